"""Deliberately naive B-splines to test against: the definition, one point at a time, in any kind of number.

``number`` is float, or mpmath.mpf for as many digits as its context holds. Nothing here is shared with bvbedit.
"""

from collections.abc import Callable, Sequence
from typing import Any

import mpmath
import numpy as np
from hypothesis import strategies as st

Row = list[Any]


def basis(knots: Sequence[float], degree: int, x: float, number: Callable[[Any], Any] = float) -> Row:
    """Return all N_i(x) by the Cox-de Boor recursion with 0/0 = 0, right-continuous, closed at the right end."""
    t, u = [number(v) for v in knots], number(x)
    last = max(i for i in range(len(t) - 1) if t[i] < t[i + 1])
    row = [number(t[i] <= u < t[i + 1] or (i == last and u == t[-1])) for i in range(len(t) - 1)]
    for p in range(1, degree + 1):
        row = [
            _quotient(u - t[i], t[i + p] - t[i], row[i], number)
            + _quotient(t[i + p + 1] - u, t[i + p + 1] - t[i + 1], row[i + 1], number)
            for i in range(len(row) - 1)
        ]
    return row


def derivatives(
    knots: Sequence[float],
    degree: int,
    x: float,
    order: int,
    number: Callable[[Any], Any] = float,
    magnitude: bool = False,
) -> Row:
    """Return all derivatives of the given order; with ``magnitude`` the sum of the terms' absolute values instead.

    The latter is the scale to which rounding errors of any evaluation of the formula are to be compared.
    """
    if order == 0:
        return basis(knots, degree, x, number)
    if degree == 0:
        return [number(0)] * (len(knots) - 1)
    t = [number(v) for v in knots]
    lower = derivatives(knots, degree - 1, x, order - 1, number, magnitude)
    sign = 1 if magnitude else -1
    return [
        _quotient(number(degree), t[i + degree] - t[i], lower[i], number)
        + sign * _quotient(number(degree), t[i + degree + 1] - t[i + 1], lower[i + 1], number)
        for i in range(len(lower) - 1)
    ]


def _quotient(a: Any, b: Any, factor: Any, number: Callable[[Any], Any]) -> Any:
    return number(0) if b == 0 or factor == 0 else a / b * factor


def matrix(knots: Sequence[float], degree: int, x: Sequence[float], order: int = 0) -> np.ndarray:
    """Return the dense collocation matrix (len(x), n) of the basis or of its derivatives."""
    return np.array([derivatives(knots, degree, float(v), order) for v in x], dtype=float).reshape(len(x), -1)


def evaluate(
    degrees: Sequence[int],
    knots: Sequence[Sequence[float]],
    control: np.ndarray,
    points: np.ndarray,
    orders: Sequence[int] | None = None,
) -> np.ndarray:
    """Return the tensor-product sum over all control points at ``points`` (n, d)."""
    orders = orders or [0] * len(degrees)
    out = np.zeros((len(points), control.shape[-1]))
    rows = [matrix(t, p, points[:, a], orders[a]) for a, (t, p) in enumerate(zip(knots, degrees, strict=True))]
    for i in range(len(points)):
        net = control
        for r in rows:
            net = np.tensordot(r[i], net, axes=(0, 0))
        out[i] = net
    return out


def exact(row: Row) -> np.ndarray:
    return np.array([float(v) for v in row])


def digits(count: int = 50) -> Any:
    """Return a context in which mpmath works with ``count`` digits."""
    return mpmath.workdps(count)


@st.composite
def knot_vectors(draw: st.DrawFn, degree: int, most: int = 6) -> np.ndarray:
    """Full clamped knot vectors: multiplicities up to degree + 1, knots one ulp apart, several domains.

    Not next to zero, where an ulp is 5e-324: that has a test of its own.
    """
    start, end = draw(st.sampled_from([(0.0, 1.0), (0.0, 1.0), (-3.0, 5.0), (1e6, 1e6 + 1.0), (-1e-9, 1e-9)]))
    shares = draw(st.lists(st.floats(1e-6, 1 - 1e-6), max_size=most))
    distinct = [start + (end - start) * s for s in shares]
    for value in list(distinct):
        for _ in range(draw(st.sampled_from([0, 0, 0, 1, 3]))):
            value = np.nextafter(value, np.inf) if abs(value) > 1e-20 else value
            distinct.append(value)
    interior: list[float] = []
    for value in sorted({float(v) for v in distinct if start < v < end}):
        interior += [value] * draw(st.integers(1, degree + 1))
    return np.array([start] * (degree + 1) + interior + [end] * (degree + 1))


def telling_points(knots: np.ndarray) -> np.ndarray:
    """Return the knots, their neighbours one ulp away, and points inside each span."""
    t = np.unique(knots)
    shares = np.array([[1e-9, 0.1, 0.5, 0.77, 1 - 1e-9]])
    inside = (t[:-1, None] + np.diff(t)[:, None] * shares).ravel()
    x = np.concatenate([t, np.nextafter(t, -np.inf), np.nextafter(t, np.inf), inside])
    return np.unique(x[(x >= t[0]) & (x <= t[-1])])


def random_knots(rng: np.random.Generator, degree: int, size: int) -> np.ndarray:
    """Return a clamped knot vector on [0, 1] for ``size`` control points, with some double knots if degree allows."""
    interior = np.sort(rng.uniform(0.02, 0.98, size - degree - 1))
    if degree >= 1 and len(interior) > 2:
        interior[1] = interior[0]
    return np.concatenate([np.zeros(degree + 1), interior, np.ones(degree + 1)])
