"""Free knots: an exact gradient, never worse than the start, and never at the price of what lies between the data."""

import gc
import subprocess
import sys
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from bvbedit.spline import free_knots
from bvbedit.spline.adaptive import AxisLines, axis_lines, dominant_knots
from bvbedit.spline.banded import Banded
from bvbedit.spline.free_knots import CONDITION_GROWTH, KEPT, LEAST_GAP, move_knots
from bvbedit.spline.knots import clamped, place_knots
from tests.spline import naive
from tests.spline.refusals import refusal

U = np.linspace(0, 1, 91)
PEAKS = {"gauss": np.exp(-(((U - 0.37) / 0.05) ** 2)), "lorentz": 1 / (1 + ((U - 0.37) / 0.02) ** 2)}


def _made(u: np.ndarray, factor: np.ndarray, roots: np.ndarray) -> AxisLines:
    return AxisLines(u, factor, roots, np.zeros(len(u)))


def _lines(values: np.ndarray, u: np.ndarray = U) -> AxisLines:
    return axis_lines(values.reshape(len(u), -1), np.ones(len(u)), [u])[0]


def _random(rng: np.random.Generator, m: int, k: int) -> AxisLines:
    """Return random lines with weights over four decades on uneven nodes."""
    u = np.cumsum(rng.uniform(0.5, 1.5, m))
    return _made((u - u[0]) / (u[-1] - u[0]), rng.normal(size=(m, k)), 10.0 ** rng.uniform(-2, 0, m))


def _scaled_condition(lines: AxisLines, knots: np.ndarray, degree: int) -> float:
    """Return the norm of the inverse of the weighted collocation matrix with columns of length one."""
    dense = lines.roots[:, None] * naive.matrix(knots, degree, lines.parameters)
    lengths = np.linalg.norm(dense, axis=0)
    smallest = np.linalg.svd(dense / lengths, compute_uv=False)[-1] if lengths.all() else 0.0
    return float(1 / smallest) if smallest > 0 else np.inf


@st.composite
def _problems(draw: st.DrawFn, highest: int = 5) -> tuple[AxisLines, np.ndarray, int]:
    """Random lines and knots that determine a spline, some of them standing up to ``degree`` times."""
    p = draw(st.integers(1, highest))
    rng = np.random.default_rng(draw(st.integers(0, 10_000)))
    lines = _random(rng, 40, 3)
    distinct = np.sort(rng.uniform(0, 1, draw(st.integers(1, 6))))
    interior = np.repeat(distinct, [draw(st.sampled_from([1, 1, 1, 2, p])) for _ in distinct])
    assume(np.unique(interior, return_counts=True)[1].max() <= p)
    knots = clamped(interior, p)
    assume(lines.error(knots, p) < np.inf and _scaled_condition(lines, knots, p) < 1e4)
    return lines, knots, p


def _dense_error(lines: AxisLines, knots: np.ndarray, degree: int) -> float:
    matrix = lines.roots[:, None] * naive.matrix(knots, degree, lines.parameters)
    fitted = matrix @ np.linalg.lstsq(matrix, lines.factor, rcond=None)[0]
    return float(np.sum((lines.factor - fitted) ** 2))


@given(_problems())
def test_the_gradient_is_that_of_finite_differences(problem):
    lines, knots, p = problem
    distinct = np.unique(knots)[1:-1]
    h = 1e-6
    # The error has kinks where a knot passes a datum and the spline has one at the knot.
    assume(np.abs(distinct[:, None] - lines.parameters).min() > 2 * h)
    assume(np.diff(np.unique(knots)).min() > 1e-3)
    functional = free_knots._Functional(lines, p)
    value = functional.of(knots)
    assert value is not None
    found = np.ldexp(value.slopes, 2 * functional.exponent)
    expected = []
    for t in distinct:
        sides = [_dense_error(lines, np.where(knots == t, t + step, knots), p) for step in (h, -h)]
        expected.append((sides[0] - sides[1]) / (2 * h))
    # The differences themselves are as far off as rounding over h, and as the curvature, which bad conditions enlarge.
    atol = 1e-5 * np.abs(expected).max() + 1e-7 * _scaled_condition(lines, knots, p) * value.error
    np.testing.assert_allclose(found, expected, rtol=0, atol=atol)


@given(_problems(), st.integers(0, 100))
def test_the_slopes_of_gaps_are_those_of_finite_differences(problem, seed):
    _, knots, p = problem
    gaps = free_knots._Gaps(knots, p, 1 / 39)
    rng = np.random.default_rng(seed)
    x, by_knot = gaps.x + rng.normal(size=len(gaps.x)), rng.normal(size=len(gaps.x) - 1)
    h = 1e-6
    expected = [
        (gaps.breaks(gaps.knots(x + h * e)) - gaps.breaks(gaps.knots(x - h * e)))[1:-1] @ by_knot / (2 * h)
        for e in np.eye(len(x))
    ]
    np.testing.assert_allclose(gaps.slopes(x, by_knot), expected, rtol=0, atol=1e-8)


@given(_problems())
def test_never_worse_than_the_start_in_order_clamped_and_apart(problem):
    lines, knots, p = problem
    result = move_knots(lines, knots, p)
    t = result.knots
    assert result.error <= result.start_error
    assert result.start_error == pytest.approx(_dense_error(lines, knots, p), rel=1e-9)
    assert result.error == pytest.approx(_dense_error(lines, t, p), rel=1e-9)
    assert 0 < result.evaluations <= 100
    # Equal knots moved as one, and the ends not at all.
    np.testing.assert_array_equal(np.diff(t) == 0, np.diff(knots) == 0)
    np.testing.assert_array_equal(t[[0, -1]], knots[[0, -1]])
    gaps, before = np.diff(np.unique(t)), np.diff(np.unique(knots))
    assert (gaps >= np.minimum(LEAST_GAP / 39, KEPT * before) * (1 - 1e-9)).all()
    # The estimate of the condition is at worst 0.7 of it.
    assert _scaled_condition(lines, t, p) <= CONDITION_GROWTH / 0.7 * _scaled_condition(lines, knots, p)


@given(st.integers(0, 10_000), st.sampled_from([1, 2, 3, 5]), st.integers(1, 30))
def test_a_least_gap_holds_whatever_is_tried(seed, degree, count):
    rng = np.random.default_rng(seed)
    knots = clamped(np.sort(rng.uniform(0, 1, count)), degree)
    gaps = free_knots._Gaps(knots, degree, 0.01)
    np.testing.assert_allclose(gaps.knots(gaps.x), knots, rtol=0, atol=1e-15)
    t = gaps.knots(rng.normal(size=count + 1) * 10.0 ** rng.integers(-1, 4))
    assert (np.diff(t) >= 0).all()
    np.testing.assert_array_equal(t[: degree + 1], 0.0)
    np.testing.assert_array_equal(t[-degree - 1 :], 1.0)
    assert (np.diff(gaps.breaks(t)) >= np.minimum(0.01, KEPT * np.diff(gaps.breaks(knots))) - 1e-15).all()


@pytest.mark.parametrize(("degree", "seed"), [(1, 0), (1, 1), (2, 0), (2, 3), (3, 0), (3, 4), (4, 1), (5, 0), (5, 3)])
def test_knots_of_a_spline_are_found_again(degree, seed):
    rng = np.random.default_rng(seed)
    u = np.linspace(0, 1, 120)
    gaps = rng.uniform(0.5, 1.5, 7)
    known = clamped(np.cumsum(gaps)[:-1] / gaps.sum(), degree)
    lines = _lines(naive.matrix(known, degree, u) @ rng.normal(size=(7 + degree, 4)), u)
    result = move_knots(lines, place_knots("averaged", u, 7 + degree, degree), degree, evaluations=300)
    assert result.error < 1e-8 * result.start_error  # measured: 1e-10 to 1e-12
    np.testing.assert_allclose(result.knots, known, rtol=0, atol=2e-5)


def test_a_kink_is_found_by_knots_that_move_as_one():
    start = clamped([0.3, 0.5, 0.5, 0.5, 0.7], 3)
    result = move_knots(_lines(np.abs(U - 0.456) + U**2), start, 3)
    assert np.unique(result.knots, return_counts=True)[1].tolist() == [4, 1, 3, 1, 4]
    assert result.knots[5] == pytest.approx(0.456, abs=1e-3)
    assert result.error < 1e-4 * result.start_error


# RMS at the data against that of averaged knots and of dominant points, as measured: factors of 35, 490, 177, 133 and
# of 5.4, 1.9, 12, 6.4.
@pytest.mark.parametrize(
    ("peak", "size", "averaged", "dominant"),
    [("lorentz", 10, 20, 3), ("lorentz", 20, 200, 1.5), ("gauss", 10, 100, 6), ("gauss", 20, 80, 4)],
)
def test_a_sharp_peak_is_fitted_many_times_better(peak, size, averaged, dominant):
    lines = _lines(PEAKS[peak])
    result = move_knots(lines, dominant_knots(lines, 3, size).of(size), 3)
    assert averaged * np.sqrt(result.error) < np.sqrt(lines.error(place_knots("averaged", U, size, 3), 3))
    assert dominant * np.sqrt(result.error) < np.sqrt(result.start_error)


@pytest.mark.parametrize("peak", list(PEAKS))
@pytest.mark.parametrize("size", [8, 12, 16, 30, 60])
def test_dominant_points_are_never_spoilt(peak, size, rng):
    lines = _lines(PEAKS[peak] + 1e-3 * rng.normal(size=91))
    path = dominant_knots(lines, 3, size)
    result = move_knots(lines, path.of(size), 3)
    assert result.error <= path.error_of(size) * (1 + 1e-12)


def _between(values: np.ndarray, knots: np.ndarray) -> float:
    """Return how far the spline fitted to values (m,) is at worst from what lies between them."""
    matrix = naive.matrix(knots, 3, U)
    x = np.linspace(0, 1, 901)
    return float(np.abs(naive.matrix(knots, 3, x) @ np.linalg.lstsq(matrix, values, rcond=None)[0] - np.sqrt(x)).max())


def test_nothing_runs_wild_between_the_data(rng, monkeypatch):
    values = np.sqrt(U) + 1e-3 * rng.normal(size=91)
    lines = _lines(values)
    wild = 0.0
    for size in (20, 40, 60):
        start = dominant_knots(lines, 3, size).of(size)
        before = _between(values, start)
        assert _between(values, move_knots(lines, start, 3).knots) < 1.5 * before
        with monkeypatch.context() as limits:
            for name, value in {"LEAST_GAP": 0.02, "KEPT": 0.01, "CONDITION_GROWTH": np.inf}.items():
                limits.setattr(free_knots, name, value)
            wild = max(wild, _between(values, move_knots(lines, start, 3).knots) / before)
    # This is what the limits are for.
    assert wild > 10


@pytest.mark.parametrize("degree", [1, 2, 3, 5, 8, 16])
def test_the_estimate_of_the_condition(degree, rng):
    from bvbedit.spline import free_knots_kernels, refinement_kernels

    tried = 0
    while tried < 30:
        lines, t = _random(rng, 60, 1), naive.random_knots(rng, degree, int(rng.integers(degree + 2, degree + 30)))
        expected = _scaled_condition(lines, t, degree)
        matrix = lines.collocation(t, degree)
        m, k = matrix.rows.shape
        upper, cosines, sines = np.zeros((matrix.columns, k)), np.empty((m, k)), np.empty((m, k))
        refinement_kernels.rotations(matrix.first, matrix.rows, upper, cosines, sines)
        if not expected < 1e10:
            continue
        tried += 1
        assert 0.7 * expected < free_knots_kernels.inverse_norm(upper) < expected * (1 + 1e-4)


def test_small_gaps_of_the_start_keep_their_share():
    knots = clamped([0.3, 0.3001, 0.37, 0.37 + 1e-9, 0.6], 3)
    result = move_knots(_lines(PEAKS["gauss"]), knots, 3)
    assert result.error < 0.5 * result.start_error
    gaps = np.diff(np.unique(result.knots))
    assert (gaps >= np.minimum(LEAST_GAP / 90, KEPT * np.diff(np.unique(knots))) * (1 - 1e-6)).all()


@pytest.mark.parametrize(
    ("knots", "degree"),
    [
        (place_knots("averaged", U, 12, 0), 0),
        (clamped([], 3), 3),
        (clamped([], 16), 16),
        (clamped([0.2, 0.5, 0.5, 0.8], 1), 1),
    ],
    ids=["degree 0", "no interior knots", "degree 16 without any", "a jump"],
)
def test_what_cannot_move_stays(knots, degree):
    lines = _lines(PEAKS["gauss"])
    result = move_knots(lines, knots, degree)
    np.testing.assert_array_equal(result.knots, knots)
    assert result.error == result.start_error == pytest.approx(lines.error(knots, degree), rel=1e-12)
    assert (result.evaluations, result.stopped) == (0, "no knot can be moved")


@pytest.mark.parametrize("values", [np.zeros(91), np.full(91, 3.0), U**3], ids=["zero", "constant", "a cubic"])
def test_data_that_are_met_already_leave_nothing_to_gain(values):
    knots = clamped([0.4, 0.7], 3)
    result = move_knots(_lines(values), knots, 3)
    np.testing.assert_array_equal(result.knots, knots)
    assert result.error == result.start_error
    assert (result.evaluations, result.stopped) == (0, "nothing is left to gain")


def test_deterministic():
    lines = _lines(PEAKS["lorentz"])
    first, second = (move_knots(lines, place_knots("averaged", U, 14, 3), 3) for _ in range(2))
    np.testing.assert_array_equal(first.knots, second.knots)
    assert (first.error, first.evaluations, first.stopped) == (second.error, second.evaluations, second.stopped)


@pytest.mark.parametrize("exponent", [-1000, -600, 600, 1000])
def test_knots_do_not_depend_on_the_scale_of_the_data(exponent):
    """Squares of such data leave the range of float64."""
    lines, start = _lines(PEAKS["lorentz"]), place_knots("averaged", U, 14, 3)
    scaled = replace(lines, factor=np.ldexp(lines.factor, exponent))
    np.testing.assert_array_equal(move_knots(scaled, start, 3).knots, move_knots(lines, start, 3).knots)


def test_knots_do_not_depend_on_the_domain():
    lines = _lines(PEAKS["lorentz"])
    far = replace(lines, parameters=1e3 + 64 * U)
    near = move_knots(lines, place_knots("averaged", U, 14, 3), 3, evaluations=30)
    result = move_knots(far, place_knots("averaged", far.parameters, 14, 3), 3, evaluations=30)
    np.testing.assert_allclose((result.knots - 1e3) / 64, near.knots, rtol=0, atol=1e-5)


def test_as_many_control_points_as_data(rng):
    """Nothing is left of the data, and the knots have no room."""
    knots = place_knots("averaged", U, 91, 3)
    result = move_knots(_lines(rng.normal(size=91)), knots, 3)
    assert result.error <= result.start_error < 1e-20


@dataclass(frozen=True)
class _Breaking(AxisLines):
    """Lines whose collocation matrix breaks from some call on, now and then or always."""

    value: float = np.nan
    every: int = 1
    calls: list[int] = field(default_factory=list)

    def collocation(self, knots: np.ndarray, degree: int) -> Banded:
        matrix = super().collocation(knots, degree)
        self.calls.append(1)
        if len(self.calls) > 1 and len(self.calls) % self.every == 0:
            matrix.rows[3:9] = self.value
        return matrix


def _broken(lines: AxisLines, value: float, every: int = 1) -> _Breaking:
    return _Breaking(lines.parameters, lines.factor, lines.roots, lines.noise, value, every)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_knots_without_a_value_are_never_the_result(value):
    """NLopt takes nan for a success after one evaluation."""
    lines, start = _lines(PEAKS["gauss"]), place_knots("averaged", U, 40, 3)
    always = move_knots(_broken(lines, value), start, 3)
    np.testing.assert_array_equal(always.knots, start)
    assert always.error == always.start_error == pytest.approx(lines.error(start, 3), rel=1e-9)
    sometimes = _broken(lines, value, every=4)
    result = move_knots(sometimes, start, 3)
    assert len(sometimes.calls) > 4
    assert result.error <= result.start_error
    assert np.isfinite(result.knots).all()


@pytest.mark.parametrize("after", [0, 1, 5, 20])
def test_stopping_keeps_the_best_so_far(after):
    lines, start = _lines(PEAKS["gauss"]), place_knots("averaged", U, 14, 3)
    asked: list[int] = []

    def stop() -> bool:
        asked.append(1)
        return len(asked) > after

    result = move_knots(lines, start, 3, should_stop=stop)
    assert (result.evaluations, result.stopped) == (after, "stopped on request")
    assert result.error == pytest.approx(lines.error(result.knots, 3), rel=1e-9)
    if after == 0:
        np.testing.assert_array_equal(result.knots, start)
    else:
        same = move_knots(lines, start, 3, evaluations=after)
        np.testing.assert_array_equal(result.knots, same.knots)
        assert (same.evaluations, same.stopped) == (after, "all evaluations were used")
    if after == 20:
        assert result.error < 0.1 * result.start_error


def test_more_evaluations_never_harm():
    lines, start = _lines(PEAKS["lorentz"]), place_knots("averaged", U, 14, 3)
    errors = [move_knots(lines, start, 3, evaluations=count).error for count in (1, 3, 10, 30, 100, 300)]
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < 1e-3 * errors[0]


def test_progress_rises_to_one():
    reported: list[float] = []
    move_knots(_lines(PEAKS["gauss"]), place_knots("averaged", U, 14, 3), 3, progress=reported.append)
    assert reported == sorted(reported)
    assert reported[0] > 0
    assert reported[-1] == 1.0
    assert len(reported) > 3


def test_nothing_of_a_search_is_kept_afterwards():
    # NLopt's optimizers are not seen by the garbage collector: one that its objective held would stay for ever.
    def kept():
        gc.collect()
        return sum(isinstance(o, free_knots._Search) for o in gc.get_objects())

    before = kept()
    move_knots(_lines(PEAKS["gauss"]), place_knots("averaged", U, 14, 3), 3)
    assert kept() == before


class _Own(Exception):  # noqa: N818
    """An exception of the caller's own."""


@pytest.mark.parametrize("kind", [KeyboardInterrupt, _Own, RuntimeError])
@pytest.mark.parametrize("door", ["progress", "should_stop"])
def test_what_callers_raise_comes_out(kind, door):
    """NLopt gives out whatever is raised inside, a Ctrl-C even, as an error of its own without a word."""

    def raising(*_: object) -> bool:
        raise kind("mine")

    with pytest.raises(kind, match="mine"):
        move_knots(_lines(PEAKS["gauss"]), place_knots("averaged", U, 14, 3), 3, **{door: raising})


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"knots": [0, 0, 0, 0, 0.5, 1, 1, 1]}, "clamped"),
        ({"knots": clamped([0.2], 3, 0.0, 0.9)}, "lie outside the knots"),
        ({"knots": clamped([0.2], 3, 0.1, 1.0)}, "lie outside the knots"),
        ({"knots": clamped([0.501, 0.502, 0.503, 0.504, 0.505, 0.506], 3)}, "do not determine 10 control points"),
        ({"knots": clamped(np.linspace(0, 1, 100)[1:-1], 3)}, "do not determine 102 control points"),
        ({"lines": _made(U, np.full((91, 2), np.nan), np.ones(91))}, "not finite"),
        ({"lines": _made(U, np.full((91, 2), np.inf), np.ones(91))}, "not finite"),
        ({"degree": 17}, "17"),
        ({"evaluations": 0}, "0 evaluations"),
        ({"evaluations": 1.5}, "1.5 evaluations"),
        ({"evaluations": True}, "True evaluations"),
    ],
)
def test_refusals(changes, match):
    sound = {"lines": _lines(PEAKS["gauss"]), "knots": clamped([0.5], 3), "degree": 3}
    assert match in refusal(lambda: move_knots(**(sound | changes)))


def test_nlopt_is_loaded_where_it_is_needed():
    code = "import sys, bvbedit.spline.free_knots; sys.exit(bool({'nlopt', 'numba'} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
