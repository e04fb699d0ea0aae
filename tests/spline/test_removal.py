"""Knot removal: certified, best possible for one knot, and the inverse of insertion."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bvbedit.spline.knots import clamped
from bvbedit.spline.refinement import insertion
from bvbedit.spline.tensor import TensorSpline
from tests.spline import naive
from tests.spline.drawn import EPS, change, largest, splines, with_axis
from tests.spline.refusals import refusal


def _curve(rng: np.random.Generator, degree: int, size: int, channels: int = 2) -> TensorSpline:
    return TensorSpline((degree,), (naive.random_knots(rng, degree, size),), rng.uniform(-1, 1, (size, channels)))


def _dense(spline: TensorSpline, count: int = 400) -> np.ndarray:
    """Parameters of a curve: many, and just beside every knot."""
    t = spline.knots[0]
    x = np.concatenate([np.linspace(0, 1, count), t, np.nextafter(t, 0), np.nextafter(t, 1)])
    return np.unique(x[(x >= 0) & (x <= 1)])[:, None]


@pytest.mark.parametrize("degree", [0, 1, 2, 3, 5, 8])
def test_removal_after_insertion_returns_the_net(degree, rng):
    spline = _curve(rng, degree, degree + 9)
    new = np.sort(rng.uniform(0.01, 0.99, 15))
    back, bound = spline.insert_knots(0, new).remove_knots(0, 1e-10)
    np.testing.assert_array_equal(back.knots[0], spline.knots[0])
    np.testing.assert_allclose(back.control, spline.control, rtol=0, atol=1e-13)
    assert bound < 1e-14


@given(st.integers(0, 5), st.integers(0, 2**32 - 1), st.floats(0.0, 1.5))
def test_no_value_changes_by_more_than_the_bound_and_the_bound_is_within_the_tolerance(degree, seed, tolerance):
    spline = _curve(np.random.default_rng(seed), degree, degree + 8)
    less, bound = spline.remove_knots(0, tolerance)
    x = _dense(spline)
    assert np.abs(less.evaluate(x) - spline.evaluate(x)).max() <= bound * (1 + 1e-12)
    assert bound <= tolerance
    if degree > 0:
        np.testing.assert_array_equal(less.control[[0, -1]], spline.control[[0, -1]])


def test_more_tolerance_never_keeps_more_knots(rng):
    spline = _curve(rng, 3, 40)
    sizes = [spline.remove_knots(0, tolerance)[0].size[0] for tolerance in np.geomspace(1e-3, 3, 25)]
    assert sizes == sorted(sizes, reverse=True)
    assert sizes[0] > sizes[-1]
    assert sizes[-1] == 4


@pytest.mark.parametrize("degree", [1, 2, 3, 4])
@pytest.mark.parametrize("copies", [1, 2])
def test_one_knot_goes_at_the_least_cost_that_is_possible(degree, copies, rng):
    # Q is what stands, A what a net without the knot would give. In the maximum norm the least of |A P - Q| is
    # |y . Q| / sum |y|, y being orthogonal to the columns of A (duality).
    t = clamped([0.2, *[0.45] * min(copies, degree), 0.7], degree)
    spline = TensorSpline((degree,), (t,), rng.normal(size=(len(t) - degree - 1, 1)))
    less, bound = spline.remove_knot(0, 0.45, held=(0, 0))
    matrix = insertion(less.knots[0], degree, t).dense()
    y = np.linalg.svd(matrix.T)[2][-1]
    np.testing.assert_allclose(y @ matrix, 0, atol=1e-14)
    best = abs(y @ spline.control[:, 0]) / np.abs(y).sum()
    assert bound == pytest.approx(best, rel=1e-12)
    np.testing.assert_allclose(np.abs(matrix @ less.control - spline.control).max(), bound, rtol=1e-12)


def test_the_cubic_of_the_nurbs_book_with_a_triple_knot():
    # Section 5.4: U = {0, 0, 0, 0, 1, 1, 1, 2, 2, 2, 2}, u = 1. It can go once where P3 = (P2 + P4)/2, since
    # alpha = (1 - 0)/(2 - 0); then again where P2 = (P1 + P1')/2 and so on: control points of a single cubic.
    p = [[Fraction(v) for v in row] for row in ((0, 0), (1, 2), (3, 3), (6, 1))]
    half = Fraction(1, 2)

    def between(a, b):
        return [half * x + half * y for x, y in zip(a, b, strict=True)]

    q1, m, q2 = between(p[0], p[1]), between(p[1], p[2]), between(p[2], p[3])
    r1, r2 = between(q1, m), between(m, q2)
    pieces = [p[0], q1, r1, between(r1, r2), r2, q2, p[3]]
    t = [0, 0, 0, 0, 1, 1, 1, 2, 2, 2, 2]
    spline = TensorSpline((3,), (t,), np.array([[float(v) for v in row] for row in pieces]))
    once = np.array([[float(v) for v in row] for row in (p[0], q1, r1, r2, q2, p[3])])
    twice = np.array([[float(v) for v in row] for row in (p[0], q1, m, q2, p[3])])
    whole = np.array([[float(v) for v in row] for row in p])
    for times, expected in ((1, once), (2, twice), (3, whole)):
        less, bound = spline.remove_knot(0, 1.0, times)
        np.testing.assert_allclose(less.control, expected, rtol=0, atol=1e-14)
        assert bound < 1e-14
    # Off the line by d, the middle point costs d/2: half goes to it, a quarter to each neighbour's equation.
    moved = np.array(spline.control)
    moved[3, 0] += 0.5
    less, bound = spline.with_control(moved).remove_knot(0, 1.0)
    # y = (1, -2, 1) on P2, P3, P4: |y . Q| / sum |y| = 2 * 0.5 / 4.
    assert bound == pytest.approx(0.25, rel=1e-12)


@pytest.mark.parametrize("axis", range(3))
def test_every_axis_of_a_volume_is_treated_alike(axis, rng):
    size, degrees = (7, 8, 9), (2, 3, 1)
    knots = [naive.random_knots(rng, p, n) for p, n in zip(degrees, size, strict=True)]
    volume = TensorSpline(degrees, knots, rng.uniform(size=(*size, 3)))
    # Each line of the volume is a channel of a curve.
    lines = np.moveaxis(volume.control, axis, 0).reshape(size[axis], -1)
    curve, expected = TensorSpline((degrees[axis],), (knots[axis],), lines).remove_knots(0, 0.3)
    less, bound = volume.remove_knots(axis, 0.3)
    assert bound == expected
    np.testing.assert_array_equal(less.knots[axis], curve.knots[0])
    np.testing.assert_array_equal(np.moveaxis(less.control, axis, 0).reshape(less.size[axis], -1), curve.control)


def test_held_control_points_do_not_take_part(rng):
    spline = _curve(rng, 3, 20)
    less, bound = spline.remove_knots(0, 0.8, held=(3, 2))
    assert less.size[0] < 20
    difference = insertion(less.knots[0], 3, spline.knots[0]).apply(less.control, 0) - spline.control
    np.testing.assert_allclose(difference[:3], 0, atol=1e-15)
    np.testing.assert_allclose(difference[-2:], 0, atol=1e-15)
    assert np.abs(difference).max() == pytest.approx(bound)


def test_ones_stay_ones_and_every_knot_of_theirs_goes(rng):
    spline = _curve(rng, 4, 30).with_control(np.ones((30, 1)))
    less, bound = spline.remove_knots(0, 1e-12)
    assert less.size == (5,)
    np.testing.assert_allclose(less.control, 1, rtol=0, atol=1e-14)
    assert bound < 1e-14


def test_what_cannot_be_removed_is_refused(rng):
    spline = TensorSpline((3,), (clamped([0.5], 3),), rng.normal(size=(5, 1)))
    for call, word in (
        (lambda: spline.remove_knots(0, -1e-3), "-0.001"),
        (lambda: spline.remove_knots(0, np.nan), "nan"),
        (lambda: spline.remove_knots(0, "all"), "'all'"),
        (lambda: spline.remove_knots(2, 0.1), "Axis 2"),
        (lambda: spline.remove_knots(0, 0.1, held=(3, 3)), "(3, 3)"),
        (lambda: spline.remove_knots(0, 0.1, held=(-1, 0)), "(-1, 0)"),
        (lambda: spline.remove_knot(0, 0.4), "0.4"),
        (lambda: spline.remove_knot(0, 0.5, 2), "2 times"),
        (lambda: spline.remove_knot(0, 0.0), "0.0"),
        (lambda: spline.remove_knot(0, np.nan), "nan"),
        (lambda: spline.remove_knot(0, 0.5, held=(3, 2)), "held"),
    ):
        message = refusal(call)
        assert word in message or "hold" in message.lower(), message


@pytest.mark.parametrize("degree", range(6))
def test_rounding_never_takes_the_bound_beyond_the_tolerance(degree, rng):
    """Constants cost nothing to within rounding, and a bound is a tolerance that is just met."""
    for _ in range(30):
        spline = _curve(rng, degree, degree + 6, 1)
        constant = spline.with_control(np.full_like(spline.control, rng.uniform()))
        assert constant.remove_knots(0, 0.0)[1] == 0.0
        _, cost = spline.remove_knot(0, float(spline.knots[0][degree + 3]))
        for tolerance in (cost, np.nextafter(cost, 0), 1e-17):
            assert spline.remove_knots(0, tolerance)[1] <= tolerance


@settings(max_examples=50)
@given(with_axis(splines(tame=True)), st.floats(0, 3), st.data())
def test_any_axis_is_thinned_within_the_bound_with_its_ends_held(drawn, tolerance, data):
    spline, axis = drawn
    p = spline.degrees[axis]
    held = tuple(data.draw(st.integers(0, min(p + 1, 3))) for _ in range(2))
    if sum(held) > spline.size[axis]:
        held = (1, 0)
    less, bound = spline.remove_knots(axis, tolerance, held=held)
    scale = largest(spline) + largest(less)
    assert bound <= tolerance
    assert change(spline, less) <= bound + 64 * EPS * scale
    rows = insertion(less.knots[axis], p, spline.knots[axis]).apply(less.control, axis)
    off = np.abs(np.moveaxis(rows - spline.control, axis, 0))
    assert (off[: held[0]] <= 64 * EPS * scale).all()
    assert (off[len(off) - held[1] :] <= 64 * EPS * scale).all()
    more, _ = spline.remove_knots(axis, 2 * tolerance, held=held)
    assert more.size[axis] <= less.size[axis]


def test_one_step_is_no_worse_than_a_linear_programme(rng):
    """Every other net without the knot is further away: the optimum's signs alternate as often as they must."""
    spline = _curve(rng, 3, 8, 1)
    value = float(spline.knots[0][6])
    less, bound = spline.remove_knot(0, value, held=(0, 0))
    matrix = insertion(less.knots[0], 3, spline.knots[0]).dense()
    off = (matrix @ less.control - spline.control)[:, 0]
    reached = np.flatnonzero(np.abs(off) > bound * (1 - 1e-9))
    # Kolmogorov: no change of the net lowers the error wherever it is largest.
    y = np.linalg.svd(matrix.T)[2][-1]
    support = np.flatnonzero(np.abs(y) > 1e-12)
    assert set(support) <= set(reached)
    assert abs(np.sign(y[support]) @ np.sign(off[support])) == len(support)
