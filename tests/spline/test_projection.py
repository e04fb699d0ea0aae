"""Local projection: splines come back as they were, changes stay where they are, jumps do not ring far."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bvbedit.spline.knots import clamped
from bvbedit.spline.projection import OVERSHOOT, project, projector
from bvbedit.spline.tensor import TensorSpline
from tests.spline.drawn import splines, tame_knots


@given(st.data(), st.sampled_from([0, 1, 2, 3, 3, 5, 7]))
def test_control_points_are_read_off_the_values_of_a_spline(data, degree):
    knots = data.draw(tame_knots(degree))
    points, matrix = projector(knots, degree)
    assert (np.diff(points) > 0).all()
    assert knots[0] < points[0]
    assert points[-1] < knots[-1]
    control = np.random.default_rng(data.draw(st.integers(0, 99))).normal(size=(len(knots) - degree - 1, 2))
    values = TensorSpline((degree,), (knots,), control).evaluate_grid([points])
    # Knots near 1e6 are rounded to 1e-10, of spans 1/16 wide 2e-9.
    np.testing.assert_allclose(matrix.apply(values, 0), control, rtol=0, atol=1e-6)


@given(splines(tame=True, highest=5))
@settings(max_examples=60)
def test_a_spline_comes_back_as_it_was(spline):
    again = project(spline.evaluate_grid, spline.knots, spline.degrees)
    np.testing.assert_allclose(again.control, spline.control, rtol=0, atol=1e-5)


@pytest.mark.parametrize("parameters", [1, 2, 3])
def test_a_net_like_a_chessboard_comes_back_too(parameters):
    knots = [clamped(np.arange(1, 6) / 6, 3)] * parameters
    control = (-1.0) ** np.indices((9,) * parameters).sum(axis=0)[..., None]
    spline = TensorSpline((3,) * parameters, knots, control)
    np.testing.assert_allclose(project(spline.evaluate_grid, knots, (3,) * parameters).control, control, atol=1e-11)


def test_a_change_stays_within_the_supports_that_it_meets(rng):
    spline = TensorSpline((3, 2), (clamped(np.arange(1, 9) / 9, 3), clamped([0.5], 2)), rng.normal(size=(12, 4, 1)))

    def change(axes):
        u = axes[0][:, None, None]
        inside = (u > 4 / 9) & (u < 5 / 9)
        return np.where(inside, np.sin(40 * u), 0.0) * np.ones((1, len(axes[1]), 1))

    net = project(change, spline.knots, spline.degrees).control
    meets = [(a < 5 / 9) and (b > 4 / 9) for a, b in zip(spline.knots[0][:-4], spline.knots[0][4:], strict=True)]
    assert net[meets].any()
    assert not net[~np.array(meets)].any()


@given(st.floats(0.01, 0.99), st.floats(-5, 5), st.floats(-5, 5))
def test_control_points_beside_a_jump_leave_its_range_by_no_more_than_told(at, before, after):
    knots = clamped(np.arange(1, 10) / 10, 3)
    net = project(lambda axes: np.where(axes[0] < at, before, after)[:, None], [knots], [3]).control
    low, high = min(before, after), max(before, after)
    margin = OVERSHOOT * (high - low) + 1e-12
    assert low - margin <= net.min()
    assert net.max() <= high + margin


def test_a_smooth_function_is_met_to_fourth_order():
    def missed(parts):
        spline = project(
            lambda axes: np.exp(np.sin(3 * axes[0]))[:, None], [clamped(np.arange(1, parts) / parts, 3)], [3]
        )
        x = np.linspace(0, 1, 1001)
        return np.abs(spline.evaluate_grid([x])[:, 0] - np.exp(np.sin(3 * x))).max()

    assert 12 < missed(16) / missed(32) < 20
    assert missed(32) < 1e-5
