"""Tables: reproduced at their nodes, interpolated as promised between them, deaf to what stands in invalid cells."""

import itertools
import math

import numpy as np
import pytest

from bvbedit import BvbError
from bvbedit.brdf.charts import HALF_DIFF, IN_OUT, RUSINKIEWICZ, RUSINKIEWICZ_360, Chart, grid_points
from bvbedit.brdf.geometry import spherical
from bvbedit.brdf.measured import MeasuredBrdf, hold
from tests.brdf.samples import random_pairs

Axes = tuple[np.ndarray, np.ndarray, np.ndarray]


def _axes(chart: Chart) -> Axes:
    """A few uneven nodes per axis; MERL's own period on its chart."""
    u, v = np.array([0.0, 0.15, 0.4, 0.7, 0.95]), np.array([0.0, 0.3, 0.5, 0.9])
    w = np.arange(6) / 6 if chart.periodic[2] else np.array([0.0, 0.2, 0.3, 0.55, 0.9, 1.0])
    return u, v, w


def _table(rng: np.random.Generator, chart: Chart, valid: np.ndarray | None = None) -> MeasuredBrdf:
    axes = _axes(chart)
    values = 10.0 ** rng.uniform(-5, 4, (5, 4, 6, 3))  # peaks of 1e4 beside 1e-5
    return MeasuredBrdf(values, np.ones((5, 4, 6), bool) if valid is None else valid, axes, chart)


def _naive(table: MeasuredBrdf, p: np.ndarray) -> np.ndarray:
    """Interpolate one point linearly in log(1 + 1000 f), corner by corner, wrapping where the chart is periodic."""
    sides = []
    for axis, (nodes, x) in enumerate(zip(table.axes, p, strict=True)):
        last = len(nodes) - 1
        below = [i for i in range(last + 1) if nodes[i] <= x]
        if table.chart.periodic[axis] and (not below or below[-1] == last):
            gap = nodes[0] + 1 - nodes[last]
            share = ((x - nodes[last]) % 1.0) / gap
            sides.append([(last, 1 - share), (0, share)])
        elif not below or below[-1] == last:
            sides.append([(0 if not below else last, 1.0)])
        else:
            i = below[-1]
            share = (x - nodes[i]) / (nodes[i + 1] - nodes[i])
            sides.append([(i, 1 - share), (i + 1, share)])
    total = np.zeros(3)
    for (i, a), (j, b), (k, c) in itertools.product(*sides):
        total += a * b * c * np.array([math.log1p(1000 * f) for f in table.filled[i, j, k]])
    return np.array([math.expm1(y) / 1000 for y in total])


CHARTS = [RUSINKIEWICZ, RUSINKIEWICZ_360, IN_OUT, HALF_DIFF]
each = pytest.mark.parametrize("chart", CHARTS, ids=lambda c: c.name)


@each
def test_nodes_are_reproduced(chart, rng):
    table = _table(rng, chart)
    nodes = grid_points(table.axes)
    wi, wo = chart.to_directions(nodes)
    # On a degenerate face all nodes along it are one pair; the first of them speaks for it.
    inside = (wi[:, 2] > 1e-6) & (wo[:, 2] > 1e-6)
    for face in chart.degenerate_faces:
        inside &= nodes[:, face.axis] > 0
    f, trusted = table.evaluate_trusted(wi[inside], wo[inside])
    expected = table.values.reshape(-1, 3)[inside]
    assert inside.sum() > 25
    np.testing.assert_allclose(f, expected, rtol=1e-9, atol=1e-12)
    assert trusted.sum() > 20


@each
def test_between_nodes_the_table_is_trilinear_in_the_logarithm(chart, rng):
    table = _table(rng, chart)
    wi, wo = random_pairs(rng, 800)
    p = chart.to_parameters(wi, wo)
    expected = [_naive(table, q) for q in p]
    np.testing.assert_allclose(table.evaluate(wi, wo), expected, rtol=1e-10, atol=1e-13)


@pytest.mark.parametrize("first", [0.0, 0.04, 0.5 / 6])
@pytest.mark.parametrize("chart", [RUSINKIEWICZ, RUSINKIEWICZ_360], ids=lambda c: c.name)
def test_phi_d_wraps_around_wherever_its_nodes_start(chart, first, rng):
    axes = (*_axes(chart)[:2], first + np.arange(6) / 6)
    table = MeasuredBrdf(rng.uniform(0, 2, (5, 4, 6, 3)), np.ones((5, 4, 6), bool), axes, chart)
    w = np.concatenate([np.linspace(0, 0.1, 11), np.linspace(0.8, 0.9999, 12)])
    p = np.stack([np.full_like(w, 0.3), np.full_like(w, 0.4), w], axis=-1)
    expected = [_naive(table, q) for q in p]
    np.testing.assert_allclose(table.evaluate(*chart.to_directions(p)), expected, rtol=1e-9)


def test_beyond_the_last_node_the_value_stays(rng):
    table = _table(rng, RUSINKIEWICZ)
    # phi_d = pi/2 (w = 0.5): both directions are equally high, here above the horizon.
    for at, node in (([0.97, 0.3, 0.5], [0.95, 0.3, 0.5]), ([0.4, 0.95, 0.5], [0.4, 0.9, 0.5])):
        f = table.evaluate(*RUSINKIEWICZ.to_directions(np.array([at, node])))
        assert f.min() > 0
        np.testing.assert_allclose(f[0], f[1], rtol=1e-9)
    f = _table(rng, IN_OUT).evaluate(*IN_OUT.to_directions(np.array([[0.95, 0.95, 0.3], [0.99, 0.99, 0.3]])))
    np.testing.assert_allclose(f[0], f[1], rtol=1e-12)


def test_invalid_cells_take_the_value_at_the_next_smaller_theta_h(rng):
    valid = np.ones((5, 4, 6), bool)
    valid[2:4, 1, 3] = False  # theta_h nodes 2 and 3: node 1 speaks for both
    valid[0:2, 2, 4] = False  # nothing below: the nearest above, node 2
    valid[:, 3, 5] = False  # nothing at all at this theta_h line: the next axis, theta_d node 2
    values = rng.uniform(0.1, 9, (5, 4, 6, 3))
    for chart in (RUSINKIEWICZ, RUSINKIEWICZ_360):
        whole = MeasuredBrdf(values, valid, _axes(chart), chart)
        assert (whole.values[~valid] == 0).all()
        table = whole.filled
        np.testing.assert_array_equal(table[2:4, 1, 3], np.tile(values[1, 1, 3], (2, 1)))
        np.testing.assert_array_equal(table[0:2, 2, 4], np.tile(values[2, 2, 4], (2, 1)))
        np.testing.assert_array_equal(table[:, 3, 5], values[:, 2, 5])
        np.testing.assert_array_equal(table[valid], values[valid])


def test_a_single_valid_cell_fills_the_table():
    valid = np.zeros((5, 4, 6), bool)
    valid[3, 1, 2] = True
    values = np.full((5, 4, 6, 3), np.nan)
    values[3, 1, 2] = 1.0, 2.0, 3.0
    table = MeasuredBrdf(values, valid, _axes(RUSINKIEWICZ), RUSINKIEWICZ)
    np.testing.assert_array_equal(table.filled, np.broadcast_to([1.0, 2.0, 3.0], (5, 4, 6, 3)))
    f, trusted = table.evaluate_trusted(spherical(0.5, 0.1), spherical(0.6, 2.0))
    np.testing.assert_allclose(f, [1, 2, 3], rtol=1e-12)
    assert not trusted


@each
@pytest.mark.parametrize("garbage", [np.nan, np.inf, -np.inf, 1e300, -1.0, 0.0])
def test_what_stands_in_invalid_cells_has_no_influence(chart, garbage, rng):
    valid = rng.uniform(size=(5, 4, 6)) < 0.6
    values = rng.uniform(0, 3, (5, 4, 6, 3))
    soiled = values.copy()
    soiled[~valid] = garbage
    clean, dirty = (MeasuredBrdf(v, valid, _axes(chart), chart) for v in (values, soiled))
    np.testing.assert_array_equal(dirty.values, clean.values)
    np.testing.assert_array_equal(dirty.filled, clean.filled)
    assert dirty.clamped == clean.clamped == 0
    wi, wo = random_pairs(rng, 300)
    for a, b in zip(clean.evaluate_trusted(wi, wo), dirty.evaluate_trusted(wi, wo), strict=True):
        np.testing.assert_array_equal(a, b)


def test_trust_needs_every_node_that_takes_part(rng):
    valid = rng.uniform(size=(5, 4, 6)) < 0.8
    table = _table(rng, HALF_DIFF, valid)
    wi, wo = random_pairs(rng, 500, np.radians(84))
    _, trusted = table.evaluate_trusted(wi, wo)
    for k, p in enumerate(HALF_DIFF.to_parameters(wi, wo)):
        sides = []
        for nodes, x in zip(table.axes, p, strict=True):
            i = int(np.clip(np.searchsorted(nodes, x, side="right") - 1, 0, len(nodes) - 1))
            j = min(i + 1, len(nodes) - 1)
            share = (x - nodes[i]) / (nodes[j] - nodes[i]) if j > i else 0.0
            sides.append(((i, 1 - share), (j, share)))
        # A node with less than a millionth of the weight is rounding.
        corners = [((i, j, k), a * b * c) for (i, a), (j, b), (k, c) in itertools.product(*sides)]
        assert trusted[k] == all(valid[cell] for cell, weight in corners if weight > 1e-6)
    assert 0 < trusted.sum() < 500


def test_elevations_beyond_85_degrees_are_not_trusted(rng):
    table = _table(rng, IN_OUT)
    _, trusted = table.evaluate_trusted(spherical(np.radians([84.9, 85.1]), 0.0), spherical(0.3, 1.0))
    assert trusted.tolist() == [True, False]


def test_negative_readings_count_as_zero_and_are_reported():
    values = np.ones((2, 2, 2, 3))
    values[0, 0, 0] = [-1.0, 0.5, -1e-9]
    values[1, 1, 1] = -5.0
    valid = np.ones((2, 2, 2), bool)
    valid[1, 1, 1] = False
    table = MeasuredBrdf(values, valid, ([0, 1],) * 3, IN_OUT)
    assert table.clamped == pytest.approx(2 / 21)
    assert table.values[0, 0, 0].tolist() == [0, 0.5, 0]
    assert table.values.min() == 0


@pytest.mark.parametrize("value", [0.0, 1e-300, 1e-12, 1e5, 1e300])
def test_extreme_values_are_interpolated_without_overflow(value):
    values = np.zeros((2, 2, 2, 3))
    values[1] = value
    table = MeasuredBrdf(values, np.ones((2, 2, 2), bool), ([0, 1],) * 3, IN_OUT)
    theta = np.array([0.0, 0.4, 1.5])
    f = table.evaluate(spherical(theta, 0.0), spherical(0.3, 1.0))
    expected = [math.expm1(t / (math.pi / 2) * math.log1p(1000 * value)) / 1000 for t in theta]
    np.testing.assert_allclose(f[:, 0], expected, rtol=1e-9, atol=0)


def test_one_node_on_an_axis_is_a_table_that_does_not_depend_on_it(rng):
    values = rng.uniform(size=(3, 1, 1, 3))
    table = MeasuredBrdf(values, np.ones((3, 1, 1), bool), ([0, 0.5, 1], [0.2], [0.7]), HALF_DIFF)
    wi, wo = random_pairs(rng, 50)
    expected = [_naive(table, p) for p in HALF_DIFF.to_parameters(wi, wo)]
    np.testing.assert_allclose(table.evaluate(wi, wo), expected, rtol=1e-10)


def test_tables_are_copied_and_read_only(rng):
    values, valid, axes = rng.uniform(size=(2, 2, 2, 3)), np.ones((2, 2, 2), bool), [np.array([0.0, 1.0])] * 3
    table = MeasuredBrdf(values, valid, tuple(axes), IN_OUT)
    kept = table.values.copy()
    values[:] = 9.0
    valid[:] = False
    axes[0][0] = 0.5
    np.testing.assert_array_equal(table.values, kept)
    assert table.valid.all()
    assert table.axes[0][0] == 0
    for a in (table.values, table.valid, *table.axes):
        assert not a.flags.writeable


GOOD = {
    "values": np.ones((2, 3, 4, 3)),
    "valid": np.ones((2, 3, 4), bool),
    "axes": ([0, 1], [0, 0.5, 1], [0, 0.2, 0.4, 1]),
    "chart": IN_OUT,
}


def _with(where: tuple[int, ...], value: float) -> np.ndarray:
    values = np.ones((2, 3, 4, 3))
    values[where] = value
    return values


@pytest.mark.parametrize(
    ("name", "value", "says"),
    [
        ("values", np.ones((2, 3, 4)), "do not belong together"),
        ("values", np.ones((2, 3, 5, 3)), "do not belong together"),
        ("valid", np.ones((2, 3), bool), "do not belong together"),
        ("axes", ([0, 1], [0, 0.5, 1]), "do not belong together"),
        ("axes", ([0, 1], [[0, 0.5, 1]], [0, 0.2, 0.4, 1]), "do not belong together"),
        ("valid", np.zeros((2, 3, 4), bool), "Not one cell"),
        ("axes", ([0, 1], [0, 0.5, 0.5], [0, 0.2, 0.4, 1]), "theta_o axis"),
        ("axes", ([0, 1.5], [0, 0.5, 1], [0, 0.2, 0.4, 1]), "theta_i axis"),
        ("axes", ([-0.1, 1], [0, 0.5, 1], [0, 0.2, 0.4, 1]), "theta_i axis"),
        ("axes", ([0, 1], [0, 0.5, 1], [0, 0.2, math.nan, 1]), "phi axis"),
        ("values", _with((1, 2, 3, 0), math.nan), r"1, 2, 3. holds \[nan, 1.0, 1.0\]"),
        ("values", _with((0, 1, 2, 2), math.inf), "0, 1, 2. holds"),
        ("values", _with((0, 1, 2, 2), 1e301), "0, 1, 2. holds"),
        ("values", _with((0, 1, 2, 2), -1e301), "0, 1, 2. holds"),
    ],
)
def test_bad_tables_are_refused(name, value, says):
    assert MeasuredBrdf(**GOOD).values.shape == (2, 3, 4, 3)
    with pytest.raises(BvbError, match=says):
        MeasuredBrdf(**{**GOOD, name: value})


def test_empty_tables_are_refused():
    with pytest.raises(BvbError, match="do not belong together"):
        MeasuredBrdf(np.ones((0, 1, 1, 3)), np.ones((0, 1, 1), bool), ([], [0], [0]), IN_OUT)


def test_hold_fills_from_the_nearest_known_node_below_or_else_above():
    values = np.arange(6.0).reshape(6, 1, 1, 1)
    known = np.array([0, 1, 0, 0, 1, 0], bool).reshape(6, 1, 1)
    assert hold(values, known, (0, 1, 2)).ravel().tolist() == [1, 1, 1, 1, 4, 4]
    assert values.ravel().tolist() == [0, 1, 2, 3, 4, 5]
    nothing = np.zeros((6, 1, 1), bool)
    assert hold(values, nothing, (0, 1, 2)).ravel().tolist() == [0, 1, 2, 3, 4, 5]


def test_reciprocity_is_the_charts(rng):
    wi, wo = random_pairs(rng, 200)
    for chart, reciprocal in ((RUSINKIEWICZ, True), (HALF_DIFF, True), (RUSINKIEWICZ_360, False), (IN_OUT, False)):
        table = _table(rng, chart)
        assert table.reciprocal == reciprocal
        same = np.allclose(table.evaluate(wi, wo), table.evaluate(wo, wi), rtol=1e-9, atol=1e-12)
        assert same == reciprocal


@pytest.mark.parametrize("chart", [IN_OUT, RUSINKIEWICZ_360], ids=lambda c: c.name)
def test_normal_incidence_and_retro_reflection_do_not_depend_on_the_azimuth(chart, rng):
    """A table may differ along a degenerate face; turning the surface must not choose between its values."""
    table = _table(rng, chart)
    w = spherical(0.6, np.arange(7.0))
    f = table.evaluate(np.array([0.0, 0.0, 1.0]), w) if chart is IN_OUT else table.evaluate(w, w)
    np.testing.assert_allclose(f, f[:1].repeat(7, axis=0), rtol=1e-9)
