"""Degree reduction: the nearest spline of lower degree, and a certified bound of the change."""

import numpy as np

from bvbedit.errors import BvbError
from bvbedit.spline.arguments import is_whole, shown
from bvbedit.spline.banded import Banded
from bvbedit.spline.knots import Floats
from bvbedit.spline.refinement import elevation, insertion


def reduced(t: Floats, p: int, net: Floats, axis: int, by: int, held: tuple[int, int]) -> tuple[Floats, Floats, float]:
    """Return knots, control points along ``axis`` and the bound of the change, with degree p reduced by ``by``.

    Interior knots lose ``by`` copies, but keep one: what elevation added goes, and no more smoothness is asked for than
    there was. Both splines are exact over the knots of degree p that hold those of either; there the control points of
    their difference are smallest in the least-squares sense, with ``held`` of them zero at either end.
    The bound is the largest of them. Raises BvbError where the new degree has not so many end values and derivatives.
    """
    low, high = held
    values, counts = np.unique(t, return_counts=True)
    counts = np.maximum(counts - by, 1)
    counts[[0, -1]] = p - by + 1
    coarse = np.repeat(values, counts)
    n = len(coarse) - p + by - 1
    if max(held) > p - by + 1 or low + high > n:
        raise BvbError(
            f"Axis {axis}: degree {p - by} with {n} control points cannot hold {held} at its ends. Hold fewer."
        )
    raised, up = elevation(coarse, p - by, by)
    old, new = np.unique(t, return_counts=True)[1], np.unique(raised, return_counts=True)[1]
    common = np.repeat(values, np.maximum(old, new))
    up = insertion(raised, p, common).after(up)
    wanted = insertion(t, p, common).apply(net, axis)
    m = len(up.rows)
    reduced_net = np.zeros((*net.shape[:axis], n, *net.shape[axis + 1 :]))
    at: list[slice] = [slice(None)] * net.ndim
    # At the ends the equations are triangular. What is between them comes last, without what they explain.
    for columns, rows in (
        (slice(0, low), slice(0, low)),
        (slice(n - high, n), slice(m - high, m)),
        (slice(low, n - high), slice(0, m)),
    ):
        if columns.start < columns.stop:
            at[axis] = rows
            rest = wanted[tuple(at)] - up.apply(reduced_net, axis)[tuple(at)]
            part = Banded(up.first[rows], up.rows[rows], n).between(columns.start, columns.stop)
            at[axis] = columns
            reduced_net[tuple(at)] = part.solve(rest, axis)
    return coarse, reduced_net, float(np.abs(up.apply(reduced_net, axis) - wanted).max())


def checked_reduction(p: int, by: object, axis: int) -> int:
    """Return ``by`` as int. Raises BvbError where degree p - ``by`` would fall below 0."""
    if not is_whole(by) or not 0 <= by <= p:
        raise BvbError(f"Axis {axis}: degree {p} cannot be reduced by {shown(by)}. Choose a whole number in 0 ... {p}.")
    return int(by)
