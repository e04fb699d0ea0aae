"""Pairs drawn for a fit: with data behind them, in the chart, split without loss."""

from collections.abc import Callable

import numpy as np
import pytest

from bvbedit.brdf.analytic import Lambert
from bvbedit.brdf.base import Brdf
from bvbedit.brdf.charts import HALF_DIFF, IN_OUT, RUSINKIEWICZ, Chart
from bvbedit.brdf.encodings import Root
from bvbedit.brdf.losses import LOSSES
from bvbedit.brdf.measured import MeasuredBrdf
from bvbedit.brdf.problem import on_any_chart
from bvbedit.brdf.sample_sets import LARGEST_REFLECTANCE, draw
from bvbedit.brdf.samples import JUDGE, Samples, draw_samples, samples_for, split
from bvbedit.spline.tensor import TensorSpline
from tests.brdf.samples import Glossy
from tests.spline.refusals import refusal

each_chart = pytest.mark.parametrize("chart", [IN_OUT, HALF_DIFF], ids=lambda c: c.name)
each_loss = pytest.mark.parametrize("loss", LOSSES.values(), ids=list(LOSSES))
# Stands in cells that are not valid; the others are grey.
WRONG, GREY = 77.0, 0.25


def _holed(chart: Chart, valid: np.ndarray) -> MeasuredBrdf:
    values = np.where(valid[..., None], GREY, WRONG) * np.ones(3)
    axes = tuple(np.arange(n) / (n - (not p)) for n, p in zip(valid.shape, chart.periodic, strict=True))
    return MeasuredBrdf(values, valid, axes, chart)


def _region(shape: tuple[int, int, int], axis: int, start: float, end: float) -> np.ndarray:
    share = np.indices(shape)[axis] / shape[axis]
    return (share >= start) & (share <= end)


HOLES = {
    "holes at random": (RUSINKIEWICZ, np.random.default_rng(3).uniform(size=(30, 30, 60)) < 0.9),
    "no small difference angles": (RUSINKIEWICZ, ~_region((30, 30, 60), 1, 0, 0.3)),
    "a measurement on the fit's own chart": (HALF_DIFF, ~_region((31, 31, 31), 0, 0.2, 0.5)),
    "the mirror side of a table of the paper's": (IN_OUT, _region((31, 31, 31), 2, 0.5, 1)),
}
each_hole = pytest.mark.parametrize("hole", HOLES)


class Blind(Brdf):
    """Grey, but blind in a region, where it answers nonsense."""

    def __init__(self, region: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> None:
        self.region = region

    def _evaluate(self, wi, wo):
        seen = ~self.region(wi, wo)
        return np.where(seen[:, None], GREY, WRONG) * np.ones(3), seen


REGIONS = {
    "light near the normal": lambda wi, wo: wi[:, 2] > 0.8,  # noqa: ARG005
    "the mirror side": lambda wi, wo: (wi[:, :2] * wo[:, :2]).sum(axis=1) < 0,
    "stripes": lambda wi, wo: np.floor(20 * wi[:, 2] * wo[:, 2]) % 2 == 0,
    "all but retro-reflection": lambda wi, wo: (wi * wo).sum(axis=1) < np.cos(0.2),
}


@each_chart
@pytest.mark.parametrize("region", REGIONS)
def test_what_was_not_measured_never_appears(region, chart):
    blind = Blind(REGIONS[region])
    samples = draw_samples(blind, chart, 3000)
    assert (samples.reflectance == GREY).all()
    for part in samples.parts:
        assert part.stop > part.start + 20
    assert len(samples.parameters) < sum(draw(blind, 3000).counts)


def test_nothing_measured_below_80_degrees_is_no_samples():
    samples = draw_samples(Blind(lambda wi, wo: np.maximum(wi[:, 2], wo[:, 2]) > 0.1), HALF_DIFF, 500)
    assert samples.parts == (slice(0, 0), slice(0, 0))
    assert samples.reflectance.shape == (0, 3)


@each_hole
def test_samples_are_those_of_the_drawn_pairs_that_can_be_trusted(hole):
    table = _holed(*HOLES[hole])
    pairs, samples = draw(table, 1500, 9), draw_samples(table, HALF_DIFF, 1500, 9)
    f, trusted = table.evaluate_trusted(pairs.wi, pairs.wo)
    np.testing.assert_array_equal(samples.parameters, HALF_DIFF.to_parameters(pairs.wi[trusted], pairs.wo[trusted]))
    np.testing.assert_allclose(samples.reflectance, f[trusted], rtol=1e-12)
    for cosine, w in zip(samples.cosines, (pairs.wi, pairs.wo), strict=True):
        np.testing.assert_array_equal(cosine[:, 0], w[trusted, 2])
    first = np.count_nonzero(trusted[pairs.parts()[0]])
    assert samples.parts == (slice(0, first), slice(first, np.count_nonzero(trusted)))


def _of_one_set(which: int) -> Samples:
    """Return samples of one of the sets alone."""
    samples = draw_samples(Glossy(0.3), HALF_DIFF, 400)
    part = samples.parts[which]
    count = part.stop - part.start
    parts = (slice(0, count), slice(count, count)) if which == 0 else (slice(0, 0), slice(0, count))
    cosines = samples.cosines[0][part], samples.cosines[1][part]
    return Samples(samples.parameters[part], samples.reflectance[part], cosines, parts, samples.weights[part])


@each_loss
@pytest.mark.parametrize("which", [0, 1], ids=["grid alone", "nodes alone"])
def test_an_empty_set_is_spoken_for_by_the_other(which, loss):
    samples = _of_one_set(which)
    errors = samples.errors(0.5 * samples.reflectance, loss)
    assert errors[0] == errors[1] > 0
    e = loss.transform(0.5 * samples.reflectance, *samples.cosines)
    assert errors[0] == loss.norm(e - loss.transform(samples.reflectance, *samples.cosines))
    assert np.isfinite(samples.metrics(errors, loss)).all()


@each_loss
def test_no_sample_at_all_is_no_error(loss):
    some = _of_one_set(0)
    nothing = slice(0, 0)
    none = Samples(
        some.parameters[:0],
        some.reflectance[:0],
        (some.cosines[0][:0], some.cosines[1][:0]),
        (nothing, nothing),
        some.weights[:0],
    )
    np.testing.assert_array_equal(none.errors(none.reflectance, loss), [0.0, 0.0])


@each_loss
def test_an_exact_model_has_no_error_and_a_shifted_one_the_errors_of_its_values(loss):
    """A constant model against a Lambertian: every error is known."""
    samples = draw_samples(Lambert(0.5), HALF_DIFF, 500)
    spline = TensorSpline((0, 0, 0), ([0, 1],) * 3, np.full((1, 1, 1, 3), np.cbrt(0.5 / np.pi)))
    np.testing.assert_allclose(samples.errors_of(spline, Root(), loss), 0.0, atol=1e-5)
    errors = samples.errors_of(spline.with_control(2 * spline.control), Root(), loss)
    c = samples.cosines
    f = np.full((len(c[0]), 3), 0.5 / np.pi)
    off = loss.transform(8 * f, *c) - loss.transform(f, *c)
    np.testing.assert_allclose(errors, [loss.norm(off[part]) for part in samples.parts], rtol=1e-9)


@each_chart
@pytest.mark.parametrize("count", [7, 400, 1003])
def test_splitting_loses_nothing_and_doubles_nothing(chart, count):
    samples = draw_samples(Glossy(0.3), chart, count, weights=lambda _chart, p: p[:, 0] + 0.1)
    fitted, judged = split(samples)
    total = len(samples.parameters)
    assert len(judged.parameters) == -(-total // JUDGE)
    for name in ("parameters", "reflectance", "weights"):
        whole, *both = (getattr(s, name) for s in (samples, fitted, judged))
        together = np.concatenate(both)
        assert together.shape == whole.shape
        for column in range(whole.shape[1]):
            np.testing.assert_array_equal(np.sort(together[:, column]), np.sort(whole[:, column]))
    # Rows stay together, and each stays in its set.
    for part in (fitted, judged):
        for ours, theirs in zip(part.parts, samples.parts, strict=True):
            rows = {tuple(p): i for i, p in enumerate(samples.parameters[theirs])}
            at = [rows[tuple(p)] for p in part.parameters[ours]]
            np.testing.assert_array_equal(part.weights[ours], samples.weights[theirs][at])
            if chart is IN_OUT:  # half-diff folds several pairs of one set to one place
                np.testing.assert_array_equal(part.reflectance[ours], samples.reflectance[theirs][at])
                for mine, whole in zip(part.cosines, samples.cosines, strict=True):
                    np.testing.assert_array_equal(mine[ours], whole[theirs][at])
    assert fitted.parts[1].stop == len(fitted.parameters)
    assert judged.parts[1].stop == len(judged.parameters)


def test_both_sets_take_part_in_both_halves():
    samples = draw_samples(Glossy(0.3), HALF_DIFF, 1000)
    for part, share in zip(split(samples), (1 - 1 / JUDGE, 1 / JUDGE), strict=True):
        for ours, all_of in zip(part.parts, samples.parts, strict=True):
            assert ours.stop - ours.start == pytest.approx(share * (all_of.stop - all_of.start), abs=1)


def test_weights_are_those_of_the_function():
    def weights(p: np.ndarray) -> np.ndarray:
        return p @ np.array([1.0, 2.0, 3.0])

    samples = draw_samples(Glossy(), HALF_DIFF, 300, weights=on_any_chart(weights))
    given = weights(samples.parameters)
    np.testing.assert_allclose(samples.weights[:, 0], given / given.max(), rtol=1e-15)
    assert (draw_samples(Glossy(), HALF_DIFF, 300).weights == 1).all()


@each_loss
def test_errors_count_by_their_weights(loss):
    """Weights that are whole numbers, the largest 3, are so many samples in one place."""
    samples = draw_samples(Glossy(0.3), HALF_DIFF, 200, weights=lambda _chart, p: np.floor(4 * p[:, 1]))
    times = np.rint(3 * samples.weights[:, 0]).astype(int)
    assert set(times) == {0, 1, 2, 3}
    f = samples.reflectance * np.random.default_rng(0).uniform(0.5, 1.5, samples.reflectance.shape)
    repeated = [np.repeat(a, times, axis=0) for a in (f, samples.reflectance, *samples.cosines)]
    off = loss.transform(repeated[0], *repeated[2:]) - loss.transform(repeated[1], *repeated[2:])
    first = int(times[samples.parts[0]].sum())
    expected = [loss.norm(off[:first]), loss.norm(off[first:])]
    np.testing.assert_allclose(samples.errors(f, loss), expected, rtol=1e-12)


@each_loss
def test_a_set_without_weight_is_spoken_for_by_the_other(loss):
    samples = draw_samples(Glossy(0.3), HALF_DIFF, 200)
    weights = np.ones_like(samples.weights)
    weights[samples.parts[0]] = 0
    heard = Samples(samples.parameters, samples.reflectance, samples.cosines, samples.parts, weights)
    f = 0.5 * samples.reflectance
    nodes = samples.errors(f, loss)[1]
    np.testing.assert_array_equal(heard.errors(f, loss), [nodes, nodes])


@pytest.mark.parametrize(
    "wrong",
    [
        lambda p: p,
        lambda p: 1.0,  # noqa: ARG005
        lambda p: np.full(len(p), -1.0),
        lambda p: np.full(len(p), np.nan),
        lambda p: np.full(len(p), np.inf),
    ],
    ids=["three a point", "one for all", "negative", "nan", "infinite"],
)
def test_weights_that_are_none_are_refused(wrong):
    refusal(lambda: draw_samples(Glossy(), HALF_DIFF, 300, weights=on_any_chart(wrong)))


def test_values_beyond_all_measure_are_capped():
    values = np.full((5, 5, 5, 3), 1e300)
    table = MeasuredBrdf(values, np.ones((5, 5, 5), bool), (np.linspace(0, 1, 5),) * 3, IN_OUT)
    assert draw_samples(table, HALF_DIFF, 100).reflectance.max() == LARGEST_REFLECTANCE


def test_larger_nets_get_more_samples_within_limits():
    counts = [samples_for(n) for n in (1, 10_000, 50_000, 10**8)]
    assert counts == sorted(counts)
    assert counts[0] == 100_000
    assert counts[2] == 300_000
    assert counts[3] == 600_000


@each_chart
def test_seeds_choose_the_samples(chart):
    first, again, other = (draw_samples(Glossy(), chart, 200, seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first.parameters, again.parameters)
    np.testing.assert_array_equal(first.reflectance, again.reflectance)
    assert not np.array_equal(first.parameters[:200], other.parameters[:200])
