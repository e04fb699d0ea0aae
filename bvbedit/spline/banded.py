"""A banded matrix along one axis of an array: what every per-axis operation on a spline comes down to."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bvbedit.errors import BvbError

Floats = NDArray[np.float64]

# Of the largest one: below, a pivot of the triangular form is rounding.
SMALLEST_PIVOT = 1e-13
# Multiplications, 2 ms of one thread. Waking a second one takes microseconds on an idle machine, but milliseconds on a
# busy one: 2.4 million of them took 0.3 ms on one thread, and 8 ms on two of which one was taken.
WORTH_SHARING = 1 << 23


@dataclass(frozen=True)
class Banded:
    """An (m, columns) matrix whose row i holds ``rows[i]`` (k,) from column ``first[i]`` on, and zeros elsewhere."""

    first: NDArray[np.int64]
    rows: Floats
    columns: int

    def apply(self, x: Floats, axis: int) -> Floats:
        """Return the matrix times ``x`` along ``axis``: (..., columns, ...) to (..., m, ...)."""
        from bvbedit.jit import frozen
        from bvbedit.spline import kernels

        view, shape = _as_three(x, axis)
        out = np.empty((view.shape[0], len(self.rows), view.shape[2]))
        apply = kernels.apply_banded_shared if self.rows.shape[1] * out.size > WORTH_SHARING else kernels.apply_banded
        apply(self.first, self.rows, frozen(view), out)
        return out.reshape((*shape[:axis], len(self.rows), *shape[axis + 1 :]))

    def largest_difference(self, x: Floats, y: Floats, axis: int) -> float:
        """Return the largest entry of |matrix times ``x`` - ``y``| along ``axis``, infinite where it overflows.

        Nothing of that size is stored: fresh memory takes longer than the arithmetic.
        """
        from bvbedit.jit import frozen
        from bvbedit.spline import kernels

        x, y = (frozen(_as_three(side, axis)[0]) for side in (x, y))
        return float(kernels.largest_difference(self.first, self.rows, x, y))

    def apply_transposed(self, x: Floats, axis: int) -> Floats:
        """Return the transposed matrix times ``x`` along ``axis``: (..., m, ...) to (..., columns, ...)."""
        from bvbedit.spline import kernels

        view, shape = _as_three(x, axis)
        out = np.zeros((view.shape[0], self.columns, view.shape[2]))
        kernels.apply_banded_transposed(self.first, self.rows, view, out)
        return out.reshape((*shape[:axis], self.columns, *shape[axis + 1 :]))

    def after(self, other: "Banded") -> "Banded":
        """Return the matrix product of this matrix and ``other``: what both do, ``other`` first."""
        from bvbedit.spline import refinement_kernels

        m = len(self.first)
        first = np.empty(m, dtype=np.int64)
        width = refinement_kernels.product_extent(self.first, self.rows, other.first, other.rows, first)
        first = np.minimum(first, other.columns - width)
        rows = np.zeros((m, width))
        refinement_kernels.product_rows(self.first, self.rows, other.first, other.rows, first, rows)
        return Banded(first, rows, other.columns)

    def between(self, low: int, high: int) -> "Banded":
        """Return the matrix (m, high - low) of the columns from ``low`` to before ``high``."""
        k = min(self.rows.shape[1], high - low)
        first = np.clip(self.first, low, high - k)
        at = (first - self.first)[:, None] + np.arange(k)
        inside = (at >= 0) & (at < self.rows.shape[1])
        rows = np.where(inside, np.take_along_axis(self.rows, np.clip(at, 0, self.rows.shape[1] - 1), axis=1), 0.0)
        return Banded(first - low, rows, high - low)

    def solve(self, y: Floats, axis: int) -> Floats:
        """Return the ``x`` (..., columns, ...) for which the matrix times x along ``axis`` is nearest to ``y``.

        Least squares by Givens rotations, for a matrix whose ``first`` does not decrease. Raises BvbError where its
        columns are linearly dependent as far as float64 can tell.
        """
        from bvbedit.spline import refinement_kernels

        m, k = self.rows.shape
        upper, cosines, sines = np.zeros((self.columns, k)), np.empty((m, k)), np.empty((m, k))
        refinement_kernels.rotations(self.first, self.rows, upper, cosines, sines)
        diagonal = np.abs(upper[:, 0])
        if not diagonal.min() > SMALLEST_PIVOT * diagonal.max():
            raise BvbError(
                f"The equations do not determine control point {int(np.argmin(diagonal))} of {self.columns}. "
                "Keep knots further apart."
            )
        view, shape = _as_three(y, axis)
        out = np.empty((view.shape[0], self.columns, view.shape[2]))
        refinement_kernels.solve_rotated(self.first, upper, cosines, sines, view, out)
        return out.reshape((*shape[:axis], self.columns, *shape[axis + 1 :]))

    def dense(self) -> Floats:
        """Return the matrix (m, columns) with its zeros."""
        m, k = self.rows.shape
        out = np.zeros((m, self.columns))
        out[np.arange(m)[:, None], self.first[:, None] + np.arange(k)] = self.rows
        return out


def _as_three(x: Floats, axis: int) -> tuple[Floats, tuple[int, ...]]:
    """View ``x`` as (before, n, after), which moves nothing in memory."""
    shape = x.shape
    before, after = int(np.prod(shape[:axis])), int(np.prod(shape[axis + 1 :]))
    return np.ascontiguousarray(x).reshape(before, shape[axis], after), shape
