"""Bounds are never passed, conditions are those of the dense matrix, distances are true."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bvbedit.spline.diagnostics import bounds, conditions, distance, slope_bounds
from bvbedit.spline.knots import clamped, greville
from bvbedit.spline.tensor import TensorSpline
from tests.spline import naive
from tests.spline.drawn import EPS, change, largest, looks, pairs, random_spline, splines, with_axis
from tests.spline.refusals import refusal


@settings(max_examples=50)
@given(with_axis(splines()))
def test_no_value_and_no_slope_passes_its_bounds(drawn):
    spline, axis = drawn
    axes = looks(spline)
    for of, (low, high) in ((spline, bounds(spline)), (spline.derivative(axis), slope_bounds(spline, axis))):
        values = of.evaluate_grid(axes).reshape(-1, spline.channels)
        slack = 64 * EPS * largest(of)
        assert (values >= low - slack).all()
        assert (values <= high + slack).all()
        assert low.shape == high.shape == (spline.channels,)


def test_bounds_are_each_channels_own_and_reached_where_the_spline_is_a_line():
    t = clamped([0.5], 1)
    spline = TensorSpline((1,), (t,), [[1.0, -2.0], [5.0, 0.0], [3.0, 7.0]])
    assert [b.tolist() for b in bounds(spline)] == [[1.0, -2.0], [5.0, 7.0]]
    assert [b.tolist() for b in slope_bounds(spline, 0)] == [[-4.0, 4.0], [8.0, 14.0]]


@pytest.mark.parametrize("p", [0, 1, 2, 3, 5, 8])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_conditions_are_those_of_the_dense_interpolation(p, seed):
    knots = [naive.random_knots(np.random.default_rng(seed + k), p, p + 1 + 3 * k) for k in (1, 2)]
    if p == 1:
        knots = [np.unique(t)[[0, *range(len(np.unique(t))), -1]] for t in knots]
    spline = TensorSpline((p, p), knots, np.zeros((*(len(t) - p - 1 for t in knots), 1)))
    expected = [np.linalg.cond(naive.matrix(t, p, greville(t, p)), np.inf) for t in knots]
    np.testing.assert_allclose(conditions(spline), expected, rtol=1e-9)


def test_across_a_jump_the_condition_is_that_of_the_worse_side(rng):
    t = clamped([0.1, 0.2, 0.5, 0.5, 0.5, 0.5, 0.9], 3)
    spline = TensorSpline((3,), (t,), rng.normal(size=(len(t) - 4, 1)))
    sides = [conditions(part)[0] for part in spline.split(0, 0.5)]
    assert conditions(spline)[0] == pytest.approx(max(sides), rel=1e-12)
    assert min(sides) > 1


def test_conditions_grow_with_the_degree_and_degree_one_is_perfect(rng):
    assert conditions(random_spline(rng, (0,), (5,), 1)) == (1.0,)
    line = TensorSpline((1,), (clamped([0.2, 0.7], 1),), np.zeros((4, 1)))
    assert conditions(line) == (1.0,)
    values = [conditions(TensorSpline((p,), (clamped([], p),), np.zeros((p + 1, 1))))[0] for p in range(1, 17)]
    assert values == sorted(values)


@settings(max_examples=50)
@given(pairs())
def test_a_distance_lies_between_what_is_seen_and_its_bound(pair):
    a, b = pair
    found = distance(a, b)
    slack = 64 * EPS * (largest(a) + largest(b))
    assert found.sampled <= found.bound + slack
    assert change(a, b) <= found.bound + slack
    grid = [np.unique(np.concatenate([s, t])) for s, t in zip(a.knots, b.knots, strict=True)]
    at_knots = np.abs(a.evaluate_grid(grid) - b.evaluate_grid(grid)).max()
    assert found.sampled >= at_knots - slack
    assert distance(a, a) == type(found)(0.0, 0.0)
    back = distance(b, a)
    assert (back.bound, back.sampled) == pytest.approx((found.bound, found.sampled), abs=slack)


@given(splines(tame=True), st.floats(-4, 4))
def test_splines_a_constant_apart_are_that_far_apart(spline, by):
    found = distance(spline, spline.with_control(spline.control + by))
    np.testing.assert_allclose([found.bound, found.sampled], abs(by), rtol=0, atol=64 * EPS * (largest(spline) + 4))


def test_what_cannot_be_compared_is_refused(rng):
    spline = random_spline(rng, (3,), (6,), 2)
    assert "2 and 1 channels" in refusal(lambda: distance(spline, spline.with_control(spline.control[:, :1])))
    assert "Axis 0" in refusal(lambda: distance(spline, spline.split(0, 0.5)[0]))
    assert "parameters" in refusal(lambda: distance(spline, random_spline(rng, (3, 3), (6, 5), 2)))
    for axis in (1, -1, 0.0, True, "0", None):
        assert "Axis" in refusal(lambda axis=axis: slope_bounds(spline, axis))
