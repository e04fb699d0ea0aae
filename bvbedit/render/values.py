"""How the values of a scene are checked as they are made."""

from numbers import Real

import numpy as np
from numpy.typing import ArrayLike

from bvbedit.errors import BvbError

Vector = tuple[float, float, float]


def set_fields(value: object, **fields: object) -> None:
    """Set fields of a frozen dataclass while it is being made."""
    for name, content in fields.items():
        object.__setattr__(value, name, content)


def vector(value: ArrayLike, name: str, lowest: float = -np.inf, highest: float = np.inf) -> Vector:
    """Return three finite numbers. Raises BvbError, which calls them ``name``, for others and those out of bounds."""
    try:
        v = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        v = np.empty(0)
    if v.shape != (3,) or not np.isfinite(v).all():
        raise BvbError(f"{name} is {value!r}. Give three finite numbers.")
    if v.min() < lowest or v.max() > highest:
        raise BvbError(f"{name} is {value!r}. Its components must lie in [{lowest:g}, {highest:g}].")
    return (float(v[0]), float(v[1]), float(v[2]))


def direction(value: ArrayLike, name: str) -> Vector:
    """Return a vector of length one. Raises BvbError, which calls it ``name``, for what is none or zero."""
    v = np.array(vector(value, name))
    if not v.any():
        raise BvbError(f"{name} is zero. Give a vector that points there.")
    v /= np.abs(v).max()
    return vector(v / np.linalg.norm(v), name)


def check_positive(value: float, name: str) -> None:
    """Raise BvbError, which calls it ``name``, for what is no positive finite number."""
    if not (isinstance(value, Real) and 0 < value < np.inf):
        raise BvbError(f"{name} is {value!r}. Give a positive finite number.")
