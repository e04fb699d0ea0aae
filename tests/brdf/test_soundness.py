"""What a material never does and a model may: on nets made so that every figure is known."""

import functools
import json

import numpy as np
import pytest

from bvbedit.brdf.analytic import Lambert
from bvbedit.brdf.charts import HALF_DIFF, IN_OUT, Chart
from bvbedit.brdf.encodings import Encoding, Linear, Log, Root
from bvbedit.brdf.geometry import elevation
from bvbedit.brdf.losses import LOSSES
from bvbedit.brdf.plan import plan
from bvbedit.brdf.problem import tabulate
from bvbedit.brdf.sample_sets import draw
from bvbedit.brdf.soundness import soundness
from bvbedit.brdf.spline_brdf import SplineBrdf, keep_faces
from bvbedit.spline.knots import clamped
from bvbedit.spline.tensor import TensorSpline
from tests.brdf.samples import Glossy


def _linear(a: float, b: float, c: float, chart: Chart = IN_OUT, encoding: Encoding | None = None) -> SplineBrdf:
    """Return the model whose encoded value is a + b u + c v."""
    i, j, _ = np.indices((2, 2, 2))
    control = (a + b * i + c * j)[..., None] * np.ones(3)
    return SplineBrdf(TensorSpline((1, 1, 1), (clamped([], 1),) * 3, control), chart, encoding or Linear())


def _constant(value: float, chart: Chart = HALF_DIFF) -> SplineBrdf:
    return _linear(value, 0.0, 0.0, chart)


@functools.cache
def _fitted(size: tuple[int, int, int] = (16, 12, 5), chart: Chart = HALF_DIFF) -> SplineBrdf:
    axes = tuple(np.linspace(0, 1, n) for n in (46, 31, 13))
    made = plan(
        tabulate(Glossy(0.2), chart, axes),
        Root(),
        LOSSES["log_cosine_rms"],
        (1.0, 1.0),
        degrees=(3, 3, 3),
        placement="dominant",
        points=2000,
    )
    return SplineBrdf(made.lofted(size), chart, Root())


@pytest.mark.parametrize("seed", range(3))
def test_a_half_diff_model_is_reciprocal_whatever_its_net(seed):
    control = np.random.default_rng(seed).uniform(-1, 2, (7, 6, 5, 3))
    knots = (clamped([0.2, 0.5, 0.6], 3), clamped([0.3, 0.9], 3), clamped([0.7], 3))
    model = SplineBrdf(TensorSpline((3, 3, 3), knots, keep_faces(control, HALF_DIFF)), HALF_DIFF, Root())
    assert soundness(model)["reciprocity"] == 0
    assert soundness(model, Glossy())["reciprocity"] == 0
    wi, wo = (w[:200] for w in (draw(model, 200).wi, draw(model, 200).wo))
    np.testing.assert_allclose(model.evaluate(wi, wo), model.evaluate(wo, wi), rtol=1e-9, atol=1e-12)


def test_an_in_out_model_may_be_reciprocal():
    assert soundness(_linear(0.2, 0.3, 0.3))["reciprocity"] < 1e-9


def test_the_reciprocity_error_is_how_much_exchanging_changes():
    """f = a + b theta_i + c theta_o, in quarters of a turn: exchanged, the two trade places."""
    a, b, c = 0.1, 0.8, 0.2
    pairs = draw(_linear(a, b, c), 20_000, seed=9)
    i, o = (elevation(w)[:, None] / (np.pi / 2) for w in (pairs.wi, pairs.wo))
    cosines = pairs.wi[:, 2:] * pairs.wo[:, 2:]
    there, back = (np.log(1 + cosines * (a + b * x + c * y)) for x, y in ((i, o), (o, i)))
    # Two times 1500 pairs are looked at.
    assert soundness(_linear(a, b, c))["reciprocity"] == pytest.approx(np.sqrt(np.mean((there - back) ** 2)), rel=0.05)


@pytest.mark.parametrize("steeper", [0.2, 0.4])
def test_more_asymmetry_is_more_error(steeper):
    errors = [soundness(_linear(0.1, b, 0.1))["reciprocity"] for b in (0.1, 0.1 + steeper, 0.1 + 2 * steeper)]
    assert errors[0] < 1e-9
    assert 0 < errors[1] < errors[2]


@pytest.mark.parametrize("zero_at", [30.0, 45.0, 70.0])
def test_the_negative_share_is_that_of_the_pairs_beyond_the_zero(zero_at):
    """A value that passes zero where theta_i is so many degrees, evenly falling."""
    model = _linear(1.0, -90 / zero_at, 0.0)
    told = soundness(model)
    pairs = draw(model, 20_000, seed=9)
    expected = np.mean(elevation(pairs.wi) > np.radians(zero_at))
    assert told["negative"] == pytest.approx(expected, abs=0.02)
    assert told["lowest"] == pytest.approx(1 - 80 / zero_at, abs=0.02)


def test_channels_count_each():
    model = _linear(1.0, 0.0, 0.0)
    control = model.spline.control * np.array([1.0, -1.0, 1.0])
    told = soundness(model.with_spline(model.spline.with_control(control)))
    assert told["negative"] == pytest.approx(1 / 3, abs=1e-12)
    assert told["lowest"] == pytest.approx(-1.0)


@pytest.mark.parametrize("chart", [IN_OUT, HALF_DIFF], ids=lambda c: c.name)
def test_a_sound_model_has_nothing_to_tell(chart):
    told = soundness(_constant(0.5 / np.pi, chart), Lambert(0.5))
    assert told["negative"] == 0
    assert told["lowest"] == pytest.approx(0.5 / np.pi)
    assert max(told[name] for name in ("reciprocity", "overshoot_grid", "overshoot_nodes")) < 1e-9


@pytest.mark.parametrize("encoding", [Linear(), Root(), Log()], ids=repr)
@pytest.mark.parametrize("off", [0.5, 2.0])
def test_outside_the_range_of_a_flat_reference_all_error_is_overshoot(off, encoding):
    """Too bright or too dark by a factor, against a Lambertian: the error of each set itself."""
    model = _linear(float(encoding.encode(np.array(off * 0.5 / np.pi))), 0, 0, HALF_DIFF, encoding)
    told = soundness(model, Lambert(0.5))
    pairs = draw(model, 20_000, seed=9)
    c = pairs.wi[:, 2] * pairs.wo[:, 2]
    error = np.log((1 + c * off * 0.5 / np.pi) / (1 + c * 0.5 / np.pi))
    for name, part in zip(("overshoot_grid", "overshoot_nodes"), pairs.parts(), strict=True):
        assert told[name] == pytest.approx(np.sqrt(np.mean(error[part] ** 2)), rel=0.03)


def test_a_model_within_the_range_of_its_neighbourhood_does_not_overshoot():
    """A good fit of a smooth lobe is off by less than the lobe changes over a node's distance."""
    told = soundness(_fitted((24, 18, 6)), Glossy(0.2))
    coarse = soundness(_fitted((5, 5, 4)), Glossy(0.2))
    assert told["overshoot_grid"] < 0.1 * coarse["overshoot_grid"]
    assert told["overshoot_nodes"] < 0.1 * coarse["overshoot_nodes"]


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("chart", [IN_OUT, HALF_DIFF], ids=lambda c: c.name)
def test_rings_are_caught(chart, axis):
    """Control points alternately lifted and lowered along an axis, by a tenth of what they are."""
    size = (12, 12, 6)
    clean = _fitted(size, chart)
    sign = np.where(np.indices(size)[axis] % 2, 1.1, 0.9)[..., None]
    ringing = clean.with_spline(clean.spline.with_control(keep_faces(clean.spline.control * sign, chart)))
    before, after = (soundness(m, Glossy(0.2)) for m in (clean, ringing))
    assert after["overshoot_grid"] > 2 * before["overshoot_grid"]
    assert after["overshoot_nodes"] > 2 * before["overshoot_nodes"]


def test_without_a_reference_nothing_is_said_of_overshoot():
    assert set(soundness(_fitted())) == {"negative", "lowest", "reciprocity"}


def test_figures_are_numbers_that_json_holds():
    told = soundness(_fitted(), Glossy(0.2))
    assert json.loads(json.dumps(told, allow_nan=False)) == told


def test_it_says_the_same_every_time():
    assert soundness(_fitted(), Glossy(0.2)) == soundness(_fitted(), Glossy(0.2))


@pytest.mark.parametrize("value", [-1e300, 0.0, 1e300])
def test_extreme_nets_are_told_without_a_warning(value):
    with np.errstate(all="raise", under="ignore"):
        told = soundness(_constant(value), Lambert(0.5))
    assert np.isfinite(list(told.values())).all()
    assert told["negative"] == (value < 0)
