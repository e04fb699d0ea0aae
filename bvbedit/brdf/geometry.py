"""Directions: what a caller may pass, and the half/difference angles of a pair (Rusinkiewicz 1998).

wi points towards the light, wo towards the viewer; both are unit vectors that point away from the surface, z is the
normal. h = norm(wi + wo) with angles theta_h, phi_h; d = Ry(-theta_h) Rz(-phi_h) wi with angles theta_d, phi_d.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bvbedit.errors import BvbError
from bvbedit.spline.arguments import real_array

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

# The luminance of linear sRGB (IEC 61966-2-1, ITU-R BT.709).
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def unit_directions(value: ArrayLike, name: str) -> Floats:
    """Return ``value`` (..., 3) as float64 unit vectors.

    Raises BvbError where the shape is not (..., 3) or a vector is zero, nan or infinite.
    """
    w = real_array(value, name)
    if w.ndim == 0 or w.shape[-1] != 3:
        raise BvbError(f"{name} has shape {w.shape}. Directions need a last axis of 3 components.")
    # Divided by the largest component first, so that neither 1e-300 nor 1e300 spoils the square.
    largest = np.max(np.abs(w), axis=-1, keepdims=True, initial=0.0)
    good = np.isfinite(largest) & (largest > 0)
    if not good.all():
        bad = np.argwhere(~good[..., 0])[0]
        raise BvbError(f"{name}{bad.tolist()} is {w[tuple(bad)].tolist()}. Directions must be finite and non-zero.")
    w = w / largest
    return np.asarray(w / np.sqrt(np.einsum("...i,...i->...", w, w))[..., None])


def spherical(theta: ArrayLike, phi: ArrayLike) -> Floats:
    """Return unit vectors (..., 3) at the angle ``theta`` from the normal and azimuth ``phi`` (radians, broadcast)."""
    theta, phi = np.broadcast_arrays(np.asarray(theta, dtype=np.float64), np.asarray(phi, dtype=np.float64))
    s = np.sin(theta)
    return np.stack([s * np.cos(phi), s * np.sin(phi), np.cos(theta)], axis=-1)


def elevation(w: Floats) -> Floats:
    """Return the angle (...) between ``w`` (..., 3) and the normal, by atan2, so that small angles keep all digits."""
    return np.arctan2(np.hypot(w[..., 0], w[..., 1]), w[..., 2])
