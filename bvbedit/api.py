"""The few verbs of the Python surface, composed from the rooms."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from bvbedit.brdf.base import Brdf, check_brdf
from bvbedit.brdf.blend import blend
from bvbedit.brdf.charts import FITTING_CHARTS, Chart, chart_named
from bvbedit.brdf.encodings import Encoding, encoding_named
from bvbedit.brdf.fit import AUTO, THOROUGH_ROUNDS, fit_net, is_published, settle
from bvbedit.brdf.geometry import Floats
from bvbedit.brdf.interest import Interest
from bvbedit.brdf.losses import Loss, loss_named
from bvbedit.brdf.metrics import Comparison, compare, estimate
from bvbedit.brdf.noise import estimate_noise
from bvbedit.brdf.plan import Plan, checked_degrees, checked_placement, checked_size, plan, try_charts
from bvbedit.brdf.problem import Weights, charts_for, on_any_chart, tabulate
from bvbedit.brdf.samples import Samples, draw_samples
from bvbedit.brdf.sizing import Step, error_curve, knee, points_for, sufficient, traded
from bvbedit.brdf.soundness import soundness
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.brdf.storage import PRECISIONS, storage_named
from bvbedit.errors import BvbError
from bvbedit.io import load, save
from bvbedit.io.budget import file_bytes, first_guess, kept_within, payload_bytes, reserved, size_within
from bvbedit.render import render
from bvbedit.spline.arguments import is_real_within, is_whole, shown

if TYPE_CHECKING:
    from bvbedit.render.scene import Scene

__all__ = ["Comparison", "blend", "compare", "fit", "load", "render", "save"]

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
class _Wish:
    """The checked arguments of ``fit``."""

    charts: tuple[Chart, ...]
    encodings: tuple[Encoding, ...]
    degrees: tuple[int, int, int]
    knots: str
    loss: Loss
    weights: Weights | Interest | None
    precision: str
    rounds: int
    smoothing: float | str | None
    source: str


def fit(
    brdf: Brdf,
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
    scene: "str | PathLike[str] | Scene | None" = None,
    precision: str = AUTO,
    thorough: bool = False,
    smoothing: float | str | None = None,
    source: str = "",
    progress: Callable[[float], None] | None = None,
) -> SplineBrdf:
    """Return an editable B-spline volume that approximates ``brdf``, with a report.

    ``chart``: ``half-diff`` (sharp highlights), ``in-out`` (the paper's), or ``auto``: the better one by a quick fit.
    ``encoding``: ``linear``, ``root``, ``log``, or ``auto``. ``knots``: ``dominant`` (where the material has features),
    ``free`` (moved from there by NLopt), ``averaged``, ``piegl-tiller`` (the paper's) or ``uniform``.

    How large: ``size``, control points along each axis; ``max_bytes``, of the saved file; ``max_payload``, bytes of
    the control net and interior knots as stored; or ``tolerance``, of the metric over both of its sample sets. They
    exclude each other. With none of them the net is as large as the knee of the error curve asks for.

    ``metric`` names what is to be small: ``log_cosine_rms``, ``fores`` or ``relative_l1``. ``weights``, a function of
    chart parameters (n, 3) that returns (n,) >= 0, multiplies the weights that follow from it. ``scene``, as ``render``
    has it, replaces both: what counts is what that scene shows of the material, on an 8-bit screen; ``tolerance`` then
    bounds the root mean square error of its pixels, 0 ... 1 (``picture_rms``). ``precision``: ``quantised``
    (``auto``, but ``float32`` in the paper's configuration; it adds 4 % to the error), ``float16``, ``float32`` or
    ``float64``.
    ``smoothing`` penalises differences of the net, for noisy data: a strength, or ``auto`` for the one that generalised
    cross-validation finds. ``thorough`` takes more steps on the metric itself and seconds longer. ``source`` names the
    data in the report, whose bytes count too.

    ``report`` tells what was tried, the error curve, how sound the model is, and how far from ``brdf``, measured over
    50,000 pairs of each sample set (``report["metrics"]``).

    Raises BvbError for unknown names, a net larger than the data, bounds too small for any net, and a tolerance that
    cannot be reached.

    >>> from bvbedit.brdf.analytic import Lambert
    >>> model = fit(Lambert((0.5, 0.5, 0.5)), size=(4, 4, 4))
    >>> round(float(model.evaluate([0, 0, 1], [1, 0, 1])[0]), 5)
    0.15915
    """
    start = perf_counter()
    check_brdf(brdf, "brdf")
    if sum(x is not None for x in (size, max_bytes, max_payload, tolerance)) > 1:
        raise BvbError("size, max_bytes, max_payload and tolerance exclude each other. Give one of them.")
    wanted = on_any_chart(weights)
    wish = _checked(chart, encoding, degrees, knots, metric, wanted, precision, thorough, smoothing, source)
    if scene is not None:
        if weights is not None:
            raise BvbError("weights and scene exclude each other. Give one of them.")
        from bvbedit.render.footprint import footprint

        interest = footprint(brdf, scene)
        wish = replace(wish, loss=interest.loss, weights=interest)
    if wish.weights is not None and is_published(wish.charts[0], wish.encodings[0], wish.knots):
        raise BvbError(
            "The paper's configuration weighs all alike. Leave weights and scene out, or choose other knots."
        )
    for name, bound in (("max_bytes", max_bytes), ("max_payload", max_payload)):
        if bound is not None and (not is_whole(bound) or not 1 <= bound <= LARGEST_BUDGET):
            raise BvbError(f"{name} is {shown(bound)}. Give a whole number of bytes from 1 to {LARGEST_BUDGET:,}.")
    if tolerance is not None and not is_real_within(tolerance, 1e-12, 1e12):
        raise BvbError(f"tolerance is {shown(tolerance)}. Give a number above zero.")
    if size is not None:
        size = checked_size(size)

    noise = estimate_noise(brdf, loss_named(metric))
    if size is not None:
        wish = replace(wish, charts=charts_for(brdf, wish.charts, size))
        if len(wish.charts) == 1 and is_published(wish.charts[0], wish.encodings[0], wish.knots):
            model = fit_net(brdf, wish.charts[0], wish.encodings[0], size=size, degrees=wish.degrees, knots=wish.knots)
            stored = storage_named(wish.precision, model.spline.control)
            model = model.stored_as(stored).told(source=wish.source, noise=noise.to_dict())
            return _measured(model, brdf, start)
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
    averaged = scene is None and best.chart.reciprocal and wish.loss.power == 2
    floor = (noise.grid, noise.nodes) if averaged else (0.0, 0.0)

    def told(model: SplineBrdf, curve: list[Step]) -> SplineBrdf:
        return model.told(
            noise=noise.to_dict(), tried=[t.to_dict() for t in trials], curve=[step.to_dict() for step in curve]
        )

    def dealt(size: tuple[int, ...]) -> tuple[int, ...]:
        return size if scene is None else traded(made, samples, size)

    if budget is not None:
        count = file_bytes if max_bytes is not None else payload_bytes
        curve = error_curve(made, samples, int(np.prod(size_within(made, samples, budget, wish.precision, count))))
        size = dealt(sufficient(curve, floor).size)
        while True:
            model = told(_settled(brdf, made, size, wish, samples, progress), curve)
            kept = kept_within(model, budget, count, lambda stored: _measured(stored, brdf, start))
            if kept is not None:
                return kept
            size = dealt(_smaller(made, size, (budget - reserved(count)) / count(model), budget))
    if size is not None:
        model = _settled(brdf, made, size, wish, samples, progress)
        return _measured(told(model, error_curve(made, samples, points)), brdf, start)
    curve = error_curve(made, samples, LARGEST_KNEE)
    if tolerance is None:
        model = _settled(brdf, made, knee(curve, floor).size, wish, samples, progress)
    else:
        model = _to_tolerance(brdf, made, wish, samples, tolerance, curve, progress)
    return _measured(told(model, curve), brdf, start)


def _checked(
    chart: str,
    encoding: str,
    degrees: Sequence[int],
    knots: str,
    metric: str,
    weights: Weights | None,
    precision: str,
    thorough: bool,
    smoothing: float | str | None,
    source: str,
) -> _Wish:
    for name, text in (("precision", precision), ("source", source)):
        if not isinstance(text, str):
            raise BvbError(f"{name} is {shown(text)}. Give a text.")
    if not isinstance(thorough, bool | np.bool_):
        raise BvbError(f"thorough is {shown(thorough)}. Give True or False.")
    charts = [chart_named(name) for name in (FITTING_CHARTS if _is_auto(chart) else (chart,))]
    if charts[0].name not in FITTING_CHARTS:
        raise BvbError(f"Chart {chart!r} is for tables only. Fit in one of {', '.join((AUTO, *FITTING_CHARTS))}.")
    if precision not in (AUTO, *PRECISIONS):
        raise BvbError(f"Unknown precision {shown(precision)}. Choose one of {', '.join((AUTO, *PRECISIONS))}.")
    if smoothing is not None and not _is_auto(smoothing) and not is_real_within(smoothing, 0.0, 1e15):
        raise BvbError(f"smoothing is {shown(smoothing)}. Give a strength in 0 ... 1e15, or {AUTO!r}.")
    encodings = tuple(encoding_named(name) for name in (ENCODINGS if _is_auto(encoding) else (encoding,)))
    if precision == AUTO:
        # The paper's nets are floats.
        published = len(charts) == 1 and is_published(charts[0], encodings[0], checked_placement(knots))
        precision = "float32" if published else "quantised"
    return _Wish(
        tuple(charts),
        encodings,
        checked_degrees(degrees),
        checked_placement(knots),
        loss_named(metric),
        weights,
        precision,
        THOROUGH_ROUNDS if thorough else 1,
        smoothing,
        source,
    )


def _is_auto(value: object) -> bool:
    """Return whether ``value`` is the word; an array would compare element by element."""
    return isinstance(value, str) and value == AUTO


def _settled(
    brdf: Brdf,
    made: Plan,
    size: Sequence[int],
    wish: _Wish,
    samples: Samples,
    progress: Callable[[float], None] | None,
) -> SplineBrdf:
    """Return the model of this size, stored as it is best."""
    chart, encoding = made.problem.chart, made.problem.encoding
    if is_published(chart, encoding, wish.knots):
        model = fit_net(brdf, chart, encoding, size=size, degrees=wish.degrees, knots=wish.knots)
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


def _settled_over(
    brdf: Brdf, made: Plan, size: Sequence[int], wish: _Wish, progress: Callable[[float], None] | None
) -> SplineBrdf:
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
    wish: _Wish,
    samples: Samples,
    tolerance: float,
    curve: list[Step],
    progress: Callable[[float], None] | None,
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


def _measured(model: SplineBrdf, brdf: Brdf, start: float) -> SplineBrdf:
    """Return the model with a report of how good it is as stored, and of the time since ``start``."""
    stored = model.with_spline(model.spline.with_control(model.storage.rounded(model.spline.control)))
    return model.told(
        metrics=estimate(stored, brdf).to_dict(), soundness=soundness(stored, brdf), seconds=perf_counter() - start
    )
