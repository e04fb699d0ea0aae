"""The sets over which errors are counted: pairs that belong to them, evenly drawn, as dense as is said."""

import functools

import numpy as np
import pytest

from bvbedit.brdf.analytic import Lambert
from bvbedit.brdf.base import Brdf
from bvbedit.brdf.charts import HALF_DIFF, IN_OUT, RUSINKIEWICZ, RUSINKIEWICZ_360, Chart, grid_points
from bvbedit.brdf.geometry import elevation
from bvbedit.brdf.measured import MeasuredBrdf
from bvbedit.brdf.sample_sets import Pairs, densities, draw, node_blocks

GREY = Lambert(0.5)
SEEDS = range(3)


def _table(chart: Chart, shape: tuple[int, int, int], valid: float = 1.0) -> MeasuredBrdf:
    """A grey table with even nodes, of which a share is valid at random."""
    axes = tuple(np.arange(n) / n for n in shape)
    mask = np.random.default_rng(7).uniform(size=shape) < valid
    return MeasuredBrdf(np.full((*shape, 3), 0.5), mask, axes, chart)


HOLED = _table(RUSINKIEWICZ, (30, 30, 60), valid=0.7)
each_brdf = pytest.mark.parametrize("brdf", [GREY, HOLED], ids=["analytic", "table"])


def _part(pairs: Pairs, which: int) -> tuple[np.ndarray, np.ndarray]:
    part = pairs.parts()[which]
    return pairs.wi[part], pairs.wo[part]


def _whole(x: np.ndarray) -> np.ndarray:
    """Return ``x`` rounded, after it was found to be whole numbers."""
    np.testing.assert_allclose(x, np.rint(x), rtol=0, atol=1e-6)
    return np.rint(x).astype(int)


@each_brdf
@pytest.mark.parametrize("seed", SEEDS)
def test_pairs_are_unit_vectors_below_80_degrees(brdf, seed):
    pairs = draw(brdf, 2000, seed)
    assert len(pairs.wi) == len(pairs.wo) == sum(pairs.counts)
    for w in (pairs.wi, pairs.wo):
        np.testing.assert_allclose(np.linalg.norm(w, axis=1), 1.0, rtol=0, atol=1e-12)
        assert elevation(w).max() <= np.radians(80) + 1e-9


@each_brdf
def test_pairs_of_the_grid_are_nodes_of_the_papers(brdf):
    wi, wo = _part(draw(brdf, 2000), 0)
    assert len(wi) == 2000
    i, j = (_whole(np.degrees(elevation(w))) for w in (wi, wo))
    phi = np.degrees(np.arctan2(wi[:, 0] * wo[:, 1] - wi[:, 1] * wo[:, 0], (wi[:, :2] * wo[:, :2]).sum(axis=1)))
    apart = (i > 0) & (j > 0)
    _whole(2 * np.abs(phi[apart]))
    # One side of the mirror plane only, the azimuth in 0 ... 180 degrees.
    assert phi[apart].min() >= -1e-9
    assert (i.min(), i.max(), j.min(), j.max()) == (0, 80, 0, 80)


def test_pairs_of_the_nodes_are_merls_with_phi_d_every_two_degrees():
    wi, wo = _part(draw(GREY, 2000), 1)
    u, v, w = RUSINKIEWICZ.to_parameters(wi, wo).T
    # theta_h = 90 u^2 degrees, and MERL's nodes are i^2 / 90.
    i, j = _whole(90 * u), _whole(90 * v)
    _whole(90 * w[(i > 0) & (j > 0)])
    assert i.max() < 90
    assert j.max() < 90


def test_pairs_of_the_nodes_of_a_table_are_its_own_and_valid():
    wi, wo = _part(draw(HOLED, 4000), 1)
    i, j, k = (_whole(n * p) for n, p in zip((30, 30, 60), RUSINKIEWICZ.to_parameters(wi, wo).T, strict=True))
    # At the poles all azimuths are one pair, whose own azimuth is taken to be zero.
    inside = (i > 0) & (j > 0)
    assert inside.mean() > 0.9
    assert HOLED.valid[i[inside], j[inside], k[inside] % 60].all()


def test_a_table_with_phi_d_all_around_is_drawn_all_around():
    table = _table(RUSINKIEWICZ_360, (12, 12, 48))
    wi, wo = _part(draw(table, 6000), 1)
    u, v, w = RUSINKIEWICZ_360.to_parameters(wi, wo).T
    inside = (u > 1e-6) & (v > 1e-6)
    counts = np.histogram(w[inside], 4, (0, 1))[0]
    assert counts.min() > 500
    np.testing.assert_allclose(counts, counts.mean(), rtol=0.1)


@each_brdf
def test_seeds_choose_the_pairs(brdf):
    first, again, other = (draw(brdf, 500, seed) for seed in (5, 5, 6))
    np.testing.assert_array_equal(first.wi, again.wi)
    np.testing.assert_array_equal(first.wo, again.wo)
    assert first.counts == again.counts
    assert not np.array_equal(first.wi[:500], other.wi[:500])


@pytest.mark.parametrize("seed", SEEDS)
def test_the_grid_is_drawn_one_from_each_stretch(seed):
    """81 x 81 x 361 nodes in order, 500 stretches: the k-th pair is from the k-th of them."""
    wi, wo = _part(draw(GREY, 500, seed), 0)
    u, v, w = IN_OUT.to_parameters(wi, wo).T
    i, j, k = _whole(90 * u), _whole(90 * v), _whole(360 * w)
    lost = (i == 0) | (j == 0)  # the azimuth means nothing there
    place = ((81 * i + j) * 361 + k) / (81 * 81 * 361 / 500)
    assert (np.abs(place - np.arange(500) - 0.5) <= 0.5 + 1e-9)[~lost].all()


def test_as_many_pairs_as_a_set_has_are_the_set():
    """A table of 6 x 5 x 8 nodes, and its valid nodes below 80 degrees as ``node_blocks`` lists them."""
    table = _table(RUSINKIEWICZ, (6, 5, 8), valid=0.6)
    wi, wo = _part(draw(table, 240), 1)
    blocks = list(node_blocks(table, 1))
    np.testing.assert_array_equal(wi, np.concatenate([b[0] for b in blocks]))
    np.testing.assert_array_equal(wo, np.concatenate([b[1] for b in blocks]))


def test_a_table_with_valid_nodes_beyond_80_degrees_alone_has_an_empty_set():
    shape = (20, 20, 20)
    valid = np.zeros(shape, bool)
    valid[19] = True  # theta_h = 81 degrees: one of the directions is lower still
    table = MeasuredBrdf(np.ones((*shape, 3)), valid, tuple(np.arange(n) / n for n in shape), RUSINKIEWICZ)
    pairs = draw(table, 300)
    assert pairs.counts == (300, 0)
    assert pairs.parts()[1] == slice(300, 300)


@functools.cache
def _spread(which: int) -> tuple[np.ndarray, np.ndarray]:
    """Return pairs of a set, each moved evenly within its own cell: rows of nodes on edges would tell nothing."""
    rng = np.random.default_rng(which)
    chart, steps = ((IN_OUT, (90, 90, 360)), (RUSINKIEWICZ, (90, 90, 90)))[which]
    p = chart.to_parameters(*_part(draw(GREY, 400_000), which))
    poles = np.minimum(p[:, 0], p[:, 1]) < 1e-6  # all azimuths are one pair
    p[poles, 2] = rng.uniform(size=np.count_nonzero(poles))
    p = np.abs(p + rng.uniform(-0.5, 0.5, p.shape) / steps)
    w = p[:, 2]
    p[:, 2] = np.minimum(w, 2 - w) if chart is IN_OUT else w % 1.0
    wi, wo = chart.to_directions(p)
    above = np.minimum(wi[:, 2], wo[:, 2]) > 0
    return wi[above], wo[above]


@pytest.mark.parametrize("which", [0, 1], ids=["grid", "nodes"])
@pytest.mark.parametrize(
    ("chart", "cells", "nodes"),
    [(IN_OUT, (9, 9, 6), (10, 10, 30)), (HALF_DIFF, (9, 9, 3), (10, 10, 20))],
    ids=["in-out", "half-diff"],
)
def test_densities_agree_with_a_count_of_the_pairs(chart, cells, nodes, which):
    """In cells of 10 x 10 x 30 degrees, each with so many nodes of a grid like those on which fits are made."""
    last = np.multiply(cells, nodes) - 1
    axes = tuple(np.arange(n + 1) / n for n in last)
    density = densities(chart, axes, 0.5)[which]
    told = density.reshape([n for pair in zip(cells, nodes, strict=True) for n in pair]).sum(axis=(1, 3, 5))
    edges = [np.array([0, *(np.arange(1, c) * k - 0.5) / n, 1]) for c, k, n in zip(cells, nodes, last, strict=True)]
    counted = np.histogramdd(chart.to_parameters(*_spread(which)), edges)[0]
    u, v, w = np.indices(cells)
    if chart is IN_OUT:
        # MERL's nodes crowd without bound at the mirror direction, and at the light itself.
        tame = (which == 0) | (u != v) | ((w > 0) & (w < cells[2] - 1))
    else:
        tame = v > 0
        # The limit of 80 degrees cuts some cells: their corners tell which.
        for corner in grid_points(((0, 1),) * 3):
            at = (np.stack([u, v, w], axis=-1).reshape(-1, 3) + corner) / cells
            tame &= (np.minimum(*(d[:, 2] for d in chart.to_directions(at))) > np.cos(np.radians(80))).reshape(cells)
    tame &= counted > 1000
    assert counted[tame].sum() > 0.3 * counted.sum()
    quotient = told / told.sum() / np.maximum(counted / counted.sum(), 1e-9)
    np.testing.assert_allclose(quotient[tame], 1.0, rtol=0, atol=0.1)
    assert np.median(quotient[tame]) == pytest.approx(1.0, abs=0.03)
    if chart is IN_OUT:
        mirror = quotient[np.arange(1, 8), np.arange(1, 8), cells[2] - 1]
        np.testing.assert_allclose(mirror, 1.0, rtol=0, atol=0.2)


@pytest.mark.parametrize("chart", [IN_OUT, HALF_DIFF], ids=lambda c: c.name)
def test_densities_have_the_mean_one_and_end_at_80_degrees(chart):
    axes = tuple(np.linspace(0, 1, n) for n in (46, 31, 19))
    both = densities(chart, axes, 0.5)
    assert both.shape == (2, 46, 31, 19)
    assert np.isfinite(both).all()
    assert both.min() >= 0
    np.testing.assert_allclose(both.mean(axis=(1, 2, 3)), 1.0, rtol=1e-12)
    wi, wo = chart.to_directions(grid_points(axes))
    # A node's cell reaches two degrees further at most.
    beyond = (np.minimum(wi[:, 2], wo[:, 2]) < np.cos(np.radians(84))).reshape(both.shape[1:])
    assert beyond.any()
    assert both[:, beyond].max() == 0
    inside = (np.minimum(wi[:, 2], wo[:, 2]) > np.cos(np.radians(79))).reshape(both.shape[1:])
    assert both[:, inside].min() > 0


def test_the_grid_is_even_on_its_own_chart():
    density = densities(IN_OUT, tuple(np.linspace(0, 1, n) for n in (46, 46, 13)), 0.5)[0]
    assert np.unique(density[density > 0]).size == 1


class _Nowhere(Brdf):
    def _evaluate(self, wi, wo):  # noqa: ARG002
        raise AssertionError("drawing looks nothing up")


def test_drawing_looks_nothing_up():
    assert sum(draw(_Nowhere(), 50).counts) > 50
