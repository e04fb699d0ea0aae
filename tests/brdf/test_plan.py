"""What is decided before a fit: chart, encoding, knots, sizes, and the step in which a net is stored."""

import functools
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.charts import HALF_DIFF, IN_OUT, Chart
from bvbedit.brdf.encodings import Encoding, Linear, Log, Root
from bvbedit.brdf.losses import LOSSES
from bvbedit.brdf.materials import material_named
from bvbedit.brdf.measured import MeasuredBrdf
from bvbedit.brdf.plan import KNOT_GRID, SMALLEST_ERROR, UNSURE, Plan, balance_of, checked_placement, plan, try_charts
from bvbedit.brdf.problem import tabulate
from bvbedit.brdf.samples import Samples, draw_samples
from bvbedit.brdf.spline_brdf import face_spread
from bvbedit.spline.knots import checked_knots
from tests.brdf.measurements import measured
from tests.brdf.samples import Glossy
from tests.spline.refusals import refusal

LOG_COSINE = LOSSES["log_cosine_rms"]
SMALL = tuple(np.linspace(0, 1, n) for n in (31, 26, 13))
each_chart = pytest.mark.parametrize("chart", [IN_OUT, HALF_DIFF], ids=lambda c: c.name)
each_placement = pytest.mark.parametrize("placement", ["dominant", "free", "averaged", "piegl-tiller", "uniform"])


def _plan(
    brdf: Brdf,
    chart: Chart = HALF_DIFF,
    encoding: Encoding | None = None,
    axes: tuple[np.ndarray, ...] = SMALL,
    **options: object,
) -> Plan:
    options = {"degrees": (3, 3, 3), "placement": "dominant", "points": 4000} | options
    return plan(tabulate(brdf, chart, axes), encoding or Root(), LOG_COSINE, (1.0, 1.0), **options)


@functools.cache
def _made(placement: str = "dominant", chart: Chart = HALF_DIFF, degrees: tuple[int, int, int] = (3, 3, 3)) -> Plan:
    return _plan(Glossy(0.25), chart, placement=placement, degrees=degrees)


@each_chart
@pytest.mark.parametrize("points", [1, 64, 200, 1500, 10**9])
def test_the_walk_grows_from_the_smallest_net_within_the_points_allowed(chart, points):
    made = _made(chart=chart)
    walk = made.walk(points)
    assert walk[0] == (4, 4, 4)
    for before, after in pairwise(walk):
        grown = [a - b for a, b in zip(after, before, strict=True)]
        assert sorted(grown)[:2] == [0, 0]
        assert 1 <= max(grown) <= 4
    assert all(np.prod(size) <= points for size in walk[1:])
    for size in walk:
        assert all(path.fewest <= n <= path.most for path, n in zip(made.paths, size, strict=True))


@each_chart
def test_each_step_of_the_walk_lowers_the_bound_of_the_error(chart):
    """The squared residual of a tensor product is at most the sum of those of its axes."""
    made = _made(chart=chart)
    bounds = [sum(path.error_of(n) for path, n in zip(made.paths, size, strict=True)) for size in made.walk(3000)]
    assert (np.diff(bounds) < 0).all()
    assert bounds[-1] < 1e-3 * bounds[0]


@pytest.mark.parametrize("degrees", [(1, 2, 3), (0, 1, 5), (4, 3, 2)])
def test_the_smallest_net_is_that_of_the_degrees(degrees):
    made = _made(degrees=degrees)
    assert made.walk(1) == [tuple(p + 1 for p in degrees)]
    assert made.lofted(made.walk(300)[-1]).degrees == degrees


def test_no_control_points_are_spent_on_noise():
    """Both can be followed by as many; the noisy measurement has features for fewer."""
    axes = tuple(np.linspace(0, 1, n) for n in (61, 46, 19))
    noisy = _plan(measured("satin-paint"), axes=axes, points=200_000)
    clean = _plan(material_named("satin-paint").brdf, axes=axes, points=200_000)
    assert sum(x.noise.sum() for x in clean.lines) == 0
    assert all(x.noise.sum() > 0 for x in noisy.lines)
    ends = [int(np.prod(made.walk(10**6)[-1])) for made in (noisy, clean)]
    assert ends[0] < 0.3 * ends[1]
    # And yet the features of the highlight are followed.
    assert noisy.walk(10**6)[-1][0] >= 8


@each_placement
def test_knots_are_full_clamped_vectors_of_every_size(placement):
    made = _made(placement)
    for size in ((4, 4, 4), (9, 7, 5), (20, 18, 10)):
        for t, n in zip(made.knots(size), size, strict=True):
            checked_knots(t, 3)
            assert len(t) == n + 4
            assert (t[0], t[-1]) == (0.0, 1.0)


def test_dominant_knots_are_short_numbers_so_that_they_take_few_bytes():
    for path in _made().paths:
        for t in path.knots:
            np.testing.assert_array_equal(t, np.round(t / KNOT_GRID) * KNOT_GRID)


@pytest.mark.parametrize("side", [0, 1])
def test_knots_gather_where_the_weights_are(side):
    """Two equal features along the first axis, one of which counts a million times as much."""
    u, v, _ = np.meshgrid(*SMALL, indexing="ij")
    f = 0.2 + np.exp(-(((u - 0.3) / 0.05) ** 2)) + np.exp(-(((u - 0.7) / 0.05) ** 2)) + 0.1 * v
    table = MeasuredBrdf(f[..., None] * np.ones(3), np.ones(f.shape, bool), SMALL, HALF_DIFF)
    made = _plan(table, weights=lambda _chart, p: np.where((p[:, 0] > 0.5) == side, 1.0, 1e-6))
    (t, _, _) = made.knots((14, 5, 5))
    t = t[4:-4]
    inside = [np.count_nonzero(np.abs(t - at) < 0.2) for at in (0.3, 0.7)]
    assert inside[side] >= 3 * max(inside[1 - side], 1)


@pytest.mark.parametrize("size", [(3, 8, 8), (8, 8, 14), (8, 10**6, 8), (8, 0, 8)])
def test_sizes_that_the_data_do_not_carry_are_refused_by_axis(size):
    message = refusal(lambda: _made().knots(size))
    assert any(name in message for name in HALF_DIFF.axes)


@each_chart
def test_the_quick_fit_keeps_degenerate_faces(chart):
    spline = _made(chart=chart).lofted((9, 8, 6))
    assert spline.size == (9, 8, 6)
    assert face_spread(spline.control, chart) <= 1e-12 * np.abs(spline.control).max()


def test_the_quick_fit_comes_nearer_with_size():
    made, samples = _made(), draw_samples(Glossy(0.25), HALF_DIFF, 2000)
    errors = [
        samples.errors_of(made.lofted(n), Root(), LOG_COSINE).max() for n in ((6, 5, 4), (12, 10, 6), (24, 20, 10))
    ]
    assert errors[1] < 0.5 * errors[0]
    assert errors[2] < 0.5 * errors[1]


def test_freed_knots_leave_less_along_each_axis():
    made, size = _made(), (10, 8, 6)
    freed = made.freed(size)
    for before, after, n in zip(made.paths, freed.paths, size, strict=True):
        # Knots are rounded after they were moved.
        assert after.error_of(n) <= 1.001 * before.error_of(n)
        np.testing.assert_array_equal(after.of(n - 1), before.of(n - 1))
    assert any(not np.array_equal(a, b) for a, b in zip(freed.knots(size), made.knots(size), strict=True))


@functools.cache
def _judges(seed: int = 3) -> Samples:
    return draw_samples(Glossy(0.25), HALF_DIFF, 8000, seed=seed)


@pytest.mark.parametrize("precision", ["float16", "float32", "float64"])
def test_float_nets_are_stored_as_they_are_called(precision):
    storage = _made().storage(precision, _made().lofted((8, 8, 5)), _judges())
    assert (storage.precision, storage.step) == (precision, None)


@pytest.mark.parametrize(
    ("material", "chart", "encoding"),
    [
        ("satin-paint", HALF_DIFF, Root()),
        ("copper", HALF_DIFF, Log()),
        ("grey-felt", IN_OUT, Root()),
        ("chrome", HALF_DIFF, Root()),
    ],
    ids=["satin", "copper", "felt", "chrome"],
)
def test_quantising_adds_four_percent_to_the_error(material, chart, encoding):
    """The geometric mean over both sets, over pairs other than those by which the step was chosen.

    In nets of some dozen control points each one's own rounding shows.
    """
    brdf = material_named(material).brdf
    table = tabulate(brdf, chart, chart.trial_grid)
    judges, others = (draw_samples(brdf, chart, 20_000, seed=seed) for seed in (3, 4))
    for points in (150, 1000, 4000):
        made = plan(table, encoding, LOG_COSINE, (1.0, 1.0), degrees=(3, 3, 3), placement="dominant", points=points)
        spline = made.lofted(made.walk(points)[-1])
        storage = made.storage("quantised", spline, judges)
        exact = others.errors_of(spline, encoding, LOG_COSINE)
        stored = others.errors_of(spline.with_control(storage.rounded(spline.control)), encoding, LOG_COSINE)
        added = np.sqrt(np.prod(stored / exact)) - 1
        assert added == pytest.approx(0.04, abs=0.02 if points > 150 else 0.06), points


def test_a_better_model_is_stored_in_smaller_steps():
    made = _made()
    steps = [made.storage("quantised", made.lofted(made.walk(n)[-1]), _judges()).step for n in (100, 400, 1600)]
    assert steps == sorted(steps, reverse=True)


@pytest.mark.parametrize("value", [0.0, 1e-300, 1e5])
def test_steps_stay_within_reason_whatever_the_errors(value):
    made, samples = _made(), _judges()
    spline = made.lofted((8, 8, 5))
    met = replace(samples, reflectance=Root().decode(spline.evaluate(samples.parameters)))
    off = replace(samples, reflectance=np.full_like(samples.reflectance, value))
    largest = np.abs(spline.control).max()
    for judges in (met, off):
        assert largest * 2.0**-21 < made.storage("quantised", spline, judges).step < largest / 8


@pytest.mark.parametrize("material", ["chrome", "blue-plastic"])
def test_mirror_like_materials_are_tried_best_in_half_diff(material):
    brdf = material_named(material).brdf
    trials = try_charts(brdf, [IN_OUT, HALF_DIFF], [Root()], LOG_COSINE, degrees=(3, 3, 3), points=1500)
    assert [t.chart for t in trials] == [HALF_DIFF, IN_OUT]
    assert trials[0].score < 0.5 * trials[1].score


def test_what_is_not_reciprocal_is_tried_best_in_the_chart_that_can_tell():
    class OneWay(Brdf):
        def _evaluate(self, wi, wo):
            f = 0.1 + wi[:, 2] ** 2 + 0.1 * wo[:, 2]
            return f[:, None] * np.ones(3), np.ones(len(f), bool)

    trials = try_charts(OneWay(), [HALF_DIFF, IN_OUT], [Root()], LOG_COSINE, degrees=(3, 3, 3), points=500)
    assert trials[0].chart is IN_OUT
    assert trials[0].score < 0.2 * trials[1].score


def test_trials_come_in_order_and_the_other_encodings_only_where_they_are_surely_better():
    trials = try_charts(
        Glossy(0.3), [IN_OUT, HALF_DIFF], [Root(), Log(), Linear()], LOG_COSINE, degrees=(3, 3, 3), points=800
    )
    assert len(trials) == 4
    counted = [t.score * (1 if t.encoding == Root() else 1 + UNSURE) for t in trials]
    assert counted == sorted(counted)
    by_chart = [t for t in trials if t.encoding == Root()]
    assert len(by_chart) == 2
    assert {t.chart for t in trials if t.encoding != Root()} == {by_chart[0].chart}
    for t in trials:
        assert t.score == pytest.approx(np.sqrt(t.errors[0] * t.errors[1]))
        assert max(t.balance) == 1.0
        assert min(t.balance) > 0


def test_a_trial_says_what_a_quick_fit_of_that_size_reaches():
    """A trial's score is that which a plan for the balanced problem comes to over other samples, but for a factor 2."""
    brdf = Glossy(0.25)
    (trial,) = try_charts(brdf, [HALF_DIFF], [Root()], LOG_COSINE, degrees=(3, 3, 3), points=600)
    made = plan(
        tabulate(brdf, HALF_DIFF, HALF_DIFF.trial_grid),
        Root(),
        LOG_COSINE,
        trial.balance,
        degrees=(3, 3, 3),
        placement="dominant",
        points=600,
    )
    samples = draw_samples(brdf, HALF_DIFF, 20_000, seed=9)
    found = samples.errors_of(made.lofted(made.walk(600)[-1]), Root(), LOG_COSINE)
    assert 0.5 < trial.score / np.sqrt(np.prod(found)) < 2


errors = st.floats(1e-300, 1e300)


@given(errors, errors)
def test_the_sets_are_balanced_so_that_relative_errors_count_alike(grid, nodes):
    """b_0 e_0^2 = b_1 e_1^2, the larger balance being one; up to the smallest error that is taken seriously."""
    balance = balance_of(np.array([grid, nodes]))
    assert max(balance) == pytest.approx(1.0)
    smaller, larger = min(grid, nodes), max(grid, nodes)
    ratio = max(smaller / larger, SMALLEST_ERROR)
    expected = (1.0, ratio**2) if grid <= nodes else (ratio**2, 1.0)
    np.testing.assert_allclose(balance, expected, rtol=1e-9)


def test_sets_without_an_error_are_balanced_too():
    assert balance_of(np.zeros(2)) == (1.0, 1.0)
    assert balance_of(np.array([0.0, 1.0])) == pytest.approx((1.0, SMALLEST_ERROR**2))


@pytest.mark.parametrize("name", ["even", "", "Dominant", None, 3, ["free"], np.ones((40, 40))])
def test_unknown_placements_are_refused(name):
    assert "dominant, free, piegl-tiller" in refusal(lambda: checked_placement(name))
