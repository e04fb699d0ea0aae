"""Knot insertion and degree elevation as banded matrices: other control points of the same spline.

Each new control point is a blossom of the old ones, built of convex combinations (Lyche & Morken 1986), so that the
entries are right to a few ulps of themselves for all knots and degrees. Interpolation at the new Greville abscissae,
which gives the same matrices, loses digits where knots nearly coincide.
"""

import numpy as np
from numpy.typing import ArrayLike

from bvbedit.errors import BvbError
from bvbedit.spline.arguments import is_whole, real_array, shown
from bvbedit.spline.banded import Banded
from bvbedit.spline.knots import MAX_DEGREE, Floats, checked_knots


def insertion(t: Floats, p: int, fine: Floats) -> Banded:
    """Return the matrix from control points over the knots ``t`` to those over ``fine``, which contain ``t``."""
    return _blossoms(t, p, fine, p)


def elevation(t: Floats, p: int, by: int) -> tuple[Floats, Banded]:
    """Return the knots, each ``by`` times more, and the matrix that raise the degree p of knots ``t`` by ``by``."""
    matrix = None
    for q in range(p + 1, p + by + 1):
        values, counts = np.unique(t, return_counts=True)
        fine = np.repeat(values, counts + 1)
        step = _blossoms(t, q - 1, fine, q)
        matrix = step if matrix is None else step.after(matrix)
        t = fine
    return t, matrix if matrix is not None else identity(len(t) - p - 1)


def identity(n: int) -> Banded:
    """Return the identity matrix (n, n)."""
    return Banded(np.arange(n), np.ones((n, 1)), n)


def _blossoms(t: Floats, p: int, fine: Floats, q: int) -> Banded:
    from bvbedit.jit import frozen
    from bvbedit.spline import refinement_kernels

    m = len(fine) - q - 1
    first, rows = np.empty(m, dtype=np.int64), np.empty((m, p + 1))
    refinement_kernels.blossom_rows(frozen(t), p, frozen(fine), q, first, rows)
    return Banded(first, rows, len(t) - p - 1)


def with_inserted(t: Floats, p: int, values: ArrayLike, axis: int) -> Floats:
    """Return the knots ``t`` of ``axis`` with ``values`` among them.

    Raises BvbError that names axis, index and value for what is no increasing row inside the domain, and for more than
    p + 1 copies of a knot.
    """
    x = np.atleast_1d(real_array(values, f"Knots to insert on axis {axis}"))
    if x.ndim != 1:
        raise BvbError(f"Knots to insert on axis {axis} have shape {x.shape}. Give one row.")
    outside = ~((x > t[0]) & (x < t[-1]))  # true for nan too
    if outside.any():
        i = int(np.flatnonzero(outside)[0])
        raise BvbError(
            f"Axis {axis}: knot {i} to insert is {x[i]}, not inside the domain ({t[0]}, {t[-1]}). Stay inside."
        )
    if (np.diff(x) < 0).any():
        i = int(np.flatnonzero(np.diff(x) < 0)[0]) + 1
        raise BvbError(f"Axis {axis}: knot {i} to insert is {x[i]}, below the one before, {x[i - 1]}. Sort them.")
    new, count = np.unique(x, return_counts=True)
    copies = count + np.searchsorted(t, new, side="right") - np.searchsorted(t, new, side="left")
    if (copies > p + 1).any():
        k = int(np.flatnonzero(copies > p + 1)[0])
        i = int(np.searchsorted(x, new[k], side="right")) - 1
        raise BvbError(
            f"Axis {axis}: knot {i} to insert is {new[k]}, which would stand {copies[k]} times. "
            f"Degree {p} allows {p + 1}."
        )
    return checked_knots_of(axis, np.sort(np.concatenate([t, x])), p)


def containing(t: Floats, p: int, target: ArrayLike, axis: int) -> Floats:
    """Return ``target`` if it is a knot vector of degree p over the same domain that contains ``t`` of ``axis``.

    Raises BvbError that names axis, index and value otherwise.
    """
    fine = checked_knots_of(axis, target, p)
    values, count = np.unique(t, return_counts=True)
    copies = np.searchsorted(fine, values, side="right") - np.searchsorted(fine, values, side="left")
    if (copies < count).any():
        k = int(np.flatnonzero(copies < count)[0])
        i = int(np.searchsorted(t, values[k]))
        raise BvbError(
            f"Axis {axis}: knot {i} = {values[k]} stands {count[k]} times, and {copies[k]} in the knots asked for. "
            "Refining only adds knots."
        )
    if fine[0] != t[0] or fine[-1] != t[-1]:
        raise BvbError(
            f"Axis {axis}: the knots asked for span [{fine[0]}, {fine[-1]}], not [{t[0]}, {t[-1]}]. Keep the domain."
        )
    return fine


def divided(t: Floats, p: int, factor: object, axis: int) -> Floats:
    """Return the knots ``t`` of ``axis`` with each span cut into ``factor`` equal parts."""
    if not is_whole(factor) or factor < 1:
        raise BvbError(f"Axis {axis}: a factor of {shown(factor)} refines nothing. Choose a whole number >= 1.")
    if factor * len(t) > LARGEST_REFINEMENT:
        raise BvbError(f"Axis {axis}: {shown(factor)} parts of {len(t)} knots are too many. Choose a smaller factor.")
    values = np.unique(t)
    shares = np.arange(1, factor) / factor
    inside = (values[:-1, None] + np.diff(values)[:, None] * shares).ravel()
    fine = np.sort(np.concatenate([t, inside]))
    if len(np.unique(inside)) < len(inside) or np.isin(inside, values).any():
        raise BvbError(f"Axis {axis}: its narrowest span has no {shown(factor)} parts in float64. Insert knots singly.")
    return checked_knots_of(axis, fine, p)


# Knots of one axis after a division.
LARGEST_REFINEMENT = 1 << 22


def checked_elevation(p: int, by: object, axis: int) -> int:
    """Return ``by`` as int. Raises BvbError where degree p + ``by`` would pass 16."""
    if not is_whole(by) or not 0 <= by <= MAX_DEGREE - p:
        raise BvbError(
            f"Axis {axis}: degree {p} cannot be raised by {shown(by)}. Choose a whole number in 0 ... {MAX_DEGREE - p}."
        )
    return int(by)


def checked_knots_of(axis: int, t: ArrayLike, p: int) -> Floats:
    """Return ``checked_knots``. Raises BvbError that names the axis too."""
    try:
        return checked_knots(t, p)
    except BvbError as error:
        raise BvbError(f"Axis {axis}: {error}") from None
