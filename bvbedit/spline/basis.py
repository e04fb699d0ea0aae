"""B-spline basis functions and their derivatives as (first index, values): never a dense row.

Cox-de Boor in the triangular form of Piegl & Tiller, algorithm A2.2, for all points at once.
"""

import numpy as np
from numpy.typing import NDArray

from bvbedit.spline.banded import Banded
from bvbedit.spline.knots import Floats

Indices = NDArray[np.int64]


def find_spans(knots: Floats, degree: int, x: Floats) -> Indices:
    """Return s (n,) with knots[s] <= x < knots[s+1]; at the right end the last span that is not empty."""
    last = len(knots) - degree - 2
    return np.clip(np.searchsorted(knots, x, side="right") - 1, degree, last).astype(np.int64)


def basis_values(knots: Floats, degree: int, x: Floats) -> tuple[Indices, Floats]:
    """Return the index (n,) of the first basis function that is not zero at ``x`` (n,), and all values (n, p+1)."""
    span = find_spans(knots, degree, x)
    return span - degree, _values_on(span, knots, degree, x)


def basis_derivatives(knots: Floats, degree: int, x: Floats, order: int) -> tuple[Indices, Floats]:
    """Return first indices (n,) and derivatives (n, p+1) of the given ``order`` (The NURBS Book, equation 2.7)."""
    span = find_spans(knots, degree, x)
    return span - degree, _derivatives_on(span, knots, degree, x, order)


def _values_on(span: Indices, knots: Floats, degree: int, x: Floats) -> Floats:
    values = np.zeros((len(x), degree + 1))
    values[:, 0] = 1.0
    for j in range(1, degree + 1):
        saved = np.zeros(len(x))
        for r in range(j):
            right, left = knots[span + r + 1], knots[span + r + 1 - j]
            share = values[:, r] / (right - left)
            values[:, r] = saved + (right - x) * share
            saved = (x - left) * share
        values[:, j] = saved
    return values


def _derivatives_on(span: Indices, knots: Floats, degree: int, x: Floats, order: int) -> Floats:
    if order == 0:
        return _values_on(span, knots, degree, x)
    out = np.zeros((len(x), degree + 1))
    if order > degree:
        return out
    lower = _derivatives_on(span, knots, degree - 1, x, order - 1)
    for j in range(degree):
        # The lower function j starts at knot i; it enters the functions j and j+1 of this degree.
        i = span - degree + 1 + j
        share = degree * lower[:, j] / (knots[i + degree] - knots[i])
        out[:, j] -= share
        out[:, j + 1] += share
    return out


def collocation(knots: Floats, degree: int, x: Floats, order: int = 0) -> Banded:
    """Return the banded matrix of basis functions (or their derivatives) at increasing or scattered ``x`` (m,)."""
    first, values = basis_derivatives(knots, degree, x, order)
    return Banded(first, values, len(knots) - degree - 1)
