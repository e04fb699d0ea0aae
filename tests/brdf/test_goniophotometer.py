"""The simulated instrument: exact without noise, and with noise as noisy as it says."""

import math
from pathlib import Path

import numpy as np
import pytest

from bvbedit.brdf.analytic import GGX, Lambert, Schlick
from bvbedit.brdf.charts import chart_named
from bvbedit.brdf.goniophotometer import BITS, FLOOR, LEAST_COSINE, SATURATION, measure
from bvbedit.brdf.materials import MATERIALS
from bvbedit.brdf.measured import MeasuredBrdf
from tests.spline.refusals import refusal

GLOSS = GGX(0.2, Schlick((0.1, 0.4, 0.9)))
GREY = Lambert(0.5)
CHROME = Path(__file__).parents[3] / "shared" / "data" / "chrome.binary"


def merl_directions(i, j, k):
    """The textbook definition, from scratch: wi = Rz(0) Ry(theta_h) d, wo its reflection in h."""
    theta_h, theta_d, phi_d = (np.asarray(i) / 90) ** 2 * math.pi / 2, np.radians(j), np.radians(k)
    h = np.stack(np.broadcast_arrays(np.sin(theta_h), 0.0 * theta_d * phi_d, np.cos(theta_h)), axis=-1)
    dx, dy, dz = np.sin(theta_d) * np.cos(phi_d), np.sin(theta_d) * np.sin(phi_d), np.cos(theta_d)
    x = np.cos(theta_h) * dx + np.sin(theta_h) * dz
    z = -np.sin(theta_h) * dx + np.cos(theta_h) * dz
    wi = np.stack(np.broadcast_arrays(x, dy, z), axis=-1)
    return wi, 2 * np.cos(theta_d)[..., None] * h - wi


@pytest.fixture(scope="module")
def merl_nodes():
    return merl_directions(*np.meshgrid(np.arange(90), np.arange(90), np.arange(180), indexing="ij"))


@pytest.fixture(scope="module")
def exact():
    return measure(GLOSS)


@pytest.fixture(scope="module")
def noisy():
    return measure(GREY, noise=0.05, seed=3)


def deviates(table: MeasuredBrdf, truth: float, noise: float, wi: np.ndarray) -> np.ndarray:
    """The readings' errors in units of the stated standard deviation, nan where there is none."""
    floor = FLOOR / np.maximum(wi[..., 2:], LEAST_COSINE)
    z = (table.values - truth) / (noise * np.hypot(truth, floor))
    return np.where(table.valid[..., None], z, np.nan)


# --- without noise


def test_merl_table_is_the_brdf_at_the_nodes(exact, merl_nodes):
    assert isinstance(exact, MeasuredBrdf)
    assert exact.values.shape == (90, 90, 180, 3)
    assert exact.chart is chart_named("rusinkiewicz")
    for axis, bins in zip(exact.axes, (90, 90, 180), strict=True):
        np.testing.assert_array_equal(axis, np.arange(bins) / bins)
    nodes = np.stack(np.meshgrid(*exact.axes, indexing="ij"), axis=-1).reshape(-1, 3)
    wi, wo = exact.chart.to_directions(nodes)
    truth = GLOSS.evaluate(wi, wo).reshape(exact.values.shape)
    np.testing.assert_array_equal(exact.values[exact.valid], truth[exact.valid])
    # The chart's directions are those of the definition.
    high = exact.valid & (np.minimum(merl_nodes[0][..., 2], merl_nodes[1][..., 2]) > 0.01)
    independent = GLOSS.evaluate(merl_nodes[0][high], merl_nodes[1][high])
    np.testing.assert_allclose(exact.values[high], independent, rtol=1e-9)


def test_merl_mask_is_the_horizon(exact, merl_nodes):
    lowest = np.minimum(merl_nodes[0][..., 2], merl_nodes[1][..., 2])
    np.testing.assert_array_equal(exact.valid, lowest > 1e-9)
    # Mirror pairs are masked alike; n is the half-vector of no hidden pair; nor do pairs at equal elevation hide.
    np.testing.assert_array_equal(exact.valid[:, :, 1:], exact.valid[:, :, :0:-1])
    assert exact.valid[0].all()
    assert exact.valid[:, :, 90].all()
    assert 0.2 < np.mean(~exact.valid) < 0.25


@pytest.mark.skipif(not CHROME.is_file(), reason="measured files are not part of the project")
def test_merl_mask_is_that_of_the_real_files_up_to_cells_at_the_horizon(exact, merl_nodes):
    real = np.fromfile(CHROME, dtype="<f8", offset=12, count=90 * 90 * 180).reshape(90, 90, 180) >= 0
    assert not (exact.valid & ~real).any()
    beyond = real & ~exact.valid
    assert np.mean(beyond) < 0.03
    assert np.minimum(merl_nodes[0][..., 2], merl_nodes[1][..., 2])[beyond].min() > -math.sin(math.radians(4))


def test_paper_table_is_the_brdf_at_the_nodes():
    table = measure(GLOSS, "paper")
    assert table.values.shape == (91, 91, 361, 3)
    assert table.chart is chart_named("in-out")
    assert table.valid.all()
    for axis, nodes in zip(table.axes, (91, 91, 361), strict=True):
        np.testing.assert_allclose(axis, np.linspace(0, 1, nodes), rtol=1e-15)
    for i, j, k in [(0, 0, 0), (45, 45, 360), (45, 45, 0), (10, 80, 77), (90, 30, 120), (90, 90, 360), (30, 90, 1)]:
        a, b = (min(math.radians(d), math.pi / 2 - 1e-4) for d in (i, j))
        wi = (math.sin(a), 0, math.cos(a))
        c = math.radians(k / 2)
        wo = (math.sin(b) * math.cos(c), math.sin(b) * math.sin(c), math.cos(b))
        np.testing.assert_allclose(table.values[i, j, k], GLOSS.evaluate(wi, wo), rtol=1e-8)
    # theta = 0 on either side: one pair of directions for all phi.
    np.testing.assert_allclose(table.values[0], table.values[0][:, :1] + 0 * table.values[0], rtol=1e-12)
    np.testing.assert_allclose(table.values, table.values.swapaxes(0, 1), rtol=1e-9)


def test_reading_the_table_returns_the_brdf_near_its_nodes(exact):
    rng = np.random.default_rng(0)
    i, j, k = rng.integers(5, 60, 200), rng.integers(5, 40, 200), rng.integers(0, 180, 200)
    wi, wo = merl_directions(i, j, k)
    np.testing.assert_allclose(exact.evaluate(wi, wo), GLOSS.evaluate(wi, wo), rtol=1e-6)


# --- with noise


def test_noise_has_the_stated_mean_and_deviation(noisy, merl_nodes):
    z = deviates(noisy, 0.5 / math.pi, 0.05, merl_nodes[0])[noisy.valid]
    count = z.size
    assert abs(z.mean()) < 5 / math.sqrt(count)
    assert z.std() == pytest.approx(1, abs=5 / math.sqrt(2 * count))
    # Normal, not merely of that width.
    assert np.mean(np.abs(z) < 1) == pytest.approx(math.erf(math.sqrt(0.5)), abs=3e-3)
    assert 4.5 < np.abs(z).max() < 7


def test_noise_is_larger_towards_the_light_at_grazing(noisy, merl_nodes):
    error = np.abs(noisy.values - 0.5 / math.pi).mean(axis=-1)
    cosine = merl_nodes[0][..., 2]
    high, low = noisy.valid & (cosine > 0.5), noisy.valid & (cosine < 0.02)
    assert error[low].mean() > 1.2 * error[high].mean()


def test_every_reading_is_independent(noisy, merl_nodes):
    z = deviates(noisy, 0.5 / math.pi, 0.05, merl_nodes[0])
    both = noisy.valid[:, :, 1:] & noisy.valid[:, :, :0:-1]
    mirror = (z[:, :, 1:, 0][both], z[:, :, :0:-1, 0][both])
    off_axis = mirror[0] != mirror[1]  # phi_d = 90 degrees is its own mirror image
    neighbours = (z[:-1][noisy.valid[1:]], z[1:][noisy.valid[1:]])
    channels = (z[..., 0][noisy.valid], z[..., 1][noisy.valid])
    for a, b in ((mirror[0][off_axis], mirror[1][off_axis]), neighbours, channels):
        assert abs(np.corrcoef(a.ravel(), b.ravel())[0, 1]) < 6e-3


def test_seeds_choose_the_readings(noisy):
    again, other = measure(GREY, noise=0.05, seed=3), measure(GREY, noise=0.05, seed=np.int64(4))
    np.testing.assert_array_equal(again.values, noisy.values)
    np.testing.assert_array_equal(other.valid, noisy.valid)
    assert np.mean(other.values[other.valid] == noisy.values[other.valid]) < 0.02


def test_in_the_dark_half_the_readings_are_clamped_at_zero(merl_nodes):
    dark = measure(Lambert(0), noise=0.02)
    values = dark.values[dark.valid]
    assert dark.clamped == 0
    assert values.min() == 0
    assert np.mean(values == 0) == pytest.approx(0.5, abs=2e-3)
    z = deviates(dark, 0.0, 0.02, merl_nodes[0])[dark.valid]
    assert z.mean() == pytest.approx(1 / math.sqrt(2 * math.pi), abs=2e-3)


def test_bright_readings_saturate_and_all_are_rounded():
    chrome = MATERIALS["chrome"].brdf
    assert measure(chrome).values.max() > 10 * SATURATION
    values = measure(chrome, noise=0.01).values
    assert values.max() == SATURATION
    mantissa = np.frexp(values)[0] * 2**BITS
    np.testing.assert_array_equal(mantissa, np.round(mantissa))
    assert len(np.unique(mantissa)) > 1000


def test_paper_grid_takes_noise_too():
    table = measure(GREY, "paper", noise=0.02, seed=1)
    inner = table.values[:60, :60]
    assert inner.mean() == pytest.approx(0.5 / math.pi, rel=1e-3)
    assert inner.std() == pytest.approx(0.02 * 0.5 / math.pi, rel=0.01)
    # The same pair of directions, read 361 times.
    assert table.values[0, 0, :, 0].std() > 0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"grid": "rgl"}, "merl, paper"),
        ({"grid": ["merl"]}, "merl, paper"),
        ({"noise": -0.1}, "noise is -0.1"),
        ({"noise": math.nan}, "noise is nan"),
        ({"noise": 2}, "noise is 2"),
        ({"noise": "0.1"}, "noise is '0.1'"),
        ({"noise": None}, "noise is None"),
        ({"seed": -1}, "seed is -1"),
        ({"seed": 0.5}, "seed is 0.5"),
        ({"seed": True}, "seed is True"),
    ],
)
def test_wrong_requests_are_named(arguments, words):
    assert words in refusal(lambda: measure(GREY, **arguments))
