"""The basis at scattered points: the spline itself, its adjoint, and the steps of conjugate gradients."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bvbedit.spline.scattered import ScatteredBasis, conjugate_gradients
from bvbedit.spline.tensor import TensorSpline
from tests.spline import naive

EPS = float(np.finfo(np.float64).eps)

degrees = st.tuples(*[st.integers(0, 5)] * 3)
seeds = st.integers(0, 2**32 - 1)
few = settings(max_examples=40)


def _case(p: tuple[int, int, int], seed: int, count: int = 60) -> tuple[list[np.ndarray], np.ndarray]:
    """Return knots with some double ones, and points: scattered, on knots, and at both ends."""
    rng = np.random.default_rng(seed)
    knots = [naive.random_knots(rng, q, q + 1 + int(rng.integers(0, 6))) for q in p]
    points = np.stack([np.concatenate([rng.uniform(size=count), rng.choice(t, 8), [0.0, 1.0]]) for t in knots], axis=-1)
    return knots, points


def _net(knots: list[np.ndarray], p: tuple[int, int, int], channels: int, seed: int) -> np.ndarray:
    shape = tuple(len(t) - q - 1 for t, q in zip(knots, p, strict=True))
    return np.random.default_rng(seed).normal(size=(*shape, channels))


@few
@given(p=degrees, channels=st.integers(1, 5), seed=seeds)
def test_applied_to_a_net_it_is_the_spline(p, channels, seed):
    knots, points = _case(p, seed)
    control = _net(knots, p, channels, seed)
    expected = TensorSpline(p, knots, control).evaluate(points)
    found = ScatteredBasis(points, knots, p).apply(control)
    np.testing.assert_allclose(found, expected, rtol=0, atol=50 * EPS * np.abs(control).max())


def test_applied_to_a_net_it_is_the_definition():
    p = (2, 3, 1)
    knots, points = _case(p, 4, count=10)
    control = _net(knots, p, 3, 4)
    expected = naive.evaluate(p, knots, control, points)
    np.testing.assert_allclose(ScatteredBasis(points, knots, p).apply(control), expected, rtol=0, atol=1e-14)


@few
@given(p=degrees, channels=st.integers(1, 5), seed=seeds)
def test_transposed_it_is_the_adjoint(p, channels, seed):
    """<B x, y> = <x, B^T y> for any x and y."""
    knots, points = _case(p, seed)
    basis = ScatteredBasis(points, knots, p)
    x = _net(knots, p, channels, seed)
    y = np.random.default_rng(seed + 1).normal(size=(len(points), channels))
    image = basis.apply(x)
    scale = np.linalg.norm(image) * np.linalg.norm(y)
    assert abs(np.vdot(image, y) - np.vdot(x, basis.apply_transposed(y))) <= 1e-13 * scale


@few
@given(p=degrees, seed=seeds)
def test_the_overlap_is_the_mean_sum_of_squares(p, seed):
    knots, points = _case(p, seed, count=20)
    rows = [naive.matrix(t, q, points[:, a]) for a, (t, q) in enumerate(zip(knots, p, strict=True))]
    brute = np.mean(np.sum(np.einsum("ni,nj,nk->nijk", *rows) ** 2, axis=(1, 2, 3)))
    assert ScatteredBasis(points, knots, p).overlap == pytest.approx(brute, rel=1e-12)


@few
@given(p=degrees, seed=seeds)
def test_it_is_a_partition_of_unity(p, seed):
    knots, points = _case(p, seed)
    basis = ScatteredBasis(points, knots, p)
    np.testing.assert_allclose(basis.apply(np.ones((*basis.size, 3))), 1.0, rtol=0, atol=20 * EPS)
    sums = basis.apply_transposed(np.ones((len(points), 1)))
    assert sums.min() >= -1e-15
    assert sums.sum() == pytest.approx(len(points), rel=1e-13)


@pytest.mark.parametrize("count", [0, 1, 3, 5])
def test_few_points_or_none_are_gathered(count):
    """Sums are gathered in several nets side by side: fewer points than nets must do no harm."""
    p, knots = (3, 3, 3), [np.array([0.0] * 4 + [0.5] + [1.0] * 4)] * 3
    points = np.random.default_rng(0).uniform(size=(count, 3))
    basis = ScatteredBasis(points, knots, p)
    values = np.random.default_rng(1).normal(size=(count, 3))
    expected = np.zeros((5, 5, 5, 3))
    for x, y in zip(points, values, strict=True):
        rows = [np.array(naive.basis(t, 3, u)) for t, u in zip(knots, x, strict=True)]
        expected += np.einsum("i,j,k,c->ijkc", *rows, y)
    np.testing.assert_allclose(basis.apply_transposed(values), expected, rtol=0, atol=1e-14)


def test_sums_are_the_same_from_run_to_run(rng):
    p, knots = (3, 3, 3), [np.array([0.0] * 4 + [1.0] * 4)] * 3
    basis = ScatteredBasis(rng.uniform(size=(20_000, 3)), knots, p)
    values = rng.normal(size=(20_000, 3))
    np.testing.assert_array_equal(basis.apply_transposed(values), basis.apply_transposed(values))


def test_nets_of_other_memory_order_are_taken(rng):
    p, knots = (1, 1, 1), [np.array([0.0, 0.0, 1.0, 1.0])] * 3
    basis = ScatteredBasis(rng.uniform(size=(50, 3)), knots, p)
    control, values = rng.normal(size=(2, 2, 2, 3)), rng.normal(size=(50, 3))
    np.testing.assert_array_equal(basis.apply(np.asfortranarray(control)), basis.apply(control))
    np.testing.assert_array_equal(basis.apply_transposed(np.asfortranarray(values)), basis.apply_transposed(values))


def _positive(n: int, seed: int, condition: float) -> np.ndarray:
    rng = np.random.default_rng(seed)
    q = np.linalg.qr(rng.normal(size=(n, n)))[0]
    return q @ np.diag(np.geomspace(1.0, condition, n)) @ q.T


@given(n=st.integers(1, 12), seed=seeds)
def test_n_steps_solve_a_system_of_n_unknowns(n, seed):
    a = _positive(n, seed, 50.0)
    right = np.random.default_rng(seed).normal(size=(n, 1))
    found = conjugate_gradients(lambda x: a @ x, right, lambda r: r, n)
    np.testing.assert_allclose(found, np.linalg.solve(a, right), rtol=0, atol=1e-8 * np.linalg.norm(right))


def test_the_inverse_as_preconditioner_solves_in_one_step(rng):
    a = _positive(9, 1, 1e8)
    right, inverse = rng.normal(size=(9, 3)), np.linalg.inv(a)
    found = conjugate_gradients(lambda x: a @ x, right, lambda r: inverse @ r, 1)
    np.testing.assert_allclose(a @ found, right, rtol=0, atol=1e-6)


def test_a_system_with_as_many_eigenvalues_as_steps_is_solved(rng):
    """30 unknowns, 4 different eigenvalues: 4 steps."""
    q = np.linalg.qr(rng.normal(size=(30, 30)))[0]
    a = q @ np.diag(np.repeat([1.0, 3.0, 4.0, 10.0], [20, 5, 3, 2])) @ q.T
    right = rng.normal(size=(30,))
    near = conjugate_gradients(lambda x: a @ x, right, lambda r: r, 4)
    np.testing.assert_allclose(near, np.linalg.solve(a, right), rtol=0, atol=1e-12)


def test_each_step_comes_nearer_in_the_norm_of_the_operator(rng):
    a = _positive(20, 3, 1e3)
    right = rng.normal(size=(20,))
    truth = np.linalg.solve(a, right)
    off = [conjugate_gradients(lambda x: a @ x, right, lambda r: r, n) - truth for n in range(12)]
    errors = [e @ a @ e for e in off]
    assert (np.diff(errors) < 0).all()


@pytest.mark.parametrize("scale", [0.0, 1e-300])
def test_nothing_to_do_is_done_without_a_division_by_zero(scale):
    right = np.full((3, 1), scale)
    with np.errstate(all="raise", under="ignore"):
        np.testing.assert_array_equal(conjugate_gradients(lambda x: x, right, lambda r: r, 5), np.zeros((3, 1)))


def test_an_operator_that_is_not_positive_ends_the_steps():
    right = np.ones((3, 1))
    assert (conjugate_gradients(lambda x: -x, right, lambda r: r, 5) == 0).all()
    assert (conjugate_gradients(lambda x: x * np.nan, right, lambda r: r, 5) == 0).all()


def test_unknowns_that_nothing_holds_stay_zero():
    """The operator is singular; its kernel is never entered."""
    keep = np.array([1.0, 0.0, 1.0])
    found = conjugate_gradients(lambda x: 2 * keep * x, keep * 3.0, lambda r: keep * r, 10)
    np.testing.assert_allclose(found, [1.5, 0.0, 1.5])
