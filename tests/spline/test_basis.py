"""Basis functions and their derivatives: against the definition in exact arithmetic, and by their identities."""

import math

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bvbedit.spline.basis import basis_derivatives, basis_values, collocation, find_spans
from bvbedit.spline.knots import clamped
from tests.spline import naive

EPS = np.finfo(float).eps

degrees_and_knots = st.integers(0, 16).flatmap(lambda p: st.tuples(st.just(p), naive.knot_vectors(p, most=4)))


def _row(first: int, values: np.ndarray, size: int) -> np.ndarray:
    out = np.zeros(size)
    out[first : first + len(values)] = values
    return out


@given(degrees_and_knots)
def test_spans_hold_their_points(case):
    p, t = case
    x = naive.telling_points(t)
    s = find_spans(t, p, x)
    assert ((t[s] <= x) & (x <= t[s + 1]) & (t[s] < t[s + 1])).all()
    assert ((x < t[s + 1]) | (x == t[-1])).all()


@settings(max_examples=60)
@given(degrees_and_knots)
def test_every_value_has_full_relative_precision(case):
    """The triangular recursion adds and multiplies positive numbers only: each step costs a few roundings, no more."""
    p, t = case
    x = naive.telling_points(t)[:: 1 + p // 4]
    first, values = basis_values(t, p, x)
    with naive.digits():
        for k in range(len(x)):
            exact = naive.exact(naive.basis(t, p, x[k], mpmath.mpf))
            ours = _row(first[k], values[k], len(exact))
            np.testing.assert_allclose(ours, exact, rtol=4 * (p + 1) * EPS, atol=1e-250)


@given(degrees_and_knots)
def test_values_are_not_negative_and_sum_to_one(case):
    p, t = case
    _, values = basis_values(t, p, naive.telling_points(t))
    assert (values >= 0).all()
    np.testing.assert_allclose(values.sum(axis=1), 1.0, rtol=0, atol=4 * (p + 1) * EPS)


@settings(max_examples=35)
@given(degrees_and_knots, st.integers(1, 4))
def test_derivatives_agree_with_exact_arithmetic(case, order):
    """Up to rounding of the terms that cancel, whose sum of magnitudes is computed alongside."""
    p, t = case
    x = naive.telling_points(t)[:: 2 + p // 4]
    first, values = basis_derivatives(t, p, x, order)
    with naive.digits():
        for k in range(len(x)):
            exact = naive.exact(naive.derivatives(t, p, x[k], order, mpmath.mpf))
            scale = naive.exact(naive.derivatives(t, p, x[k], order, mpmath.mpf, magnitude=True))
            error = np.abs(_row(first[k], values[k], len(exact)) - exact)
            assert (error <= 8 * (p + 1) * EPS * scale + 1e-250).all()


@pytest.mark.parametrize("degree", [1, 2, 3, 5, 8, 16])
def test_derivatives_are_limits_of_difference_quotients(degree, rng):
    """mpmath differentiates the values numerically, so that the formula for derivatives plays no part."""
    t = naive.random_knots(rng, degree, degree + 4)
    inner = np.unique(t)
    x = 0.5 * (inner[0] + inner[1])
    for order in range(1, min(degree, 3) + 1):
        first, values = basis_derivatives(t, degree, np.array([x]), order)
        ours = _row(first[0], values[0], len(t) - degree - 1)
        with naive.digits(60):
            for i in range(len(ours)):
                limit = mpmath.diff(lambda u, i=i: naive.basis(t, degree, u, mpmath.mpf)[i], mpmath.mpf(x), order)
                assert ours[i] == pytest.approx(float(limit), rel=1e-9, abs=1e-9 * np.abs(ours).max())


@given(degrees_and_knots, st.integers(1, 17))
def test_derivatives_sum_to_zero_and_end_past_the_degree(case, order):
    p, t = case
    x = 0.5 * (np.unique(t)[1:] + np.unique(t)[:-1])
    _, values = basis_derivatives(t, p, x, order)
    if order > p:
        assert (values == 0).all()
    else:
        scale = np.abs(values).sum(axis=1) + 1e-300
        assert (np.abs(values.sum(axis=1)) <= 1e-12 * scale).all()


def test_full_multiplicity_takes_the_functions_of_the_right_side():
    t = clamped([0.5, 0.5, 0.5], 2)
    first, values = basis_values(t, 2, np.array([np.nextafter(0.5, 0), 0.5]))
    assert first.tolist() == [0, 3]
    np.testing.assert_allclose(values, [[0, 0, 1], [1, 0, 0]], rtol=0, atol=1e-15)


def test_collocation_is_the_dense_matrix_of_the_definition(rng):
    t = naive.random_knots(rng, 3, 9)
    x = rng.permutation(np.append(np.linspace(0, 1, 23), 0.5))
    for order in range(5):
        matrix = collocation(t, 3, x, order)
        assert matrix.columns == 9
        expected = naive.matrix(t, 3, x, order)
        scale = 1e-13 * math.factorial(order) * max(1.0, np.abs(expected).max())
        np.testing.assert_allclose(matrix.dense(), expected, rtol=0, atol=scale)
