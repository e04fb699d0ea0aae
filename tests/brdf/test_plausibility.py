"""Albedos against other ways to integrate; what no material does is found, and repaired with nothing left to find."""

import functools
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bvbedit.brdf import albedo as quadrature
from bvbedit.brdf.analytic import GGX, Lambert, Schlick
from bvbedit.brdf.base import Brdf
from bvbedit.brdf.charts import HALF_DIFF, IN_OUT, grid_points
from bvbedit.brdf.encodings import Linear, Log, Root
from bvbedit.brdf.fit import fit_net
from bvbedit.brdf.geometry import elevation, spherical
from bvbedit.brdf.materials import material_named
from bvbedit.brdf.plausibility import albedo, check, make_plausible
from bvbedit.brdf.repair import ELEVATIONS
from bvbedit.brdf.spline_brdf import SplineBrdf, face_spread, keep_faces
from bvbedit.spline.fitting import loft
from bvbedit.spline.knots import clamped
from bvbedit.spline.tensor import TensorSpline
from tests.brdf.samples import random_pairs
from tests.spline.refusals import refusal

CHARTS = pytest.mark.parametrize("chart", [HALF_DIFF, IN_OUT], ids=lambda c: c.name)
ENCODINGS = pytest.mark.parametrize("encoding", [Linear(), Root(), Log()], ids=lambda e: e.name)
STEEP = np.radians([0.0, 0.3, 45.0, 80.0, 89.0, 89.9])
# No multiple of the steps at which albedos are repaired, and more of them where those are finer.
FINER = np.radians(np.concatenate([np.linspace(0, 80, 211), np.linspace(80, 90, 263)]))


@functools.cache
def _material(what: str) -> Brdf:
    if what == "chrome":
        return material_named("chrome").brdf
    return GGX(0.4, Schlick((0.9, 0.8, 0.7)))


@functools.cache
def _model(what: str) -> SplineBrdf:
    match what:
        case "rough":
            return fit_net(_material("rough"), HALF_DIFF, Root(), size=(12, 9, 5), knots="uniform")
        case "rough in-out":
            return fit_net(_material("rough"), IN_OUT, Log(), size=(12, 12, 8), knots="uniform")
        case "chrome":
            return fit_net(_material("chrome"), HALF_DIFF, Root(), size=(20, 12, 4))
        case "bright":
            return _scaled(_model("rough"), 1.4)
        case "bright in-out":
            return make_plausible(_scaled(_model("rough in-out"), 1.4), energy=False)[0]
        case "bright chrome":
            return _scaled(_model("chrome"), 1.49)
    raise KeyError(what)


@functools.cache
def _repaired(what: str):
    return make_plausible(_model(what), colour=False, negative=True)


def _scaled(model: SplineBrdf, factor: float) -> SplineBrdf:
    f = model.encoding.decode(model.spline.control)
    return model.with_spline(model.spline.with_control(model.encoding.encode(factor * f)))


def _random(chart, encoding, seed: int, size=(5, 6, 4), low: float = -0.3, degrees=(3, 3, 3)) -> SplineBrdf:
    """A net of random control points, rougher than any fit, that is too bright and negative in places."""
    rng = np.random.default_rng(seed)
    knots = [clamped(np.sort(rng.uniform(0.1, 0.9, n - p - 1)), p) for n, p in zip(size, degrees, strict=True)]
    f = keep_faces(rng.uniform(low, 0.9, (*size, 3)), chart)
    return SplineBrdf(TensorSpline(degrees, knots, np.sign(f) * encoding.encode(np.abs(f))), chart, encoding)


def _brute(brdf: Brdf, theta_o: float, places=(900, 350)) -> np.ndarray:
    """Sum over polar coordinates around the mirror direction, dense close to it: nothing of a chart is used."""
    t, beta = ((np.arange(n) + 0.5) / n for n in places)
    alpha = np.repeat(np.pi * t**3, places[1])
    weight = np.repeat(3 * np.pi * t**2 / places[0], places[1]) * np.sin(alpha) * np.pi / places[1]
    local = spherical(alpha, np.tile(np.pi * beta, places[0]))
    s, c = np.sin(theta_o), np.cos(theta_o)
    # Half the circle: the other one is its mirror image.
    wi = np.stack([c * local[:, 0] - s * local[:, 2], local[:, 1], s * local[:, 0] + c * local[:, 2]], axis=1)
    kept = wi[:, 2] > 0
    wi, weight = wi[kept], 2 * weight[kept]
    f = brdf.evaluate_unit(wi, np.broadcast_to(spherical(theta_o, 0.0), wi.shape))[0]
    return (f * (wi[:, 2] * weight)[:, None]).sum(axis=0)


@pytest.mark.parametrize("what", ["rough", "chrome", "rough in-out"])
def test_the_albedo_is_that_of_brute_force(what):
    model = _model(what)
    found = albedo(model, STEEP)
    brute = np.stack([_brute(model, t) for t in STEEP])
    np.testing.assert_allclose(found.value, brute, rtol=1e-3)
    assert (found.error < 1e-3 * found.value).all()


@pytest.mark.parametrize("what", ["rough", "chrome", "rough in-out"])
def test_the_albedo_is_the_mean_weight_of_samples(what, rng):
    model = _model(what)
    for theta in np.radians([10.0, 75.0, 88.0]):
        wo = np.broadcast_to(spherical(theta, 0.0), (1 << 14, 3))
        _, _, weight = model.sample(wo, rng.uniform(size=(1 << 14, 2)))
        spread = weight.std(axis=0) / np.sqrt(len(weight))
        assert (np.abs(weight.mean(axis=0) - model.albedo(theta)) < 4.5 * spread + 1e-4).all()


@pytest.mark.parametrize("what", ["rough", "chrome", "rough in-out"])
def test_the_error_that_is_told_holds(what):
    theta = np.radians(np.linspace(0, 90, 37))
    found = albedo(_model(what), theta)
    exact = quadrature.albedo_value(_model(what), theta, (16, 30))
    assert (np.abs(found.value - exact) <= found.error).all()
    assert (np.abs(found.value - exact) < 3e-4 * exact).all()
    assert (found.error < 1e-3 * found.value).all()


@CHARTS
@ENCODINGS
def test_a_rough_net_is_integrated_within_a_few_of_the_errors_told(chart, encoding):
    theta = np.radians(np.linspace(0, 90, 19))
    for seed, degrees in enumerate([(3, 3, 3), (2, 3, 1), (3, 2, 2)]):
        model = _random(chart, encoding, seed, degrees=degrees)
        found = albedo(model, theta)
        exact = quadrature.albedo_value(model, theta, (16, 30))
        assert (np.abs(found.value - exact) <= 5 * found.error).all()
        assert (found.error < 0.15 * found.value.max()).all()


@CHARTS
@ENCODINGS
def test_a_constant_reflects_its_share_at_every_elevation(chart, encoding):
    rho = np.array([0.5, 0.2, 1.0])
    net = np.broadcast_to(encoding.encode(rho / np.pi), (4, 4, 4, 3))
    grey = SplineBrdf(TensorSpline((3, 3, 3), [clamped([], 3)] * 3, net), chart, encoding)
    found = albedo(grey, np.linspace(0, np.pi / 2, 31))
    np.testing.assert_allclose(found.value, np.broadcast_to(rho, (31, 3)), rtol=3e-4)
    assert (np.abs(found.value - rho) <= found.error).all()
    fine = quadrature.albedo_value(grey, np.linspace(0, np.pi / 2, 31), (24, 24))
    np.testing.assert_allclose(fine, np.broadcast_to(rho, (31, 3)), rtol=2e-6)
    assert make_plausible(grey, negative=True)[0] is grey


@CHARTS
def test_a_fitted_lambert_keeps_its_albedo(chart):
    axes = (np.linspace(0, 1, 21),) * 3
    f = Lambert(0.5).evaluate(*chart.to_directions(grid_points(axes))).reshape(21, 21, 21, 3)
    spline = loft(np.cbrt(f), axes, [clamped([0.3, 0.7], 3)] * 3, (3, 3, 3)).spline
    model = SplineBrdf(spline, chart, Root())
    np.testing.assert_allclose(model.albedo(np.linspace(0, np.pi / 2, 19)), 0.5, rtol=3e-4)


def test_a_fitted_metal_has_the_albedo_of_the_metal():
    theta = np.radians([0.0, 30.0, 60.0, 80.0])
    brute = np.stack([_brute(_material("rough"), t) for t in theta])
    np.testing.assert_allclose(_model("rough").albedo(theta), brute, rtol=0.01)
    brute = np.stack([_brute(_material("chrome"), t) for t in theta])
    np.testing.assert_allclose(_model("chrome").albedo(theta), brute, rtol=0.03)


def test_albedos_come_in_the_shape_of_the_elevations():
    model = _model("rough")
    assert model.albedo(0.3).shape == (3,)
    assert model.albedo(np.zeros((2, 4))).shape == (2, 4, 3)
    assert model.albedo([]).shape == (0, 3)
    np.testing.assert_array_equal(model.albedo([[0.3]])[0, 0], albedo(model, 0.3).value)
    # The limit at the horizon.
    np.testing.assert_allclose(model.albedo(np.pi / 2), model.albedo(np.pi / 2 - 1e-5), rtol=1e-3)


def test_what_is_no_model_or_no_elevation_is_refused():
    grey = Lambert(0.5)
    for call in (check, make_plausible, lambda m: albedo(m, 0.1)):
        assert "no B-spline model" in refusal(lambda call=call: call(grey))
    for theta in (-0.1, 1.6, np.nan, [0.1, np.inf]):
        assert "Elevations" in refusal(lambda theta=theta: _model("rough").albedo(theta))
    net = np.full((2, 2, 2, 3), 1e308)
    blinding = SplineBrdf(TensorSpline((1, 1, 1), [[0, 0, 1, 1]] * 3, net), IN_OUT, Linear())
    assert "float64" in refusal(lambda: make_plausible(blinding, negative=True))


def test_a_check_tells_where_energy_is_created():
    found = check(_model("bright"))
    theta = np.degrees(ELEVATIONS)
    a = albedo(_model("bright"), ELEVATIONS)
    created = (a.value > 1 + a.error).any(axis=1)
    assert created.any()
    inside = np.zeros(len(theta), dtype=bool)
    for low, high in found.creates_energy:
        inside |= (theta >= low) & (theta <= high)
    np.testing.assert_array_equal(inside, created)
    np.testing.assert_array_equal(found.largest_albedo, a.value.max(axis=0))
    assert not found.plausible
    assert "energy is created from" in found.text()
    assert found.text().endswith("; nowhere negative; reciprocal")
    assert json.loads(json.dumps(found.to_dict())) == found.to_dict()
    assert check(_model("rough")).plausible


@pytest.mark.parametrize("what", ["bright", "bright in-out", "bright chrome"])
def test_repaired_materials_create_no_energy_anywhere(what):
    model = _model(what)
    before = quadrature.albedo_value(model, FINER)
    assert before.max() > 1
    control = model.spline.control.copy()
    repaired, told = _repaired(what)
    np.testing.assert_array_equal(model.spline.control, control)
    after = quadrature.albedo_value(repaired, FINER)
    assert after.max() <= 1
    assert after.max() > 0.99
    assert (np.array(told.albedo_after) <= 1).all()
    assert told.largest_change > 0
    assert "factors down to" in told.text()
    assert json.loads(json.dumps(told.to_dict())) == told.to_dict()
    assert face_spread(repaired.spline.control, model.chart) <= 1e-14 * control.max()
    # No more than m(theta_i) m(theta_o) is lost, and nothing gained.
    m = np.array(told.factors)
    assert (after <= before * (1 + 1e-9)).all()
    assert (after >= before * m.min(axis=0) ** 2 * (1 - 1e-6)).all()
    again, nothing = make_plausible(repaired, negative=True)
    assert again is repaired
    assert nothing.text() == "nothing to repair"


def test_control_points_stay_where_nothing_must_change():
    model = _model("bright")
    repaired, told = _repaired("bright")
    assert told.raised == 0
    nodes, m = np.radians(told.elevations), np.array(told.factors)
    pairs = model.chart.to_directions(grid_points(model.spline.greville))
    on = [np.stack([np.interp(elevation(w), nodes, m[:, c]) for c in range(3)], axis=1) for w in pairs]
    kept = (on[0] * on[1] == 1).reshape(model.spline.control.shape)
    # Degenerate faces are means of what their directions ask for.
    kept[:, :1] = kept[:2] = False
    assert kept.mean() > 0.2
    np.testing.assert_array_equal(repaired.spline.control[kept], model.spline.control[kept])
    # Energy is created beyond 70 degrees; far below, only what comes from there is dimmed.
    low = np.radians(np.linspace(0, 45, 10))
    np.testing.assert_allclose(repaired.albedo(low), model.albedo(low), rtol=0.02)


def test_a_mirror_is_repaired_near_grazing_alone():
    model = _model("bright chrome")
    repaired, told = _repaired("bright chrome")
    created = check(model).creates_energy
    assert created[0][0] > 60
    low = np.radians(np.linspace(0, 50, 11))
    np.testing.assert_allclose(repaired.albedo(low), model.albedo(low), rtol=5e-3)
    assert min(min(row) for row in told.factors) > 0.9


def test_energy_alone_keeps_what_was_not_asked_for():
    model = _random(IN_OUT, Linear(), 5, low=-0.1)
    model = model.with_spline(model.spline.with_control(model.spline.control + np.array([0, 0, 0.3])))
    same, told = make_plausible(model, energy=False, negative=False, reciprocity=False)
    assert same is model
    assert told.text() == "nothing to repair"
    dim, told = make_plausible(model, negative=False, reciprocity=False)
    assert not told.averaged
    assert told.raised == 0
    assert not check(dim).creates_energy


def test_exchanging_light_and_viewer_changes_nothing_after_the_repair(rng):
    model = _random(IN_OUT, Root(), 7, size=(6, 5, 4), low=0.1)
    found = check(model)
    assert not found.reciprocal
    assert found.reciprocity_largest > found.reciprocity_mean > 0.01
    assert "not reciprocal" in found.text()
    repaired, told = make_plausible(model, energy=False, negative=False)
    assert told.averaged
    assert told.largest_change > 0
    wi, wo = random_pairs(rng, 500)
    np.testing.assert_allclose(repaired.evaluate(wi, wo), repaired.evaluate(wo, wi), rtol=1e-11)
    # In the encoding it is the mean of both ways.
    y, z = (model.encoding.encode(model.evaluate(*pair)) for pair in ((wi, wo), (wo, wi)))
    np.testing.assert_allclose(model.encoding.encode(repaired.evaluate(wi, wo)), 0.5 * (y + z), rtol=1e-11)
    assert check(repaired).reciprocal
    assert check(repaired).reciprocity_largest == 0


@CHARTS
def test_negative_values_go_and_others_stay(chart):
    knots = [clamped([0.2, 0.4, 0.6, 0.8], 3)] * 3
    net = np.full((8, 8, 8, 3), 0.3)
    # A value below zero, and a control point that is, though no value near it.
    net[5, 4, 5, 1], net[2, 2, 2, 0] = -1.5, -0.05
    net[4, 5, 5, 1] = -1.5
    model = SplineBrdf(TensorSpline((3, 3, 3), knots, keep_faces(net, chart)), chart, Linear())
    found = check(model)
    assert found.negative
    assert found.least_control <= found.lowest < 0
    place = [found.lowest_at[name] for name in chart.axes]
    assert len(place) == 3
    assert "black where the spline is negative, down to" in found.text()
    repaired, told = make_plausible(model, energy=False, negative=True)
    assert told.raised == 2
    assert told.raised_most <= 1.5
    moved = repaired.spline.control != model.spline.control
    assert set(map(tuple, np.argwhere(moved))) == {(5, 4, 5, 1), (4, 5, 5, 1)}
    u = np.linspace(0, 1, 61)
    assert repaired.spline.evaluate_grid((u, u, u)).min() >= -1e-12
    # Not all the way to zero: their neighbours carry them.
    assert repaired.spline.control[5, 4, 5, 1] < -0.01
    assert not check(repaired).negative
    assert make_plausible(repaired, negative=True)[0] is repaired


def test_a_net_below_zero_everywhere_becomes_black():
    net = np.full((4, 4, 4, 3), -1.0)
    model = SplineBrdf(TensorSpline((3, 3, 3), [clamped([], 3)] * 3, net), HALF_DIFF, Log())
    repaired, told = make_plausible(model, negative=True)
    assert (repaired.spline.control == 0).all()
    assert told.largest_change == 1
    assert check(repaired).plausible
    assert "nowhere negative" in check(repaired).text()


@CHARTS
@ENCODINGS
@settings(max_examples=2)
@given(seed=st.integers(0, 1 << 30))
def test_after_a_repair_there_is_nothing_to_complain_about(chart, encoding, seed):
    model = _random(chart, encoding, seed)
    control = model.spline.control.copy()
    repaired, told = make_plausible(model, negative=True)
    np.testing.assert_array_equal(model.spline.control, control)
    found = check(repaired)
    assert found.plausible, found.text()
    assert (np.array(told.albedo_after) <= np.maximum(1, told.albedo_before)).all()
    again, nothing = make_plausible(repaired, negative=True)
    assert again is repaired
    assert nothing.largest_change == 0


def test_the_colour_stays_unless_channels_are_dimmed_apart():
    coloured = _scaled(_model("rough"), 1.3)
    red = coloured.with_spline(coloured.spline.with_control(coloured.spline.control * [1.3, 1.0, 0.8]))
    whole, apart = (make_plausible(red, colour=colour)[0] for colour in (True, False))
    assert check(whole).plausible
    assert check(apart).plausible
    ratio = whole.spline.control / np.where(red.spline.control == 0, 1.0, red.spline.control)
    assert np.ptp(ratio, axis=-1).max() < 1e-9
    factors = apart.spline.control / np.where(red.spline.control == 0, 1.0, red.spline.control)
    assert np.ptp(factors, axis=-1).max() > 0.05
