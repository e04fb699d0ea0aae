"""Blending materials: each space mixes what it says, exactly where nets can, and tells where it could not."""

import functools

import numpy as np
import pytest

from bvbedit import blend
from bvbedit.brdf.analytic import Lambert
from bvbedit.brdf.charts import HALF_DIFF, IN_OUT
from bvbedit.brdf.encodings import Linear, Log, Root
from bvbedit.brdf.losses import LOSSES
from bvbedit.brdf.plan import plan
from bvbedit.brdf.problem import tabulate
from bvbedit.brdf.spline_brdf import SplineBrdf, face_spread
from bvbedit.spline.knots import clamped
from bvbedit.spline.tensor import TensorSpline
from tests.brdf.samples import Glossy, random_pairs
from tests.spline.refusals import refusal

MATT = Lambert((0.6, 0.3, 0.1))
SHINY = Glossy(0.3)


@functools.cache
def _model(brdf, chart, encoding, size, knots="averaged"):
    """Return a quick fit: what is blended need not be the best model of its material."""
    table = tabulate(brdf, chart, tuple(np.linspace(0, 1, n) for n in (31, 26, 19)))
    made = plan(table, encoding, LOSSES["log_cosine_rms"], (1.0, 1.0), degrees=(3, 3, 3), placement=knots, points=1000)
    return SplineBrdf(made.lofted(size), chart, encoding)


def _two(encoding, chart=HALF_DIFF, other=None):
    return (
        _model(MATT, chart, encoding, (10, 6, 4)),
        _model(SHINY, chart, other or encoding, (12, 7, 5), "uniform"),
    )


@functools.cache
def _refitted(space, chart=HALF_DIFF):
    """Return the mixture of two models of another encoding than that of the space, half of each."""
    return blend(*_two(Root(), chart), 0.5, space)


def _mixed(a, b, t, encoding, wi, wo):
    return encoding.decode((1 - t) * encoding.encode(a.evaluate(wi, wo)) + t * encoding.encode(b.evaluate(wi, wo)))


@pytest.mark.parametrize("t", [0.25, 0.5, 0.9])
@pytest.mark.parametrize(("space", "encoding"), [("linear", Linear()), ("log", Log(1e-3))])
def test_reflectance_is_mixed_exactly_where_nets_have_that_encoding(space, encoding, t, rng):
    a, b = _two(encoding)
    wi, wo = random_pairs(rng, 500)
    mixed = blend(a, b, t, space)
    assert mixed.report["blend"]["exact"]
    expected = _mixed(a, b, t, encoding, wi, wo)
    # Encoded values below zero, where a coarse net rings, count as zero in each model but not in the mixture of nets.
    sound = np.all([m.spline.evaluate(m.chart.to_parameters(wi, wo)) >= 0 for m in (a, b)], axis=(0, 2))
    assert sound.mean() > 0.95
    np.testing.assert_allclose(mixed.evaluate(wi, wo)[sound], expected[sound], rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("space", ["linear", "log"])
def test_other_encodings_are_refitted_and_the_report_tells_how_far(space, rng):
    a, b = _two(Root())
    wi, wo = random_pairs(rng, 2000, np.radians(80))
    mixed = _refitted(space)
    assert not mixed.report["blend"]["exact"]
    assert any("refitted" in note for note in mixed.report["notes"])
    expected = _mixed(a, b, 0.5, Linear() if space == "linear" else Log(1e-3), wi, wo)
    c = (wi[:, 2] * wo[:, 2])[:, None]
    error = np.sqrt(np.mean((np.log1p(c * mixed.evaluate(wi, wo)) - np.log1p(c * expected)) ** 2))
    told = mixed.report["metrics"]["grid"]["log_cosine_rms"]
    assert 0 < told < 0.01
    assert error < 3 * told


def test_charts_that_differ_are_mixed_by_reflectance_in_the_first_ones(rng):
    a, b = _model(MATT, HALF_DIFF, Root(), (12, 6, 4)), _model(SHINY, IN_OUT, Log(), (9, 9, 12))
    mixed = blend(a, b, 0.3, "linear")
    assert mixed.chart is HALF_DIFF
    assert mixed.encoding == Root()
    assert mixed.spline.size == a.spline.size
    wi, wo = random_pairs(rng, 2000, np.radians(80))
    c = (wi[:, 2] * wo[:, 2])[:, None]
    expected = _mixed(a, b, 0.3, Linear(), wi, wo)
    assert np.sqrt(np.mean((np.log1p(c * mixed.evaluate(wi, wo)) - np.log1p(c * expected)) ** 2)) < 0.01


def test_nets_are_mixed_control_point_by_control_point(rng):
    a, b = _two(Root())
    wi, wo = random_pairs(rng, 300)
    for t in (0.25, 0.7, np.array([0.1, 0.5, 0.9])):
        expected = _mixed(a, b, t, Root(), wi, wo)
        np.testing.assert_allclose(blend(a, b, t).evaluate(wi, wo), expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("space", ["net", "linear", "log"])
def test_the_ends_are_the_two_models_themselves(space):
    a, b = _two(Root())
    for t, end in ((0, a), (1.0, b), ([1, 1, 1], b)):
        mixed = blend(a, b, t, space)
        assert mixed.spline is end.spline
        assert "metrics" not in mixed.report


def test_what_cannot_be_mixed_as_nets_is_refused_by_naming_both():
    root, log = _two(Root(), other=Log())
    message = refusal(lambda: blend(root, log, 0.5))
    assert "half-diff, root (k = 3)" in message
    assert "half-diff, log (eps = 0.001)" in message
    other = _model(SHINY, IN_OUT, Root(), (5, 5, 5))
    assert "in-out" in refusal(lambda: blend(root, other, 0.5))


def test_beyond_the_ends_mixtures_extrapolate_with_a_note(rng):
    a, b = _two(Root())
    mixed = blend(a, b, 1.4)
    assert any("outside [0, 1]" in note for note in mixed.report["notes"])
    assert (mixed.evaluate(*random_pairs(rng, 300)) >= 0).all()
    assert not any("outside" in note for note in blend(a, b, 0.4).report["notes"])


def _fading(*control: float) -> TensorSpline:
    """A share of B that falls to zero along the first parameter."""
    p = len(control) - 2
    net = np.array(control).reshape(-1, 1, 1, 1)
    return TensorSpline((p, 0, 0), (clamped([0.5], p), [0, 1], [0, 1]), net)


def test_a_share_that_differs_from_place_to_place_keeps_one_highlight_and_the_other_body(rng):
    a, b = _two(Log())
    # Wholly B at theta_h = 0, and flat there, as a model must be.
    share = _fading(1, 1, 0, 0)
    mixed = blend(a, b, share, "log")
    assert mixed.report["blend"]["exact"]
    assert mixed.spline.degrees == (5, 3, 3)
    x = rng.uniform(0, 1, (400, 3))
    t = share.evaluate(x)
    assert t.max() > 0.9
    assert t.min() < 0.1
    expected = (1 - t) * a.spline.evaluate(x) + t * b.spline.evaluate(x)
    np.testing.assert_allclose(mixed.spline.evaluate(x), expected, rtol=0, atol=1e-11)
    refitted = blend(*_two(Root()), share, "linear")
    assert refitted.report["blend"]["t"] is None
    assert refitted.report["metrics"]["grid"]["log_cosine_rms"] < 0.02


def test_a_share_that_would_leave_a_cusp_is_told():
    mixed = blend(*_two(Log()), _fading(1, 0, 0), "log")
    assert not mixed.report["blend"]["exact"]
    assert any("degenerate face" in note for note in mixed.report["notes"])
    assert face_spread(mixed.spline.control, HALF_DIFF) == 0


@pytest.mark.parametrize("chart", [HALF_DIFF, IN_OUT], ids=lambda c: c.name)
@pytest.mark.parametrize("space", ["net", "linear"])
def test_degenerate_faces_stay_constant(space, chart):
    assert face_spread(_refitted(space, chart).spline.control, chart) == 0


def test_knots_equal_up_to_rounding_are_united():
    a, b = _two(Root())
    knots = [np.where((t > 0) & (t < 1), np.nextafter(t, 1), t) for t in a.spline.knots]
    moved = b.with_spline(TensorSpline(a.spline.degrees, knots, a.spline.control * 0.5))
    mixed = blend(a, moved, 0.5)
    assert mixed.spline.size == a.spline.size
    assert any("united" in note for note in mixed.report["notes"])
    np.testing.assert_allclose(mixed.spline.control, 0.75 * a.spline.control)


def test_wrong_blends_are_refused_in_one_line():
    a, b = _two(Root())
    for call in (
        lambda: blend(a, MATT, 0.5),
        lambda: blend(None, b, 0.5),
        lambda: blend(a, b, np.nan),
        lambda: blend(a, b, [0.1, 0.2]),
        lambda: blend(a, b, "half"),
        lambda: blend(a, b, 0.5, "gamma"),
        lambda: blend(a, b, 0.5, None),
        lambda: blend(a, b, TensorSpline((1,), ([0, 0, 1, 1],), [[0.0], [1.0]])),
    ):
        refusal(call)
