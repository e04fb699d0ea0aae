"""Splines brought over the same knots, and mixed: each is the function it was, and every mixture what it says."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bvbedit.spline.compatible import KNOT_TOLERANCE, MergedKnot, blend, combine, make_compatible
from bvbedit.spline.knots import clamped
from bvbedit.spline.tensor import TensorSpline
from tests.spline.drawn import (
    DOMAINS,
    EPS,
    assert_ones,
    assert_same,
    largest,
    looks,
    ones,
    pairs,
    random_spline,
    splines,
)
from tests.spline.refusals import refusal


@settings(max_examples=50)
@given(pairs(), st.data())
def test_compatible_splines_have_equal_degrees_and_knots_and_are_who_they_were(pair, data):
    domain = pair[0].domain
    third = data.draw(splines(tame=True, domain=domain))
    given_ = (*pair, third)
    out, merged = make_compatible(*given_)
    assert merged == ()
    for s in out:
        assert s.degrees == tuple(max(p) for p in zip(*(g.degrees for g in given_), strict=True))
        for t, first, own in zip(s.knots, out[0].knots, zip(*(g.knots for g in given_), strict=True), strict=True):
            np.testing.assert_array_equal(t, first)
            assert set(t) == set(np.concatenate(own))
    for before, after in zip(given_, out, strict=True):
        assert_same(before, after)
        assert before.domain == after.domain
    # Of each knot there are as many copies as one of the splines needs, and no more.
    for axis in range(third.parameters):
        degree = out[0].degrees[axis]
        for v in np.unique(out[0].knots[axis]):
            copies = [
                np.sum(g.knots[axis] == v) + degree - g.degrees[axis] if (g.knots[axis] == v).any() else 0
                for g in given_
            ]
            assert np.sum(out[0].knots[axis] == v) == max(copies)
    for s in make_compatible(*(ones(g) for g in given_))[0]:
        assert_ones(s)


@settings(max_examples=50)
@given(st.data(), st.sampled_from(DOMAINS))
def test_knots_equal_up_to_rounding_are_merged_reported_and_change_next_to_nothing(data, domain):
    a = data.draw(splines(tame=True, domain=[domain], channels=2, highest=5))
    t = a.knots[0].copy()
    unit = np.spacing(max(np.abs(domain)))
    inside = np.unique(t[(t > t[0]) & (t < t[-1])])
    moves = {float(v): data.draw(st.integers(-8, 8)) * unit for v in inside}
    moved = np.array([v + moves.get(float(v), 0.0) for v in t])
    b = TensorSpline(a.degrees, (moved,), a.control)
    (first, second), merged = make_compatible(a, b)
    np.testing.assert_array_equal(first.knots[0], a.knots[0])
    np.testing.assert_array_equal(second.knots[0], a.knots[0])
    expected = [MergedKnot(1, 0, float(v), float(v + m)) for v, m in sorted(moves.items()) if float(v + m) != float(v)]
    assert list(merged) == expected
    np.testing.assert_array_equal(second.control, b.control)
    # The other way round it is the first that leads.
    _, back = make_compatible(b, a)
    assert [(m.kept, m.replaced) for m in back] == [(m.replaced, m.kept) for m in merged]


def test_of_two_knots_nearby_only_the_nearer_is_taken_for_one():
    u = float(np.spacing(0.5))
    a = TensorSpline((2,), (clamped([0.5], 2),), np.arange(4.0)[:, None])
    b = TensorSpline((2,), (clamped([0.5 - u, 0.5 + 2 * u], 2),), np.arange(5.0)[:, None])
    (first, second), merged = make_compatible(a, b)
    assert merged == (MergedKnot(1, 0, 0.5, 0.5 - u),)
    assert first.knots[0].tolist() == second.knots[0].tolist() == clamped([0.5, 0.5 + 2 * u], 2).tolist()
    (first, _), merged = make_compatible(b, a)
    assert merged == (MergedKnot(1, 0, 0.5 - u, 0.5),)
    np.testing.assert_array_equal(first.knots[0], b.knots[0])


@pytest.mark.parametrize(
    ("apart", "tolerance", "one"),
    [
        (KNOT_TOLERANCE / 2, KNOT_TOLERANCE, True),
        (KNOT_TOLERANCE * 2, KNOT_TOLERANCE, False),
        (1e-6, 2e-6, True),
        (1e-6, 5e-7, False),
        (2.0**-53, 0.0, False),
    ],
)
def test_knots_are_one_within_the_tolerance_and_two_beyond(apart, tolerance, one):
    a = TensorSpline((3,), (clamped([0.5], 3),), np.arange(5.0)[:, None])
    b = TensorSpline((3,), (clamped([0.5 - apart], 3),), np.arange(5.0)[:, None])
    (first, second), merged = make_compatible(a, b, tolerance=tolerance)
    assert len(merged) == int(one)
    assert first.size == second.size == ((5,) if one else (6,))


def test_ends_that_differ_by_rounding_become_those_of_the_first():
    end = float(np.nextafter(1, 2))
    a = TensorSpline((2,), (clamped([0.5], 2),), np.arange(4.0)[:, None])
    b = TensorSpline((2,), (clamped([0.25], 2, 0.0, end),), np.arange(4.0)[:, None])
    (first, second), merged = make_compatible(a, b)
    assert first.domain == second.domain == a.domain
    assert merged == (MergedKnot(1, 0, 1.0, end),)


def test_one_spline_is_compatible_with_itself(rng):
    spline = random_spline(rng, (3, 2), (5, 6), 2)
    (same, again), merged = make_compatible(spline, spline)
    assert merged == ()
    for s in (same, again, *make_compatible(spline)[0]):
        np.testing.assert_array_equal(s.control, spline.control)


@settings(max_examples=50)
@given(pairs(), st.floats(-2, 3))
def test_a_blend_is_affine_in_its_share_and_ends_at_the_splines_to_the_bit(pair, t):
    a, b = pair
    (one, other), _ = make_compatible(a, b)
    np.testing.assert_array_equal(blend(a, b, 0).control, one.control)
    np.testing.assert_array_equal(blend(a, b, 1.0).control, other.control)
    mixed = blend(a, b, t)
    scale = (abs(t) + abs(1 - t)) * (largest(a) + largest(b))
    np.testing.assert_allclose(
        mixed.control, one.control + t * (other.control - one.control), rtol=0, atol=16 * EPS * scale
    )
    axes = looks(a, b)
    expected = (1 - t) * a.evaluate_grid(axes) + t * b.evaluate_grid(axes)
    np.testing.assert_allclose(mixed.evaluate_grid(axes), expected, rtol=0, atol=128 * EPS * scale)
    half = blend(blend(a, b, 0.0), blend(a, b, t), 0.5)
    np.testing.assert_allclose(half.control, blend(a, b, t / 2).control, rtol=0, atol=16 * EPS * scale)
    assert_ones(blend(ones(a), ones(b), t), 16 * (1 + abs(t)))


@given(pairs(highest=5))
def test_each_channel_has_its_own_share(pair):
    a, b = pair
    shares = np.linspace(-0.5, 1.0, a.channels)
    mixed = blend(a, b, shares)
    for c, t in enumerate(shares):
        np.testing.assert_array_equal(mixed.control[..., c], blend(a, b, float(t)).control[..., c])


@settings(max_examples=40)
@given(pairs(highest=3), st.data())
def test_a_share_that_differs_from_place_to_place_is_the_pointwise_mixture(pair, data):
    a, b = pair
    channels = data.draw(st.sampled_from([1, a.channels]))
    t = data.draw(splines(tame=True, domain=a.domain, channels=channels, highest=3))
    mixed = blend(a, b, t)
    assert mixed.degrees == tuple(max(p, q) + r for p, q, r in zip(a.degrees, b.degrees, t.degrees, strict=True))
    axes = looks(a, b)
    share = t.evaluate_grid(axes)
    expected = (1 - share) * a.evaluate_grid(axes) + share * b.evaluate_grid(axes)
    scale = (1 + largest(t)) * (largest(a) + largest(b))
    np.testing.assert_allclose(mixed.evaluate_grid(axes), expected, rtol=0, atol=1e-11 * scale)


@settings(max_examples=40)
@given(pairs(), st.data())
def test_a_combination_is_the_weighted_sum_of_the_values(pair, data):
    a, b = pair
    c = data.draw(splines(tame=True, domain=a.domain, channels=a.channels))
    weights = [2.0, np.linspace(-1, 1, a.channels), [-0.5]]
    mixed = combine([a, b, c], weights)
    axes = looks(a, b, c)
    expected = sum(np.asarray(w) * s.evaluate_grid(axes) for w, s in zip(weights, (a, b, c), strict=True))
    scale = 4 * max(map(largest, (a, b, c)))
    np.testing.assert_allclose(mixed.evaluate_grid(axes), expected, rtol=0, atol=128 * EPS * scale)
    np.testing.assert_array_equal(combine([a, a], [1, -1]).control, np.zeros_like(a.control))
    assert_ones(combine([ones(a), ones(b), ones(c)], [0.25, 0.25, 0.5]))


def _curve(channels: int = 2, end: float = 1.0) -> TensorSpline:
    return TensorSpline((2,), (clamped([0.5 * end], 2, 0.0, end),), np.ones((4, channels)))


def _surface() -> TensorSpline:
    return TensorSpline((1, 1), (clamped([], 1), clamped([], 1)), np.ones((2, 2, 2)))


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (make_compatible, ["No spline"]),
        (lambda: make_compatible(_curve(), _surface()), ["Spline 1", "2 parameters", "1"]),
        (lambda: make_compatible(_curve(), _curve(), _curve(2, 2.0)), ["Axis 0", "spline 2", "2.0", "1.0"]),
        (lambda: make_compatible(_curve(), _curve(2, 1.0 + 1e-9)), ["Axis 0", "spline 1"]),
        (lambda: make_compatible(_curve(), tolerance=-1e-9), ["-1e-09"]),
        (lambda: make_compatible(_curve(), tolerance=np.nan), ["nan"]),
        (lambda: make_compatible(_curve(), tolerance=0.01), ["0.01"]),
        (lambda: make_compatible(_curve(), tolerance="tight"), ["'tight'"]),
        (lambda: combine([], []), ["0 splines"]),
        (lambda: combine([_curve()], [1.0, 2.0]), ["1 splines", "2 weights"]),
        (lambda: combine([_curve(), _curve(1)], [1.0, 2.0]), ["Spline 1", "1 channels", "2"]),
        (lambda: combine([_curve(), _curve()], [1.0, np.nan]), ["Weight 1", "nan"]),
        (lambda: combine([_curve(), _curve()], [[1.0, np.inf], 1.0]), ["Weight 0", "inf"]),
        (lambda: combine([_curve(), _curve()], [1.0, [1.0, 2.0, 3.0]]), ["Weight 1"]),
        (lambda: combine([_curve(), _surface()], [1.0, 1.0]), ["parameters"]),
        (lambda: combine([_curve(), _curve()], [1e308, 1e308]), ["float64"]),
        (lambda: blend(_curve(), _curve(), np.nan), ["t", "nan"]),
        (lambda: blend(_curve(), _curve(), [0.1, 0.2, 0.3]), ["t", "2"]),
        (lambda: blend(_curve(), _curve(1), 0.5), ["channels"]),
        (lambda: blend(_curve(), _curve(2, 2.0), 0.5), ["Axis 0", "2.0"]),
        (lambda: blend(_curve(), _curve(), _curve(3)), ["channels"]),
        (lambda: blend(_curve(), _curve(), _surface()), ["parameters"]),
        (lambda: blend(_curve(), _curve(), _curve(1, 2.0)), ["Axis 0", "2.0"]),
    ],
)
def test_what_cannot_be_mixed_is_refused(call, says):
    message = refusal(call)
    assert all(word in message for word in says), message
