"""Before a fit: which chart and encoding suit a BRDF, where knots go, and how the error falls with the net's size."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.charts import Chart
from bvbedit.brdf.encodings import Encoding
from bvbedit.brdf.geometry import Floats
from bvbedit.brdf.losses import Loss
from bvbedit.brdf.problem import Problem, Table, Weights, pose, tabulate
from bvbedit.brdf.sample_sets import draw
from bvbedit.brdf.samples import Samples, in_chart, looked_up
from bvbedit.brdf.spline_brdf import keep_faces
from bvbedit.brdf.storage import Storage
from bvbedit.errors import BvbError
from bvbedit.spline.adaptive import (
    AxisLines,
    KnotPath,
    allocate,
    axis_lines,
    dominant_knots,
    marginals,
    placed_knots,
)
from bvbedit.spline.arguments import is_whole, one_per_axis, shown
from bvbedit.spline.fitting import loft
from bvbedit.spline.free_knots import move_knots
from bvbedit.spline.knots import PLACEMENTS, checked_degree
from bvbedit.spline.tensor import TensorSpline

# Placements that look at the data; "free" moves the knots of "dominant".
ADAPTIVE = ("dominant", "free")
# No table has as many nodes by far.
MOST_POINTS = 1 << 24
# An axis is tried with up to so many control points for the cube root of the net's, and a few.
ELONGATION = 4.0
FEW = 20
# Knots are rounded to multiples of this, far below any spacing of data: float64 of few digits deflate to 2 or 3 bytes.
KNOT_GRID = 2.0**-16
# Share of the squared error that quantising is meant to add: 4 % of the error, where the balance of the sets is that of
# the final model; 1 to 15 % were seen, and more of tiny nets.
QUANTISATION = 0.08
# A control point follows a feature if it takes away so many times what it would of noise: one is the mean, and the
# largest of some dozen such gains is about twice that (the penalty of Mallows' Cp too).
FEATURE = 2.0
# Pairs of each set that judge a trial.
TRIAL_SAMPLES = 20_000
# What a trial's error is uncertain by: another encoding has to be that much better than the first.
UNSURE = 0.1
# An error below this share of the other set's counts as so large.
SMALLEST_ERROR = 1e-6
# Turns in which the sets are balanced: one set may gain much where the other loses little.
BALANCING = 4


@dataclass(frozen=True)
class Plan:
    """A posed problem, and the knots of each axis for every number of control points."""

    problem: Problem
    degrees: tuple[int, int, int]
    lines: tuple[AxisLines, ...]
    paths: tuple[KnotPath, ...]

    def knots(self, size: Sequence[int]) -> tuple[Floats, ...]:
        """Return full knot vectors for ``size`` control points.

        Raises BvbError where the data of an axis do not carry so many.
        """
        for axis, (path, n) in enumerate(zip(self.paths, size, strict=True)):
            if not path.fewest <= n <= path.most:
                raise BvbError(
                    f"{shown(n)} control points along {self.problem.chart.axes[axis]} are not what its data and degree "
                    f"{path.degree} carry. Choose a whole number in {path.fewest} ... {path.most}."
                )
        return tuple(path.of(int(n)) for path, n in zip(self.paths, size, strict=True))

    def walk(self, points: int) -> list[tuple[int, ...]]:
        """Return growing sizes, from the smallest net to one of at most so many control points.

        None is spent that takes away no more than it would of noise alone.
        """
        return allocate(self.paths, points, [FEATURE * float(x.noise.mean()) for x in self.lines])

    def freed(self, size: Sequence[int]) -> "Plan":
        """Return the plan with the knots for ``size`` moved freely along each axis, from where they are."""
        paths = []
        for lines, path, knots in zip(self.lines, self.paths, self.knots(size), strict=True):
            moved = move_knots(lines, knots, path.degree)
            paths.append(path.with_knots(_rounded(moved.knots), moved.error))
        return replace(self, paths=tuple(paths))

    def lofted(self, size: Sequence[int]) -> TensorSpline:
        """Return the quick fit of this size: lofting with the marginals of the weights, degenerate faces averaged."""
        rows = [x.roots**2 for x in self.lines]
        knots = self.knots(size)
        spline = loft(self.problem.values, self.problem.table.axes, knots, self.degrees, rows).spline
        return spline.with_control(keep_faces(spline.control, self.problem.chart))

    def storage(self, precision: str, errors: Floats) -> Storage:
        """Return how a net with these ``errors`` over the sets (2,) is stored best in ``precision``.

        A step h moves control points evenly within half a step, values by h^2/12 times the mean sum of squares of the
        basis functions, and the metric by the mean weight times that.
        """
        if precision != "quantised":
            return Storage(precision)
        problem = self.problem
        overlap = float(np.prod([_overlap(x, path) for x, path in zip(self.lines, self.paths, strict=True)]))
        # Means of |error|^power to the power 2/power: squares of a typical error, as the weights count them.
        allowed = QUANTISATION * float(np.dot(problem.balance, errors ** (4 / problem.loss.power)))
        largest = float(np.abs(problem.values).max())
        step = np.sqrt(12 * allowed / max(problem.weights.mean() * overlap, np.finfo(float).tiny))
        return Storage(precision, float(np.clip(step, max(largest, 1e-3) * 2.0**-20, max(largest, 1e-3) * 2.0**-4)))


@dataclass(frozen=True)
class Trial:
    """What a chart and an encoding are good for, by a quick fit on a coarse grid."""

    chart: Chart
    encoding: Encoding
    balance: tuple[float, float]
    """What an error over each of the sets counts, so that their product is small."""
    errors: Floats
    """The metric over samples of each of the sets (2,), but for its scale."""

    @property
    def score(self) -> float:
        """The geometric mean of the errors, by which trials are compared."""
        return float(np.sqrt(np.prod(self.errors)))


@dataclass(frozen=True)
class _Bench:
    """A chart on trial."""

    table: Table
    samples: Samples
    loss: Loss
    points: int

    def trial(self, encoding: Encoding, degrees: Sequence[int], weights: Weights | None) -> Trial:
        """Return what the chart does with ``encoding``, the sets balanced by turns of fitting and measuring."""

        def planned(balance: tuple[float, float]) -> Plan:
            return plan(
                self.table,
                encoding,
                self.loss,
                balance,
                degrees=degrees,
                placement="dominant",
                points=self.points,
                weights=weights,
            )

        black = self.samples.errors(np.zeros_like(self.samples.reflectance), self.loss)
        balance = balance_of(black)
        made = planned(balance)
        knots = made.knots(made.walk(self.points)[-1])
        for _ in range(BALANCING):
            problem = pose(self.table, encoding, self.loss, balance, weights)
            spline = loft(problem.values, self.table.axes, knots, made.degrees, marginals(problem.weights)).spline
            balance = balance_of(self._errors(spline, encoding))
        made = planned(balance)
        return Trial(
            self.table.chart, encoding, balance, self._errors(made.lofted(made.walk(self.points)[-1]), encoding)
        )

    def _errors(self, spline: TensorSpline, encoding: Encoding) -> Floats:
        kept = spline.with_control(keep_faces(spline.control, self.table.chart))
        return self.samples.errors_of(kept, encoding, self.loss)


def plan(
    table: Table,
    encoding: Encoding,
    loss: Loss,
    balance: Sequence[float],
    *,
    degrees: Sequence[int],
    placement: str,
    points: int,
    weights: Weights | None = None,
) -> Plan:
    """Return the problem of ``table`` with knots for nets of up to about so many ``points`` on each axis."""
    problem = pose(table, encoding, loss, balance, weights)
    lines = axis_lines(problem.values, problem.weights, table.axes, problem.variance)
    p0, p1, p2 = (int(p) for p in degrees)
    paths = tuple(_path(x, placement, p, points) for x, p in zip(lines, (p0, p1, p2), strict=True))
    return Plan(problem, (p0, p1, p2), lines, paths)


def checked_size(size: object) -> tuple[int, int, int]:
    """Return ``size``. Raises BvbError where it is no three whole numbers above zero, or more than any net has."""
    numbers = one_per_axis(size, "Size")
    if len(numbers) != 3 or not all(is_whole(n) and n > 0 for n in numbers):
        raise BvbError(
            f"Size {shown(numbers)} is not three whole numbers above zero. Give control points along each axis."
        )
    n0, n1, n2 = (int(n) for n in numbers)
    if n0 * n1 * n2 > MOST_POINTS:
        raise BvbError(f"A net of size {shown(numbers)} is too large. Keep within {MOST_POINTS:,} control points.")
    return n0, n1, n2


def checked_degrees(degrees: object) -> tuple[int, int, int]:
    """Return ``degrees``. Raises BvbError where they are no three degrees."""
    numbers = [checked_degree(p) for p in one_per_axis(degrees, "Degrees")]
    if len(numbers) != 3:
        raise BvbError(f"{len(numbers)} degrees given. Give three, one for each axis.")
    return numbers[0], numbers[1], numbers[2]


def checked_placement(name: object) -> str:
    """Return ``name``. Raises BvbError where it places no knots."""
    if not isinstance(name, str) or name not in (*ADAPTIVE, *PLACEMENTS):
        raise BvbError(f"Unknown knot placement {shown(name)}. Choose one of {', '.join((*ADAPTIVE, *PLACEMENTS))}.")
    return name


def _path(lines: AxisLines, placement: str, degree: int, points: int) -> KnotPath:
    m = len(lines.parameters)
    most = min(m, max(degree + 1, int(ELONGATION * points ** (1 / 3)) + FEW))
    if placement in PLACEMENTS:
        return placed_knots(lines, placement, degree, most)
    path = dominant_knots(lines, degree, most)
    return KnotPath(degree, tuple(_rounded(t) for t in path.knots), path.errors)


def _rounded(knots: Floats) -> Floats:
    return np.asarray(np.round(knots / KNOT_GRID) * KNOT_GRID)


def _overlap(lines: AxisLines, path: KnotPath) -> float:
    """Return the mean sum of squares of the basis functions of an axis at its data."""
    knots = path.knots[-1]
    rows = lines.collocation(knots, path.degree).rows / lines.roots[:, None]
    return float(np.mean(np.sum(rows**2, axis=1)))


def try_charts(
    brdf: Brdf,
    charts: Sequence[Chart],
    encodings: Sequence[Encoding],
    loss: Loss,
    *,
    degrees: Sequence[int],
    points: int,
    weights: Weights | None = None,
) -> list[Trial]:
    """Return trials of each chart with each encoding for nets of about so many ``points``, the best one first.

    A trial lofts over dominant points on the coarse grid of the chart, judged by samples of the metric itself: what a
    folded chart cannot represent counts against it.
    """
    reflectance = looked_up(brdf, draw(brdf, TRIAL_SAMPLES))
    tried = []
    for chart in charts:
        bench = _Bench(tabulate(brdf, chart, chart.trial_grid), in_chart(reflectance, chart, weights), loss, points)
        tried.append((bench.trial(encodings[0], degrees, weights), bench))
    tried.sort(key=lambda t: t[0].score)
    # The other encodings are tried in the chart that is best with the first.
    bench = tried[0][1]
    trials = [t for t, _ in tried] + [bench.trial(encoding, degrees, weights) for encoding in encodings[1:]]
    # Errors that differ by less than the choice is sure of are the same: then the first encoding serves.
    return sorted(trials, key=lambda t: t.score * (1.0 if t.encoding == encodings[0] else 1 + UNSURE))


def balance_of(errors: Floats) -> tuple[float, float]:
    """Return what an error over each set counts, so that both fall by the same share: the inverse squares."""
    largest = float(errors.max())
    if not largest > 0:
        return 1.0, 1.0
    relative = np.maximum(errors / largest, SMALLEST_ERROR)
    inverse = (relative.min() / relative) ** 2
    return float(inverse[0]), float(inverse[1])
