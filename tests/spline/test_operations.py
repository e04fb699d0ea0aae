"""Whole splines joined, cut, turned, stretched and multiplied: still the functions they are said to be."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bvbedit.spline.diagnostics import conditions
from bvbedit.spline.knots import clamped, greville
from bvbedit.spline.operations import join, permute, product, reparametrise, reverse, to_bezier
from bvbedit.spline.tensor import TensorSpline
from tests.spline import naive
from tests.spline.drawn import (
    EPS,
    assert_ones,
    assert_same,
    change,
    largest,
    looks,
    ones,
    pairs,
    random_spline,
    splines,
    with_axis,
)
from tests.spline.refusals import refusal

TAME = with_axis(splines(tame=True))


def _count(t: np.ndarray, value: float) -> int:
    return int(np.sum(t == value))


@settings(max_examples=60)
@given(TAME, st.integers(1, 31))
def test_what_was_split_comes_back_whole(drawn, k):
    """At a knot all of its copies come back, and between knots none stays."""
    spline, axis = drawn
    (a, b), p = spline.domain[axis], spline.degrees[axis]
    at = a + (b - a) * (k / 32)
    back, bound = join(*spline.split(axis, at), axis)
    assert back.domain == spline.domain
    scale = largest(spline)
    assert bound <= 2.0**-44 * scale
    assert change(spline, back) <= bound + 64 * EPS * scale
    # A knot may even go where control points happen to allow it, never more than stood there may stay.
    assert _count(back.knots[axis], at) <= _count(spline.knots[axis], at)
    if p <= 5 and back.size == spline.size:
        np.testing.assert_array_equal(back.knots[axis], spline.knots[axis])
        np.testing.assert_allclose(back.control, spline.control, rtol=0, atol=2.0**-30 * scale)
    whole, _ = join(*ones(spline).split(axis, at), axis)
    assert_ones(whole, 1024)


@settings(max_examples=40)
@given(pairs(), st.data())
def test_parts_that_do_not_fit_keep_their_jump_and_a_tolerance_closes_it(pair, data):
    a, b = pair
    axis = data.draw(st.integers(0, a.parameters - 1))
    start, end = a.domain[axis]
    b = reparametrise(b, axis, end, end + (end - start))
    whole, bound = join(a, b, axis)
    p = whole.degrees[axis]
    assert p == max(a.degrees[axis], b.degrees[axis])
    scale = max(largest(a), largest(b))
    assert bound <= 2.0**-44 * scale
    for part in (a, b):
        axes = looks(part)
        if part is a:
            axes[axis] = axes[axis][axes[axis] < end]
        off = np.abs(part.evaluate_grid(axes) - whole.evaluate_grid(axes)).max()
        assert off <= bound + 256 * EPS * scale
    if 0 < p <= 3:
        closed, bound = join(a, b, axis, 1e4 * scale)
        assert _count(closed.knots[axis], end) == 0
        assert bound <= 1e4 * scale
        axes = looks(a)
        axes[axis] = axes[axis][axes[axis] < end]
        assert np.abs(a.evaluate_grid(axes) - closed.evaluate_grid(axes)).max() <= bound + 256 * EPS * scale


def test_parts_that_meet_smoothly_keep_as_many_knots_as_their_smoothness_asks_for():
    """x^3 and x^3 + (x - 1)^m: the knot at 1 stands 4 - m times."""
    t = clamped([], 3)
    first = TensorSpline((3,), (t,), [[0.0], [0.0], [0.0], [1.0]])
    rest = np.array([1.0, 2.0, 4.0, 8.0])  # x^3 on [1, 2]
    powers = {0: [1, 1, 1, 1], 1: [0, 1 / 3, 2 / 3, 1], 2: [0, 0, 1 / 3, 1], 3: [0, 0, 0, 1]}
    for m, row in powers.items():
        second = TensorSpline((3,), (t + 1,), (rest + row)[:, None])
        whole, bound = join(first, second, 0)
        assert _count(whole.knots[0], 1.0) == 4 - m
        assert bound < 1e-13
    whole, _ = join(first, TensorSpline((3,), (t + 1,), rest[:, None]), 0)
    np.testing.assert_allclose(whole.control[:, 0], [0, 0, 0, 8], rtol=0, atol=1e-13)


@settings(max_examples=50)
@given(splines())
def test_bezier_pieces_are_the_spline_span_by_span(spline):
    pieces = to_bezier(spline)
    assert pieces.shape == tuple(len(np.unique(t)) - 1 for t in spline.knots)
    step = max(1, pieces.size // 6)
    for index in list(np.ndindex(pieces.shape))[::step]:
        piece = pieces[index]
        for (a, b), t, i in zip(piece.domain, spline.knots, index, strict=True):
            assert [a, b] == np.unique(t)[i : i + 2].tolist()
        assert piece.size == tuple(p + 1 for p in spline.degrees)
        axes = [
            x[(x < b) | (b == t[-1])] for x, (_, b), t in zip(looks(piece), piece.domain, spline.knots, strict=True)
        ]
        assert_same(spline, piece, axes)
        # The end points of a piece are values: at its start those of the spline.
        corner = [[a] for a, _ in piece.domain]
        np.testing.assert_allclose(
            piece.control[(0,) * spline.parameters],
            spline.evaluate_grid(corner).reshape(-1),
            rtol=0,
            atol=64 * EPS * largest(spline),
        )
    for piece in to_bezier(ones(spline)).flat[::step]:
        assert_ones(piece)


@settings(max_examples=50)
@given(TAME)
def test_backwards_is_the_mirrored_function_and_twice_backwards_the_same(drawn):
    spline, axis = drawn
    turned = reverse(spline, axis)
    a, b = spline.domain[axis]
    assert turned.domain == spline.domain
    np.testing.assert_array_equal(turned.control, np.flip(spline.control, axis))
    axes = looks(spline)
    # Not at knots: the reflected parameter is rounded, and might fall on the other side of a jump.
    between = np.unique(spline.knots[axis])
    axes[axis] = ((between[:-1, None] * [0.8, 0.4]) + between[1:, None] * [0.2, 0.6]).ravel()
    mirrored = list(axes)
    mirrored[axis] = a + (b - axes[axis])
    width = 4 * EPS * max(abs(a), abs(b))
    slope = spline.derivative(axis)
    np.testing.assert_allclose(
        turned.evaluate_grid(mirrored),
        spline.evaluate_grid(axes),
        rtol=0,
        atol=64 * EPS * largest(spline) + 8 * width * largest(slope),
    )
    twice = reverse(turned, axis)
    np.testing.assert_array_equal(twice.control, spline.control)
    np.testing.assert_allclose(twice.knots[axis], spline.knots[axis], rtol=0, atol=2 * EPS * max(abs(a), abs(b)))
    assert_ones(reverse(ones(spline), axis), 0)


@settings(max_examples=50)
@given(splines(), st.data())
def test_permuted_axes_take_permuted_parameters(spline, data):
    order = data.draw(st.permutations(range(spline.parameters)))
    turned = permute(spline, order)
    axes = looks(spline)
    expected = spline.evaluate_grid(axes).transpose(*order, spline.parameters)
    np.testing.assert_allclose(
        turned.evaluate_grid([axes[a] for a in order]), expected, rtol=0, atol=64 * EPS * largest(spline)
    )
    back = permute(turned, [order.index(a) for a in range(spline.parameters)])
    np.testing.assert_array_equal(back.control, spline.control)
    assert all((s == t).all() for s, t in zip(back.knots, spline.knots, strict=True))


@pytest.mark.parametrize(
    "operation",
    [
        lambda s, a: s.insert_knots(a, [0.35, 0.35, 0.6]),
        lambda s, a: s.refine(a, 3),
        lambda s, a: s.elevate(a, 2),
        lambda s, a: s.reduce(a)[0],
        lambda s, a: s.remove_knots(a, 0.8)[0],
        lambda s, a: s.split(a, 0.4)[1],
        lambda s, a: join(*s.split(a, 0.4), a)[0],
        lambda s, a: s.derivative(a),
        lambda s, a: s.antiderivative(a),
        lambda s, a: reverse(s, a),
        lambda s, a: reparametrise(s, a, -1.0, 2.0),
    ],
)
def test_permuting_axes_commutes_with_whatever_is_done_to_one_of_them(operation, rng):
    spline = random_spline(rng, (2, 3, 4), (6, 7, 8), 2)
    for order in itertools.permutations(range(3)):
        turned = permute(spline, order)
        for axis in range(3):
            first = permute(operation(spline, axis), order)
            last = operation(turned, order.index(axis))
            assert first.degrees == last.degrees
            for s, t in zip(first.knots, last.knots, strict=True):
                np.testing.assert_array_equal(s, t)
            np.testing.assert_allclose(first.control, last.control, rtol=0, atol=1e-12)


@settings(max_examples=50)
@given(TAME, st.sampled_from([(0.0, 1.0), (-7.0, 9.0), (1e-3, 1e3), (-1.0, 0.0)]))
def test_a_stretched_domain_keeps_the_values_and_comes_back(drawn, domain):
    spline, axis = drawn
    a, b = spline.domain[axis]
    there = reparametrise(spline, axis, *domain)
    assert there.domain[axis] == domain
    np.testing.assert_array_equal(there.control, spline.control)
    axes = looks(spline)
    breaks = np.unique(spline.knots[axis])
    axes[axis] = ((breaks[:-1, None] * [0.8, 0.4]) + breaks[1:, None] * [0.2, 0.6]).ravel()
    mapped = list(axes)
    share = (axes[axis] - a) / (b - a)
    mapped[axis] = (1 - share) * domain[0] + share * domain[1]
    noise = 8 * EPS * max(abs(a), abs(b)) * largest(spline.derivative(axis))
    noise += 8 * EPS * max(np.abs(domain)) * largest(there.derivative(axis))
    np.testing.assert_allclose(
        there.evaluate_grid(mapped), spline.evaluate_grid(axes), rtol=0, atol=noise + 64 * EPS * largest(spline)
    )
    back = reparametrise(there, axis, a, b)
    unit = max(abs(a), abs(b), (b - a) * max(np.abs(domain)) / (domain[1] - domain[0]))
    np.testing.assert_allclose(back.knots[axis], spline.knots[axis], rtol=0, atol=8 * EPS * unit)


@settings(max_examples=60)
@given(pairs(highest=5))
def test_a_product_is_the_pointwise_product_with_its_jumps(pair):
    a, b = pair
    made = product(a, b)
    assert made.degrees == tuple(p + q for p, q in zip(a.degrees, b.degrees, strict=True))
    for s, p, t, q, u in zip(a.knots, a.degrees, b.knots, b.degrees, made.knots, strict=True):
        assert set(u) == set(s) | set(t)
        for v in set(u):
            m, n = _count(s, v), _count(t, v)
            assert _count(u, v) == max(m + q if m else 0, n + p if n else 0)
    axes = looks(a, b)
    scale = largest(a) * largest(b)
    condition = np.prod(conditions(made))
    np.testing.assert_allclose(
        made.evaluate_grid(axes),
        a.evaluate_grid(axes) * b.evaluate_grid(axes),
        rtol=0,
        atol=64 * EPS * scale * max(condition, 1),
    )
    turned = product(b, a)
    np.testing.assert_allclose(turned.control, made.control, rtol=0, atol=256 * EPS * scale * condition)
    once = product(a, ones(b))
    assert_ones(product(ones(a), ones(b)), 64 * condition)
    axes = looks(a)
    np.testing.assert_allclose(
        once.evaluate_grid(axes), a.evaluate_grid(axes), rtol=0, atol=64 * EPS * largest(a) * condition
    )


def test_powers_of_the_parameter_multiply_to_powers():
    t = clamped([0.25, 0.5, 0.5], 3)
    x = TensorSpline((3,), (t,), greville(t, 3)[:, None])
    power, points = x, np.linspace(0, 1, 41)[:, None]
    for k in range(2, 6):
        power = product(power, x)
        np.testing.assert_allclose(power.evaluate(points), points**k, rtol=0, atol=1e-12)


def test_a_single_channel_multiplies_all(rng):
    a, b = random_spline(rng, (2, 3), (5, 6), 3), random_spline(rng, (1, 2), (4, 5), 1)
    points = rng.uniform(size=(50, 2))
    for one, other in ((a, b), (b, a)):
        made = product(one, other)
        assert made.channels == 3
        np.testing.assert_allclose(made.evaluate(points), a.evaluate(points) * b.evaluate(points), rtol=0, atol=1e-12)


def _curve(degree: int = 3, start: float = 0.0, end: float = 1.0, channels: int = 1) -> TensorSpline:
    return TensorSpline((degree,), (clamped([], degree, start, end),), np.ones((degree + 1, channels)))


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: join(_curve(), _curve(3, 1.0, 2.0, 2), 0), ["channels"]),
        (lambda: join(_curve(), _surface(), 0), ["parameters"]),
        (lambda: join(_curve(), _curve(), 0), ["Axis 0", "1.0", "0.0"]),
        (lambda: join(_curve(), _curve(3, 1.5, 2.0), 0), ["Axis 0", "1.0", "1.5"]),
        (lambda: join(_curve(), _curve(3, 1.0, 2.0), 1), ["Axis 1"]),
        (lambda: join(_curve(), _curve(3, 1.0, 2.0), 0, -1.0), ["Axis 0", "-1.0"]),
        (lambda: join(_curve(), _curve(3, 1.0, 2.0), 0, np.nan), ["Axis 0", "nan"]),
        (lambda: join(_curve(), _curve(3, 1.0, 2.0), 0, "all"), ["Axis 0", "'all'"]),
        (lambda: join(_surface(), reparametrise(_surface(1.5), 1, 1.0, 2.0), 1), ["Axis 0", "1.5"]),
        (lambda: reverse(_curve(), 1), ["Axis 1"]),
        (lambda: reverse(_curve(), 0.0), ["Axis 0.0"]),
        (lambda: permute(_surface(), (0,)), ["(0,)", "0 ... 1"]),
        (lambda: permute(_surface(), (0, 0)), ["(0, 0)"]),
        (lambda: permute(_surface(), (1, 2)), ["(1, 2)"]),
        (lambda: permute(_surface(), (0.0, 1)), ["(0.0, 1)"]),
        (lambda: permute(_surface(), "ab"), ["'ab'"]),
        (lambda: reparametrise(_curve(), 0, 1.0, 1.0), ["Axis 0", "(1.0, 1.0)"]),
        (lambda: reparametrise(_curve(), 0, 1.0, 0.0), ["Axis 0", "(1.0, 0.0)"]),
        (lambda: reparametrise(_curve(), 0, 0.0, np.inf), ["Axis 0", "inf"]),
        (lambda: reparametrise(_curve(), 0, np.nan, 1.0), ["Axis 0", "nan"]),
        (lambda: reparametrise(_curve(), 0, 0.0, 1e300), ["1e+300"]),
        (lambda: reparametrise(_curve(), 0, 0.0, "1"), ["Axis 0", "'1'"]),
        (lambda: reparametrise(_curve(), 3, 0.0, 1.0), ["Axis 3"]),
        (lambda: reparametrise(_crowded(), 0, 1e9, 1e9 + 1), ["Axis 0", "coincide"]),
        (lambda: product(_curve(channels=2), _curve(channels=3)), ["2 and 3 channels"]),
        (lambda: product(_curve(), _surface()), ["parameters"]),
        (lambda: product(_curve(), _curve(3, 0.0, 2.0)), ["Axis 0", "2.0"]),
        (lambda: product(_curve(9), _curve(8)), ["Axis 0", "17", "16"]),
        (lambda: product(*_close()), ["Axis 0", "condition"]),
    ],
)
def test_what_cannot_be_joined_turned_stretched_or_multiplied_is_refused(call, says):
    message = refusal(call)
    assert all(word in message for word in says), message


def _surface(end: float = 1.0) -> TensorSpline:
    return TensorSpline((1, 2), (clamped([], 1, 0.0, end), clamped([], 2)), np.ones((2, 3, 1)))


def _crowded() -> TensorSpline:
    return TensorSpline((1,), (clamped([0.5, 0.5 + 1e-12], 1),), np.ones((4, 1)))


def _close() -> tuple[TensorSpline, TensorSpline]:
    """Knots of one spline that differ, and are too close for a product."""
    crowded = TensorSpline((3,), (clamped([0.5, np.nextafter(0.5, 1)], 3),), np.ones((6, 1)))
    return crowded, _curve()


def test_the_naive_definition_agrees_with_a_product(rng):
    """Once from outside: neither evaluation nor interpolation of the package takes part."""
    t, s = clamped([0.5, 0.5, 0.5], 2), clamped([0.3], 1)
    a, b = TensorSpline((2,), (t,), rng.normal(size=(6, 1))), TensorSpline((1,), (s,), rng.normal(size=(3, 1)))
    made = product(a, b)
    x = np.array([0.0, 0.1, 0.3, np.nextafter(0.5, 0), 0.5, 0.7, 1.0])[:, None]
    left = naive.evaluate((3,), made.knots, made.control, x)
    right = naive.evaluate((2,), (t,), a.control, x) * naive.evaluate((1,), (s,), b.control, x)
    np.testing.assert_allclose(left, right, rtol=0, atol=1e-13)
