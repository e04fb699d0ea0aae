"""Splines to test with, drawn by hypothesis, and what it means that two of them are one function."""

from collections.abc import Sequence

import numpy as np
from hypothesis import strategies as st

from bvbedit.spline.tensor import TensorSpline
from tests.spline import naive

EPS = float(np.finfo(np.float64).eps)
DOMAINS = [(0.0, 1.0), (0.0, 1.0), (-3.0, 5.0), (1e6, 1e6 + 1.0), (-1e-9, 1e-9)]
# For each number of parameters: degrees, interior knots at most, and parameters of an axis at which to look.
DEGREES = {1: [0, 1, 2, 3, 3, 4, 5, 7, 16], 2: [0, 1, 2, 3, 3, 5], 3: [0, 1, 2, 3], 4: [0, 1, 2]}
MOST_KNOTS = {1: 5, 2: 3, 3: 2, 4: 1}
MOST_LOOKS = {1: 1000, 2: 40, 3: 16, 4: 9}


@st.composite
def tame_knots(draw: st.DrawFn, degree: int, most: int = 5, domain: tuple[float, float] | None = None) -> np.ndarray:
    """Full clamped knot vectors on a grid of 16 parts, multiplicities up to degree + 1."""
    start, end = domain or draw(st.sampled_from(DOMAINS))
    interior: list[float] = []
    for k in sorted(draw(st.lists(st.integers(1, 15), max_size=most, unique=True))):
        interior += [start + (end - start) * (k / 16)] * draw(st.sampled_from([1, 1, 1, 2, degree, degree + 1]))
    interior = [v for v in interior if interior.count(v) <= degree + 1]
    return np.array([start] * (degree + 1) + interior + [end] * (degree + 1))


@st.composite
def splines(
    draw: st.DrawFn,
    parameters: int | None = None,
    *,
    tame: bool = False,
    channels: int | None = None,
    domain: Sequence[tuple[float, float]] | None = None,
    highest: int = 16,
) -> TensorSpline:
    """Random control points over ``tame_knots``, or over ``naive.knot_vectors``: knots an ulp apart among them."""
    d = len(domain) if domain else parameters or draw(st.sampled_from([1, 1, 1, 2, 2, 3, 4]))
    degrees = [draw(st.sampled_from([p for p in DEGREES[d] if p <= highest])) for _ in range(d)]
    knots = []
    for axis, p in enumerate(degrees):
        on = domain[axis] if domain else None
        knots.append(draw(tame_knots(p, MOST_KNOTS[d], on) if tame else naive.knot_vectors(p, MOST_KNOTS[d])))
    size = [len(t) - p - 1 for t, p in zip(knots, degrees, strict=True)]
    rng = np.random.default_rng(draw(st.integers(0, 1000)))
    return TensorSpline(degrees, knots, rng.normal(size=(*size, channels or draw(st.integers(1, 3)))))


@st.composite
def pairs(draw: st.DrawFn, parameters: int | None = None, highest: int = 16) -> tuple[TensorSpline, TensorSpline]:
    """Two tame splines over one domain with equal channels; degrees and knots are their own."""
    d = parameters or draw(st.sampled_from([1, 1, 1, 2, 3]))
    domain = [draw(st.sampled_from(DOMAINS)) for _ in range(d)]
    channels = draw(st.integers(1, 3))
    one, other = (draw(splines(tame=True, domain=domain, channels=channels, highest=highest)) for _ in range(2))
    return one, other


@st.composite
def with_axis(draw: st.DrawFn, drawn: st.SearchStrategy[TensorSpline]) -> tuple[TensorSpline, int]:
    spline = draw(drawn)
    return spline, draw(st.integers(0, spline.parameters - 1))


def random_spline(rng: np.random.Generator, degrees: Sequence[int], size: Sequence[int], channels: int) -> TensorSpline:
    knots = [naive.random_knots(rng, p, n) for p, n in zip(degrees, size, strict=True)]
    return TensorSpline(degrees, knots, rng.normal(size=(*size, channels)))


def looks(*splines: TensorSpline) -> list[np.ndarray]:
    """Return for each axis parameters at which differences would show: knots, their neighbours, points between."""
    axes = []
    for knots in zip(*(s.knots for s in splines), strict=True):
        low, high = max(t[0] for t in knots), min(t[-1] for t in knots)
        x = np.unique(np.concatenate([naive.telling_points(t) for t in knots]))
        x = x[(x >= low) & (x <= high)]
        step = -(-len(x) // MOST_LOOKS[len(splines[0].knots)])
        axes.append(np.unique([*x[::step], x[-1]]))
    return axes


def largest(spline: TensorSpline) -> float:
    return float(np.abs(spline.control).max())


def change(a: TensorSpline, b: TensorSpline) -> float:
    """Return the largest difference seen."""
    axes = looks(a, b)
    return float(np.abs(a.evaluate_grid(axes) - b.evaluate_grid(axes)).max())


def slope_magnitude(spline: TensorSpline, axis: int) -> TensorSpline:
    """Return the derivative with all differences made sums: what rounding errors of it are to be compared with."""
    p, t, slope = spline.degrees[axis], spline.knots[axis], spline.derivative(axis)
    if p == 0:
        return slope
    gap, net = t[p + 1 : -1] - t[1 : -p - 1], np.moveaxis(np.abs(spline.control), axis, -1)
    sums = ((net[..., 1:] + net[..., :-1]) * (p / np.where(gap > 0, gap, np.inf)))[..., gap > 0]
    return slope.with_control(np.moveaxis(sums, -1, axis))


def assert_same(a: TensorSpline, b: TensorSpline, axes: Sequence[np.ndarray] | None = None, ulps: float = 64) -> None:
    """Assert that values and first derivatives agree, ``ulps`` times the rounding unit of their terms."""
    axes = axes or looks(a, b)
    np.testing.assert_allclose(
        b.evaluate_grid(axes), a.evaluate_grid(axes), rtol=0, atol=ulps * EPS * max(largest(a), largest(b))
    )
    for axis in range(a.parameters):
        off = np.abs(a.derivative(axis).evaluate_grid(axes) - b.derivative(axis).evaluate_grid(axes))
        scale = sum(slope_magnitude(s, axis).evaluate_grid(axes) for s in (a, b))
        # Channels and neighbours share a scale: small control points are rounded beside large ones.
        assert (off <= ulps * EPS * scale.max(axis=-1, keepdims=True) + 1e-300).all() or (
            off <= ulps * EPS * scale.max()
        ).all(), axis


def ones(spline: TensorSpline) -> TensorSpline:
    return spline.with_control(np.ones_like(spline.control))


def assert_ones(spline: TensorSpline, ulps: float = 16) -> None:
    np.testing.assert_allclose(spline.control, 1.0, rtol=0, atol=ulps * EPS)
