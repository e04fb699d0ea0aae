"""What the analytic models share: checked parameters, and the angles of a pair of directions."""

from abc import abstractmethod
from collections.abc import Sequence
from functools import cached_property
from numbers import Real

import numpy as np

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.density import Density
from bvbedit.brdf.geometry import Bools, Floats
from bvbedit.errors import BvbError
from bvbedit.spline.arguments import is_real_within, shown

Colour = float | Sequence[float]
"""One number for all three channels, or three numbers (linear RGB)."""

# Cosines of elevations are not taken below this value, so that the lobes' 1/cos and 1/cos^2 end in a large number
# instead of infinity, and h = n where wi = -wo. It is a hundredth of the 1e-4 rad to which the paper's grid is capped.
COS_FLOOR = 1e-6

# Roughness (alpha, Beckmann's m) is the root mean square slope, up to a factor: 1e-4 makes a lobe twenty times narrower
# than the disc of the sun, 2 a surface of slopes beyond 60 degrees.
ROUGHNESS = (1e-4, 2.0)


# Share of the samples of a model with a lobe and a diffuse part that is drawn by the cosine.
DIFFUSE_SHARE = 0.3


class Pair:
    """The angles of n pairs of unit vectors on or above the horizon that the models are made of, each computed once.

    h = (wi + wo)/|wi + wo|, and since |wi + wo| = 2 cos theta_d nothing here is the difference of nearly equal numbers:
    sin and tan of theta_h come from the horizontal part of wi + wo and keep their digits in the narrowest lobe.
    """

    def __init__(self, wi: Floats, wo: Floats) -> None:
        self.xi, self.yi, zi = np.ascontiguousarray(wi.T)
        self.xo, self.yo, zo = np.ascontiguousarray(wo.T)
        self.cos_i: Floats = np.maximum(zi, COS_FLOOR)
        self.cos_o: Floats = np.maximum(zo, COS_FLOOR)

    def __len__(self) -> int:
        return len(self.xi)

    @cached_property
    def horizontal(self) -> Floats:
        """The dot product of the horizontal parts of wi and wo."""
        return np.asarray(self.xi * self.xo + self.yi * self.yo)

    @cached_property
    def sum_xy2(self) -> Floats:
        """The square of the horizontal part of wi + wo."""
        return np.asarray((self.xi + self.xo) ** 2 + (self.yi + self.yo) ** 2)

    @cached_property
    def sum_z(self) -> Floats:
        return self.cos_i + self.cos_o

    @cached_property
    def sum2(self) -> Floats:
        """|wi + wo|^2."""
        return self.sum_xy2 + self.sum_z**2

    @cached_property
    def tan2_h(self) -> Floats:
        return self.sum_xy2 / self.sum_z**2

    @cached_property
    def sin2_h(self) -> Floats:
        return self.sum_xy2 / self.sum2

    @cached_property
    def cos2_h(self) -> Floats:
        return np.asarray(self.sum_z**2 / self.sum2)

    @cached_property
    def cos_d(self) -> Floats:
        """wi.h = wo.h."""
        return np.minimum(0.5 * np.sqrt(self.sum2), 1.0)

    def refracted(self, eta: float) -> "Pair":
        """Return the pair as it runs inside a layer of relative refractive index ``eta`` (Snell's law)."""
        inside = object.__new__(Pair)
        inside.xi, inside.yi, inside.xo, inside.yo = (a / eta for a in (self.xi, self.yi, self.xo, self.yo))
        # From z itself where the layer does not bend, from the horizontal part where it does.
        inside.cos_i = np.sqrt(1 - (1 - self.cos_i**2) / eta**2)
        inside.cos_o = np.sqrt(1 - (1 - self.cos_o**2) / eta**2)
        return inside


class Analytic(Brdf):
    """A BRDF in closed form. A subclass implements ``reflectance`` on pairs whose angles all parts of a sum share."""

    reciprocal = True

    @property
    @abstractmethod
    def density(self) -> Density:
        """The density of the model's own lobes."""

    @abstractmethod
    def reflectance(self, pair: Pair) -> Floats:
        """Return f_r (n, 3) in 1/sr, finite and not negative; nothing is checked."""

    def _evaluate(self, wi: Floats, wo: Floats) -> tuple[Floats, Bools]:
        return self.reflectance(Pair(wi, wo)), np.ones(len(wi), dtype=bool)


def colour(model: str, name: str, value: Colour, low: float, high: float) -> tuple[float, float, float]:
    """Return ``value`` as three numbers. Raises BvbError unless all are finite and within [low, high]."""
    try:
        numbers = (value,) * 3 if isinstance(value, Real) else tuple(value)  # type: ignore[arg-type]
    except TypeError:
        numbers = ()
    if len(numbers) != 3 or not all(is_real_within(v, low, high) for v in numbers):
        raise BvbError(f"{model}: {name} is {shown(value)}. Give one number or three (RGB) from {low:g} to {high:g}.")
    return float(numbers[0]), float(numbers[1]), float(numbers[2])


def number(model: str, name: str, value: float, low: float, high: float) -> float:
    """Return ``value`` as a float. Raises BvbError unless it is a number within [low, high]."""
    if not is_real_within(value, low, high):
        raise BvbError(f"{model}: {name} is {shown(value)}. Give a number from {low:g} to {high:g}.")
    return float(value)
