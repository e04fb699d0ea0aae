"""Before a fit: which chart and encoding suit a BRDF, where knots go, and how the error falls with the net's size."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.charts import Chart
from bvbedit.brdf.encodings import Encoding
from bvbedit.brdf.geometry import Floats
from bvbedit.brdf.interest import Interest
from bvbedit.brdf.losses import LogCosine, Loss
from bvbedit.brdf.problem import Problem, Table, Weights, pose, secants, tabulate
from bvbedit.brdf.samples import Samples, drawn, in_chart
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
from bvbedit.spline.fitting import fit_weighted, loft
from bvbedit.spline.free_knots import move_knots
from bvbedit.spline.knots import PLACEMENTS, checked_degree, place_knots
from bvbedit.spline.tensor import TensorSpline
from bvbedit.threads import side_by_side

# Placements that look at the data; "free" moves the knots of "dominant".
ADAPTIVE = ("dominant", "free")
# No table has as many nodes by far.
MOST_POINTS = 1 << 24
# An axis is tried with up to so many control points for the cube root of the net's, and a few.
ELONGATION = 4.0
FEW = 20
# Knots are rounded to multiples of this, far below any spacing of data: float64 of few digits deflate to 2 or 3 bytes.
KNOT_GRID = 2.0**-16
# Share of the squared error that quantising may add, 4 % of the error. At 48 KiB, half of that made five
# materials' models 2 % better to 2 % worse, twice that 0 to 5 % worse.
QUANTISATION = 0.08
# The step is measured and corrected so many times.
CORRECTIONS = 2
# A control point follows a feature if it takes away so many times what it would of noise: one is the mean, and the
# largest of some dozen such gains is about twice that (the penalty of Mallows' Cp too).
FEATURE = 2.0
# Pairs of each set that judge a trial.
TRIAL_SAMPLES = 20_000
# Conjugate gradient steps of a trial.
TRIAL_STEPS = 6
# What a trial's error is uncertain by: another encoding has to be that much better than the first.
UNSURE = 0.1
# An error below this share of the other set's counts as so large.
SMALLEST_ERROR = 1e-6
# Whose weights least squares is given first. Those of a metric that is no mean of squares depend on errors that can
# only be guessed before there is a fit: by them alone fits were up to 2.7 times as far off, in that very metric.
SURROGATE = LogCosine()
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
        for axis, path, n in zip(self.problem.chart.axes, self.paths, size, strict=True):
            _check_carried(path, axis, n)
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

    def storage(self, precision: str, spline: TensorSpline, samples: Samples) -> Storage:
        """Return how ``spline`` is stored best in ``precision``: quantised, it adds ``QUANTISATION`` over ``samples``.

        A step h moves control points evenly within half a step, values by h^2/12 times the mean sum of squares of the
        basis functions, and the metric by the mean weight times that: the first guess, which is then measured.
        """
        if precision != "quantised":
            return Storage(precision)
        problem = self.problem

        def errors_of(net: TensorSpline) -> Floats:
            return samples.errors_of(net, problem.encoding, problem.loss)

        errors = errors_of(spline)
        overlap = float(np.prod([_overlap(x, path) for x, path in zip(self.lines, self.paths, strict=True)]))
        # Means of |error|^power to the power 2/power: squares of a typical error, as the weights count them.
        allowed = QUANTISATION * float(np.dot(problem.balance, errors ** (4 / problem.loss.power)))
        largest = max(float(np.abs(spline.control).max()), 1e-3)
        step = np.sqrt(12 * allowed / max(problem.weights.mean() * overlap, np.finfo(float).tiny))
        smallest, coarsest = largest * 2.0**-20, largest * 2.0**-4
        storage = Storage(precision, float(np.clip(step, smallest, coarsest)))
        for _ in range(CORRECTIONS if errors.all() else 0):
            rounded = errors_of(spline.with_control(storage.rounded(spline.control)))
            # The mean over the sets, as the metric has it, of the squares.
            before, after = (np.prod(samples.metrics(e, problem.loss)) for e in (errors, rounded))
            added = float(after / before) - 1
            share = float(np.clip(QUANTISATION / max(added, QUANTISATION / 16), 1 / 64, 16))
            storage = Storage(precision, float(np.clip(storage.step * np.sqrt(share), smallest, coarsest)))
        return storage


@dataclass(frozen=True)
class Trial:
    """What a chart and an encoding are good for, by a quick fit on a coarse grid."""

    chart: Chart
    encoding: Encoding
    surrogate: Loss
    """The metric whose weights least squares was given."""
    balance: tuple[float, float]
    """What an error over each of the sets counts, so that their product is small."""
    errors: Floats
    """The metric over samples of each of the sets (2,), but for its scale, after one turn of balancing."""

    @property
    def score(self) -> float:
        """The geometric mean of the errors, by which trials are compared."""
        return float(np.sqrt(np.prod(self.errors)))

    def to_dict(self) -> dict[str, Any]:
        """Return what was tried, and the metric but for its scale, with three digits."""
        grid, nodes = (float(f"{e:.3g}") for e in self.errors)
        names = {"chart": self.chart.name, "encoding": self.encoding.name, "weights": self.surrogate.name}
        return {**names, "grid": grid, "nodes": nodes}


@dataclass(frozen=True)
class _Bench:
    """A chart with an encoding on trial: knots, and the sets' balance to be found."""

    made: Plan
    knots: tuple[Floats, ...]
    samples: Samples
    weights: Weights | Interest | None

    def trial(self, balance: tuple[float, float], turns: int) -> Trial:
        """Return what the quick fit does once the sets are balanced by so many turns of fitting and measuring."""
        problem = self.made.problem
        errors = np.ones(2)
        for turn in range(turns + 1):
            if turn:
                balance = balance_of(errors)
            posed = problem
            if balance != problem.balance:
                posed = pose(problem.table, problem.encoding, problem.loss, balance, self.weights, problem.surrogate)
            errors = self.samples.errors_of(self._fitted(posed), problem.encoding, problem.loss)
        return Trial(problem.chart, problem.encoding, problem.surrogate, balance, errors)

    def _fitted(self, posed: Problem) -> TensorSpline:
        """Return a fit in few steps: lofting alone makes small nets of sharp highlights ring, and misjudges them."""
        axes, degrees = posed.table.axes, self.made.degrees
        first = loft(posed.values, axes, self.knots, degrees, marginals(posed.weights)).spline
        return fit_weighted(
            posed.values,
            posed.weights * secants(posed, first),
            axes,
            self.knots,
            degrees,
            start=first.control,
            project=lambda control: keep_faces(control, posed.chart),
            max_iterations=TRIAL_STEPS,
        ).spline


def plan(
    table: Table,
    encoding: Encoding,
    loss: Loss,
    balance: Sequence[float],
    *,
    degrees: Sequence[int],
    placement: str,
    points: int,
    weights: Weights | Interest | None = None,
    surrogate: Loss | None = None,
) -> Plan:
    """Return the problem of ``table`` with knots for nets of up to about so many ``points`` on each axis."""
    problem = pose(table, encoding, loss, balance, weights, surrogate)
    lines = axis_lines(problem.values, problem.weights, table.axes, problem.variance)
    p0, p1, p2 = (int(p) for p in degrees)
    paths = tuple(_path(x, placement, p, points) for x, p in zip(lines, (p0, p1, p2), strict=True))
    return Plan(problem, (p0, p1, p2), lines, paths)


def knots_for(
    values: Floats, table: Table, placement: str, size: Sequence[int], degrees: tuple[int, int, int]
) -> tuple[Floats, ...]:
    """Return full knot vectors for ``size`` control points, of ``values`` (m_1, m_2, m_3, c) that all count alike.

    Raises BvbError where the data of an axis do not carry so many.
    """
    if placement in PLACEMENTS:
        return tuple(place_knots(placement, u, n, p) for u, n, p in zip(table.axes, size, degrees, strict=True))
    lines = axis_lines(values, np.ones(values.shape[:-1]), table.axes)
    vectors = []
    for axis, of_axis, n, p in zip(table.chart.axes, lines, size, degrees, strict=True):
        path = dominant_knots(of_axis, p, n)
        _check_carried(path, axis, n)
        knots = path.of(n)
        vectors.append(_rounded(move_knots(of_axis, knots, p).knots if placement == "free" else knots))
    return tuple(vectors)


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


def _check_carried(path: KnotPath, axis: str, n: int) -> None:
    if not path.fewest <= n <= path.most:
        raise BvbError(
            f"{shown(n)} control points along {axis} are not what its data and degree {path.degree} carry. "
            f"Choose a whole number in {path.fewest} ... {path.most}."
        )


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
    weights: Weights | Interest | None = None,
) -> list[Trial]:
    """Return trials of each chart with each encoding for nets of about so many ``points``, the best one first.

    A trial lofts over dominant points on the coarse grid of the chart, judged by samples of the metric itself: what a
    folded chart cannot represent counts against it. The weights are those of ``SURROGATE``; at the end another metric
    is tried with its own weights too. An interest has its own.
    """
    reflectance = drawn(brdf, TRIAL_SAMPLES, weights=weights)
    usual = loss if isinstance(weights, Interest) else SURROGATE

    def bench(
        table: Table, samples: Samples, encoding: Encoding, surrogate: Loss, balance: tuple[float, float]
    ) -> _Bench:
        made = plan(
            table,
            encoding,
            loss,
            balance,
            degrees=degrees,
            placement="dominant",
            points=points,
            weights=weights,
            surrogate=surrogate,
        )
        return _Bench(made, made.knots(made.walk(points)[-1]), samples, weights)

    def tried_out(table: Table, samples: Samples, encoding: Encoding, surrogate: Loss = usual) -> tuple[Trial, _Bench]:
        # Knots for sets that count as if the model were black say little: a first fit tells better.
        balance = balance_of(samples.errors(np.zeros_like(samples.reflectance), loss))
        first = bench(table, samples, encoding, surrogate, balance).trial(balance, 0)
        balance = balance_of(first.errors)
        second = bench(table, samples, encoding, surrogate, balance)
        return second.trial(balance, 0), second

    def in_its_way(chart: Chart) -> tuple[Trial, _Bench]:
        table = tabulate(brdf, chart, chart.trial_grid)
        return tried_out(table, in_chart(reflectance, chart, weights), encodings[0])

    def rank(t: tuple[Trial, _Bench]) -> float:
        # Errors that differ by less than the choice is sure of are the same: then the first encoding serves.
        return t[0].score * (1.0 if t[0].encoding == encodings[0] else 1 + UNSURE)

    tried = sorted(side_by_side(in_its_way, charts), key=rank)
    # The other encodings are tried in the chart that is best with the first.
    table, samples = tried[0][1].made.problem.table, tried[0][1].samples
    tried = sorted(tried + [tried_out(table, samples, encoding) for encoding in encodings[1:]], key=rank)
    if loss != usual:
        tried = sorted([*tried, tried_out(table, samples, tried[0][0].encoding, loss)], key=rank)
    best, chosen = tried[0]
    # Only for the chosen one the balance is worth further turns.
    balance = chosen.trial(balance_of(best.errors), BALANCING - 2).balance
    return [replace(best, balance=balance), *(t for t, _ in tried[1:])]


def balance_of(errors: Floats) -> tuple[float, float]:
    """Return what an error over each set counts, so that both fall by the same share: the inverse squares."""
    largest = float(errors.max())
    if not largest > 0:
        return 1.0, 1.0
    relative = np.maximum(errors / largest, SMALLEST_ERROR)
    inverse = (relative.min() / relative) ** 2
    return float(inverse[0]), float(inverse[1])
