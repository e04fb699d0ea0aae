"""``fit`` from end to end: every bound is kept, every choice obeyed, everything told, whatever the table."""

import functools
import json

import numpy as np
import pytest

import bvbedit
from bvbedit.brdf.charts import HALF_DIFF, IN_OUT, RUSINKIEWICZ, Chart, grid_points
from bvbedit.brdf.losses import LOSSES
from bvbedit.brdf.materials import material_named
from bvbedit.brdf.measured import MeasuredBrdf
from bvbedit.brdf.metrics import estimate
from bvbedit.brdf.samples import draw_samples
from bvbedit.brdf.spline_brdf import SplineBrdf, face_spread
from bvbedit.io.budget import payload_bytes
from tests.brdf.measurements import measured
from tests.brdf.samples import Glossy, random_pairs
from tests.spline.refusals import refusal

# A material without noise, and what saves trying charts and encodings where they are not what is tested.
EXACT = Glossy(0.25)
FITTED_IN = {"half-diff": HALF_DIFF, "in-out": IN_OUT}
SHARP = {"chart": "half-diff", "encoding": "root"}
pytestmark = pytest.mark.filterwarnings("error")


@functools.cache
def _measured(chart: Chart = RUSINKIEWICZ, shape: tuple[int, int, int] = (30, 30, 36)) -> MeasuredBrdf:
    """A small measurement of satin paint with 3 % noise."""
    axes = tuple(np.arange(n) / (n - (not p)) for n, p in zip(shape, chart.periodic, strict=True))
    wi, wo = chart.to_directions(grid_points(axes))
    above = np.minimum(wi[:, 2], wo[:, 2]) > 1e-6
    f = np.zeros((len(wi), 3))
    f[above] = material_named("satin-paint").brdf.evaluate(wi[above], wo[above])
    f *= 1 + 0.03 * np.random.default_rng(0).normal(size=f.shape)
    return MeasuredBrdf(f.reshape(*shape, 3), above.reshape(shape), axes, chart)


@functools.cache
def _exact(chart: str = "half-diff", shape: tuple[int, int, int] = (46, 36, 25)) -> MeasuredBrdf:
    """The material at few nodes of the chart in which it is fitted, where tables are fitted quickly."""
    axes = tuple(np.linspace(0, 1, n) for n in shape)
    wi, wo = (np.abs(w) for w in FITTED_IN[chart].to_directions(grid_points(axes)))
    return MeasuredBrdf(EXACT.evaluate(wi, wo).reshape(*shape, 3), np.ones(shape, bool), axes, FITTED_IN[chart])


def _flat(value: float, chart: Chart = HALF_DIFF, valid: np.ndarray | None = None) -> MeasuredBrdf:
    """A table with one value wherever it is valid, and nonsense elsewhere."""
    shape = (20, 20, 20)
    mask = np.ones(shape, bool) if valid is None else valid
    values = np.where(mask[..., None], value, np.nan) * np.ones(3)
    axes = tuple(np.arange(n) / (n - (not p)) for n, p in zip(shape, chart.periodic, strict=True))
    return MeasuredBrdf(values, mask, axes, chart)


def _log_cosine(model: SplineBrdf) -> tuple[float, float]:
    told = model.report["metrics"]
    return told["grid"]["log_cosine_rms"], told["nodes"]["log_cosine_rms"]


@functools.cache
def _default() -> tuple[SplineBrdf, list[float]]:
    shares: list[float] = []
    return bvbedit.fit(_measured(), source="satin.binary", progress=shares.append), shares


@functools.cache
def _within(option: str, bound: int, precision: str = "auto") -> SplineBrdf:
    return bvbedit.fit(_exact(), precision=precision, **{option: bound}, **SHARP)


@pytest.mark.parametrize("bound", [2500, 6000])
def test_a_file_is_no_longer_than_its_bound_and_hardly_shorter(bound, tmp_path):
    model = _within("max_bytes", bound)
    path = tmp_path / "m.bvb"
    bvbedit.save(model, path, precision=None)
    assert 0.8 * bound < path.stat().st_size <= bound
    again = bvbedit.load(path)
    assert again.storage == model.storage
    assert dict(again.report) == dict(model.report)


@pytest.mark.parametrize(("bound", "precision"), [(1000, "auto"), (6000, "float16")])
def test_a_payload_is_no_more_than_its_bound_and_hardly_less(bound, precision):
    assert 0.75 * bound < payload_bytes(_within("max_payload", bound, precision)) <= bound


def test_more_bytes_make_a_better_model():
    small, large = (np.prod(_log_cosine(_within("max_bytes", bound))) for bound in (2500, 6000))
    assert large < 0.3 * small


@pytest.mark.parametrize("option", ["max_bytes", "max_payload"])
def test_bytes_that_hold_no_net_are_refused(option):
    refusal(lambda: bvbedit.fit(_exact(), **{option: 40}, **SHARP))


@pytest.mark.parametrize(("metric", "tolerance"), [("log_cosine_rms", 0.002), ("fores", 0.15)])
def test_a_tolerance_is_kept_on_both_sets_by_a_net_no_larger_than_needed(metric, tolerance):
    model = bvbedit.fit(EXACT, tolerance=tolerance, metric=metric, **SHARP)
    told = model.report["metrics"]
    errors = [told[name][metric] for name in ("grid", "nodes")]
    assert max(errors) <= 1.05 * tolerance
    assert max(errors) > 0.5 * tolerance


def test_a_tolerance_that_the_smallest_net_just_misses_is_kept_by_another():
    table = _exact(shape=(61, 46, 25))
    model = bvbedit.fit(table, tolerance=0.15, metric="fores", **SHARP)
    found = bvbedit.compare(model, table)
    assert max(found.grid.fores, found.nodes.fores) <= 1.05 * 0.15


def test_a_tolerance_below_what_the_data_are_off_by_is_refused_with_the_best_that_was_reached():
    table = _measured(IN_OUT, (20, 20, 20))
    message = refusal(lambda: bvbedit.fit(table, tolerance=1e-9, chart="in-out", encoding="root"))
    assert "log_cosine_rms of 1e-09 cannot be reached in in-out" in message


def test_by_default_the_report_tells_all_that_was_decided_in_json(tmp_path):
    model, shares = _default()
    report = json.loads(json.dumps(dict(model.report), allow_nan=False))
    assert {(t["chart"], t["encoding"]) for t in report["tried"]} >= {("half-diff", "root"), ("in-out", "root")}
    assert len(report["tried"]) == 3
    chosen = report["tried"][0]
    assert (chosen["chart"], chosen["encoding"]) == (model.chart.name, model.encoding.name)
    curve = report["curve"]
    points = [int(np.prod(step["size"])) for step in curve]
    assert points == sorted(points)
    assert list(model.spline.size) in [step["size"] for step in curve]
    assert set(report["noise"]) == {"grid", "nodes", "pole"}
    assert min(report["noise"].values()) > 0
    assert set(report["soundness"]) == {"negative", "lowest", "reciprocity", "overshoot_grid", "overshoot_nodes"}
    assert set(report["metrics"]) == {"grid", "nodes", "paper"}
    assert (report["knots"], report["metric"], report["source"]) == ("dominant", "log_cosine_rms", "satin.binary")
    assert report["seconds"] > 0
    assert shares
    assert all(0 <= s <= 1 for s in shares)
    path = tmp_path / "m.bvb"
    bvbedit.save(model, path, precision=None)
    assert dict(bvbedit.load(path).report) == dict(model.report)


def test_the_metrics_told_are_those_of_the_file(tmp_path):
    model, _ = _default()
    path = tmp_path / "m.bvb"
    bvbedit.save(model, path, precision=None)
    found = estimate(bvbedit.load(path), _measured()).to_dict()
    for name, figures in model.report["metrics"].items():
        assert figures == pytest.approx(found[name], rel=1e-9)


def test_by_default_a_net_is_as_large_as_its_features_and_near_its_noise():
    model, _ = _default()
    noise = model.report["noise"]
    assert np.prod(model.spline.size) < 3000
    for error, name in zip(_log_cosine(model), ("grid", "nodes"), strict=True):
        assert error < 1.5 * noise[name]


def test_a_fit_is_the_same_every_time():
    model, again = _within("max_payload", 1000, "auto"), bvbedit.fit(_exact(), max_payload=1000, **SHARP)
    assert again.storage == model.storage
    np.testing.assert_array_equal(again.spline.control, model.spline.control)
    for ours, theirs in zip(again.spline.knots, model.spline.knots, strict=True):
        np.testing.assert_array_equal(ours, theirs)


CHOICES = [
    ("half-diff", "root", "dominant", "float16"),
    ("half-diff", "root", "free", "quantised"),
    ("half-diff", "linear", "uniform", "auto"),
    ("in-out", "root", "averaged", "float32"),
    ("in-out", "log", "piegl-tiller", "auto"),
    ("in-out", "linear", "piegl-tiller", "float64"),
]


@functools.cache
def _chosen(chart: str, encoding: str, knots: str, precision: str, thorough: bool = False) -> SplineBrdf:
    return bvbedit.fit(
        _exact(chart),
        chart=chart,
        encoding=encoding,
        knots=knots,
        precision=precision,
        size=(9, 8, 7),
        thorough=thorough,
    )


@pytest.mark.parametrize(("chart", "encoding", "knots", "precision"), CHOICES, ids=["-".join(c) for c in CHOICES])
def test_choices_by_name_are_obeyed_to_the_file(chart, encoding, knots, precision, tmp_path, rng):
    model = _chosen(chart, encoding, knots, precision)
    path = tmp_path / "m.bvb"
    bvbedit.save(model, path, precision=None)
    again = bvbedit.load(path)
    stored = "quantised" if precision == "auto" else precision
    assert (again.chart.name, again.encoding.name, again.spline.size) == (chart, encoding, (9, 8, 7))
    assert (again.storage.precision, again.report["knots"]) == (stored, knots)
    with np.load(path) as arrays:
        assert arrays["control"].dtype == (np.uint8 if stored == "quantised" else stored)
    if encoding != "linear":
        assert max(_log_cosine(model)) < 0.05
        assert face_spread(again.spline.control, again.chart) <= 1e-12 * np.abs(again.spline.control).max()
    wi, wo = random_pairs(rng, 500, np.radians(75))
    np.testing.assert_allclose(again.evaluate(wi, wo), model.evaluate(wi, wo), rtol=0.2, atol=0.02)


def test_free_knots_are_kept_only_where_they_are_better():
    dominant, free = (_chosen(*choice) for choice in CHOICES[:2])
    (note,) = [n for n in free.report["notes"] if "free knots" in n]
    assert ("kept" in note) != ("left" in note)
    # The one is quantised, which adds some percent to each of two errors.
    assert np.prod(_log_cosine(free)) <= 1.2 * np.prod(_log_cosine(dominant))


def test_a_thorough_fit_is_no_worse():
    plain, thorough = _chosen(*CHOICES[0]), _chosen(*CHOICES[0], thorough=True)
    assert np.prod(_log_cosine(thorough)) <= 1.02 * np.prod(_log_cosine(plain))


def test_weights_lower_the_error_where_they_are():
    """A window in theta_h counts a hundred times as much as the rest: there it gains, and elsewhere it may lose."""
    samples = draw_samples(_exact(), HALF_DIFF, 5000, seed=8)
    inside = np.abs(samples.parameters[:, 0] - 0.6) < 0.15

    def rms(model: SplineBrdf, where: np.ndarray) -> float:
        f = model.encoding.decode(model.spline.evaluate(samples.parameters))
        loss = LOSSES["log_cosine_rms"]
        off = loss.transform(f, *samples.cosines) - loss.transform(samples.reflectance, *samples.cosines)
        return float(np.sqrt(np.mean(off[where] ** 2)))

    plain, focused = (
        bvbedit.fit(_exact(), size=(8, 7, 4), precision="float64", weights=weights, **SHARP)
        for weights in (None, lambda p: np.where(np.abs(p[:, 0] - 0.6) < 0.15, 100.0, 1.0))
    )
    assert rms(focused, inside) < 0.8 * rms(plain, inside)
    assert rms(focused, ~inside) > rms(plain, ~inside)


def test_smoothing_brings_a_large_net_nearer_to_what_noise_hides():
    """The finest net that the data carry follows their noise, unless its differences are penalised."""
    truth, table, options = material_named("satin-paint").brdf, _measured(), {"size": (40, 40, 12), **SHARP}
    plain, found = (bvbedit.fit(table, smoothing=s, **options) for s in (None, "auto"))
    given = bvbedit.fit(table, smoothing=1e-3, size=(8, 7, 5), **SHARP)
    strength = found.report["smoothing"]["strength"]
    assert strength > 0
    assert found.report["smoothing"]["degrees_of_freedom"] < 0.8 * 40 * 40 * 12
    assert given.report["smoothing"]["strength"] == 1e-3
    errors = [
        np.prod([getattr(estimate(m, truth), s).log_cosine_rms for s in ("grid", "nodes")]) for m in (plain, found)
    ]
    assert errors[1] < 0.9 * errors[0]


def test_the_published_configuration_is_fitted_without_trials():
    options = {"chart": "in-out", "encoding": "linear", "knots": "piegl-tiller"}
    model = bvbedit.fit(_measured(), size=(6, 6, 9), source="satin.binary", **options)
    assert model.report["solver"] == "lofting"
    assert model.report["source"] == "satin.binary"
    assert "tried" not in model.report
    assert set(model.report["metrics"]) == {"grid", "nodes", "paper"}
    assert model.storage.precision == "float32"
    assert bvbedit.fit(_measured(), size=(6, 6, 9), precision="quantised", **options).storage.step > 0


def test_a_size_that_one_chart_carries_is_fitted_in_that():
    model = bvbedit.fit(_measured(), size=(8, 8, 70))
    assert model.chart is IN_OUT
    assert {t["chart"] for t in model.report["tried"]} == {"in-out"}
    assert "Choose at most" in refusal(lambda: bvbedit.fit(_measured(), size=(8, 8, 152)))


@functools.cache
def _fitted_for(metric: str) -> SplineBrdf:
    return bvbedit.fit(measured("satin-paint"), metric=metric, size=(20, 14, 6), **SHARP)


@pytest.mark.parametrize("metric", ["fores", "relative_l1"])
def test_a_metric_asked_for_is_no_worse_than_by_a_fit_for_another(metric):
    """The geometric mean over both sets, of a noisy measurement."""
    asked, other = (_fitted_for(name).report["metrics"] for name in (metric, "log_cosine_rms"))
    product = [np.sqrt(told["grid"][metric] * told["nodes"][metric]) for told in (asked, other)]
    assert product[0] <= 1.02 * product[1]
    assert _fitted_for(metric).report["metric"] == metric


def _finite(model: SplineBrdf) -> None:
    assert np.isfinite(model.spline.control).all()
    report = json.loads(json.dumps(dict(model.report), allow_nan=False))
    assert np.isfinite(report["metrics"]["grid"]["log_cosine_rms"])
    wi, wo = random_pairs(np.random.default_rng(1), 2000)
    f = model.evaluate(wi, wo)
    assert np.isfinite(f).all()
    assert f.min() >= 0


@pytest.mark.parametrize("options", [{}, {"max_bytes": 4000, "metric": "fores", **SHARP}], ids=str)
def test_a_black_table_makes_a_black_model(options, rng):
    model = bvbedit.fit(_flat(0.0), **options)
    _finite(model)
    np.testing.assert_array_equal(model.evaluate(*random_pairs(rng, 500)), 0.0)
    assert np.prod(model.spline.size) == 64


@pytest.mark.parametrize("options", [{}, {"metric": "relative_l1", "max_payload": 3000}], ids=str)
def test_a_saturated_table_is_fitted_up_to_the_largest_reflectance(options, rng):
    model = bvbedit.fit(_flat(1e300, IN_OUT), **options)
    _finite(model)
    np.testing.assert_allclose(model.evaluate(*random_pairs(rng, 500, np.radians(75))), 1e5, rtol=0.05)


@pytest.mark.parametrize(
    ("chart", "fitted_in"),
    [(RUSINKIEWICZ, "half-diff"), (RUSINKIEWICZ, "in-out"), (IN_OUT, "half-diff"), (IN_OUT, "in-out")],
    ids=lambda x: getattr(x, "name", x),
)
def test_a_table_with_one_region_of_valid_cells_is_extended_calmly(chart, fitted_in, rng):
    """The rest is held from it: a flat region makes a flat model, everywhere."""
    place = np.indices((20, 20, 20)) / 20
    model = bvbedit.fit(_flat(0.3, chart, (np.abs(place - 0.4) < 0.12).all(axis=0)), chart=fitted_in, encoding="root")
    _finite(model)
    np.testing.assert_allclose(model.evaluate(*random_pairs(rng, 2000)), 0.3, rtol=0.02)
