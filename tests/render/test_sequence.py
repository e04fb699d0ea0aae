"""The random points: nets at every power of two, pairs and pixels independent."""

import numpy as np
import pytest

from bvbedit.render.sequence import mix, point


def points(state, n, pair=0):
    return np.array([point(np.uint64(state), i, pair) for i in range(n)])


@pytest.mark.parametrize("state", [0, 1, 2**64 - 1])
@pytest.mark.parametrize("pair", [0, 2])
def test_each_box_of_each_shape_holds_one_point(state, pair):
    m = 6
    p = points(state, 2**m, pair)
    assert p.min() >= 0
    assert p.max() < 1
    for k in range(m + 1):
        cells = np.floor(p[:, 0] * 2**k) * 2 ** (m - k) + np.floor(p[:, 1] * 2 ** (m - k))
        assert len(np.unique(cells)) == 2**m


def test_pairs_and_neighbouring_pixels_are_not_correlated():
    seed = np.uint64(0)
    n = 256
    columns = np.concatenate(
        [points(mix(seed, np.uint64(pixel)), n, pair) for pixel in range(3) for pair in range(3)], axis=1
    )
    correlation = np.corrcoef(columns.T) - np.eye(columns.shape[1])
    # 1/sqrt(256) is one standard deviation of independent numbers; 153 pairs are looked at.
    assert np.abs(correlation).max() < 4 / np.sqrt(n)


def test_a_constant_slope_is_integrated_far_better_than_by_chance():
    # Random points would err by about 0.29 / sqrt(1024) = 0.009 in the mean of a coordinate.
    error = points(7, 1024).mean(axis=0) - 0.5
    assert np.abs(error).max() < 1e-4
