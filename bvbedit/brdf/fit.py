"""Fitting a B-spline volume to any BRDF: a plan, a net by weighted least squares, a few steps on the metric itself."""

import math
import sys
from collections.abc import Callable, Sequence
from time import perf_counter
from typing import Any

import numpy as np

from bvbedit.brdf.base import Brdf, check_brdf
from bvbedit.brdf.charts import IN_OUT, Chart
from bvbedit.brdf.encodings import Encoding, Linear, check_encoding
from bvbedit.brdf.geometry import Floats
from bvbedit.brdf.interest import Interest
from bvbedit.brdf.losses import Distance, Loss, loss_named
from bvbedit.brdf.plan import Plan, checked_degrees, checked_placement, checked_size, knots_for, plan, try_charts
from bvbedit.brdf.polish import polish
from bvbedit.brdf.problem import Problem, Table, Weights, on_any_chart, pose, secants, tabulate
from bvbedit.brdf.samples import draw_samples, samples_for
from bvbedit.brdf.spline_brdf import SplineBrdf, check_fitting_chart, keep_faces
from bvbedit.errors import BvbError
from bvbedit.spline.adaptive import AxisLines, axis_lines
from bvbedit.spline.arguments import one_per_axis
from bvbedit.spline.fitting import FitResult, fit_weighted, loft
from bvbedit.spline.knots import checked_knots
from bvbedit.spline.smoothing import smooth
from bvbedit.spline.tensor import TensorSpline

Progress = Callable[[float], None]

# Conjugate gradient steps on the grid unite lofting with the weights and the degenerate faces: as many as pass over so
# many nodes in all, no fewer than FEWEST_STEPS, until they change next to nothing. The steps on the metric's samples do
# the rest.
GRID_PASSES = 12_000_000
FEWEST_STEPS, MOST_STEPS = 8, 100
# The strength of smoothing that is found by cross-validation.
AUTO = "auto"
# Gauss-Newton steps on the metric's samples, and those of a thorough fit.
ROUNDS = 1
THOROUGH_ROUNDS = 4


def fit_net(
    brdf: Brdf,
    chart: Chart,
    encoding: Encoding,
    *,
    size: Sequence[int],
    degrees: Sequence[int] = (3, 3, 3),
    knots: str = "dominant",
    metric: str = "log_cosine_rms",
    weights: Callable[[Floats], Floats] | None = None,
    progress: Progress | None = None,
) -> SplineBrdf:
    """Return the B-spline volume of ``size`` control points that approximates ``brdf``, with a report.

    Directions that are one pair in the chart (its folds) are averaged. What stands in cells without data has no
    influence: there the value held from the nearest cell with data asks for a small weight, so that the model has no
    freedom to run wild. The control points of degenerate faces are kept equal. ``weights`` (n, 3) -> (n,) of chart
    parameters multiplies the weights that the metric asks for. The published configurations alone (``in-out`` and
    ``linear``, with knots ``piegl-tiller`` or the metric ``e_rms``) are lofted to the filled table with equal weights
    and free faces (Lee & Park 2008). Raises BvbError where size and degrees do not suit each other or the data.
    """
    check_brdf(brdf, "brdf")
    check_fitting_chart(chart)
    check_encoding(encoding)
    size, degrees = checked_size(size), checked_degrees(degrees)
    knots, loss = checked_placement(knots), loss_named(metric)
    start = perf_counter()
    if is_published(chart, encoding, knots, loss):
        return _published(brdf, encoding, size, degrees, knots).told(seconds=perf_counter() - start)
    points, wanted = math.prod(size), on_any_chart(weights)
    trial = try_charts(brdf, [chart], [encoding], loss, degrees=degrees, points=points, weights=wanted)[0]
    made = plan(
        tabulate(brdf, chart),
        encoding,
        loss,
        trial.balance,
        degrees=degrees,
        placement=knots,
        points=max(size) ** 3,
        weights=wanted,
        surrogate=trial.surrogate,
    )
    if knots == "free":
        made = made.freed(size)
    return settle(brdf, made, size, weights=wanted, progress=progress).told(knots=knots, seconds=perf_counter() - start)


def is_published(chart: Chart, encoding: Encoding, knots: str, loss: Loss) -> bool:
    """Return whether this is a fit of Lee & Park (2008): over their knots, or over others to their error E."""
    in_their_terms = chart is IN_OUT and isinstance(encoding, Linear)
    return in_their_terms and (knots == "piegl-tiller" or isinstance(loss, Distance))


def fit_over(
    brdf: Brdf,
    chart: Chart,
    encoding: Encoding,
    knots: Sequence[Floats],
    degrees: Sequence[int],
    *,
    metric: str = "log_cosine_rms",
    progress: Progress | None = None,
) -> SplineBrdf:
    """Return the B-spline volume over given full knot vectors that approximates ``brdf``, as ``fit_net`` does.

    Raises BvbError where the knots or degrees are none, or ask for more control points than the grid has nodes.
    """
    check_brdf(brdf, "brdf")
    check_fitting_chart(chart)
    check_encoding(encoding)
    start = perf_counter()
    loss = loss_named(metric)
    given, degrees = one_per_axis(knots, "Knots"), checked_degrees(degrees)
    if len(given) != 3:
        raise BvbError(f"{len(given)} knot vectors given. Give three, one for each axis.")
    vectors = tuple(checked_knots(t, p) for t, p in zip(given, degrees, strict=True))
    points = math.prod(len(t) - p - 1 for t, p in zip(vectors, degrees, strict=True))
    trial = try_charts(brdf, [chart], [encoding], loss, degrees=degrees, points=points)[0]
    problem = pose(tabulate(brdf, chart), encoding, loss, trial.balance, surrogate=trial.surrogate)
    lines = axis_lines(problem.values, problem.weights, problem.table.axes)
    model = _settle_over(brdf, problem, lines, vectors, degrees, progress=progress)
    return model.told(knots="given", seconds=perf_counter() - start)


def settle(
    brdf: Brdf,
    made: Plan,
    size: Sequence[int],
    *,
    weights: Weights | Interest | None = None,
    rounds: int = ROUNDS,
    smoothing: float | str | None = None,
    progress: Progress | None = None,
) -> SplineBrdf:
    """Return the model of ``size`` control points that a plan leads to, with a report.

    ``rounds`` Gauss-Newton steps on the metric's samples end the fit, unless ``smoothing`` penalises differences of the
    net: with a strength, or with the one that cross-validation finds (``AUTO``).
    """
    return _settle_over(
        brdf,
        made.problem,
        made.lines,
        made.knots(size),
        made.degrees,
        weights=weights,
        rounds=rounds,
        smoothing=smoothing,
        progress=progress,
    )


def _settle_over(
    brdf: Brdf,
    problem: Problem,
    lines: tuple[AxisLines, ...],
    knots: Sequence[Floats],
    degrees: Sequence[int],
    *,
    weights: Weights | Interest | None = None,
    rounds: int = ROUNDS,
    smoothing: float | str | None = None,
    progress: Progress | None = None,
) -> SplineBrdf:
    """Return the model over given full knot vectors: on the grid, then on the metric's own samples."""
    axes, chart = problem.table.axes, problem.chart

    def project(control: Floats) -> Floats:
        return keep_faces(control, chart)

    done = 0.0

    def report(share: float) -> None:
        nonlocal done
        done = max(done, float(share))
        if progress is not None:
            progress(done)

    if smoothing is not None:
        # What is held is no datum: the penalty bridges nodes without data.
        known = np.any(np.stack(problem.table.trusted), axis=0)
        smoothed, told = smooth(
            problem.values,
            np.where(known, problem.weights, 0.0),
            axes,
            knots,
            degrees,
            project=project,
            strength=None if isinstance(smoothing, str) else smoothing,
            # What the chart folds onto one node are so many readings for one datum.
            independent=None if brdf.readings is None else max(1.0, brdf.readings / len(problem.table.sides)),
            progress=progress,
        )
        model = _reported(smoothed, smoothed.spline, problem.table, problem.encoding, "smoothing")
        strength = {"strength": told.strength, "degrees_of_freedom": told.degrees_of_freedom}
        notes = [*model.report["notes"], *told.notes]
        return model.told(metric=problem.loss.name, smoothing=strength, notes=notes)
    first = loft(problem.values, axes, knots, degrees, [x.roots**2 for x in lines])
    result = fit_weighted(
        problem.values,
        problem.weights * secants(problem, first.spline),
        axes,
        knots,
        degrees,
        start=first.spline.control,
        project=project,
        max_iterations=int(np.clip(GRID_PASSES // problem.weights.size, FEWEST_STEPS, MOST_STEPS)),
        progress=lambda share: report(share / (1 + rounds)),
    )
    samples = draw_samples(brdf, chart, samples_for(result.spline.control.size // 3), weights=weights)
    spline = polish(
        result.spline,
        lines,
        samples,
        problem.encoding,
        problem.loss,
        project=project,
        rounds=rounds,
        progress=lambda share: report((1 + rounds * share) / (1 + rounds)),
    )
    report(1.0)
    return _reported(first, spline, problem.table, problem.encoding, "metric").told(metric=problem.loss.name)


def _published(
    brdf: Brdf, encoding: Encoding, size: Sequence[int], degrees: tuple[int, int, int], placement: str
) -> SplineBrdf:
    """Return the fit of Lee & Park (2008): the paper's grid, one side, equal weights, free faces."""
    table = tabulate(brdf, IN_OUT, IN_OUT.grid, mirrored=False)
    values = encoding.encode(table.sides[0])
    knots = knots_for(values, table, placement, size, degrees)
    result = loft(values, table.axes, knots, degrees)
    return _reported(result, result.spline, table, encoding, "lofting").told(knots=placement)


def _reported(result: FitResult, spline: TensorSpline, table: Table, encoding: Encoding, solver: str) -> SplineBrdf:
    known = np.any(np.stack(table.trusted), axis=0)
    report: dict[str, Any] = {
        "solver": solver,
        "grid": [len(u) for u in table.axes],
        "without_data": float(1 - known.mean()),
        "clamped": table.clamped,
        "condition": [min(c, sys.float_info.max) for c in result.conditions],
        "notes": list(result.notes),
    }
    return SplineBrdf(spline, table.chart, encoding, report)
