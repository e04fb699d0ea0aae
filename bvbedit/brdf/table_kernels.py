"""Compiled work on tables: multilinear interpolation over three axes."""

import numpy as np
from numba import prange

from bvbedit.brdf.geometry import Bools, Floats
from bvbedit.jit import inlined_kernel, parallel_kernel

# A node whose share is less is there by rounding, and need not be valid.
NEGLIGIBLE = 1e-6


@inlined_kernel
def bracket(nodes: Floats, x: float, periodic: bool) -> tuple[int, int, float]:
    """Return the two nodes around ``x`` and the share of the second: clamped at the ends, or wrapped with period 1."""
    last = len(nodes) - 1
    if x < nodes[0] or x >= nodes[last]:
        if not periodic:
            end = 0 if x < nodes[0] else last
            return end, end, 0.0
        past = x - nodes[last] + (1.0 if x < nodes[0] else 0.0)
        return last, 0, past / (1.0 + nodes[0] - nodes[last])
    # Right at once where nodes are equally spaced, as all tables' are; a few steps off where they are nearly so.
    low = min(int((x - nodes[0]) / (nodes[last] - nodes[0]) * last), last - 1)
    while x < nodes[low]:
        low -= 1
    while x >= nodes[low + 1]:
        low += 1
    high = low + 1
    return low, high, (x - nodes[low]) / (nodes[high] - nodes[low])


@parallel_kernel
def interpolate(
    parameters: Floats,
    axis_0: Floats,
    axis_1: Floats,
    axis_2: Floats,
    periodic: bool,
    table: Floats,
    valid: Bools,
) -> tuple[Floats, Bools]:
    """Return trilinear means (n, 3) of ``table`` (n_0, n_1, n_2, 3), and whether all nodes that take part are valid."""
    means = np.empty((len(parameters), 3))
    trusted = np.empty(len(parameters), dtype=np.bool_)
    for n in prange(len(parameters)):
        i0, i1, s = bracket(axis_0, parameters[n, 0], False)
        j0, j1, t = bracket(axis_1, parameters[n, 1], False)
        k0, k1, r = bracket(axis_2, parameters[n, 2], periodic)
        red = green = blue = 0.0
        good = True
        for a in range(2):
            i = i1 if a else i0
            wa = s if a else 1.0 - s
            for b in range(2):
                j = j1 if b else j0
                wb = wa * (t if b else 1.0 - t)
                for c in range(2):
                    k = k1 if c else k0
                    w = wb * (r if c else 1.0 - r)
                    red += w * table[i, j, k, 0]
                    green += w * table[i, j, k, 1]
                    blue += w * table[i, j, k, 2]
                    good = good and (w < NEGLIGIBLE or valid[i, j, k])
        means[n, 0], means[n, 1], means[n, 2] = red, green, blue
        trusted[n] = good
    return means, trusted
