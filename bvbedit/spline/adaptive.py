"""Knots where the data have features: dominant points (Park & Lee 2007) for every axis of a table, and how many.

One knot vector serves all lines of a table along an axis, and the least-squares residual of an axis depends on these
lines only through their Gram matrix: a table of millions of values shrinks to one small factor an axis before any knot
is tried. The projections P_a onto the splines of the axes commute and are orthogonal, so that

    ||F - P_u P_v P_w F||^2 <= ||F - P_u F||^2 + ||F - P_v F||^2 + ||F - P_w F||^2,

and control points can be given to one axis after the other (``allocate``).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from bvbedit.errors import BvbError
from bvbedit.spline.arguments import is_whole, one_per_axis, real_array, shown
from bvbedit.spline.banded import SMALLEST_PIVOT, Banded
from bvbedit.spline.basis import collocation
from bvbedit.spline.knots import Floats, checked_degree, increasing, place_knots
from bvbedit.threads import each_block

# Weights below this share of the largest are raised to it: rows without weight would leave knots undetermined.
WEIGHT_FLOOR = 1e-8
# Data whose largest exponent is beyond this are scaled.
EXTREME = 400
# Squared errors below this share of the lines' energy are rounding.
ROUNDING = 1e-20
# Share of the lines' energy that may be left out of their factor: 1e-6 of their norm, far below any fit's error.
NEGLIGIBLE_ENERGY = 1e-12
# The unpublished parameters of Park & Lee, chosen by `tests/benchmarks/dominant.py`: errors relative to those over
# 9.68/9.69, as a geometric mean over six measurements, both charts, all axes, equal weights and the metric's.
# Share of the curvature in the shape index that a segment is split by; the rest is its length. 0.467 for 0.5, 0.468 for
# 0.3 and 0.7, 0.469 for 0.9, 0.472 for none.
MIX = 0.5
# Segments of the largest deviation that are tried for each new point; the best one is split. 0.467 for 3, 0.470 for 6,
# 0.472 for 1.
CANDIDATES = 3
# A deviation counts as a feature from so many times the noise on: the sums over a row's lines are known that well.
SURE = 1.1


@dataclass(frozen=True)
class AxisLines:
    """All weighted lines of a table along one axis, as far as least squares can tell them apart."""

    parameters: Floats
    """(m,) increasing."""
    factor: Floats
    """(m, k): factor factor^T is the Gram matrix of the lines, their rows times ``roots``."""
    roots: Floats
    """(m,): square roots of the rows' weights, > 0."""
    noise: Floats
    """(m,): what the noise of the data puts into the squared norm of each row."""

    def collocation(self, knots: Floats, degree: int) -> Banded:
        """Return the weighted collocation matrix (m, n)."""
        matrix = collocation(knots, degree, self.parameters)
        return Banded(matrix.first, self.roots[:, None] * matrix.rows, matrix.columns)

    def residual(self, knots: Floats, degree: int) -> Floats:
        """Return (I - P) factor (m, k): what the splines over ``knots`` leave of the lines.

        Raises BvbError where the data do not determine a control point.
        """
        from bvbedit.jit import frozen
        from bvbedit.spline import adaptive_kernels

        residual = np.empty_like(self.factor)
        if not adaptive_kernels.residual_left(
            frozen(knots), degree, frozen(self.parameters), self.roots, self.factor, SMALLEST_PIVOT, residual
        ):
            raise BvbError(f"The data do not determine all control points over knots {shown(knots.tolist())}.")
        return residual

    def error(self, knots: Floats, degree: int) -> float:
        """Return the squared norm of ``residual``, infinite where the data do not determine a control point."""
        from bvbedit.jit import frozen
        from bvbedit.spline import adaptive_kernels

        of = frozen(knots), degree, frozen(self.parameters), self.roots, self.factor
        return float(adaptive_kernels.error_left(*of, SMALLEST_PIVOT))


@dataclass(frozen=True)
class KnotPath:
    """Knot vectors of one axis for every number of control points from degree + 1 on, and what each leaves."""

    degree: int
    knots: tuple[Floats, ...]
    """Full clamped vectors; entry i has degree + 1 + i control points."""
    errors: Floats
    """Squared norms of the residual; of dominant points they never rise."""

    @property
    def fewest(self) -> int:
        """The number of control points of the first entry."""
        return self.degree + 1

    @property
    def most(self) -> int:
        """The number of control points of the last entry."""
        return self.degree + len(self.knots)

    def of(self, size: int) -> Floats:
        """Return the knots for ``size`` control points."""
        return self.knots[size - self.fewest]

    def with_knots(self, knots: Floats, error: float) -> "KnotPath":
        """Return the path with other ``knots`` for their number of control points, which leave ``error``."""
        i = len(knots) - 2 * (self.degree + 1)
        vectors = (*self.knots[:i], knots, *self.knots[i + 1 :])
        errors = self.errors.copy()
        errors[i] = error
        return KnotPath(self.degree, vectors, errors)

    def error_of(self, size: int) -> float:
        """Return the squared norm of the residual for ``size`` control points."""
        return float(self.errors[size - self.fewest])


def axis_lines(
    values: Floats, weights: Floats, parameters: Sequence[Floats], variance: Floats | None = None
) -> tuple[AxisLines, ...]:
    """Return the lines of ``values`` (m_1, ..., m_d, c) along each axis.

    ``variance`` (m_1, ..., m_d) of the data's noise, summed over channels, is zero where it is not given. Errors are
    relative to the largest weight and, of data beyond 2^400, to a power of two near the largest value.

    ``weights`` (m_1, ..., m_d) >= 0 need not be separable: each axis takes the mean over the others for its rows, and
    the mean over itself for the lines. ``parameters`` are the d increasing grid axes. Raises BvbError for shapes that
    do not match, and for values or weights that are not finite, negative weights, or weights that are all zero.
    """
    values, weights = real_array(values, "Data"), real_array(weights, "Weights")
    nodes = tuple(real_array(u, "Nodes") for u in one_per_axis(parameters, "Nodes"))
    shape = tuple(len(u) if u.ndim == 1 else -1 for u in nodes)
    if values.shape[:-1] != shape or weights.shape != shape or not all(increasing(u) and len(u) > 1 for u in nodes):
        raise BvbError(
            f"Data {values.shape} and weights {weights.shape} do not lie on a grid of {shape} nodes. "
            "Give values (m_1, ..., m_d, channels), weights (m_1, ..., m_d) and d increasing axes."
        )
    if not (np.isfinite(values).all() and np.isfinite(weights).all() and weights.min() >= 0 and weights.any()):
        raise BvbError("Data or weights are not finite, or no weight is positive. Fill or leave out what is not.")
    weights = weights / weights.max()
    # Squares of extreme data leave the range of float64. Knots do not depend on the scale.
    exponent = int(np.frexp(np.abs(values).max())[1])
    if abs(exponent) > EXTREME:
        values = np.ldexp(values, -exponent)
        variance = None if variance is None else np.ldexp(variance, -2 * exponent)
    rows = marginals(weights)
    noise = np.zeros(shape) if variance is None else weights * variance

    out = []
    for a, u in enumerate(nodes):
        roots = np.sqrt(rows[a])
        scale = np.sqrt(weights.mean(axis=a, keepdims=True) / weights.mean())
        gram = _gram(values, np.broadcast_to(scale[..., None], values.shape), a) * (roots[:, None] * roots)
        eigenvalues, vectors = np.linalg.eigh(gram)
        kept = np.cumsum(np.maximum(eigenvalues, 0.0)) > NEGLIGIBLE_ENERGY * max(np.trace(gram), np.finfo(float).tiny)
        kept[-1] = True
        factor = np.ascontiguousarray(vectors[:, kept] * np.sqrt(np.maximum(eigenvalues[kept], 0.0)))
        others = tuple(b for b in range(len(nodes)) if b != a)
        out.append(AxisLines(u, factor, roots, noise.sum(axis=others)))
    return tuple(out)


def _gram(values: Floats, scale: Floats, axis: int) -> Floats:
    """Return the Gram matrix (m, m) of the lines of ``values`` times ``scale`` (m_1, ..., m_d, c) along ``axis``."""
    across = 1 if axis == 0 else 0

    def gram_of(part: slice) -> Floats:
        block = (slice(None),) * across + (part,)
        lines = np.moveaxis(values[block] * scale[block], axis, 0).reshape(values.shape[axis], -1)
        return np.asarray(lines @ lines.T)

    layers = values.shape[across]
    return np.asarray(sum(each_block(layers, values.size // (layers * values.shape[-1]), gram_of)))


def marginals(weights: Floats) -> list[Floats]:
    """Return for each axis the mean (m_a,) of ``weights`` (m_1, ..., m_d) over the others, raised above zero."""
    d = weights.ndim
    rows = [weights.mean(axis=tuple(b for b in range(d) if b != a)) for a in range(d)]
    return [np.maximum(row, WEIGHT_FLOOR * row.max()) for row in rows]


def dominant_knots(lines: AxisLines, degree: int, most: int) -> KnotPath:
    """Return knots from dominant points for every number of control points from ``degree`` + 1 up to ``most``.

    A dominant point is a node of the data, one for each control point; the interior knots are the means of p
    consecutive ones. Each step takes the segments between neighbouring points that deviate most, splits them where the
    shape index (curvature and length) is balanced, and keeps the split that leaves the smallest error. Where the means
    would raise the error, one knot is inserted into the previous vector in place of them, so that the error never
    rises. Fewer vectors come back where the data carry no more. Deterministic.

    Raises BvbError for a degree outside 0 ... 16 and ``most`` outside degree + 1 ... m.
    Source: H. Park, J.-H. Lee, "B-spline curve fitting based on adaptive curve refinement using dominant points", CAD
    39 (2007); its weights and thresholds are not published in what was at hand, see ``MIX`` and ``CANDIDATES``.
    """
    p = checked_degree(degree)
    u, m = lines.parameters, len(lines.parameters)
    if not is_whole(most) or not p + 1 <= most <= m:
        raise BvbError(
            f"{shown(most)} control points cannot be placed over {m} data at degree {p}. "
            f"Choose a whole number in {p + 1} ... {m}."
        )
    curvature = _turning(lines)
    points = _balanced_seeds(u, curvature, p + 1)
    # Which of several splits leaves least is a matter of noise, where there is noise.
    candidates = 1 if lines.noise.any() else CANDIDATES
    knots = [_means(u, points, p)]
    errors = [lines.error(knots[0], p)]
    # Where the splines hold the lines already, errors are rounding, and may as well rise.
    slack = ROUNDING * float(np.sum(lines.factor**2))
    while len(points) < most:
        best = None
        residual = np.sum(lines.residual(knots[-1], p) ** 2, axis=1)
        segments = _segments(u, points, np.maximum(residual - SURE * lines.noise, 0.0))
        for rank, (a, b) in enumerate(segments):
            if rank >= candidates and best is not None:
                break
            new = _split(u, curvature, a, b)
            tried = sorted([*points, new])
            # The means are the method; a knot is only inserted where they would raise the error.
            for vector in (_means(u, tried, p), _inserted(knots[-1], u[new], p)):
                error = np.inf if vector is None else lines.error(vector, p)
                if vector is not None and error <= errors[-1] + slack:
                    if best is None or error < best[0]:
                        best = error, vector, tried
                    break
        if best is None:
            break
        error, vector, points = best
        knots.append(vector)
        errors.append(min(error, errors[-1]))
    return KnotPath(p, tuple(knots), np.array(errors))


def placed_knots(lines: AxisLines, placement: str, degree: int, most: int) -> KnotPath:
    """Return knots placed without a look at the data (``knots.PLACEMENTS``), as ``dominant_knots`` does.

    Their errors may rise. Raises BvbError as ``place_knots`` does.
    """
    vectors = tuple(place_knots(placement, lines.parameters, n, degree) for n in range(degree + 1, most + 1))
    return KnotPath(degree, vectors, np.array([lines.error(t, degree) for t in vectors]))


def allocate(paths: Sequence[KnotPath], points: int, floors: Sequence[float] | None = None) -> list[tuple[int, ...]]:
    """Return growing sizes (n_1, ..., n_d), from the smallest net to the largest of at most ``points`` control points.

    Each step gives control points to the axis whose error falls most for the logarithm of the net's growth; several at
    once where one alone brings nothing. ``floors``: for each axis the error that one control point takes away by
    following noise; an axis whose gain is no more is left alone.
    """
    floors = [0.0] * len(paths) if floors is None else floors
    size = [path.fewest for path in paths]
    walk = [tuple(size)]
    while True:
        best: tuple[float, int, int] | None = None
        for a, path in enumerate(paths):
            for step in range(1, min(4, path.most - size[a]) + 1):
                if np.prod(size) // size[a] * (size[a] + step) > points:
                    break
                gain = path.error_of(size[a]) - path.error_of(size[a] + step) - step * floors[a]
                rate = gain / np.log1p(step / size[a])
                if gain > 0 and (best is None or rate > best[0]):
                    best = rate, a, step
        if best is None:
            return walk
        size[best[1]] += best[2]
        walk.append(tuple(size))


def _turning(lines: AxisLines) -> Floats:
    """Return by how much the lines turn at each node (m,): the norm of the change of their slopes, weighted."""
    u = lines.parameters
    slopes = np.diff(lines.factor / lines.roots[:, None], axis=0) / np.diff(u)[:, None]
    turning = np.zeros(len(u))
    turning[1:-1] = np.linalg.norm(np.diff(slopes, axis=0), axis=1) * lines.roots[1:-1]
    return turning


def _balanced_seeds(u: Floats, curvature: Floats, count: int) -> list[int]:
    """Return the ends and, between them, the nodes at equal shares of the shape index."""
    if count == 1:
        return [0]
    index = MIX * _share(np.cumsum(curvature)) + (1 - MIX) * _share(u)
    seeds = {0, len(u) - 1}
    for share in np.arange(1, count - 1) / (count - 1):
        free = [i for i in range(len(u)) if i not in seeds]
        seeds.add(min(free, key=lambda i: (abs(index[i] - share), i)))
    return sorted(seeds)


def _share(x: Floats) -> Floats:
    span = x[-1] - x[0]
    return (x - x[0]) / span if span > 0 else np.zeros(len(x))


def _segments(u: Floats, points: Sequence[int], deviation: Floats) -> list[tuple[int, int]]:
    """Return the segments that can be split: the largest sum of ``deviation`` (m,) first, then the longest."""
    # At degree 0 no point stands on the right end, but what lies behind the last one can be split too.
    ends = points if points[-1] == len(u) - 1 else [*points, len(u)]
    segments = [(a, b) for a, b in pairwise(ends) if b - a > 1]
    return sorted(
        segments, key=lambda s: (-float(deviation[s[0] : s[1] + 1].sum()), u[s[0]] - u[min(s[1], len(u) - 1)], s[0])
    )


def _split(u: Floats, curvature: Floats, a: int, b: int) -> int:
    """Return the node between ``a`` and ``b`` at which the shape index of the segment is halved."""
    inside = np.arange(a + 1, b)
    turning = curvature[a + 1 : b]
    before = np.cumsum(turning) - 0.5 * turning
    total = turning.sum()
    share = before / total if total > 0 else np.full(len(inside), 0.5)
    index = MIX * share + (1 - MIX) * (u[inside] - u[a]) / (u[min(b, len(u) - 1)] - u[a])
    return int(inside[np.argmin(np.abs(index - 0.5))])


def _means(u: Floats, points: Sequence[int], degree: int) -> Floats:
    """Return the clamped knots whose interior ones are means of ``degree`` consecutive dominant points."""
    x = u[np.asarray(points)]
    if degree == 0:
        # Constant pieces end half-way between their points.
        interior = 0.5 * (x[:-1] + x[1:])
    else:
        count = len(x) - degree - 1
        interior = sum((x[1 + i : 1 + i + count] for i in range(1, degree)), x[1 : 1 + count]) / degree
    return np.concatenate([np.full(degree + 1, u[0]), interior, np.full(degree + 1, u[-1])])


def _inserted(knots: Floats, at: float, degree: int) -> Floats | None:
    """Return ``knots`` with one more, or None where it stands there as often as the degree allows."""
    if np.count_nonzero(knots == at) >= max(degree, 1):
        return None
    return np.insert(knots, np.searchsorted(knots, at), at)
