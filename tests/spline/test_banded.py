"""Banded matrices along one axis, against dense ones."""

import numpy as np
import pytest

from bvbedit.spline import kernels
from bvbedit.spline.banded import Banded
from tests.spline.refusals import refusal


def _random(rng: np.random.Generator, m: int, columns: int, k: int) -> Banded:
    return Banded(rng.integers(0, columns - k + 1, m), rng.normal(size=(m, k)), columns)


# Bands of 1 to 7: the kernels unroll the first four. Tails beside and across the chunk of 1536 values.
@pytest.mark.parametrize("k", [1, 2, 3, 4, 5, 7])
@pytest.mark.parametrize(
    ("before", "after"),
    [((), ()), ((), (1,)), ((1,), (1,)), ((2, 3), ()), ((4,), (3,)), ((), (1536,)), ((2,), (1537,)), ((), (2, 1600))],
)
def test_apply_and_its_transpose_agree_with_the_dense_matrix(k, before, after, rng):
    matrix = _random(rng, 9, 11, k)
    dense = matrix.dense()
    assert dense.shape == (9, 11)
    axis = len(before)
    x, y = rng.normal(size=(*before, 11, *after)), rng.normal(size=(*before, 9, *after))
    forward = np.moveaxis(np.tensordot(dense, x, axes=(1, axis)), 0, axis)
    backward = np.moveaxis(np.tensordot(dense.T, y, axes=(1, axis)), 0, axis)
    np.testing.assert_allclose(matrix.apply(x, axis), forward, rtol=0, atol=1e-13)
    np.testing.assert_allclose(matrix.apply_transposed(y, axis), backward, rtol=0, atol=1e-13)


def test_views_that_are_not_contiguous_give_the_same_and_are_left_alone(rng):
    matrix = _random(rng, 6, 5, 3)
    x = rng.normal(size=(4, 5, 3)).T
    kept = x.copy()
    np.testing.assert_array_equal(matrix.apply(x, 1), matrix.apply(np.ascontiguousarray(x), 1))
    np.testing.assert_array_equal(x, kept)


@pytest.mark.parametrize("k", [1, 3, 4, 6])
@pytest.mark.parametrize(("columns", "channels"), [(1, 1), (5, 3), (700, 3), (1600, 1)])
def test_weighted_normal_agrees_with_the_dense_product(k, columns, channels, rng):
    matrix = _random(rng, 9, 8, k)
    weights = rng.uniform(size=(9, columns)) * rng.integers(0, 2, (9, columns))
    x = rng.normal(size=(8, columns * channels))
    out = np.full_like(x, np.nan)
    kernels.weighted_normal(matrix.first, matrix.rows, weights, x, out)
    a = matrix.dense()
    expected = a.T @ (np.repeat(weights, channels, axis=1) * (a @ x))
    np.testing.assert_allclose(out, expected, rtol=0, atol=1e-12)


def _ordered(rng: np.random.Generator, m: int, columns: int, k: int) -> Banded:
    """Random rows that begin ever later and reach every column."""
    first = np.sort(np.clip(np.arange(m) * columns // m, 0, columns - k))
    return Banded(first, rng.normal(size=(m, k)), columns)


@pytest.mark.parametrize(("k", "j"), [(1, 1), (1, 4), (4, 1), (3, 5), (7, 2)])
def test_one_matrix_after_another_is_their_product(k, j, rng):
    one, other = _ordered(rng, 20, 11, k), _ordered(rng, 11, 8, j)
    both = one.after(other)
    assert both.columns == 8
    np.testing.assert_allclose(both.dense(), one.dense() @ other.dense(), rtol=0, atol=1e-13)


def test_rows_of_zeros_stay_zeros_in_a_product(rng):
    one = _ordered(rng, 6, 5, 3)
    empty = Banded(one.first, np.zeros_like(one.rows), 5)
    np.testing.assert_array_equal(empty.after(_ordered(rng, 5, 4, 2)).dense(), np.zeros((6, 4)))


@pytest.mark.parametrize("k", [1, 3, 6])
@pytest.mark.parametrize(("low", "high"), [(0, 9), (0, 4), (3, 9), (2, 3), (1, 8)])
def test_columns_between_two_are_those_of_the_dense_matrix(k, low, high, rng):
    matrix = _ordered(rng, 13, 9, k)
    part = matrix.between(low, high)
    assert part.columns == high - low
    np.testing.assert_array_equal(part.dense(), matrix.dense()[:, low:high])


@pytest.mark.parametrize("k", [1, 2, 4])
@pytest.mark.parametrize("m", [8, 30])
@pytest.mark.parametrize("shape", [(), (3,), (2, 3)])
@pytest.mark.parametrize("axis", [0, 1])
def test_solutions_are_those_of_dense_least_squares(k, m, shape, axis, rng):
    matrix = _ordered(rng, m, 8, k)
    matrix.rows[:, 0] += 3.0
    y = rng.normal(size=(m, *shape)) if axis == 0 else rng.normal(size=(4, m, *shape))
    x = matrix.solve(y, axis)
    flat = np.moveaxis(y, axis, 0).reshape(m, -1)
    expected = np.linalg.lstsq(matrix.dense(), flat, rcond=None)[0]
    np.testing.assert_allclose(np.moveaxis(x, axis, 0).reshape(8, -1), expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("scale", [1e-150, 1.0, 1e150])
def test_dependent_columns_are_refused_whatever_their_size(scale, rng):
    matrix = _ordered(rng, 12, 6, 2)
    sound = Banded(matrix.first, scale * (matrix.rows + np.array([3.0, 0.0])), 6)
    assert np.isfinite(sound.solve(rng.normal(size=12), 0)).all()
    rows = sound.rows.copy()
    rows[matrix.first == 2, 0] = 0.0
    rows[matrix.first == 1, 1] = 0.0
    lame = Banded(matrix.first, rows, 6)
    assert not lame.dense()[:, 2].any()
    assert "control point 2 of 6" in refusal(lambda: lame.solve(rng.normal(size=12), 0))
