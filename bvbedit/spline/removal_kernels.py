"""Compiled loops of knot removal. Inputs are taken to be right, as in ``kernels``.

A net is (n, lines), and ``row_of`` (n,) names the row in which each of its control points is stored, so that taking one
out moves no others. Knot r is always the last of its copies.
"""

import numpy as np
from numpy.typing import NDArray

from bvbedit.jit import kernel
from bvbedit.spline.kernels import largest_size

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

# Products of quotients of knots are kept below this.
LARGE = 1e150
# Lines worked on at once, so that a sum over control points stays in the first-level cache.
CHUNK = 1024


@kernel
def null_vector(t: Floats, p: int, r: int, alpha: Floats, y: Floats) -> tuple[int, int]:
    """Return the first index and number of the control points that see knot r, with the vector ``y`` beside them.

    Without knot r a net P would give Q_i = alpha_i P_i + (1 - alpha_i) P_{i-1} (Boehm 1980): one equation more than
    unknowns. ``y`` is what makes y . Q = 0 for all such Q; ``alpha[i]`` are those factors, 1 for the first, 0 for the
    last.
    """
    z = t[r]
    low = r
    while t[low - 1] == z:
        low -= 1
    first = r - 1 - p
    count = low - first + 1
    alpha[0] = 1.0
    y[0] = 1.0
    for i in range(1, count):
        if i < count - 1:
            left, right = t[first + i], t[first + i + p + 1]
            alpha[i] = (z - left) / (right - left)
            beta = (right - z) / (right - left)
        else:
            alpha[i], beta = 0.0, 1.0
        y[i] = -y[i - 1] * alpha[i - 1] / beta
        if abs(y[i]) > LARGE:
            for j in range(i + 1):
                y[j] /= LARGE
    return first, count


@kernel
def free_share(y: Floats, first: int, count: int, n: int, held_0: int, held_1: int) -> float:
    """Return sum |y| over those of the n control points that may change; ``y[count:]`` gets y, 0 for the others."""
    total = 0.0
    for i in range(count):
        y[count + i] = y[i] if held_0 <= first + i < n - held_1 else 0.0
        total += abs(y[count + i])
    return total


@kernel
def null_product(y: Floats, share: float, net: Floats, rows: Indices, start: int, out: Floats) -> None:
    """out = sum_i y[i] / share net[rows[i], start : start + len(out)], two rows in one pass."""
    out[:] = 0.0
    count, stop = len(rows), start + len(out)
    for i in range(0, count - 1, 2):
        y0, y1, x0, x1 = y[i] / share, y[i + 1] / share, net[rows[i], start:stop], net[rows[i + 1], start:stop]
        for a in range(len(out)):
            out[a] += y0 * x0[a] + y1 * x1[a]
    if count % 2:
        y0, x0 = y[count - 1] / share, net[rows[count - 1], start:stop]
        for a in range(len(out)):
            out[a] += y0 * x0[a]


@kernel
def replace_row(x: Floats, neighbour: Floats, share: float, own: float) -> None:
    """x = (x - share neighbour) / own."""
    for a in range(len(x)):
        x[a] = (x[a] - share * neighbour[a]) / own


@kernel
def removal_cost(
    t: Floats, p: int, r: int, net: Floats, row_of: Indices, n: int, held_0: int, held_1: int, alpha: Floats, y: Floats
) -> float:
    """Return the least largest change of a control point with which knot r can go: max |y . Q| / sum |y|.

    The first ``held_0`` and the last ``held_1`` of the n control points may not take part in the change.
    """
    first, count = null_vector(t, p, r, alpha, y)
    share = free_share(y, first, count, n, held_0, held_1)
    if share == 0.0:
        return np.inf
    rows = row_of[first : first + count]
    lines = net.shape[1]
    total = np.empty(min(CHUNK, lines))
    largest = 0.0
    for start in range(0, lines, CHUNK):
        part = total[: min(CHUNK, lines - start)]
        null_product(y, share, net, rows, start, part)
        largest = max(largest, largest_size(part))
    return largest


@kernel
def remove_one(
    t: Floats, p: int, r: int, net: Floats, row_of: Indices, n: int, held_0: int, held_1: int, alpha: Floats, y: Floats
) -> None:
    """Take knot r out of ``t`` and one control point out of ``net``, both in place.

    The inconsistent equations are met best in the maximum norm by spreading y . Q with equal size and the signs of y.
    Then they are solved from both sides to where alpha passes 1/2, so that no step enlarges an error.
    """
    first, count = null_vector(t, p, r, alpha, y)
    share = free_share(y, first, count, n, held_0, held_1)
    # Left of the middle an equation yields its own control point, right of it the one before.
    middle = 0
    while middle + 1 < count - 1 and alpha[middle + 1] >= 0.5:
        middle += 1
    rows = row_of[first : first + count].copy()
    total = np.empty(net.shape[1])
    null_product(y, share, net, rows, 0, total)
    for i in range(count):
        if y[count + i] != 0.0:
            sign, row = np.sign(y[i]), net[rows[i]]
            for a in range(len(row)):
                row[a] -= sign * total[a]
    for i in range(1, middle + 1):
        replace_row(net[rows[i]], net[rows[i - 1]], 1.0 - alpha[i], alpha[i])
    # From the right, control point i - 1 comes from equation i: until the end it is stored one row later.
    for i in range(count - 2, middle + 1, -1):
        replace_row(net[rows[i]], net[rows[i + 1]], alpha[i], 1.0 - alpha[i])
    # What stands in row middle + 1 was the equation left over.
    for i in range(first + middle + 1, n - 1):
        row_of[i] = row_of[i + 1]
    for i in range(r, len(t) - 1):
        t[i] = t[i + 1]


@kernel
def remove_cheapest(
    t: Floats,
    p: int,
    net: Floats,
    row_of: Indices,
    n: int,
    held_0: int,
    held_1: int,
    costs: Floats,
    may_go: NDArray[np.bool_],
    budget: float,
    most: int,
) -> tuple[int, float, float]:
    """Remove the knot that costs least, again and again, while the costs sum up to ``budget`` at most.

    ``costs`` (knots,) hold the cost of each knot, nan where it is to be computed; ``may_go`` (knots,) tells which of
    them may be removed. Returns the number of removed knots, ``most`` at most, the sum of their costs,
    and the cost of the next one.
    """
    alpha, y = np.empty(p + 2), np.empty(2 * (p + 2))
    removed, spent = 0, 0.0
    while True:
        best, r = np.inf, -1
        for k in range(p + 1, n):
            if np.isnan(costs[k]):
                costs[k] = np.inf
                if may_go[k] and t[k + 1] > t[k]:
                    costs[k] = removal_cost(t, p, k, net, row_of, n, held_0, held_1, alpha, y)
            if costs[k] < best:
                best, r = costs[k], k
        if r < 0 or spent + best > budget or removed == most:
            return removed, spent, best
        remove_one(t[: n + p + 1], p, r, net, row_of, n, held_0, held_1, alpha, y)
        spent += best
        removed += 1
        n -= 1
        for k in range(r, n + p + 1):
            costs[k], may_go[k] = costs[k + 1], may_go[k + 1]
        for k in range(max(p + 1, r - p - 1), min(n, r + p + 2)):
            costs[k] = np.nan


@kernel
def to_lines(net: Floats, rows: Floats) -> None:
    """Lay ``net`` (before, n, after) out as ``rows`` (n, before * after): a line for each column."""
    before, n, after = net.shape
    for b in range(before):
        for i in range(n):
            for a in range(after):
                rows[i, b * after + a] = net[b, i, a]


@kernel
def from_lines(rows: Floats, row_of: Indices, net: Floats) -> None:
    """Put the rows named by ``row_of`` (n,) back into ``net`` (before, n, after)."""
    before, n, after = net.shape
    for b in range(before):
        for i in range(n):
            row = rows[row_of[i]]
            for a in range(after):
                net[b, i, a] = row[b * after + a]
