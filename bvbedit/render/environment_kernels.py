"""Compiled loops of environments: what is seen in a lat-long picture, and drawing directions by it. Nothing is checked.

The conventions of pictures are those of LatLongEnvironment. The bilinear look-up cuts the sphere into h + 1 rows of w
patches: patch (i, j) lies between the centres of texel rows i - 1 and i, which are the same row in the caps around the
poles, and between those of texel columns j and j + 1, wrapped. A density is constant over solid angle in each patch:
the mean over its corners and over channels, times ``scale``. ``rows`` (h + 2,) is the distribution function of i, and
``columns[i]`` (w + 1,) that of j given i, both from 0 to 1 (see EnvironmentDensity).
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bvbedit.brdf.angle_kernels import upper_atan2
from bvbedit.jit import inlined_kernel, kernel

Array = NDArray[Any]
Floats = NDArray[np.float64]
RGB = tuple[float, float, float]


@inlined_kernel
def place(height: int, width: int, x: float, y: float, z: float) -> tuple[float, float]:
    """Return the row and the column of a direction in a lat-long picture; texel centres lie at whole numbers."""
    row = upper_atan2(math.sqrt(x * x + y * y), z) / math.pi * height - 0.5
    # A picture of one column is the same all around.
    column = 0.0 if width == 1 else (0.5 + math.atan2(x, y) / (2.0 * math.pi)) * width - 0.5
    return row, column


@inlined_kernel
def look_up(texels: Array, x: float, y: float, z: float) -> RGB:
    """Return the radiance that arrives from a unit direction: the lat-long picture, bilinear, wrapped in azimuth."""
    height, width = texels.shape[0], texels.shape[1]
    row, column = place(height, width, x, y, z)
    r, c = math.floor(row), math.floor(column)
    a, b = row - r, column - c
    r0, r1 = max(r, 0), min(r + 1, height - 1)
    c0, c1 = wrapped(c, width), wrapped(c + 1, width)
    w00, w01, w10, w11 = (1 - a) * (1 - b), (1 - a) * b, a * (1 - b), a * b
    return (
        w00 * texels[r0, c0, 0] + w01 * texels[r0, c1, 0] + w10 * texels[r1, c0, 0] + w11 * texels[r1, c1, 0],
        w00 * texels[r0, c0, 1] + w01 * texels[r0, c1, 1] + w10 * texels[r1, c0, 1] + w11 * texels[r1, c1, 1],
        w00 * texels[r0, c0, 2] + w01 * texels[r0, c1, 2] + w10 * texels[r1, c0, 2] + w11 * texels[r1, c1, 2],
    )


@inlined_kernel
def wrapped(column: int, width: int) -> int:
    """Return a column from -1 to width on the sphere: modulo the width, without a division."""
    if column < 0:
        return column + width
    return column - width if column >= width else column


@inlined_kernel
def patch_mean(texels: Array, i: int, j: int) -> float:
    """Return the mean over channels of the bilinear look-up in patch (i, j), even in row and column."""
    r0, r1 = max(i - 1, 0), min(i, texels.shape[0] - 1)
    c1 = wrapped(j + 1, texels.shape[1])
    total = 0.0
    for k in range(3):
        # One by one, in float64: sums of the largest float32 would overflow.
        total += texels[r0, j, k]
        total += texels[r0, c1, k]
        total += texels[r1, j, k]
        total += texels[r1, c1, k]
    return total / 12.0


@inlined_kernel
def pdf_of(texels: Array, scale: float, x: float, y: float, z: float) -> float:
    """Return the density over solid angle with which ``draw`` draws a unit direction."""
    height, width = texels.shape[0], texels.shape[1]
    row, column = place(height, width, x, y, z)
    return scale * patch_mean(texels, math.floor(row) + 1, wrapped(math.floor(column), width))


@kernel
def place_in(distribution: Floats, u: float) -> tuple[int, float]:
    """Return the step of a distribution function from 0 to 1 that holds ``u`` in [0, 1), and where in it u is.

    That is the last step that begins at or before u: a step of no height is never returned.
    """
    i = int(np.searchsorted(distribution, u, side="right")) - 1
    return i, (u - distribution[i]) / (distribution[i + 1] - distribution[i])


@kernel
def draw(
    texels: Array, rows: Floats, columns: Floats, scale: float, u: float, v: float
) -> tuple[float, float, float, float]:
    """Return a unit direction drawn by ``u`` and ``v`` in [0, 1), and its density over solid angle.

    The density is that of ``pdf_of``, asked at the rounded direction: weights of multiple importance sampling must be
    functions of the direction alone. So it can be zero, rarely, where a direction is rounded over the edge of a patch.
    """
    height, width = texels.shape[0], texels.shape[1]
    i, a = place_in(rows, u)
    j, b = place_in(columns[i], v)
    # Even in cos theta and in azimuth, hence in solid angle.
    above, below = math.cos(max(i - 0.5, 0.0) * math.pi / height), math.cos(min(i + 0.5, height) * math.pi / height)
    z = above + a * (below - above)
    radius = math.sqrt((1.0 - z) * (1.0 + z))
    azimuth = ((j + 0.5 + b) / width - 0.5) * 2.0 * math.pi
    x, y = radius * math.sin(azimuth), radius * math.cos(azimuth)
    return x, y, z, pdf_of(texels, scale, x, y, z)
