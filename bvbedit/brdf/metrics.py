"""How far one BRDF is from another: the error metrics over fixed sets of pairs of directions.

c = cos theta_i cos theta_o; natural logarithms; plain means over samples and channels.
"""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from bvbedit.brdf.base import BLOCK, Brdf, check_brdf
from bvbedit.brdf.geometry import Floats, spherical
from bvbedit.brdf.sample_sets import HIGHEST_ELEVATION, HORIZON_MARGIN, LARGEST_REFLECTANCE, MARGIN, draw, node_blocks
from bvbedit.errors import BvbError
from bvbedit.spline.arguments import is_whole, shown

# Each meets 45 degrees, and both ends of every axis of the paper's grid.
STRIDES = (1, 3, 5, 9, 15, 45)


@dataclass(frozen=True)
class Errors:
    """Metrics over one set of samples; all are zero for equal BRDFs."""

    log_cosine_rms: float
    """sqrt(mean (log(1 + a c) - log(1 + b c))^2)."""
    fores: float
    """sqrt(mean cbrt(((a - b) cos theta_i)^2)), the simple metric that correlates best (Fores et al. 2012)."""
    relative_l1: float
    """sum |a - b| / sum |b| of RGB vector lengths."""
    samples: int


@dataclass(frozen=True)
class PaperErrors:
    """Euclidean RGB distance over the 91 x 91 x 361 nodes of Lee & Park (2008), equation 7, in 1/sr."""

    e_max: float
    e_avg: float
    e_max_45: float
    """At theta_i = 45 degrees alone (Fig. 5)."""
    e_avg_45: float


@dataclass(frozen=True)
class Comparison:
    """The distance of a from b over the paper's grid up to 80 degrees, over MERL's nodes, and as the paper has it."""

    grid: Errors
    nodes: Errors
    paper: PaperErrors

    def to_dict(self) -> dict[str, Any]:
        """Return the figures nested by name."""
        return asdict(self)


def _lengths(v: Floats) -> Floats:
    """Return the lengths (n,) of ``v`` (n, 3), whose squares may leave the range of float64."""
    return np.asarray(np.hypot(np.hypot(v[:, 0], v[:, 1]), v[:, 2]))


class _Sums:
    """Running sums of one sample set, so that millions of samples need no more memory than a block."""

    def __init__(self) -> None:
        self.squared = self.roots = self.difference = self.length = 0.0
        self.samples = 0

    def add(self, a: Floats, b: Floats, cos_i: Floats, cos_o: Floats) -> None:
        c = (cos_i * cos_o)[:, None]
        self.squared += float(np.sum((np.log1p(a * c) - np.log1p(b * c)) ** 2))
        self.roots += float(np.sum(np.cbrt((a - b) * cos_i[:, None]) ** 2))
        self.difference += float(np.sum(_lengths(a - b)))
        self.length += float(np.sum(_lengths(b)))
        self.samples += len(a)

    def errors(self) -> Errors:
        values = max(3 * self.samples, 1)
        relative = self.difference / self.length if self.length > 0 else (0.0 if self.difference == 0 else np.inf)
        return Errors(np.sqrt(self.squared / values), np.sqrt(self.roots / values), relative, self.samples)


def compare(a: Brdf, b: Brdf, *, stride: int = 1, progress: Callable[[float], None] | None = None) -> Comparison:
    """Return the distance of ``a`` from the reference ``b``.

    The nodes are the valid ones of ``b`` where it is a MERL table, else all MERL nodes with phi_d in steps of 2
    degrees; both elevations under 80 degrees. A ``stride`` (a divisor of 45) takes every so many-th node of each axis
    only: 5 is a hundred times quicker and tells the means to a few percent. ``progress`` is called with the share done.
    Raises BvbError for another stride, and what is no Brdf.
    """
    check_brdf(a, "a")
    check_brdf(b, "b")
    if not is_whole(stride) or stride not in STRIDES:
        raise BvbError(f"stride is {shown(stride)}. Choose one of {', '.join(map(str, STRIDES))}.")
    grid, nodes = _Sums(), _Sums()
    theta = _elevations(stride)
    blocks = list(node_blocks(b, stride))
    steps = len(theta) + len(blocks)

    def done(count: int) -> None:
        if progress is not None:
            progress(count / steps)

    paper = _paper(a, b, theta, stride, grid, done)
    for i, (wi, wo) in enumerate(blocks):
        nodes.add(a.evaluate_unit(wi, wo)[0], b.evaluate_unit(wi, wo)[0], wi[:, 2], wo[:, 2])
        done(len(theta) + i + 1)
    return Comparison(grid.errors(), nodes.errors(), paper)


def _elevations(stride: int) -> Floats:
    return np.asarray(np.minimum(np.radians(np.arange(0.0, 91.0, stride)), np.pi / 2 - HORIZON_MARGIN))


def _paper(
    a: Brdf,
    b: Brdf,
    theta: Floats,
    stride: int,
    grid: _Sums | None = None,
    done: Callable[[int], None] = lambda _: None,
) -> PaperErrors:
    """Return the paper's errors over its grid, and add those up to 80 degrees to ``grid``."""
    phi = np.radians(np.arange(0, 361, stride) * 0.5)
    wo = spherical(theta[:, None], phi).reshape(-1, 3)
    low_o = np.repeat(theta <= HIGHEST_ELEVATION + MARGIN, len(phi))
    distances = np.empty((len(theta), 2))
    # Several elevations at once: a call for each would cost more than its pairs.
    together = max(1, BLOCK // len(wo))
    for start in range(0, len(theta), together):
        lights = spherical(theta[start : start + together], np.zeros(1))
        wi_all, wo_all = np.repeat(lights, len(wo), axis=0), np.tile(wo, (len(lights), 1))
        fa, fb = a.evaluate_unit(wi_all, wo_all)[0], b.evaluate_unit(wi_all, wo_all)[0]
        difference = np.minimum(fa, LARGEST_REFLECTANCE) - np.minimum(fb, LARGEST_REFLECTANCE)
        length = np.linalg.norm(difference, axis=1).reshape(len(lights), -1)
        distances[start : start + together, 0] = length.max(axis=1)
        distances[start : start + together, 1] = length.mean(axis=1)
        if grid is not None:
            counted = np.repeat(theta[start : start + together] <= HIGHEST_ELEVATION + MARGIN, len(wo))
            counted &= np.tile(low_o, len(lights))
            if counted.any():
                grid.add(fa[counted], fb[counted], wi_all[counted, 2], wo_all[counted, 2])
        done(start + len(lights))
    return PaperErrors(
        float(distances[:, 0].max()), float(distances[:, 1].mean()), *(float(e) for e in distances[45 // stride])
    )


def estimate(a: Brdf, b: Brdf, pairs: int = 50_000, seed: int = 3, stride: int = STRIDES[2]) -> Comparison:
    """Return about what ``compare`` does, from so many pairs of each set drawn at random, in a fraction of a second.

    Where rare pairs decide, as at grazing mirror directions, it is uncertain by much. The paper's errors are those of
    every fifth node of each axis, or those that ``stride`` says. ``seed`` chooses the pairs.
    """
    drawn = draw(b, pairs, seed)
    fa, fb = a.evaluate_unit(drawn.wi, drawn.wo)[0], b.evaluate_unit(drawn.wi, drawn.wo)[0]
    found = []
    for part in drawn.parts():
        sums = _Sums()
        sums.add(fa[part], fb[part], drawn.wi[part, 2], drawn.wo[part, 2])
        found.append(sums.errors())
    return Comparison(found[0], found[1], _paper(a, b, _elevations(stride), stride))


def lengths_on_grid(b: Brdf, stride: int = 1) -> tuple[float, float]:
    """Return the largest and the mean length of the RGB vector of ``b`` over the paper's nodes, in 1/sr."""
    from bvbedit.brdf.analytic import Lambert

    # The distance from what reflects nothing.
    errors = _paper(Lambert((0.0, 0.0, 0.0)), b, _elevations(stride), stride)
    return errors.e_max, errors.e_avg
