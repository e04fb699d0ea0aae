"""Knot removal: the cheapest knots go first, and the change is certified.

What one knot's removal costs, and how the control points then stand, is the best approximation of the old control
points in the maximum norm. The bound of the whole change is the largest control point of the difference spline, brought
back to the old knots: its convex hull (Piegl & Tiller, The NURBS Book, section 5.4, bound each step instead).
"""

import numpy as np

from bvbedit.spline.knots import Floats
from bvbedit.spline.refinement import insertion

# Ulps of the largest control point.
ROUNDING = 16.0


def remove_within(
    t: Floats, p: int, net: Floats, tolerance: float, held: tuple[int, int], at: float | None = None, most: int = -1
) -> tuple[Floats, Floats, float]:
    """Return knots, control points (n', lines) and the bound of the change, <= ``tolerance``, of ``net`` (n, lines).

    ``held`` control points at either end stay. With ``at`` only copies of that knot may go, ``most`` of them at most.
    """
    from bvbedit.spline import removal_kernels

    n = len(net)
    most = n if most < 0 else most
    knots, rows, row_of = t.copy(), net.copy(), np.arange(n)
    costs, may_go = np.full(len(t), np.nan), np.ones(len(t), dtype=bool) if at is None else t == at

    def remove(budget: float, most: int) -> tuple[int, float, float]:
        return removal_kernels.remove_cheapest(knots, p, rows, row_of, n, held[0], held[1], costs, may_go, budget, most)

    def bound() -> float:
        return change(t, p, net, knots[: n + p + 1], rows[row_of[:n]])

    spent = 0.0
    while most > 0:
        removed, cost, following = remove(tolerance - spent, most)
        n, most, spent = n - removed, most - removed, spent + cost
        # The next one alone changes more than the others can make up for.
        if not following - spent <= tolerance or most == 0:
            break
        if removed == 0:
            # The sum of the costs forbids the next removal; what it truly changes may be less.
            before = knots.copy(), rows.copy(), row_of.copy()
            remove(np.inf, 1)
            n, most, spent = n - 1, most - 1, bound()
            if spent > tolerance:
                (knots, rows, row_of), n = before, n + 1
                break
    if n == len(net):
        return t, net, 0.0
    return _settled(t, p, net, knots[: n + p + 1].copy(), rows[row_of[:n]], held)


def _settled(
    t: Floats, p: int, net: Floats, coarse: Floats, rows: Floats, held: tuple[int, int]
) -> tuple[Floats, Floats, float]:
    """Return ``coarse`` knots with control points ``rows``, or nearer ones, and the bound of the change.

    One removal after the other is not the best that the remaining knots allow. Least squares came 10 % nearer on models
    of measurements, and 40 times nearer at degree 16, where rounding adds up.
    """
    bound = change(t, p, net, coarse, rows)
    if bound <= ROUNDING * np.spacing(np.abs(net).max()):
        return coarse, rows, bound
    matrix = insertion(coarse, p, t)
    low, high = held[0], len(rows) - held[1]
    ends = np.concatenate([net[:low], np.zeros((high - low, net.shape[1])), net[len(net) - held[1] :]])
    ends[low:high] = matrix.between(low, high).solve(net - matrix.apply(ends, 0), 0)
    nearer = change(t, p, net, coarse, ends)
    return (coarse, ends, nearer) if nearer < bound else (coarse, rows, bound)


def change(t: Floats, p: int, net: Floats, coarse: Floats, rows: Floats) -> float:
    """Return the largest control point, over the knots ``t``, of the difference of ``net`` and ``rows``."""
    there = rows if len(rows) == len(net) else insertion(coarse, p, t).apply(rows, 0)
    with np.errstate(over="ignore", invalid="ignore"):
        largest = float(np.abs(there - net).max())
    # What overflows is no bound, and no tolerance allows it.
    return largest if np.isfinite(largest) else np.inf
