"""Fitting as the Python surface, edits and recipes have it: what is asked is checked, and the size of the net found.

Knows models and how many bytes their files take; nothing of scenes, whose interest is made by others, nor of edits.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bvbedit.brdf.base import Brdf, check_brdf
from bvbedit.brdf.charts import FITTING_CHARTS, IN_OUT, Chart, chart_named
from bvbedit.brdf.encodings import Encoding, encoding_named
from bvbedit.brdf.fit import AUTO, THOROUGH_ROUNDS, fit_net, is_published, settle
from bvbedit.brdf.geometry import Floats
from bvbedit.brdf.interest import Interest
from bvbedit.brdf.losses import Distance, Loss, loss_named
from bvbedit.brdf.metrics import estimate
from bvbedit.brdf.noise import estimate_noise
from bvbedit.brdf.plan import Plan, checked_degrees, checked_placement, checked_size, plan, try_charts
from bvbedit.brdf.problem import Weights, charts_for, on_any_chart, tabulate
from bvbedit.brdf.samples import Samples, draw_samples
from bvbedit.brdf.sizing import Step, error_curve, knee, points_for, sufficient, traded
from bvbedit.brdf.soundness import soundness
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.brdf.storage import PRECISIONS, storage_named
from bvbedit.errors import BvbError
from bvbedit.io.budget import file_bytes, first_guess, kept_within, payload_bytes, reserved, size_within
from bvbedit.spline.arguments import is_real_within, is_whole, shown

Progress = Callable[[float], None]
# More of a report, told of the model that has the rest of it.
Told = Callable[[SplineBrdf], Mapping[str, Any]]

LINEAR = "linear"
# What ``encoding="auto"`` tries: those that highlights ask for.
ENCODINGS = ("root", "log")
# The knee of the error curve is looked for up to so many control points, a file of about 100 KB.
LARGEST_KNEE = 64_000
# A tolerance is pursued up to so many.
LARGEST_NET = 200_000
TOLERANCE_TRIES = 6
# The walk to larger nets never takes longer steps.
STEP = 4.0
# A net that is this much better than a tolerance asks for is tried smaller.
TOO_GOOD = 0.9
# Bytes that no model needs.
LARGEST_BUDGET = 1 << 30
# Pairs of each set that judge the sizes of nets, others than those of the trials and of the fit.
JUDGES, JUDGING_SEED = 20_000, 1


@dataclass(frozen=True)
class Wish:
    """The checked arguments of ``bvbedit.fit``, whose meanings they have; see ``wished``."""

    charts: tuple[Chart, ...]
    encodings: tuple[Encoding, ...]
    size: tuple[int, int, int] | None
    degrees: tuple[int, int, int]
    knots: str
    max_bytes: int | None
    max_payload: int | None
    tolerance: float | None
    loss: Loss
    weights: Weights | Interest | None
    precision: str
    rounds: int
    smoothing: float | str | None
    source: str


def wished(
    *,
    chart: str = AUTO,
    encoding: str = AUTO,
    size: Sequence[int] | None = None,
    degrees: Sequence[int] = (3, 3, 3),
    knots: str = "dominant",
    max_bytes: int | None = None,
    max_payload: int | None = None,
    tolerance: float | None = None,
    metric: str = "log_cosine_rms",
    weights: Callable[[Floats], Floats] | None = None,
    precision: str = AUTO,
    thorough: bool = False,
    smoothing: float | str | None = None,
    source: str = "",
) -> Wish:
    """Return what is asked of a fit. Raises BvbError for all that can be known to be wrong before there are data."""
    if sum(x is not None for x in (size, max_bytes, max_payload, tolerance)) > 1:
        raise BvbError("size, max_bytes, max_payload and tolerance exclude each other. Give one of them.")
    wanted = on_any_chart(weights)
    for name, text in (("precision", precision), ("source", source)):
        if not isinstance(text, str):
            raise BvbError(f"{name} is {shown(text)}. Give a text.")
    if not isinstance(thorough, bool | np.bool_):
        raise BvbError(f"thorough is {shown(thorough)}. Give True or False.")
    loss = loss_named(metric)
    if isinstance(loss, Distance):
        # Least squares on samples misses most of what E counts, which stands in a few peaks: lofting does not.
        chart = IN_OUT.name if _is_auto(chart) else chart
        encoding = LINEAR if _is_auto(encoding) else encoding
    charts = [chart_named(name) for name in (FITTING_CHARTS if _is_auto(chart) else (chart,))]
    if charts[0].name not in FITTING_CHARTS:
        raise BvbError(f"Chart {chart!r} is for tables only. Fit in one of {', '.join((AUTO, *FITTING_CHARTS))}.")
    if precision not in (AUTO, *PRECISIONS):
        raise BvbError(f"Unknown precision {shown(precision)}. Choose one of {', '.join((AUTO, *PRECISIONS))}.")
    if smoothing is not None and not _is_auto(smoothing) and not is_real_within(smoothing, 0.0, 1e15):
        raise BvbError(f"smoothing is {shown(smoothing)}. Give a strength in 0 ... 1e15, or {AUTO!r}.")
    encodings = tuple(encoding_named(name) for name in (ENCODINGS if _is_auto(encoding) else (encoding,)))
    checked, placement = checked_degrees(degrees), checked_placement(knots)
    if isinstance(loss, Distance) and not is_published(charts[0], encodings[0], placement, loss):
        raise BvbError(
            f"{loss.name} is the paper's error, of its chart and encoding. Choose chart {IN_OUT.name} and encoding "
            f"{LINEAR}, or another metric."
        )
    if precision == AUTO:
        # The paper's nets are floats.
        published = len(charts) == 1 and is_published(charts[0], encodings[0], placement, loss)
        precision = "float32" if published else "quantised"
    for name, bound in (("max_bytes", max_bytes), ("max_payload", max_payload)):
        if bound is not None and (not is_whole(bound) or not 1 <= bound <= LARGEST_BUDGET):
            raise BvbError(f"{name} is {shown(bound)}. Give a whole number of bytes from 1 to {LARGEST_BUDGET:,}.")
    if tolerance is not None and not is_real_within(tolerance, 1e-12, 1e12):
        raise BvbError(f"tolerance is {shown(tolerance)}. Give a number above zero.")
    return Wish(
        charts=tuple(charts),
        encodings=encodings,
        size=None if size is None else checked_size(size),
        degrees=checked,
        knots=placement,
        max_bytes=max_bytes,
        max_payload=max_payload,
        tolerance=tolerance,
        loss=loss,
        weights=wanted,
        precision=precision,
        rounds=THOROUGH_ROUNDS if thorough else 1,
        smoothing=smoothing,
        source=source,
    )


def fitted(
    brdf: Brdf,
    wish: Wish,
    *,
    interest: Interest | None = None,
    more: Told | None = None,
    progress: Progress | None = None,
) -> SplineBrdf:
    """Return an editable B-spline volume that approximates ``brdf`` as wished, with a report. See ``bvbedit.fit``.

    ``interest`` replaces metric and weights. ``more`` returns what else the report is to tell, given the model with the
    rest of it: these bytes count too. Raises BvbError for a net larger than the data, bounds too small for any net, and
    a tolerance that cannot be reached.
    """
    check_brdf(brdf, "brdf")
    metric = wish.loss
    if interest is not None:
        wish = replace(wish, loss=interest.loss, weights=interest)
    if wish.weights is not None and is_published(wish.charts[0], wish.encodings[0], wish.knots, wish.loss):
        raise BvbError(
            "The paper's configuration weighs all alike. Leave weights and scene out, or choose another chart."
        )
    size, max_bytes, max_payload, tolerance = wish.size, wish.max_bytes, wish.max_payload, wish.tolerance

    noise = estimate_noise(brdf, metric)
    if size is not None:
        wish = replace(wish, charts=charts_for(brdf, wish.charts, size))
        if len(wish.charts) == 1 and is_published(wish.charts[0], wish.encodings[0], wish.knots, wish.loss):
            model = _published(brdf, wish.charts[0], wish.encodings[0], size, wish)
            stored = storage_named(wish.precision, model.spline.control)
            model = model.stored_as(stored).told(source=wish.source, noise=noise.to_dict())
            return _measured(model, brdf, more)
    budget = max_bytes if max_bytes is not None else max_payload
    if size is not None:
        points = int(np.prod(size))
    elif budget is not None:
        points = first_guess(budget, wish.precision)
    else:
        points = LARGEST_KNEE // 8
    trials = try_charts(
        brdf, wish.charts, wish.encodings, wish.loss, degrees=wish.degrees, points=points, weights=wish.weights
    )
    best = trials[0]
    samples = draw_samples(brdf, best.chart, JUDGES, JUDGING_SEED, wish.weights)
    largest = max(size) ** 3 if size is not None else points if budget is not None else LARGEST_NET
    made = plan(
        tabulate(brdf, best.chart),
        best.encoding,
        wish.loss,
        best.balance,
        degrees=wish.degrees,
        placement=wish.knots,
        points=largest,
        weights=wish.weights,
        surrogate=best.surrogate,
    )
    # What the chart averages out of what is fitted is still in the data that nets are judged by.
    averaged = interest is None and best.chart.reciprocal and wish.loss.power == 2
    floor = (noise.grid, noise.nodes) if averaged else (0.0, 0.0)

    def told(model: SplineBrdf, curve: list[Step]) -> SplineBrdf:
        return model.told(
            noise=noise.to_dict(), tried=[t.to_dict() for t in trials], curve=[step.to_dict() for step in curve]
        )

    def dealt(size: tuple[int, ...]) -> tuple[int, ...]:
        return size if interest is None else traded(made, samples, size)

    if budget is not None:
        count = file_bytes if max_bytes is not None else payload_bytes
        curve = error_curve(made, samples, int(np.prod(size_within(made, samples, budget, wish.precision, count))))
        net = dealt(sufficient(curve, floor).size)
        while True:
            model = told(_settled(brdf, made, net, wish, samples, progress), curve)
            kept = kept_within(model, budget, count, lambda stored: _measured(stored, brdf, more))
            if kept is not None:
                return kept
            net = dealt(_smaller(made, net, (budget - reserved(count)) / count(model), budget))
    if size is not None:
        model = _settled(brdf, made, size, wish, samples, progress)
        return _measured(told(model, error_curve(made, samples, points)), brdf, more)
    curve = error_curve(made, samples, LARGEST_KNEE)
    if tolerance is None:
        model = _settled(brdf, made, knee(curve, floor).size, wish, samples, progress)
    else:
        model = _to_tolerance(brdf, made, wish, samples, tolerance, curve, progress)
    return _measured(told(model, curve), brdf, more)


def _is_auto(value: object) -> bool:
    """Return whether ``value`` is the word; an array would compare element by element."""
    return isinstance(value, str) and value == AUTO


def _settled(
    brdf: Brdf,
    made: Plan,
    size: Sequence[int],
    wish: Wish,
    samples: Samples,
    progress: Progress | None,
) -> SplineBrdf:
    """Return the model of this size, stored as it is best."""
    chart, encoding = made.problem.chart, made.problem.encoding
    if is_published(chart, encoding, wish.knots, wish.loss):
        model = _published(brdf, chart, encoding, size, wish)
    else:
        model = _settled_over(brdf, made, size, wish, progress)
    errors = samples.errors_of(model.spline, encoding, wish.loss)
    if wish.knots == "free":
        freed = _settled_over(brdf, made.freed(size), size, wish, progress)
        better = samples.errors_of(freed.spline, encoding, wish.loss)
        gain = float(np.sqrt(np.prod(better) / max(np.prod(errors), np.finfo(float).tiny)))
        if gain < 1:
            model, errors = freed, better
        notes = [*model.report["notes"], f"free knots: {gain:.3g} times the error of dominant points, {_kept(gain)}"]
        model = model.told(notes=notes)
    return model.stored_as(made.storage(wish.precision, model.spline, samples)).told(
        knots=wish.knots, source=wish.source
    )


def _published(brdf: Brdf, chart: Chart, encoding: Encoding, size: Sequence[int], wish: Wish) -> SplineBrdf:
    """Return the model in the paper's configuration, with a report that tells no times: these are the caller's."""
    model = fit_net(brdf, chart, encoding, size=size, degrees=wish.degrees, knots=wish.knots, metric=wish.loss.name)
    report = {name: value for name, value in model.report.items() if name != "seconds"}
    return SplineBrdf(model.spline, chart, encoding, report, storage=model.storage)


def _settled_over(brdf: Brdf, made: Plan, size: Sequence[int], wish: Wish, progress: Progress | None) -> SplineBrdf:
    return settle(
        brdf, made, size, weights=wish.weights, rounds=wish.rounds, smoothing=wish.smoothing, progress=progress
    )


def _kept(gain: float) -> str:
    return "kept" if gain < 1 else "left"


def _smaller(made: Plan, size: Sequence[int], share: float, budget: int) -> tuple[int, ...]:
    """Return a net of about ``share`` of the control points of ``size``. Raises BvbError where there is none."""
    smaller = made.walk(int(np.prod(size) * 0.98 * min(share, 1.0)))[-1]
    if np.prod(smaller) >= np.prod(size):
        raise BvbError(f"{budget} bytes hold no net of degrees {made.degrees} and its report. Allow more.")
    return smaller


def _to_tolerance(
    brdf: Brdf,
    made: Plan,
    wish: Wish,
    samples: Samples,
    tolerance: float,
    curve: list[Step],
    progress: Progress | None,
) -> SplineBrdf:
    """Return the smallest model found whose metric over both sets is within ``tolerance``, as stored."""
    points, good, reached = points_for(curve, tolerance), None, np.inf
    bounds = [0.0, np.inf]
    for _ in range(TOLERANCE_TRIES):
        # The first net of so many that is none of those that were not good enough.
        walk = made.walk(int(min(max(points, STEP * bounds[0]), LARGEST_NET)))
        size = next((n for n in walk if np.prod(n) >= points and np.prod(n) > bounds[0]), walk[-1])
        if np.prod(size) <= bounds[0] or np.prod(size) >= bounds[1]:
            break
        model = _settled(brdf, made, size, wish, samples, progress)
        stored = model.spline.with_control(model.storage.rounded(model.spline.control))
        error = max(samples.metrics(samples.errors_of(stored, model.encoding, wish.loss), wish.loss))
        reached, points = min(reached, error), int(np.prod(size))
        bounds[error <= tolerance] = points
        if error <= tolerance:
            good = model
            if error >= TOO_GOOD * tolerance or points == curve[0].points:
                break
        elif points >= 0.9 * LARGEST_NET:
            break
        # The error falls with about the square root of the number of control points.
        guess = points * float(np.clip((error / (0.96 * tolerance)) ** 2, 0.3, 3.0))
        points = int(min(max(guess, 1.02 * bounds[0]), 0.98 * bounds[1]))
        if bounds[1] < 1.1 * bounds[0]:
            break
    if good is None:
        raise BvbError(
            f"{wish.loss.name} of {tolerance:g} cannot be reached in {made.problem.chart.name}: {reached:.3g} is the "
            f"best, of up to {int(bounds[0]):,} control points. Allow more, or choose another chart."
        )
    return good


def _measured(model: SplineBrdf, brdf: Brdf, more: Told | None) -> SplineBrdf:
    """Return the model with a report of how good it is as stored, and of what else is to be told."""
    stored = model.with_spline(model.spline.with_control(model.storage.rounded(model.spline.control)))
    told = model.told(metrics=estimate(stored, brdf).to_dict(), soundness=soundness(stored, brdf))
    return told if more is None else told.told(**more(told))
