"""B-spline basis functions and their derivatives as (first index, values): never a dense row.

Cox-de Boor in the triangular form of Piegl & Tiller, algorithm A2.2.
"""

import numpy as np
from numpy.typing import NDArray

from bvbedit.errors import BvbError
from bvbedit.spline.banded import Banded
from bvbedit.spline.knots import Floats, greville

Indices = NDArray[np.int64]


def find_spans(knots: Floats, degree: int, x: Floats) -> Indices:
    """Return s (n,) with knots[s] <= x < knots[s+1]; at the right end the last span that is not empty."""
    last = len(knots) - degree - 2
    return np.clip(np.searchsorted(knots, x, side="right") - 1, degree, last).astype(np.int64)


def find_spans_before(knots: Floats, degree: int, x: Floats) -> Indices:
    """Return s (n,) with knots[s] < x <= knots[s+1]; at the left end the first span that is not empty."""
    last = len(knots) - degree - 2
    return np.clip(np.searchsorted(knots, x, side="left") - 1, degree, last).astype(np.int64)


def basis_values(knots: Floats, degree: int, x: Floats) -> tuple[Indices, Floats]:
    """Return the index (n,) of the first basis function that is not zero at ``x`` (n,), and all values (n, p+1)."""
    span = find_spans(knots, degree, x)
    return span - degree, _values_on(span, knots, degree, x)


def basis_derivatives(knots: Floats, degree: int, x: Floats, order: int) -> tuple[Indices, Floats]:
    """Return first indices (n,) and derivatives (n, p+1) of the given ``order`` (The NURBS Book, equation 2.7)."""
    span = find_spans(knots, degree, x)
    return span - degree, _derivatives_on(span, knots, degree, x, order)


def _values_on(span: Indices, knots: Floats, degree: int, x: Floats) -> Floats:
    from bvbedit.jit import frozen
    from bvbedit.spline import kernels

    values = np.empty((len(x), degree + 1))
    kernels.basis_at(frozen(knots), degree, span, frozen(np.ascontiguousarray(x)), values)
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


def limits(knots: Floats, degree: int, x: Floats, before: NDArray[np.bool_]) -> Banded:
    """Return the matrix of basis functions at ``x`` (m,), their limits from the left where ``before`` (m,) is true."""
    span = np.where(before, find_spans_before(knots, degree, x), find_spans(knots, degree, x))
    return Banded(span - degree, _values_on(span, knots, degree, x), len(knots) - degree - 1)


def interpolation(knots: Floats, degree: int) -> tuple[Floats, NDArray[np.bool_], Banded, float]:
    """Return the Greville abscissae (n,), where limits from the left are meant, the matrix there, and its condition.

    At an interior knot of full multiplicity two control points stand, one on either side of the jump. The inverse of a
    totally positive matrix has the signs of a chessboard, so that its largest row sum, which is the condition number in
    the maximum norm since the rows of the matrix sum up to one, comes from a single solve. Source: de Boor, A Practical
    Guide to Splines, chapter XIII.
    """
    x = greville(knots, degree)
    before = np.zeros(len(x), dtype=bool)
    if degree > 0:
        before = knots[: -degree - 1] < knots[1:-degree]
        before &= knots[1:-degree] == x
    matrix = limits(knots, degree, x, before)
    try:
        alternating = matrix.solve(np.where(np.arange(len(x)) % 2, -1.0, 1.0), 0)
    except BvbError:
        return x, before, matrix, np.inf
    return x, before, matrix, float(np.abs(alternating).max())
