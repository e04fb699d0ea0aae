"""What a page has sent: any value at all, of which what was meant is taken, or something else in its place."""

from collections.abc import Collection
from typing import Any, TypeVar

import numpy as np

T = TypeVar("T")


def real(value: Any, otherwise: float, low: float = -np.inf, high: float = np.inf) -> float:
    """Return a finite number, brought between ``low`` and ``high``, or another one where none was sent."""
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        return otherwise
    return float(min(max(number, low), high)) if np.isfinite(number) else otherwise


def whole(value: Any, otherwise: int, low: int, high: int) -> int:
    """Return a whole number, brought between ``low`` and ``high``, or another one where none was sent."""
    return int(real(value, otherwise, low, high))


def one_of(value: Any, known: Collection[T], otherwise: T) -> T:
    """Return a value that is known, or another one in the place of one that is not."""
    # Compared one by one: lists and objects cannot be looked up.
    return next((k for k in known if type(k) is type(value) and k == value), otherwise)
