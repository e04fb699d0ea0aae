"""Each edit does what it promises, and nothing beside that."""

import functools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import bvbedit
from bvbedit.brdf.analytic import GGX, Lambert, Schlick, Sum
from bvbedit.brdf.blend import blend
from bvbedit.brdf.charts import HALF_DIFF, IN_OUT, grid_points
from bvbedit.brdf.encodings import Linear, Log, Root
from bvbedit.brdf.geometry import spherical
from bvbedit.brdf.measured import MeasuredBrdf
from bvbedit.brdf.plausibility import albedo, check, make_plausible
from bvbedit.brdf.spline_brdf import keep_faces
from bvbedit.brdf.storage import Storage
from bvbedit.edit.appearance import ELEVATIONS, Broaden, Denoise, Gain, RaiseGrazing, Sharpen, Tint, colour_matrix
from bvbedit.edit.combining import Blend, MakePlausible, MovePoints
from bvbedit.edit.parts import body_of
from bvbedit.edit.resampling import distance
from bvbedit.edit.structural import Elevate, InsertKnots, Reduce, Refine, RemoveKnots, Store
from bvbedit.spline.smoothing import second_differences
from tests.brdf.samples import random_pairs
from tests.edit.samples import CHARTS, ENCODINGS, lofted, quick_edits, smooth, spread
from tests.spline.refusals import refusal

BOTH = pytest.mark.parametrize("chart", CHARTS, ids=lambda c: c.name)
EACH = pytest.mark.parametrize("encoding", ENCODINGS, ids=lambda e: e.name)
HOMOGENEOUS = pytest.mark.parametrize("encoding", [Linear(), Root()], ids=lambda e: e.name)


# Of linear sRGB.
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def pairs(count=400, highest=85.0):
    return random_pairs(np.random.default_rng(7), count, np.radians(highest))


def mean_albedo(model):
    return albedo(model, ELEVATIONS).value.mean(axis=0)


# ------------------------------------------------------------------------------------------------- gain and tint


@BOTH
@HOMOGENEOUS
@pytest.mark.parametrize("factor", [0.0, 0.3, 1.0, 7.5, 1e6])
def test_gain_multiplies_the_reflectance(chart, encoding, factor):
    model, (wi, wo) = smooth(chart, encoding), pairs()
    brighter = Gain(factor=factor).apply(model)
    np.testing.assert_allclose(brighter.evaluate(wi, wo), factor * model.evaluate(wi, wo), rtol=1e-12)
    assert spread(brighter) == 0


@BOTH
@pytest.mark.parametrize("factor", [0.0, 0.3, 2.0, 40.0])
def test_gain_of_a_log_net_is_as_close_as_it_tells(chart, factor):
    model, (wi, wo) = smooth(chart, Log(), (12, 9, 6)), pairs()
    brighter = Gain(factor=factor).apply(model)
    points = np.random.default_rng(1).random((3000, 3))
    c = np.prod([w[:, 2:] for w in chart.to_directions(points)], axis=0)
    ours, wanted = (
        brighter.encoding.decode(brighter.spline.evaluate(points)),
        factor * model.encoding.decode(model.spline.evaluate(points)),
    )
    told = brighter.report["refit_error"]
    assert np.sqrt(np.mean((np.log1p(c * ours) - np.log1p(c * wanted)) ** 2)) <= 1.2 * told + 1e-15
    if factor == 0:
        assert brighter.evaluate(wi, wo).max() < 1e-15
    else:
        off = np.abs(brighter.evaluate(wi, wo) / (factor * model.evaluate(wi, wo)) - 1)
        assert off.mean() < 1e-3
        assert off.max() < 0.02
    assert spread(brighter) == 0


@BOTH
@HOMOGENEOUS
def test_tint_multiplies_each_channel(chart, encoding):
    model, (wi, wo) = smooth(chart, encoding), pairs()
    warm = Tint(rgb=(1.0, 0.7, 0.2)).apply(model)
    np.testing.assert_allclose(warm.evaluate(wi, wo), model.evaluate(wi, wo) * (1, 0.7, 0.2), rtol=1e-12)


@EACH
def test_edits_by_constant_factors_commute(encoding):
    model = smooth(HALF_DIFF, encoding)
    a, b = Gain(factor=1.7), Gain(factor=0.6)
    one, other = b.apply(a.apply(model)), a.apply(b.apply(model))
    # A log net is projected twice.
    limit = 1e-12 if encoding.homogeneous else 1e-3
    np.testing.assert_allclose(one.spline.control, other.spline.control, rtol=limit, atol=limit)


@BOTH
@HOMOGENEOUS
def test_gain_and_tint_of_disjoint_regions_commute(chart, encoding):
    model = smooth(chart, encoding)
    a, b = Gain(factor=3, theta_h=(0, 15), falloff=5), Tint(rgb=(0.5, 1, 2), theta_h=(40, 90), falloff=5)
    one, other = b.apply(a.apply(model)), a.apply(b.apply(model))
    assert np.abs(one.spline.control - model.spline.control).max() > 0.01
    np.testing.assert_allclose(one.spline.control, other.spline.control, rtol=1e-13)


@given(st.floats(-180, 180), st.floats(0, 1.5))
@settings(max_examples=25)
def test_hue_and_saturation_keep_luminance_where_the_gamut_allows(hue, saturation):
    model, (wi, wo) = smooth(HALF_DIFF, Linear()), pairs(200, 75)
    if hue == 0 and saturation == 1:
        return
    turned = Tint(hue=hue, saturation=saturation).apply(model)
    before, after = (m.evaluate(wi, wo) @ LUMINANCE for m in (model, turned))
    np.testing.assert_allclose(after, before, rtol=0.01)
    assert spread(turned) == 0


@EACH
def test_turning_the_hue_keeps_grey(encoding):
    model, (wi, wo) = Tint(saturation=0.0).apply(smooth(HALF_DIFF, encoding)), pairs()
    turned = Tint(hue=77.0).apply(model)
    np.testing.assert_allclose(turned.evaluate(wi, wo), model.evaluate(wi, wo), rtol=1e-9)


@BOTH
@EACH
def test_without_saturation_all_is_grey(chart, encoding):
    model, (wi, wo) = smooth(chart, encoding), pairs()
    grey = Tint(saturation=0.0).apply(model).evaluate(wi, wo)
    np.testing.assert_allclose(grey, grey[:, :1] * np.ones(3), rtol=1e-9)
    np.testing.assert_allclose(grey[:, 0], model.evaluate(wi, wo) @ LUMINANCE, rtol=0.02)


def test_a_full_turn_of_the_hue_in_three_steps_comes_back():
    model, (wi, wo) = smooth(HALF_DIFF, Linear()), pairs()
    # Little colour, so that no step leaves the gamut.
    pale = Tint(saturation=0.3).apply(model)
    turned = pale
    for _ in range(3):
        turned = Tint(hue=120.0).apply(turned)
    assert np.abs(Tint(hue=120.0).apply(pale).evaluate(wi, wo) - pale.evaluate(wi, wo)).max() > 0.01
    np.testing.assert_allclose(turned.evaluate(wi, wo), pale.evaluate(wi, wo), rtol=1e-6)


# ------------------------------------------------------------------------------------------------- regions

REGION = {"theta_h": (0.0, 12.0), "falloff": 6.0}
REGIONAL = {
    "gain": Gain(factor=3, **REGION),
    "tint": Tint(rgb=(0.3, 1, 2), **REGION),
    "denoise": Denoise(strength=10, **REGION),
}
# These change values, not control points: what they change is read off in a span of each control point's support.
RESAMPLED = {
    "hue": Tint(hue=60, **REGION),
    "saturation": Tint(saturation=0.0, **REGION),
    "highlight": Gain(factor=2, part="highlight", **REGION),
    "body": Tint(rgb=(1, 0.5, 1), part="body", **REGION),
}


def supports_of(spline, chosen):
    """Whether each of (n, 3) points lies in the support of a ``chosen`` (n_0, n_1, n_2) control point."""

    def holds(points):
        inside = np.zeros(len(points), dtype=bool)
        for index in np.argwhere(chosen):
            ends = [(t[i], t[i + p + 1]) for t, i, p in zip(spline.knots, index, spline.degrees, strict=True)]
            inside |= np.all([(a <= x) & (x <= b) for x, (a, b) in zip(points.T, ends, strict=True)], axis=0)
        return inside

    return holds


def regional_model(chart, encoding):
    """Finer in the first two axes, and with a colour outside of what turned hues may have."""
    model = smooth(chart, encoding, (12, 9, 5))
    return Tint(rgb=(1, 0.3, 1e-4)).apply(model) if encoding.homogeneous else model


@BOTH
@EACH
@pytest.mark.parametrize("edit", REGIONAL.values(), ids=REGIONAL)
def test_a_regional_edit_moves_no_control_points_of_weight_zero(chart, encoding, edit):
    model = regional_model(chart, encoding)
    weights = edit.net_weights(model)
    edited = edit.apply(model)
    net, before = edited.spline.control, model.spline.control
    untouched = weights == 0
    assert 0.1 < untouched.mean() < 0.98
    assert np.array_equal(net[untouched], before[untouched])
    assert np.abs(net - before).max() > 0.01
    # The spline is the same outside the union of the supports of the control points that have weight.
    points = np.random.default_rng(2).random((4000, 3))
    outside = ~supports_of(model.spline, weights > 0)(points)
    assert outside.any()
    change = np.abs(edited.spline.evaluate(points[outside]) - model.spline.evaluate(points[outside]))
    assert change.max() <= 1e-12 * np.abs(before).max()
    assert spread(edited) <= 1e-15


@BOTH
@EACH
@pytest.mark.parametrize("edit", RESAMPLED.values(), ids=RESAMPLED)
def test_a_regional_edit_of_values_ends_with_the_supports_that_meet_the_region(chart, encoding, edit):
    model = regional_model(chart, encoding)
    edited = edit.apply(model)
    # Whether the region meets a span, by many places in it; then the four control points that live there may move.
    knots = [np.unique(t) for t in model.spline.knots]
    met = np.zeros(model.spline.size, dtype=bool)
    inside = np.linspace(0, 1, 9)
    for cell in np.ndindex(*[len(t) - 1 for t in knots]):
        axes = [t[i] + (t[i + 1] - t[i]) * inside for t, i in zip(knots, cell, strict=True)]
        if edit.weights(chart, grid_points(tuple(axes))).any():
            met[tuple(slice(i, i + 4) for i in cell)] = True
    for face in chart.degenerate_faces:
        layers = np.moveaxis(met, face.axis, 0)[: face.layers]
        layers |= layers.any(axis=(0, face.along + (face.along < face.axis)), keepdims=True)
    net, before = edited.spline.control, model.spline.control
    assert (~met).any()
    np.testing.assert_allclose(net[~met], before[~met], rtol=0, atol=1e-12 * np.abs(before).max())
    assert np.abs(net - before).max() > 1e-3
    assert spread(edited) <= 1e-15


@BOTH
@EACH
def test_far_from_degenerate_faces_nothing_but_the_means_on_these_is_rounded(chart, encoding):
    model, edit = regional_model(chart, encoding), Tint(rgb=(0.5, 2, 1), theta_i=(60, 90), falloff=5)
    untouched = edit.net_weights(model) == 0
    net, before = edit.apply(model).spline.control, model.spline.control
    np.testing.assert_allclose(net[untouched], before[untouched], rtol=1e-15)
    untouched[:2], untouched[:, :1] = False, False
    assert untouched.any()
    assert np.array_equal(net[untouched], before[untouched])


def test_inside_the_region_the_whole_edit_is_made():
    model = smooth(IN_OUT, Root(), (16, 16, 5))
    edited = Gain(factor=2, theta_i=(20, 70), theta_o=(20, 70), falloff=5).apply(model)
    wi, wo = spherical(np.radians([45, 50]), 0.0), spherical(np.radians([44, 45]), np.array([0.3, 2.0]))
    np.testing.assert_allclose(edited.evaluate(wi, wo), 2 * model.evaluate(wi, wo), rtol=1e-12)


# ------------------------------------------------------------------------------------------------- the lobe

ALPHA = 0.08


@functools.cache
def ggx(chart):
    """GGX fitted at a small budget, on few nodes of the chart to be quick."""
    grid = (31, 13, 5) if chart is HALF_DIFF else (46, 46, 25)
    axes = tuple(np.linspace(0, 1, n) for n in grid)
    brdf, (wi, wo) = GGX(ALPHA, Schlick(0.5)), chart.to_directions(grid_points(axes))
    valid = np.minimum(wi[:, 2], wo[:, 2]) > 1e-6
    values = np.zeros((len(wi), 3))
    values[valid] = brdf.evaluate(wi[valid], wo[valid])
    table = MeasuredBrdf(values.reshape(*grid, 3), valid.reshape(grid), axes, chart)
    size = (14, 6, 4) if chart is HALF_DIFF else (20, 20, 12)
    return bvbedit.fit(table, chart=chart.name, encoding="root", size=size, precision="float64")


def half_width(brdf):
    """theta_h, in degrees, at which a lobe has half its peak, at difference angle zero."""
    theta = np.radians(np.linspace(0, 40, 8001))
    w = spherical(theta, 0.0)
    f = brdf.evaluate(w, w)[:, 1]
    return np.degrees(np.interp(-f[0] / 2, -f, theta))


@BOTH
@pytest.mark.parametrize("factor", [0.7, 1.5, 2.0])
def test_broaden_makes_the_lobe_of_a_rougher_surface(chart, factor):
    model = ggx(chart)
    assert half_width(model) == pytest.approx(half_width(GGX(ALPHA, Schlick(0.5))), rel=0.02)
    edited = Broaden(factor=factor).apply(model)
    assert half_width(edited) == pytest.approx(half_width(GGX(factor * ALPHA, Schlick(0.5))), rel=0.05)
    np.testing.assert_allclose(mean_albedo(edited), mean_albedo(model), rtol=0.01)
    assert spread(edited) <= 1e-15


def test_in_half_angles_the_knots_move_along_with_the_lobe():
    model = ggx(HALF_DIFF)
    edited = Broaden(factor=2.0, keep_energy=False).apply(model)
    old, new = (np.tan(np.pi / 2 * m.spline.knots[0][4:-4] ** 2) for m in (model, edited))
    np.testing.assert_allclose(new, 2 * old, rtol=1e-12)
    assert edited.report["refit_error"] < 1e-3


@pytest.mark.parametrize("factor", [0.05, 1.0, 20.0])
def test_broaden_keeps_the_domain_whatever_the_factor(factor):
    edited = Broaden(factor=factor, keep_energy=False).apply(smooth())
    assert edited.spline.domain == ((0, 1),) * 3
    assert np.isfinite(edited.spline.control).all()


@BOTH
def test_sharpen_undoes_broaden_within_the_refit_errors(chart):
    model = ggx(chart)
    broad = Broaden(factor=1.6, keep_energy=False).apply(model)
    again = Sharpen(factor=1.6, keep_energy=False).apply(broad)
    missed = distance(again, model.spline.evaluate_inside)
    # What the first one missed, the second makes narrower and so counts twice at most.
    assert missed <= 2 * broad.report["refit_error"] + again.report["refit_error"] + 1e-12
    np.testing.assert_allclose(
        Sharpen(factor=1.6).apply(broad).spline.control, Broaden(factor=1 / 1.6).apply(broad).spline.control
    )


# ------------------------------------------------------------------------------------------------- parts


BODY = Lambert((0.3, 0.2, 0.1))


@functools.cache
def plastic(chart):
    size = (16, 8, 4) if chart is HALF_DIFF else (18, 18, 14)
    return lofted(Sum([BODY, GGX(0.1, Schlick(0.04))], [1.0, 1.0]), chart, Root(), size)


@BOTH
def test_the_body_of_a_lambertian_under_a_gloss_is_the_lambertian(chart):
    model, (wi, wo) = plastic(chart), pairs(1000, 60)
    body = body_of(model)(chart.to_parameters(wi, wo))
    wanted = BODY.evaluate(wi, wo)
    # The tail of GGX does not end: at 75 degrees a little of it is still there, and the fit of in-out rings.
    assert np.abs(body / wanted - 1).mean() < (0.01 if chart is HALF_DIFF else 0.05)


@BOTH
def test_without_its_highlight_about_the_lambertian_is_left(chart):
    model, (wi, wo) = plastic(chart), pairs(1000, 60)
    matt = Gain(factor=0, part="highlight").apply(model)
    left, wanted = matt.evaluate(wi, wo), BODY.evaluate(wi, wo)
    assert np.abs(model.evaluate(wi, wo) / wanted - 1).mean() > 0.1
    assert np.abs(left / wanted - 1).mean() < 0.06
    assert matt.report["refit_error"] < 0.02
    assert spread(matt) <= 1e-15


@BOTH
def test_the_body_is_the_least_over_half_angles(chart):
    model = noisy(chart)
    points = np.array([[0.0, 5 / 45, 3 / 9], [0.0, 20 / 45, 0.0], [0.0, 40 / 45, 1.0]])
    halves = np.repeat(points[:, None], 76, axis=1)
    halves[..., 0] = np.sqrt(np.arange(76) / 90)
    flat = halves.reshape(-1, 3)
    flat = flat if chart is HALF_DIFF else chart.to_parameters(*HALF_DIFF.to_directions(flat))
    f = model.encoding.decode(model.spline.evaluate(flat)).reshape(3, 76, 3)
    halves[:, 0, 0] = 0.3
    ours = halves[:, 0] if chart is HALF_DIFF else chart.to_parameters(*HALF_DIFF.to_directions(halves[:, 0]))
    np.testing.assert_allclose(body_of(model)(ours), f.min(axis=1), rtol=1e-9)


def test_a_broader_highlight_stands_on_the_same_body():
    model = plastic(HALF_DIFF)
    edited = Broaden(factor=2, part="highlight", keep_energy=False).apply(model)
    theta = np.radians(np.linspace(0, 40, 50))
    w, narrow = (spherical(t, 0.0) for t in (theta, np.arctan(np.tan(theta) / 2)))
    body = BODY.evaluate(w, w)
    np.testing.assert_allclose(edited.evaluate(w, w), body + (model.evaluate(narrow, narrow) - body), rtol=0.02)
    high = random_pairs(np.random.default_rng(1), 300, np.radians(60))
    np.testing.assert_allclose(
        body_of(edited)(HALF_DIFF.to_parameters(*high)), body_of(model)(HALF_DIFF.to_parameters(*high)), rtol=0.05
    )


def test_what_is_below_zero_stays_below():
    model = smooth(HALF_DIFF, Linear())
    below = model.with_spline(model.spline.with_control(model.spline.control - 0.4))
    edited = Tint(hue=30.0).apply(below)
    x = np.random.default_rng(1).random((3000, 3))
    before, after = below.spline.evaluate(x), edited.spline.evaluate(x)
    black = (before < -0.1).all(axis=1)
    assert black.mean() > 0.1
    assert (after[black] < 0).all()
    # The kink at zero is met as well as the net can.
    assert np.median(np.abs(after - before)[black]) < 0.02


def test_body_and_highlight_make_up_the_whole():
    model, (wi, wo) = plastic(HALF_DIFF), pairs(1000, 70)
    both = Gain(factor=2, part="body").apply(Gain(factor=2, part="highlight").apply(model))
    np.testing.assert_allclose(both.evaluate(wi, wo), 2 * model.evaluate(wi, wo), rtol=0.05)


# ------------------------------------------------------------------------------------------------- grazing, noise


@BOTH
@pytest.mark.parametrize(("amount", "power"), [(1.0, 5.0), (-1.0, 2.0), (4.0, 5.0)])
def test_raise_grazing_follows_schlick_the_better_the_finer_the_net(chart, amount, power):
    wi, wo = pairs(500, 75)
    cos_d = np.linalg.norm(wi + wo, axis=1) / 2
    model, missed = smooth(chart, Linear(), (9, 9, 6)), []
    wanted = model.evaluate(wi, wo) * (1 + amount * (1 - cos_d) ** power)[:, None]
    for _ in range(2):
        edited = RaiseGrazing(amount=amount, power=power).apply(model)
        missed.append(np.abs(edited.evaluate(wi, wo) / wanted - 1).mean())
        assert spread(edited) <= 1e-15
        for axis in range(3):
            model = Refine(axis=axis).apply(model)
    # Factors at the Greville abscissae: of second order.
    assert missed[0] < 0.03
    assert missed[1] < missed[0] / 3


def test_raise_grazing_doubles_at_ninety_degrees_and_leaves_normal_difference_angles():
    model = smooth(HALF_DIFF, Root())
    edited = RaiseGrazing(amount=1.0).apply(model)
    # The second layer of control points, equal to the first at theta_h = 0, stands at another difference angle.
    for point, factor, error in (([0.0, 1.0, 0.4], 2.0, 0.01), ([0.3, 0.0, 0.4], 1.0, 1e-12)):
        f, g = (m.encoding.decode(m.spline.evaluate(point)) for m in (model, edited))
        np.testing.assert_allclose(g, factor * f, rtol=error)


def curvature(model, axis):
    spline = model.spline
    return np.linalg.norm(np.tensordot(second_differences(spline.knots[axis], 3), spline.control, (1, axis)))


@functools.cache
def noisy(chart, *, faces=True):
    model = smooth(chart, Root())
    net = model.spline.control + np.random.default_rng(4).normal(scale=0.03, size=model.spline.control.shape)
    return model.with_spline(model.spline.with_control(keep_faces(net, chart) if faces else net))


@BOTH
@pytest.mark.parametrize("faces", [True, False])
def test_denoise_of_strength_zero_changes_nothing(chart, faces):
    # Without constant faces, as the paper's plain fit.
    model = noisy(chart, faces=faces)
    same = Denoise(strength=0.0).apply(model)
    np.testing.assert_allclose(same.spline.control, model.spline.control, rtol=0, atol=1e-10)


@BOTH
def test_denoise_lowers_the_curvature_and_keeps_degenerate_faces(chart):
    models = [Denoise(strength=s).apply(noisy(chart)) for s in (0.0, 0.01, 1.0, 100.0)]
    for axis in range(3):
        bent = [curvature(m, axis) for m in models]
        assert bent[0] > bent[1] > bent[2] > bent[3]
        assert bent[3] < 0.25 * bent[0]
    assert all(spread(m) <= 1e-15 for m in models)


# ------------------------------------------------------------------------------------------------- targets, partners


@BOTH
@EACH
def test_move_points_hits_its_targets(chart, encoding):
    model = smooth(chart, encoding)
    places = ((10.0, 20.0, 30.0), (60.0, 50.0, 170.0), (5.0, 45.0, 90.0))
    wanted = np.array([[0.4, 0.2, 0.1], [0.1, 0.1, 0.1], [0.02, 0.5, 0.3]])
    edited = MovePoints(at=places, rgb=tuple(map(tuple, wanted))).apply(model)
    theta_i, theta_o, phi = np.radians(places).T
    f = edited.evaluate(spherical(theta_i, 0.0), spherical(theta_o, phi))
    np.testing.assert_allclose(f, wanted, rtol=1e-8)
    assert spread(edited) <= 1e-14


def test_move_points_at_the_pole_moves_the_whole_face():
    edited = MovePoints(at=(0, 0, 0), rgb=(0.7, 0.6, 0.5)).apply(smooth())
    n = np.array([[0.0, 0, 1]])
    np.testing.assert_allclose(edited.evaluate(n, n), [[0.7, 0.6, 0.5]], rtol=1e-8)
    assert spread(edited) <= 1e-14


@pytest.fixture
def partner(tmp_path):
    path = tmp_path / "partner.bvb"
    bvbedit.save(Tint(rgb=(0.2, 1, 3)).apply(smooth()), path, precision="float64")
    return path


@pytest.mark.parametrize("t", [0.0, 0.3, 1.0, (0.1, 0.5, 0.9)])
def test_blend_is_that_of_brdfs(t, partner):
    mixed = Blend(partner=partner, t=t).apply(smooth())
    assert np.array_equal(mixed.spline.control, blend(smooth(), bvbedit.load(partner), t).spline.control)


def test_a_regional_blend_is_the_partner_inside_and_the_model_outside(tmp_path):
    model, path = smooth(size=(12, 9, 5)), tmp_path / "partner.bvb"
    other = Tint(rgb=(0.2, 1, 3)).apply(model)
    bvbedit.save(other, path, precision="float64")
    edit = Blend(partner=path, t=1.0, theta_h=(0, 20), falloff=3)
    mixed = edit.apply(model)
    points = np.random.default_rng(2).random((4000, 3))
    # A change of values reaches as far as the supports of control points that are read off a span of it.
    theta_h = model.chart.angles(points)[:, 0]
    for chosen, like in ((theta_h > 70, model), (theta_h < 1, other)):
        assert chosen.any()
        x = points[chosen]
        np.testing.assert_allclose(mixed.spline.evaluate(x), like.spline.evaluate(x), rtol=0, atol=1e-11)
    assert spread(mixed) <= 1e-13


def test_a_partner_that_is_missing_or_a_measurement_is_refused(tmp_path):
    assert "none.bvb does not exist" in refusal(lambda: Blend(partner=tmp_path / "none.bvb", t=0.5).apply(smooth()))
    values, axes = np.ones((3, 3, 3, 3)), (np.linspace(0, 1, 3),) * 3
    bvbedit.save(MeasuredBrdf(values, np.ones((3, 3, 3), dtype=bool), axes, HALF_DIFF), tmp_path / "table.npz")
    assert "is a measurement" in refusal(lambda: Blend(partner=tmp_path / "table.npz", t=0.5).apply(smooth()))


def test_make_plausible_tells_what_it_repaired():
    bright = Gain(factor=8).apply(smooth(IN_OUT, Root()))
    assert check(bright).creates_energy
    edited = MakePlausible().apply(bright)
    assert check(edited).plausible
    _, repair = make_plausible(bright)
    assert list(edited.report["notes"]) == [repair.text()]
    assert "albedo at most" in repair.text()
    left = MakePlausible(energy=False, reciprocity=False).apply(bright)
    assert np.array_equal(left.spline.control, bright.spline.control)
    assert list(left.report["notes"]) == ["nothing to repair"]


# ------------------------------------------------------------------------------------------------- structure

KEEPING = (
    InsertKnots(axis=0, at=(0.2, 0.5, 0.5)),
    InsertKnots(axis=2, at=0.41),
    Refine(axis=1, factor=3),
    Elevate(axis=2, by=2),
)


@BOTH
@pytest.mark.parametrize("edit", KEEPING, ids=lambda e: e.line())
def test_structural_edits_keep_values(chart, edit, rng):
    model, x = smooth(chart), rng.uniform(0, 1, (2000, 3))
    edited = edit.apply(model)
    assert np.prod(edited.spline.size) > np.prod(model.spline.size)
    np.testing.assert_allclose(edited.spline.evaluate(x), model.spline.evaluate(x), rtol=0, atol=1e-13)
    assert spread(edited) <= 1e-15


def test_what_was_added_is_removed_again_within_the_tolerance(rng):
    model, x = smooth(), rng.uniform(0, 1, (2000, 3))
    for more, less in (
        (Refine(axis=0), RemoveKnots(axis=0, tolerance=1e-9)),
        (Elevate(axis=1), Reduce(axis=1, tolerance=1e-9)),
    ):
        again = less.apply(more.apply(model))
        assert again.spline.size == model.spline.size
        assert again.spline.degrees == model.spline.degrees
        np.testing.assert_allclose(again.spline.evaluate(x), model.spline.evaluate(x), rtol=0, atol=1e-9)
        assert "changed by at most" in again.report["notes"][0]
    assert "1e-09" in refusal(lambda: Reduce(axis=0, tolerance=1e-9).apply(model))


@pytest.mark.parametrize("storage", [Storage("float16"), Storage("float32"), Storage("float64")], ids=repr)
def test_store_rounds_as_a_file_does(storage, tmp_path):
    model = smooth()
    stored = Store(precision=storage.precision).apply(model)
    bvbedit.save(model, tmp_path / "m.bvb", precision=storage.precision)
    read = bvbedit.load(tmp_path / "m.bvb")
    assert np.array_equal(stored.spline.control, read.spline.control)
    assert stored.storage == read.storage == storage


def test_store_quantised_takes_a_step_or_finds_the_one_that_a_file_would_have(tmp_path):
    model = smooth()
    bvbedit.save(model, tmp_path / "m.bvb", precision="quantised")
    read, stored = bvbedit.load(tmp_path / "m.bvb"), Store(precision="quantised").apply(model)
    assert stored.storage == read.storage
    assert np.array_equal(stored.spline.control, read.spline.control)
    coarse = Store(precision="quantised", step=0.01).apply(model)
    np.testing.assert_allclose(coarse.spline.control / 0.01, np.round(coarse.spline.control / 0.01), atol=1e-9)


@BOTH
@given(st.data())
@settings(max_examples=25)
def test_degenerate_faces_stay_constant_through_all_edits(chart, data):
    model = smooth(chart)
    for edit in data.draw(st.lists(quick_edits(), min_size=1, max_size=4)):
        model = edit.apply(model)
        assert spread(model) <= 1e-13 * max(1, np.abs(model.spline.control).max())


@pytest.mark.parametrize("space", ["auto", "linear", "log"])
def test_materials_of_any_chart_may_be_blended_again_and_again(space, tmp_path):
    one, other = smooth(HALF_DIFF, Log()), smooth(IN_OUT, Root())
    for name, model in (("one", one), ("other", other)):
        bvbedit.save(model, tmp_path / f"{name}.bvb", precision="float64")
    mixed = one
    for name in ("other", "one", "other"):
        mixed = Blend(partner=tmp_path / f"{name}.bvb", t=0.5, space=space).apply(mixed)
    wi, wo = pairs()
    f, a, b = (m.evaluate(wi, wo) for m in (mixed, one, other))
    np.testing.assert_allclose(f[(a > 0.01) & (b > 0.01)].mean(), (0.375 * a + 0.625 * b).mean(), rtol=0.2)
    assert mixed.spline.size == one.spline.size


def test_a_blend_across_charts_tells_what_its_net_cannot_follow(tmp_path):
    sharp = bvbedit.fit(GGX(0.03, Schlick((0.9, 0.9, 0.9))), chart="half-diff", encoding="root", size=(20, 8, 6))
    for name, model in (("sharp", sharp), ("smooth", smooth(HALF_DIFF, Root()))):
        bvbedit.save(model, tmp_path / f"{name}.bvb")

    def notes_of(chart, partner):
        return list(Blend(partner=tmp_path / partner, t=0.5).apply(smooth(chart, Root())).report.get("notes", []))

    (note,) = notes_of(IN_OUT, "sharp.bvb")
    assert note.startswith("sharp.bvb is in chart half-diff, and what is sharp in it is lost between the knots of this")
    assert notes_of(HALF_DIFF, "sharp.bvb") == []


def test_hues_turn_from_red_to_yellow_to_green():
    red, green, blue = colour_matrix(50.0, 1.0) @ [0.8, 0.2, 0.2]
    assert green > 2 * blue
    assert red > blue
    red, green, blue = colour_matrix(120.0, 1.0) @ [0.8, 0.2, 0.2]
    assert green > max(red, blue)
