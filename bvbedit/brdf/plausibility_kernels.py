"""Compiled loops of the albedo's quadrature. Inputs are taken to be right: angles in range, arrays contiguous."""

import math

import numpy as np
from numba import prange
from numpy.typing import NDArray

from bvbedit.brdf.angle_kernels import upper_atan2
from bvbedit.brdf.chart_kernels import HALF_PI, horizon
from bvbedit.brdf.geometry import Floats
from bvbedit.jit import inlined_kernel, parallel_kernel


@inlined_kernel
def angle_of(cosine: float) -> float:
    """Return acos of what may lie outside [-1, 1], as quotients of tangents do."""
    return math.acos(min(max(cosine, -1.0), 1.0))


@parallel_kernel
def half_vector_points(
    theta_o: Floats,
    row_of: NDArray[np.int64],
    u: Floats,
    du: Floats,
    nodes: Floats,
    gauss: Floats,
    p: Floats,
    w: Floats,
) -> None:
    """Write the parameters ``p`` (rows * 2n, 3) and weights ``w`` (rows * 2n,) of circles of half vectors.

    Row r has theta_h = pi/2 u[r]^2, the width ``du``[r] of a rule along u, and the elevation ``theta_o``[row_of[r]].
    Its azimuths run over the half circle on which wi is above the horizon, in two pieces of ``nodes`` and ``gauss``
    (n,), Gauss's rule on [0, 1]: up to the fold phi_d = pi/2 of the chart, where wi.z = wo.z, and from there on.
    The sum of f times weights is the integral of f cos theta_i over all wi.
    """
    n = len(nodes)
    for r in prange(len(u)):
        to = theta_o[row_of[r]]
        th = HALF_PI * u[r] * u[r]
        so, co, sh, ch = math.sin(to), math.cos(to), math.sin(th), math.cos(th)
        # wi.z = 2 (wo.h) cos theta_h - cos theta_o > 0, and the same > cos theta_o.
        last = angle_of(-co * math.cos(2.0 * th) / (so * math.sin(2.0 * th))) if so * sh * ch > 0.0 else math.pi
        fold = angle_of(co * sh / (so * ch)) if so * ch > 0.0 else 0.0
        # The larger piece is cut in two, close to its start where h is close to the horizon: phi_d turns quickly there.
        cut = max(fold, last - fold) * ch / (1.0 + ch)
        if fold < last - fold:
            cut += fold
        first, second = min(fold, cut), max(fold, cut)
        # d omega_i = 4 (wo.h) sin theta_h d theta_h d phi, both halves of the circle, d theta_h = pi u du.
        scale = 8.0 * sh * math.pi * u[r] * du[r]
        for a in range(3 * n):
            piece, k = a // n, a % n
            start = 0.0 if piece == 0 else (first if piece == 1 else second)
            width = (first if piece == 0 else (second if piece == 1 else last)) - start
            phi = start + width * nodes[k]
            c, s = math.cos(phi), math.sin(phi)
            width *= gauss[k]
            # wo turned by -theta_h: (dx, dy, wo.h); wi is (-dx, -dy, wo.h).
            dx, dy = ch * so * c - sh * co, so * s
            along = max(sh * so * c + ch * co, 0.0)
            across = math.sqrt(dx * dx + dy * dy)
            cos_phi_d = abs(dx) / across if across > 0.0 else 1.0
            at = 3 * n * r + a
            p[at, 0] = u[r]
            p[at, 1] = min(1.0, upper_atan2(across, along) / horizon(th, cos_phi_d))
            p[at, 2] = min(1.0, upper_atan2(abs(dy), abs(dx)) / HALF_PI)
            w[at] = scale * width * along * max(2.0 * along * ch - co, 0.0)


@parallel_kernel
def weighted_sums(f: Floats, weights: Floats, each: int, out: Floats) -> None:
    """out[e] = sum of weights[a] f[a] over the ``each`` rows a of ``f`` (n, 3) that belong to it, one after another."""
    for e in prange(len(out)):
        r = g = b = 0.0
        for a in range(e * each, (e + 1) * each):
            r += weights[a] * f[a, 0]
            g += weights[a] * f[a, 1]
            b += weights[a] * f[a, 2]
        out[e, 0], out[e, 1], out[e, 2] = r, g, b
