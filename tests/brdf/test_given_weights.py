"""Weights that a caller gives: they multiply those of the metric, whatever their unit, and wrong ones are refused."""

import numpy as np
import pytest

from bvbedit.brdf.charts import HALF_DIFF, IN_OUT, Chart, grid_points
from bvbedit.brdf.encodings import Root
from bvbedit.brdf.losses import LOSSES
from bvbedit.brdf.problem import Table, on_any_chart, pose, tabulate
from tests.brdf.samples import Glossy
from tests.spline.refusals import refusal

LOG_COSINE = LOSSES["log_cosine_rms"]
SMALL = tuple(np.linspace(0, 1, n) for n in (16, 13, 10))
each_chart = pytest.mark.parametrize("chart", [IN_OUT, HALF_DIFF], ids=lambda c: c.name)
each_loss = pytest.mark.parametrize("loss", LOSSES.values(), ids=list(LOSSES))


def _table(chart: Chart) -> Table:
    return tabulate(Glossy(0.3), chart, SMALL)


@each_chart
@each_loss
def test_weights_given_multiply_those_built_in(chart, loss):
    table = _table(chart)

    def given(p: np.ndarray) -> np.ndarray:
        return 0.5 + p[:, 0] * (p[:, 2] > 0.4)

    plain, weighted = (pose(table, Root(), loss, (1.0, 1.0), on_any_chart(w)) for w in (None, given))
    factors = given(grid_points(SMALL)).reshape(plain.weights.shape)
    quotient = weighted.weights / (factors * plain.weights)
    np.testing.assert_allclose(quotient, quotient[0, 0, 0], rtol=1e-12)
    np.testing.assert_array_equal(weighted.values, plain.values)


@pytest.mark.parametrize("scale", [1e-300, 1e-3, 1e3, 1e300])
def test_weights_given_in_another_scale_are_the_same(scale):
    """The step in which a net is stored follows from the weights: their unit must not matter."""
    one, other = (
        pose(_table(HALF_DIFF), Root(), LOG_COSINE, (0.3, 1.0), lambda _chart, p, s=s: s * (0.1 + p[:, 0]))
        for s in (1.0, scale)
    )
    np.testing.assert_allclose(other.weights, one.weights, rtol=1e-12)
    flat = pose(_table(HALF_DIFF), Root(), LOG_COSINE, (0.3, 1.0), lambda _chart, p: np.full(len(p), scale))
    plain = pose(_table(HALF_DIFF), Root(), LOG_COSINE, (0.3, 1.0))
    np.testing.assert_allclose(flat.weights, plain.weights, rtol=1e-12)


def test_weights_may_be_zero_in_parts():
    posed = pose(_table(HALF_DIFF), Root(), LOG_COSINE, (1, 1), lambda _chart, p: p[:, 0] > 0.5)
    assert (posed.weights[:8] == 0).all()
    assert (posed.weights[8:] > 0).all()


@pytest.mark.parametrize(
    "wrong",
    [
        3.0,
        lambda p: p,
        lambda p: 1.0,  # noqa: ARG005
        lambda p: None,  # noqa: ARG005
        lambda p: ["a"] * len(p),
        lambda p: np.ones(len(p) - 1),
        lambda p: np.zeros(len(p)),
        lambda p: -p[:, 0],
        lambda p: np.where(p[:, 0] > 0.5, np.nan, 1.0),
        lambda p: np.where(p[:, 0] > 0.5, np.inf, 1.0),
    ],
    ids=["no function", "three", "one", "none", "texts", "too few", "all zero", "negative", "nan", "infinite"],
)
def test_weights_that_are_none_are_refused(wrong):
    message = refusal(lambda: pose(_table(HALF_DIFF), Root(), LOG_COSINE, (1.0, 1.0), on_any_chart(wrong)))
    assert "weights" in message.lower()
