"""How noisy a measurement is, told by what it measured more than once: a material is the same for all of these pairs.

Mirror images are one pair of directions to a bilaterally symmetric material, exchanged pairs to a reciprocal one, and
all azimuths to an isotropic one where the half vector is the normal (theta_h = 0: MERL measures it 180 times over).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.geometry import spherical
from bvbedit.brdf.losses import Loss
from bvbedit.brdf.problem import MIRROR, tells_mirrored
from bvbedit.brdf.sample_sets import HIGHEST_ELEVATION, LARGEST_REFLECTANCE, draw

PAIRS, SEED = 8_000, 4
# At theta_h = 0: so many angles theta_d, and azimuths of each.
ANGLES, AZIMUTHS = 40, 90


@dataclass(frozen=True)
class Noise:
    """Standard deviations of T of a single measurement; zero where nothing was measured twice."""

    grid: float
    """Over the set ``grid``."""
    nodes: float
    """Over the set ``nodes``."""
    pole: float
    """At theta_h = 0, below 80 degrees."""

    def to_dict(self) -> dict[str, Any]:
        """Return the figures with three digits."""
        return {name: float(f"{value:.3g}") for name, value in vars(self).items()}


def estimate_noise(brdf: Brdf, loss: Loss) -> Noise:
    """Return how much T, in which the metric counts errors, differs between pairs that a material cannot tell apart.

    What a material really does to break these symmetries counts as noise too: no folded chart can represent it.
    """
    pairs = draw(brdf, PAIRS, SEED)
    cosines = pairs.wi[:, 2:], pairs.wo[:, 2:]
    alike = [(pairs.wi, pairs.wo)]
    if tells_mirrored(brdf):
        alike += [(pairs.wi * MIRROR, pairs.wo * MIRROR)]
    if not brdf.reciprocal:
        alike += [(o, i) for i, o in alike]
    looked = [brdf.evaluate_unit(i, o) for i, o in alike]
    trusted = np.all([t for _, t in looked], axis=0)
    values = np.stack([loss.transform(np.minimum(f, LARGEST_REFLECTANCE), *cosines) for f, _ in looked])
    variance = values.var(axis=0, ddof=1) if len(alike) > 1 else np.zeros_like(values[0])
    parts = [variance[part][trusted[part]] for part in pairs.parts()]
    grid, nodes = (float(np.sqrt(v.mean())) if v.size else 0.0 for v in parts)
    return Noise(grid, nodes, _at_pole(brdf, loss))


def _at_pole(brdf: Brdf, loss: Loss) -> float:
    theta = np.linspace(0, HIGHEST_ELEVATION, ANGLES + 1)[1:]
    phi = np.arange(AZIMUTHS) * (np.pi / AZIMUTHS)
    wi = spherical(theta[:, None], phi).reshape(-1, 3)
    f, trusted = brdf.evaluate_unit(wi, wi * np.array([-1.0, -1.0, 1.0]))
    t = loss.transform(np.minimum(f, LARGEST_REFLECTANCE), wi[:, 2:], wi[:, 2:]).reshape(ANGLES, AZIMUTHS, 3)
    whole = trusted.reshape(ANGLES, AZIMUTHS).all(axis=1)
    return float(np.sqrt(t[whole].var(axis=1, ddof=1).mean())) if whole.any() else 0.0
