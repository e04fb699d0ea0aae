"""Whatever a caller hands to the spline room is taken, or refused in one line that names it."""

from fractions import Fraction

import numpy as np
import pytest

from bvbedit.spline.arguments import is_real_within, is_whole, one_per_axis, real_array, shown
from bvbedit.spline.compatible import blend, combine, make_compatible
from bvbedit.spline.diagnostics import slope_bounds
from bvbedit.spline.fitting import fit_weighted, loft
from bvbedit.spline.knots import checked_degree, checked_knots, clamped, place_knots
from bvbedit.spline.operations import join, permute, reparametrise, reverse
from bvbedit.spline.sculpting import move_points, scale_region
from bvbedit.spline.tensor import TensorSpline
from tests.spline.refusals import refusal

# Nothing that a door wants: texts, nothing, ragged rows, complex numbers, numbers beyond float64, other things.
NO_NUMBERS = ["abc", None, [[1, 2], [3]], [1j, 0, 0], [10**400], [object()], {"a": 1}]
each_no_numbers = pytest.mark.parametrize("wrong", NO_NUMBERS, ids=lambda w: shown(w)[:12])

KNOTS = [0, 0, 0, 0, 1, 1, 1, 1]
U = np.linspace(0, 1, 8)


def _spline(**changes: object) -> TensorSpline:
    return TensorSpline(**({"degrees": (3,), "knots": (KNOTS,), "control": np.ones((4, 1))} | changes))


def _halves() -> TensorSpline:
    return _spline(knots=(clamped([0.5], 3),), control=np.ones((5, 1)))


def _next() -> TensorSpline:
    return _spline(knots=(clamped([], 3, 1.0, 2.0),))


def _fit(**changes: object) -> object:
    start = {"start": np.zeros((4, 1))}
    sound = {"values": np.ones((8, 1)), "parameters": [U], "knots": [KNOTS], "degrees": [3], "weights": np.ones(8)}
    return fit_weighted(**(sound | start | changes))


@each_no_numbers
@pytest.mark.parametrize(
    "door",
    [
        lambda wrong: _spline(degrees=wrong),
        lambda wrong: _spline(degrees=(wrong,)),
        lambda wrong: _spline(knots=wrong),
        lambda wrong: _spline(knots=(wrong,)),
        lambda wrong: _spline(control=wrong),
        lambda wrong: _spline().evaluate(wrong),
        lambda wrong: _spline().evaluate([0.5], derivatives=(wrong,)),
        lambda wrong: _spline().evaluate_grid(wrong),
        lambda wrong: _spline().evaluate_grid([wrong]),
        lambda wrong: _spline().derivative(wrong),
        lambda wrong: _spline().derivative(0, wrong),
        lambda wrong: _spline().antiderivative(wrong),
        lambda wrong: _spline().integrate([wrong]),
        lambda wrong: _spline().integrate([(0, wrong)]),
        lambda wrong: _spline().insert_knots(wrong, [0.5]),
        lambda wrong: _spline().insert_knots(0, wrong),
        lambda wrong: _spline().refine(wrong, 2),
        lambda wrong: _spline().refine(0, wrong),
        lambda wrong: _spline().refine(0, knots=wrong),
        lambda wrong: _spline().remove_knots(wrong, 0.1),
        lambda wrong: _spline().remove_knots(0, wrong),
        lambda wrong: _spline().remove_knots(0, 0.1, held=(wrong, 0)),
        lambda wrong: _spline().remove_knot(0, wrong),
        lambda wrong: _halves().remove_knot(0, 0.5, wrong),
        lambda wrong: _spline().elevate(wrong),
        lambda wrong: _spline().elevate(0, wrong),
        lambda wrong: _spline().reduce(wrong),
        lambda wrong: _spline().reduce(0, wrong),
        lambda wrong: _spline().reduce(0, held=(0, wrong)),
        lambda wrong: _spline().split(wrong, 0.5),
        lambda wrong: _spline().split(0, wrong),
        lambda wrong: _spline().restrict([wrong]),
        lambda wrong: _spline().restrict([(wrong, 1)]),
        lambda wrong: join(_spline(), _next(), wrong),
        lambda wrong: reverse(_spline(), wrong),
        lambda wrong: permute(_spline(), wrong),
        lambda wrong: permute(_spline(), (wrong,)),
        lambda wrong: reparametrise(_spline(), wrong, 0.0, 2.0),
        lambda wrong: reparametrise(_spline(), 0, wrong, 2.0),
        lambda wrong: reparametrise(_spline(), 0, 0.0, wrong),
        lambda wrong: make_compatible(_spline(), tolerance=wrong),
        lambda wrong: combine([_spline()], wrong),
        lambda wrong: combine([_spline()], [wrong]),
        lambda wrong: blend(_spline(), _spline(), wrong),
        lambda wrong: move_points(_spline(), wrong, [[1.0]]),
        lambda wrong: move_points(_spline(), [[0.5]], wrong),
        lambda wrong: move_points(_spline(), [[0.5]], [[1.0]], keep=[wrong]),
        lambda wrong: scale_region(_spline(), [wrong], 2.0),
        lambda wrong: scale_region(_spline(), [(0, 1)], wrong),
        lambda wrong: scale_region(_spline(), [(0, 1)], 2.0, wrong),
        lambda wrong: slope_bounds(_spline(), wrong),
        checked_degree,
        lambda wrong: checked_knots(wrong, 3),
        lambda wrong: clamped(wrong, 3),
        lambda wrong: clamped([0.5], 3, wrong, 1.0),
        lambda wrong: place_knots(wrong, U, 6, 3),
        lambda wrong: place_knots("averaged", wrong, 6, 3),
        lambda wrong: place_knots("averaged", U, wrong, 3),
        lambda wrong: place_knots("averaged", U, 6, wrong),
        lambda wrong: loft(wrong, [U], [KNOTS], [3]),
        lambda wrong: _fit(parameters=wrong),
        lambda wrong: _fit(parameters=[wrong]),
        lambda wrong: _fit(knots=[wrong]),
        lambda wrong: _fit(degrees=[wrong]),
        lambda wrong: _fit(weights=wrong),
        lambda wrong: _fit(start=wrong),
        lambda wrong: _fit(tolerance=wrong),
    ],
)
def test_every_door_refuses_what_is_no_number(door, wrong):
    refusal(lambda: door(wrong))


@pytest.mark.parametrize(
    "door",
    [
        lambda: _spline(degrees=3),
        lambda: _spline(degrees=(), knots=(), control=[1.0]),
        lambda: _spline(control=np.ones((5, 1))),
        lambda: _spline(control=np.full((4, 1), np.nan)),
        lambda: _spline().evaluate([2.0]),
        lambda: _spline().evaluate([0.5], derivatives=1),
        lambda: _spline().evaluate([0.5], derivatives=(0.5,)),
        lambda: _spline().derivative(0.0),
        lambda: _spline().derivative(True),
        lambda: _spline().derivative(0, True),
        lambda: _spline().antiderivative(1),
        lambda: TensorSpline((16,), (clamped([], 16),), np.ones((17, 1))).antiderivative(0),
        lambda: _spline().integrate([(0, 1), (0, 1)]),
        lambda: _spline().integrate([(0.6, 0.5)]),
        lambda: _spline().integrate([(0, np.nan)]),
        lambda: _spline().integrate([(-0.1, 0.5)]),
        lambda: _spline().integrate(0.5),
        lambda: checked_degree(np.ones((40, 40))),
        lambda: checked_knots([0, 0, 0.5, 0.5, 0.5, 1, 1], 1),
        lambda: checked_knots([0, 0.1, 1, 2], 1),
        lambda: clamped([[0.5]], 3),
        lambda: place_knots("averaged", U, 6.0, 3),
        lambda: place_knots("averaged", U, True, 0),
        lambda: place_knots(np.ones((40, 40)), U, 6, 3),
        lambda: loft(np.ones((7, 1)), [U], [KNOTS], [3]),
        lambda: loft(np.ones((8, 0)), [U], [KNOTS], [3]),
        lambda: loft(np.ones((0, 1)), [U[:0]], [KNOTS], [3]),
        lambda: loft(np.ones((8, 1)), [U], [KNOTS], [2]),
        lambda: loft(np.ones((8, 1)), [U], [np.linspace(-1, 2, 9)], [3]),
        lambda: loft(np.full((8, 1), np.nan), [U], [KNOTS], [3]),
        lambda: _fit(weights=-np.ones(8)),
        lambda: _fit(start=np.zeros((5, 1))),
        lambda: _fit(tolerance=0.0),
        lambda: _fit(tolerance=np.nan),
    ],
)
def test_every_refusal_says_what_and_what_to_do(door):
    refusal(door)


@pytest.mark.parametrize("row", [[0, 1], (0.0, 1), [Fraction(0), Fraction(1)], np.array([0, 1], np.float32), range(2)])
def test_any_real_numbers_make_an_array(row):
    array = real_array(row, "x")
    assert array.dtype == np.float64
    assert array.tolist() == [0, 1]


def test_what_is_an_array_already_is_not_copied():
    a = np.ones(3)
    assert real_array(a, "x") is a
    mask = np.ones(3, bool)
    assert real_array(mask, "x", bool) is mask


def test_values_are_shown_in_one_short_line():
    assert shown("three") == "'three'"
    assert shown(np.eye(2)) == "array([[1., 0.], [0., 1.]])"
    assert len(shown(np.eye(100))) < 100


def test_whole_and_real_numbers_of_any_type():
    assert all(is_whole(v) for v in (0, -3, np.int64(5), np.uint8(5)))
    assert not any(is_whole(v) for v in (True, np.True_, 1.0, "1", None, np.array([1])))
    assert all(is_real_within(v, 0, 1) for v in (0, 1, 0.5, np.float32(0.5), Fraction(1, 3)))
    assert not any(is_real_within(v, 0, 1) for v in (True, -1, 1.5, np.nan, np.inf, 10**400, "0.5", None, 1j))


def test_one_entry_per_axis_is_any_row():
    assert one_per_axis(np.array([1, 2]), "Size") == one_per_axis([1, 2], "Size") == (1, 2)
