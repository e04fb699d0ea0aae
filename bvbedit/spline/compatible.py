"""Splines over the same knots: what mixing them needs, and the mixtures."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bvbedit.errors import BvbError
from bvbedit.spline.arguments import is_real_within, one_per_axis, real_array, shown
from bvbedit.spline.knots import Floats
from bvbedit.spline.refinement import checked_knots_of, elevation, insertion
from bvbedit.spline.tensor import TensorSpline, all_finite, assembled

# Of the domain's largest parameter: knots closer than this are taken for one, computed in two ways.
KNOT_TOLERANCE = 2.0**-46


@dataclass(frozen=True)
class MergedKnot:
    """A knot that was taken for another one, since they differ by rounding alone."""

    spline: int
    """Which of the splines was changed."""
    axis: int
    kept: float
    replaced: float


def make_compatible(
    *splines: TensorSpline, tolerance: float = KNOT_TOLERANCE
) -> tuple[tuple[TensorSpline, ...], tuple[MergedKnot, ...]]:
    """Return the splines with equal degrees and knots, each the same function as before, and which knots were merged.

    Lower degrees are elevated; of each knot there are as many copies as the spline that has most of them needs.
    Knots of two splines closer than ``tolerance`` times the domain's largest parameter become one, at the place of the
    earlier spline's. Raises BvbError for domains that differ by more, for other numbers of parameters, and for a
    tolerance outside [0, 1e-3].
    """
    if not splines:
        raise BvbError("No spline given. Give at least one.")
    first = splines[0]
    for k, s in enumerate(splines):
        if s.parameters != first.parameters:
            raise BvbError(f"Spline {k} has {s.parameters} parameters, the first {first.parameters}. They must agree.")
    return unite_knots(splines, range(first.parameters), tolerance)


def unite_knots(
    splines: Sequence[TensorSpline], axes: Sequence[int], tolerance: float = KNOT_TOLERANCE, refined: bool = True
) -> tuple[tuple[TensorSpline, ...], tuple[MergedKnot, ...]]:
    """Move knots of ``axes`` that are equal up to rounding to one place, and there make degrees and knots equal.

    Not ``refined``, the splines keep their own degrees and knots, moved. Domains must agree on ``axes``.
    """
    if not is_real_within(tolerance, 0.0, 1e-3):
        raise BvbError(f"Tolerance {shown(tolerance)} cannot tell knots apart. Choose one in 0 ... 0.001.")
    merged: list[MergedKnot] = []
    out = list(splines)
    # The last axis first: the nets are small while the contiguous runs are short.
    for axis in sorted(axes, reverse=True):
        vectors = _moved(axis, [s.knots[axis] for s in out], tolerance, merged)
        if not refined:
            out = [_with_knots(s, axis, t) for s, t in zip(out, vectors, strict=True)]
            continue
        target = max(s.degrees[axis] for s in out)
        raised = [elevation(t, s.degrees[axis], target - s.degrees[axis]) for s, t in zip(out, vectors, strict=True)]
        values = np.unique(np.concatenate([t for t, _ in raised]))
        counts = np.max([np.searchsorted(t, values, "right") - np.searchsorted(t, values) for t, _ in raised], axis=0)
        union = checked_knots_of(axis, np.repeat(values, counts), target)
        for k, (t, matrix) in enumerate(raised):
            if len(t) < len(union):
                matrix = insertion(t, target, union).after(matrix)
            if len(matrix.rows) > matrix.columns:
                out[k] = out[k]._with_axis(axis, target, union.copy(), matrix.apply(out[k].control, axis))
            else:
                out[k] = _with_knots(out[k], axis, union.copy())
    return tuple(out), tuple(sorted(merged, key=lambda m: m.axis))


def _with_knots(spline: TensorSpline, axis: int, t: Floats) -> TensorSpline:
    if t is spline.knots[axis] or np.array_equal(t, spline.knots[axis]):
        return spline
    return assembled(spline.degrees, (*spline.knots[:axis], t, *spline.knots[axis + 1 :]), spline.control)


def _moved(axis: int, vectors: Sequence[Floats], tolerance: float, merged: list[MergedKnot]) -> list[Floats]:
    """Return the knot vectors with knots moved that are nearest to one another and within the tolerance."""
    near = tolerance * max(float(np.abs(t).max()) for t in vectors)
    ends = vectors[0][[0, -1]]
    known, out = np.unique(vectors[0]), [vectors[0]]
    for k, t in enumerate(vectors[1:], start=1):
        if not (np.abs(t[[0, -1]] - ends) <= near).all():
            raise BvbError(
                f"Axis {axis}: spline {k} spans [{t[0]}, {t[-1]}], the first [{ends[0]}, {ends[1]}]. "
                "Reparametrise or restrict one."
            )
        values = np.unique(t)
        placed = values.copy()
        placed[[0, -1]] = ends
        inside = values[1:-1]
        if len(inside) and len(known) > 2:
            there, back = _nearest(inside, known[1:-1]), _nearest(known[1:-1], inside)
            # Mutually nearest pairs keep the order of the knots.
            pairs = (back[there] == np.arange(len(inside))) & (np.abs(known[1:-1][there] - inside) <= near)
            placed[1:-1] = np.where(pairs, known[1:-1][there], inside)
        if not (np.diff(placed) > 0).all():
            i = int(np.flatnonzero(np.diff(placed) <= 0)[0])
            i = i if i > 0 else 1
            raise BvbError(
                f"Axis {axis}: knot {values[i]} of spline {k} is an end of the first, up to rounding. Remove that knot."
            )
        merged += [
            MergedKnot(k, axis, float(new), float(old)) for new, old in zip(placed, values, strict=True) if new != old
        ]
        out.append(placed[np.searchsorted(values, t)])
        known = np.union1d(known, placed)
    return out


def _nearest(x: Floats, among: Floats) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Return the index of the number ``among`` (sorted) that is nearest to each of ``x``."""
    right = np.clip(np.searchsorted(among, x), 1, max(len(among) - 1, 1))
    right = np.minimum(right, len(among) - 1)
    left = np.maximum(right - 1, 0)
    return np.where(x - among[left] <= among[right] - x, left, right)


def combine(splines: Sequence[TensorSpline], weights: Sequence[ArrayLike]) -> TensorSpline:
    """Return sum_k weights[k] splines[k] over common knots; each weight is a number or one per channel.

    Knots equal up to rounding are united, as ``make_compatible`` does and reports. Raises BvbError for another number
    of weights, weights that are not finite, and splines of unequal channels or domains.
    """
    splines, weights = one_per_axis(splines, "Splines"), one_per_axis(weights, "Weights")
    if len(splines) != len(weights) or not splines:
        raise BvbError(f"{len(splines)} splines and {len(weights)} weights given. Give one weight for each spline.")
    channels = splines[0].channels
    for k, s in enumerate(splines):
        if s.channels != channels:
            raise BvbError(f"Spline {k} has {s.channels} channels, the first {channels}. They must agree.")
    factors = [checked_factor(w, channels, f"Weight {k}") for k, w in enumerate(weights)]
    with np.errstate(over="ignore", invalid="ignore"):
        # Weighed while they are small.
        weighed = [assembled(s.degrees, s.knots, s.control * w) for s, w in zip(splines, factors, strict=True)]
        same, _ = make_compatible(*weighed)
        net = same[0].control
        # It is a copy of ours, weighed, and fresh memory takes longer than the sum.
        net.setflags(write=True)
        for s in same[1:]:
            net += s.control
    if not all_finite(net):
        raise BvbError("The combination leaves the range of float64. Choose smaller weights.")
    return assembled(same[0].degrees, same[0].knots, net)


def blend(a: TensorSpline, b: TensorSpline, t: "ArrayLike | TensorSpline") -> TensorSpline:
    """Return (1 - t) a + t b over common knots: t = 0 gives a, t = 1 gives b.

    ``t`` is a number, one for each channel, or a spline over the same domain with one channel or as many as the others,
    so that a mixture may differ from place to place: then degrees add, exactly. Values outside [0, 1] extrapolate.
    Raises BvbError for a ``t`` of another shape or not finite, and for splines that do not suit one another.

    >>> a = TensorSpline((1,), ([0, 0, 1, 1],), [[0.0], [2.0]])
    >>> b = TensorSpline((1,), ([0, 0, 1, 1],), [[4.0], [2.0]])
    >>> blend(a, b, 0.25).control[:, 0].tolist()
    [1.0, 2.0]
    """
    if isinstance(t, TensorSpline):
        from bvbedit.spline.operations import product

        return combine([a, product(t, combine([b, a], [1.0, -1.0]))], [1.0, 1.0])
    share = checked_factor(t, a.channels, "t")
    return combine([a, b], [1.0 - share, share])


def checked_factor(value: ArrayLike, channels: int, name: str) -> Floats:
    """Return ``value`` as an array () or (channels,). Raises BvbError for another shape and what is not finite."""
    factor = real_array(value, name)
    if factor.shape not in ((), (1,), (channels,)) or not np.isfinite(factor).all():
        raise BvbError(f"{name} is {shown(value)}. Give one finite number, or {channels}, one for each channel.")
    return factor
