"""The last steps of a fit: never worse, usually better, faces kept, weights heard."""

import functools

import numpy as np
import pytest

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.charts import HALF_DIFF, IN_OUT, Chart
from bvbedit.brdf.encodings import Encoding, Linear, Log, Root
from bvbedit.brdf.losses import LOSSES, Loss
from bvbedit.brdf.plan import Plan, plan
from bvbedit.brdf.polish import polish
from bvbedit.brdf.problem import Weights, tabulate
from bvbedit.brdf.samples import Samples, draw_samples, split
from bvbedit.brdf.spline_brdf import face_spread, keep_faces
from bvbedit.spline.tensor import TensorSpline
from tests.brdf.samples import Glossy

LOG_COSINE = LOSSES["log_cosine_rms"]
SIZE = (9, 8, 5)
AXES = tuple(np.linspace(0, 1, n) for n in (31, 26, 13))
each_loss = pytest.mark.parametrize("loss", LOSSES.values(), ids=list(LOSSES))
each_case = pytest.mark.parametrize(
    ("chart", "encoding"),
    [(HALF_DIFF, Root()), (HALF_DIFF, Log()), (IN_OUT, Root()), (IN_OUT, Linear())],
    ids=lambda x: getattr(x, "name", x),
)


@functools.cache
def _made(chart: Chart, encoding: Encoding, loss: Loss) -> Plan:
    return plan(
        tabulate(Glossy(0.3), chart, AXES),
        encoding,
        loss,
        (1.0, 1.0),
        degrees=(3, 3, 3),
        placement="dominant",
        points=1000,
    )


@functools.cache
def _samples(chart: Chart, seed: int = 0) -> Samples:
    return draw_samples(Glossy(0.3), chart, 5000, seed)


def _polished(
    made: Plan, samples: Samples, start: TensorSpline | None = None, rounds: int = 2, **options: object
) -> TensorSpline:
    chart, problem = made.problem.chart, made.problem
    return polish(
        start or made.lofted(SIZE),
        made.lines,
        samples,
        problem.encoding,
        problem.loss,
        project=lambda control: keep_faces(control, chart),
        rounds=rounds,
        **options,
    )


def _score(spline: TensorSpline, made: Plan, samples: Samples) -> float:
    """Return the geometric mean of the metric over both sets."""
    return float(np.sqrt(np.prod(samples.errors_of(spline, made.problem.encoding, made.problem.loss))))


@each_loss
@each_case
def test_over_the_judging_samples_a_polished_net_is_never_worse(chart, encoding, loss):
    made, samples = _made(chart, encoding, loss), _samples(chart)
    judges = split(samples)[1]
    for rounds in (1, 3):
        assert _score(_polished(made, samples, rounds=rounds), made, judges) <= _score(made.lofted(SIZE), made, judges)


@each_case
def test_a_polished_net_is_better_over_samples_it_has_not_seen(chart, encoding):
    made, unseen = _made(chart, encoding, LOG_COSINE), _samples(chart, seed=8)
    before, after = (_score(s, made, unseen) for s in (made.lofted(SIZE), _polished(made, _samples(chart))))
    assert after < 0.95 * before


@pytest.mark.parametrize("spoiled", [0.01, 0.3, 3.0])
def test_a_spoiled_net_is_brought_back(spoiled, rng):
    """Each control point changed by up to so much of it: a few rounds undo most of the harm."""
    made, samples = _made(HALF_DIFF, Root(), LOG_COSINE), _samples(HALF_DIFF)
    good = made.lofted(SIZE)
    bad = good.with_control(good.control * (1 + spoiled * rng.uniform(-1, 1, good.control.shape)))
    judges = split(samples)[1]
    before, after = (_score(s, made, judges) for s in (bad, _polished(made, samples, bad, rounds=6)))
    assert after < 0.5 * before


@each_case
def test_degenerate_faces_stay_equal(chart, encoding):
    made = _made(chart, encoding, LOG_COSINE)
    control = _polished(made, _samples(chart)).control
    assert not np.array_equal(control, made.lofted(SIZE).control)
    assert face_spread(control, chart) <= 1e-12 * np.abs(control).max()


def test_an_unequal_face_is_made_equal_even_where_nothing_is_gained(rng):
    made, samples = _made(HALF_DIFF, Root(), LOG_COSINE), _samples(HALF_DIFF)
    good = made.lofted(SIZE)
    start = good.with_control(good.control + 1e-3 * rng.normal(size=good.control.shape))
    found = _polished(made, samples, start, rounds=0).control
    np.testing.assert_allclose(found, keep_faces(start.control, HALF_DIFF), rtol=0, atol=1e-15)


def test_a_net_that_is_exact_already_stays_exact():
    class Exact(Brdf):
        reciprocal = True

        def _evaluate(self, wi, wo):
            return Root().decode(made.lofted(SIZE).evaluate(HALF_DIFF.to_parameters(wi, wo))), np.ones(len(wi), bool)

    made = _made(HALF_DIFF, Root(), LOG_COSINE)
    spline = _polished(made, draw_samples(Exact(), HALF_DIFF, 3000))
    np.testing.assert_allclose(spline.control, made.lofted(SIZE).control, rtol=0, atol=1e-9)


def test_it_is_the_same_every_time():
    made, samples = _made(HALF_DIFF, Root(), LOG_COSINE), _samples(HALF_DIFF)
    first, second = (_polished(made, samples).control for _ in range(2))
    np.testing.assert_array_equal(first, second)


def _weighted(weights: Weights) -> TensorSpline:
    samples = draw_samples(Glossy(0.3), HALF_DIFF, 5000, weights=weights)
    return _polished(_made(HALF_DIFF, Root(), LOG_COSINE), samples, rounds=3)


def test_weights_move_the_error_to_where_they_are_small():
    unseen = _samples(HALF_DIFF, seed=8)
    inside = unseen.parameters[:, 0] < 0.3

    def rms(spline: TensorSpline, where: np.ndarray) -> float:
        t = [
            LOG_COSINE.transform(f, *unseen.cosines)
            for f in (Root().decode(spline.evaluate(unseen.parameters)), unseen.reflectance)
        ]
        return float(np.sqrt(np.mean((t[0] - t[1])[where] ** 2)))

    narrow = _weighted(lambda _chart, p: np.where(p[:, 0] < 0.3, 1.0, 1e-3))
    wide = _weighted(lambda _chart, p: np.where(p[:, 0] < 0.3, 1e-3, 1.0))
    assert rms(narrow, inside) < 0.9 * rms(wide, inside)
    assert rms(wide, ~inside) < 0.9 * rms(narrow, ~inside)


@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_weights_of_another_scale_are_the_same_weights(scale):
    one, other = (_weighted(lambda _chart, p, s=s: s * (0.1 + p[:, 1])).control for s in (1.0, scale))
    np.testing.assert_allclose(other, one, rtol=0, atol=1e-9)


def test_without_a_sample_the_net_stays():
    made, some = _made(HALF_DIFF, Root(), LOG_COSINE), _samples(HALF_DIFF)
    none = Samples(
        some.parameters[:0],
        some.reflectance[:0],
        (some.cosines[0][:0], some.cosines[1][:0]),
        (slice(0, 0), slice(0, 0)),
        some.weights[:0],
    )
    np.testing.assert_allclose(_polished(made, none).control, made.lofted(SIZE).control, rtol=0, atol=1e-15)


@each_loss
def test_one_set_alone_is_enough(loss):
    made, both = _made(HALF_DIFF, Root(), loss), _samples(HALF_DIFF)
    part = both.parts[0]
    count = part.stop
    one = Samples(
        both.parameters[part],
        both.reflectance[part],
        (both.cosines[0][part], both.cosines[1][part]),
        (slice(0, count), slice(count, count)),
        both.weights[part],
    )
    with np.errstate(all="raise", under="ignore"):
        spline = _polished(made, one)
    assert _score(spline, made, split(one)[1]) <= _score(made.lofted(SIZE), made, split(one)[1])


@each_loss
@pytest.mark.parametrize("encoding", [Root(), Log(), Linear()], ids=repr)
def test_a_black_material_is_polished_without_a_division_by_zero(loss, encoding):
    class Black(Brdf):
        reciprocal = True

        def _evaluate(self, wi, wo):  # noqa: ARG002
            return np.zeros((len(wi), 3)), np.ones(len(wi), bool)

    made = plan(
        tabulate(Black(), HALF_DIFF, AXES),
        encoding,
        loss,
        (1.0, 1.0),
        degrees=(3, 3, 3),
        placement="averaged",
        points=200,
    )
    with np.errstate(all="raise", under="ignore"):
        spline = _polished(made, draw_samples(Black(), HALF_DIFF, 500))
    np.testing.assert_array_equal(encoding.decode(spline.control), 0.0)


def test_progress_rises_to_one_at_most():
    shares: list[float] = []
    _polished(_made(HALF_DIFF, Root(), LOG_COSINE), _samples(HALF_DIFF), rounds=3, progress=shares.append)
    assert shares == sorted(shares)
    assert 0 < shares[0] <= shares[-1] <= 1
