"""TensorSpline: every way of evaluating it agrees with the definition and with each other, and nothing changes it."""

import itertools

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bvbedit import BvbError
from bvbedit.spline.basis import collocation
from bvbedit.spline.knots import clamped, greville
from bvbedit.spline.tensor import TensorSpline
from tests.spline import naive
from tests.spline.drawn import EPS, largest, splines, with_axis

# Degrees, sizes and channels: all dimensions, mixed degrees, as few control points as the degree allows, and the
# tricubic RGB volume, which has a kernel of its own.
SHAPES = [
    ((0,), (5,), 1),
    ((1,), (2,), 2),
    ((16,), (19,), 3),
    ((3, 2), (4, 6), 5),
    ((0, 7), (3, 9), 1),
    ((3, 3, 3), (4, 4, 4), 3),
    ((3, 3, 3), (9, 5, 12), 3),
    ((3, 3, 3), (9, 5, 6), 4),
    ((2, 3, 1), (4, 6, 5), 3),
    ((3, 2, 1, 0), (5, 4, 3, 2), 3),
    ((1, 3, 3, 3), (3, 4, 6, 5), 2),
]


def _spline(rng: np.random.Generator, degrees: tuple[int, ...], size: tuple[int, ...], channels: int) -> TensorSpline:
    knots = [naive.random_knots(rng, p, n) for p, n in zip(degrees, size, strict=True)]
    return TensorSpline(degrees, knots, rng.normal(size=(*size, channels)))


def _points(rng: np.random.Generator, spline: TensorSpline, count: int = 60) -> np.ndarray:
    """Random points, knots, and all corners of the domain."""
    ends = np.array(list(itertools.product(*spline.domain)))
    inside = rng.uniform(ends[0], ends[-1], (count, spline.parameters))
    knots = np.stack([rng.choice(t, count) for t in spline.knots], axis=1)
    mixed = np.where(rng.uniform(size=knots.shape) < 0.5, knots, inside)
    return np.concatenate([ends, inside, knots, mixed])


@pytest.mark.parametrize(("degrees", "size", "channels"), SHAPES)
def test_points_and_grid_agree_with_the_definition(degrees, size, channels, rng):
    spline = _spline(rng, degrees, size, channels)
    points = _points(rng, spline)
    expected = naive.evaluate(degrees, spline.knots, spline.control, points)
    np.testing.assert_allclose(spline.evaluate(points), expected, rtol=0, atol=5e-14)
    axes = [np.unique(np.append(rng.choice(t, 3), (t[0], t[-1], *rng.uniform(0, 1, 2)))) for t in spline.knots]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    on_grid = naive.evaluate(degrees, spline.knots, spline.control, grid.reshape(-1, len(degrees)))
    np.testing.assert_allclose(spline.evaluate_grid(axes).reshape(on_grid.shape), on_grid, rtol=0, atol=5e-14)
    np.testing.assert_allclose(spline.evaluate(grid), spline.evaluate_grid(axes), rtol=0, atol=5e-14)


@given(st.tuples(*(naive.knot_vectors(3),) * 3), st.integers(0, 1000))
def test_the_fast_kernel_agrees_with_the_general_one_on_any_knots(knots, seed):
    """A fourth channel sends the same net through the general kernel."""
    rng = np.random.default_rng(seed)
    net = rng.normal(size=(*(len(t) - 4 for t in knots), 4))
    rgb, general = TensorSpline((3, 3, 3), knots, net[..., :3]), TensorSpline((3, 3, 3), knots, net)
    points = np.stack([rng.choice(naive.telling_points(t), 200) for t in knots], axis=1)
    fast, slow = rgb.evaluate(points), general.evaluate(points)[:, :3]
    np.testing.assert_allclose(fast, slow, rtol=0, atol=2e-14 * np.abs(net).max())
    some = points[:5]
    np.testing.assert_allclose(slow[:5], naive.evaluate((3, 3, 3), knots, net, some)[:, :3], rtol=0, atol=1e-13)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("channels", [3, 4])
def test_at_a_jump_the_value_from_the_right_is_taken(axis, channels, rng):
    knots = [clamped([], 3), clamped([], 3), clamped([], 3)]
    knots[axis] = clamped([0.25, 0.25, 0.25, 0.25], 3)
    net = np.zeros((*(len(t) - 4 for t in knots), channels))
    right = np.moveaxis(net, axis, 0)[4:]
    right[:] = 1.0
    spline = TensorSpline((3, 3, 3), knots, net)
    points = rng.uniform(size=(50, 3))
    for at, value in ((0.25, 1.0), (np.nextafter(0.25, 0), 0.0), (np.nextafter(0.25, 1), 1.0)):
        points[:, axis] = at
        np.testing.assert_allclose(spline.evaluate(points), value, rtol=0, atol=1e-14)
        axes = [points[:5, a] for a in range(3)]
        np.testing.assert_allclose(spline.evaluate_grid(axes), value, rtol=0, atol=1e-14)


@pytest.mark.parametrize(("start", "end"), [(0.0, 0.9), (0.0, 5.0), (-1.0, 2.0), (5.0, 5.7), (-0.3, 0.4)])
def test_next_to_a_jump_on_the_edge_of_a_bin_the_right_side_is_found(start, end):
    """The fast kernel looks spans up in 32 bins here; at their edges rounding puts points one bin off."""
    edges = np.linspace(start, end, 33)[1:-1]
    below = np.nextafter(edges, start)
    scale = 32 / (end - start)
    assert ((edges - start) * scale < np.arange(1, 32)).any() or ((below - start) * scale >= np.arange(1, 32)).any()
    for edge in edges:
        t = clamped([edge] * 4, 3, start, end)
        spline = TensorSpline((3, 3, 3), (t, t, t), np.repeat([0.0, 1.0], 4)[:, None, None, None] * np.ones((8, 8, 3)))
        x = np.array([np.nextafter(edge, start), edge])
        values = spline.evaluate(np.stack([x, x, x], axis=1))[:, 0]
        np.testing.assert_allclose(values, [0.0, 1.0], rtol=0, atol=1e-14)


@pytest.mark.parametrize(("degrees", "size", "channels"), SHAPES)
def test_derivatives_three_ways(degrees, size, channels, rng):
    """By evaluate, by the derivative spline, and by the basis' derivatives on the original net."""
    spline = _spline(rng, degrees, size, channels)
    axes = [np.append(rng.uniform(0, 1, 4), (t[0], t[len(t) // 2], t[-1])) for t in spline.knots]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    for _ in range(4):
        orders = tuple(int(o) for o in rng.integers(0, 4, len(degrees)))
        hodograph = spline
        expected = spline.control
        for axis, order in enumerate(orders):
            hodograph = hodograph.derivative(axis, order)
            expected = collocation(spline.knots[axis], degrees[axis], axes[axis], order).apply(expected, axis)
        assert hodograph.degrees == tuple(max(p - o, 0) for p, o in zip(degrees, orders, strict=True))
        assert hodograph.domain == spline.domain
        scale = max(1.0, np.abs(expected).max())
        np.testing.assert_allclose(spline.evaluate(grid, orders), expected, rtol=0, atol=1e-11 * scale)
        np.testing.assert_allclose(hodograph.evaluate_grid(axes), expected, rtol=0, atol=1e-11 * scale)


@pytest.mark.parametrize("interior", [[0.4], [0.4] * 3, [0.4] * 4, [0.2, 0.4, 0.4, 0.4, 0.4, 0.9]])
def test_derivatives_integrate_back_to_the_differences_of_each_piece(interior, rng):
    """Gauss-Legendre is exact on each polynomial piece; at a knot of full multiplicity the jump is no derivative."""
    t = clamped(interior, 3)
    spline = TensorSpline((3,), (t,), rng.normal(size=(len(t) - 4, 2)))
    x, w = np.polynomial.legendre.leggauss(3)
    for a, b in itertools.pairwise(np.unique(t)):
        nodes = 0.5 * (a + b) + 0.5 * (b - a) * x
        integral = 0.5 * (b - a) * w @ spline.evaluate(nodes[:, None], derivatives=(1,))
        ends = spline.evaluate([[a], [np.nextafter(b, 0) if b < 1 else b]])
        np.testing.assert_allclose(integral, ends[1] - ends[0], rtol=0, atol=1e-12)


def test_a_polynomial_has_the_derivatives_of_the_polynomial():
    """By linear precision the net xi_i eta_j is u v, whatever the knots."""
    knots = (clamped([0.1, 0.5, 0.5], 3), clamped([0.7], 2))
    xi, eta = greville(knots[0], 3), greville(knots[1], 2)
    spline = TensorSpline((3, 2), knots, (xi[:, None] * eta)[..., None])
    u, v = np.meshgrid([0.0, 0.3, 0.5, 1.0], [0.0, 0.7, 0.8, 1.0])
    points = np.stack([u, v], axis=-1)
    for orders, expected in (((0, 0), u * v), ((1, 0), v), ((0, 1), u), ((1, 1), 1 + 0 * u), ((2, 0), 0 * u)):
        np.testing.assert_allclose(spline.evaluate(points, orders)[..., 0], expected, rtol=0, atol=1e-13)


def test_derivatives_that_do_not_exist_are_refused(rng):
    spline = _spline(rng, (2, 3), (4, 5), 1)
    for axis, order in ((2, 1), (-1, 1), (0, -1), (0, 1.5), (0, np.nan)):
        with pytest.raises(BvbError, match=r"Axis|order"):
            spline.derivative(axis, order)
    with pytest.raises(BvbError, match="3 derivative orders"):
        spline.evaluate([0.5, 0.5], derivatives=(1, 0, 0))


@pytest.mark.parametrize("channels", [3, 1])
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, np.nextafter(1, 2), -5e-324, 1e300])
def test_points_outside_the_domain_are_refused_by_axis_and_value(channels, bad, rng):
    spline = _spline(rng, (3, 3, 3), (4, 5, 6), channels)
    points = rng.uniform(size=(100, 3))
    points[57, 1] = bad
    with pytest.raises(BvbError, match="axis 1 is outside") as error:
        spline.evaluate(points)
    assert str(bad) in str(error.value)
    with pytest.raises(BvbError, match="axis 1 is outside"):
        spline.evaluate_grid([[0.5], [0.2, bad], [0.5]])


@pytest.mark.parametrize("points", [0.5, [0.5, 0.5], [[0.5, 0.5, 0.5, 0.5]], [[]]])
def test_points_of_another_dimension_are_refused(points, rng):
    with pytest.raises(BvbError, match="last axis of 3"):
        _spline(rng, (3, 3, 3), (4, 5, 6), 3).evaluate(points)


def test_grids_of_another_dimension_are_refused(rng):
    spline = _spline(rng, (3, 3), (4, 5), 3)
    with pytest.raises(BvbError, match="3 grid axes"):
        spline.evaluate_grid([[0.5]] * 3)
    with pytest.raises(BvbError, match="Grid axis 1"):
        spline.evaluate_grid([[0.5], [[0.5]]])


@pytest.mark.parametrize(
    ("degrees", "knots", "control", "says"),
    [
        ((), (), [1.0], "0 degrees"),
        ((0,) * 5, ([0, 1],) * 5, np.zeros((1,) * 6), "5 degrees"),
        ((1, 1), ([0, 0, 1, 1],), np.zeros((2, 2, 1)), "2 degrees and 1 knot"),
        ((1,), ([0, 0, 1, 1],), [0.0, 1.0], "shape"),
        ((1,), ([0, 0, 1, 1],), np.zeros((3, 1)), "shape"),
        ((1,), ([0, 0, 1, 1],), np.zeros((2, 0)), "shape"),
        ((1,), ([0, 0, 1, 1],), [[0.0], [np.inf]], r"Control point \(1, 0\) is inf"),
        ((1,), ([0, 0, 1, 1],), [[np.nan], [0.0]], r"Control point \(0, 0\) is nan"),
        ((17,), ([0] * 18 + [1] * 18,), np.zeros((18, 1)), "Degree 17"),
    ],
)
def test_nets_that_do_not_fit_their_knots_are_refused(degrees, knots, control, says):
    with pytest.raises(BvbError, match=says):
        TensorSpline(degrees, knots, control)


def test_nothing_that_was_given_or_returned_changes_a_spline(rng):
    knots = [clamped([0.5], 3) for _ in range(3)]
    net = rng.normal(size=(5, 5, 5, 3))
    spline = TensorSpline((3, 3, 3), knots, net)
    points = rng.uniform(size=(20, 3))
    before = spline.evaluate(points)
    kept = before.copy()
    net[:] = 7.0
    for a in (*spline.knots, spline.control):
        assert not a.flags.writeable
    with pytest.raises(ValueError, match="read-only"):
        spline.control[0, 0, 0, 0] = 1.0
    other = spline.with_control(net)
    before[:] = 0.0
    spline.evaluate_grid([[0.1]] * 3)[:] = 0.0
    np.testing.assert_array_equal(spline.evaluate(points), kept)
    np.testing.assert_allclose(other.evaluate(points), 7.0, rtol=1e-14)


@pytest.mark.parametrize("channels", [1, 3])
def test_empty_sets_of_points_have_empty_values(channels, rng):
    spline = _spline(rng, (3, 3, 3), (4, 5, 6), channels)
    assert spline.evaluate(np.empty((0, 3))).shape == (0, channels)
    assert spline.evaluate(np.empty((2, 0, 3))).shape == (2, 0, channels)
    assert spline.evaluate(np.empty((0, 3)), derivatives=(1, 0, 0)).shape == (0, channels)
    assert spline.evaluate_grid([[0.5], [], [0.1, 0.2]]).shape == (1, 0, 2, channels)
    assert spline.evaluate([0.1, 0.2, 0.3]).shape == (channels,)


@pytest.mark.parametrize("channels", [3, 2])
def test_the_number_of_threads_changes_no_bit(channels, rng):
    spline = _spline(rng, (3, 3, 3), (9, 8, 7), channels)
    points, axes = rng.uniform(size=(5000, 3)), [rng.uniform(size=n) for n in (31, 7, 40)]
    results = []
    before = numba.get_num_threads()
    try:
        for count in (1, numba.config.NUMBA_NUM_THREADS):
            numba.set_num_threads(count)
            results.append((spline.evaluate(points), spline.evaluate_grid(axes)))
    finally:
        numba.set_num_threads(before)
    for one, many in zip(*results, strict=True):
        np.testing.assert_array_equal(one, many)


@pytest.mark.parametrize("channels", [3, 1])
@pytest.mark.parametrize("exponent", [-900, 1000])
def test_values_scale_exactly_by_powers_of_two(channels, exponent, rng):
    spline = _spline(rng, (3, 3, 3), (5, 4, 6), channels)
    points = rng.uniform(0.05, 0.95, (200, 3))
    scaled = spline.with_control(np.ldexp(spline.control, exponent))
    np.testing.assert_allclose(scaled.evaluate(points), np.ldexp(spline.evaluate(points), exponent), rtol=1e-13)


def test_a_hundred_thousand_knots_on_one_axis(rng):
    t = clamped(np.sort(rng.uniform(size=100_000)), 3)
    spline = TensorSpline((3,), (t,), greville(t, 3)[:, None])
    x = rng.uniform(size=(10_000, 1))
    np.testing.assert_allclose(spline.evaluate(x), x, rtol=0, atol=1e-14)
    volume = TensorSpline(
        (3, 3, 3), (clamped([], 3), clamped([], 3), t), np.tile(greville(t, 3)[:, None], (4, 4, 1, 3))
    )
    points = rng.uniform(size=(10_000, 3))
    np.testing.assert_allclose(volume.evaluate(points), np.tile(points[:, 2:], 3), rtol=0, atol=1e-14)


@pytest.mark.parametrize("channels", [3, 4])
@pytest.mark.parametrize(
    ("start", "interior", "end"),
    [(-1e100, [], 1e100), (0.0, [], 1e-100), (0.0, [1e-100], 1.0), (0.0, [0.5, np.nextafter(0.5, 1)], 1.0)],
)
def test_knots_as_far_and_as_close_as_is_allowed_are_evaluated_right(start, interior, end, channels):
    t = clamped(interior, 3, start, end)
    xi = greville(t, 3) / max(abs(start), end)
    spline = TensorSpline((3, 3, 3), (t, t, t), np.tile(xi[:, None, None, None], (len(xi), len(xi), channels)))
    x = np.unique([*t, *(start + (end - start) * np.linspace(0, 1, 9)), np.nextafter(end, start)])
    values = spline.evaluate(np.stack([x, x, x], axis=1))
    np.testing.assert_allclose(values, np.tile(x[:, None] / max(abs(start), end), channels), rtol=0, atol=1e-14)


@settings(max_examples=50)
@given(with_axis(splines(tame=True)))
def test_the_derivative_of_the_antiderivative_is_the_spline(drawn):
    spline, axis = drawn
    p, t = spline.degrees[axis], spline.knots[axis]
    if p == 16:
        spline = spline.reduce(axis)[0]
        p, t = spline.degrees[axis], spline.knots[axis]
    summed = spline.antiderivative(axis)
    assert summed.degrees[axis] == p + 1
    assert not summed.control.take(0, axis).any()
    back = summed.derivative(axis)
    assert back.degrees == spline.degrees
    np.testing.assert_array_equal(back.knots[axis], t)
    least = (t[p + 1 :] - t[: -p - 1]).min()
    noise = 8 * EPS * largest(summed) * (p + 1) / least
    np.testing.assert_allclose(back.control, spline.control, rtol=0, atol=noise + 8 * EPS * largest(spline))


@settings(max_examples=60)
@given(splines(tame=True), st.data())
def test_integrals_are_those_of_gauss_on_each_span_and_of_antiderivatives(spline, data):
    """Over boxes that end at knots and between them, and over empty ones."""
    if max(spline.degrees) == 16:
        spline = spline.reduce(spline.degrees.index(16))[0]
    box = []
    for t in spline.knots:
        share = st.integers(0, 32).map(lambda k, t=t: float(t[0] + (t[-1] - t[0]) * (k / 32)))
        box.append(tuple(sorted((data.draw(share), data.draw(share)))))
    nodes, weights = [], []
    for t, p, (a, b) in zip(spline.knots, spline.degrees, box, strict=True):
        x, w = np.polynomial.legendre.leggauss(p // 2 + 1)
        ends = np.unique([a, *t[(t > a) & (t < b)], b])
        half = np.diff(ends) / 2
        nodes.append((ends[:-1, None] + half[:, None] * (1 + x)).ravel())
        weights.append((half[:, None] * w).ravel())
    expected = spline.evaluate_grid(nodes)
    for w in weights:
        expected = np.tensordot(w, expected, axes=(0, 0))
    volume = np.prod([t[-1] - t[0] for t in spline.knots])
    # A parameter near 1e6 is rounded by 1e-10 of a domain of length 1.
    unit = max(np.abs(t).max() / (t[-1] - t[0]) for t in spline.knots)
    slack = 256 * EPS * (1 + unit) * largest(spline) * volume
    found = spline.integrate(box)
    np.testing.assert_allclose(found, expected, rtol=0, atol=slack)
    summed = spline
    for axis in range(spline.parameters):
        summed = summed.antiderivative(axis)
    corners = summed.evaluate_grid(box)
    for _ in box:
        corners = corners[-1] - corners[0]
    np.testing.assert_allclose(found, corners, rtol=0, atol=slack * 2**spline.parameters)
    np.testing.assert_array_equal(spline.integrate(), spline.integrate(spline.domain))
    if any(a == b for a, b in box):
        np.testing.assert_array_equal(found, 0.0)
    constant = spline.with_control(np.ones_like(spline.control))
    np.testing.assert_allclose(constant.integrate(), volume, rtol=64 * EPS)


def test_the_integral_of_the_whole_is_the_sum_of_its_parts(rng):
    spline = _spline(rng, (3, 2), (8, 6), 3)
    whole, cut = spline.integrate(), spline.knots[0][5]
    for at in (0.123, cut):
        parts = [spline.integrate([(0.0, at), (0.0, 1.0)]), spline.integrate([(at, 1.0), (0.0, 1.0)])]
        np.testing.assert_allclose(sum(parts), whole, rtol=0, atol=1e-14)
        np.testing.assert_allclose(sum(s.integrate() for s in spline.split(0, at)), whole, rtol=0, atol=1e-14)
