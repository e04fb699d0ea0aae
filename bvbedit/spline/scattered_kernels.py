"""Compiled sums over the basis functions at scattered points. Inputs are taken to be right: in range, contiguous."""

import numpy as np
from numba import prange
from numpy.typing import NDArray

from bvbedit.jit import parallel_kernel

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]


# ``first`` (N, 3) and ``basis`` (N, 3, k) are of three axes, ``k`` the largest number of functions of an axis and
# ``counts`` how many there are on each: unused places are not read.


@parallel_kernel
def apply_at(first: Indices, basis: Floats, counts: Indices, control: Floats, out: Floats) -> None:
    """out[n, c] = sum_ijk B0[n, i] B1[n, j] B2[n, k] control[i0 + i, j0 + j, k0 + k, c]."""
    channels = control.shape[3]
    flat = control.reshape(-1)
    row = control.shape[2] * channels
    plane = control.shape[1] * row
    for n in prange(len(first)):
        for c in range(channels):
            out[n, c] = 0.0
        for i in range(counts[0]):
            for j in range(counts[1]):
                w = basis[n, 0, i] * basis[n, 1, j]
                at = (first[n, 0] + i) * plane + (first[n, 1] + j) * row + first[n, 2] * channels
                if channels == 3:
                    r = g = b = 0.0
                    for k in range(counts[2]):
                        x, place = basis[n, 2, k], np.uint64(at + 3 * k)
                        r += x * flat[place]
                        g += x * flat[place + np.uint64(1)]
                        b += x * flat[place + np.uint64(2)]
                    out[n, 0] += w * r
                    out[n, 1] += w * g
                    out[n, 2] += w * b
                else:
                    for k in range(counts[2]):
                        x = w * basis[n, 2, k]
                        for c in range(channels):
                            out[n, c] += x * flat[at + k * channels + c]


@parallel_kernel
def gather_at(first: Indices, basis: Floats, counts: Indices, values: Floats, nets: Floats) -> None:
    """nets[t, i0 + i, j0 + j, k0 + k, c] += B0[n, i] B1[n, j] B2[n, k] values[n, c], a net for each of t threads.

    Which points a thread takes does not depend on how many run, so that sums are the same from run to run.
    """
    threads, channels, count = len(nets), values.shape[1], len(first)
    row = nets.shape[3] * channels
    plane = nets.shape[2] * row
    for t in prange(threads):
        net = nets[t].reshape(-1)
        for n in range(count * t // threads, count * (t + 1) // threads):
            for i in range(counts[0]):
                for j in range(counts[1]):
                    w = basis[n, 0, i] * basis[n, 1, j]
                    at = (first[n, 0] + i) * plane + (first[n, 1] + j) * row + first[n, 2] * channels
                    if channels == 3:
                        r, g, b = w * values[n, 0], w * values[n, 1], w * values[n, 2]
                        for k in range(counts[2]):
                            x, place = basis[n, 2, k], np.uint64(at + 3 * k)
                            net[place] += x * r
                            net[place + np.uint64(1)] += x * g
                            net[place + np.uint64(2)] += x * b
                    else:
                        for k in range(counts[2]):
                            x = w * basis[n, 2, k]
                            for c in range(channels):
                                net[at + k * channels + c] += x * values[n, c]
