"""Knot vectors: placements against their formulas, validation that names the culprit, Greville abscissae."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bvbedit import BvbError
from bvbedit.spline.knots import PLACEMENTS, checked_degree, checked_knots, clamped, greville, place_knots
from tests.spline import naive

DATA = np.linspace(0, 1, 91)


@st.composite
def placements(draw: st.DrawFn) -> tuple[np.ndarray, int, int]:
    """Data parameters, a size and a degree that they can carry."""
    gaps = draw(st.lists(st.floats(1e-3, 1.0), min_size=1, max_size=30))
    u = np.concatenate([[0.0], np.cumsum(gaps)]) + draw(st.sampled_from([0.0, -2.0, 100.0]))
    degree = draw(st.integers(1, min(5, len(u) - 1)))
    return u, draw(st.integers(degree + 1, len(u))), degree


@given(placements())
def test_piegl_tiller_is_equations_9_68_and_9_69(case):
    u, size, p = case
    m, n = len(u) - 1, size - 1
    d = (m + 1) / (n - p + 1)  # 9.68
    interior = []
    for j in range(1, n - p + 1):  # 9.69
        i = math.floor(j * d)
        alpha = j * d - i
        interior.append((1 - alpha) * u[i - 1] + alpha * u[i])
    expected = [u[0]] * (p + 1) + interior + [u[-1]] * (p + 1)
    np.testing.assert_allclose(place_knots("piegl-tiller", u, size, p), expected, rtol=1e-13, atol=1e-13)


@given(placements())
def test_averaged_are_means_of_parameters_at_equispaced_indices(case):
    u, size, p = case
    chosen = []
    for k in range(size):
        index = k * (len(u) - 1) / (size - 1)
        i = min(math.floor(index), len(u) - 2)
        chosen.append(u[i] + (index - i) * (u[i + 1] - u[i]))
    interior = [sum(chosen[i : i + p]) / p for i in range(1, size - p)]
    expected = [u[0]] * (p + 1) + interior + [u[-1]] * (p + 1)
    np.testing.assert_allclose(place_knots("averaged", u, size, p), expected, rtol=1e-13, atol=1e-13)


@given(placements())
def test_uniform_knots_are_equally_spaced(case):
    u, size, p = case
    steps = np.diff(place_knots("uniform", u, size, p)[p:-p])
    np.testing.assert_allclose(steps, (u[-1] - u[0]) / (size - p), rtol=1e-9)


@pytest.mark.parametrize("placement", PLACEMENTS)
@pytest.mark.parametrize(("size", "degree"), [(1, 0), (2, 1), (4, 3), (5, 3), (17, 16), (90, 3), (91, 3)])
def test_placements_make_full_clamped_vectors_for_every_size(placement, size, degree):
    t = place_knots(placement, DATA, size, degree)
    assert len(t) == size + degree + 1
    assert (t[: degree + 1] == 0).all()
    assert (t[-degree - 1 :] == 1).all()
    assert (np.diff(t) >= 0).all()


@pytest.mark.parametrize(
    ("placement", "size", "condition"),
    [
        # Measured in advance with another program (numerics.md).
        *[("averaged", n, c) for n, c in ((60, 4.4), (80, 4.6), (88, 6.5), (91, 3.9))],
        *[("piegl-tiller", n, c) for n, c in ((60, 28), (80, 5e6))],
        *[("uniform", n, c) for n, c in ((60, 5), (80, 16), (88, 533), (91, 3e6))],
    ],
)
def test_conditions_of_the_collocation_matrix_on_91_uniform_data(placement, size, condition):
    matrix = naive.matrix(place_knots(placement, DATA, size, 3), 3, DATA)
    assert np.linalg.cond(matrix) == pytest.approx(condition, rel=0.1)


@pytest.mark.parametrize(
    ("degree", "knots", "says"),
    [
        (2, [0, 0, 0, 0.5, math.nan, 1, 1, 1], "Knot 4 is nan"),
        (2, [0, 0, 0, 0.5, math.inf, 1, 1, 1], "Knot 4 is inf"),
        (2, [0, 0, 0, 0.5, 0.4, 1, 1, 1], "Knot 4 is 0.4"),
        (2, [0, 0, 0, 0.5, 0.5, 0.5, 0.5, 1, 1, 1], r"Knot 3 = 0.5 stands more than 3 times"),
        (1, [0, 0, 0, 1, 1], r"Knot 0 = 0.0 stands more than 2 times"),
        (1, [0, 0, 1, 1, 1], r"Knot 2 = 1.0 stands more than 2 times"),
        (1, [2, 2, 2, 2], "stands more than 2 times"),
        (2, [0, 0, 0.1, 1, 1, 1], "not clamped"),
        (2, [0, 0, 0, 0.9, 1, 1], "not clamped"),
        (2, [0, 0, 1, 1], "at least 6 knots"),
        (0, [1], "at least 2 knots"),
        (1, [0, 0, 5e-324, 1, 1], "Knots 1 and 2 are"),
        (1, [0, 0, 1e-200, 1e-200], "Knots 1 and 2 are"),
        (1, [-1e308, -1e308, 1e308, 1e308], "Knot 0 is -1e.308"),
        (1, [[0, 0], [1, 1]], "in one row"),
    ],
)
def test_bad_knots_are_refused_by_index_and_value(degree, knots, says):
    with pytest.raises(BvbError, match=says):
        checked_knots(knots, degree)


@pytest.mark.parametrize("degree", [-1, 17, 2.5, True, math.nan, math.inf, "three", None])
def test_bad_degrees_are_refused(degree):
    with pytest.raises(BvbError, match="Degree"):
        checked_degree(degree)


@pytest.mark.parametrize("degree", [0, 3, 16, np.int64(5)])
def test_whole_degrees_become_int(degree):
    assert checked_degree(degree) == degree
    assert type(checked_degree(degree)) is int


def test_full_multiplicity_inside_is_allowed_for_every_degree():
    for p in range(17):
        assert (clamped([0.5] * (p + 1), p)[p + 1 : -p - 1] == 0.5).all()


def test_checked_knots_are_a_read_only_copy():
    given_knots = np.array([0.0, 0, 1, 1])
    t = checked_knots(given_knots, 1)
    given_knots[2] = 7.0
    assert t.tolist() == [0, 0, 1, 1]
    assert not t.flags.writeable


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("equal", DATA, 10, 3), "equal.*piegl-tiller, averaged, uniform"),
        (("averaged", DATA, 3, 3), "3 control points.*4 ... 91"),
        (("averaged", DATA, 92, 3), "92 control points.*4 ... 91"),
        (("averaged", DATA[::-1], 10, 3), "increasing"),
        (("averaged", [0, 0.5, 0.5, 1], 4, 3), "increasing"),
        (("averaged", [0, 0.5, math.nan, 1], 4, 3), "increasing"),
        (("averaged", [0.5], 1, 0), "at least two"),
        (("averaged", DATA, 10, 17), "Degree 17"),
    ],
)
def test_impossible_placements_are_refused(arguments, says):
    with pytest.raises(BvbError, match=says):
        place_knots(*arguments)


@given(st.integers(1, 16).flatmap(lambda p: st.tuples(st.just(p), naive.knot_vectors(p))))
def test_greville_abscissae_reproduce_the_parameter(case):
    p, t = case
    xi = greville(t, p)
    assert len(xi) == len(t) - p - 1
    assert xi[0] == t[0]
    assert xi[-1] == t[-1]
    assert (np.diff(xi) >= 0).all()
    x = naive.telling_points(t)
    scale = max(abs(t[0]), abs(t[-1]))
    np.testing.assert_allclose(naive.matrix(t, p, x) @ xi, x, rtol=0, atol=1e-14 * scale)


def test_greville_abscissae_of_degree_0_are_the_middles_of_the_spans():
    assert greville(clamped([0.2, 0.6], 0), 0).tolist() == pytest.approx([0.1, 0.4, 0.8])
