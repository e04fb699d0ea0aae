"""What every BRDF can do: be evaluated, and say where its values can be believed."""

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import ArrayLike

from bvbedit.brdf.geometry import Bools, Floats, unit_directions
from bvbedit.errors import BvbError

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
        wi, wo = unit_directions(wi, "wi"), unit_directions(wo, "wo")
        try:
            wi, wo = np.broadcast_arrays(wi, wo)
        except ValueError:
            raise BvbError(f"wi {wi.shape} and wo {wo.shape} do not broadcast. Give them compatible shapes.") from None
        shape = wi.shape[:-1]
        f, trusted = self.evaluate_unit(wi.reshape(-1, 3), wo.reshape(-1, 3))
        return f.reshape(*shape, 3), trusted.reshape(shape)

    def evaluate_unit(self, wi: Floats, wo: Floats) -> tuple[Floats, Bools]:
        """Return ``evaluate_trusted`` for arrays (n, 3) that are known to hold unit vectors; nothing is checked."""
        f = np.zeros((len(wi), 3))
        trusted = np.zeros(len(wi), dtype=bool)
        lowest = np.cos(self.reliable_elevation)
        for start in range(0, len(wi), BLOCK):
            block = slice(start, start + BLOCK)
            i, o = np.ascontiguousarray(wi[block]), np.ascontiguousarray(wo[block])
            smaller = np.minimum(i[:, 2], o[:, 2])
            above = smaller >= 0
            if above.all():
                f[block], backed = self._evaluate(i, o)
                trusted[block] = backed & (smaller >= lowest)
            elif above.any():
                f[block][above], backed = self._evaluate(i[above], o[above])
                trusted[block][above] = backed & (smaller[above] >= lowest)
        return f, trusted


def check_brdf(value: object, name: str) -> None:
    """Raise BvbError where ``value``, called ``name``, is no Brdf."""
    if not isinstance(value, Brdf):
        raise BvbError(f"{name} is {type(value).__name__}, not a Brdf. Give what load() or fit() returned.")
