"""Smoothing is the dense penalised solution, and the strength that is chosen is the one that brute force finds."""

import functools
from collections.abc import Callable, Sequence

import numpy as np
import pytest

from bvbedit import BvbError
from bvbedit.spline.fitting import MARGINAL_FLOOR, fit_weighted, loft
from bvbedit.spline.knots import clamped, greville, place_knots
from bvbedit.spline.smoothing import LARGEST_STRENGTH, Smoothing, choose_strength, second_differences, smooth
from bvbedit.spline.tensor import TensorSpline
from tests.spline import naive
from tests.spline.refusals import refusal

Net = np.ndarray
Case = tuple[np.ndarray, list[np.ndarray], list[np.ndarray], tuple[int, ...]]

# Data, control points and degrees along each axis, for 1 to 3 parameters.
PROBLEMS = [
    ((14,), (8,), (3,)),
    ((10, 9), (6, 5), (3, 1)),
    ((9, 8, 10), (5, 4, 6), (3, 2, 3)),
]
each_problem = pytest.mark.parametrize(("m", "n", "degrees"), PROBLEMS)


def _problem(rng: np.random.Generator, m: Sequence[int], n: Sequence[int], degrees: tuple[int, ...]) -> Case:
    """Random values of two channels on unevenly spaced nodes, and averaged knots."""
    axes = [np.cumsum(rng.uniform(0.5, 1.5, count)) for count in m]
    axes = [(u - u[0]) / (u[-1] - u[0]) for u in axes]
    knots = [place_knots("averaged", u, size, p) for u, size, p in zip(axes, n, degrees, strict=True)]
    return rng.normal(size=(*m, 2)), axes, knots, degrees


def _weights(rng: np.random.Generator, shape: Sequence[int]) -> np.ndarray:
    """Weights over two decades that no product of marginals makes; a quarter of them zero."""
    return np.where(rng.uniform(size=shape) < 0.25, 0.0, 10.0 ** rng.uniform(-2, 0, shape))


def _separable(rng: np.random.Generator, shape: Sequence[int]) -> np.ndarray:
    return functools.reduce(np.multiply.outer, [rng.uniform(0.05, 1.0, m) for m in shape])


def _kronecker(matrices: Sequence[np.ndarray]) -> np.ndarray:
    return functools.reduce(np.kron, matrices)


def _differences(knots: np.ndarray, degree: int) -> np.ndarray:
    """Return the difference matrix row by row, from the parabola through three control points over their abscissae."""
    g = greville(knots, degree)
    mean = (g[-1] - g[0]) / (len(g) - 1) if len(g) > 1 else 1.0
    out = np.zeros((max(len(g) - 2, 0), len(g)))
    for i in range(len(out)):
        h1, h2 = g[i + 1] - g[i], g[i + 2] - g[i + 1]
        for j in range(3):
            parabola = np.polyfit([-h1, 0.0, h2], np.eye(3)[j], 2)
            out[i, i + j] = 2 * parabola[0] * mean**2 * 4 * h1 * h2 / (h1 + h2) ** 2
    return out


def _marginals(weights: np.ndarray, case: Case) -> tuple[list[np.ndarray], float]:
    """Return the normal matrices of the marginals, whose largest weight is one, and the level of their product."""
    _, axes, knots, degrees = case
    d = len(axes)
    marginals = [weights.mean(axis=tuple(b for b in range(d) if b != a)) for a in range(d)]
    marginals = [np.maximum(w / w.max(), MARGINAL_FLOOR) for w in marginals]
    bases = [naive.matrix(t, p, u) for u, t, p in zip(axes, knots, degrees, strict=True)]
    normals = [a.T @ (w[:, None] * a) for a, w in zip(bases, marginals, strict=True)]
    return normals, weights.mean() / np.prod([w.mean() for w in marginals])


def _dense(weights: np.ndarray, case: Case) -> tuple[np.ndarray, np.ndarray]:
    """Return the collocation matrix of the whole grid and the penalty matrix for strength one."""
    _, axes, knots, degrees = case
    d = len(axes)
    bases = [naive.matrix(t, p, u) for u, t, p in zip(axes, knots, degrees, strict=True)]
    normals, level = _marginals(weights, case)
    total = np.zeros((np.prod([len(n) for n in normals]),) * 2)
    for a in range(d):
        difference = _differences(knots[a], degrees[a])
        penalty = difference.T @ difference
        scale = np.trace(normals[a]) / np.trace(penalty)
        total += level * scale * _kronecker([penalty if b == a else normals[b] for b in range(d)])
    return _kronecker(bases), total


def _solution(weights: np.ndarray, case: Case, strength: float) -> np.ndarray:
    """Solve the penalised normal equations, (n_1 ... n_d, c)."""
    values = case[0]
    a, penalty = _dense(weights, case)
    w = weights.reshape(-1, 1)
    return np.linalg.solve(a.T @ (w * a) + strength * penalty, a.T @ (w * values.reshape(-1, values.shape[-1])))


def _brute_scores(weights: np.ndarray, case: Case, strengths: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
    """Return the square root of the GCV score and the trace of the hat matrix of each of the ``strengths``."""
    values = case[0]
    a, penalty = _dense(weights, case)
    root = np.sqrt(weights.reshape(-1, 1))
    y, count = root * values.reshape(len(root), -1), len(root)
    scores, traces = [], []
    for strength in strengths:
        hat = root * a @ np.linalg.solve(a.T @ (root**2 * a) + strength * penalty, (root * a).T)
        residual = np.sum((y - hat @ y) ** 2) / y.shape[1]
        scores.append(np.sqrt(count * residual) / (count - np.trace(hat)))
        traces.append(np.trace(hat))
    return np.array(scores), np.array(traces)


def _wavy(axes: Sequence[np.ndarray]) -> np.ndarray:
    """A smooth function of two channels that no small net reproduces, of size one."""
    u, v, w = np.meshgrid(*axes, indexing="ij")
    f = np.exp(-(((u - 0.3) / 0.25) ** 2)) * (1 + 0.3 * v) + 0.3 * np.cos(3 * w) * u
    return np.stack([f, v**2 - 0.5 * f], axis=-1)


def _noisy(rng: np.random.Generator, sigma: float) -> tuple[np.ndarray, Case]:
    """Return the wavy function on a grid, and the problem to find it again under noise."""
    axes = [np.linspace(0, 1, m) for m in (24, 20, 22)]
    knots = [place_knots("uniform", u, n, 3) for u, n in zip(axes, (15, 12, 13), strict=True)]
    truth = _wavy(axes)
    return truth, (truth + sigma * rng.normal(size=truth.shape), axes, knots, (3, 3, 3))


def _solve(weights: np.ndarray, case: Case, strength: float | None = None, **options: object) -> Net:
    values, *rest = case
    settings = {"tolerance": 1e-11, "max_iterations": 5000} | options
    return smooth(values, weights, *rest, strength=strength, **settings)[0].spline.control


@pytest.mark.parametrize(("degree", "size"), [(0, 6), (1, 6), (2, 7), (3, 9), (5, 9), (3, 4)])
def test_differences_are_those_of_parabolas_and_vanish_on_lines(degree, size, rng):
    knots = clamped(np.sort(rng.uniform(0.0, 1.0, size - degree - 1)), degree, 0.0, 1.0)
    g = greville(knots, degree)
    if np.diff(g).min() > 0.05 * np.diff(g).mean():
        np.testing.assert_allclose(second_differences(knots, degree), _differences(knots, degree), rtol=0, atol=1e-9)
    np.testing.assert_allclose(second_differences(knots, degree) @ (3 * g - 7), 0, rtol=0, atol=1e-11)


def test_equidistant_control_points_have_plain_differences():
    knots = clamped(np.linspace(0, 1, 9)[1:-1], 1)
    np.testing.assert_allclose(second_differences(knots, 1), np.diff(np.eye(9), 2, axis=0), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("size", [1, 2])
def test_fewer_than_three_control_points_have_no_differences(size):
    assert second_differences(clamped(np.linspace(0, 1, size + 1)[1:-1], 0), 0).shape == (0, size)


@pytest.mark.parametrize("unit", [1e-90, 1e90])
def test_differences_do_not_depend_on_the_unit_of_the_parameter(unit, rng):
    knots = naive.random_knots(rng, 3, 12)
    np.testing.assert_allclose(second_differences(unit * knots, 3), second_differences(knots, 3), rtol=1e-10, atol=0)


@pytest.mark.parametrize("gap", [0.0, 1e-99, 1e-17, 1e-9])
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_coinciding_knots_leave_differences_bounded(gap, degree):
    """A jump, and knots next to zero at which not even an ulp keeps neighbours apart."""
    knots = clamped(np.concatenate([[-0.5], gap * np.arange(degree + 1), [0.5]]), degree, -1.0, 1.0)
    rows = second_differences(knots, degree)
    assert np.isfinite(rows).all()
    assert np.abs(rows).max() <= 200
    np.testing.assert_allclose(rows @ greville(knots, degree), 0, rtol=0, atol=1e-13)


@each_problem
@pytest.mark.parametrize("strength", [1e-4, 1.0, 1e4])
def test_the_smoothed_net_is_the_dense_penalised_solution(m, n, degrees, strength, rng):
    case = _problem(rng, m, n, degrees)
    weights = _weights(rng, m)
    expected = _solution(weights, case, strength).reshape(*n, 2)
    scale = np.abs(expected).max()
    np.testing.assert_allclose(_solve(weights, case, strength), expected, rtol=0, atol=1e-6 * scale)
    start = rng.normal(size=(*n, 2))
    np.testing.assert_allclose(_solve(weights, case, strength, start=start), expected, rtol=0, atol=1e-6 * scale)


@each_problem
def test_separable_weights_need_no_iteration(m, n, degrees, rng):
    """The start is the solution, and from another one the preconditioner is the inverse itself."""
    case = _problem(rng, m, n, degrees)
    weights = _separable(rng, m)
    values, *rest = case
    result, _ = smooth(values, weights, *rest, strength=2.0, tolerance=1e-9)
    assert result.iterations == 0
    expected = _solution(weights, case, 2.0).reshape(*n, 2)
    np.testing.assert_allclose(result.spline.control, expected, rtol=0, atol=1e-9)
    result, _ = smooth(values, weights, *rest, strength=2.0, tolerance=1e-9, start=rng.normal(size=(*n, 2)))
    assert result.iterations <= 2
    np.testing.assert_allclose(result.spline.control, expected, rtol=0, atol=1e-7)


@each_problem
def test_strength_zero_is_the_weighted_fit(m, n, degrees, rng):
    values, axes, knots, _ = _problem(rng, m, n, degrees)
    weights = _weights(rng, m) + 1e-3
    start = loft(values, axes, knots, degrees).spline.control
    options = {"start": start, "tolerance": 1e-11, "max_iterations": 5000}
    plain = fit_weighted(values, weights, axes, knots, degrees, **options).spline.control
    smoothed = smooth(values, weights, axes, knots, degrees, strength=0, **options)[0].spline.control
    np.testing.assert_allclose(smoothed, plain, rtol=0, atol=1e-6 * np.abs(plain).max())


@each_problem
@pytest.mark.parametrize("strength", [1e11, LARGEST_STRENGTH])
def test_without_bound_the_weighted_multilinear_function_is_left(m, n, degrees, strength, rng):
    values, axes, *rest = _problem(rng, m, n, degrees)
    weights = _weights(rng, m)
    lines = _kronecker([np.stack([np.ones(len(u)), u], axis=1) for u in axes])
    root = np.sqrt(weights.reshape(-1, 1))
    fitted = lines @ np.linalg.lstsq(root * lines, root * values.reshape(-1, 2), rcond=None)[0]
    spline = TensorSpline(rest[1], rest[0], _solve(weights, (values, axes, *rest), strength))
    np.testing.assert_allclose(spline.evaluate_grid(axes), fitted.reshape(values.shape), rtol=0, atol=1e-6)


@pytest.mark.parametrize("strength", [0.0, 1e-6, 1.0, 1e6, 1e12, None])
def test_multilinear_data_are_reproduced_at_any_strength(strength, rng):
    _, axes, knots, degrees = _problem(rng, (9, 8, 10), (5, 4, 6), (3, 2, 3))
    u, v, w = np.meshgrid(*axes, indexing="ij")
    values = (1 + 2 * u - v + 3 * u * w - 2 * u * v * w)[..., None]
    weights = _weights(rng, (9, 8, 10)) + 1e-3
    result, smoothing = smooth(values, weights, axes, knots, degrees, strength=strength)
    np.testing.assert_allclose(result.spline.evaluate_grid(axes), values, rtol=0, atol=1e-12)
    assert smoothing.noise < 1e-13


@each_problem
@pytest.mark.parametrize("strength", [0.0, 1e-3, 1.0, 1e3])
def test_degrees_of_freedom_are_the_trace_of_the_hat_matrix(m, n, degrees, strength, rng):
    case = _problem(rng, m, n, degrees)
    weights = _separable(rng, m)
    values, *rest = case
    _, smoothing = smooth(values, weights, *rest, strength=strength)
    scores, traces = _brute_scores(weights, case, [strength])
    assert smoothing.degrees_of_freedom == pytest.approx(traces[0], rel=1e-9)
    assert smoothing.strengths.tolist() == [strength]
    np.testing.assert_allclose(smoothing.gcv, scores, rtol=1e-9)


@each_problem
def test_the_strength_has_the_least_score_by_brute_force(m, n, degrees, rng):
    values, axes, knots, _ = _problem(rng, m, n, degrees)
    # Of noise alone the best is no smoothing or all: there is a wave to be found.
    values = 0.1 * values + sum(np.cos(4 * u) for u in np.meshgrid(*axes, indexing="ij"))[..., None]
    case = values, axes, knots, degrees
    weights = _separable(rng, m)
    smoothing = choose_strength(values, weights, *case[1:])
    scores, traces = _brute_scores(weights, case, smoothing.strengths)
    np.testing.assert_allclose(smoothing.gcv, scores, rtol=1e-6)
    assert smoothing.notes == ()
    fine = np.geomspace(*smoothing.strengths[[0, -1]], 400)
    (best,), (trace,) = _brute_scores(weights, case, [smoothing.strength])
    assert best <= _brute_scores(weights, case, fine)[0].min() * (1 + 1e-6)
    assert smoothing.degrees_of_freedom == pytest.approx(trace, rel=1e-9)
    # The ends leave nearly all and next to nothing of what the penalty sees.
    assert traces[0] > 0.98 * np.prod(n)
    assert traces[-1] < 2 ** len(n) + 0.01 * np.prod(n)


@pytest.mark.parametrize("sigma", [0.01, 0.1])
def test_smoothed_noise_is_nearer_to_the_truth_than_the_fit_and_the_data(sigma, rng):
    truth, (values, *rest) = _noisy(rng, sigma)
    result, smoothing = smooth(values, np.ones(values.shape[:-1]), *rest)

    def error(spline: TensorSpline) -> float:
        return float(np.sqrt(np.mean((spline.evaluate_grid(rest[0]) - truth) ** 2)))

    assert error(result.spline) < 0.8 * error(loft(values, *rest).spline)
    assert error(result.spline) < 0.3 * sigma
    assert smoothing.noise == pytest.approx(sigma, rel=0.1)
    assert smoothing.notes == ()


def test_noise_that_neighbours_share_is_smoothed_when_it_is_told(rng):
    """Eight neighbours with one reading: cross-validation takes what they share for a feature, unless told."""
    truth, (_, *rest) = _noisy(rng, 0.0)
    coarse = rng.normal(size=[-(-m // 2) for m in truth.shape[:-1]] + [truth.shape[-1]])
    shared = coarse
    for a, m in enumerate(truth.shape[:-1]):
        shared = np.take(np.repeat(shared, 2, axis=a), np.arange(m), axis=a)
    values, weights = truth + 0.1 * shared, np.ones(truth.shape[:-1])

    def error(independent: float | None) -> float:
        spline = smooth(values, weights, *rest, independent=independent)[0].spline
        return float(np.sqrt(np.mean((spline.evaluate_grid(rest[0]) - truth) ** 2)))

    assert error(coarse[..., 0].size) < 0.8 * error(None)
    assert (
        choose_strength(values, weights, *rest, independent=1e9).strength
        == choose_strength(values, weights, *rest).strength
    )


@pytest.mark.parametrize("independent", [0.0, -1, np.nan, np.inf, "8", [8]])
def test_numbers_of_independent_data_that_are_none_are_refused(independent):
    u = np.linspace(0, 1, 6)
    rest = np.ones((6, 1)), np.ones(6), [u], [clamped([], 3)], [3]
    for door in (choose_strength, smooth):
        assert "independent" in refusal(lambda door=door: door(*rest, independent=independent))


@pytest.mark.parametrize("sigma", [0.01, 0.1])
def test_the_noise_is_that_of_the_weighted_residual(sigma, rng):
    """Weights that are inverse variances, in any unit."""
    truth, (_, *rest) = _noisy(rng, 0.0)
    weights = 50 * _separable(rng, truth.shape[:-1])
    values = truth + sigma * rng.normal(size=truth.shape) / np.sqrt(weights)[..., None]
    assert choose_strength(values, weights, *rest).noise == pytest.approx(sigma, rel=0.1)


def test_noise_is_told_where_weights_are_zero_too(rng):
    _, (values, *rest) = _noisy(rng, 0.1)
    u, v, w = np.meshgrid(*rest[0], indexing="ij")
    gap = ((u - 0.6) ** 2 + (v - 0.5) ** 2 + (w - 0.4) ** 2 < 0.05) | (u + v > 1.7)
    smoothing = choose_strength(values, np.where(gap, 0.0, 1.0), *rest)
    assert smoothing.noise == pytest.approx(0.1, rel=0.1)
    whole = choose_strength(values, np.ones(gap.shape), *rest)
    assert 1 / 3 < smoothing.strength / whole.strength < 3


@pytest.mark.parametrize("garbage", [1e6, 1e300, -1e300])
def test_data_of_weight_zero_have_no_influence(garbage, rng):
    case = _problem(rng, (12, 11, 10), (6, 5, 6), (3, 2, 3))
    values, *rest = case
    weights = _weights(rng, (12, 11, 10))
    soiled = np.where(weights[..., None] == 0, garbage, values)
    (clean, a), (other, b) = (smooth(v, weights, *rest) for v in (values, soiled))
    np.testing.assert_array_equal(other.spline.control, clean.spline.control)
    assert (a.strength, a.noise) == (b.strength, b.noise)


def test_features_without_noise_are_not_smoothed(rng):
    _, axes, knots, degrees = _problem(rng, (15, 14), (8, 7), (3, 3))
    values = TensorSpline(degrees, knots, rng.normal(size=(8, 7, 1))).evaluate_grid(axes)
    smoothing = choose_strength(values, np.ones((15, 14)), axes, knots, degrees)
    assert "without any smoothing" in smoothing.notes[0]
    assert smoothing.strength == smoothing.strengths[0]


def test_noise_about_a_plane_is_smoothed_to_a_multilinear_function():
    """Not under every seed: noise may look like a bend."""
    rng = np.random.default_rng(3)
    axes = [np.linspace(0, 1, 15), np.linspace(0, 1, 14)]
    knots = [place_knots("averaged", u, 8, 3) for u in axes]
    values = np.add.outer(axes[0], axes[1])[..., None] + rng.normal(size=(15, 14, 3))
    smoothing = choose_strength(values, np.ones((15, 14)), axes, knots, (3, 3))
    assert "multilinear" in smoothing.notes[0]
    assert smoothing.degrees_of_freedom == pytest.approx(4, abs=0.1)


def test_nets_too_small_to_bend_are_fitted_as_they_are(rng):
    axes = [np.linspace(0, 1, 6), np.linspace(0, 1, 5)]
    knots = [clamped([], 1), clamped([0.5], 0)]
    values = rng.normal(size=(6, 5, 2))
    result, smoothing = smooth(values, np.ones((6, 5)), axes, knots, (1, 0))
    np.testing.assert_allclose(
        result.spline.control, loft(values, axes, knots, (1, 0)).spline.control, rtol=0, atol=1e-12
    )
    assert "nothing to smooth" in smoothing.notes[0]
    assert smoothing.degrees_of_freedom == 4


def test_interpolation_tells_no_noise(rng):
    """As many control points as data leave no degree of freedom for it."""
    u = np.linspace(0, 1, 12)
    knots, values = place_knots("averaged", u, 12, 3), rng.normal(size=(12, 1))
    result, smoothing = smooth(values, np.ones(12), [u], [knots], [3], strength=0.0)
    np.testing.assert_allclose(result.spline.evaluate(u[:, None]), values, rtol=0, atol=1e-10)
    assert np.isnan(smoothing.noise)
    assert choose_strength(values, np.ones(12), [u], [knots], [3]).strength > 0


def test_knots_that_ruin_the_solution_are_smoothed(rng):
    """The condition of the collocation matrix passes 1e8: the penalties of the axis and of smoothing add up."""
    u = np.linspace(0, 1, 91)
    truth = np.sin(6 * u)[:, None]
    values = truth + 0.1 * rng.normal(size=truth.shape)
    result, smoothing = smooth(values, np.ones(91), [u], [place_knots("piegl-tiller", u, 88, 3)], [3])
    assert result.conditions[0] > 1e8
    assert smoothing.noise == pytest.approx(0.1, rel=0.2)
    assert np.sqrt(np.mean((result.spline.evaluate_grid([u]) - truth) ** 2)) < 0.05


def _project(net: Net) -> Net:
    """Return the nearest net whose first two layers are equal and do not vary along the last axis."""
    out = net.copy()
    out[:2] = net[:2].mean(axis=(0, -2), keepdims=True)
    return out


def _constrained(weights: np.ndarray, case: Case, strength: float, project: Callable[[Net], Net]) -> np.ndarray:
    """Solve the dense problem among the nets that ``project`` keeps."""
    values = case[0]
    size = tuple(len(t) - p - 1 for t, p in zip(case[2], case[3], strict=True))
    a, penalty = _dense(weights, case)
    kept = np.stack([project(e.reshape(*size, 1)).ravel() for e in np.eye(a.shape[1])])
    q, singular, _ = np.linalg.svd(kept)
    e, w = q[:, singular > 0.5], weights.reshape(-1, 1)
    normal = e.T @ (a.T @ (w * a) + strength * penalty) @ e
    return (e @ np.linalg.solve(normal, e.T @ a.T @ (w * values.reshape(len(w), -1)))).reshape(*size, -1)


@pytest.mark.parametrize("strength", [1e-2, 1e2])
def test_projected_faces_stay_equal(strength, rng):
    case = _problem(rng, (9, 8, 10), (5, 4, 6), (3, 2, 3))
    weights = _weights(rng, (9, 8, 10))
    control = _solve(weights, case, strength, project=_project)
    assert np.ptp(control[:2], axis=(0, -2)).max() == 0
    np.testing.assert_allclose(control, _constrained(weights, case, strength, _project), rtol=0, atol=1e-6)
    values, *rest = case
    chosen, _ = smooth(values, weights, *rest, project=_project)
    assert np.ptp(chosen.spline.control[:2], axis=(0, -2)).max() == 0


def _everything(found: tuple[object, Smoothing], of_values: int = 0, of_weights: int = 0) -> list[np.ndarray]:
    """Return net, noise, scores, strength and degrees of freedom, where data were scaled by 2^.. and weights by 4^.."""
    result, s = found
    net = np.ldexp(result.spline.control, -of_values)
    return [net, *(np.ldexp(x, -of_values - of_weights) for x in (s.noise, s.gcv)), s.strength, s.degrees_of_freedom]


@pytest.mark.parametrize(("of_values", "of_weights"), [(-996, 0), (996, 0), (0, -498), (0, 510), (996, -498)])
def test_smoothing_scales_with_data_and_weights(of_values, of_weights, rng):
    """Squares of such values leave the range of float64."""
    values, *rest = _problem(rng, (9, 8), (6, 5), (3, 3))
    values = 0.1 * values + np.cos(5 * rest[0][0])[:, None, None]
    weights = rng.uniform(0.1, 1.0, (9, 8))
    plain = smooth(values, weights, *rest, tolerance=1e-10)
    scaled = smooth(np.ldexp(values, of_values), np.ldexp(weights, 2 * of_weights), *rest, tolerance=1e-10)
    for a, b in zip(_everything(scaled, of_values, of_weights), _everything(plain), strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-8, atol=1e-9)


@pytest.mark.parametrize("strength", [None, 3.0])
def test_data_of_zeros_are_smoothed_to_zeros(strength):
    u = np.linspace(0, 1, 9)
    result, smoothing = smooth(np.zeros((9, 1)), np.ones(9), [u], [clamped([0.3, 0.5], 3)], [3], strength=strength)
    assert not result.spline.control.any()
    assert smoothing.noise == 0


def test_the_same_data_give_the_same_bits(rng):
    _, (values, *rest) = _noisy(rng, 0.1)
    weights = _weights(rng, values.shape[:-1])
    first, second = (_everything(smooth(values, weights, *rest)) for _ in range(2))
    for a, b in zip(first, second, strict=True):
        np.testing.assert_array_equal(a, b)


def test_progress_is_that_of_the_fit(rng):
    values, *rest = _problem(rng, (9, 8, 10), (5, 4, 6), (3, 2, 3))
    reported: list[float] = []
    smooth(values, _weights(rng, (9, 8, 10)), *rest, strength=0.1, tolerance=1e-8, progress=reported.append)
    assert reported[-1] == 1.0


@each_problem
def test_a_fit_takes_any_penalty(m, n, degrees, rng):
    """Not only differences: also more rows than columns, and an axis without."""
    values, axes, knots, _ = _problem(rng, m, n, degrees)
    weights = _weights(rng, m)
    rows = [rng.normal(size=(size + 2 if a == 0 else 0, size)) for a, size in enumerate(n)]
    normals, level = _marginals(weights, (values, axes, knots, degrees))
    a = _kronecker([naive.matrix(t, p, u) for u, t, p in zip(axes, knots, degrees, strict=True)])
    w = weights.reshape(-1, 1)
    penalised = a.T @ (w * a) + level * _kronecker([rows[0].T @ rows[0], *normals[1:]])
    expected = np.linalg.solve(penalised, a.T @ (w * values.reshape(-1, 2))).reshape(*n, 2)
    options = {"start": np.zeros((*n, 2)), "tolerance": 1e-11, "max_iterations": 5000}
    result = fit_weighted(values, weights, axes, knots, degrees, penalty=rows, **options)
    np.testing.assert_allclose(result.spline.control, expected, rtol=0, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize(
    "penalty",
    [
        [],
        [np.eye(5)],
        [np.eye(5)] * 3,
        [np.eye(5), np.eye(5)],
        [np.ones(5), np.eye(6)],
        [np.eye(5), np.nan * np.eye(6)],
    ],
)
def test_penalties_that_suit_no_net_are_refused(penalty, rng):
    values, axes, knots, degrees = _problem(rng, (9, 8), (5, 6), (3, 3))
    start = np.zeros((5, 6, 2))
    message = refusal(lambda: fit_weighted(values, np.ones((9, 8)), axes, knots, degrees, start=start, penalty=penalty))
    assert "Penalties" in message


@pytest.mark.parametrize("penalty", [3, "abc", [None, None], ["a", "b"], [[[1j]], [[2]]]])
def test_penalties_that_are_no_matrices_are_refused(penalty, rng):
    values, axes, knots, degrees = _problem(rng, (9, 8), (5, 6), (3, 3))
    refusal(
        lambda: fit_weighted(values, np.ones((9, 8)), axes, knots, degrees, start=np.zeros((5, 6, 2)), penalty=penalty)
    )


@pytest.mark.parametrize("strength", [-1.0, -1e-300, np.nan, np.inf, 2 * LARGEST_STRENGTH, True, "1", [1.0], 1j])
def test_strengths_that_cannot_smooth_are_refused(strength):
    u = np.linspace(0, 1, 6)
    message = refusal(lambda: smooth(np.ones((6, 1)), np.ones(6), [u], [clamped([], 3)], [3], strength=strength))
    assert "Strength" in message


@pytest.mark.parametrize("door", [choose_strength, smooth])
@pytest.mark.parametrize(
    ("name", "wrong", "word"),
    [
        ("values", np.ones((7, 1)), "grid"),
        ("values", np.full((6, 1), np.inf), "finite"),
        ("values", "abc", "Data"),
        ("weights", np.ones(5), "Weights"),
        ("weights", -np.ones(6), "Weights"),
        ("weights", np.zeros(6), "Weights"),
        ("weights", np.full(6, np.nan), "Weights"),
        ("weights", None, "Weights"),
        ("parameters", [np.linspace(1, 0, 6)], "increase"),
        ("parameters", [np.linspace(0, 2, 6)], "outside"),
        ("knots", [[0, 0, 0, 1]], "Knots"),
        ("degrees", [3, 3], "grid"),
        ("degrees", [17], "Degree"),
    ],
)
def test_data_that_suit_no_fit_are_refused(door, name, wrong, word):
    sound = {
        "values": np.ones((6, 1)),
        "weights": np.ones(6),
        "parameters": [np.linspace(0, 1, 6)],
        "knots": [clamped([], 3)],
        "degrees": [3],
    }
    assert word in refusal(lambda: door(**(sound | {name: wrong})))


@pytest.mark.parametrize("changes", [{"start": np.zeros((5, 1))}, {"tolerance": 0.0}, {"start": "abc"}])
def test_what_the_fit_refuses_is_refused(changes):
    u = np.linspace(0, 1, 6)
    with pytest.raises(BvbError):
        smooth(np.ones((6, 1)), np.ones(6), [u], [clamped([], 3)], [3], **changes)
