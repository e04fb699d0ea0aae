"""Regions: pairs of directions whose angles lie in intervals, the same in every chart, with a soft edge."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bvbedit.brdf.charts import HALF_DIFF, IN_OUT
from bvbedit.edit.region import Region
from tests.brdf.samples import random_pairs
from tests.edit.samples import CHARTS, smooth
from tests.spline.refusals import refusal

LIMITS = {"theta_h": 90, "theta_d": 90, "phi_d": 90, "theta_i": 90, "theta_o": 90, "phi": 180}


def naive_angles(wi, wo):
    """The six angles in degrees, by arccos and the book."""
    h = (wi + wo) / np.linalg.norm(wi + wo, axis=1, keepdims=True)
    theta = [np.degrees(np.arccos(np.clip(w[:, 2], -1, 1))) for w in (wi, wo, h)]
    phi = np.degrees(np.arccos(np.clip(np.cos(np.subtract(*[np.arctan2(w[:, 1], w[:, 0]) for w in (wi, wo)])), -1, 1)))
    theta_d = np.degrees(np.arccos(np.clip((wi * h).sum(axis=1), -1, 1)))
    # d has its azimuth from the plane of h and the normal.
    out = np.cross(h, [0, 0, 1])
    x = np.cross(out, h)
    c = np.abs((wi * x).sum(axis=1)), np.abs((wi * out).sum(axis=1))
    phi_d = np.degrees(np.arctan2(c[1], c[0]))
    return {
        "theta_h": theta[2],
        "theta_d": theta_d,
        "phi_d": phi_d,
        "theta_i": theta[0],
        "theta_o": theta[1],
        "phi": phi,
    }


@st.composite
def regions(draw, least=0.5):
    names = draw(st.lists(st.sampled_from(list(LIMITS)), min_size=1, max_size=3, unique=True))
    given_ = {}
    for name in names:
        a, b = sorted(draw(st.tuples(st.floats(0, LIMITS[name]), st.floats(0, LIMITS[name]))))
        given_[name] = (a, b)
    return Region(**given_, falloff=draw(st.floats(least, 40)))


def share(angles, interval, falloff):
    away = np.maximum(np.maximum(interval[0] - angles, angles - interval[1]), 0)
    x = np.clip(1 - away / falloff, 0, 1)
    return x * x * (3 - 2 * x)


@pytest.mark.parametrize("chart", CHARTS, ids=lambda c: c.name)
@given(region=regions())
@settings(max_examples=40)
def test_a_pair_belongs_by_the_angles_of_its_directions_or_of_those_exchanged(chart, region):
    wi, wo = random_pairs(np.random.default_rng(5), 300, np.radians(85))
    angles = naive_angles(wi, wo)
    expected = np.ones(300)
    for name in ("theta_h", "theta_d", "phi_d", "phi"):
        if getattr(region, name) is not None:
            expected *= share(angles[name], getattr(region, name), region.falloff)
    ways = np.ones((2, 300))
    for way, names in zip(ways, (("theta_i", "theta_o"), ("theta_o", "theta_i")), strict=True):
        for name, of in zip(("theta_i", "theta_o"), names, strict=True):
            if getattr(region, name) is not None:
                way *= share(angles[of], getattr(region, name), region.falloff)
    weights = region.weights(chart, chart.to_parameters(wi, wo))
    # Angles by arccos are right to 1e-6 degrees.
    np.testing.assert_allclose(weights, expected * ways.max(axis=0), rtol=0, atol=2e-5)
    np.testing.assert_allclose(region.weights(chart, chart.to_parameters(wo, wi)), weights, rtol=0, atol=1e-7)


def test_it_is_one_inside_a_half_amid_the_edge_and_nothing_beyond():
    region = Region(theta_i=(20, 40), falloff=10)
    theta = np.array([20, 30, 40, 45, 15, 50, 10, 60])
    points = np.stack([theta / 90, theta / 90, np.full(8, 0.5)], axis=-1)
    np.testing.assert_allclose(region.weights(IN_OUT, points), [1, 1, 1, 0.5, 0.5, 0, 0, 0], atol=1e-12)


def test_without_a_falloff_the_edge_is_sharp():
    region = Region(theta_d=(30, 40), falloff=0)
    v = np.array([29.999, 30, 40, 40.001]) / 90
    points = np.stack([np.zeros(4), v, np.zeros(4)], axis=-1)
    assert region.weights(HALF_DIFF, points).tolist() == [0, 1, 1, 0]


@pytest.mark.parametrize("chart", CHARTS, ids=lambda c: c.name)
def test_the_whole_range_of_an_angle_is_everywhere(chart, rng):
    assert Region().everywhere
    assert not Region(phi=(0, 180)).everywhere
    points = rng.uniform(0, 1, (5, 60, 3))
    for name, high in LIMITS.items():
        weights = Region(**{name: (0, high)}, falloff=0).weights(chart, points)
        assert weights.shape == (5, 60)
        assert (weights == 1).all()


@pytest.mark.parametrize("chart", CHARTS, ids=lambda c: c.name)
def test_control_points_belong_by_their_greville_abscissae(chart):
    model = smooth(chart)
    region = Region(theta_h=(0, 25), theta_d=(10, 80), falloff=8)
    weights = region.net_weights(model)
    assert weights.shape == model.spline.size
    g = model.spline.greville
    at = np.array([g[0][2], g[1][3], g[2][1]])
    assert weights[2, 3, 1] == region.weights(chart, at)


def test_a_region_without_control_points_is_refused():
    region = Region(theta_h=(33.3, 33.4), falloff=0)
    assert "No control point lies in the region" in refusal(lambda: region.net_weights(smooth()))


@pytest.mark.parametrize(
    "wrong",
    [
        {"theta_h": (20, 10)},
        {"theta_h": (0, 91)},
        {"phi": (0, 181)},
        {"phi_d": (-1, 20)},
        {"theta_d": (np.nan, 20)},
        {"theta_d": (0, np.nan)},
        {"theta_i": ()},
        {"theta_i": (1, 2, 3)},
        {"theta_o": 20},
        {"theta_o": ("0", 20)},
        {"falloff": -1},
        {"falloff": 91},
        {"falloff": np.inf},
        {"falloff": True},
    ],
    ids=str,
)
def test_what_is_no_interval_of_angles_is_refused_by_name(wrong):
    assert refusal(lambda: Region(**wrong)).startswith(next(iter(wrong)))
