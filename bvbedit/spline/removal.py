"""Knot removal: the cheapest knots go first, and the change is certified.

What one knot's removal costs, and how the control points then stand, is the best approximation of the old control
points in the maximum norm. The bound of the whole change is the largest control point of the difference spline, brought
back to the old knots: its convex hull (Piegl & Tiller, The NURBS Book, section 5.4, bound each step instead).
"""

import numpy as np

from bvbedit.spline.knots import Floats
from bvbedit.spline.refinement import insertion


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

    def remove(budget: float, most: int) -> tuple[int, float]:
        return removal_kernels.remove_cheapest(knots, p, rows, row_of, n, held[0], held[1], costs, may_go, budget, most)

    def bound() -> float:
        return change(t, p, net, knots[: n + p + 1], rows[row_of[:n]])

    spent = 0.0
    while most > 0:
        removed, cost = remove(tolerance - spent, most)
        n, most, spent = n - removed, most - removed, spent + cost
        if removed == 0:
            # The sum of the costs forbids the next removal; what it truly changes may be less.
            before = knots.copy(), rows.copy(), row_of.copy()
            removed, _ = remove(np.inf, 1)
            n, most, spent = n - removed, most - removed, bound()
            if spent > tolerance:
                (knots, rows, row_of), n = before, n + removed
            if spent > tolerance or removed == 0:
                break
    return knots[: n + p + 1].copy(), rows[row_of[:n]], bound()


def change(t: Floats, p: int, net: Floats, coarse: Floats, rows: Floats) -> float:
    """Return the largest control point, over the knots ``t``, of the difference of ``net`` and ``rows``."""
    there = rows if len(rows) == len(net) else insertion(coarse, p, t).apply(rows, 0)
    with np.errstate(over="ignore", invalid="ignore"):
        largest = float(np.abs(there - net).max())
    # What overflows is no bound, and no tolerance allows it.
    return largest if np.isfinite(largest) else np.inf
