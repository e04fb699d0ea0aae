"""What every BRDF can do: be evaluated, and say where its values can be believed."""

from abc import ABC, abstractmethod
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from bvbedit.brdf.density import Density
from bvbedit.brdf.geometry import Bools, Floats, unit_directions
from bvbedit.errors import BvbError
from bvbedit.spline.arguments import real_array, shown

NORMAL = np.array([0.0, 0.0, 1.0])
# Pairs evaluated at once. Large enough to keep every thread busy, small enough that the temporaries of a
# million-pixel picture stay within tens of megabytes.
BLOCK = 1 << 18


class Brdf(ABC):
    """A bidirectional reflectance distribution function f_r(wi, wo) in 1/sr, linear RGB, without the cosine.

    A subclass implements ``_evaluate`` on unit vectors; arguments are checked here, once.
    """

    # Beyond this angle from the normal (radians) a value is extrapolation and must carry no weight in a fit.
    reliable_elevation: float = float(np.radians(89.0))
    # Whether f(wi, wo) = f(wo, wi) by construction, so that a folded chart need not average the two.
    reciprocal: bool = False
    # How many places were measured: between them values are interpolated, noise and all. None where there is no noise.
    readings: int | None = None

    @abstractmethod
    def _evaluate(self, wi: Floats, wo: Floats) -> tuple[Floats, Bools]:
        """Return f (n, 3) and whether data stand behind it (n,), for unit vectors (n, 3) on or above the horizon."""

    def evaluate(self, wi: ArrayLike, wo: ArrayLike) -> Floats:
        """Return f_r (..., 3) in 1/sr for directions (..., 3), zero where either lies below the horizon.

        The directions are broadcast against one another and need not be normalised.
        Raises BvbError for directions that are zero, nan, infinite or not (..., 3).
        """
        return self.evaluate_trusted(wi, wo)[0]

    def evaluate_trusted(self, wi: ArrayLike, wo: ArrayLike) -> tuple[Floats, Bools]:
        """Return ``evaluate(wi, wo)`` (..., 3) and a mask (...): false where no data stand behind the value.

        False are invalid cells of a measurement, elevations beyond ``reliable_elevation``, and below the horizon.
        """
        wi, wo = _pairs(wi, wo)
        shape = wi.shape[:-1]
        f, trusted = self.evaluate_unit(wi.reshape(-1, 3), wo.reshape(-1, 3))
        return f.reshape(*shape, 3), trusted.reshape(shape)

    @cached_property
    def density(self) -> Density:
        """What directions of light are drawn by: near f cos theta_i, and never zero where that is not."""
        from bvbedit.brdf.sampling import half_vector_density

        return half_vector_density(self)

    def sample(self, wo: ArrayLike, u: ArrayLike) -> tuple[Floats, Floats, Floats]:
        """Return directions of light wi (..., 3) drawn for ``wo`` (..., 3), their density (...), and weights (..., 3).

        ``u`` (..., 2) are numbers in [0, 1), broadcast against ``wo``. The density is over solid angle, in 1/sr; the
        weight is f cos theta_i over it, so that its mean over many u is the albedo. Where a sample is rejected, as half
        vectors may lead below the horizon, and where ``wo`` is there, wi = n and density and weight are zero.
        Raises BvbError as ``evaluate`` does, and for u outside [0, 1).
        """
        wo, numbers = unit_directions(wo, "wo"), real_array(u, "u")
        if numbers.ndim == 0 or numbers.shape[-1] != 2 or not ((numbers >= 0) & (numbers < 1)).all():
            raise BvbError(f"u is {shown(u)}. Give numbers (..., 2) in [0, 1).")
        try:
            shape = np.broadcast_shapes(wo.shape[:-1], numbers.shape[:-1])
        except ValueError:
            raise BvbError(f"wo {wo.shape} and u {numbers.shape} do not broadcast. Give compatible shapes.") from None
        view = np.ascontiguousarray(np.broadcast_to(wo, (*shape, 3)).reshape(-1, 3))
        wi, density, weight = self.sample_unit(view, np.broadcast_to(numbers, (*shape, 2)).reshape(-1, 2))
        return wi.reshape(*shape, 3), density.reshape(shape), weight.reshape(*shape, 3)

    def sample_unit(self, wo: Floats, u: Floats) -> tuple[Floats, Floats, Floats]:
        """Return ``sample`` for arrays (n, 3) and (n, 2) that are known to be right; nothing is checked."""
        above = wo[:, 2] >= 0
        wi, density = self.density.sample(np.where(above[:, None], wo, NORMAL), np.ascontiguousarray(u))
        kept = above & (density > 0)
        wi[~kept], density[~kept] = NORMAL, 0.0
        weight = np.zeros((len(wo), 3))
        f = self.evaluate_unit(wi[kept], wo[kept])[0]
        weight[kept] = f * (wi[kept, 2] / density[kept])[:, None]
        return wi, density, weight

    def pdf(self, wi: ArrayLike, wo: ArrayLike) -> Floats:
        """Return the density (...) over solid angle with which ``sample`` draws ``wi`` (..., 3), given ``wo`` (..., 3).

        Zero where either lies below the horizon. Raises BvbError as ``evaluate`` does.
        """
        wi, wo = _pairs(wi, wo)
        shape = wi.shape[:-1]
        return self.pdf_unit(wi.reshape(-1, 3), wo.reshape(-1, 3)).reshape(shape)

    def pdf_unit(self, wi: Floats, wo: Floats) -> Floats:
        """Return ``pdf`` for arrays (n, 3) that are known to hold unit vectors; nothing is checked."""
        above = (wi[:, 2] > 0) & (wo[:, 2] >= 0)
        out = np.zeros(len(wi))
        out[above] = self.density.pdf(np.ascontiguousarray(wi[above]), np.ascontiguousarray(wo[above]))
        return out

    def evaluate_unit(self, wi: Floats, wo: Floats) -> tuple[Floats, Bools]:
        """Return ``evaluate_trusted`` for arrays (n, 3) that are known to hold unit vectors; nothing is checked."""
        blocks = [slice(start, start + BLOCK) for start in range(0, len(wi), BLOCK)]
        found = [self._evaluate_block(np.ascontiguousarray(wi[b]), np.ascontiguousarray(wo[b])) for b in blocks]
        if len(found) == 1:
            return found[0]
        if not found:
            return np.zeros((0, 3)), np.zeros(0, dtype=bool)
        return np.concatenate([f for f, _ in found]), np.concatenate([trusted for _, trusted in found])

    def _evaluate_block(self, wi: Floats, wo: Floats) -> tuple[Floats, Bools]:
        smaller = np.minimum(wi[:, 2], wo[:, 2])
        lowest = np.cos(self.reliable_elevation)
        above = smaller >= 0
        if above.all():
            f, backed = self._evaluate(wi, wo)
            return f, backed & (smaller >= lowest)
        f, trusted = np.zeros((len(wi), 3)), np.zeros(len(wi), dtype=bool)
        if above.any():
            f[above], backed = self._evaluate(wi[above], wo[above])
            trusted[above] = backed & (smaller[above] >= lowest)
        return f, trusted


def _pairs(wi: ArrayLike, wo: ArrayLike) -> tuple[Floats, Floats]:
    """Return both as unit vectors (..., 3) of one shape. Raises BvbError where they are none, or do not broadcast."""
    i, o = unit_directions(wi, "wi"), unit_directions(wo, "wo")
    try:
        i, o = np.broadcast_arrays(i, o)
    except ValueError:
        raise BvbError(f"wi {i.shape} and wo {o.shape} do not broadcast. Give them compatible shapes.") from None
    return i, o


def check_brdf(value: object, name: str) -> None:
    """Raise BvbError where ``value``, called ``name``, is no Brdf."""
    if not isinstance(value, Brdf):
        raise BvbError(f"{name} is {type(value).__name__}, not a Brdf. Give what load() or fit() returned.")
