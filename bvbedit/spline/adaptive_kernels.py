"""Compiled loops of the search for dominant points. Inputs are taken to be right, as in ``kernels``."""

import numpy as np
from numpy.typing import NDArray

from bvbedit.jit import kernel
from bvbedit.spline.kernels import basis_into

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]


@kernel
def eliminate(
    knots: Floats,
    degree: int,
    parameters: Floats,
    roots: Floats,
    lines: Floats,
    first: Indices,
    basis: Floats,
    upper: Floats,
    right: Floats,
) -> float:
    """Bring the weighted collocation matrix to a triangle by Givens rotations; return what it leaves of the lines.

    That is the squared norm of (I - P) ``lines`` (m, k), the sum of squares of what the rotations push out of the
    triangle, infinite where a pivot is zero. ``first`` (m,) and ``basis`` (m, p + 1) become the banded matrix, its
    rows times ``roots``; ``upper`` (n, p + 1) starts as zeros and becomes R, row j from column j on; ``right`` (n, k)
    starts as zeros and becomes the right-hand sides Q^T ``lines``.
    """
    width = degree + 1
    n = len(upper)
    row, line = np.empty(width), np.empty(lines.shape[1])
    left = 0.0
    span = degree
    for i in range(len(parameters)):
        while span < n - 1 and knots[span + 1] <= parameters[i]:
            span += 1
        first[i] = span - degree
        basis_into(knots, degree, span, parameters[i], basis[i])
        for c in range(width):
            basis[i, c] *= roots[i]
            row[c] = basis[i, c]
        line[:] = lines[i]
        for c in range(width):
            if row[c] == 0.0:
                continue
            j = first[i] + c
            r = np.hypot(upper[j, 0], row[c])
            cosine, sine = upper[j, 0] / r, row[c] / r
            for b in range(width - c):
                above, below = upper[j, b], row[c + b]
                upper[j, b] = cosine * above + sine * below
                row[c + b] = cosine * below - sine * above
            target = right[j]
            for a in range(len(line)):
                above, below = target[a], line[a]
                target[a] = cosine * above + sine * below
                line[a] = cosine * below - sine * above
        for a in range(len(line)):
            left += line[a] * line[a]
    return left


@kernel
def determined(upper: Floats, smallest_pivot: float) -> bool:
    """Return whether no pivot is below so many of the largest one."""
    low, high = np.inf, 0.0
    for j in range(len(upper)):
        pivot = abs(upper[j, 0])
        low, high = min(low, pivot), max(high, pivot)
    return low > smallest_pivot * high


@kernel
def error_left(
    knots: Floats, degree: int, parameters: Floats, roots: Floats, lines: Floats, smallest_pivot: float
) -> float:
    """Return the squared norm of what the splines over ``knots`` leave of the lines, infinite where undetermined."""
    n = len(knots) - degree - 1
    first, basis = np.empty(len(parameters), dtype=np.int64), np.empty((len(parameters), degree + 1))
    upper, right = np.zeros((n, degree + 1)), np.zeros((n, lines.shape[1]))
    left = eliminate(knots, degree, parameters, roots, lines, first, basis, upper, right)
    return left if determined(upper, smallest_pivot) else np.inf


@kernel
def residual_left(
    knots: Floats,
    degree: int,
    parameters: Floats,
    roots: Floats,
    lines: Floats,
    smallest_pivot: float,
    residual: Floats,
) -> bool:
    """Write (I - P) ``lines`` into ``residual`` (m, k) and return true, or false where the lines do not determine P."""
    n, k = len(knots) - degree - 1, lines.shape[1]
    first, basis = np.empty(len(parameters), dtype=np.int64), np.empty((len(parameters), degree + 1))
    upper, right = np.zeros((n, degree + 1)), np.zeros((n, k))
    eliminate(knots, degree, parameters, roots, lines, first, basis, upper, right)
    if not determined(upper, smallest_pivot):
        return False
    for j in range(n - 1, -1, -1):
        target = right[j]
        for c in range(1, min(degree + 1, n - j)):
            factor, other = upper[j, c], right[j + c]
            for a in range(k):
                target[a] -= factor * other[a]
        for a in range(k):
            target[a] /= upper[j, 0]
    for i in range(len(parameters)):
        out = residual[i]
        out[:] = lines[i]
        for c in range(degree + 1):
            b, control = basis[i, c], right[first[i] + c]
            for a in range(k):
                out[a] -= b * control[a]
    return True
