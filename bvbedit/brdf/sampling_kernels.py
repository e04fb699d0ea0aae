"""Compiled loops of sampling half vectors. Inputs are taken to be right: unit vectors on or above the horizon."""

import math

import numpy as np
from numba import prange
from numpy.typing import NDArray

from bvbedit.brdf.angle_kernels import upper_atan2
from bvbedit.jit import inlined_kernel, parallel_kernel

Floats = NDArray[np.float64]

# A density is a spline of degree one in each of (theta_o, s, phi), s = 1 - cos theta_h, phi the azimuth of h relative
# to that of wo without its sign: ``p`` (K, I, J) are its values at the nodes ``theta`` (K,), ``s`` (I,) and ``phi``
# (J,), of which ``theta`` and ``phi`` are evenly spaced from 0. Its integrals are splines of degree two, given at the
# same nodes: ``rows`` (K, I, J) from 0 to phi, ``marginals`` (K, I) over all phi, ``columns`` (K, I) of these from 0
# to s. Each layer k integrates to one.


@inlined_kernel
def below(nodes: Floats, x: float) -> tuple[int, float]:
    """Return the interval of ``nodes`` that holds ``x`` and where in it x is, from 0 to 1."""
    low, high = 0, len(nodes) - 1
    while high - low > 1:
        middle = (low + high) // 2
        if nodes[middle] <= x:
            low = middle
        else:
            high = middle
    return low, min(max((x - nodes[low]) / (nodes[low + 1] - nodes[low]), 0.0), 1.0)


@inlined_kernel
def below_even(nodes: Floats, x: float) -> tuple[int, float]:
    """Return the same for nodes that begin at 0 and are evenly spaced."""
    place = max(x, 0.0) * (len(nodes) - 1) / nodes[-1]
    low = min(int(place), len(nodes) - 2)
    return low, min(place - low, 1.0)


@inlined_kernel
def half_density(
    ix: float,
    iy: float,
    iz: float,
    ox: float,
    oy: float,
    oz: float,
    theta: Floats,
    s: Floats,
    phi: Floats,
    p: Floats,
) -> float:
    """Return the density of wi = i over solid angle, given wo = o, that the density of half vectors makes."""
    hx, hy, hz = ix + ox, iy + oy, iz + oz
    length = math.sqrt(hx * hx + hy * hy + hz * hz)
    if length == 0.0 or hz <= 0.0:
        return 0.0
    hx, hy, hz = hx / length, hy / length, hz / length
    sine = math.sqrt(ox * ox + oy * oy)
    k, a = below_even(theta, upper_atan2(sine, oz))
    # 1 - cos, without the loss of digits near the pole.
    i, b = below(s, (hx * hx + hy * hy) / (1.0 + hz))
    ax, ay = (ox / sine, oy / sine) if sine > 0.0 else (1.0, 0.0)
    j, c = below_even(phi, upper_atan2(abs(ax * hy - ay * hx), ax * hx + ay * hy))
    value = 0.0
    for x in range(2):
        for y in range(2):
            w = (a if x else 1.0 - a) * (b if y else 1.0 - b)
            value += w * ((1.0 - c) * p[k + x, i + y, j] + c * p[k + x, i + y, j + 1])
    # Half for either sign of phi.
    return 0.5 * value / (4.0 * (ox * hx + oy * hy + oz * hz))


@inlined_kernel
def part_of_span(rest: float, left: float, right: float) -> float:
    """Return x in [0, 1] up to which a density that runs from ``left`` to ``right`` holds ``rest`` of a unit span."""
    root = math.sqrt(max(left * left + 2.0 * (right - left) * rest, 0.0))
    if left + root <= 0.0:
        return 0.0
    return min(2.0 * rest / (left + root), 1.0)


@parallel_kernel
def draw_by_cosine(u: Floats, wi: Floats, density: Floats) -> None:
    """Write ``wi`` (n, 3) drawn by ``u`` (n, 2) in [0, 1), and their ``density`` (n,), the cosine over pi."""
    for n in prange(len(u)):
        radius, angle, height = math.sqrt(u[n, 0]), 2.0 * math.pi * u[n, 1], math.sqrt(1.0 - u[n, 0])
        wi[n, 0], wi[n, 1], wi[n, 2] = radius * math.cos(angle), radius * math.sin(angle), height
        density[n] = height / math.pi


@parallel_kernel
def density_of(
    wi: Floats, wo: Floats, theta: Floats, s: Floats, phi: Floats, p: Floats, cosine_share: float, out: Floats
) -> None:
    """Write the density of ``wi`` (n, 3) over solid angle, given ``wo`` (n, 3), into ``out`` (n,)."""
    for n in prange(len(wi)):
        ix, iy, iz, ox, oy, oz = wi[n, 0], wi[n, 1], wi[n, 2], wo[n, 0], wo[n, 1], wo[n, 2]
        half = half_density(ix, iy, iz, ox, oy, oz, theta, s, phi, p)
        out[n] = (1.0 - cosine_share) * half + cosine_share * wi[n, 2] / math.pi


@parallel_kernel
def draw_directions(
    wo: Floats,
    u: Floats,
    theta: Floats,
    s: Floats,
    phi: Floats,
    p: Floats,
    rows: Floats,
    marginals: Floats,
    columns: Floats,
    cosine_share: float,
    wi: Floats,
    density: Floats,
) -> None:
    """Write ``wi`` (n, 3) for ``wo`` (n, 3) and ``u`` (n, 2) in [0, 1), and their ``density`` (n,), zero if rejected.

    Half vectors are drawn by inverting the marginal distribution of s, then that of phi given s; a small share of the
    directions by the cosine.
    """
    for n in prange(len(wo)):
        x, y, half = u[n, 0], u[n, 1], 0.0
        ox, oy, oz = wo[n, 0], wo[n, 1], wo[n, 2]
        if x < cosine_share:
            x /= cosine_share
            radius, angle = math.sqrt(x), 2.0 * math.pi * y
            ix, iy, iz = radius * math.cos(angle), radius * math.sin(angle), math.sqrt(1.0 - x)
            half = half_density(ix, iy, iz, ox, oy, oz, theta, s, phi, p)
        else:
            x = (x - cosine_share) / (1.0 - cosine_share)
            sign = 1.0
            if y < 0.5:
                y = 2.0 * y
            else:
                y, sign = 2.0 * y - 1.0, -1.0
            sine = math.sqrt(ox * ox + oy * oy)
            k, a = below_even(theta, upper_atan2(sine, oz))
            # s: the last node whose distribution function is not above x.
            low, high = 0, len(s) - 1
            while high - low > 1:
                middle = (low + high) // 2
                if (1.0 - a) * columns[k, middle] + a * columns[k + 1, middle] <= x:
                    low = middle
                else:
                    high = middle
            width = s[low + 1] - s[low]
            rest = x - ((1.0 - a) * columns[k, low] + a * columns[k + 1, low])
            left = (1.0 - a) * marginals[k, low] + a * marginals[k + 1, low]
            right = (1.0 - a) * marginals[k, low + 1] + a * marginals[k + 1, low + 1]
            b = part_of_span(max(rest, 0.0) / width, left, right)
            i, w00, w01 = low, (1.0 - a) * (1.0 - b), (1.0 - a) * b
            w10, w11 = a * (1.0 - b), a * b
            # phi, given s.
            end = len(phi) - 1
            whole = w00 * rows[k, i, end] + w01 * rows[k, i + 1, end]
            y *= whole + w10 * rows[k + 1, i, end] + w11 * rows[k + 1, i + 1, end]
            low, high = 0, end
            while high - low > 1:
                middle = (low + high) // 2
                at = w00 * rows[k, i, middle] + w01 * rows[k, i + 1, middle]
                at += w10 * rows[k + 1, i, middle] + w11 * rows[k + 1, i + 1, middle]
                if at <= y:
                    low = middle
                else:
                    high = middle
            at = w00 * rows[k, i, low] + w01 * rows[k, i + 1, low]
            at += w10 * rows[k + 1, i, low] + w11 * rows[k + 1, i + 1, low]
            left = w00 * p[k, i, low] + w01 * p[k, i + 1, low] + w10 * p[k + 1, i, low] + w11 * p[k + 1, i + 1, low]
            right = w00 * p[k, i, low + 1] + w01 * p[k, i + 1, low + 1]
            right += w10 * p[k + 1, i, low + 1] + w11 * p[k + 1, i + 1, low + 1]
            width = phi[low + 1] - phi[low]
            c = part_of_span(max(y - at, 0.0) / width, left, right)
            angle = sign * (phi[low] + width * c)
            height = s[i] + b * (s[i + 1] - s[i])
            # The half vector, and its mirror image of wo.
            radius = math.sqrt(height * (2.0 - height))
            ax, ay = (ox / sine, oy / sine) if sine > 0.0 else (1.0, 0.0)
            cosine, sine = math.cos(angle), math.sin(angle)
            hx, hy, hz = radius * (ax * cosine - ay * sine), radius * (ay * cosine + ax * sine), 1.0 - height
            d = 2.0 * (ox * hx + oy * hy + oz * hz)
            ix, iy, iz = d * hx - ox, d * hy - oy, d * hz - oz
            if d <= 0.0:
                iz = 0.0
            else:
                # As half_density has it, whose angles are known here.
                half = 0.5 * ((1.0 - c) * left + c * right) / (2.0 * d)
        if iz > 0.0:
            wi[n, 0], wi[n, 1], wi[n, 2] = ix, iy, iz
            density[n] = (1.0 - cosine_share) * half + cosine_share * iz / math.pi
        else:
            wi[n, 0], wi[n, 1], wi[n, 2] = 0.0, 0.0, 1.0
            density[n] = 0.0
