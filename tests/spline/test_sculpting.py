"""Direct manipulation: targets are met with the least change, and regions are scaled where they lie."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bvbedit.spline.knots import clamped
from bvbedit.spline.sculpting import move_points, scale_region
from bvbedit.spline.tensor import TensorSpline
from tests.spline import naive
from tests.spline.refusals import refusal


def _volume(rng: np.random.Generator, degrees=(2, 3, 1), size=(5, 6, 4), channels=3) -> TensorSpline:
    knots = [naive.random_knots(rng, p, n) for p, n in zip(degrees, size, strict=True)]
    return TensorSpline(degrees, knots, rng.normal(size=(*size, channels)))


def _rows(spline: TensorSpline, x: np.ndarray) -> np.ndarray:
    """What each control point counts at each of the points, from the definition."""
    unit = np.eye(int(np.prod(spline.size))).reshape(*spline.size, -1)
    return naive.evaluate(spline.degrees, spline.knots, unit, x)


@given(st.integers(1, 6), st.integers(0, 3), st.integers(0, 2**32 - 1))
def test_targets_are_met_points_to_keep_stay_and_no_smaller_change_does_it(count, kept, seed):
    rng = np.random.default_rng(seed)
    spline = _volume(rng)
    x, still = rng.uniform(size=(count, 3)), rng.uniform(size=(kept, 3))
    targets = rng.normal(size=(count, 3))
    moved = move_points(spline, x, targets, keep=still)
    np.testing.assert_allclose(moved.evaluate(x), targets, rtol=0, atol=1e-8)
    if kept:
        np.testing.assert_allclose(moved.evaluate(still), spline.evaluate(still), rtol=0, atol=1e-8)
    rows = _rows(spline, np.concatenate([x, still]))
    change = np.concatenate([targets - spline.evaluate(x), np.zeros((kept, 3))])
    least = np.linalg.pinv(rows, rcond=1e-10) @ change
    delta = (moved.control - spline.control).reshape(len(least), 3)
    np.testing.assert_allclose(delta, least, rtol=0, atol=1e-8 * max(1, np.abs(least).max()))


def test_only_control_points_that_the_point_sees_move(rng):
    spline = _volume(rng, (3, 3, 3), (9, 9, 9))
    x = np.array([[0.01, 0.5, 0.99]])
    moved = move_points(spline, x, spline.evaluate(x) + 1)
    changed = (moved.control != spline.control).any(axis=-1)
    assert 0 < changed.sum() <= 64
    assert (changed.reshape(-1) <= (_rows(spline, x)[0] != 0)).all()


def test_a_projection_keeps_what_it_keeps(rng):
    spline = _volume(rng)

    def even(net: np.ndarray) -> np.ndarray:
        out = net.copy()
        out[0] = out[0].mean(axis=1, keepdims=True)
        return out

    x = np.array([[0.02, 0.4, 0.6], [0.7, 0.1, 0.2]])
    moved = move_points(spline, x, [[1.0, 2, 3], [4, 5, 6]], project=even)
    np.testing.assert_allclose(moved.evaluate(x), [[1, 2, 3], [4, 5, 6]], atol=1e-9)
    change = moved.control - spline.control
    np.testing.assert_allclose(change[0], np.broadcast_to(change[0].mean(axis=1, keepdims=True), change[0].shape))


def test_targets_that_repeat_are_met_and_those_that_contradict_are_refused(rng):
    spline = _volume(rng)
    x = np.array([[0.3, 0.3, 0.3]] * 2)
    np.testing.assert_allclose(move_points(spline, x, np.ones((2, 3))).evaluate(x), 1, atol=1e-9)
    assert "target" in refusal(lambda: move_points(spline, x, [[0.0] * 3, [1.0] * 3]))
    refusal(lambda: move_points(spline, x[:1], [[9.0] * 3], keep=x[:1]))


def test_a_region_is_scaled_by_its_greville_abscissae(rng):
    spline = _volume(rng, (1, 1), (11, 6), 2)
    spline = TensorSpline(
        (1, 1), (clamped(np.linspace(0, 1, 11)[1:-1], 1), clamped([0.2, 0.4, 0.6, 0.8], 1)), spline.control
    )
    box = [(0.3, 0.5), (0.0, 0.41)]
    scaled = scale_region(spline, box, [3.0, 1.0])
    inside = np.zeros((11, 6), dtype=bool)
    inside[3:6, :3] = True
    np.testing.assert_array_equal(scaled.control[inside], spline.control[inside] * (3.0, 1.0))
    np.testing.assert_array_equal(scaled.control[~inside], spline.control[~inside])
    soft = scale_region(spline, box, 3.0, falloff=(0.2, 0.0))
    factor = soft.control[:, 0, 0] / spline.control[:, 0, 0]
    # Smoothstep: half of the gain half of the way out, nothing beyond.
    np.testing.assert_allclose(factor, [1, 1, 2, 3, 3, 3, 2, 1, 1, 1, 1], rtol=1e-12)
    np.testing.assert_array_equal(scale_region(spline, box, 1.0, 0.3).control, spline.control)


@pytest.mark.parametrize(
    ("call", "word"),
    [
        (lambda s: move_points(s, np.empty((0, 3)), np.empty((0, 3))), "at least one"),
        (lambda s: move_points(s, [[0.5, 0.5]], [[1.0] * 3]), "(1, 2)"),
        (lambda s: move_points(s, [[0.5] * 3], [[1.0] * 2]), "(1, 2)"),
        (lambda s: move_points(s, [[0.5, 0.5, 1.5]], [[1.0] * 3]), "1.5"),
        (lambda s: move_points(s, [[0.5, 0.5, np.nan]], [[1.0] * 3]), "nan"),
        (lambda s: move_points(s, [[0.5] * 3], [[1.0, np.inf, 0.0]]), "inf"),
        (lambda s: move_points(s, [[0.5] * 3], [[1.0] * 3], keep=[[2.0] * 3]), "2.0"),
        (lambda s: move_points(s, [[0.5] * 3], [[1.0] * 3], keep=[[0.1, 0.2]]), "(1, 2)"),
        (lambda s: move_points(s, [[0.5] * 3], [[1.0] * 3], keep=[0.1, 0.2, 0.3]), "(3,)"),
        (lambda s: move_points(s, "here", [[1.0] * 3]), "'here'"),
        (lambda s: scale_region(s, [(0, 1)] * 2, 2.0), "3 intervals"),
        (lambda s: scale_region(s, [(0, 1), (0, 1), (0.5, 2)], 2.0), "Axis 2"),
        (lambda s: scale_region(s, [(0, 1), (0, 1), (0.501, 0.502)], 2.0), "No control point"),
        (lambda s: scale_region(s, [(0, 1)] * 3, np.nan), "nan"),
        (lambda s: scale_region(s, [(0, 1)] * 3, [1.0, 2.0]), "Gain"),
        (lambda s: scale_region(s, [(0, 1)] * 3, 2.0, -0.1), "-0.1"),
        (lambda s: scale_region(s, [(0, 1)] * 3, 2.0, [0.1, 0.1]), "Falloff"),
        (lambda s: scale_region(s, [(0, 1)] * 3, 2.0, [0.1, np.nan, 0.1]), "Falloff"),
        (lambda s: scale_region(s, [(0, 1)] * 3, 2.0, np.inf), "inf"),
    ],
)
def test_what_makes_no_sense_is_refused(call, word, rng):
    spline = TensorSpline((1, 1, 1), (clamped([0.3], 1),) * 3, rng.normal(size=(3, 3, 3, 3)))
    message = refusal(lambda: call(spline))
    assert word in message, message
