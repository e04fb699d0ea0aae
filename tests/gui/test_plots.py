"""Plots: lines and albedos that are those of the model, and pictures that say so in words."""

import re
from concurrent.futures import ThreadPoolExecutor
from xml.etree import ElementTree

import numpy as np
import pytest

from bvbedit import BvbError, fit
from bvbedit.brdf.analytic import GGX, Lambert, Schlick
from bvbedit.brdf.charts import CHARTS, HALF_DIFF, IN_OUT, RUSINKIEWICZ, grid_points
from bvbedit.brdf.encodings import Linear
from bvbedit.brdf.fit import fit_net
from bvbedit.brdf.measured import MeasuredBrdf
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.spline.tensor import TensorSpline
from bvbedit_gui.plots import albedo_curve, draw_albedo, draw_iso_line, iso_line
from bvbedit_gui.plots.albedo_picture import above_one
from bvbedit_gui.plots.svg import text_width
from bvbedit_gui.themes import DARK, LIGHT

GOLD = GGX(0.3, Schlick((0.9, 0.6, 0.2)))
MIRROR = GGX(0.005, Schlick((0.9, 0.8, 0.7)))
SVG = "{http://www.w3.org/2000/svg}"
SIZES = ((380, 240), (480, 300), (1100, 700))


@pytest.fixture(scope="module")
def gold():
    return fit(GOLD, size=(8, 6, 4), chart="half-diff", encoding="root")


@pytest.fixture(scope="module")
def white():
    return fit_net(Lambert((1.0,) * 3), IN_OUT, Linear(), size=(4, 4, 4), degrees=(3, 3, 3), knots="uniform")


@pytest.fixture(scope="module")
def table():
    """A measurement with a hole: theta_d from 40 to 50 degrees."""
    axes = (np.linspace(0, 1, 31), np.arange(46) / 45, np.arange(19) / 18)
    wi, wo = RUSINKIEWICZ.to_directions(grid_points(axes))
    shape = tuple(len(a) for a in axes)
    above = (np.minimum(wi[:, 2], wo[:, 2]) >= 0).reshape(shape)
    above[:, 20:26] = False
    return MeasuredBrdf(GOLD.evaluate(wi, wo).reshape(*shape, 3), above, axes, RUSINKIEWICZ)


def flat(albedo):
    clamped = np.repeat([0.0, 1.0], 4)
    return SplineBrdf(TensorSpline((3,) * 3, (clamped,) * 3, np.full((4, 4, 4, 3), albedo / np.pi)), IN_OUT, Linear())


def texts(svg):
    return [e.text for e in ElementTree.fromstring(svg).iter(SVG + "text")]


def directions(line, parameter):
    points = np.tile(np.array(line.at), (len(parameter), 1))
    points[:, line.axis] = parameter
    return line.chart.to_directions(points)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("chart", [HALF_DIFF, IN_OUT], ids=repr)
def test_the_line_has_the_values_and_angles_of_the_model(gold, chart, axis):
    line = iso_line(gold, GOLD, chart=chart, axis=axis, at=(0.4, 0.5, 0.6))
    wi, wo = directions(line, line.parameter)
    np.testing.assert_allclose(line.model, gold.evaluate(wi, wo), rtol=1e-9, atol=1e-12)
    known = np.isfinite(line.reference).all(axis=1)
    np.testing.assert_allclose(line.reference[known], GOLD.evaluate(wi, wo)[known], rtol=1e-12)
    # Closed forms are believed up to 89 degrees.
    grazing = np.minimum(wi[:, 2], wo[:, 2]) < np.cos(GOLD.reliable_elevation)
    np.testing.assert_array_equal(known, ~grazing)
    assert line.parameter[0] == 0
    assert line.parameter[-1] == 1
    assert (np.diff(line.parameter) > 0).all()
    assert 0.4 in line.parameter or axis != 0
    points = np.tile(np.array(line.at), (len(line.parameter), 1))
    points[:, axis] = line.parameter
    np.testing.assert_allclose(line.degrees, chart.angles(points)[:, axis], rtol=1e-12, atol=1e-12)
    assert not line.model.flags.writeable


def test_knots_are_where_the_spline_has_them(gold):
    for axis in range(3):
        line = iso_line(gold, None, chart=gold.chart, axis=axis, at=(0.4, 0.5, 0.6))
        np.testing.assert_array_equal(line.knots, np.unique(gold.spline.knots[axis]))
        np.testing.assert_allclose(line.at_knots, gold.evaluate(*directions(line, line.knots)), rtol=1e-9, atol=1e-12)
        assert line.reference is None
    assert len(iso_line(gold, None, chart=IN_OUT, axis=0, at=(0.4, 0.5, 0.6)).knots) == 0
    assert len(iso_line(GOLD, None, chart=HALF_DIFF, axis=0, at=(0.4, 0.5, 0.6)).knots) == 0


@pytest.mark.parametrize(("chart", "axis", "at"), [(HALF_DIFF, 0, (0, 0.4, 1)), (IN_OUT, 1, (0.503, 0, 1))], ids=str)
def test_a_mirrors_peak_is_resolved(chart, axis, at):
    line = iso_line(MIRROR, None, chart=chart, axis=axis, at=at)
    f = line.model[:, 0]
    peak = float(np.nanmax(f))
    # The highlight is about a degree wide; what lies between the points is nearly on the line through them.
    assert np.count_nonzero(f > 0.1 * peak) >= 12
    middle = 0.5 * (line.parameter[1:] + line.parameter[:-1])
    between = MIRROR.evaluate(*directions(line, middle))[:, 0]
    assert np.nanmax(np.abs(between - np.interp(middle, line.parameter, f))) < 0.02 * peak


def test_titles_tell_which_line(gold):
    def title(chart, axis, at):
        return iso_line(gold, None, chart=chart, axis=axis, at=at).title

    assert title(HALF_DIFF, 0, (0.2, 0.4, 0.5)) == "along θ_h at θ_d = 40 %, φ_d = 45°"
    # At phi_d = 90 degrees the horizon is at theta_d = 90 degrees whatever theta_h is.
    assert title(HALF_DIFF, 0, (0.2, 0.4, 1.0)) == "along θ_h at θ_d = 36°, φ_d = 90°"
    assert title(HALF_DIFF, 1, (0.5, 0.4, 0.5)) == "along θ_d at θ_h = 22.5°, φ_d = 45°"
    assert title(IN_OUT, 2, (0.5, 0.25, 0.5)) == "along φ at θ_i = 45°, θ_o = 22.5°"


def test_holes_and_grazing_of_a_measurement_are_gaps(table):
    line = iso_line(table, None, chart=RUSINKIEWICZ, axis=1, at=(0.3, 0.2, 0.5))
    seen = np.isfinite(line.model).all(axis=1)
    hole = (line.degrees > 39) & (line.degrees < 51)
    assert not seen[hole].any()
    assert seen[line.degrees < 37].all()
    # The hole, and elevations beyond 85 degrees, below the horizon at last.
    assert not seen[line.degrees > 86].any()
    svg = draw_iso_line(line, width=480, height=300, theme=LIGHT)
    reds = [e.get("d") for e in ElementTree.fromstring(svg).iter(SVG + "path") if "clip-path" in e.attrib]
    assert reds[0].count("M") == 2
    blind = iso_line(table, None, chart=HALF_DIFF, axis=2, at=(1.0, 0.9, 0.5))
    assert np.isnan(blind.model).all()
    for scale in ("linear", "log"):
        assert "nothing reliable is known along this line" in texts(
            draw_iso_line(blind, width=480, height=300, theme=DARK, scale=scale)
        )


@pytest.mark.parametrize("scale", ["linear", "log"])
@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])
def test_pictures_have_the_words_and_are_small(gold, scale, theme):
    line = iso_line(gold, GOLD, chart=HALF_DIFF, axis=0, at=(0.2, 0.4, 0.5))
    for width, height in SIZES:
        svg = draw_iso_line(line, width=width, height=height, theme=theme, scale=scale)
        root = ElementTree.fromstring(svg)
        assert (root.get("width"), root.get("height")) == (str(width), str(height))
        words = texts(svg)
        assert "f along θ_h at θ_d = 40 %, φ_d = 45°" in words
        assert {"red", "green", "blue", "reference", "knots", "f, 1/sr", "90°"} <= set(words)
        assert any(w.startswith("θ_h, degrees") for w in words)
        residual = "relative residual, %" if scale == "log" else "model − reference, 1/sr"
        assert any(w.startswith(residual) for w in words)
        assert theme.paper in svg
        assert all(colour in svg for colour in theme.series)
        assert "nan" not in svg.lower()
        assert len(svg.encode()) < 80_000


@pytest.mark.parametrize(("width", "height"), SIZES)
@pytest.mark.parametrize("scale", ["linear", "log"])
def test_no_words_overlap_or_are_cut(gold, white, scale, width, height):
    for model, reference in ((gold, GOLD), (white, None), (flat(0.0), Lambert((1.0, 1.0, 1.0)))):
        line = iso_line(model, reference, chart=model.chart, axis=0, at=(0.2, 0.4, 0.5))
        check_words(draw_iso_line(line, width=width, height=height, theme=LIGHT, scale=scale), width, height)
    check_words(draw_albedo(albedo_curve(white), width=width, height=height, theme=LIGHT), width, height)


def check_words(svg, width, height):
    boxes = []
    for e in ElementTree.fromstring(svg).iter(SVG + "text"):
        size, x, y = float(e.get("font-size")), float(e.get("x")), float(e.get("y"))
        assert 11 <= size <= 13
        wide = text_width(e.text, size, bold=e.get("font-weight") == "bold")
        before = {None: 0.0, "middle": wide / 2, "end": wide}[e.get("text-anchor")]
        if "transform" in e.attrib:
            box = (x - 0.8 * size, y - wide + before, x + 0.2 * size, y + before, e.text)
        else:
            box = (x - before, y - 0.8 * size, x - before + wide, y + 0.2 * size, e.text)
        assert box[0] >= 0, box
        assert box[1] >= 0, box
        assert box[2] <= width, box
        assert box[3] <= height, box
        for other in boxes:
            apart = box[2] <= other[0] or other[2] <= box[0] or box[3] <= other[1] or other[3] <= box[1]
            assert apart, (box, other)
        boxes.append(box)


def test_pictures_are_the_same_each_time_and_in_threads(gold):
    def drawn(k):
        at = (0.2, 0.1 * k, 0.5)
        line = iso_line(gold, GOLD, chart=HALF_DIFF, axis=0, at=at)
        return draw_iso_line(line, width=480, height=300, theme=LIGHT, scale="log")

    alone = [drawn(k) for k in range(8)]
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(drawn, range(8))) == alone
    # On one page the names within one picture must not mean something in another.
    names = [set(re.findall(r'id="([^"]*)"', svg)) for svg in alone]
    assert all(names)
    assert len(set.union(*names)) == sum(map(len, names))


def test_settings_of_matplotlib_change_nothing(gold):
    from matplotlib import rc_context, rcParams

    line = iso_line(gold, GOLD, chart=HALF_DIFF, axis=1, at=(0.2, 0.4, 0.5))
    before, settings = draw_iso_line(line, width=480, height=300, theme=LIGHT), dict(rcParams)
    others = {"svg.fonttype": "path", "svg.hashsalt": "x", "path.simplify": False, "text.usetex": True, "font.size": 20}
    with rc_context(others):
        text_width.cache_clear()
        assert draw_iso_line(line, width=480, height=300, theme=LIGHT) == before
    assert dict(rcParams) == settings


@pytest.mark.parametrize("scale", ["linear", "log"])
def test_black_and_constant_and_negative_models_are_drawn(gold, scale):
    black = flat(0.0)
    line = iso_line(black, Lambert((0.0, 0.0, 0.0)), chart=IN_OUT, axis=0, at=(0.5, 0.5, 0.5))
    assert any(
        w.startswith("black") for w in texts(draw_iso_line(line, width=480, height=300, theme=LIGHT, scale=scale))
    )
    grey = flat(0.5)
    line = iso_line(grey, Lambert((0.5, 0.5, 0.5)), chart=IN_OUT, axis=0, at=(0.5, 0.5, 0.5))
    words = texts(draw_iso_line(line, width=480, height=300, theme=LIGHT, scale=scale))
    # Rounding is no residual.
    assert any(w.endswith(": none") for w in words)
    negative = gold.with_spline(gold.spline.with_control(gold.spline.control - 0.8))
    line = iso_line(negative, GOLD, chart=HALF_DIFF, axis=0, at=(0.5, 0.5, 0.5))
    assert (line.model == 0).any()
    words = texts(draw_iso_line(line, width=480, height=300, theme=LIGHT, scale=scale))
    assert any(w.startswith("≤") for w in words) == (scale == "log")


def test_what_makes_no_sense_is_refused(gold):
    with pytest.raises(BvbError, match="axis is 3"):
        iso_line(gold, None, chart=HALF_DIFF, axis=3, at=(0.5, 0.5, 0.5))
    for at in ((0.5, 0.5, 1.5), (0.5, float("nan"), 0.5), (0.5, 0.5)):
        with pytest.raises(BvbError, match="three chart parameters"):
            iso_line(gold, None, chart=HALF_DIFF, axis=0, at=at)
    line = iso_line(gold, None, chart=HALF_DIFF, axis=0, at=(0.5, 0.5, 0.5))
    with pytest.raises(BvbError, match="width is 20"):
        draw_iso_line(line, width=20, height=300, theme=LIGHT)
    with pytest.raises(BvbError, match="linear or log"):
        draw_iso_line(line, width=480, height=300, theme=LIGHT, scale="root")
    with pytest.raises(BvbError, match="no B-spline model"):
        albedo_curve(GOLD)


def test_lines_at_the_edges_of_every_chart(gold):
    for chart in CHARTS.values():
        for axis in range(3):
            for at in ((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (1.0, 0.5, 0.0), (0.0, 1.0, 1.0)):
                line = iso_line(gold, None, chart=chart, axis=axis, at=at)
                draw_iso_line(line, width=380, height=240, theme=DARK, scale="log")
                if chart in (HALF_DIFF, IN_OUT):
                    assert np.isfinite(line.model).all()


def test_the_albedo_of_white_is_one(white):
    curve = albedo_curve(white)
    np.testing.assert_allclose(curve.value, 1.0, atol=2e-5)
    assert 40 <= len(curve.degrees) <= 46
    assert curve.creates_energy == ()
    assert curve.words.startswith("creates no energy")
    words = texts(draw_albedo(curve, width=480, height=300, theme=LIGHT))
    assert {"Directional albedo", "θ_o, degrees", "albedo", "90°", curve.words} <= set(words)
    assert albedo_curve(flat(0.0)).words == "creates no energy: at most 0 (red, 0°)"


def test_created_energy_is_shaded_and_said(white):
    more = flat(1.08)
    curve = albedo_curve(more, albedo_curve(white))
    np.testing.assert_allclose(curve.value, 1.08, rtol=1e-4)
    assert curve.words == "creates energy at 0° ... 90°: at most 1.08"
    svg = draw_albedo(curve, width=480, height=300, theme=DARK)
    assert DARK.warning in svg
    assert {curve.words, "reference"} <= set(texts(svg))
    assert LIGHT.warning not in draw_albedo(albedo_curve(white), width=480, height=300, theme=LIGHT)


def test_areas_above_one_end_where_the_line_crosses_it():
    x, y = np.array([0.0, 0.25, 0.5, 0.75, 1.0]), np.array([0.5, 1.5, 0.5, 0.9, 1.1])
    first, second = above_one(x, y)
    np.testing.assert_allclose(first, [[0.125, 1], [0.125, 1], [0.25, 1.5], [0.375, 1], [0.375, 1]])
    np.testing.assert_allclose(second, [[0.875, 1], [0.875, 1], [1, 1.1], [1, 1]])
    assert above_one(x, np.ones(5)) == []
