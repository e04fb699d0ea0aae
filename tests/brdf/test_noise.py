"""How noisy a measurement is: the estimate against noise that is known, because it was simulated."""

import numpy as np
import pytest

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.charts import HALF_DIFF, IN_OUT, RUSINKIEWICZ, RUSINKIEWICZ_360, Chart, grid_points
from bvbedit.brdf.encodings import Root
from bvbedit.brdf.fit import fit_net
from bvbedit.brdf.geometry import elevation, spherical
from bvbedit.brdf.goniophotometer import FLOOR
from bvbedit.brdf.losses import LOSSES, Loss
from bvbedit.brdf.materials import MATERIALS, material_named
from bvbedit.brdf.measured import MeasuredBrdf
from bvbedit.brdf.metrics import estimate
from bvbedit.brdf.noise import Noise, estimate_noise
from bvbedit.brdf.plan import plan
from bvbedit.brdf.problem import pose, tabulate
from bvbedit.brdf.sample_sets import draw
from bvbedit.brdf.samples import draw_samples
from tests.brdf.measurements import measured
from tests.brdf.samples import Glossy

LOG_COSINE = LOSSES["log_cosine_rms"]
SMOOTH = "teflon"
each_loss = pytest.mark.parametrize("loss", LOSSES.values(), ids=list(LOSSES))


def _really(table: Brdf, truth: Brdf, loss: Loss) -> tuple[float, float, float]:
    """Return the standard deviations of T that the table has over other pairs of both sets, and at theta_h = 0."""
    pairs = draw(table, 20_000, seed=77)
    theta, phi = np.radians(np.arange(2.0, 81.0, 2.0))[:, None], np.radians(np.arange(0.0, 180.0))
    pole = spherical(theta, phi).reshape(-1, 3)
    opposite = pole * np.array([-1.0, -1.0, 1.0])
    parts = [(pairs.wi[part], pairs.wo[part]) for part in pairs.parts()] + [(pole, opposite)]
    found = []
    for wi, wo in parts:
        f, trusted = table.evaluate_trusted(wi, wo)
        c = wi[:, 2:], wo[:, 2:]
        off = loss.transform(f, *c) - loss.transform(truth.evaluate(wi, wo), *c)
        found.append(float(np.sqrt(np.mean(off[trusted] ** 2))))
    return found[0], found[1], found[2]


@each_loss
def test_the_noise_of_a_merl_table_is_told_to_10_percent(loss):
    """A smooth material: what the table is off by is noise, and none of it is interpolation."""
    table = measured(SMOOTH)
    noise = estimate_noise(table, loss)
    np.testing.assert_allclose(
        [noise.grid, noise.nodes, noise.pole], _really(table, material_named(SMOOTH).brdf, loss), rtol=0.1
    )


def test_at_merls_nodes_the_noise_is_the_one_that_the_instrument_was_given():
    """A deviation of noise hypot(f, floor / cos theta_i), times the slope of T."""
    table, truth = measured(SMOOTH), material_named(SMOOTH).brdf
    pairs = draw(table, 20_000, seed=5)
    wi, wo = pairs.wi[pairs.parts()[1]], pairs.wo[pairs.parts()[1]]
    f, c = truth.evaluate(wi, wo), (wi[:, 2:], wo[:, 2:])
    deviation = 0.05 * np.hypot(f, FLOOR / wi[:, 2:]) * LOG_COSINE.slope(f, *c)
    assert estimate_noise(table, LOG_COSINE).nodes == pytest.approx(np.sqrt(np.mean(deviation**2)), rel=0.05)


def _simulated(chart: Chart, shape: tuple[int, int, int], relative: float) -> tuple[MeasuredBrdf, MeasuredBrdf]:
    """Return a table of a smooth material with independent noise in each cell, and the one without."""
    axes = tuple(np.arange(n) / (n - (not p)) for n, p in zip(shape, chart.periodic, strict=True))
    wi, wo = (np.maximum(w, [-1, -1, 1e-9]) for w in chart.to_directions(grid_points(axes)))
    f = Glossy(0.8).evaluate(wi, wo)
    readings = f * (1 + relative * np.random.default_rng(3).normal(size=f.shape))
    exact, noisy = (MeasuredBrdf(v.reshape(*shape, 3), np.ones(shape, bool), axes, chart) for v in (f, readings))
    return noisy, exact


SIMULATED = {
    "half-diff, all around": (RUSINKIEWICZ_360, (30, 30, 120)),
    "half-diff, half around": (RUSINKIEWICZ, (30, 30, 60)),
    "the paper's": (IN_OUT, (46, 46, 46)),
}


@pytest.mark.parametrize("kind", SIMULATED)
def test_noise_is_told_on_every_chart_that_measures_a_pair_more_than_once(kind):
    noisy, exact = _simulated(*SIMULATED[kind], 0.1)
    noise = estimate_noise(noisy, LOG_COSINE)
    grid, nodes, _ = _really(noisy, exact, LOG_COSINE)
    assert noise.grid == pytest.approx(grid, rel=0.1)
    if noisy.chart is IN_OUT:
        # Near the mirror direction, where MERL's nodes crowd, exchanged pairs are read from the same cells.
        assert 0.7 * nodes < noise.nodes < nodes
    else:
        assert noise.nodes == pytest.approx(nodes, rel=0.1)


@pytest.mark.parametrize("kind", SIMULATED)
def test_the_variance_of_what_half_diff_is_fitted_to_is_that_of_its_errors(kind):
    """The mean over sides that were measured independently; what a table holds once counts once."""
    axes = tuple(np.linspace(0, 1, n) for n in (46, 46, 31))
    noisy, exact = (
        pose(tabulate(t, HALF_DIFF, axes), Root(), LOG_COSINE, (1.0, 1.0)) for t in _simulated(*SIMULATED[kind], 0.05)
    )
    sure = np.zeros(noisy.weights.shape, bool)
    sure[3:-3, 3:-3, 2:-2] = True
    sure &= np.all(noisy.table.trusted, axis=0)
    if kind == "the paper's":  # exchanged pairs within two cells of 2 degrees are one reading, or half of one
        lower, higher = (elevation(w) for w in HALF_DIFF.to_directions(grid_points(axes)))
        sure &= (np.abs(lower - higher) > np.radians(4)).reshape(sure.shape)
    off = np.sum((noisy.values - exact.values) ** 2, axis=-1)
    assert noisy.variance[sure].mean() == pytest.approx(off[sure].mean(), rel=0.1)


def test_a_table_that_measures_every_pair_once_tells_nothing():
    noisy, _ = _simulated(HALF_DIFF, (31, 31, 31), 0.1)
    noise = estimate_noise(noisy, LOG_COSINE)
    assert noise.grid <= 1e-12
    assert noise.nodes <= 1e-12


@pytest.mark.parametrize("name", MATERIALS)
def test_a_material_itself_has_no_noise(name):
    noise = estimate_noise(material_named(name).brdf, LOG_COSINE)
    assert max(noise.grid, noise.nodes, noise.pole) < 1e-9


@each_loss
def test_an_exact_table_has_next_to_no_noise(loss):
    """What is left is the interpolation of cells beside the pole."""
    _, exact = _simulated(RUSINKIEWICZ, (30, 30, 60), 0.0)
    noisy, _ = _simulated(RUSINKIEWICZ, (30, 30, 60), 0.1)
    none, some = estimate_noise(exact, loss), estimate_noise(noisy, loss)
    assert none.nodes < 1e-9
    assert none.grid < 0.02 * some.grid


def test_twice_the_noise_is_twice_the_estimate():
    one, two = (estimate_noise(_simulated(RUSINKIEWICZ, (30, 30, 60), r)[0], LOG_COSINE) for r in (0.02, 0.04))
    assert two.grid == pytest.approx(2 * one.grid, rel=0.02)
    assert two.nodes == pytest.approx(2 * one.nodes, rel=0.02)


def test_a_material_that_is_not_symmetric_counts_as_noise():
    class Sided(Brdf):
        reciprocal = True

        def _evaluate(self, wi, wo):
            cross = wi[:, 0] * wo[:, 1] - wi[:, 1] * wo[:, 0]
            return (0.5 + 0.1 * np.sign(cross))[:, None] * np.ones(3), np.ones(len(wi), bool)

    # Two values that differ by 0.2 deviate by 0.2 / sqrt(2).
    noise = estimate_noise(Sided(), LOSSES["relative_l1"])
    assert noise.grid == pytest.approx(0.2 / np.sqrt(2), rel=0.05)


def test_where_no_mirror_image_is_measured_there_is_no_noise_to_tell():
    class OneSided(Brdf):
        reciprocal = True

        def _evaluate(self, wi, wo):
            return np.ones((len(wi), 3)), wi[:, 0] * wo[:, 1] - wi[:, 1] * wo[:, 0] > 1e-9

    with np.errstate(all="raise"):
        assert estimate_noise(OneSided(), LOG_COSINE) == Noise(0.0, 0.0, 0.0)


def test_the_report_has_three_digits():
    assert Noise(0.0123456, 1.0, 0.0).to_dict() == {"grid": 0.0123, "nodes": 1.0, "pole": 0.0}


NOISY = ("satin-paint", "gold-metallic-paint", SMOOTH)


@pytest.mark.parametrize("name", NOISY)
def test_a_fit_is_at_most_half_as_far_from_the_material_as_its_measurement_is(name):
    """Readings that are alike are averaged, and a net of 1,400 control points cannot follow a million readings."""
    truth, table = material_named(name).brdf, measured(name)
    model = fit_net(table, HALF_DIFF, Root(), size=(20, 14, 5))
    fitted, own = estimate(model, truth), estimate(table, truth)
    assert fitted.grid.log_cosine_rms < 0.5 * own.grid.log_cosine_rms
    assert fitted.nodes.log_cosine_rms < 0.5 * own.nodes.log_cosine_rms


def test_dominant_points_of_noisy_data_are_no_worse_than_averaged_knots():
    """Features are followed and noise is not: quick fits of three materials in three sizes, against the materials."""
    quotients = []
    for name in NOISY:
        table, truth = tabulate(measured(name), HALF_DIFF), material_named(name).brdf
        samples = draw_samples(truth, HALF_DIFF, 10_000, seed=5)
        dominant, averaged = (
            plan(table, Root(), LOG_COSINE, (1.0, 0.1), degrees=(3, 3, 3), placement=placement, points=27_000)
            for placement in ("dominant", "averaged")
        )
        for size in ((12, 8, 4), (20, 14, 5), (30, 20, 8)):
            errors = [samples.errors_of(made.lofted(size), Root(), LOG_COSINE) for made in (dominant, averaged)]
            quotients.append(float(np.sqrt(np.prod(errors[0] / errors[1]))))
    assert np.exp(np.mean(np.log(quotients))) <= 1.05
    assert max(quotients) < 1.25
