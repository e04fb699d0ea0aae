"""The distance of two BRDFs: against sums written out one pair at a time, and by closed forms."""

import itertools
import math

import numpy as np
import pytest

from bvbedit.brdf.analytic import GGX, Lambert, Schlick
from bvbedit.brdf.base import Brdf
from bvbedit.brdf.charts import RUSINKIEWICZ
from bvbedit.brdf.geometry import spherical
from bvbedit.brdf.goniophotometer import measure
from bvbedit.brdf.measured import MeasuredBrdf
from bvbedit.brdf.metrics import Errors, compare

GLOSS = GGX(0.3, Schlick((0.2, 0.5, 0.9)))
GREY = Lambert((0.2, 0.3, 0.4))
STRIDE = 15


def _errors(pairs: list[tuple[np.ndarray, np.ndarray]], a: Brdf, b: Brdf) -> Errors:
    """The definitions, one pair and channel at a time."""
    squares, roots, difference, length = [], [], 0.0, 0.0
    for wi, wo in pairs:
        fa, fb = a.evaluate(wi, wo).tolist(), b.evaluate(wi, wo).tolist()
        for x, y in zip(fa, fb, strict=True):
            c = wi[2] * wo[2]
            squares.append((math.log(1 + x * c) - math.log(1 + y * c)) ** 2)
            roots.append(math.cbrt(((x - y) * wi[2]) ** 2))
        difference += math.dist(fa, fb)
        length += math.hypot(*fb)
    means = (math.sqrt(sum(v) / len(v)) for v in (squares, roots))
    return Errors(*means, difference / length, len(pairs))


def _agree(ours: Errors, expected: Errors) -> None:
    assert ours.samples == expected.samples
    for name in ("log_cosine_rms", "fores", "relative_l1"):
        assert getattr(ours, name) == pytest.approx(getattr(expected, name), rel=1e-9), name


def test_grid_is_the_papers_up_to_80_degrees():
    theta, phi = np.radians(np.arange(0, 80.5, STRIDE)), np.radians(np.arange(0, 180.5, STRIDE / 2))
    pairs = [(spherical(i, 0.0), spherical(o, p)) for i, o, p in itertools.product(theta, theta, phi)]
    _agree(compare(GLOSS, GREY, stride=STRIDE).grid, _errors(pairs, GLOSS, GREY))


def _nodes(steps_of_phi_d: int, valid: np.ndarray | None = None) -> list[tuple[np.ndarray, np.ndarray]]:
    """MERL's nodes with both elevations under 80 degrees, of which every STRIDE-th of each axis takes part."""
    pairs = []
    for i, j, k in itertools.product(range(0, 90, STRIDE), range(0, 90, STRIDE), range(0, 180, steps_of_phi_d)):
        w = [v[0] for v in RUSINKIEWICZ.to_directions(np.array([[i / 90, j / 90, k / 180]]))]
        if min(w[0][2], w[1][2]) > math.cos(math.radians(80)) and (valid is None or valid[i, j, k]):
            pairs.append((w[0], w[1]))
    return pairs


def test_nodes_are_merls_with_phi_d_every_two_degrees():
    _agree(compare(GLOSS, GREY, stride=STRIDE).nodes, _errors(_nodes(2 * STRIDE), GLOSS, GREY))


def test_nodes_of_a_table_are_its_valid_ones():
    exact = measure(GREY)
    valid = exact.valid.copy()
    valid[15:40, :, 30] = False
    table = MeasuredBrdf(exact.values, valid, exact.axes, exact.chart)
    pairs = _nodes(STRIDE, valid)
    assert len(pairs) < len(_nodes(STRIDE))
    _agree(compare(GLOSS, table, stride=STRIDE).nodes, _errors(pairs, GLOSS, table))


class Spiked(Brdf):
    """Grey but for a spike beyond every cap where both directions graze."""

    def _evaluate(self, wi, wo):
        f = GREY.evaluate_unit(wi, wo)[0]
        f[np.maximum(wi[:, 2], wo[:, 2]) < 0.01] = 1e9
        return f, np.ones(len(f), bool)


def test_the_papers_errors_are_those_of_equation_7():
    theta = np.radians(np.arange(0, 90.5, STRIDE))
    theta[-1] = math.pi / 2 - 1e-4
    phi = np.radians(np.arange(0, 180.5, STRIDE / 2))
    wi, wo = spherical(theta, 0.0)[:, None, None], spherical(theta[:, None], phi)
    for other in (GLOSS, Spiked()):
        apart = np.linalg.norm(
            np.minimum(other.evaluate(wi, wo), 1e5) - np.minimum(GREY.evaluate(wi, wo), 1e5), axis=-1
        )
        paper = compare(other, GREY, stride=STRIDE).paper
        at_45 = apart[3]
        expected = (apart.max(), apart.mean(), at_45.max(), at_45.mean())
        assert (paper.e_max, paper.e_avg, paper.e_max_45, paper.e_avg_45) == pytest.approx(expected, rel=1e-12)
    assert paper.e_max == pytest.approx(1e5 * math.sqrt(3), rel=1e-3)


@pytest.mark.parametrize("stride", [5, 45])
def test_lambert_against_lambert_in_closed_form(stride):
    result = compare(Lambert(0.6), Lambert(0.2), stride=stride)
    distance = 0.4 / math.pi * math.sqrt(3)
    assert [result.grid.relative_l1, result.nodes.relative_l1] == pytest.approx([2.0, 2.0])
    assert list(result.to_dict()["paper"].values()) == pytest.approx([distance] * 4)


def test_equal_brdfs_are_at_no_distance_and_black_is_infinitely_far_in_relative_terms():
    same = compare(GLOSS, GLOSS, stride=STRIDE).to_dict()
    assert all(v == 0 for part in same.values() for name, v in part.items() if name != "samples")
    black = Lambert(0.0)
    assert compare(GREY, black, stride=STRIDE).grid.relative_l1 == math.inf
    assert compare(black, black, stride=STRIDE).grid.relative_l1 == 0


def test_progress_rises_to_one():
    shares: list[float] = []
    compare(GREY, GREY, stride=STRIDE, progress=shares.append)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
