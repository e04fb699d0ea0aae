"""Degree reduction: the nearest spline of lower degree, and a certified bound of the change."""

import numpy as np

from bvbedit.errors import BvbError
from bvbedit.spline.arguments import is_whole, shown
from bvbedit.spline.knots import Floats
from bvbedit.spline.refinement import elevation, insertion


def reduced(t: Floats, p: int, net: Floats, axis: int, by: int, held: tuple[int, int]) -> tuple[Floats, Floats, float]:
    """Return knots, control points along ``axis`` and the bound of the change, with degree p reduced by ``by``.

    Interior knots lose ``by`` copies, but keep one: what elevation added goes, and no more smoothness is asked for than
    there was. Both splines are exact over the knots of degree p that hold those of either; there the control points of
    their difference are smallest in the least-squares sense, with ``held`` control points at either end as they were.
    The bound is the largest of them.
    """
    values, counts = np.unique(t, return_counts=True)
    counts = np.maximum(counts - by, 1)
    counts[[0, -1]] = p - by + 1
    coarse = np.repeat(values, counts)
    n = len(coarse) - p + by - 1
    raised, up = elevation(coarse, p - by, by)
    old, new = np.unique(t, return_counts=True)[1], np.unique(raised, return_counts=True)[1]
    common = np.repeat(values, np.maximum(old, new))
    up = insertion(raised, p, common).after(up)
    wanted = insertion(t, p, common).apply(net, axis)
    # A single control point cannot hold both ends.
    low, high = held if n >= sum(held) and p > by else (0, 0)
    ends = np.zeros((*net.shape[:axis], n, *net.shape[axis + 1 :]))
    at: list[slice] = [slice(None)] * net.ndim
    for rows in (slice(0, low), slice(n - high, n)):
        at[axis] = rows
        take = list(at)
        take[axis] = rows if rows.start == 0 else slice(net.shape[axis] - high, None)
        ends[tuple(at)] = net[tuple(take)]
    if low + high < n:
        at[axis] = slice(low, n - high)
        ends[tuple(at)] = up.between(low, n - high).solve(wanted - up.apply(ends, axis), axis)
    return coarse, ends, float(np.abs(up.apply(ends, axis) - wanted).max())


def checked_reduction(p: int, by: object, axis: int) -> int:
    """Return ``by`` as int. Raises BvbError where degree p - ``by`` would fall below 0."""
    if not is_whole(by) or not 0 <= by <= p:
        raise BvbError(f"Axis {axis}: degree {p} cannot be reduced by {shown(by)}. Choose a whole number in 0 ... {p}.")
    return int(by)
