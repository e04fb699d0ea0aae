"""Banded matrices along one axis, against dense ones."""

import numpy as np
import pytest

from bvbedit.spline import kernels
from bvbedit.spline.banded import Banded


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
