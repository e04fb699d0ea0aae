"""The metrics as a fit sees them: slopes against differences, figures against those of ``compare``."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.charts import HALF_DIFF
from bvbedit.brdf.losses import LOSSES, SMALLEST_SHARE, Loss, PictureError, loss_named
from bvbedit.brdf.metrics import estimate
from bvbedit.brdf.samples import draw_samples
from tests.brdf.samples import Glossy
from tests.spline.refusals import refusal

each = pytest.mark.parametrize("loss", LOSSES.values(), ids=list(LOSSES))
reflectances = st.floats(1e-6, 1e5)
cosines = st.floats(0.17, 1.0)


class Tinted(Brdf):
    """A reflectance times a factor for each channel."""

    def __init__(self, brdf: Brdf, factors: tuple[float, float, float]) -> None:
        self.brdf, self.factors, self.reciprocal = brdf, np.array(factors), brdf.reciprocal

    def _evaluate(self, wi, wo):
        f, backed = self.brdf.evaluate_unit(wi, wo)
        return f * self.factors, backed


def _cosines(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    return rng.uniform(0.17, 1, (count, 1)), rng.uniform(0.17, 1, (count, 1))


@pytest.mark.parametrize("loss", [*LOSSES.values(), PictureError(mean=0.2, scale=0.7)], ids=lambda x: x.name)
@given(f=st.tuples(reflectances, reflectances, reflectances), cos_i=cosines, cos_o=cosines)
def test_the_slope_is_the_difference_quotient_of_the_transform(loss, f, cos_i, cos_o):
    f, c = np.array([f]), (np.array([[cos_i]]), np.array([[cos_o]]))
    h = 1e-4 * f
    quotient = (loss.transform(f + h, *c) - loss.transform(f - h, *c)) / (2 * h)
    np.testing.assert_allclose(loss.slope(f, *c), quotient, rtol=1e-6)


@each
def test_the_transform_rises_and_keeps_black_at_zero(loss, rng):
    c = _cosines(rng, 50)
    f = np.sort(rng.uniform(0, 1e4, (9, 50, 3)), axis=0)
    assert (np.diff([loss.transform(x, *c) for x in f], axis=0) >= 0).all()
    np.testing.assert_array_equal(loss.transform(np.zeros((50, 3)), *c), 0.0)


def _figures(loss: Loss, truth: Brdf, other: Brdf, pairs: int) -> tuple[list[float], list[float]]:
    """Return the metric over both sets as the loss has it and as ``estimate`` has it, over the same pairs."""
    samples = draw_samples(truth, HALF_DIFF, pairs, seed=3)
    wi, wo = HALF_DIFF.to_directions(samples.parameters)
    f = other.evaluate(wi, wo)
    found = samples.metrics(samples.errors(f, loss), loss)
    told = estimate(other, truth, pairs, seed=3).to_dict()
    return list(found), [told[name][loss.name] for name in ("grid", "nodes")]


@pytest.mark.parametrize("name", ["log_cosine_rms", "fores"])
def test_the_metric_is_that_of_compare(name):
    found, expected = _figures(LOSSES[name], Glossy(0.3), Tinted(Glossy(0.3), (1.1, 0.8, 1.5)), 3000)
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_relative_l1_is_that_of_compare_where_the_channels_err_alike():
    """The metric takes lengths of RGB vectors and the loss sums of components: of parallel vectors these agree."""
    found, expected = _figures(LOSSES["relative_l1"], Glossy(0.3), Tinted(Glossy(0.3), (1.2, 1.2, 1.2)), 3000)
    np.testing.assert_allclose(found, 0.2, rtol=1e-9)
    np.testing.assert_allclose(expected, 0.2, rtol=1e-9)


def test_of_any_colours_relative_l1_is_that_of_compare_up_to_the_shape_of_the_norms():
    """1 <= |x|_1 / |x|_2 <= sqrt(3) in three channels, above and below the line."""
    found, expected = _figures(LOSSES["relative_l1"], Glossy(0.3), Tinted(Glossy(0.3), (1.4, 1.0, 0.9)), 3000)
    quotient = np.divide(found, expected)
    assert (quotient >= 1 / np.sqrt(3)).all()
    assert (quotient <= np.sqrt(3)).all()


@each
def test_the_norm_is_the_root_of_the_mean_power(loss):
    error = np.array([[0.5, -2.0, 0.0], [1e-3, 30.0, -1e4]])
    mean = sum(abs(float(e)) ** loss.power for e in error.ravel()) / 6
    assert loss.norm(error) == pytest.approx(mean**0.5, rel=1e-14)
    assert loss.norm(np.zeros((4, 3))) == 0


@each
@given(scale=st.floats(1e-3, 1e3))
def test_a_metric_but_relative_l1_of_scaled_errors_scales_with_half_the_power(loss, scale):
    error = np.random.default_rng(0).normal(size=(100, 3))
    target = np.random.default_rng(1).uniform(1, 2, (100, 3))
    one, many = (loss.metric(loss.norm(s * error), target) for s in (1.0, scale))
    exponent = 1.0 if loss.name == "relative_l1" else loss.power / 2
    assert many == pytest.approx(one * scale**exponent, rel=1e-12)


def test_black_targets_leave_relative_l1_finite():
    loss = LOSSES["relative_l1"]
    assert loss.metric(loss.norm(np.ones((5, 3))), np.zeros((5, 3))) == 1.0
    assert loss.metric(0.0, np.zeros((0, 3))) == 0.0


@each
def test_least_squares_with_the_reweighting_is_the_power_of_the_errors(loss, rng):
    """Sum e^2 |e|^(p - 2) = sum |e|^p, but for the scale and for errors below the smallest share."""
    error = rng.uniform(0.2, 2, (10_000, 3)) * rng.choice([-1, 1], (10_000, 3))
    assert np.abs(error).min() > SMALLEST_SHARE * np.abs(error).mean()
    weights = loss.reweighting(error)
    mean = np.abs(error).mean()
    assert (weights * error**2).sum() == pytest.approx((np.abs(error) ** loss.power).sum() * mean ** (2 - loss.power))


@pytest.mark.parametrize("scale", [1e-300, 1e-6, 1.0, 1e300])
@each
def test_the_reweighting_is_about_one_whatever_the_scale(loss, scale, rng):
    np.testing.assert_allclose(loss.reweighting(np.full((10, 3), -scale)), 1.0, rtol=1e-12)
    weights = loss.reweighting(scale * rng.uniform(0.7, 1.3, (1000, 3)))
    assert weights.mean() == pytest.approx(1.0, abs=0.1)


@each
def test_no_error_gets_an_endless_weight(loss, rng):
    error = np.where(rng.uniform(size=(1000, 3)) < 0.5, 0.0, rng.normal(size=(1000, 3)))
    for e in (error, np.zeros((10, 3))):
        weights = loss.reweighting(e)
        assert np.isfinite(weights).all()
        assert weights.min() > 0
        assert weights.max() <= SMALLEST_SHARE ** (loss.power - 2) * (1 + 1e-12)


def test_the_reweighting_of_squares_is_one(rng):
    loss = LOSSES["log_cosine_rms"]
    np.testing.assert_array_equal(loss.reweighting(rng.normal(size=(40, 3))), np.ones((40, 3)))


@each
def test_losses_are_found_by_the_names_of_the_metrics(loss):
    assert loss_named(loss.name) is loss


@pytest.mark.parametrize("wrong", ["rms", "", "Fores", None, 3, ["fores"], np.ones((40, 40))])
def test_unknown_metrics_are_refused_with_a_list_of_the_names(wrong):
    message = refusal(lambda: loss_named(wrong))
    assert "log_cosine_rms, fores, relative_l1" in message
