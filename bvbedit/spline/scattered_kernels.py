"""Compiled sums over the basis functions at scattered points. Inputs are taken to be right: in range, contiguous."""

import numpy as np
from numba import prange
from numpy.typing import NDArray

from bvbedit.jit import parallel_kernel
from bvbedit.spline.kernels import basis_into, locate

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]


# ``first`` (N, 3) and ``basis`` (N, 3, k) are of three axes, ``k`` the largest number of functions of an axis and
# ``counts`` how many there are on each: unused places are not read.


@parallel_kernel
def basis_along(
    axis: int, knots: Floats, degree: int, bins: Indices, points: Floats, first: Indices, basis: Floats
) -> None:
    """Write the basis functions at ``points`` (N, 3) along ``axis``; ``bins`` as ``kernels.locate`` takes them."""
    last = len(knots) - degree - 2
    scale = len(bins) / (knots[-1] - knots[0])
    for n in prange(len(points)):
        span = locate(points[n, axis], knots, bins, scale, last)
        first[n, axis] = span - degree
        basis_into(knots, degree, span, points[n, axis], basis[n, axis])


# Cubic functions along the last axis and three channels meet twelve neighbouring numbers of a net for each pair of
# functions on the others: written out they stay in vector registers, which makes both passes 1.5 to 2 times as fast.


@parallel_kernel
def apply_at(first: Indices, basis: Floats, counts: Indices, control: Floats, out: Floats) -> None:
    """out[n, c] = sum_ijk B0[n, i] B1[n, j] B2[n, k] control[i0 + i, j0 + j, k0 + k, c]."""
    channels = control.shape[3]
    flat = control.reshape(-1)
    row = control.shape[2] * channels
    plane = control.shape[1] * row
    cubic_rgb = channels == 3 and counts[2] == 4
    for n in prange(len(first)):
        a = b = c = d = e = f = g = h = p = q = r = s = 0.0
        for channel in range(channels):
            out[n, channel] = 0.0
        for i in range(counts[0]):
            for j in range(counts[1]):
                w = basis[n, 0, i] * basis[n, 1, j]
                corner = (first[n, 0] + i) * plane + (first[n, 1] + j) * row + first[n, 2] * channels
                if cubic_rgb:
                    at = np.uint64(corner)
                    a += w * flat[at]
                    b += w * flat[at + np.uint64(1)]
                    c += w * flat[at + np.uint64(2)]
                    d += w * flat[at + np.uint64(3)]
                    e += w * flat[at + np.uint64(4)]
                    f += w * flat[at + np.uint64(5)]
                    g += w * flat[at + np.uint64(6)]
                    h += w * flat[at + np.uint64(7)]
                    p += w * flat[at + np.uint64(8)]
                    q += w * flat[at + np.uint64(9)]
                    r += w * flat[at + np.uint64(10)]
                    s += w * flat[at + np.uint64(11)]
                else:
                    for k in range(counts[2]):
                        x = w * basis[n, 2, k]
                        for channel in range(channels):
                            out[n, channel] += x * flat[corner + k * channels + channel]
        if cubic_rgb:
            x = basis[n, 2]
            out[n, 0] = x[0] * a + x[1] * d + x[2] * g + x[3] * q
            out[n, 1] = x[0] * b + x[1] * e + x[2] * h + x[3] * r
            out[n, 2] = x[0] * c + x[1] * f + x[2] * p + x[3] * s


@parallel_kernel
def gather_at(first: Indices, basis: Floats, counts: Indices, values: Floats, nets: Floats) -> None:
    """nets[t, i0 + i, j0 + j, k0 + k, c] += B0[n, i] B1[n, j] B2[n, k] values[n, c], a net for each of t threads.

    Which points a thread takes does not depend on how many run, so that sums are the same from run to run.
    """
    threads, channels, count = len(nets), values.shape[1], len(first)
    row = nets.shape[3] * channels
    plane = nets.shape[2] * row
    cubic_rgb = channels == 3 and counts[2] == 4
    for t in prange(threads):
        net = nets[t].reshape(-1)
        for n in range(count * t // threads, count * (t + 1) // threads):
            if cubic_rgb:
                x, v = basis[n, 2], values[n]
                a, b, c = x[0] * v[0], x[0] * v[1], x[0] * v[2]
                d, e, f = x[1] * v[0], x[1] * v[1], x[1] * v[2]
                g, h, p = x[2] * v[0], x[2] * v[1], x[2] * v[2]
                q, r, s = x[3] * v[0], x[3] * v[1], x[3] * v[2]
            for i in range(counts[0]):
                for j in range(counts[1]):
                    w = basis[n, 0, i] * basis[n, 1, j]
                    corner = (first[n, 0] + i) * plane + (first[n, 1] + j) * row + first[n, 2] * channels
                    if cubic_rgb:
                        at = np.uint64(corner)
                        net[at] += w * a
                        net[at + np.uint64(1)] += w * b
                        net[at + np.uint64(2)] += w * c
                        net[at + np.uint64(3)] += w * d
                        net[at + np.uint64(4)] += w * e
                        net[at + np.uint64(5)] += w * f
                        net[at + np.uint64(6)] += w * g
                        net[at + np.uint64(7)] += w * h
                        net[at + np.uint64(8)] += w * p
                        net[at + np.uint64(9)] += w * q
                        net[at + np.uint64(10)] += w * r
                        net[at + np.uint64(11)] += w * s
                    else:
                        for k in range(counts[2]):
                            y = w * basis[n, 2, k]
                            for channel in range(channels):
                                net[corner + k * channels + channel] += y * values[n, channel]
