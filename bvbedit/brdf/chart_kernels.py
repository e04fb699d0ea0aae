"""Compiled maps between pairs of directions and chart parameters. Inputs are taken to be unit vectors (n, 3)."""

import math

import numpy as np
from numba import prange

from bvbedit.brdf.angle_kernels import upper_atan2
from bvbedit.brdf.geometry import Floats
from bvbedit.jit import inlined_kernel, kernel, parallel_kernel

HALF_PI = math.pi / 2
# Below this cosine of theta_h the horizon of the difference angle is the quotient of two roundings.
HORIZON_COSINE = 1e-12


@inlined_kernel
def half_difference(
    wix: float, wiy: float, wiz: float, wox: float, woy: float, woz: float
) -> tuple[float, float, float, float]:
    """Return theta_h, theta_d, and x and y of d (up to a positive factor), from which phi_d = atan2(y, x).

    wi = h cos(theta_d) + k with k = (wi - wo)/2 orthogonal to h, so that |wi - wo| and |wi + wo| give theta_d to full
    precision at both ends, and k alone, turned by -phi_h and -theta_h, gives phi_d.
    """
    sx, sy, sz = wix + wox, wiy + woy, wiz + woz
    kx, ky, kz = wix - wox, wiy - woy, wiz - woz
    s = math.sqrt(sx * sx + sy * sy + sz * sz)
    k = math.sqrt(kx * kx + ky * ky + kz * kz)
    horizontal = math.sqrt(sx * sx + sy * sy)
    if s == 0.0:  # wi = -wo: h = n
        horizontal, sz, s = 0.0, 1.0, 1.0
        theta_d = HALF_PI
    else:
        theta_d = upper_atan2(k, s)
    theta_h = upper_atan2(horizontal, sz)
    cos_phi, sin_phi = 1.0, 0.0
    if horizontal > 0.0:
        cos_phi, sin_phi = sx / horizontal, sy / horizontal
    dx = (sz * (cos_phi * kx + sin_phi * ky) - horizontal * kz) / s
    dy = cos_phi * ky - sin_phi * kx
    # Adding zero makes a negative zero positive: where the azimuth means nothing it is 0, not pi.
    return theta_h, theta_d, dx + 0.0, dy + 0.0


@inlined_kernel
def horizon(theta_h: float, cos_phi_d: float) -> float:
    """Return theta_d_max, the difference angle at which one of the directions reaches the horizon."""
    c = math.cos(theta_h)
    if c < HORIZON_COSINE:
        return HALF_PI
    return upper_atan2(c, math.sin(theta_h) * abs(cos_phi_d))


@parallel_kernel
def half_diff_parameters(wi: Floats, wo: Floats) -> Floats:
    p = np.empty((len(wi), 3))
    for n in prange(len(wi)):
        theta_h, theta_d, dx, dy = half_difference(wi[n, 0], wi[n, 1], wi[n, 2], wo[n, 0], wo[n, 1], wo[n, 2])
        phi_d = upper_atan2(abs(dy), abs(dx))
        p[n, 0] = min(1.0, math.sqrt(theta_h / HALF_PI))
        p[n, 1] = min(1.0, theta_d / horizon(theta_h, math.cos(phi_d)))
        p[n, 2] = min(1.0, phi_d / HALF_PI)
    return p


@parallel_kernel
def half_diff_directions(p: Floats) -> tuple[Floats, Floats]:
    wi, wo = np.empty((len(p), 3)), np.empty((len(p), 3))
    for n in prange(len(p)):
        theta_h, phi_d = HALF_PI * p[n, 0] * p[n, 0], HALF_PI * p[n, 2]
        if math.cos(theta_h) < HORIZON_COSINE:
            # Both directions lie in the surface: turned against one another there, phi_d cannot be anything else.
            phi_d = HALF_PI
        theta_d = p[n, 1] * horizon(theta_h, math.cos(phi_d))
        place_half_difference(theta_h, theta_d, phi_d, wi[n], wo[n])
        # The face v = 1 is the horizon itself; rounding must not put it below.
        wi[n, 2] = max(0.0, wi[n, 2])
    return wi, wo


@kernel
def place_half_difference(theta_h: float, theta_d: float, phi_d: float, wi: Floats, wo: Floats) -> None:
    """Write the pair with phi_h = 0 into ``wi`` and ``wo`` (3,)."""
    ch, sh, cd, sd = math.cos(theta_h), math.sin(theta_h), math.cos(theta_d), math.sin(theta_d)
    dx, dy = sd * math.cos(phi_d), sd * math.sin(phi_d)
    wi[0], wi[1], wi[2] = ch * dx + sh * cd, dy, ch * cd - sh * dx
    wo[0], wo[1], wo[2] = sh * cd - ch * dx, -dy, ch * cd + sh * dx


@parallel_kernel
def rusinkiewicz_parameters(wi: Floats, wo: Floats, period: float) -> Floats:
    p = np.empty((len(wi), 3))
    for n in prange(len(wi)):
        theta_h, theta_d, dx, dy = half_difference(wi[n, 0], wi[n, 1], wi[n, 2], wo[n, 0], wo[n, 1], wo[n, 2])
        phi_d = math.atan2(dy, dx)
        if phi_d < 0.0:
            phi_d += period
        p[n, 0] = min(1.0, math.sqrt(theta_h / HALF_PI))
        p[n, 1] = min(1.0, theta_d / HALF_PI)
        p[n, 2] = min(1.0, max(0.0, (phi_d % period) / period))
    return p


@parallel_kernel
def rusinkiewicz_directions(p: Floats, period: float) -> tuple[Floats, Floats]:
    wi, wo = np.empty((len(p), 3)), np.empty((len(p), 3))
    for n in prange(len(p)):
        place_half_difference(HALF_PI * p[n, 0] * p[n, 0], HALF_PI * p[n, 1], period * p[n, 2], wi[n], wo[n])
    return wi, wo


@parallel_kernel
def in_out_parameters(wi: Floats, wo: Floats) -> Floats:
    p = np.empty((len(wi), 3))
    for n in prange(len(wi)):
        cross = wi[n, 0] * wo[n, 1] - wi[n, 1] * wo[n, 0]
        dot = wi[n, 0] * wo[n, 0] + wi[n, 1] * wo[n, 1]
        p[n, 0] = min(1.0, upper_atan2(math.sqrt(wi[n, 0] ** 2 + wi[n, 1] ** 2), wi[n, 2]) / HALF_PI)
        p[n, 1] = min(1.0, upper_atan2(math.sqrt(wo[n, 0] ** 2 + wo[n, 1] ** 2), wo[n, 2]) / HALF_PI)
        p[n, 2] = min(1.0, upper_atan2(abs(cross), dot) / math.pi)
    return p


@parallel_kernel
def in_out_directions(p: Floats) -> tuple[Floats, Floats]:
    wi, wo = np.empty((len(p), 3)), np.empty((len(p), 3))
    for n in prange(len(p)):
        theta_i, theta_o, phi = HALF_PI * p[n, 0], HALF_PI * p[n, 1], math.pi * p[n, 2]
        si, so = math.sin(theta_i), math.sin(theta_o)
        wi[n, 0], wi[n, 1], wi[n, 2] = si, 0.0, math.cos(theta_i)
        wo[n, 0], wo[n, 1], wo[n, 2] = so * math.cos(phi), so * math.sin(phi), math.cos(theta_o)
    return wi, wo
