"""Material for the tests of the BRDF room: a glossy reflectance in closed form, and pairs of directions."""

import numpy as np

from bvbedit.brdf.base import Brdf


class Glossy(Brdf):
    """A Gaussian lobe in tan(theta_h) that grows towards grazing, over a reddish diffuse part; reciprocal."""

    reciprocal = True

    def __init__(self, width: float = 0.1) -> None:
        self.width = width

    def _evaluate(self, wi: np.ndarray, wo: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        h = wi + wo
        tangent2 = (h[:, 0] ** 2 + h[:, 1] ** 2) / np.maximum(h[:, 2], 1e-3) ** 2
        lobe = np.exp(-tangent2 / self.width**2) / (np.pi * self.width**2)
        grazing = 0.2 + 0.8 * (1 - 0.5 * np.linalg.norm(h, axis=1)) ** 5
        f = np.array([0.09, 0.03, 0.01]) + (lobe * grazing)[:, None] * np.array([1.0, 0.9, 0.7])
        return f, np.ones(len(f), dtype=bool)


def random_pairs(rng: np.random.Generator, count: int, highest: float = np.pi / 2) -> tuple[np.ndarray, np.ndarray]:
    """Return pairs of unit vectors, uniform over the cap of elevations up to ``highest`` (radians)."""
    z = rng.uniform(np.cos(highest), 1.0, (2, count))
    phi = rng.uniform(0, 2 * np.pi, (2, count))
    s = np.sqrt(1 - z * z)
    wi, wo = np.stack([s * np.cos(phi), s * np.sin(phi), z], axis=-1)
    return wi, wo


def turned(w: np.ndarray, angle: float | np.ndarray) -> np.ndarray:
    """Return ``w`` (n, 3) rotated about the normal."""
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * w[:, 0] - s * w[:, 1], s * w[:, 0] + c * w[:, 1], w[:, 2]], axis=-1)


def nearby(rng: np.random.Generator, w: np.ndarray, count: int, radius: float) -> np.ndarray:
    """Return ``count`` unit vectors within ``radius`` of the unit vector ``w`` (3,), on or above the horizon."""
    step = rng.normal(size=(count, 3))
    step *= radius * rng.uniform(0, 1, (count, 1)) / np.linalg.norm(step, axis=1, keepdims=True)
    out = w + step
    out[:, 2] = np.abs(out[:, 2])
    return out / np.linalg.norm(out, axis=1, keepdims=True)
