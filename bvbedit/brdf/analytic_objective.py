"""What a fit of an analytic model minimises: the product of the metric over both sample sets, and its derivatives."""

import math
from collections.abc import Sequence
from functools import cached_property
from itertools import pairwise

import numpy as np

from bvbedit.brdf.analytic.common import Pair
from bvbedit.brdf.analytic_models import Lobe
from bvbedit.brdf.geometry import Floats
from bvbedit.brdf.losses import Loss
from bvbedit.brdf.samples import Reflectance

# Albedos are searched as log(albedo + this): zero is reached, and is not infinitely far away.
DARKEST = 1e-5
# Albedos at a start: towards zero the search has no slope to climb. From 0.001 up, all starts of "ggx 2" on the gold
# paint of the six measurements ended with one lobe black.
START_ALBEDO = (0.1, 0.9)
# Step of the differences of a lobe in its scaled parameters; central ones are then right to some ten digits.
STEP = 1e-5


class Objective:
    """The logarithm of the squared error of x = log colours (1 + lobes, 3), then shapes; the mean over both sets."""

    def __init__(self, reflectance: Reflectance, lobes: Sequence[Lobe], loss: Loss, rounding: float) -> None:
        pairs = reflectance.pairs
        self.pair = Pair(pairs.wi, pairs.wo)
        self.f: Floats = np.ascontiguousarray(reflectance.f.T)
        """(3, N)."""
        self.cosines = pairs.wi[None, :, 2], pairs.wo[None, :, 2]
        self.target = loss.transform(self.f, *self.cosines)
        self.sets = [part for part in pairs.parts() if part.stop > part.start]
        self.loss, self.lobes = loss, tuple(lobes)
        size = float(np.sqrt(np.mean(self.target**2))) if self.target.size else 0.0
        self.rounding = max(rounding * size, 1e-150)

    def of(self, lobes: Sequence[Lobe]) -> "Objective":
        """Return the same objective for other lobes."""
        other = object.__new__(Objective)
        other.__dict__.update({k: v for k, v in self.__dict__.items() if k != "bounds"})
        other.lobes = tuple(lobes)
        return other

    @cached_property
    def bounds(self) -> tuple[Floats, Floats]:
        """The least and the largest x: albedos from 0 to 1."""
        colours = 3 * (1 + len(self.lobes))
        each = [lobe.bounds for lobe in self.lobes]
        low = np.concatenate([np.full(colours, math.log(DARKEST)), *(a for a, _ in each)])
        return low, np.concatenate([np.full(colours, math.log1p(DARKEST)), *(b for _, b in each)])

    def parts_of(self, x: Floats) -> tuple[Floats, list[Floats]]:
        """Return colours (1 + lobes, 3) and the shapes of each lobe."""
        colours = 3 * (1 + len(self.lobes))
        ends = np.cumsum([colours, *(len(lobe.names) for lobe in self.lobes)])
        shapes = [x[a:b] for a, b in pairwise(ends)]
        return np.clip(np.exp(x[:colours]) - DARKEST, 0.0, 1.0).reshape(-1, 3), shapes

    def basis(self, shapes: Sequence[Floats]) -> Floats:
        """Return what the colours are multiplied by (1 + lobes, N)."""
        rows = [np.full(len(self.pair), 1 / np.pi)]
        rows += [lobe.lobe(self.pair, x) for lobe, x in zip(self.lobes, shapes, strict=True)]
        return np.stack(rows)

    def __call__(self, x: Floats, slopes: Floats) -> float:
        """Return the value at ``x`` and write its derivatives into ``slopes``, unless that is empty."""
        colours, shapes = self.parts_of(x)
        basis = self.basis(shapes)
        f = colours.T @ basis
        error = self.loss.transform(f, *self.cosines) - self.target
        power = self.loss.power
        # Powers below 2 have a cusp at zero, which is rounded off.
        squared = error * error + self.rounding**2
        size = squared if power == 2 else squared ** (power / 2)
        means = [float(size[:, part].mean()) for part in self.sets]
        value = float(np.mean(np.log(means)))
        if slopes.size and math.isfinite(value):
            slope = power * error if power == 2 else power * error * size / squared
            slope *= self.loss.slope(f, *self.cosines)
            for part, mean in zip(self.sets, means, strict=True):
                slope[:, part] /= len(self.sets) * mean * 3 * (part.stop - part.start)
            slopes[: colours.size] = ((basis @ slope.T) * (colours + DARKEST)).reshape(-1)
            place = colours.size
            for lobe, own, colour in zip(self.lobes, shapes, colours[1:], strict=True):
                weighted = colour @ slope
                for k in range(len(own)):
                    step = np.zeros(len(own))
                    step[k] = STEP
                    change = lobe.lobe(self.pair, own + step) - lobe.lobe(self.pair, own - step)
                    slopes[place] = weighted @ change / (2 * STEP)
                    place += 1
        # The error itself, whatever the power, squared.
        return value * (2 / power) if power != 2 else value

    def metrics(self, x: Floats) -> tuple[float, float]:
        """Return the metric over each of the sets; a set without data is spoken for by the other one."""
        colours, shapes = self.parts_of(x)
        f = colours.T @ self.basis(shapes)
        error = self.loss.transform(f, *self.cosines) - self.target
        found = [self.loss.metric(self.loss.norm(error[:, part]), self.target[:, part]) for part in self.sets]
        return float(found[0]), float(found[-1])

    def coloured(self, shapes: Sequence[Floats]) -> Floats:
        """Return x of the colours that are nearest to the material by least squares, weighted as the metric has it."""
        basis = self.basis(shapes)
        weight = self.loss.slope(self.f, *self.cosines)
        colours = np.empty((len(basis), 3))
        for c in range(3):
            rows = basis * weight[c]
            normal = rows @ rows.T
            normal[np.diag_indices(len(basis))] *= 1 + 1e-6
            normal[np.diag_indices(len(basis))] += np.finfo(float).tiny
            colours[:, c] = np.linalg.solve(normal, rows @ (weight[c] * self.f[c]))
        inside = np.clip(np.nan_to_num(colours), *START_ALBEDO)
        return np.concatenate([np.log(inside + DARKEST).reshape(-1), *shapes])
