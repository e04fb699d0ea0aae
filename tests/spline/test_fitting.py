"""Lofting is the tensor-product least-squares solution; the weighted fit is the dense weighted one."""

import functools
from collections.abc import Callable, Sequence

import numba
import numpy as np
import pytest

from bvbedit import BvbError
from bvbedit.spline.fitting import CONDITION_LIMIT, MARGINAL_FLOOR, fit_axis, fit_weighted, loft
from bvbedit.spline.knots import clamped, place_knots
from bvbedit.spline.tensor import TensorSpline
from tests.spline import naive

Net = np.ndarray
Case = tuple[np.ndarray, list[np.ndarray], list[np.ndarray], tuple[int, ...]]

# Data, control points and degrees along each axis, for 1 to 4 parameters.
PROBLEMS = [
    ((12,), (7,), (3,)),
    ((9, 8), (5, 6), (3, 1)),
    ((9, 8, 10), (5, 4, 6), (3, 2, 3)),
    ((6, 5, 5, 4), (4, 3, 3, 2), (3, 2, 1, 0)),
]


def _problem(rng: np.random.Generator, m: Sequence[int], n: Sequence[int], degrees: tuple[int, ...]) -> Case:
    """Random values of two channels on unevenly spaced nodes, and averaged knots."""
    axes = [np.cumsum(rng.uniform(0.5, 1.5, count)) for count in m]
    axes = [(u - u[0]) / (u[-1] - u[0]) for u in axes]
    knots = [place_knots("averaged", u, size, p) for u, size, p in zip(axes, n, degrees, strict=True)]
    return rng.normal(size=(*m, 2)), axes, knots, degrees


def _kronecker(axes: list[np.ndarray], knots: list[np.ndarray], degrees: tuple[int, ...]) -> np.ndarray:
    """Return the collocation matrix of the whole grid, (m_1 ... m_d, n_1 ... n_d), which nobody should assemble."""
    return functools.reduce(np.kron, [naive.matrix(t, p, u) for u, t, p in zip(axes, knots, degrees, strict=True)])


def _weights(rng: np.random.Generator, shape: Sequence[int]) -> np.ndarray:
    """Weights over four decades that no product of marginals makes; a quarter of them zero."""
    return np.where(rng.uniform(size=shape) < 0.25, 0.0, 10.0 ** rng.uniform(-4, 0, shape))


def _dense_weighted(
    matrix: np.ndarray, weights: np.ndarray, values: np.ndarray, size: Sequence[int], project: Callable[[Net], Net]
) -> Net:
    """Solve min |sqrt(W) (A E z - y)| with the columns of E an orthonormal basis of the nets that ``project`` keeps."""
    channels = values.shape[-1]
    kept = np.stack([project(e.reshape(*size, 1)).ravel() for e in np.eye(matrix.shape[1])])
    np.testing.assert_allclose(kept @ kept, kept, rtol=0, atol=1e-14)
    np.testing.assert_allclose(kept, kept.T, rtol=0, atol=1e-14)
    q, singular, _ = np.linalg.svd(kept)
    allowed = q[:, singular > 0.5]
    root = np.sqrt(weights.ravel())[:, None]
    z = np.linalg.lstsq(root * (matrix @ allowed), root * values.reshape(-1, channels), rcond=None)[0]
    return allowed @ z


@pytest.mark.parametrize(("m", "n", "degrees"), PROBLEMS)
def test_lofting_is_the_assembled_least_squares_solution(m, n, degrees, rng):
    values, axes, knots, _ = _problem(rng, m, n, degrees)
    dense = np.linalg.lstsq(_kronecker(axes, knots, degrees), values.reshape(-1, 2), rcond=None)[0]
    ours = loft(values, axes, knots, degrees).spline
    assert ours.degrees == degrees
    np.testing.assert_allclose(ours.control.reshape(-1, 2), dense, rtol=0, atol=1e-10 * np.abs(dense).max())


@pytest.mark.parametrize("degrees", [(3, 3, 3), (0, 1, 5), (2, 8, 3)])
@pytest.mark.parametrize("placement", ["averaged", "uniform", "piegl-tiller"])
def test_a_spline_of_the_same_space_is_reproduced(placement, degrees, rng):
    axes = [np.linspace(0, 1, m) for m in (21, 30, 25)]
    knots = [place_knots(placement, u, n, p) for u, n, p in zip(axes, (9, 10, 8), degrees, strict=True)]
    spline = TensorSpline(degrees, knots, rng.normal(size=(9, 10, 8, 3)))
    result = loft(spline.evaluate_grid(axes), axes, knots, degrees)
    np.testing.assert_allclose(result.spline.control, spline.control, rtol=0, atol=1e-10)
    assert result.notes == ()


def test_as_many_control_points_as_data_interpolate(rng):
    u = np.linspace(0, 1, 30)
    y = rng.normal(size=(30, 1))
    spline = loft(y, [u], [place_knots("averaged", u, 30, 3)], [3]).spline
    np.testing.assert_allclose(spline.evaluate(u[:, None]), y, rtol=0, atol=1e-12)


@pytest.mark.parametrize("exponent", [-1000, -500, 500, 900])
def test_lofting_scales_with_the_data(exponent, rng):
    values, axes, knots, degrees = _problem(rng, (9, 8), (5, 6), (3, 3))
    plain, scaled = (loft(v, axes, knots, degrees).spline.control for v in (values, np.ldexp(values, exponent)))
    np.testing.assert_allclose(scaled, np.ldexp(plain, exponent), rtol=1e-10, atol=0)


def test_conditions_are_those_of_the_collocation_matrices(rng):
    values, axes, knots, degrees = _problem(rng, (9, 8, 10), (5, 4, 6), (3, 2, 3))
    expected = [np.linalg.cond(naive.matrix(t, p, u)) for u, t, p in zip(axes, knots, degrees, strict=True)]
    assert loft(values, axes, knots, degrees).conditions == pytest.approx(expected, rel=1e-9)


def test_an_axis_offers_its_pseudo_inverse_and_inverse_normal_matrix(rng):
    u, t = np.linspace(0, 1, 14), naive.random_knots(rng, 3, 8)
    w = rng.uniform(0.1, 1.0, 14)
    a = naive.matrix(t, 3, u)
    axis = fit_axis(u, t, 3, w)
    np.testing.assert_allclose(axis.inverse_normal, np.linalg.inv(a.T @ (w[:, None] * a)), rtol=1e-8, atol=1e-10)
    expected = np.linalg.pinv(np.sqrt(w)[:, None] * a) * np.sqrt(w)
    np.testing.assert_allclose(axis.pseudo_inverse, expected, rtol=0, atol=1e-10)


@pytest.mark.parametrize("size", [88, 89, 90, 91])
def test_knots_that_ruin_the_solution_are_tamed_and_confessed(size, rng):
    """A plain QR solve returns coefficients of 5e22 on these (numerics.md)."""
    u = np.linspace(0, 1, 91)
    y = np.exp(-(((u - 0.3) / 0.05) ** 2))[:, None] + 0.05 * rng.normal(size=(91, 1))
    knots = place_knots("piegl-tiller", u, size, 3)
    result = loft(y, [u], [knots], [3])
    assert result.conditions[0] > 1e15
    assert len(result.notes) == 1
    assert "axis 0" in result.notes[0]
    assert "penalty" in result.notes[0]
    assert np.abs(result.spline.control).max() < 1e4 * np.abs(y).max()
    # The penalty must not spoil what the data determine: no worse than three quarters as many averaged knots.
    fewer = loft(y, [u], [place_knots("averaged", u, 68, 3)], [3])
    errors = [np.sqrt(np.mean((f.spline.evaluate_grid([u]) - y) ** 2)) for f in (result, fewer)]
    assert errors[0] < errors[1]


@pytest.mark.parametrize("size", [88, 91])
def test_the_penalty_leaves_what_the_data_determine(size):
    u = np.linspace(0, 1, 91)
    result = loft(np.sin(6 * u)[:, None], [u], [place_knots("piegl-tiller", u, size, 3)], [3])
    assert result.notes
    np.testing.assert_allclose(result.spline.evaluate(u[:, None])[:, 0], np.sin(6 * u), rtol=0, atol=1e-7)


def test_knots_that_leave_a_control_point_without_data_are_tamed_too():
    u = np.linspace(0, 1, 20)
    knots = clamped([0.501, 0.502, 0.503, 0.504, 0.505, 0.506], 3)
    result = loft(np.sin(3 * u)[:, None], [u], [knots], [3])
    assert result.conditions[0] > CONDITION_LIMIT
    assert result.notes
    x = np.linspace(0, 1, 400)
    np.testing.assert_allclose(result.spline.evaluate(x[:, None])[:, 0], np.sin(3 * x), rtol=0, atol=0.02)


def test_more_control_points_than_data_are_refused(rng):
    u, knots = np.linspace(0, 1, 8), clamped(np.linspace(0, 1, 7)[1:-1], 3)
    with pytest.raises(BvbError, match="9 control points cannot be fitted to 8 data"):
        loft(rng.normal(size=(8, 1)), [u], [knots], [3])


def test_a_factor_that_would_fill_the_memory_is_refused():
    u = np.linspace(0, 1, 20_000)
    with pytest.raises(BvbError, match="MiB"):
        fit_axis(u, place_knots("uniform", u, 10_000, 3), 3)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_data_that_are_not_finite_are_refused_by_index(bad, rng):
    values, axes, knots, degrees = _problem(rng, (9, 8), (5, 6), (3, 3))
    values[4, 7, 1] = bad
    with pytest.raises(BvbError, match=r"\(4, 7, 1\)"):
        loft(values, axes, knots, degrees)
    with pytest.raises(BvbError, match=r"\(4, 7, 1\)"):
        fit_weighted(values, np.ones((9, 8)), axes, knots, degrees, start=np.zeros((5, 6, 2)))


@pytest.mark.parametrize("drop", ["values", "axes", "knots", "degrees"])
def test_data_that_do_not_lie_on_the_grid_are_refused(drop, rng):
    values, axes, knots, degrees = _problem(rng, (9, 8), (5, 6), (3, 3))
    given = {"values": values, "axes": axes, "knots": knots, "degrees": degrees}
    given[drop] = given[drop][:-1]
    with pytest.raises(BvbError, match="grid"):
        loft(given["values"], given["axes"], given["knots"], given["degrees"])


@pytest.mark.parametrize(
    "nodes", [[0, 0.2, 0.4, 0.6, 0.8, 2.0], [-0.5, 0.2, 0.4, 0.6, 0.8, 1], [0, 0.2, np.nan, 0.6, 0.8, 1]]
)
def test_nodes_outside_the_knots_are_refused(nodes):
    """Outside the domain no spline has a value, and what is fitted there by extrapolation means nothing."""
    with pytest.raises(BvbError, match="axis 0 lie outside the knots"):
        loft(np.ones((6, 1)), [np.array(nodes)], [clamped([], 3)], [3])


@pytest.mark.parametrize("nodes", [np.full(6, 0.5), np.linspace(1, 0, 6), np.array([0, 0.2, 0.2, 0.6, 0.8, 1])])
def test_nodes_that_do_not_increase_are_refused(nodes):
    """Coinciding nodes once went through, with coefficients of 2e16."""
    with pytest.raises(BvbError, match="axis 0 do not increase"):
        loft(np.ones((6, 1)), [nodes], [clamped([], 3)], [3])


@pytest.mark.parametrize("weights", [np.zeros(6), -np.ones(6), np.full(6, np.nan), np.full(6, np.inf), np.ones(5)])
def test_weights_that_mean_nothing_are_refused(weights):
    u = np.linspace(0, 1, 6)
    with pytest.raises(BvbError, match="Weights"):
        fit_weighted(np.ones((6, 1)), weights, [u], [clamped([], 3)], [3], start=np.zeros((4, 1)))


@pytest.mark.parametrize("start", [np.zeros((5, 1)), np.zeros((4, 2)), np.zeros(4), np.full((4, 1), np.nan)])
def test_starts_that_are_no_net_of_this_fit_are_refused(start):
    u = np.linspace(0, 1, 6)
    with pytest.raises(BvbError, match="start"):
        fit_weighted(np.ones((6, 1)), np.ones(6), [u], [clamped([], 3)], [3], start=start)


@pytest.mark.parametrize(("m", "n", "degrees"), PROBLEMS)
def test_the_weighted_fit_is_the_dense_weighted_solution(m, n, degrees, rng):
    values, axes, knots, _ = _problem(rng, m, n, degrees)
    weights = _weights(rng, m)
    matrix = _kronecker(axes, knots, degrees)
    expected = _dense_weighted(matrix, weights, values, n, lambda net: net)
    result = fit_weighted(
        values, weights, axes, knots, degrees, start=np.zeros((*n, 2)), tolerance=1e-10, max_iterations=2000
    )
    fitted, wanted = (matrix @ c.reshape(-1, 2) for c in (result.spline.control, expected))
    used = weights.ravel() > 0
    np.testing.assert_allclose(fitted[used], wanted[used], rtol=0, atol=1e-6 * np.abs(values).max())
    assert result.residual <= 1e-10
    assert result.notes == ()


def _project(net: Net) -> Net:
    """Return the nearest net whose first two layers are equal and do not vary along the last axis."""
    out = net.copy()
    out[:2] = net[:2].mean(axis=(0, -2), keepdims=True)
    return out


@pytest.mark.parametrize(("m", "n", "degrees"), PROBLEMS[1:])
def test_the_constrained_fit_is_the_dense_constrained_solution(m, n, degrees, rng):
    values, axes, knots, _ = _problem(rng, m, n, degrees)
    weights = _weights(rng, m)
    matrix = _kronecker(axes, knots, degrees)
    expected = _dense_weighted(matrix, weights, values, n, _project)
    start = loft(values, axes, knots, degrees).spline.control
    result = fit_weighted(
        values, weights, axes, knots, degrees, start=start, project=_project, tolerance=1e-10, max_iterations=2000
    )
    control = result.spline.control
    assert np.ptp(control[:2], axis=(0, -2)).max() == 0  # to the last bit, whatever rounding the iteration gathered
    used = weights.ravel() > 0
    fitted, wanted = (matrix @ c.reshape(-1, 2) for c in (control, expected))
    np.testing.assert_allclose(fitted[used], wanted[used], rtol=0, atol=1e-6 * np.abs(values).max())


def test_equal_weights_give_the_lofted_net(rng):
    values, axes, knots, degrees = _problem(rng, (9, 8, 10), (5, 4, 6), (3, 2, 3))
    lofted = loft(values, axes, knots, degrees).spline.control
    result = fit_weighted(
        values, np.full((9, 8, 10), 0.3), axes, knots, degrees, start=np.zeros_like(lofted), tolerance=1e-12
    )
    np.testing.assert_allclose(result.spline.control, lofted, rtol=0, atol=1e-10)
    assert result.iterations <= 3  # the preconditioner is the inverse itself


def test_data_of_weight_zero_have_no_influence(rng):
    values, axes, knots, degrees = _problem(rng, (12, 11, 10), (5, 4, 6), (3, 2, 3))
    weights = _weights(rng, (12, 11, 10))
    weights[:, 9:] = 0.0
    garbage = np.where(weights[..., None] == 0, 1e6, values)
    start = loft(values, axes, knots, degrees).spline.control
    solve = functools.partial(
        fit_weighted,
        weights=weights,
        parameters=axes,
        knots=knots,
        degrees=degrees,
        tolerance=1e-11,
        max_iterations=3000,
    )
    clean, soiled = solve(values, start=start), solve(garbage, start=start)
    np.testing.assert_array_equal(soiled.spline.control, clean.spline.control)
    # Nor where the start comes from the garbage itself.
    misled = solve(garbage, start=loft(garbage, axes, knots, degrees).spline.control)
    used = weights > 0
    fitted = [r.spline.evaluate_grid(axes)[used] for r in (misled, clean)]
    np.testing.assert_allclose(*fitted, rtol=0, atol=1e-4)


def test_control_points_without_any_datum_follow_the_start(rng):
    """Of the nets that fit equally well: the one whose spline is nearest to the start's, weighed by the marginals."""
    u = np.linspace(0, 1, 41)
    knots = place_knots("averaged", u, 12, 3)
    weights = np.where(u < 0.5, 1.0, 0.0)
    basis = naive.matrix(knots, 3, u)
    unseen = basis[weights > 0].max(axis=0) == 0
    assert unseen.sum() == 4
    start = rng.normal(size=(12, 1))
    result = fit_weighted(np.sin(6 * u)[:, None], weights, [u], [knots], [3], start=start, tolerance=1e-10)
    moved = result.spline.control - start
    normal = basis.T @ (np.maximum(weights, MARGINAL_FLOOR)[:, None] * basis)
    expected = -np.linalg.solve(normal[np.ix_(unseen, unseen)], normal[np.ix_(unseen, ~unseen)] @ moved[~unseen])
    np.testing.assert_allclose(moved[unseen], expected, rtol=0, atol=1e-7)


@pytest.mark.parametrize("iterations", [1, 2, 5, 20])
def test_the_objective_never_rises_above_the_start(iterations, rng):
    values, axes, knots, degrees = _problem(rng, (12, 11, 10), (5, 4, 6), (3, 2, 3))
    weights = _weights(rng, (12, 11, 10))

    def objective(control: Net) -> float:
        fitted = TensorSpline(degrees, knots, control).evaluate_grid(axes)
        return float(np.sum(weights[..., None] * (fitted - values) ** 2))

    start = loft(values, axes, knots, degrees).spline.control
    results = [
        fit_weighted(
            values, weights, axes, knots, degrees, start=start, project=_project, tolerance=1e-14, max_iterations=k
        )
        for k in (iterations, iterations + 1)
    ]
    steps = [objective(_project(start)), *(objective(r.spline.control) for r in results)]
    assert steps[0] >= steps[1] >= steps[2] * (1 - 1e-12)
    assert results[0].iterations == iterations
    assert "stopped after" in results[0].notes[-1]
    assert results[0].residual > 0


def test_a_start_at_the_solution_stays(rng):
    _, axes, knots, degrees = _problem(rng, (9, 8), (5, 6), (3, 3))
    spline = TensorSpline(degrees, knots, rng.normal(size=(5, 6, 2)))
    data, weights = spline.evaluate_grid(axes), _weights(rng, (9, 8))
    result = fit_weighted(data, weights, axes, knots, degrees, start=spline.control)
    np.testing.assert_allclose(result.spline.control, spline.control, rtol=0, atol=1e-12)


@pytest.mark.parametrize("start", [0.0, 1.0])
def test_data_of_zeros_are_fitted_by_zeros(start):
    u = np.linspace(0, 1, 9)
    reported: list[float] = []
    result = fit_weighted(
        np.zeros((9, 1)),
        np.linspace(0.1, 1.0, 9),
        [u],
        [clamped([0.5], 3)],
        [3],
        start=np.full((5, 1), start),
        progress=reported.append,
    )
    np.testing.assert_allclose(result.spline.control, 0.0, rtol=0, atol=1e-9)
    assert all(0 <= p <= 1 for p in reported)


@pytest.mark.parametrize(("of_values", "of_weights"), [(-996, 0), (996, 0), (0, -996), (0, 1020)])
def test_the_weighted_fit_scales_with_data_and_ignores_the_scale_of_weights(of_values, of_weights, rng):
    """Squares of such values leave the range of float64: that must not end the iteration at the start."""
    values, axes, knots, degrees = _problem(rng, (9, 8), (5, 6), (3, 3))
    weights = rng.uniform(0.1, 1.0, (9, 8))

    start = loft(values, axes, knots, degrees).spline.control

    def solve(of_values: int, of_weights: int) -> Net:
        y, w, first = np.ldexp(values, of_values), np.ldexp(weights, of_weights), np.ldexp(start, of_values)
        net = fit_weighted(y, w, axes, knots, degrees, start=first, tolerance=1e-10).spline.control
        return np.ldexp(net, -of_values)

    np.testing.assert_allclose(solve(of_values, of_weights), solve(0, 0), rtol=0, atol=1e-7)


def test_data_at_the_end_of_float64_are_fitted():
    """Sums of such values leave its range too."""
    u, largest = np.linspace(0, 1, 9), 0.5 * np.finfo(float).max
    result = fit_weighted(
        np.full((9, 1), largest), np.linspace(0.1, 1.0, 9), [u], [clamped([0.5], 3)], [3], start=np.zeros((5, 1))
    )
    np.testing.assert_allclose(result.spline.control, largest, rtol=1e-9)


def test_progress_rises_to_one(rng):
    values, axes, knots, degrees = _problem(rng, (9, 8, 10), (5, 4, 6), (3, 2, 3))
    reported: list[float] = []
    fit_weighted(
        values,
        _weights(rng, (9, 8, 10)),
        axes,
        knots,
        degrees,
        start=np.zeros((5, 4, 6, 2)),
        tolerance=1e-8,
        max_iterations=2000,
        progress=reported.append,
    )
    assert reported[-1] == 1.0
    assert all(p <= 1.0 for p in reported)
    assert len(reported) > 3


def test_the_number_of_threads_changes_no_bit(rng):
    values, axes, knots, degrees = _problem(rng, (15, 40, 30), (5, 9, 8), (3, 3, 3))
    weights, before = _weights(rng, (15, 40, 30)), numba.get_num_threads()
    nets = []
    try:
        for count in (1, numba.config.NUMBA_NUM_THREADS):
            numba.set_num_threads(count)
            start = loft(values, axes, knots, degrees).spline.control
            nets.append(fit_weighted(values, weights, axes, knots, degrees, start=start).spline.control)
    finally:
        numba.set_num_threads(before)
    np.testing.assert_array_equal(*nets)
