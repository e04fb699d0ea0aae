"""Fits that follow pairs of their own: how densely they lie, how they weigh nodes, and which samples they bring."""

import numpy as np
import pytest

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.charts import HALF_DIFF, IN_OUT, grid_points
from bvbedit.brdf.encodings import Root
from bvbedit.brdf.fit import settle
from bvbedit.brdf.interest import Interest
from bvbedit.brdf.losses import PictureError
from bvbedit.brdf.plan import plan
from bvbedit.brdf.problem import UNASKED, pose, tabulate
from bvbedit.brdf.samples import draw_samples
from bvbedit.brdf.sizing import step_of, traded
from tests.brdf.samples import Glossy, random_pairs

LOSS = PictureError(mean=0.1)
SMALL = tuple(np.linspace(0, 1, n) for n in (16, 13, 10))

each_chart = pytest.mark.parametrize("chart", [IN_OUT, HALF_DIFF], ids=lambda c: c.name)


class Held(Glossy):
    """Without data beyond 50 degrees, though values are told."""

    def _evaluate(self, wi, wo):
        return super()._evaluate(wi, wo)[0], np.minimum(wi[:, 2], wo[:, 2]) > np.cos(np.radians(50))


class Rough(Brdf):
    """A ripple that few control points cannot follow, everywhere alike."""

    reciprocal = True

    def _evaluate(self, wi, wo):
        ripple = 0.3 + 0.1 * np.sin(15 * wi[:, 2]) * np.sin(15 * wo[:, 2])
        return ripple[:, None] * np.ones(3), np.ones(len(wi), dtype=bool)


def _near(rng: np.random.Generator, lowest: float, highest: float, count: int = 40_000) -> Interest:
    """Return an interest in pairs whose elevations are within these bounds (degrees)."""
    wi, wo = random_pairs(rng, 20 * count, np.radians(highest))
    kept = np.maximum(wi[:, 2], wo[:, 2]) < np.cos(np.radians(lowest))
    return Interest(wi[kept][:count], wo[kept][:count], rng.uniform(0.5, 1.0, (len(wi[kept][:count]), 3)), LOSS)


@each_chart
def test_a_density_is_one_on_average(chart, rng):
    points = rng.uniform(size=(100_000, 3))
    assert _near(rng, 0, 80).density(chart, points).mean() == pytest.approx(1.0, rel=0.05)


@each_chart
def test_pairs_evenly_in_a_chart_have_the_density_one(chart, rng):
    wi, wo = chart.to_directions(rng.uniform(size=(200_000, 3)))
    found = Interest(wi, wo, np.ones_like(wi), LOSS).density(chart, rng.uniform(0.1, 0.9, (1000, 3)))
    np.testing.assert_allclose(found, 1.0, atol=0.25)


@each_chart
def test_nodes_weigh_as_the_pairs_lie_and_none_weighs_nothing(chart, rng):
    interest = _near(rng, 0, 40)
    problem = pose(tabulate(Glossy(0.3), chart, SMALL), Root(), LOSS, (1.0, 1.0), interest)
    wi, wo = chart.to_directions(grid_points(SMALL))
    low = (np.minimum(wi[:, 2], wo[:, 2]) < np.cos(np.radians(60))).reshape(problem.weights.shape)
    assert problem.weights.min() > 0.9 * UNASKED * problem.weights.mean()
    np.testing.assert_allclose(problem.weights[low], problem.weights.min(), rtol=0.2)
    assert problem.weights[~low].mean() > 5 * problem.weights[low].mean()


@each_chart
def test_what_is_held_is_fitted_as_it_is_seen(chart, rng):
    posed = [
        pose(tabulate(brdf, chart, SMALL), Root(), LOSS, (1.0, 1.0), _near(rng, 0, 90))
        for brdf in (Glossy(0.3), Held(0.3))
    ]
    np.testing.assert_allclose(posed[1].values, posed[0].values, atol=1e-12)


@each_chart
def test_samples_are_all_the_pairs_with_data_or_without(chart, rng):
    interest = _near(rng, 0, 90, 500)
    samples = draw_samples(Held(0.3), chart, 20, weights=interest)
    np.testing.assert_allclose(samples.parameters, chart.to_parameters(interest.wi, interest.wo))
    np.testing.assert_allclose(samples.reflectance, Glossy(0.3).evaluate(interest.wi, interest.wo))
    np.testing.assert_allclose(samples.weights, interest.counts / interest.counts.max())
    f = samples.reflectance * 1.1
    off = LOSS.transform(f, None, None) - LOSS.transform(samples.reflectance, None, None)
    error = np.sqrt(np.sum(interest.counts * off**2) / np.sum(interest.counts))
    np.testing.assert_allclose(samples.errors(f, LOSS), error)


@each_chart
def test_the_error_is_small_where_the_pairs_are(chart, rng):
    brdf, table = Rough(), tabulate(Rough(), chart, tuple(np.linspace(0, 1, n) for n in (40, 40, 10)))
    steep, grazing = _near(rng, 0, 35), _near(rng, 60, 90)

    def error(followed: Interest, judged: Interest) -> float:
        options = {"degrees": (3, 3, 3), "placement": "dominant", "points": 900, "weights": followed}
        made = plan(table, Root(), LOSS, (1.0, 1.0), **options)
        model = settle(brdf, made, (10, 10, 4), weights=followed)
        samples = draw_samples(brdf, chart, 1, weights=judged)
        return float(samples.errors_of(model.spline, Root(), LOSS)[0])

    assert error(steep, steep) < 0.7 * error(grazing, steep)
    assert error(grazing, grazing) < 0.7 * error(steep, grazing)


@each_chart
def test_trading_between_axes_costs_no_control_points_and_lowers_the_error(chart, rng):
    interest, brdf = _near(rng, 30, 80), Glossy(0.3)
    options = {"degrees": (3, 3, 3), "placement": "dominant", "points": 900, "weights": interest}
    made = plan(tabulate(brdf, chart, SMALL), Root(), LOSS, (1.0, 1.0), **options)
    samples, size = draw_samples(brdf, chart, 1, weights=interest), (6, 6, 9)
    found = traded(made, samples, size)
    assert np.prod(found) <= np.prod(size)
    assert step_of(made, samples, found).score() <= step_of(made, samples, size).score()
