"""Compiled loops that turn one knot vector into another. Inputs are taken to be right, as in ``kernels``."""

import numpy as np
from numpy.typing import NDArray

from bvbedit.jit import kernel

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]


@kernel
def blossom_weights(t: Floats, p: int, args: Floats, before: float, near: int, weights: Floats, new: Floats) -> int:
    """Write into ``weights`` what each control point counts in the blossom f(args), and return the first's index.

    ``args`` (p,) stand side by side in a knot vector that contains ``t`` (or do so with one of them left out), behind
    the knot ``before``. Those that are knots of ``t`` are arguments which the control points share; each of the others
    replaces one outer knot, by an affine combination that is convex since ``args`` lie between the outer knots (Lyche &
    Morken 1986). So all weights are >= 0 and each is right to a few ulps of itself, whatever the knots.
    The search for args[0] in ``t`` begins at the index ``near``; ``new`` is room for p numbers.
    """
    weights[:] = 0.0
    if p == 0:
        weights[0] = 1.0
        return near
    z = args[0]
    start = near
    while start > 0 and t[start - 1] >= z:
        start -= 1
    while t[start] < z:
        start += 1
    in_knots = 0
    while start + in_knots < len(t) and t[start + in_knots] == z:
        in_knots += 1
    in_args = 0
    while in_args < p and args[in_args] == z:
        in_args += 1
    # Of more copies in t the last ones are meant if the row begins amid them, and else the first.
    if in_args < in_knots and before == z:
        start += in_knots - in_args
    at = start
    count = 0
    for x in args:
        if at < len(t) and t[at] == x:
            at += 1
        else:
            new[count] = x
            count += 1
    last = start - 1
    weights[0] = 1.0
    for k in range(count, 0, -1):
        x = new[k - 1]
        for i in range(count - k, -1, -1):
            j = last - count + k + i
            left, right = t[j], t[j + p - k + 1]
            share = weights[i] / (right - left)
            # The larger part is what the smaller leaves: weights sum up to one, and no error is repeated p times.
            if x - left < right - x:
                part = (x - left) * share
                weights[i + 1] += part
                weights[i] -= part
            else:
                part = (right - x) * share
                weights[i + 1] += weights[i] - part
                weights[i] = part
    return last - count


@kernel
def blossom_rows(t: Floats, p: int, fine: Floats, q: int, first: Indices, rows: Floats) -> None:
    """Express the control points over the knots ``fine`` and degree ``q`` by those over ``t`` and degree ``p``.

    q = p inserts knots: control point i is the blossom of fine[i+1 : i+p+1]. q = p + 1 elevates: it is the mean of the
    blossoms that leave out one of fine[i+1 : i+q+1]. Rows (m, p+1) begin at the control points of the span at fine[i],
    which is one of those that they describe, so that no other can have an influence.
    """
    weights, new, args = np.empty(p + 1), np.empty(p + 1), np.empty(p)
    blossoms = 1 if q == p else q
    span = 0
    for i in range(len(first)):
        while t[span + 1] <= fine[i]:
            span += 1
        base = span - p
        first[i] = base
        rows[i] = 0.0
        for omitted in range(blossoms):
            args[:] = fine[i + 1 : i + 1 + p]
            if q > p:
                args[omitted:] = fine[i + 2 + omitted : i + 1 + q]
            at = blossom_weights(t, p, args, fine[i], span, weights, new)
            for k in range(max(0, base - at), min(p, base + p - at) + 1):
                rows[i, at + k - base] += weights[k]
        if blossoms > 1:
            rows[i] /= blossoms


@kernel
def product_extent(first_a: Indices, rows_a: Floats, first_b: Indices, rows_b: Floats, first: Indices) -> int:
    """Write the first column of each row of the banded product into ``first`` and return the width of its band."""
    width = 1
    for i in range(len(first_a)):
        low, high = -1, -1
        for j in range(rows_a.shape[1]):
            if rows_a[i, j] == 0.0:
                continue
            b = first_a[i] + j
            for k in range(rows_b.shape[1]):
                if rows_b[b, k] != 0.0:
                    column = first_b[b] + k
                    low = column if low < 0 else min(low, column)
                    high = max(high, column)
        first[i] = max(low, 0)
        width = max(width, high - low + 1)
    return width


@kernel
def product_rows(
    first_a: Indices, rows_a: Floats, first_b: Indices, rows_b: Floats, first: Indices, rows: Floats
) -> None:
    """rows = A B, both banded, with ``first`` and the width of ``rows`` wide enough; ``rows`` start as zeros."""
    for i in range(len(first_a)):
        for j in range(rows_a.shape[1]):
            a = rows_a[i, j]
            if a == 0.0:
                continue
            b = first_a[i] + j
            for k in range(rows_b.shape[1]):
                if rows_b[b, k] != 0.0:
                    rows[i, first_b[b] + k - first[i]] += a * rows_b[b, k]


@kernel
def rotations(first: Indices, rows: Floats, upper: Floats, cosines: Floats, sines: Floats) -> None:
    """Bring a banded matrix (m, n) to triangular form, row by row, by Givens rotations.

    ``upper`` (n, k) starts as zeros and becomes R, row j from column j on; ``cosines``, ``sines`` (m, k) become the
    rotations of row i with the rows first[i] ... of R. ``first`` must not decrease.
    """
    k = rows.shape[1]
    row = np.empty(k)
    for i in range(len(first)):
        row[:] = rows[i]
        for c in range(k):
            j = first[i] + c
            r = np.hypot(upper[j, 0], row[c])
            cosine, sine = 1.0, 0.0
            if row[c] != 0.0:
                cosine, sine = upper[j, 0] / r, row[c] / r
            cosines[i, c], sines[i, c] = cosine, sine
            for b in range(k - c):
                above, below = upper[j, b], row[c + b]
                upper[j, b] = cosine * above + sine * below
                row[c + b] = cosine * below - sine * above


@kernel
def solve_rotated(first: Indices, upper: Floats, cosines: Floats, sines: Floats, right: Floats, out: Floats) -> None:
    """Solve least squares for the right-hand sides ``right`` (before, m, after) into ``out`` (before, n, after)."""
    k = upper.shape[1]
    n = len(upper)
    line = np.empty(right.shape[2])
    for b in range(len(right)):
        solution = out[b]
        solution[:] = 0.0
        for i in range(len(first)):
            line[:] = right[b, i]
            for c in range(k):
                cosine, sine = cosines[i, c], sines[i, c]
                if sine != 0.0:
                    target = solution[first[i] + c]
                    for a in range(len(line)):
                        above, below = target[a], line[a]
                        target[a] = cosine * above + sine * below
                        line[a] = cosine * below - sine * above
        for j in range(n - 1, -1, -1):
            target = solution[j]
            for c in range(1, min(k, n - j)):
                factor, other = upper[j, c], solution[j + c]
                for a in range(len(target)):
                    target[a] -= factor * other[a]
            for a in range(len(target)):
                target[a] /= upper[j, 0]
