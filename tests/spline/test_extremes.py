"""The spline kernel at the extremes, against 50 digits: right to a few ulps, or refused in one line.

Errors are in units in the last place of the largest control point. ``OPERATIONS`` measure one each, on a spline of one
parameter; python -m tests.benchmarks.extremes prints them all.
"""

import warnings
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import mpmath
import numpy as np
import pytest

from bvbedit import BvbError
from bvbedit.spline.compatible import blend, combine, make_compatible
from bvbedit.spline.diagnostics import distance
from bvbedit.spline.operations import join, product, reparametrise, to_bezier
from bvbedit.spline.sculpting import move_points, scale_region
from bvbedit.spline.tensor import TensorSpline
from tests.spline import exact, naive
from tests.spline.refusals import refusal

pytestmark = pytest.mark.filterwarnings("error")

ULPS = 16


def clamped(p: int, interior: Any, start: float = 0.0, end: float = 1.0) -> np.ndarray:
    return np.array([start] * (p + 1) + sorted(map(float, interior)) + [end] * (p + 1))


def cluster(x: float, count: int) -> list[float]:
    """``count`` numbers, each the next one after the one before."""
    out = [float(x)]
    while len(out) < count:
        out.append(float(np.nextafter(out[-1], np.inf)))
    return out


def full_and_close(rng: np.random.Generator, p: int) -> np.ndarray:
    return clamped(p, np.repeat(cluster(rng.uniform(0.3, 0.6), 3), [p + 1, max(p, 1), p + 1]))


KNOTS: dict[str, Callable[[np.random.Generator, int], np.ndarray]] = {
    "ordinary knots": lambda rng, p: naive.random_knots(rng, p, p + 9),
    "n = p + 1": lambda _, p: clamped(p, []),
    "knots p + 1 times": lambda rng, p: clamped(p, np.repeat(rng.uniform(0.1, 0.9, 3), [p + 1, max(p, 1), p + 1])),
    "knots one ulp apart": lambda rng, p: clamped(
        p, [*cluster(rng.uniform(0.1, 0.4), 2), rng.uniform(0.4, 0.6), *cluster(rng.uniform(0.6, 0.9), 5)]
    ),
    "one ulp apart, p + 1 times": full_and_close,
    "one ulp from the ends": lambda _, p: clamped(p, [1e-17, 2e-17, 1 - 2.0**-52, 1 - 2.0**-53]),
    "domain [1e6, 1e6 + 1]": lambda rng, p: clamped(p, 1e6 + rng.uniform(0, 1, 6), 1e6, 1e6 + 1),
    "domain [-1e-9, 1e-9]": lambda rng, p: clamped(p, rng.uniform(-1e-9, 1e-9, 6), -1e-9, 1e-9),
}
NETS: dict[str, Callable[[np.random.Generator, int], np.ndarray]] = {
    "values in [-1, 1]": lambda rng, n: rng.uniform(-1, 1, n),
    "1e4 beside 1e-5": lambda rng, n: rng.choice([1e4, 1e-5], n) * rng.uniform(0.5, 1, n),
    "values of 1e300": lambda rng, n: 1e300 * rng.uniform(-1, 1, n),
    "values of 1e-300": lambda rng, n: 1e-300 * rng.uniform(-1, 1, n),
    "zeros": lambda _, n: np.zeros(n),
    "zeros but one": lambda _, n: np.eye(n)[n // 2],
}


def curve(p: int, t: Any, control: Any) -> TensorSpline:
    return TensorSpline((p,), (t,), np.asarray(control, dtype=float)[:, None])


def as_exact(s: TensorSpline) -> exact.Function:
    return exact.spline(s.knots[0], s.degrees[0], s.control[:, 0])


@dataclass
class Case:
    """A spline with its oracle."""

    s: TensorSpline
    rng: np.random.Generator

    def __post_init__(self) -> None:
        self.f = as_exact(self.s)
        self.p, self.t = self.s.degrees[0], self.s.knots[0]
        self.start, self.end = self.s.domain[0]
        self.inside = np.unique(self.t)[1:-1]
        self.scale = float(np.abs(self.s.control).max()) or 1.0

    def at(self, share: float) -> float:
        return float(self.start + share * (self.end - self.start))

    def new_knots(self) -> np.ndarray:
        """Knots to insert: anywhere, one ulp beside old ones, and these to their full multiplicity."""
        wanted = [self.at(x) for x in self.rng.uniform(0.02, 0.98, 4)]
        for x in self.inside[:3]:
            wanted += [float(np.nextafter(x, np.inf)), float(x), float(x)]
        out: list[float] = []
        for x in sorted(wanted):
            if self.start < x < self.end and np.sum(self.t == x) + out.count(x) <= self.p:
                out.append(x)
        return np.array(out)

    def cuts(self) -> list[float]:
        """Parameters to cut at: anywhere, at knots, and one ulp beside one."""
        x = [self.at(0.37), *self.inside[:1], *np.nextafter(self.inside[:1], np.inf)]
        return sorted({float(v) for v in x if self.start < v < self.end})

    def other(self) -> TensorSpline:
        """Return a spline of lower degree on the same domain, with knots here, one ulp beside them and elsewhere."""
        q = max(0, self.p - 2)
        inner = {self.at(self.rng.uniform(0.05, 0.95)), *np.nextafter(self.inside[:2], -np.inf), *self.inside[:1]}
        t = clamped(q, [x for x in inner if self.start < x < self.end], self.start, self.end)
        return curve(q, t, self.scale * self.rng.uniform(-1, 1, len(t) - q - 1))


def case(degree: int, knots: str = "ordinary knots", net: str = "values in [-1, 1]") -> Case:
    rng = np.random.default_rng([degree, *map(ord, knots + net)])
    t = KNOTS[knots](rng, degree)
    return Case(curve(degree, t, NETS[net](rng, len(t) - degree - 1)), rng)


def error(s: TensorSpline, f: exact.Function, scale: float) -> float:
    """Return how far the control points of ``s`` are from those that f has over its knots."""
    return exact.ulps(s.control[:, 0], exact.control_points(f, s.knots[0], s.degrees[0]), scale)


def difference(a: TensorSpline, b: TensorSpline, knots: np.ndarray, degree: int) -> Any:
    """Return the largest control point of a - b over the given knots: no value differs by more."""
    f = exact.total([as_exact(a), as_exact(b)], [1.0, -1.0])
    return max(map(abs, exact.control_points(f, knots, degree)))


def in_ulps(x: Any, scale: float) -> float:
    return exact.ulps([0.0], [x], scale)


def insert(c: Case) -> float:
    return error(c.s.insert_knots(0, c.new_knots()), c.f, c.scale)


def split(c: Case) -> float:
    return max(error(part, c.f, c.scale) for x in c.cuts() for part in c.s.split(0, x))


def restrict(c: Case) -> float:
    ends = [c.start, *c.cuts(), c.end]
    return max(error(c.s.restrict([(a, b)]), c.f, c.scale) for a, b in pairwise(ends))


def bezier(c: Case) -> float:
    return max(error(piece, c.f, c.scale) for piece in to_bezier(c.s))


def elevate(c: Case) -> float:
    return max(error(c.s.elevate(0, by), c.f, c.scale) for by in {min(1, 16 - c.p), 16 - c.p})


def reduce(c: Case) -> float:
    """Take back an elevation; no value is off by more."""
    high = c.s.elevate(0, min(3, 16 - c.p))
    low, bound = high.reduce(0, high.degrees[0] - c.p)
    np.testing.assert_array_equal(low.knots[0], c.t)
    off = difference(high, low, high.knots[0], high.degrees[0])
    assert off <= bound + ULPS * np.spacing(c.scale)
    return in_ulps(off, c.scale)


def remove(c: Case) -> float:
    """Take back an insertion; no value is off by more."""
    values = c.new_knots()
    fine = s = c.s.insert_knots(0, values)
    for x in values:
        s, _ = s.remove_knot(0, x)
    np.testing.assert_array_equal(s.knots[0], c.t)
    return in_ulps(difference(fine, s, fine.knots[0], c.p), c.scale)


def simplify(c: Case) -> float:
    """Remove what a third of the largest control point allows: by how much the bound that is reported fails."""
    tolerance = c.scale / 3
    s, bound = c.s.remove_knots(0, tolerance)
    assert bound <= tolerance
    return max(0.0, float(in_ulps(difference(c.s, s, c.t, c.p), c.scale) - bound / np.spacing(c.scale)))


def join_parts(c: Case) -> float:
    """Join what was split; no value is off by more."""
    worst = 0.0
    for x in c.cuts():
        whole, bound = join(*c.s.split(0, x), 0)
        cut = np.sort(np.concatenate([c.t, np.repeat(x, c.p + 1 - np.sum(c.t == x))]))
        off = difference(c.s, whole, cut, c.p)
        assert off <= bound + ULPS * np.spacing(c.scale)
        worst = max(worst, in_ulps(off, c.scale))
    return worst


def unite(c: Case) -> float:
    o = c.other()
    (a, b), merged = make_compatible(c.s, o, tolerance=0.0)
    assert merged == ()
    np.testing.assert_array_equal(a.knots[0], b.knots[0])
    return max(error(a, c.f, c.scale), error(b, as_exact(o), c.scale))


WEIGHTS = (0.25, -1.0, 1000.0)


def mix(c: Case) -> float:
    (a, b), _ = make_compatible(c.s, c.other(), tolerance=0.0)
    worst = 0.0
    for w in WEIGHTS:
        size = abs(1 - w) + abs(w)
        wanted = exact.total([as_exact(a), as_exact(b)], [1 - w, w])
        worst = max(worst, error(blend(a, b, w), wanted, c.scale * size))
    return worst


def factors(c: Case) -> tuple[TensorSpline, TensorSpline]:
    q = min(c.p, 16 - c.p)
    t = clamped(q, [c.at(0.3), c.at(0.7)], c.start, c.end)
    return c.s, curve(q, t, c.rng.uniform(-1, 1, len(t) - q - 1))


def multiply(c: Case) -> float:
    """Control points of a product."""
    a, b = factors(c)
    return error(product(a, b), exact.product(c.f, as_exact(b)), c.scale)


def multiply_values(c: Case) -> float:
    """Values of a product."""
    a, b = factors(c)
    s = product(a, b)
    x = naive.telling_points(s.knots[0])[:: 1 + c.p // 4]
    breaks, f, g = list(np.unique(s.knots[0])), exact.product(c.f, as_exact(b)), as_exact(s)
    return max(in_ulps(exact.value(f, v, breaks) - exact.value(g, v, breaks), c.scale) for v in x)


def differentiate(c: Case) -> float:
    """All orders up to three, of the largest control point of the derivative."""
    worst, f = 0.0, c.f
    for order in (1, 2, 3):
        f, d = exact.derivative(f), c.s.derivative(0, order)
        worst = max(worst, error(d, f, float(np.abs(d.control).max()) or 1.0))
    return worst


def antidifferentiate(c: Case) -> float:
    f = exact.antiderivative(c.f, c.t)
    return error(c.s.antiderivative(0), f, c.scale * (c.end - c.start))


def integrate(c: Case) -> float:
    boxes = [(c.start, c.end), (c.at(0.2), c.at(0.7)), *((float(x), c.end) for x in c.inside[:2])]
    wanted = [exact.integral(c.f, list(c.t), *box) for box in boxes]
    found = [c.s.integrate([box])[0] for box in boxes]
    return exact.ulps(found, wanted, c.scale * (c.end - c.start))


def move(c: Case) -> float:
    """A value is moved, another one kept."""
    x = np.array([[c.at(0.1)], [c.at(0.9)]])
    target = c.scale * c.rng.uniform(-1, 1)
    apart = np.searchsorted(c.t, x[0], "right") < np.searchsorted(c.t, x[1], "right") or c.p > 0
    s = move_points(c.s, x[:1], [[target]], x[1:] if apart else None)
    breaks, g = list(np.unique(c.t)), as_exact(s)
    off = abs(exact.value(g, x[0, 0], breaks) - target)
    if apart:
        off = max(off, abs(exact.value(g, x[1, 0], breaks) - exact.value(c.f, x[1, 0], breaks)))
    return in_ulps(off, c.scale)


def evaluate(c: Case) -> float:
    x = naive.telling_points(c.t)
    x = np.unique(np.concatenate([c.t, x[:: 1 + c.p // 6]]))
    breaks = list(np.unique(c.t))
    wanted = [exact.value(c.f, float(v), breaks) for v in x]
    found = (c.s.evaluate(x[:, None])[:, 0], c.s.evaluate_grid([x])[:, 0])
    return max(exact.ulps(values, wanted, c.scale) for values in found)


@dataclass
class Operation:
    measure: Callable[[Case], float]
    limit: float = ULPS
    high: float | None = None
    """The limit from the degree ``turn`` on, where control points are so much worse determined than values."""
    turn: int = 8
    degrees: range = range(17)
    refused: tuple[str, ...] = ()
    """Knots that it may refuse."""
    slow: bool = False
    """Whether 50 digits take long at degree 16."""

    def allowed(self, degree: int) -> float:
        return self.limit if degree < self.turn or self.high is None else self.high


CLOSE = ("knots one ulp apart", "one ulp apart, p + 1 times", "one ulp from the ends")
OPERATIONS: dict[str, Operation] = {
    "insert knots": Operation(insert),
    "split": Operation(split),
    "restrict": Operation(restrict),
    "to Bezier": Operation(bezier),
    "elevate to 16": Operation(elevate),
    "elevate, reduce": Operation(reduce),
    "insert, remove": Operation(remove, high=4096, slow=True),
    "remove, bound": Operation(simplify),
    "split, join": Operation(join_parts, high=1024, slow=True),
    "make compatible": Operation(unite),
    "blend": Operation(mix, slow=True),
    "product": Operation(multiply, 128, 2.0**20, 4, range(9), CLOSE),
    "product, values": Operation(multiply_values, 16, 1024, 4, refused=CLOSE, slow=True),
    "derivative": Operation(differentiate),
    "antiderivative": Operation(antidifferentiate, degrees=range(16)),
    "integrate": Operation(integrate),
    "move points": Operation(move),
    "evaluate": Operation(evaluate, 32),
}


def measured(operation: str, degree: int, knots: str = "ordinary knots", net: str = "values in [-1, 1]") -> float | str:
    """Return the error, or the message of the refusal. Warnings of numpy are errors."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            return OPERATIONS[operation].measure(case(degree, knots, net))
        except BvbError as refused:
            return str(refused)


USUAL = ("ordinary knots", "knots one ulp apart")
OPERATION_AND_KNOTS = [(o, k) for o in OPERATIONS for k in KNOTS]


@pytest.mark.parametrize("operation", ["insert knots", "split", "elevate to 16"])
@pytest.mark.parametrize("degree", range(17))
def test_insertion_splitting_and_elevation_are_right_to_16_ulps_at_every_degree(operation, degree):
    assert measured(operation, degree) <= ULPS


@pytest.mark.parametrize(("operation", "knots"), OPERATION_AND_KNOTS)
def test_extreme_knots_are_right_or_refused(operation, knots):
    degrees = (0, 1, 3, 6) if OPERATIONS[operation].slow and knots not in USUAL else (0, 1, 3, 16)
    for degree in degrees:
        if degree not in OPERATIONS[operation].degrees:
            continue
        found = measured(operation, degree, knots)
        if isinstance(found, str):
            assert knots in OPERATIONS[operation].refused, found
            assert "stand so close" in found
        else:
            assert found <= OPERATIONS[operation].allowed(degree), degree


@pytest.mark.parametrize("net", [n for n in NETS if n != "values in [-1, 1]"])
@pytest.mark.parametrize("operation", OPERATIONS)
def test_extreme_control_points_are_right(operation, net):
    for degree, knots in ((3, "knots one ulp apart"), (5, "ordinary knots")):
        found = measured(operation, degree, knots, net)
        if isinstance(found, str):
            # Slopes of 1e300 over one ulp are none.
            overflow = operation == "derivative" and net == "values of 1e300" and "range of float64" in found
            assert overflow or knots in OPERATIONS[operation].refused, found
        else:
            assert found <= OPERATIONS[operation].allowed(degree), degree


def test_the_oracle_returns_the_control_points_it_was_made_of():
    for degree in (0, 3, 16):
        for knots in KNOTS:
            c = case(degree, knots)
            assert error(c.s, c.f, c.scale) < 1e-30


def test_the_oracle_agrees_with_the_definition():
    for degree in (0, 2, 7):
        c = case(degree, "knots one ulp apart")
        for x in naive.telling_points(c.t)[::7]:
            with naive.digits():
                row = naive.basis(c.t, degree, float(x), mpmath.mpf)
                wanted = mpmath.fsum(v * float(p) for v, p in zip(row, c.s.control[:, 0], strict=True))
                assert abs(exact.value(c.f, float(x), list(np.unique(c.t))) - wanted) < 1e-30


def test_small_control_points_beside_large_ones_stay_right_to_their_own_size():
    """Insertion and elevation are convex: what is small all around is not spoilt by what is large elsewhere."""
    rng = np.random.default_rng(3)
    t = naive.random_knots(rng, 3, 40)
    control = np.where(np.arange(40) < 20, 1e4, 1e-5) * rng.uniform(0.5, 1, 40)
    s = curve(3, t, control)
    f = as_exact(s)
    for fine in (s.insert_knots(0, np.sort(rng.uniform(0, 1, 30))), s.elevate(0, 5)):
        wanted = exact.control_points(f, fine.knots[0], fine.degrees[0])
        for x, y in zip(fine.control[:, 0], wanted, strict=True):
            assert exact.ulps([x], [y], float(y)) <= ULPS


def test_a_zero_slice_stays_zero_under_what_is_done_along_other_axes():
    rng = np.random.default_rng(5)
    net = rng.uniform(-1, 1, (7, 5, 8, 2))
    net[:, 2] = 0.0
    degrees = (3, 2, 3)
    s = TensorSpline(degrees, [naive.random_knots(rng, p, n) for p, n in zip(degrees, net.shape, strict=False)], net)
    for axis in (0, 2):
        high = s.elevate(axis, 2)
        fine = s.insert_knots(axis, [0.3, 0.3, 0.6])
        parts = s.split(axis, 0.4)
        results = [high, fine, *parts, high.reduce(axis, 2)[0], fine.remove_knots(axis, 0.2)[0], join(*parts, axis)[0]]
        results += [s.derivative(axis), s.antiderivative(axis), blend(s, fine, 0.3), scale_region(s, [(0, 1)] * 3, 2.0)]
        for result in results:
            assert (result.control[:, 2] == 0).all()
            assert (result.control[:, 1] != 0).any()


def test_each_axis_of_a_volume_is_worked_on_like_a_curve():
    rng = np.random.default_rng(6)
    degrees, size = (2, 16, 3), (5, 20, 6)
    knots = [KNOTS["knots p + 1 times"](rng, 2), KNOTS["n = p + 1"](rng, 16), KNOTS["knots one ulp apart"](rng, 3)]
    size = tuple(len(t) - p - 1 for t, p in zip(knots, degrees, strict=True))
    s = TensorSpline(degrees, knots, rng.uniform(-1, 1, (*size, 2)))
    for axis, p in enumerate(degrees):
        lines = np.moveaxis(s.control, axis, -1).reshape(-1, size[axis])
        work = [lambda v, a: v.insert_knots(a, [0.25, 0.75]), lambda v, a: v.split(a, 0.5)[1]]
        work += [lambda v, a: v.elevate(a)] if p < 16 else [lambda v, a: v.reduce(a, 2)[0]]
        for do in work:
            found = np.moveaxis(do(s, axis).control, axis, -1).reshape(len(lines), -1)
            for i in (0, len(lines) // 2, len(lines) - 1):
                alone = do(curve(p, knots[axis], lines[i]), 0).control[:, 0]
                np.testing.assert_allclose(found[i], alone, rtol=0, atol=ULPS * np.spacing(1.0))


@pytest.mark.parametrize("net", [n for n in NETS if n != "zeros"])
def test_the_unrolled_cubic_volume_is_right_at_knots_one_ulp_apart(net):
    rng = np.random.default_rng(7)
    knots = [KNOTS[k](rng, 3) for k in ("knots one ulp apart", "knots p + 1 times", "one ulp apart, p + 1 times")]
    size = tuple(len(t) - 4 for t in knots)
    control = NETS[net](rng, int(np.prod(size)) * 3).reshape(*size, 3)
    control = control if net != "zeros but one" else np.ones_like(control)
    s = TensorSpline((3, 3, 3), knots, control)
    points = np.stack([rng.choice(naive.telling_points(t), 12) for t in knots], axis=1)
    scale = float(np.abs(control).max())
    for x, found in zip(points, s.evaluate(points), strict=True):
        with naive.digits():
            rows = [naive.basis(t, 3, float(v), mpmath.mpf) for t, v in zip(knots, x, strict=True)]
            weights = {
                (i, j, k): u * v * w
                for i, u in enumerate(rows[0])
                if u
                for j, v in enumerate(rows[1])
                if v
                for k, w in enumerate(rows[2])
                if w
            }
            wanted = [mpmath.fsum(w * float(control[(*at, c)]) for at, w in weights.items()) for c in range(3)]
        assert exact.ulps(found, wanted, scale) <= 2 * ULPS


def test_a_float32_net_loses_its_rounding_and_no_more():
    """Half an ulp of float32, 2^-25 to 2^-24 of the largest control point: insertion and elevation are convex."""
    rng = np.random.default_rng(8)
    for scale in (1.0, 1e4, 1e30):
        t = naive.random_knots(rng, 5, 30)
        control = scale * rng.uniform(-1, 1, 30)
        s, rounded = curve(5, t, control), curve(5, t, control.astype(np.float32))
        loss = float(np.spacing(np.float32(np.abs(control).max()))) / 2
        assert distance(s, rounded).bound <= loss
        values = np.sort(rng.uniform(0, 1, 9))
        for do in (lambda v, x=values: v.insert_knots(0, x), lambda v: v.elevate(0, 11), lambda v: v.split(0, 0.3)[0]):
            change = np.abs(do(s).control - do(rounded).control).max()
            assert loss / 100 < change <= loss + ULPS * np.spacing(scale)


@pytest.mark.parametrize("degree", [0, 1, 3, 9])
def test_blending_weights_of_zero_and_one_return_the_parts_exactly(degree):
    c = case(degree)
    (a, b), _ = make_compatible(c.s, c.other())
    for w, part in ((0.0, a), (1.0, b)):
        np.testing.assert_array_equal(blend(a, b, w).control, part.control)
        np.testing.assert_array_equal(blend(c.s, b, w).knots[0], part.knots[0])
    share = curve(1, [0, 0, 1, 1], [-2.0, 3.0])  # weights outside [0, 1], different from place to place
    b = curve(1, clamped(1, [0.012]), [1.0, -1.0, 0.5])
    wanted = exact.total([c.f, exact.product(as_exact(share), exact.total([as_exact(b), c.f], [1, -1]))], [1, 1])
    assert error(blend(c.s, b, share), wanted, 6 * c.scale) <= (ULPS if degree < 4 else 4096)


def test_knots_equal_up_to_rounding_are_united_and_reported():
    """The result is the spline over the moved knots, and says which were moved."""
    a, b = case(3).s, case(2).s
    moved = np.nextafter(a.knots[0], 2.0)[4:-4]
    other = curve(3, clamped(3, moved), case(3).rng.uniform(-1, 1, len(a.knots[0]) - 4))
    (_, there), merged = make_compatible(a, other)
    assert {(m.kept, m.replaced) for m in merged} == set(zip(a.knots[0][4:-4], moved, strict=True))
    assert {(m.spline, m.axis) for m in merged} == {(1, 0)}
    np.testing.assert_array_equal(there.knots[0], a.knots[0])
    np.testing.assert_array_equal(there.control, other.control)
    (first, second), merged = make_compatible(a, b)
    assert merged == ()
    assert max(error(first, as_exact(a), 1.0), error(second, as_exact(b), 1.0)) <= ULPS


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("times", [1, 2])
def test_a_knot_that_is_an_end_of_the_other_domain_up_to_rounding_is_refused(times, turned):
    """Else it would stand more than p + 1 times, or before the knot that precedes it."""
    below = 1 - 2.0**-53
    a = curve(1, [0, 0, 0.5, below, below], [1, 2, 3])
    b = curve(1, clamped(1, [below] * times), np.arange(2 + times))
    if turned:
        a, b = (curve(1, np.sort(1 - s.knots[0]), s.control[:, 0]) for s in (a, b))
    for do in (lambda: make_compatible(a, b), lambda: blend(a, b, 0.5), lambda: product(a, b)):
        assert "is an end of the first" in refusal(do)


@pytest.mark.parametrize("x", [5e-324, 1e-200, 1e-101])
def test_cuts_too_near_to_a_knot_for_float64_are_refused(x):
    s = curve(2, clamped(2, []), [1.0, 2.0, 3.0])
    for do in (lambda: s.split(0, x), lambda: s.restrict([(0, x)]), lambda: s.integrate([(0, x)])):
        assert refusal(do).startswith("Axis 0: Knots 2 and 3 are ")
    a, b = (curve(1, clamped(1, [v], -1.0, 1.0), [1.0, 2.0, 3.0]) for v in (0.0, x))
    assert refusal(lambda: make_compatible(a, b, tolerance=0.0)).startswith("Axis 0: Knots 2 and 3 are ")


MAX = np.finfo(np.float64).max


def test_what_leaves_the_range_of_float64_is_refused():
    huge = curve(2, clamped(2, [0.3, 0.6]), [1e300, -1e300, 1e300, -1e300, 1e300])
    largest = curve(2, clamped(2, [0.3, 0.6]), [MAX, MAX, -MAX, -MAX, MAX])
    long, short = reparametrise(huge, 0, -1e50, 1e50), reparametrise(huge, 0, 0, 1e-50)
    box = [(0, 1)]
    for call in (
        lambda: product(huge, huge),
        lambda: long.integrate(),
        lambda: long.antiderivative(0),
        lambda: short.derivative(0),
        lambda: largest.derivative(0),
        lambda: scale_region(huge, box, 1e200),
        lambda: blend(huge, huge, 1e10),
        lambda: combine([largest, largest], [1.0, 1.0]),
        lambda: distance(largest, combine([largest], [-1.0])),
        lambda: move_points(largest, [[0.45]], [[MAX]]),
    ):
        message = refusal(call)
        assert "range of float64" in message or "Control point" in message, message


def test_at_the_end_of_float64_nothing_becomes_infinite_in_silence():
    rng = np.random.default_rng(9)
    for degree in (1, 3, 9):
        t = naive.random_knots(rng, degree, degree + 9)
        for signs in (np.ones(degree + 9), rng.choice([-1.0, 1.0], degree + 9)):
            s = curve(degree, t, MAX * signs)
            for do in (
                lambda s=s: s.insert_knots(0, [0.2, 0.7]),
                lambda s=s: s.elevate(0, 5),
                lambda s=s: s.split(0, 0.4)[0],
                lambda s=s: s.reduce(0)[0],
                lambda s=s: s.remove_knots(0, MAX / 2)[0],
                lambda s=s: s.remove_knot(0, s.knots[0][s.degrees[0] + 2])[0],
                lambda s=s: s.antiderivative(0),
                lambda s=s: make_compatible(s, s.elevate(0))[0][0],
                lambda s=s: product(s, curve(0, [0, 1], [0.5])),
            ):
                with suppress(BvbError):
                    assert np.isfinite(do().control).all()


BAD = [np.nan, np.inf, -np.inf]


@pytest.mark.parametrize("bad", BAD)
def test_nan_and_infinity_are_refused_with_axis_index_and_value(bad):
    s = TensorSpline((1, 2), (clamped(1, [0.5]), clamped(2, [])), np.arange(9.0).reshape(3, 3, 1))
    net = s.control.copy()
    net[1, 2, 0] = bad
    for call, told in (
        (lambda: TensorSpline((1, 2), (s.knots[0], [0, 0, 0, bad, 1, 1, 1]), net), ("Axis 1", "Knot 3", str(bad))),
        (lambda: TensorSpline((1, 2), s.knots, net), ("(1, 2, 0)", str(bad))),
        (lambda: s.with_control(net), ("(1, 2, 0)", str(bad))),
        (lambda: s.insert_knots(1, [0.2, bad]), ("Axis 1", "knot 1", str(bad))),
        (lambda: s.refine(1, knots=[0, 0, 0, bad, 1, 1, 1]), ("Axis 1", "Knot 3", str(bad))),
        (lambda: s.evaluate([[0.1, 0.1], [0.1, bad]]), ("Parameter 1", "axis 1", str(bad))),
        (lambda: s.evaluate_grid([[0.1], [0.2, 0.3, bad]]), ("Parameter 2", "axis 1", str(bad))),
        (lambda: s.split(1, bad), ("Axis 1", str(bad))),
        (lambda: s.restrict([(0, 1), (0, bad)]), ("Axis 1", str(bad))),
        (lambda: s.integrate([(0, 1), (bad, 1)]), ("Axis 1", str(bad))),
        (lambda: s.remove_knots(1, bad), ("Axis 1", str(bad))),
        (lambda: s.remove_knot(1, bad), ("Axis 1", str(bad))),
        (lambda: s.elevate(1, bad), ("Axis 1", str(bad))),
        (lambda: s.reduce(1, bad), ("Axis 1", str(bad))),
        (lambda: s.derivative(1, bad), (str(bad),)),
        (lambda: reparametrise(s, 1, 0.0, bad), ("Axis 1", str(bad))),
        (lambda: join(*s.split(1, 0.5), 1, bad), ("Axis 1", str(bad))),
        (lambda: make_compatible(s, s, tolerance=bad), (str(bad),)),
        (lambda: combine([s, s], [1.0, bad]), ("Weight 1", str(bad))),
        (lambda: blend(s, s, bad), ("t is", str(bad))),
        (lambda: move_points(s, [[0.1, 0.1], [0.2, 0.2]], [[1.0], [bad]]), ("Target 1", str(bad))),
        (lambda: move_points(s, [[0.1, 0.1], [0.2, bad]], [[1.0], [2.0]]), ("Parameter 1", "axis 1", str(bad))),
        (lambda: move_points(s, [[0.1, 0.1]], [[1.0]], [[0.2, bad]]), ("Parameter 0", "axis 1", str(bad))),
        (lambda: scale_region(s, [(0, 1), (0, bad)], 2.0), ("Axis 1", str(bad))),
        (lambda: scale_region(s, [(0, 1), (0, 1)], bad), ("Gain", str(bad))),
    ):
        message = refusal(call)
        assert all(part in message for part in told), message


MANY = 100_000


@pytest.fixture(scope="module")
def long_curve() -> TensorSpline:
    rng = np.random.default_rng(10)
    t = clamped(3, rng.uniform(0, 1, MANY - 8))
    return curve(3, t, rng.uniform(-1, 1, MANY - 4))


def sampled_error(s: TensorSpline, f: exact.Function, count: int = 60) -> float:
    """Return the error of some control points, those at the ends among them."""
    n = s.size[0]
    which = sorted({0, 1, n - 2, n - 1, *np.random.default_rng(n).integers(0, n, count).tolist()})
    return exact.ulps(s.control[which, 0], exact.control_points(f, s.knots[0], s.degrees[0], which), 1.0)


def sampled_error_of_slopes(s: TensorSpline, f: exact.Function) -> float:
    """Return the error of some control points of the derivative, each to its own size."""
    slopes = s.derivative(0)
    which = np.random.default_rng(3).integers(0, slopes.size[0], 60).tolist()
    wanted = exact.control_points(exact.derivative(f), slopes.knots[0], slopes.degrees[0], which)
    return max(exact.ulps([slopes.control[i, 0]], [y], abs(float(y))) for i, y in zip(which, wanted, strict=True))


def test_100_000_knots_are_refined_and_elevated_right(long_curve):
    f = as_exact(long_curve)
    fine = long_curve.insert_knots(0, np.sort(np.random.default_rng(1).uniform(0, 1, 20_000)))
    assert sampled_error(fine, f) <= ULPS
    assert sampled_error(long_curve.elevate(0, 2), f) <= ULPS
    for part in long_curve.split(0, 0.37):
        assert sampled_error(part, f) <= ULPS
    assert sampled_error(long_curve.restrict([(0.2, 0.7)]), f) <= ULPS
    (same, other), _ = make_compatible(long_curve, curve(5, clamped(5, [0.5]), np.ones(7)))
    assert sampled_error(same, f) <= ULPS
    np.testing.assert_allclose(other.control, 1.0, rtol=0, atol=ULPS * 2.0**-52)


def test_100_000_knots_go_there_and_back(long_curve):
    near = {"rtol": 0, "atol": 2 * ULPS * 2.0**-52}
    low, _ = long_curve.elevate(0, 2).reduce(0, 2)
    np.testing.assert_allclose(low.control, long_curve.control, **near)
    coarse, bound = long_curve.insert_knots(0, [0.1, 0.5, 0.5, 0.9]).remove_knots(0, 1e-14)
    np.testing.assert_array_equal(coarse.knots[0], long_curve.knots[0])
    np.testing.assert_allclose(coarse.control, long_curve.control, **near)
    assert bound <= 1e-14
    whole, _ = join(*long_curve.split(0, 0.4321), 0)
    np.testing.assert_array_equal(whole.knots[0], long_curve.knots[0])
    np.testing.assert_allclose(whole.control, long_curve.control, **near)


def test_100_000_knots_are_integrated_differentiated_and_multiplied_right(long_curve):
    t, net = long_curve.knots[0], long_curve.control[:, 0]
    f = as_exact(long_curve)
    assert sampled_error_of_slopes(long_curve, f) <= ULPS
    with naive.digits():
        terms = [mpmath.mpf(c) * (mpmath.mpf(b) - a) / 4 for c, a, b in zip(net, t, t[4:], strict=False)]
        sums = [mpmath.mpf(0)]
        for term in terms:
            sums.append(sums[-1] + term)
    # Sums over the whole domain [0, 1], to be compared with control points of size 1.
    assert exact.ulps(long_curve.antiderivative(0).control[:, 0], sums, 1.0) <= ULPS
    assert exact.ulps(long_curve.integrate(), [sums[-1]], 1.0) <= ULPS
    line = curve(1, [0, 0, 1, 1], [-1.0, 2.0])
    assert sampled_error(product(long_curve, line), exact.product(f, as_exact(line))) <= 128
    moved = move_points(long_curve, [[0.25]], [[7.0]], [[0.26]])
    assert exact.ulps(moved.evaluate([[0.25]])[0], [7.0], 7.0) <= ULPS
    x = np.random.default_rng(2).uniform(0, 1, 100)
    wanted = [exact.value(f, float(v), t) for v in x]
    assert exact.ulps(long_curve.evaluate(x[:, None])[:, 0], wanted, 1.0) <= ULPS
