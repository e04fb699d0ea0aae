"""Knots of one axis from the Gram matrix of its lines: errors that are those of dense least squares and never rise."""

import functools
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bvbedit.spline.adaptive import (
    WEIGHT_FLOOR,
    AxisLines,
    KnotPath,
    allocate,
    axis_lines,
    dominant_knots,
    marginals,
    placed_knots,
)
from bvbedit.spline.knots import PLACEMENTS, checked_knots, place_knots
from tests.spline import naive
from tests.spline.refusals import refusal

U = np.linspace(0, 1, 91)
PEAK = 1 / (1 + ((U - 0.37) / 0.02) ** 2)


def _lines(values: np.ndarray, u: np.ndarray = U) -> AxisLines:
    return axis_lines(values.reshape(len(u), -1), np.ones(len(u)), [u])[0]


def _axes(rng: np.random.Generator, shape: Sequence[int]) -> list[np.ndarray]:
    axes = [np.cumsum(rng.uniform(0.5, 1.5, m)) for m in shape]
    return [(u - u[0]) / (u[-1] - u[0]) for u in axes]


@st.composite
def _tables(draw: st.DrawFn, separable: bool = False) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
    """Random tables of one to three axes and two channels, with weights over decades."""
    rng = np.random.default_rng(draw(st.integers(0, 10_000)))
    shape = draw(st.sampled_from([(24,), (14, 9), (20, 3), (9, 8, 10)]))
    weights = 10.0 ** rng.uniform(-3, 0, shape)
    if separable:
        weights = functools.reduce(np.multiply.outer, [10.0 ** rng.uniform(-2, 0, m) for m in shape])
    elif draw(st.booleans()):
        weights[rng.uniform(size=shape) < 0.25] = 0.0
    smooth = draw(st.booleans())
    values = rng.normal(size=(*shape, 2))
    for a in range(len(shape)) if smooth else ():
        values = np.cumsum(values, axis=a)
    return values, weights, _axes(rng, shape)


def _assert_sound(path: KnotPath, lines: AxisLines, degree: int) -> None:
    """Assert that there is one clamped vector for each size, that the data determine its spline, and its error."""
    u, rounding = lines.parameters, 1e-25 * float(np.sum(lines.factor**2))
    assert path.degree == degree
    assert path.fewest == degree + 1
    assert path.most == degree + len(path.knots) <= len(u)
    assert len(path.errors) == len(path.knots)
    for size in range(path.fewest, path.most + 1):
        t = path.of(size)
        checked_knots(t, degree)
        assert len(t) - degree - 1 == size
        assert (t[0], t[-1]) == (u[0], u[-1])
        assert _schoenberg_whitney(t, degree, u)
        assert np.isfinite(path.error_of(size))
        assert path.error_of(size) == pytest.approx(lines.error(t, degree), rel=1e-12, abs=rounding)


def _schoenberg_whitney(knots: np.ndarray, degree: int, u: np.ndarray) -> bool:
    """Return whether each basis function has a datum of its own where it is not zero."""
    k = 0
    for i in range(len(knots) - degree - 1):
        low, high = knots[i], knots[i + degree + 1]
        # Basis functions are not zero at the left end of their support where it is a knot of full multiplicity.
        first = knots[i + degree] == low
        last = knots[i + 1] == high == knots[-1]
        while k < len(u) and not ((low < u[k] or (first and low == u[k])) and (u[k] < high or (last and u[k] == high))):
            k += 1
        if k == len(u):
            return False
        k += 1
    return True


def _assert_never_rising(errors: np.ndarray) -> None:
    assert (np.diff(errors) <= 0).all()


@given(_tables(), st.integers(0, 5))
def test_errors_never_rise(table, degree):
    for lines in axis_lines(*table):
        m = len(lines.parameters)
        if m > degree:
            path = dominant_knots(lines, degree, m)
            _assert_sound(path, lines, degree)
            _assert_never_rising(path.errors)


def _left(values: np.ndarray, weights: np.ndarray, matrices: Sequence[np.ndarray]) -> float:
    """Return the weighted squared norm of what dense least squares leaves; weights relative to the largest."""
    roots = np.sqrt(weights / weights.max()).ravel()[:, None]
    matrix = roots * functools.reduce(np.kron, matrices)
    right = roots * values.reshape(len(roots), -1)
    return float(np.sum((right - matrix @ np.linalg.lstsq(matrix, right, rcond=None)[0]) ** 2))


@given(_tables(separable=True), st.integers(0, 4))
def test_the_error_of_an_axis_is_that_of_dense_least_squares(table, degree):
    values, weights, axes = table
    for a, lines in enumerate(axis_lines(values, weights, axes)):
        t = place_knots("averaged", axes[a], min(degree + 2, len(axes[a])), min(degree, len(axes[a]) - 1))
        p = min(degree, len(axes[a]) - 1)
        matrices = [naive.matrix(t, p, u) if a == b else np.eye(len(u)) for b, u in enumerate(axes)]
        scale = np.sum(values**2 * (weights / weights.max())[..., None])
        assert lines.error(t, p) == pytest.approx(_left(values, weights, matrices), rel=1e-7, abs=1e-11 * scale)
        # What is left of the factor has the Gram matrix of what is left of the lines.
        left = np.sum(lines.residual(t, p) ** 2)
        assert lines.error(t, p) == pytest.approx(left, rel=1e-12, abs=1e-14 * scale)


@given(_tables(separable=True), st.integers(1, 3))
def test_the_errors_of_the_axes_bound_that_of_the_whole(table, degree):
    """The inequality that lets axes be refined one after the other."""
    values, weights, axes = table
    if min(values.shape[:-1]) <= degree:
        return
    vectors = [place_knots("averaged", u, degree + 1 + len(u) // 5, degree) for u in axes]
    whole = _left(values, weights, [naive.matrix(t, degree, u) for t, u in zip(vectors, axes, strict=True)])
    lines = axis_lines(values, weights, axes)
    errors = [x.error(t, degree) for x, t in zip(lines, vectors, strict=True)]
    assert max(errors) * (1 - 1e-9) <= whole <= sum(errors) * (1 + 1e-9)


def test_the_gram_matrix_is_that_of_the_weighted_lines(rng):
    values, weights = rng.normal(size=(8, 7, 6, 2)), rng.uniform(0.1, 1.0, (8, 7, 6))
    axes = _axes(rng, (8, 7, 6))
    for a, lines in enumerate(axis_lines(values, weights, axes)):
        others = tuple(b for b in range(3) if b != a)
        w = weights / weights.max()
        by_row, by_line = w.mean(axis=others, keepdims=True), w.mean(axis=a, keepdims=True)
        table = np.moveaxis(values * np.sqrt(by_row * by_line / w.mean())[..., None], a, 0).reshape(len(axes[a]), -1)
        np.testing.assert_allclose(lines.factor @ lines.factor.T, table @ table.T, rtol=0, atol=1e-11)
        np.testing.assert_allclose(lines.roots**2, by_row.ravel(), rtol=1e-12)
        np.testing.assert_array_equal(lines.parameters, axes[a])
        np.testing.assert_array_equal(lines.noise, 0.0)


def test_few_lines_have_a_small_factor(rng):
    table = rng.normal(size=(91, 2)) @ rng.normal(size=(2, 300))
    assert _lines(table).factor.shape == (91, 2)


def test_noise_adds_up_in_the_rows_as_the_weights_say(rng):
    variance, weights = rng.uniform(size=(40, 50)), np.outer(rng.uniform(0.1, 1, 40), rng.uniform(0.1, 1, 50))
    noise = rng.normal(size=(40, 50, 1)) * np.sqrt(variance)[..., None]
    for lines in axis_lines(noise, weights, _axes(rng, (40, 50)), variance):
        found = np.sum(lines.factor**2, axis=1)
        assert np.sum(found) == pytest.approx(np.sum(lines.noise), rel=0.1)
        np.testing.assert_allclose(found, lines.noise, rtol=1.5)


@pytest.mark.parametrize(
    "where",
    [np.s_[:, :], np.s_[2:5], np.s_[:, 6], np.s_[4, 3]],
    ids=["all", "some rows", "the last column", "one node"],
)
def test_rows_without_weight_get_a_little(where):
    w = np.zeros((9, 7))
    w[where] = 1
    rows = marginals(w)
    assert [len(r) for r in rows] == [9, 7]
    for r in rows:
        assert r.min() >= WEIGHT_FLOOR * r.max() > 0
    lines = axis_lines(np.ones((9, 7, 1)), w, [np.arange(9.0), np.arange(7.0)])
    assert all(x.roots.min() > 0 for x in lines)


def test_deterministic(rng):
    values, weights, axes = rng.normal(size=(30, 20, 3)), rng.uniform(size=(30, 20)), _axes(rng, (30, 20))
    paths = [[dominant_knots(x, 3, 18) for x in axis_lines(values, weights, axes)] for _ in range(2)]
    for one, other in zip(*paths, strict=True):
        np.testing.assert_array_equal(one.errors, other.errors)
        for s, t in zip(one.knots, other.knots, strict=True):
            np.testing.assert_array_equal(s, t)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 37.0, 1e6])
def test_knots_do_not_depend_on_the_scale(scale):
    values = np.stack([PEAK, np.sin(9 * U)], axis=1)
    expected, found = (dominant_knots(_lines(s * values), 3, 30) for s in (1.0, scale))
    np.testing.assert_allclose(found.of(20), expected.of(20), rtol=0, atol=1e-12)
    np.testing.assert_allclose(found.errors[:15], scale**2 * expected.errors[:15], rtol=1e-6)


@pytest.mark.parametrize("degree", [0, 1, 3, 5, 16])
@pytest.mark.parametrize("value", [0.0, 3.0, -1.0])
def test_constant_data(value, degree):
    lines = _lines(np.full(91, value))
    path = dominant_knots(lines, degree, 30)
    _assert_sound(path, lines, degree)
    assert path.most == 30
    assert path.errors.max() <= 1e-24 * value**2


@pytest.mark.parametrize("scale", [1e-300, 1e-160, 1e160, 1e300])
def test_extreme_data_get_the_knots_of_tame_ones(scale):
    """Their squares leave the range of float64."""
    expected, found = (dominant_knots(_lines(s * PEAK), 3, 25) for s in (1.0, scale))
    assert found.most == 25
    np.testing.assert_allclose(found.of(20), expected.of(20), rtol=0, atol=1e-12)


@pytest.mark.parametrize("degree", range(17))
def test_all_degrees_from_the_fewest_control_points_to_as_many_as_data(degree, rng):
    u = _axes(rng, (40,))[0]
    lines = _lines(rng.normal(size=(40, 2)), u)
    path = dominant_knots(lines, degree, 40)
    _assert_sound(path, lines, degree)
    _assert_never_rising(path.errors)
    assert dominant_knots(lines, degree, degree + 1).most == degree + 1


@pytest.mark.parametrize("degree", [1, 2, 3, 5])
def test_as_many_control_points_as_data_meet_them(degree, rng):
    lines = _lines(rng.normal(size=(40, 2)), np.linspace(0, 1, 40))
    path = dominant_knots(lines, degree, 40)
    assert path.most == 40
    assert path.errors[-1] < 1e-20 * path.errors[0]


@pytest.mark.parametrize(("m", "degree"), [(2, 0), (2, 1), (3, 1), (4, 3), (5, 3), (17, 16)])
def test_the_fewest_data(m, degree):
    lines = _lines(np.arange(m) ** 2.0, np.arange(float(m)))
    for most in range(degree + 1, m + 1):
        path = dominant_knots(lines, degree, most)
        _assert_sound(path, lines, degree)


# The RMS of averaged and of Piegl-Tiller knots over that of dominant points, as measured: 6.5 and 7.1, 264 and 462,
# 4,190 and 3,970.
@pytest.mark.parametrize(("size", "factor"), [(10, 4), (20, 150), (30, 2000)])
def test_a_sharp_peak_gets_its_knots(size, factor):
    lines = _lines(PEAK)
    path = dominant_knots(lines, 3, 30)
    near = np.abs(np.unique(path.of(20))[1:-1] - 0.37) < 0.1
    assert near.mean() > 0.5
    for placement in ("averaged", "piegl-tiller"):
        assert factor**2 * path.error_of(size) < lines.error(place_knots(placement, U, size, 3), 3)


@pytest.mark.parametrize("values", [PEAK, PEAK[::-1]], ids=["left", "right"])
def test_constant_pieces_follow_a_peak_on_either_side(values):
    """At degree 0 no point stands on the right end: what lies behind the last one was once never split."""
    lines = _lines(np.ascontiguousarray(values))
    path = dominant_knots(lines, 0, 40)
    assert path.most == 40
    for size, factor in ((10, 3), (40, 50)):  # measured: 4.2 and 4.7, 77 and 81
        assert factor**2 * path.error_of(size) < lines.error(place_knots("uniform", U, size, 0), 0)


def test_a_peak_of_some_lines_only_gets_its_knots(rng):
    """One vector serves all lines: what few of them need must not drown in those that need nothing."""
    table = np.outer(np.cos(2 * U), rng.uniform(1, 2, 200))
    table[:, :10] += PEAK[:, None]
    lines = _lines(table)
    path = dominant_knots(lines, 3, 20)
    assert 10**2 * path.error_of(20) < lines.error(place_knots("averaged", U, 20, 3), 3)


def test_weights_draw_the_knots():
    y = np.sin(40 * U)
    for centre in (0.2, 0.8):
        weights = np.where(np.abs(U - centre) < 0.2, 1.0, 1e-6)
        knots = dominant_knots(axis_lines(y[:, None], weights, [U])[0], 3, 20).of(20)[4:-4]
        assert (np.abs(knots - centre) < 0.25).mean() > 0.7


def test_noise_draws_no_knots(rng):
    """Points for the features, not for where the noise is loudest."""
    deviation = np.where(U > 0.6, 0.05, 1e-4)
    values = PEAK[:, None] + deviation[:, None] * rng.normal(size=(91, 40))
    variance = np.repeat(deviation[:, None] ** 2, 40, axis=1)
    knots = []
    for known in (variance, None):
        lines = axis_lines(values[..., None], np.ones((91, 40)), [U, np.arange(40.0)], known)[0]
        knots.append(dominant_knots(lines, 3, 16).of(16)[4:-4])
    with_noise_known, without = ((t > 0.6).sum() for t in knots)
    assert with_noise_known < without


@pytest.mark.parametrize("placement", list(PLACEMENTS))
def test_placed_knots_make_a_path(placement, rng):
    lines = _lines(rng.normal(size=(91, 3)))
    path = placed_knots(lines, placement, 3, 30)
    _assert_sound(path, lines, 3)
    np.testing.assert_array_equal(path.of(12), place_knots(placement, U, 12, 3))


def test_a_path_takes_other_knots(rng):
    path = dominant_knots(_lines(rng.normal(size=(91, 3))), 3, 30)
    other = place_knots("uniform", U, 12, 3)
    changed = path.with_knots(other, 0.5)
    np.testing.assert_array_equal(changed.of(12), other)
    assert changed.error_of(12) == 0.5
    assert path.error_of(12) != 0.5
    for size in (4, 11, 13, 30):
        np.testing.assert_array_equal(changed.of(size), path.of(size))
        assert changed.error_of(size) == path.error_of(size)


VALUES, WEIGHTS, NODES = np.ones((5, 4, 3)), np.ones((5, 4)), [np.arange(5.0), np.arange(4.0)]


def _with(array: np.ndarray, value: float) -> np.ndarray:
    out = array.copy()
    out[1, 2] = value
    return out


@pytest.mark.parametrize(
    "changes",
    [
        {"values": VALUES[:4]},
        {"values": VALUES[..., 0]},
        {"values": "abc"},
        {"values": _with(VALUES, np.nan)},
        {"values": _with(VALUES, np.inf)},
        {"weights": WEIGHTS[:, :3]},
        {"weights": _with(WEIGHTS, np.nan)},
        {"weights": _with(WEIGHTS, np.inf)},
        {"weights": _with(WEIGHTS, -1.0)},
        {"weights": np.zeros((5, 4))},
        {"parameters": NODES[:1]},
        {"parameters": [NODES[0], NODES[1][::-1]]},
        {"parameters": [NODES[0], np.zeros(4)]},
        {"parameters": [NODES[0], np.array([0, 1, np.nan, 3])]},
        {"parameters": [NODES[0], np.zeros((4, 1))]},
        {"parameters": 3},
    ],
    ids=str,
)
def test_lines_are_refused(changes):
    refusal(lambda: axis_lines(**({"values": VALUES, "weights": WEIGHTS, "parameters": NODES} | changes)))


def test_one_node_on_an_axis_is_refused():
    refusal(lambda: axis_lines(np.ones((5, 1, 3)), np.ones((5, 1)), [np.arange(5.0), np.zeros(1)]))


@pytest.mark.parametrize(("degree", "most"), [(-1, 5), (17, 20), (1.5, 5), (True, 5), ("3", 5)])
def test_degrees_are_refused(degree, most):
    refusal(lambda: dominant_knots(_lines(PEAK), degree, most))


@pytest.mark.parametrize("most", [3, 0, -1, 92, 10.5, True, None])
def test_numbers_of_control_points_are_refused(most):
    refusal(lambda: dominant_knots(_lines(PEAK), 3, most))


@st.composite
def _paths(draw: st.DrawFn) -> list[KnotPath]:
    """Paths with made-up errors: some axes stall, some have nothing to gain."""
    out = []
    for _ in range(draw(st.integers(1, 3))):
        p = draw(st.integers(0, 3))
        falls = draw(st.lists(st.sampled_from([1.0, 1.0, 0.99, 0.7, 0.3, 0.01, 0.0]), max_size=12))
        errors = 10.0 ** draw(st.integers(-3, 3)) * np.cumprod([1.0, *falls])
        out.append(KnotPath(p, tuple(np.zeros(2 * p + 2 + i) for i in range(len(errors))), errors))
    return out


@given(_paths(), st.integers(1, 3000), st.sampled_from([0.0, 0.0, 0.1, 1e3]))
def test_allocation_grows_within_its_points(paths, points, floor):
    walk = allocate(paths, points, [floor] * len(paths))
    assert walk[0] == tuple(path.fewest for path in paths)
    for before, after in pairwise(walk):
        steps = np.subtract(after, before)
        assert steps.min() >= 0
        assert np.count_nonzero(steps) == 1
        assert steps.max() <= 4
        gain = sum(p.error_of(a) - p.error_of(b) for p, a, b in zip(paths, before, after, strict=True))
        assert gain > floor * steps.max()
    for size in walk:
        assert all(path.fewest <= n <= path.most for path, n in zip(paths, size, strict=True))
    for size in walk[1:]:
        assert np.prod(size) <= points


def test_allocation_gives_points_to_the_axis_with_the_feature():
    u, v = U, np.linspace(0, 1, 41)
    values = (PEAK[:, None] * (1 + 0.2 * v) + 0.1 * v**2)[..., None]
    paths = [dominant_knots(x, 3, 30) for x in axis_lines(values, np.ones((91, 41)), [u, v])]
    sizes = allocate(paths, 120)
    assert sizes[-1][0] >= 20
    assert sizes[-1][1] <= 5
    swapped = allocate(paths[::-1], 120)
    assert [s[::-1] for s in swapped] == sizes


def test_allocation_leaves_noise_alone(rng):
    values = (PEAK[:, None] + 0.01 * rng.normal(size=(91, 41)))[..., None]
    variance = np.full((91, 41), 1e-4)
    lines = axis_lines(values, np.ones((91, 41)), [U, np.linspace(0, 1, 41)], variance)
    paths = [dominant_knots(x, 3, 30) for x in lines]
    # A control point takes away the noise of one row, and of the rows there are those taken where it is most.
    floors = [3 * float(x.noise.mean()) for x in lines]
    size = allocate(paths, 900, floors)[-1]
    assert 10 <= size[0] <= 15
    assert size[1] == 4
    assert np.prod(allocate(paths, 900)[-1]) > 800


def test_steps_over_a_stall():
    """Where one control point alone brings nothing, several at once may."""
    errors = np.array([1.0, 1.0, 1.0, 0.1])
    path = KnotPath(3, tuple(np.zeros(8 + i) for i in range(4)), errors)
    assert allocate([path], 10) == [(4,), (7,)]
    assert allocate([path], 6) == [(4,)]
