"""Fresnel reflectance over cos theta_d = wi.h: Schlick's approximation and the exact formula for a smooth interface."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from bvbedit.brdf.analytic.common import Colour, colour
from bvbedit.brdf.geometry import Floats
from bvbedit.errors import BvbError
from bvbedit.spline.arguments import shown


class Fresnel(ABC):
    """Reflectance in [0, 1] of a smooth interface."""

    @abstractmethod
    def __call__(self, cos_d: Floats) -> Floats:
        """Return F (n, 3) for the cosines (n,) in [0, 1] of the angle of incidence."""


@dataclass(frozen=True)
class Schlick(Fresnel):
    """F = f0 + (1 - f0)(1 - cos theta_d)^5, with f0 the colour at normal incidence.

    Schlick, "An inexpensive BRDF model for physically-based rendering", Computer Graphics Forum 13(3), 1994.
    Raises BvbError for f0 outside [0, 1].
    """

    f0: Colour

    def __post_init__(self) -> None:
        object.__setattr__(self, "f0", colour("Schlick", "f0", self.f0, 0.0, 1.0))

    def __call__(self, cos_d: Floats) -> Floats:
        f0 = np.asarray(self.f0)
        remaining = 1 - cos_d
        squared = remaining * remaining
        return np.asarray(f0 + (1 - f0) * (squared * squared * remaining)[:, None])


@dataclass(frozen=True)
class ExactFresnel(Fresnel):
    """F of unpolarised light on an interface with the complex relative refractive index eta + i k; k = 0: a dielectric.

    The real form of Fresnel's formulas, e.g. Cook & Torrance 1982 (k = 0) and PBRT (section "Fresnel reflectance"):
    with 2 a^2 = sqrt((eta^2 - k^2 - sin^2)^2 + 4 eta^2 k^2) + eta^2 - k^2 - sin^2.
    Raises BvbError for eta outside [0.01, 100] or k outside [0, 100].
    """

    eta: Colour
    k: Colour = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "eta", colour("ExactFresnel", "eta", self.eta, 0.01, 100.0))
        object.__setattr__(self, "k", colour("ExactFresnel", "k", self.k, 0.0, 100.0))

    def __call__(self, cos_d: Floats) -> Floats:
        F = np.empty((len(cos_d), 3))
        constants = list(zip(tuple(np.atleast_1d(self.eta)), tuple(np.atleast_1d(self.k)), strict=True))
        for c, (eta, k) in enumerate(constants):
            # A colourless interface is computed once.
            F[:, c] = F[:, 0] if c and constants[c] == constants[0] else _exact(cos_d, float(eta), float(k))
        return F


def _exact(cos_d: Floats, eta: float, k: float) -> Floats:
    # eta = 1, k = 0 leaves 0/0 at cos = 0: the floor makes it 0.
    c = np.maximum(cos_d, 1e-9)
    c2 = c * c
    s2 = 1 - c2
    t = eta * eta - k * k - s2
    a2b2 = np.hypot(t, 2 * eta * k)
    two_ac = np.sqrt(2 * np.maximum(a2b2 + t, 0)) * c
    Rs = (a2b2 + c2 - two_ac) / (a2b2 + c2 + two_ac)
    p, q = c2 * a2b2 + s2 * s2, two_ac * s2
    Rp = Rs * (p - q) / (p + q)
    return np.asarray(np.clip(0.5 * (Rs + Rp), 0, 1))


def checked_fresnel(model: str, value: object) -> None:
    """Raise BvbError unless ``value`` is a Fresnel term."""
    if not isinstance(value, Fresnel):
        raise BvbError(f"{model}: fresnel is {shown(value)}. Give Schlick(f0) or ExactFresnel(eta, k).")
