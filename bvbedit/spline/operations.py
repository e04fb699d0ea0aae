"""What is done to whole splines: joining, cutting to Bezier pieces, turning, stretching, multiplying."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bvbedit.errors import BvbError
from bvbedit.spline.arguments import is_real_within, is_whole, one_per_axis, shown
from bvbedit.spline.banded import Banded
from bvbedit.spline.basis import interpolation, limits
from bvbedit.spline.compatible import unite_knots
from bvbedit.spline.knots import MAX_DEGREE, Floats
from bvbedit.spline.refinement import checked_knots_of
from bvbedit.spline.tensor import TensorSpline, all_finite, assembled

# Of the largest control point: what joining two halves of one spline leaves as rounding.
JOIN_TOLERANCE = 2.0**-44
# Beyond this condition of the interpolation that gives a product's control points, half of the digits would be lost.
CONDITION_LIMIT = 1e8


def join(a: TensorSpline, b: TensorSpline, axis: int, tolerance: float | None = None) -> tuple[TensorSpline, float]:
    """Return the spline that is ``a`` and then ``b`` along ``axis``, and the certified bound of its change.

    The parts must meet: the domain of ``a`` ends on ``axis`` where that of ``b`` begins, and agrees on the others.
    Degrees and the other axes' knots are made equal. Of the knots where they meet as many are removed as ``tolerance``
    allows, by default rounding alone: what was split comes back whole, what does not fit keeps its jump.
    Raises BvbError where domains or channels do not suit, and for a tolerance below zero.
    """
    axis = a._axis(axis)
    if b.parameters != a.parameters or b.channels != a.channels:
        raise BvbError(f"{a!r} and {b!r} cannot be joined. Give splines of equal parameters and channels.")
    end, start = a.domain[axis][1], b.domain[axis][0]
    if end != start:
        raise BvbError(f"Axis {axis}: the first part ends at {end}, the second begins at {start}. Reparametrise one.")
    if tolerance is None:
        tolerance = JOIN_TOLERANCE * float(max(np.abs(a.control).max(), np.abs(b.control).max()))
    degree = max(a.degrees[axis], b.degrees[axis])
    a, b = (s.elevate(axis, degree - s.degrees[axis]) for s in (a, b))
    # On the other axes only: there both are as if each were extended over the other's part.
    (a, b), _ = unite_knots([a, b], [k for k in range(a.parameters) if k != axis])
    t = np.concatenate([a.knots[axis], b.knots[axis][degree + 1 :]])
    net = np.concatenate([a.control, b.control], axis=axis)
    whole = assembled(a.degrees, (*a.knots[:axis], t, *a.knots[axis + 1 :]), net)
    held = None if degree > 0 else (0, 0)
    return whole._without(axis, tolerance, held, end, degree + 1)


def to_bezier(spline: TensorSpline) -> NDArray[np.object_]:
    """Return the polynomial pieces (spans_1, ..., spans_d) of ``spline``, each a TensorSpline without interior knots.

    Their control points are the Bezier points of the pieces.
    """
    breaks = [np.unique(t) for t in spline.knots]
    for axis, (values, t, p) in enumerate(zip(breaks, spline.knots, spline.degrees, strict=True)):
        inside = values[1:-1]
        copies = np.searchsorted(t, inside, side="right") - np.searchsorted(t, inside, side="left")
        spline = spline.insert_knots(axis, np.repeat(inside, p + 1 - copies))
    pieces = np.empty(tuple(len(v) - 1 for v in breaks), dtype=object)
    for index in np.ndindex(pieces.shape):
        rows = (slice(i * (p + 1), (i + 1) * (p + 1)) for i, p in zip(index, spline.degrees, strict=True))
        knots = tuple(np.repeat(v[i : i + 2], p + 1) for i, v, p in zip(index, breaks, spline.degrees, strict=True))
        pieces[index] = assembled(spline.degrees, knots, spline.control[tuple(rows)].copy())
    return pieces


def reverse(spline: TensorSpline, axis: int) -> TensorSpline:
    """Return the spline run through backwards along ``axis``, over the same domain: V(a + b - u).

    At a jump the value stays that from the right. Raises BvbError for an unknown axis.
    """
    axis = spline._axis(axis)
    t = spline.knots[axis]
    turned = t[0] + (t[-1] - t[::-1])
    turned[t[::-1] == t[0]] = t[-1]
    return spline._with_axis(axis, spline.degrees[axis], turned, np.flip(spline.control, axis), trusted=False)


def permute(spline: TensorSpline, axes: Sequence[int]) -> TensorSpline:
    """Return the spline whose axis k is axis ``axes[k]`` of ``spline``.

    Raises BvbError where ``axes`` does not name each axis once.
    """
    order = one_per_axis(axes, "Axes")
    if not all(is_whole(a) for a in order) or sorted(order) != list(range(spline.parameters)):
        raise BvbError(f"{shown(axes)} is no order of the axes. Name each of 0 ... {spline.parameters - 1} once.")
    return assembled(
        tuple(spline.degrees[a] for a in order),
        tuple(spline.knots[a] for a in order),
        spline.control.transpose(*order, spline.parameters).copy(),
    )


def reparametrise(spline: TensorSpline, axis: int, start: float, end: float) -> TensorSpline:
    """Return the spline with the domain of ``axis`` mapped affinely to [start, end].

    Raises BvbError for an unknown axis, an empty or infinite interval, and knots that would coincide on it.
    """
    axis = spline._axis(axis)
    largest = np.finfo(np.float64).max
    if not is_real_within(start, -largest, largest) or not is_real_within(end, start, largest) or start == end:
        raise BvbError(f"Axis {axis}: ({shown(start)}, {shown(end)}) is no interval. Give a start and a larger end.")
    t = spline.knots[axis]
    share = (t - t[0]) / (t[-1] - t[0])
    mapped = (1 - share) * start + share * end
    if len(np.unique(mapped)) < len(np.unique(t)):
        raise BvbError(f"Axis {axis}: knots would coincide in float64 on [{start}, {end}]. Choose a longer interval.")
    return spline._with_axis(axis, spline.degrees[axis], mapped, spline.control.copy(), trusted=False)


def product(a: TensorSpline, b: TensorSpline) -> TensorSpline:
    """Return the pointwise product of two splines over one domain, exact by degree.

    Degrees add. A knot that stands m times in ``a`` (degree p) and not in ``b`` (degree q) stands m + q times in the
    product, and one of both as the less smooth of the two asks. Channels are equal in number, or one spline has a
    single one. The product lies in the new space, so that interpolating it at the Greville abscissae reproduces it.
    Knots equal up to rounding are united. Raises BvbError for domains, channels or degrees that do not allow it, and
    where knots stand so close that the interpolation would lose half of the digits.
    """
    if 1 not in (a.channels, b.channels) and a.channels != b.channels:
        raise BvbError(f"{a.channels} and {b.channels} channels have no product. Give equal numbers, or a single one.")
    if a.parameters != b.parameters:
        raise BvbError(f"{a!r} and {b!r} have no product. Give splines of equal parameters.")
    (a, b), _ = unite_knots([a, b], range(a.parameters), refined=False)
    degrees = tuple(p + q for p, q in zip(a.degrees, b.degrees, strict=True))
    values_a, values_b = a.control, b.control
    knots: list[Floats] = []
    matrices: list[Banded] = []
    for axis in reversed(range(a.parameters)):
        if degrees[axis] > MAX_DEGREE:
            raise BvbError(f"Axis {axis}: a product of degree {degrees[axis]} is beyond {MAX_DEGREE}. Reduce a factor.")
        t = _product_knots(a.knots[axis], a.degrees[axis], b.knots[axis], b.degrees[axis])
        t = checked_knots_of(axis, t, degrees[axis])
        x, before, matrix, condition = interpolation(t, degrees[axis])
        if not condition <= CONDITION_LIMIT:
            raise BvbError(
                f"Axis {axis}: knots of the factors stand so close that their product has condition {condition:.1e}. "
                "Make them equal, or remove one."
            )
        values_a = limits(a.knots[axis], a.degrees[axis], x, before).apply(values_a, axis)
        values_b = limits(b.knots[axis], b.degrees[axis], x, before).apply(values_b, axis)
        knots.insert(0, t)
        matrices.insert(0, matrix)
    with np.errstate(over="ignore", invalid="ignore"):
        values = values_a * values_b
    if not all_finite(values):
        raise BvbError("The product leaves the range of float64. Scale a factor.")
    for axis, matrix in enumerate(matrices):
        values = matrix.solve(values, axis)
    return TensorSpline(degrees, knots, values)


def _product_knots(s: Floats, p: int, t: Floats, q: int) -> Floats:
    values = np.union1d(s, t)
    in_s, in_t = (np.searchsorted(k, values, "right") - np.searchsorted(k, values, "left") for k in (s, t))
    counts = np.maximum(np.where(in_s > 0, in_s + q, 0), np.where(in_t > 0, in_t + p, 0))
    return np.repeat(values, counts)
