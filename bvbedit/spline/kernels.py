"""Compiled loops of the spline room. Inputs are taken to be right: contiguous, in range, in the domain."""

import numpy as np
from numba import prange
from numpy.typing import NDArray

from bvbedit.jit import inlined_kernel, kernel, parallel_kernel

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

# Values of one row worked on at once in the kernels that pass over a band twice: what they need stays in the
# second-level cache.
CHUNK = 1536
# Contiguous runs shorter than this, as the channels of the last axis, do not pay for slices.
SHORT = 16
# Rows that a thread takes at once.
ROWS = 8


# Loops run over slices taken beforehand: indices that start at zero are known not to wrap, so that they vectorise
# (2.5 times faster on a 91 x 91 x 361 x 3 grid). The first four rows of a band are added in one pass for the same gain.


@kernel
def band_row(row: Floats, x: Floats, out: Floats) -> None:
    """out = sum_j row[j] x[j, :]."""
    done = 0
    if len(row) >= 4:
        r0, r1, r2, r3 = row[0], row[1], row[2], row[3]
        x0, x1, x2, x3 = x[0], x[1], x[2], x[3]
        for a in range(len(out)):
            out[a] = r0 * x0[a] + r1 * x1[a] + r2 * x2[a] + r3 * x3[a]
        done = 4
    else:
        out[:] = 0.0
    for j in range(done, len(row)):
        r, xj = row[j], x[j]
        for a in range(len(out)):
            out[a] += r * xj[a]


@kernel
def band_column(row: Floats, x: Floats, out: Floats) -> None:
    """out[j, :] += row[j] x."""
    done = 0
    if len(row) >= 4:
        r0, r1, r2, r3 = row[0], row[1], row[2], row[3]
        o0, o1, o2, o3 = out[0], out[1], out[2], out[3]
        for a in range(len(x)):
            o0[a] += r0 * x[a]
            o1[a] += r1 * x[a]
            o2[a] += r2 * x[a]
            o3[a] += r3 * x[a]
        done = 4
    for j in range(done, len(row)):
        r, oj = row[j], out[j]
        for a in range(len(x)):
            oj[a] += r * x[a]


@kernel
def apply_rows(first: Indices, rows: Floats, x: Floats, out: Floats, start: int, stop: int) -> None:
    """out[i, :] = sum_j rows[i, j] x[first[i] + j, :] for i from ``start`` to before ``stop``."""
    after, k = x.shape[1], rows.shape[1]
    if after >= SHORT:
        for i in range(start, stop):
            band_row(rows[i], x[first[i] : first[i] + k], out[i])
        return
    # Unsigned indices are known not to count from the end.
    one, two, three = np.uint64(1), np.uint64(2), np.uint64(3)
    for i in range(start, stop):
        f = np.uint64(first[i])
        if k >= 4:
            r0, r1, r2, r3 = rows[i, 0], rows[i, 1], rows[i, 2], rows[i, 3]
        if k >= 4 and after == 3:
            # RGB, without the bookkeeping of a short loop: 1.4 times as fast.
            out[i, 0] = r0 * x[f, 0] + r1 * x[f + one, 0] + r2 * x[f + two, 0] + r3 * x[f + three, 0]
            out[i, 1] = r0 * x[f, 1] + r1 * x[f + one, 1] + r2 * x[f + two, 1] + r3 * x[f + three, 1]
            out[i, 2] = r0 * x[f, 2] + r1 * x[f + one, 2] + r2 * x[f + two, 2] + r3 * x[f + three, 2]
        else:
            for a in range(after):
                out[i, a] = 0.0
                if k >= 4:
                    out[i, a] = r0 * x[f, a] + r1 * x[f + one, a] + r2 * x[f + two, a] + r3 * x[f + three, a]
        for j in range(4 if k >= 4 else 0, k):
            r, at = rows[i, j], f + np.uint64(j)
            for a in range(after):
                out[i, a] += r * x[at, a]


@kernel
def apply_banded(first: Indices, rows: Floats, x: Floats, out: Floats) -> None:
    """out[b, i, :] = sum_j rows[i, j] x[b, first[i] + j, :]."""
    for b in range(len(x)):
        apply_rows(first, rows, x[b], out[b], 0, len(rows))


@parallel_kernel
def apply_banded_shared(first: Indices, rows: Floats, x: Floats, out: Floats) -> None:
    """Do what ``apply_banded`` does, on all threads."""
    m = len(rows)
    blocks = (m + ROWS - 1) // ROWS
    for piece in prange(len(x) * blocks):
        b, start = piece // blocks, ROWS * (piece % blocks)
        apply_rows(first, rows, x[b], out[b], start, min(start + ROWS, m))


@kernel
def largest_size(x: Floats) -> float:
    """Return max |x[a]|, by four running maxima, as each step waits for the one before it."""
    m0 = m1 = m2 = m3 = 0.0
    last = len(x) - len(x) % 4
    for a in range(0, last, 4):
        m0 = max(m0, abs(x[a]))
        m1 = max(m1, abs(x[a + 1]))
        m2 = max(m2, abs(x[a + 2]))
        m3 = max(m3, abs(x[a + 3]))
    for a in range(last, len(x)):
        m0 = max(m0, abs(x[a]))
    return max(max(m0, m1), max(m2, m3))


@kernel
def largest_difference(first: Indices, rows: Floats, x: Floats, y: Floats) -> float:
    """Return the largest |A x - y|, A banded along the second axis of ``x``."""
    m, after = len(rows), x.shape[2]
    image = np.empty((m, after))
    flat = image.reshape(-1)
    largest = 0.0
    for b in range(len(x)):
        apply_rows(first, rows, x[b], image, 0, m)
        there = y[b].reshape(-1)
        for a in range(len(flat)):
            flat[a] -= there[a]
        largest = max(largest, largest_size(flat))
    return largest


@parallel_kernel
def apply_banded_transposed(first: Indices, rows: Floats, x: Floats, out: Floats) -> None:
    """out[b, first[i] + j, :] += rows[i, j] x[b, i, :]; ``out`` starts as zeros."""
    before, m, after = x.shape
    k = rows.shape[1]
    chunks = (after + CHUNK - 1) // CHUNK
    for piece in prange(before * chunks):
        b, start = piece // chunks, CHUNK * (piece % chunks)
        stop = min(start + CHUNK, after)
        for i in range(m):
            band_column(rows[i], x[b, i, start:stop], out[b, first[i] : first[i] + k, start:stop])


@parallel_kernel
def weighted_normal(first: Indices, rows: Floats, weights: Floats, x: Floats, out: Floats) -> None:
    """out = A^T W A x along the first axis, without ever storing A x.

    A is banded (m, n), ``x`` and ``out`` are (n, columns * channels), and ``weights`` (m, columns) belong to the
    ``channels`` neighbouring values of a column alike.
    """
    columns = weights.shape[1]
    m, k = rows.shape
    channels = x.shape[1] // columns
    width = max(1, CHUNK // channels)
    for piece in prange((columns + width - 1) // width):
        start = width * piece
        stop = min(start + width, columns)
        x_piece = x[:, start * channels : stop * channels]
        out_piece = out[:, start * channels : stop * channels]
        out_piece[:] = 0.0
        line = np.empty((stop - start) * channels)
        for i in range(m):
            band_row(rows[i], x_piece[first[i] : first[i] + k], line)
            w = weights[i, start:stop]
            for a in range(len(w)):
                for c in range(channels):
                    line[a * channels + c] *= w[a]
            band_column(rows[i], line, out_piece[first[i] : first[i] + k])


@inlined_kernel
def locate(x: float, knots: Floats, bins: Indices, scale: float, last: int) -> int:
    """Return the span of ``x`` by way of ``bins``, the spans at the left ends of equal bins of width 1/scale."""
    span = bins[min(int((x - knots[0]) * scale), len(bins) - 1)]
    while span < last and x >= knots[span + 1]:
        span += 1
    while x < knots[span]:  # rounding put x one bin too far
        span -= 1
    return int(span)


@inlined_kernel
def cubic(polynomials: Floats, span: int, i: int, t: float) -> float:
    """Return basis function i of a span at the local parameter ``t`` in [0, 1], by its powers (spans, 4, 4)."""
    high = polynomials[span, i, 2] + t * polynomials[span, i, 3]
    return float(polynomials[span, i, 0] + t * (polynomials[span, i, 1] + t * high))


@parallel_kernel
def evaluate_cubic_rgb(
    points: Floats,
    knots_0: Floats,
    knots_1: Floats,
    knots_2: Floats,
    bins_0: Indices,
    bins_1: Indices,
    bins_2: Indices,
    polynomials_0: Floats,
    polynomials_1: Floats,
    polynomials_2: Floats,
    control: Floats,
    out: Floats,
) -> None:
    """Evaluate a tricubic volume with three channels at ``points`` (n, 3) into ``out`` (n, 3).

    ``polynomials`` (spans, 4, 4) are the basis functions of each span in powers of the local parameter in [0, 1].
    The twelve scalars a .. l gather four neighbouring control points along the last axis, three channels each: they
    stay in vector registers, which an array of accumulators does not.
    """
    n0, n1, n2 = control.shape[0], control.shape[1], control.shape[2]
    scale_0 = len(bins_0) / (knots_0[-1] - knots_0[0])
    scale_1 = len(bins_1) / (knots_1[-1] - knots_1[0])
    scale_2 = len(bins_2) / (knots_2[-1] - knots_2[0])
    flat = control.reshape(-1)
    row, plane = np.uint64(3 * n2), np.uint64(3 * n1 * n2)
    for n in prange(len(points)):
        s0 = locate(points[n, 0], knots_0, bins_0, scale_0, n0 - 1)
        s1 = locate(points[n, 1], knots_1, bins_1, scale_1, n1 - 1)
        s2 = locate(points[n, 2], knots_2, bins_2, scale_2, n2 - 1)
        t0 = (points[n, 0] - knots_0[s0]) / (knots_0[s0 + 1] - knots_0[s0])
        t1 = (points[n, 1] - knots_1[s1]) / (knots_1[s1 + 1] - knots_1[s1])
        t2 = (points[n, 2] - knots_2[s2]) / (knots_2[s2 + 1] - knots_2[s2])
        a = b = c = d = e = f = g = h = i = j = k = l = 0.0  # noqa: E741
        corner = np.uint64(s0 - 3) * plane + np.uint64(s1 - 3) * row + np.uint64(3 * (s2 - 3))
        for u in range(4):
            wu = cubic(polynomials_0, s0, u, t0)
            for v in range(4):
                w = wu * cubic(polynomials_1, s1, v, t1)
                at = corner + np.uint64(u) * plane + np.uint64(v) * row
                a += w * flat[at]
                b += w * flat[at + np.uint64(1)]
                c += w * flat[at + np.uint64(2)]
                d += w * flat[at + np.uint64(3)]
                e += w * flat[at + np.uint64(4)]
                f += w * flat[at + np.uint64(5)]
                g += w * flat[at + np.uint64(6)]
                h += w * flat[at + np.uint64(7)]
                i += w * flat[at + np.uint64(8)]
                j += w * flat[at + np.uint64(9)]
                k += w * flat[at + np.uint64(10)]
                l += w * flat[at + np.uint64(11)]  # noqa: E741
        w0, w1 = cubic(polynomials_2, s2, 0, t2), cubic(polynomials_2, s2, 1, t2)
        w2, w3 = cubic(polynomials_2, s2, 2, t2), cubic(polynomials_2, s2, 3, t2)
        out[n, 0] = w0 * a + w1 * d + w2 * g + w3 * j
        out[n, 1] = w0 * b + w1 * e + w2 * h + w3 * k
        out[n, 2] = w0 * c + w1 * f + w2 * i + w3 * l


@kernel
def basis_into(knots: Floats, degree: int, span: int, x: float, out: Floats) -> None:
    """Write the degree + 1 basis functions of ``span`` at ``x`` into ``out`` (The NURBS Book, algorithm A2.2)."""
    out[0] = 1.0
    for j in range(1, degree + 1):
        saved = 0.0
        for r in range(j):
            right, left = knots[span + r + 1], knots[span + r + 1 - j]
            share = out[r] / (right - left)
            out[r] = saved + (right - x) * share
            saved = (x - left) * share
        out[j] = saved


@kernel
def basis_at(knots: Floats, degree: int, spans: Indices, points: Floats, out: Floats) -> None:
    """Do what ``basis_into`` does for ``points`` (n,) in their ``spans`` (n,), into ``out`` (n, p + 1)."""
    for n in range(len(points)):
        basis_into(knots, degree, spans[n], points[n], out[n])


@parallel_kernel
def evaluate_any(
    points: Floats,
    degrees: Indices,
    knots: Floats,
    starts: Indices,
    spans: Indices,
    control: Floats,
    out: Floats,
) -> None:
    """Evaluate a volume of four parameters, any degrees and any channels, at ``points`` (n, 4) into ``out`` (n, c).

    ``knots`` holds the four knot vectors one after another, axis a from ``starts[a]`` on; ``spans`` (n, 4) are known.
    """
    channels = control.shape[4]
    blocks = (len(points) + 255) // 256
    for block in prange(blocks):
        basis = np.empty((4, 17))
        for n in range(256 * block, min(256 * block + 256, len(points))):
            for a in range(4):
                t = knots[starts[a] : starts[a + 1]]
                basis_into(t, degrees[a], spans[n, a], points[n, a], basis[a])
            first = spans[n] - degrees
            for c in range(channels):
                out[n, c] = 0.0
            for i in range(degrees[0] + 1):
                for j in range(degrees[1] + 1):
                    wij = basis[0, i] * basis[1, j]
                    for k in range(degrees[2] + 1):
                        wijk = wij * basis[2, k]
                        for m in range(degrees[3] + 1):
                            w = wijk * basis[3, m]
                            for c in range(channels):
                                out[n, c] += w * control[first[0] + i, first[1] + j, first[2] + k, first[3] + m, c]
