"""How large a net has to be: on curves whose knee and noise are known, and on nets that are really fitted."""

import functools
import json
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bvbedit.brdf.charts import HALF_DIFF
from bvbedit.brdf.encodings import Root
from bvbedit.brdf.losses import LOSSES
from bvbedit.brdf.plan import Plan, plan
from bvbedit.brdf.problem import tabulate
from bvbedit.brdf.samples import Samples, draw_samples
from bvbedit.brdf.sizing import (
    AS_GOOD,
    UNSEEN,
    WORTH_DOUBLING,
    Step,
    error_curve,
    knee,
    points_for,
    step_of,
    sufficient,
)
from tests.brdf.samples import Glossy

LOG_COSINE = LOSSES["log_cosine_rms"]


def _curve(errors: list[float], noise: float = 0.0, apart: float = 3.0) -> list[Step]:
    """Return a curve whose control points double, with these errors, noise added in squares; nodes err more."""
    signal = [np.hypot(e, noise) for e in errors]
    return [Step((2**i, 5, 25), float(e), float(apart * e)) for i, e in enumerate(signal)]


def _falling(length: int, share: float, start: float = 1.0) -> list[float]:
    """Return errors of which each doubling takes away ``share``."""
    return [start * (1 - share) ** i for i in range(length)]


def test_the_score_is_the_geometric_mean_and_points_the_product():
    step = Step((3, 4, 5), 0.02, 0.08)
    assert step.points == 60
    assert step.score() == pytest.approx(0.04)
    assert step.score((0.012, 0.0)) == pytest.approx(np.sqrt(0.016 * 0.08))


@pytest.mark.parametrize("noise", [(1.0, 1.0), (0.02, 0.08), (0.0, 1.0)])
def test_noise_never_explains_all_of_an_error(noise):
    assert 0 < Step((3, 4, 5), 0.02, 0.08).score(noise) <= 0.04


@pytest.mark.parametrize("at", [0, 1, 4, 8])
def test_the_knee_is_where_the_error_stops_falling(at):
    falling = _falling(at + 1, 0.4)
    curve = _curve(falling + _falling(10 - at, 0.05, falling[-1])[1:])
    assert knee(curve) is curve[at]


@given(share=st.floats(0.0, 0.9), length=st.integers(2, 10))
def test_a_curve_that_falls_evenly_is_worth_all_or_nothing(share, length):
    curve = _curve(_falling(length, share, 1e6))
    if abs(share - WORTH_DOUBLING) > 1e-6:
        assert knee(curve) is curve[-1 if share > WORTH_DOUBLING else 0]


def test_errors_that_nobody_sees_are_worth_no_control_points():
    curve = _curve(_falling(14, 0.6, 1.0), apart=1.0)
    assert knee(curve).grid <= UNSEEN < curve[curve.index(knee(curve)) - 1].grid
    assert sufficient(curve) is curve[-1]


def test_a_late_fall_after_a_flat_stretch_is_worth_it():
    """A feature narrower than any knot span so far shows only when it is resolved."""
    curve = _curve([1.0, 0.99, 0.98, 0.5, 0.49])
    assert knee(curve) is curve[3]


def test_steps_that_are_more_or_less_than_a_doubling_count_by_their_size():
    """Four times the points for 0.8 of the error are no two doublings of 0.85 each, and half a doubling for it is."""
    assert knee([Step((1, 5, 25), 1.0, 1.0), Step((4, 5, 25), 0.8, 0.8)]).points == 125
    assert knee([Step((10, 5, 25), 1.0, 1.0), Step((14, 5, 25), 0.8, 0.8)]).points == 14 * 125
    assert knee([Step((10, 5, 25), 1.0, 1.0), Step((14, 5, 25), 0.95, 0.95)]).points == 1250


@pytest.mark.parametrize("at", [2, 4, 6])
def test_noise_that_is_known_does_not_hide_the_knee(at):
    """The error measured levels off at the noise; what is left without it falls on to the knee."""
    falling = _falling(at + 1, 0.4)
    errors = falling + _falling(9 - at, 0.05, falling[-1])[1:]
    noise = 2 * falling[-1]
    curve = _curve(errors, noise)
    assert knee(curve, (noise, 3 * noise)) is curve[at]
    assert knee(curve).points < curve[at].points


def test_a_single_net_is_its_own_knee():
    (step,) = _curve([0.5])
    assert knee([step]) is step
    assert sufficient([step]) is step


@given(st.lists(st.floats(1e-6, 1e3), min_size=1, max_size=12))
def test_the_sufficient_net_is_the_smallest_that_is_as_good_as_the_best(errors):
    curve = _curve(errors)
    found = curve.index(sufficient(curve))
    best = min(errors)
    assert errors[found] <= (1 + AS_GOOD) * best * (1 + 1e-9)
    assert all(e > (1 + AS_GOOD) * best * (1 - 1e-9) for e in errors[:found])


def test_a_larger_net_without_effect_is_not_needed():
    curve = _curve([1.0, 0.5, 0.3, 0.3 * (1 - 0.5 * AS_GOOD), 0.31])
    assert sufficient(curve) is curve[2]


@given(exponent=st.floats(0.2, 1.5), share=st.floats(0.01, 0.99))
def test_the_points_for_a_tolerance_are_those_of_the_power_law_that_the_curve_follows(exponent, share):
    points = 125.0 * 2.0 ** np.arange(9)
    curve = _curve(list((points / 125) ** -exponent))
    # The metric over both sets is to be within: that of the nodes is larger.
    tolerance = 3 * 256 ** (-exponent * share)
    expected = 125 * 256**share
    assert points_for(curve, tolerance) == pytest.approx(expected, rel=0.01, abs=1)


def test_tolerances_beyond_the_curve_ask_for_its_ends():
    curve = _curve([1.0, 0.5, 0.25])
    assert points_for(curve, 100.0) == 125
    assert points_for(curve, 3.0) == 125
    assert points_for(curve, 0.01) == 2 * 500
    assert points_for(_curve([0.0, 0.0]), 1e-9) == 125


def test_a_curve_that_rises_again_is_met_where_it_first_passes():
    assert 125 < points_for(_curve([1.0, 0.2, 0.6, 0.1]), 1.5) < 250


@functools.cache
def _fitted() -> tuple[Plan, Samples]:
    table = tabulate(Glossy(0.25), HALF_DIFF, tuple(np.linspace(0, 1, n) for n in (46, 31, 13)))
    made = plan(table, Root(), LOG_COSINE, (1.0, 1.0), degrees=(3, 3, 3), placement="dominant", points=4000)
    return made, draw_samples(Glossy(0.25), HALF_DIFF, 3000, seed=5)


@pytest.mark.parametrize("most", [64, 125, 300, 2500])
def test_a_curve_is_made_of_nets_that_double_up_to_the_last_that_is_allowed(most):
    made, samples = _fitted()
    curve = error_curve(made, samples, most)
    points = [step.points for step in curve]
    assert points == sorted(set(points))
    assert points[-1] == max(np.prod(size) for size in made.walk(most)) <= max(most, 64)
    for smaller, larger in pairwise(points[:-1]):
        assert 1.3 < larger / smaller < 3
    assert {step.size for step in curve} <= set(made.walk(most))


def test_the_curve_falls_as_nets_grow():
    made, samples = _fitted()
    scores = [step.score() for step in error_curve(made, samples, 2500)]
    assert len(scores) >= 5
    assert (np.diff(scores) < 0).all()
    assert scores[-1] < 0.1 * scores[0]


def test_a_step_is_what_the_quick_fit_of_that_size_is_off_by():
    made, samples = _fitted()
    step = step_of(made, samples, (10, 8, 5))
    f = Root().decode(made.lofted((10, 8, 5)).evaluate(samples.parameters))
    c = samples.cosines[0] * samples.cosines[1]
    off = np.log(1 + c * f) - np.log(1 + c * samples.reflectance)
    rms = [float(np.sqrt(np.mean(off[part] ** 2))) for part in samples.parts]
    assert (step.grid, step.nodes) == pytest.approx(rms, rel=1e-9)
    assert json.loads(json.dumps(step.to_dict())) == {
        "size": [10, 8, 5],
        "grid": float(f"{rms[0]:.3g}"),
        "nodes": float(f"{rms[1]:.3g}"),
    }
