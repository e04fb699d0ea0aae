"""Knot insertion, elevation and splitting: other control points, the same function, to the last digits."""

from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise
from math import comb

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bvbedit.spline.knots import clamped
from bvbedit.spline.refinement import elevation, insertion
from bvbedit.spline.tensor import TensorSpline
from tests.spline import naive
from tests.spline.drawn import EPS, assert_ones, assert_same, largest, looks, ones, random_spline, splines, with_axis
from tests.spline.refusals import refusal

Row = list[Fraction]


def _boehm(t: Sequence[Fraction], p: int, u: Fraction, net: list[Row]) -> tuple[Row, list[Row]]:
    """Insert ``u`` once into exact knots and control points (The NURBS Book, equations 5.11 and 5.15)."""
    k = max(i for i in range(len(t)) if t[i] <= u)
    out = []
    for i in range(len(net) + 1):
        if i <= k - p:
            out.append(net[i])
        elif t[i] >= u:
            out.append(net[i - 1])
        else:
            alpha = (u - t[i]) / (t[i + p] - t[i])
            out.append([alpha * a + (1 - alpha) * b for a, b in zip(net[i], net[i - 1], strict=True)])
    return [*t[: k + 1], u, *t[k + 1 :]], out


def _unit(n: int) -> list[Row]:
    return [[Fraction(int(i == j)) for j in range(n)] for i in range(n)]


def _solved(matrix: list[Row], right: list[Row]) -> list[Row]:
    """Solve a square system exactly."""
    rows = [[*a, *b] for a, b in zip(matrix, right, strict=True)]
    n = len(rows)
    for j in range(n):
        pivot = next(i for i in range(j, n) if rows[i][j] != 0)
        rows[j], rows[pivot] = rows[pivot], rows[j]
        rows[j] = [v / rows[j][j] for v in rows[j]]
        for i in range(n):
            if i != j:
                rows[i] = [a - rows[i][j] * b for a, b in zip(rows[i], rows[j], strict=True)]
    return [r[n:] for r in rows]


@st.composite
def _insertions(draw: st.DrawFn) -> tuple[np.ndarray, int, list[float]]:
    p = draw(st.sampled_from([0, 1, 2, 3, 3, 5, 8]))
    t = draw(naive.knot_vectors(p, 4))
    inside = [float(v) for v in naive.telling_points(t) if t[0] < v < t[-1] and abs(v) > 1e-99]
    new = sorted(draw(st.lists(st.sampled_from(inside), max_size=6)))
    return t, p, [v for v in new if new.count(v) + np.sum(t == v) <= p + 1]


@given(_insertions())
def test_each_entry_of_the_insertion_matrix_is_right_to_a_few_ulps_of_itself(drawn):
    t, p, new = drawn
    exact_t, exact = [Fraction(v) for v in t.tolist()], _unit(len(t) - p - 1)
    for u in new:
        exact_t, exact = _boehm(exact_t, p, Fraction(u), exact)
    fine = np.sort(np.concatenate([t, new]))
    dense = insertion(t, p, fine).dense()
    expected = np.array([[float(v) for v in row] for row in exact])
    assert dense.shape == expected.shape
    assert (dense >= 0).all()
    np.testing.assert_allclose(dense, expected, rtol=4 * (p + 1) * EPS, atol=1e-300)


# The NURBS Book, examples 5.1 and 5.2: alpha_3, alpha_4, alpha_5 for 5/2, and then alpha_3, alpha_4 for 2 again.
BOOK = [0, 0, 0, 0, 1, 2, 3, 4, 5, 5, 5, 5]


def test_the_books_example_of_inserting_a_knot_between_knots():
    assert [(Fraction(5, 2) - BOOK[i]) / (BOOK[i + 3] - BOOK[i]) for i in (3, 4, 5)] == [
        Fraction(5, 6),
        Fraction(1, 2),
        Fraction(1, 6),
    ]
    old = np.random.default_rng(51).normal(size=(8, 3))
    new = TensorSpline((3,), (BOOK,), old).insert_knots(0, 2.5)
    assert new.knots[0].tolist() == [0, 0, 0, 0, 1, 2, 2.5, 3, 4, 5, 5, 5, 5]
    expected = [
        *old[:3],
        5 / 6 * old[3] + 1 / 6 * old[2],
        1 / 2 * old[4] + 1 / 2 * old[3],
        1 / 6 * old[5] + 5 / 6 * old[4],
        *old[5:],
    ]
    np.testing.assert_allclose(new.control, expected, rtol=0, atol=4 * EPS)
    np.testing.assert_array_equal(new.control[:3], old[:3])
    np.testing.assert_array_equal(new.control[6:], old[5:])


def test_the_books_example_of_inserting_a_knot_again():
    old = np.random.default_rng(52).normal(size=(8, 2))
    new = TensorSpline((3,), (BOOK,), old).insert_knots(0, [2])
    expected = [*old[:3], 2 / 3 * old[3] + 1 / 3 * old[2], 1 / 3 * old[4] + 2 / 3 * old[3], *old[4:]]
    np.testing.assert_allclose(new.control, expected, rtol=0, atol=4 * EPS)


@settings(max_examples=60)
@given(with_axis(splines()), st.data())
def test_inserting_knots_changes_no_value_and_no_slope(drawn, data):
    spline, axis = drawn
    t, p = spline.knots[axis], spline.degrees[axis]
    inside = [float(v) for v in naive.telling_points(t) if t[0] < v < t[-1] and abs(v) > 1e-99]
    new = sorted(data.draw(st.lists(st.sampled_from(inside), max_size=5)))
    new = [v for v in new if new.count(v) + np.sum(t == v) <= p + 1]
    fine = spline.insert_knots(axis, new)
    assert fine.knots[axis].tolist() == sorted([*t.tolist(), *new])
    assert fine.degrees == spline.degrees
    assert_same(spline, fine)
    assert_ones(ones(spline).insert_knots(axis, new))
    assert largest(fine) <= largest(spline) * (1 + 16 * EPS)
    again = spline.refine(axis, knots=fine.knots[axis])
    np.testing.assert_array_equal(again.control, fine.control)
    one_by_one = spline
    for v in new:
        one_by_one = one_by_one.insert_knots(axis, v)
    np.testing.assert_allclose(one_by_one.control, fine.control, rtol=0, atol=64 * EPS * largest(spline))


@pytest.mark.parametrize("factor", [1, 2, 3, 7])
def test_refining_by_a_factor_cuts_each_span_into_equal_parts(factor, rng):
    spline = random_spline(rng, (3, 2), (7, 5), 2)
    for axis in (0, 1):
        fine = spline.refine(axis, factor)
        before, after = np.unique(spline.knots[axis]), np.unique(fine.knots[axis])
        expected = [np.linspace(a, b, factor + 1)[:-1] for a, b in pairwise(before)]
        np.testing.assert_allclose(after, np.append(np.concatenate(expected), 1.0), rtol=0, atol=2 * EPS)
        assert set(before) <= set(after)
        assert_same(spline, fine)
        assert fine.degrees == spline.degrees


@settings(max_examples=60)
@given(with_axis(splines()), st.integers(0, 4))
def test_elevating_changes_no_value_and_no_slope(drawn, by):
    spline, axis = drawn
    p = spline.degrees[axis]
    by = min(by, 16 - p)
    raised = spline.elevate(axis, by)
    assert raised.degrees[axis] == p + by
    values, counts = np.unique(spline.knots[axis], return_counts=True)
    np.testing.assert_array_equal(raised.knots[axis], np.repeat(values, counts + by))
    assert_same(spline, raised)
    assert_ones(ones(spline).elevate(axis, by))
    assert largest(raised) <= largest(spline) * (1 + 16 * EPS)
    step = spline
    for _ in range(by):
        step = step.elevate(axis)
    np.testing.assert_allclose(step.control, raised.control, rtol=0, atol=64 * EPS * largest(spline))


@pytest.mark.parametrize("p", [0, 1, 2, 3, 8, 15])
def test_one_bezier_piece_is_elevated_as_the_book_says(p, rng):
    """Equation 5.36, and what it gives when used again and again."""
    old = rng.normal(size=(p + 1, 2))
    curve = TensorSpline((p,), (clamped([], p),), old)
    expected = [
        (1 - i / (p + 1)) * old[min(i, p)] + i / (p + 1) * old[max(i - 1, 0)] for i in range(p + 2)
    ]  # equation 5.36
    np.testing.assert_allclose(curve.elevate(0).control, expected, rtol=0, atol=8 * EPS * largest(curve))
    by = 16 - p
    weights = [
        [Fraction(comb(p, j) * comb(by, i - j), comb(16, i)) if j <= i else 0 for j in range(p + 1)] for i in range(17)
    ]
    np.testing.assert_allclose(
        curve.elevate(0, by).control, np.array(weights, float) @ old, rtol=0, atol=32 * EPS * largest(curve)
    )


def test_the_books_cubic_becomes_the_quartic_that_is_the_same_function():
    """Section 5.5. The quartic's control points come from an exact solution of its interpolation of the cubic."""
    a, b = Fraction(3, 10), Fraction(7, 10)
    cubic, quartic = [0] * 4 + [a, b] + [1] * 4, [0] * 5 + [a, a, b, b] + [1] * 5
    points = [Fraction(sum(quartic[i + 1 : i + 5])) / 4 for i in range(9)]
    left = [naive.basis(quartic, 4, x, Fraction) for x in points]
    right = [naive.basis(cubic, 3, x, Fraction) for x in points]
    exact = _solved(left, right)
    assert exact[1] == [Fraction(1, 4), Fraction(3, 4), 0, 0, 0, 0]
    knots, matrix = elevation(clamped([0.3, 0.7], 3), 3, 1)
    np.testing.assert_array_equal(knots, clamped([0.3, 0.3, 0.7, 0.7], 4))
    np.testing.assert_allclose(matrix.dense(), np.array(exact, float), rtol=1e-14, atol=1e-15)


@settings(max_examples=60)
@given(with_axis(splines()), st.data())
def test_both_parts_of_a_split_are_the_spline_where_they_are(drawn, data):
    spline, axis = drawn
    t, p = spline.knots[axis], spline.degrees[axis]
    inside = [float(v) for v in naive.telling_points(t) if t[0] < v < t[-1] and abs(v) > 1e-99]
    at = data.draw(st.sampled_from(inside))
    parts = spline.split(axis, at)
    assert parts[0].domain[axis] == (t[0], at)
    assert parts[1].domain[axis] == (at, t[-1])
    for part in parts:
        axes = looks(part)
        # At its end a part takes the limit from the left; the spline, the value from the right.
        if part is parts[0]:
            axes[axis] = axes[axis][axes[axis] < at]
        assert_same(spline, part, axes)
        assert part.knots[axis].tolist().count(at) == p + 1
    for part in ones(spline).split(axis, at):
        assert_ones(part)
    if p > 0 and np.sum(t == at) <= p:
        last, first = (s.control.take(i, axis) for s, i in zip(parts, (-1, 0), strict=True))
        np.testing.assert_allclose(last, first, rtol=0, atol=64 * EPS * largest(spline))


@settings(max_examples=50)
@given(splines(), st.data())
def test_a_restricted_spline_is_the_spline_in_the_box(spline, data):
    box = []
    for t in spline.knots:
        sound = [v for v in naive.telling_points(t) if v == 0 or abs(v) > 1e-99]
        ends = data.draw(st.lists(st.sampled_from(sound), min_size=2, max_size=2, unique=True))
        box.append(tuple(sorted(float(v) for v in ends)))
    part = spline.restrict(box)
    assert part.domain == tuple(box)
    axes = looks(part)
    axes = [x[(x < b) | (b == t[-1])] for x, (_, b), t in zip(axes, box, spline.knots, strict=True)]
    assert_same(spline, part, axes)
    assert_ones(ones(spline).restrict(box))
    whole = spline.restrict(spline.domain)
    np.testing.assert_array_equal(whole.control, spline.control)


def test_order_of_axes_does_not_matter_to_refinement(rng):
    spline = random_spline(rng, (3, 2, 1), (6, 5, 4), 2)
    one = spline.insert_knots(0, [0.4, 0.4]).elevate(2).refine(1, 2)
    other = spline.refine(1, 2).elevate(2).insert_knots(0, [0.4, 0.4])
    np.testing.assert_allclose(one.control, other.control, rtol=0, atol=32 * EPS * largest(spline))


@pytest.fixture
def surface(rng: np.random.Generator) -> TensorSpline:
    return TensorSpline((3, 2), (clamped([0.5], 3), clamped([0.25, 0.75], 2)), rng.normal(size=(5, 5, 2)))


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ([0.5, np.nan], ["knot 1", "nan"]),
        ([0.5, np.inf], ["knot 1", "inf"]),
        ([0.0], ["knot 0", "0.0"]),
        ([0.2, 1.0], ["knot 1", "1.0"]),
        ([0.2, -3.0], ["knot 1", "-3.0"]),
        ([0.2, 0.9, 0.8], ["knot 2", "0.8", "0.9"]),
        ([0.25, 0.25, 0.25], ["knot 2", "0.25", "4 times", "allows 3"]),
        ([[0.2]], ["(1, 1)"]),
    ],
)
def test_knots_that_cannot_be_inserted_are_refused_by_axis_index_and_value(surface, values, says):
    message = refusal(lambda: surface.insert_knots(1, values))
    assert all(word in message for word in ["xis 1", *says]), message


@pytest.mark.parametrize(
    ("knots", "says"),
    [
        (clamped([0.5], 2), ["Axis 1", "knot 3", "0.25", "0 in"]),
        (clamped([0.25, 0.75], 2, 0.0, 2.0), ["Axis 1"]),
        (clamped([0.25, 0.75], 2, -1.0, 1.0), ["Axis 1"]),
        ([0, 0, 0, 0.25, 0.25, 0.25, 0.25, 0.75, 1, 1, 1], ["Axis 1", "0.25", "more than 3"]),
        ([0, 0, 0, 0.75, 0.25, 1, 1, 1], ["Axis 1", "Knot 4", "0.25"]),
        ([0, 0, 0, 0.25, np.nan, 0.75, 1, 1, 1], ["Axis 1", "Knot 4", "nan"]),
        (clamped([0.25, 0.75], 3), ["Axis 1"]),
    ],
)
def test_knots_that_do_not_refine_are_refused_by_axis_index_and_value(surface, knots, says):
    message = refusal(lambda: surface.refine(1, knots=knots))
    assert all(word in message for word in says), message


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda s: s.refine(1), ["Axis 1", "factor"]),
        (lambda s: s.refine(1, 2, knots=[0, 1]), ["Axis 1", "factor"]),
        (lambda s: s.refine(1, 0), ["Axis 1", "0"]),
        (lambda s: s.refine(1, 1.5), ["Axis 1", "1.5"]),
        (lambda s: s.refine(1, 10**30), ["Axis 1", "1000000"]),
        (lambda s: s.refine(2, 2), ["Axis 2"]),
        (lambda s: s.insert_knots(-1, [0.5]), ["Axis -1"]),
        (lambda s: s.elevate(0, 14), ["Axis 0", "14", "13"]),
        (lambda s: s.elevate(0, -1), ["Axis 0", "-1"]),
        (lambda s: s.elevate(0, 0.5), ["Axis 0", "0.5"]),
        (lambda s: s.elevate(0, True), ["Axis 0", "True"]),
        (lambda s: s.elevate(7), ["Axis 7"]),
        (lambda s: s.split(0, 0.0), ["Axis 0", "0.0"]),
        (lambda s: s.split(0, 1.0), ["Axis 0", "1.0"]),
        (lambda s: s.split(0, np.nan), ["Axis 0", "nan"]),
        (lambda s: s.split(0, 5e-324), ["Axis 0", "4.94066e-324 apart"]),
        (lambda s: s.split(3, 0.5), ["Axis 3"]),
        (lambda s: s.restrict([(0, 1)]), ["(1, 2)"]),
        (lambda s: s.restrict([(0, 1), (0.5, 0.5)]), ["Axis 1", "0.5"]),
        (lambda s: s.restrict([(0, 1), (0.6, 0.5)]), ["Axis 1", "0.6"]),
        (lambda s: s.restrict([(0, 1), (0.6, 1.5)]), ["Axis 1", "1.5"]),
        (lambda s: s.restrict([(0, 1), (0, 5e-324)]), ["Axis 1", "4.94066e-324 apart"]),
        (lambda s: s.restrict([(0, 1), (np.nan, 1)]), ["Axis 1", "nan"]),
    ],
)
def test_what_cannot_be_refined_elevated_or_split_is_refused(surface, call, says):
    message = refusal(lambda: call(surface))
    assert all(word in message for word in says), message


def test_a_span_with_no_number_inside_cannot_be_divided():
    t = clamped([0.5, np.nextafter(0.5, 1)], 1)
    spline = TensorSpline((1,), (t,), np.zeros((4, 1)))
    assert "Axis 0" in refusal(lambda: spline.refine(0, 2))


def test_refining_leaves_the_spline_as_it_was(surface):
    control, knots = surface.control.copy(), [t.copy() for t in surface.knots]
    for new in (
        surface.insert_knots(0, [0.5]),
        surface.refine(1, 3),
        surface.elevate(0),
        *surface.split(0, 0.5),
        surface.insert_knots(0, []),
        surface.elevate(1, 0),
    ):
        assert not new.control.flags.writeable
        assert not any(t.flags.writeable for t in new.knots)
    np.testing.assert_array_equal(surface.control, control)
    for t, before in zip(surface.knots, knots, strict=True):
        np.testing.assert_array_equal(t, before)
