"""The error metrics as a fit sees them: what an error counts, and which weight least squares must give it."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from bvbedit.brdf.geometry import Floats
from bvbedit.errors import BvbError
from bvbedit.spline.arguments import shown

# Before there is a fit an error is taken to be this share of the value.
EXPECTED = 0.01
# Errors below this share of the mean one count as so large: powers below 2 would else give them all the weight.
SMALLEST_SHARE = 0.1


@dataclass(frozen=True)
class Loss(ABC):
    """mean |T(a) - T(b)|^power over samples and channels, T depending on the cosines of the directions' elevations.

    To first order that is least squares on the encoded value y with the weight (T'(f) f'(y))^2, times |error|^(power -
    2) where the power is not 2 (iteratively reweighted least squares).
    """

    name: str
    power: float

    @abstractmethod
    def transform(self, f: Floats, cos_i: Floats, cos_o: Floats) -> Floats:
        """Return T (..., 3) of reflectance ``f`` (..., 3), cosines (..., 1)."""

    @abstractmethod
    def slope(self, f: Floats, cos_i: Floats, cos_o: Floats) -> Floats:
        """Return dT/df (..., 3)."""

    def norm(self, error: Floats) -> float:
        """Return (mean |error|^power)^(1/2), the metric but for its scale."""
        return float(np.sqrt(np.mean(error * error if self.power == 2 else np.abs(error) ** self.power)))

    def metric(self, norm: float, target: Floats) -> float:
        """Return the metric itself for a ``norm`` of errors from ``target`` (N, 3), the true T."""
        return norm

    def reweighting(self, error: Floats, mean: float | None = None) -> Floats:
        """Return |error|^(power - 2) of errors of T, relative to that of their ``mean`` size; ones for the power 2."""
        if self.power == 2:
            return np.ones_like(error)
        size = np.abs(error)
        mean = max(float(size.mean()) if mean is None else mean, np.finfo(float).tiny)
        return np.asarray(np.maximum(size / mean, SMALLEST_SHARE) ** (self.power - 2))

    def expected(self, f: Floats, cos_i: Floats, cos_o: Floats) -> Floats:
        """Return the errors of T to expect before there is a fit."""
        return EXPECTED * self.transform(f, cos_i, cos_o)


@dataclass(frozen=True)
class LogCosine(Loss):
    """T = log(1 + f cos theta_i cos theta_o), squared."""

    name: str = "log_cosine_rms"
    power: float = 2.0

    def transform(self, f: Floats, cos_i: Floats, cos_o: Floats) -> Floats:
        return np.log1p(f * (cos_i * cos_o))

    def slope(self, f: Floats, cos_i: Floats, cos_o: Floats) -> Floats:
        c = cos_i * cos_o
        return np.asarray(c / (1.0 + f * c))


@dataclass(frozen=True)
class Fores(Loss):
    """T = f cos theta_i, to the power 2/3 (Fores et al. 2012)."""

    name: str = "fores"
    power: float = 2 / 3

    def transform(self, f: Floats, cos_i: Floats, cos_o: Floats) -> Floats:
        return np.asarray(f * cos_i)

    def slope(self, f: Floats, cos_i: Floats, cos_o: Floats) -> Floats:
        return np.broadcast_to(cos_i, f.shape)


class Plain(Loss):
    """T = f."""

    def transform(self, f: Floats, cos_i: Floats, cos_o: Floats) -> Floats:
        return f

    def slope(self, f: Floats, cos_i: Floats, cos_o: Floats) -> Floats:
        return np.ones_like(f)


@dataclass(frozen=True)
class RelativeL1(Plain):
    """Absolute differences; the metric takes lengths of RGB vectors, this the sum of their components."""

    name: str = "relative_l1"
    power: float = 1.0

    def metric(self, norm: float, target: Floats) -> float:
        mean = float(np.mean(np.abs(target))) if target.size else 0.0
        return norm**2 / mean if mean > 0 else norm**2


@dataclass(frozen=True)
class Distance(Plain):
    """Squares of the distances E of Lee & Park (2008), eq. 7, whose highlights count above all else."""

    name: str = "e_rms"
    power: float = 2.0


@dataclass(frozen=True)
class PictureError(Loss):
    """T = 2 scale sqrt(f + mean), squared: what a picture is off by, which sums f times light over all directions.

    For errors e of f about as large as some g, (sum of light e)^2 <= (sum of light g) (sum of light e^2 / g) is nearly
    an equality (Cauchy, Schwarz). A model's errors grow with f, but do not vanish with it: g = f + ``mean``. With e
    itself counted alike everywhere, a highlight took all the weight: of chrome pixels were 188/255 off.
    """

    name: str = "picture_rms"
    power: float = 2.0
    mean: float = 1.0
    """The mean of f over the light."""
    scale: float = 1.0

    def transform(self, f: Floats, cos_i: Floats, cos_o: Floats) -> Floats:
        return np.asarray(2 * self.scale * np.sqrt(f + self.mean))

    def slope(self, f: Floats, cos_i: Floats, cos_o: Floats) -> Floats:
        return np.asarray(self.scale / np.sqrt(f + self.mean))


LOSSES: dict[str, Loss] = {loss.name: loss for loss in (LogCosine(), Fores(), RelativeL1(), Distance())}


def loss_named(name: str) -> Loss:
    """Return the loss of the metric called ``name``. Raises BvbError that lists the names where there is none."""
    if not isinstance(name, str) or name not in LOSSES:
        raise BvbError(f"Unknown metric {shown(name)}. Choose one of {', '.join(LOSSES)}.")
    return LOSSES[name]
