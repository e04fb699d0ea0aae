"""From linear radiance to what a screen shows."""

from numbers import Real

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bvbedit.errors import BvbError

MAX_STOPS = 64.0


def linear_picture(picture: ArrayLike, name: str) -> NDArray[np.floating]:
    """Return ``picture`` as an array (h, w, 3) of floats. Raises BvbError for another shape, nan or infinity."""
    p = np.asarray(picture)
    if p.ndim != 3 or p.shape[-1] != 3 or p.size == 0 or p.dtype.kind != "f":
        raise BvbError(f"{name} is {p.dtype} of shape {p.shape}. Give a linear picture: floats (height, width, 3).")
    if not np.isfinite(p).all():
        raise BvbError(f"{name} has values that are nan or infinite. Clean it first.")
    return p


def tone_map(picture: ArrayLike, exposure: float = 0.0) -> NDArray[np.uint8]:
    """Return a linear picture (h, w, 3) as 8-bit sRGB (IEC 61966-2-1): times 2^exposure, clipped to [0, 1], rounded.

    ``exposure`` is in stops, -64 to 64. Raises BvbError for other exposures, shapes, types, and for nan or infinity.
    """
    linear = linear_picture(picture, "picture")
    if not (isinstance(exposure, Real) and abs(exposure) <= MAX_STOPS):
        raise BvbError(f"exposure is {exposure!r}. Give stops between {-MAX_STOPS:g} and {MAX_STOPS:g}.")
    x = np.clip(linear.astype(np.float64) * 2.0**exposure, 0.0, 1.0)
    encoded = np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)
    return np.asarray(np.floor(255.0 * encoded + 0.5), dtype=np.uint8)
