"""An oracle for control points: piecewise polynomials by their Taylor series, in mpmath, at 50 digits.

A function is a callable that gives, for a number a, the Taylor coefficients about a of the piece to the right of a.
Sums, products, derivatives and integrals of functions are those of their series, and the control point i of degree q
over any knots is the polar form of a piece in its support at the q knots inside (Ramshaw 1989). So one formula serves
insertion, elevation, products and all the rest. Nothing here is shared with bvbedit.
"""

from bisect import bisect_right
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from itertools import pairwise
from math import comb
from typing import Any

import mpmath
import numpy as np

Series = list[Any]
Function = Callable[[Any], Series]

DIGITS = 50
# What the polar form may cancel, at degree 16 about 20 digits, is added to those that are wanted.
GUARD = 40


def spline(knots: Sequence[float], degree: int, control: Sequence[float]) -> Function:
    """Return the spline of one parameter and one channel, by de Boor's algorithm with series for numbers."""
    t, p = [float(v) for v in knots], degree

    @cache
    def series(a: Any) -> Series:
        with mpmath.workdps(DIGITS + GUARD):
            s = min(bisect_right(t, a) - 1, len(t) - p - 2)
            d = [[mpmath.mpf(float(control[i]))] for i in range(s - p, s + 1)]
            near = [mpmath.mpf(v) for v in t[s - p : s + p + 1]]
            start = [a - v for v in near]
            for r in range(1, p + 1):
                for j in range(p, r - 1, -1):
                    # d_{j-1} + (x - left) (d_j - d_{j-1}) / (right - left), with x = a + h
                    share = 1 / (near[1 + j - r + p] - near[j])
                    slope = [(u - v) * share for u, v in zip(d[j], d[j - 1], strict=True)]
                    flat = [v + start[j] * w for v, w in zip(d[j - 1], slope, strict=True)]
                    d[j] = [flat[0], *(u + w for u, w in zip(flat[1:], slope[:-1], strict=True)), slope[-1]]
            return d[p]

    return series


def total(functions: Sequence[Function], weights: Sequence[float]) -> Function:
    """Return the weighted sum."""

    @cache
    def series(a: Any) -> Series:
        with mpmath.workdps(DIGITS + GUARD):
            parts = [[mpmath.mpf(float(w)) * c for c in f(a)] for f, w in zip(functions, weights, strict=True)]
            return [mpmath.fsum(p[k] for p in parts if k < len(p)) for k in range(max(map(len, parts)))]

    return series


def product(f: Function, g: Function) -> Function:
    """Return the pointwise product."""

    @cache
    def series(a: Any) -> Series:
        with mpmath.workdps(DIGITS + GUARD):
            u, v = f(a), g(a)
            out = [mpmath.mpf(0)] * (len(u) + len(v) - 1)
            for i, x in enumerate(u):
                for j, y in enumerate(v):
                    out[i + j] += x * y
            return out

    return series


def derivative(f: Function) -> Function:
    """Return the derivative within the pieces."""

    @cache
    def series(a: Any) -> Series:
        with mpmath.workdps(DIGITS + GUARD):
            c = f(a)
            return [k * c[k] for k in range(1, len(c))] or [mpmath.mpf(0)]

    return series


def antiderivative(f: Function, breaks: Iterable[float]) -> Function:
    """Return the integral from the first of ``breaks``, between which f is a polynomial; it is known there only."""
    with mpmath.workdps(DIGITS + GUARD):
        ends = sorted(set(map(float, breaks)))
        table, start = {}, mpmath.mpf(0)
        for a, b in pairwise(ends):
            table[a] = [start, *(c / (k + 1) for k, c in enumerate(f(a)))]
            start = _horner(table[a], mpmath.mpf(b) - a)
    return lambda a: table[float(a)]


def value(f: Function, x: float, breaks: Sequence[float], before: bool = False) -> Any:
    """Return f(x), at the last of the sorted ``breaks`` (or wherever ``before``) from the left."""
    with mpmath.workdps(DIGITS + GUARD):
        if before or x == breaks[-1]:
            a = max(b for b in breaks if b < x)
            return _horner(f(a), mpmath.mpf(float(x)) - a)
        return f(float(x))[0]


def integral(f: Function, breaks: Sequence[float], low: float, high: float) -> Any:
    """Return the integral over [low, high] of f, a polynomial between ``breaks``."""
    with mpmath.workdps(DIGITS + GUARD):
        ends = sorted({low, high, *(float(b) for b in breaks if low < b < high)})
        pieces = ((f(a), mpmath.mpf(b) - a) for a, b in pairwise(ends))
        return mpmath.fsum(_horner([0, *(c / (k + 1) for k, c in enumerate(s))], width) for s, width in pieces)


def control_points(f: Function, knots: Sequence[float], degree: int, which: Iterable[int] | None = None) -> list[Any]:
    """Return the control points of f as a spline over ``knots``, all of them or those of the indices ``which``."""
    t, q = [float(v) for v in knots], degree
    out = []
    with mpmath.workdps(DIGITS + GUARD):
        for i in range(len(t) - q - 1) if which is None else which:
            # The widest piece in the support: seen from there no other knot is far away.
            s = max(range(i, i + q + 1), key=lambda k: t[k + 1] - t[k])
            symmetric = [mpmath.mpf(1)] + [mpmath.mpf(0)] * q
            for j in range(1, q + 1):
                z = mpmath.mpf(t[i + j]) - t[s]
                for k in range(j, 0, -1):
                    symmetric[k] += z * symmetric[k - 1]
            out.append(mpmath.fsum(c * symmetric[k] / comb(q, k) for k, c in enumerate(f(t[s])[: q + 1])))
    return out


def ulps(found: Sequence[float], wanted: Sequence[Any], scale: float) -> float:
    """Return the largest difference in units in the last place of ``scale``."""
    with mpmath.workdps(DIGITS):
        unit = mpmath.mpf(float(np.spacing(scale)))
        worst = max(abs(mpmath.mpf(float(x)) - y) for x, y in zip(found, wanted, strict=True))
        return float(worst / unit)


def _horner(series: Series, h: Any) -> Any:
    out = mpmath.mpf(0)
    for c in reversed(series):
        out = out * h + c
    return out
