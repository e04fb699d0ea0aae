"""What callers hand over, taken in at the public doors: arrays of real numbers, whole numbers, one thing per axis."""

from collections.abc import Iterable
from numbers import Integral, Real
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from bvbedit.errors import BvbError

# Longer values are cut in messages, which are one line.
LONGEST_SHOWN = 80


def shown(value: object) -> str:
    """Return ``value`` as a message quotes it: in one line, however large it is."""
    text = " ".join(repr(value).split())
    return text if len(text) <= LONGEST_SHOWN else text[:LONGEST_SHOWN] + " ..."


def real_array(value: object, name: str, dtype: type = np.float64) -> NDArray[Any]:
    """Return ``value`` as an array of ``dtype``, itself if it is one.

    Raises BvbError for texts, complex numbers, rows of unequal length, and numbers beyond float64.
    """
    try:
        array = np.asarray(value)
        if array.dtype.kind in "biufO":
            return array.astype(dtype, copy=False)
    except (TypeError, ValueError, OverflowError):
        pass
    raise BvbError(f"{name}: {shown(value)} is no array of real numbers. Give numbers, in rows of equal length.")


def one_per_axis(value: object, name: str) -> tuple[Any, ...]:
    """Return ``value`` as a tuple. Raises BvbError where it is no row of things."""
    if not isinstance(value, Iterable) or (isinstance(value, np.ndarray) and value.ndim == 0):
        raise BvbError(f"{name}: {shown(value)} is no list. Give one entry for each axis.")
    return tuple(value)


def is_whole(value: object) -> TypeGuard[int]:
    """Return whether ``value`` is a whole number of any integer type; True and False are none."""
    return isinstance(value, Integral) and not isinstance(value, bool)


def is_real_within(value: object, low: float, high: float) -> TypeGuard[float]:
    """Return whether ``value`` is a real number within [low, high]; True, False and nan are none."""
    return isinstance(value, Real) and not isinstance(value, bool) and bool(low <= value <= high)  # type: ignore[operator]
