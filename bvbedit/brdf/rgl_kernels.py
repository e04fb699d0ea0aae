"""Compiled evaluation of RGL measurements (Dupuy & Jakob 2018); names follow the fields of their files.

Images are indexed [y, x] = [azimuth, elevation], with nodes on the edges of the unit square; stacks of images have one
image for each theta_i.
"""

import math

import numpy as np
from numba import prange

from bvbedit.brdf.angle_kernels import upper_atan2
from bvbedit.brdf.geometry import Floats
from bvbedit.jit import inlined_kernel, parallel_kernel


@inlined_kernel
def cell(x: float, nodes: int) -> tuple[int, float]:
    """Return the node below ``x`` in [0, 1] and how far it is to the next, as a share."""
    x = min(max(x, 0.0), 1.0) * (nodes - 1)
    i = min(int(x), nodes - 2)
    return i, x - i


@inlined_kernel
def bilinear(image: Floats, y: float, x: float) -> float:
    """Return ``image`` at a point of the unit square."""
    i, s = cell(y, image.shape[0])
    j, t = cell(x, image.shape[1])
    low = (1.0 - t) * image[i, j] + t * image[i, j + 1]
    return float((1.0 - s) * low + s * ((1.0 - t) * image[i + 1, j] + t * image[i + 1, j + 1]))


@inlined_kernel
def bilinear_of(images: Floats, a: int, c: int, y: float, x: float) -> float:
    """Return channel ``c`` of the images ``a`` (n, channels, height, width) at a point of the unit square."""
    i, s = cell(y, images.shape[2])
    j, t = cell(x, images.shape[3])
    low = (1.0 - t) * images[a, c, i, j] + t * images[a, c, i, j + 1]
    high = (1.0 - t) * images[a, c, i + 1, j] + t * images[a, c, i + 1, j + 1]
    return float((1.0 - s) * low + s * high)


@inlined_kernel
def to_sample(
    y: float, x: float, a: int, b: int, r: float, vndf: Floats, conditional: Floats, marginal: Floats
) -> tuple[float, float]:
    """Return the uniform sample (y, x) that the density between the images ``a`` and ``b`` (share r) maps to a point.

    The density is bilinear, so that its distribution functions are quadratic between nodes: ``conditional``
    (n, height, width) along x and ``marginal`` (n, height) of whole rows, both from zero at the first node.
    """
    height, width = vndf.shape[1], vndf.shape[2]
    i, s = cell(y, height)
    j, t = cell(x, width)
    q = 1.0 - r
    v00 = q * vndf[a, i, j] + r * vndf[b, i, j]
    v01 = q * vndf[a, i, j + 1] + r * vndf[b, i, j + 1]
    v10 = q * vndf[a, i + 1, j] + r * vndf[b, i + 1, j]
    v11 = q * vndf[a, i + 1, j + 1] + r * vndf[b, i + 1, j + 1]
    c0 = (1.0 - s) * v00 + s * v10
    c1 = (1.0 - s) * v01 + s * v11
    below = q * conditional[a, i, j] + r * conditional[b, i, j]
    above = q * conditional[a, i + 1, j] + r * conditional[b, i + 1, j]
    along = (1.0 - s) * below + s * above + t * (c0 + 0.5 * t * (c1 - c0))
    row_0 = q * conditional[a, i, width - 1] + r * conditional[b, i, width - 1]
    row_1 = q * conditional[a, i + 1, width - 1] + r * conditional[b, i + 1, width - 1]
    row = (1.0 - s) * row_0 + s * row_1
    # A row without any density is never sampled: there the point itself will do.
    sample_x = along / row if row > 0.0 else x
    sample_y = q * marginal[a, i] + r * marginal[b, i] + s * (row_0 + 0.5 * s * (row_1 - row_0))
    return sample_y, sample_x


@inlined_kernel
def accumulate(
    f: Floats,
    n: int,
    theta: float,
    ix: float,
    iy: float,
    iz: float,
    ox: float,
    oy: float,
    oz: float,
    theta_i: Floats,
    sigma: Floats,
    ndf: Floats,
    vndf: Floats,
    conditional: Floats,
    marginal: Floats,
    rgb: Floats,
    jacobian: bool,
) -> None:
    """Add f_r(wi, wo) to row n of ``f`` (., 3): wi = i at the elevation ``theta``, wo = o."""
    hx, hy, hz = ix + ox, iy + oy, iz + oz
    u_x = math.sqrt(upper_atan2(math.sqrt(hx * hx + hy * hy), hz) * 2.0 / math.pi)
    if ix == 0.0 and iy == 0.0:
        ix = 1.0
    # The azimuth of the half vector, counted from behind wi.
    cross = ix * hy - iy * hx
    turns = 0.5 + math.copysign(upper_atan2(abs(cross), ix * hx + iy * hy), cross) / (2.0 * math.pi)
    u_y = turns - math.floor(turns)

    last = len(theta_i) - 1
    b = 0
    while b < last and theta_i[b] < theta:
        b += 1
    a = max(b - 1, 0)
    r = min((theta - theta_i[a]) / (theta_i[b] - theta_i[a]), 1.0) if b > a else 0.0

    # The published value is f_r times the cosine of the outgoing direction.
    factor = 1.0 / oz
    if jacobian:
        factor *= bilinear(ndf, u_y, u_x) / (4.0 * bilinear(sigma, 0.5, math.sqrt(theta * 2.0 / math.pi)))
    s_y, s_x = to_sample(u_y, u_x, a, b, r, vndf, conditional, marginal)
    for c in range(3):
        low, high = bilinear_of(rgb, a, c, s_y, s_x), bilinear_of(rgb, b, c, s_y, s_x)
        f[n, c] += factor * ((1.0 - r) * low + r * high)


@inlined_kernel
def held(x: float, y: float, z: float, highest: float) -> tuple[float, float, float, float]:
    """Return the elevation of a direction, at most ``highest``, and the direction of that elevation."""
    sine = math.sqrt(x * x + y * y)
    theta = upper_atan2(sine, z)
    if theta <= highest:
        return theta, x, y, z
    longer = math.sin(highest) / sine
    return highest, longer * x, longer * y, math.cos(highest)


@parallel_kernel
def evaluate(
    wi: Floats,
    wo: Floats,
    highest: float,
    theta_i: Floats,
    sigma: Floats,
    ndf: Floats,
    vndf: Floats,
    conditional: Floats,
    marginal: Floats,
    rgb: Floats,
    jacobian: bool,
) -> Floats:
    """Return the mean of f_r(wi, wo) and f_r(wo, wi) (n, 3), clamped at zero, elevations held at ``highest``."""
    f = np.zeros((len(wi), 3))
    for n in prange(len(wi)):
        t_i, ix, iy, iz = held(wi[n, 0], wi[n, 1], wi[n, 2], highest)
        t_o, ox, oy, oz = held(wo[n, 0], wo[n, 1], wo[n, 2], highest)
        accumulate(f, n, t_i, ix, iy, iz, ox, oy, oz, theta_i, sigma, ndf, vndf, conditional, marginal, rgb, jacobian)
        accumulate(f, n, t_o, ox, oy, oz, ix, iy, iz, theta_i, sigma, ndf, vndf, conditional, marginal, rgb, jacobian)
        for c in range(3):
            f[n, c] = max(0.5 * f[n, c], 0.0)
    return f
