"""Degree reduction: what elevation added goes, the rest is the nearest there is, and the bound is one."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bvbedit.spline.knots import clamped
from bvbedit.spline.refinement import elevation, insertion
from bvbedit.spline.tensor import TensorSpline
from tests.spline.drawn import EPS, assert_ones, change, largest, ones, random_spline, splines, with_axis
from tests.spline.refusals import refusal

TAME = with_axis(splines(tame=True))


@settings(max_examples=60)
@given(TAME, st.integers(1, 3))
def test_what_elevation_added_goes_without_loss(drawn, by):
    spline, axis = drawn
    by = min(by, 16 - spline.degrees[axis])
    back, bound = spline.elevate(axis, by).reduce(axis, by)
    assert back.degrees == spline.degrees
    np.testing.assert_array_equal(back.knots[axis], spline.knots[axis])
    scale = largest(spline)
    assert bound <= 256 * EPS * scale
    # Elevation makes control points alike: their differences lose about as many digits as there are degrees.
    np.testing.assert_allclose(
        back.control, spline.control, rtol=0, atol=2.0 ** spline.degrees[axis] * 256 * EPS * scale
    )
    assert_ones(ones(spline).elevate(axis, by).reduce(axis, by)[0], 2.0 ** spline.degrees[axis] * 64)


@settings(max_examples=60)
@given(TAME, st.data())
def test_no_value_changes_by_more_than_the_bound_and_ends_stay(drawn, data):
    spline, axis = drawn
    p = spline.degrees[axis]
    by = data.draw(st.integers(0, min(p, 3)))
    low, bound = spline.reduce(axis, by)
    slack = 64 * EPS * largest(spline)
    assert low.degrees[axis] == p - by
    assert low.domain == spline.domain
    assert change(spline, low) <= bound + slack
    if p > by:
        for end in (0, -1):
            np.testing.assert_array_equal(low.control.take(end, axis), spline.control.take(end, axis))
    if by == 0:
        assert bound <= slack
    again, same = spline.reduce(axis, by, tolerance=bound)
    np.testing.assert_array_equal(again.control, low.control)
    assert same == bound
    if bound > 0:
        assert f"Axis {axis}" in refusal(lambda: spline.reduce(axis, by, tolerance=bound * 0.999))


@pytest.mark.parametrize("held", [(0, 0), (1, 1), (2, 1), (3, 3), (0, 4)])
def test_held_values_and_derivatives_at_the_ends_stay(held, rng):
    spline = random_spline(rng, (4, 2), (9, 4), 2)
    low, _ = spline.reduce(0, held=held)
    for end, count in ((0.0, held[0]), (1.0, held[1])):
        points = np.array([[end, v] for v in np.linspace(0, 1, 5)])
        for order in range(count):
            want = spline.evaluate(points, (order, 0))
            scale = np.abs(want).max() * 1e3
            np.testing.assert_allclose(low.evaluate(points, (order, 0)), want, rtol=0, atol=64 * EPS * scale)
    back, bound = spline.elevate(0).reduce(0, held=held)
    assert bound < 1e-13
    np.testing.assert_allclose(back.control, spline.control, rtol=0, atol=1e-12)


@pytest.mark.parametrize("held", [(0, 0), (1, 1), (2, 0)])
@pytest.mark.parametrize("interior", [[], [0.5], [0.3, 0.3, 0.6], [0.2, 0.2, 0.2, 0.2]])
def test_the_change_is_the_least_in_the_sense_of_least_squares(interior, held, rng):
    """Of the control points of the change, over knots that hold both splines, with some at the ends zero."""
    t = clamped(interior, 3)
    spline = TensorSpline((3,), (t,), rng.normal(size=(len(t) - 4, 2)))
    low, bound = spline.reduce(0, held=held)
    raised, up = elevation(low.knots[0], 2, 1)
    common = np.sort(np.concatenate([np.repeat(v, max(np.sum(t == v), np.sum(raised == v))) for v in np.unique(t)]))
    matrix = insertion(raised, 3, common).dense() @ up.dense()
    wanted = insertion(t, 3, common).dense() @ spline.control
    change_of = matrix @ low.control - wanted
    assert bound == pytest.approx(np.abs(change_of).max(), abs=1e-14)
    # Least squares with equations to be met: no admissible direction shrinks the sum any further.
    fixed = np.concatenate([matrix[: held[0]], matrix[len(matrix) - held[1] :]])
    _, s, v = np.linalg.svd(fixed, full_matrices=True) if len(fixed) else (None, np.empty(0), np.eye(matrix.shape[1]))
    free = v[len(s) :].T
    np.testing.assert_allclose((matrix @ free).T @ change_of, 0.0, atol=1e-13)
    np.testing.assert_allclose(change_of[: held[0]], 0.0, atol=1e-14)
    np.testing.assert_allclose(change_of[len(matrix) - held[1] :], 0.0, atol=1e-14)


def test_a_single_cubic_becomes_the_parabola_between_its_ends():
    """x^3 on [0, 1]: Bezier points 0 0 0 1. Of parabolas with ends 0 and 1, b elevates to 0, 2b/3, (1 + 2b)/3, 1."""
    cubic = TensorSpline((3,), (clamped([], 3),), [[0.0], [0.0], [0.0], [1.0]])
    low, bound = cubic.reduce(0)
    # (2b/3)^2 + ((1 + 2b)/3)^2 is least at b = -1/4: changes of -1/6 and 1/6.
    np.testing.assert_allclose(low.control[:, 0], [0.0, -0.25, 1.0], rtol=0, atol=4 * EPS)
    assert bound == pytest.approx(1 / 6, rel=1e-14)


def test_interior_knots_lose_copies_but_never_the_last(rng):
    t = clamped([0.2, 0.4, 0.4, 0.6, 0.6, 0.6, 0.8, 0.8, 0.8, 0.8], 3)
    spline = TensorSpline((3,), (t,), rng.normal(size=(len(t) - 4, 1)))
    for by, interior in (
        (1, [0.2, 0.4, 0.6, 0.6, 0.8, 0.8, 0.8]),
        (2, [0.2, 0.4, 0.6, 0.8, 0.8]),
        (3, [0.2, 0.4, 0.6, 0.8]),
    ):
        assert spline.reduce(0, by)[0].knots[0].tolist() == clamped(interior, 3 - by).tolist()


def test_the_order_of_axes_does_not_matter(rng):
    spline = random_spline(rng, (3, 2, 4), (6, 5, 7), 2)
    turned = spline.control.transpose(2, 0, 1, 3)
    other = TensorSpline((4, 3, 2), [spline.knots[a] for a in (2, 0, 1)], turned)
    for axis, there in ((0, 1), (1, 2), (2, 0)):
        (one, bound), (two, same) = spline.reduce(axis), other.reduce(there)
        np.testing.assert_allclose(two.control, one.control.transpose(2, 0, 1, 3), rtol=0, atol=1e-13)
        assert same == pytest.approx(bound, rel=1e-12)


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda s: s.reduce(0, 4), ["Axis 0", "4", "0 ... 3"]),
        (lambda s: s.reduce(0, -1), ["Axis 0", "-1"]),
        (lambda s: s.reduce(0, 1.0), ["Axis 0", "1.0"]),
        (lambda s: s.reduce(0, True), ["Axis 0", "True"]),
        (lambda s: s.reduce(1), ["Axis 1"]),
        (lambda s: s.reduce(0, 1, -1e-9), ["Axis 0", "-1e-09"]),
        (lambda s: s.reduce(0, 1, np.nan), ["Axis 0", "nan"]),
        (lambda s: s.reduce(0, 1, "a"), ["Axis 0", "'a'"]),
        (lambda s: s.reduce(0, 1, 0.0), ["Axis 0", "by 1"]),
        (lambda s: s.reduce(0, held=(1,)), ["Axis 0"]),
        (lambda s: s.reduce(0, held=(-1, 0)), ["Axis 0", "-1"]),
        (lambda s: s.reduce(0, held=(0.5, 0)), ["Axis 0", "0.5"]),
        (lambda s: s.reduce(0, held=(9, 0)), ["Axis 0", "9"]),
        (lambda s: s.reduce(0, 2, held=(3, 0)), ["Axis 0", "degree 1", "(3, 0)"]),
        (lambda s: s.reduce(0, 3, held=(1, 2)), ["Axis 0", "degree 0", "(1, 2)"]),
    ],
)
def test_what_cannot_be_reduced_is_refused(call, says, rng):
    spline = TensorSpline((3,), (clamped([0.5], 3),), rng.normal(size=(5, 1)))
    message = refusal(lambda: call(spline))
    assert all(word in message for word in says), message
