"""A banded matrix along one axis of an array: what every per-axis operation on a spline comes down to."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Banded:
    """An (m, columns) matrix whose row i holds ``rows[i]`` (k,) from column ``first[i]`` on, and zeros elsewhere."""

    first: NDArray[np.int64]
    rows: Floats
    columns: int

    def apply(self, x: Floats, axis: int) -> Floats:
        """Return the matrix times ``x`` along ``axis``: (..., columns, ...) to (..., m, ...)."""
        from bvbedit.spline import kernels

        view, shape = _as_three(x, axis)
        out = np.empty((view.shape[0], len(self.rows), view.shape[2]))
        kernels.apply_banded(self.first, self.rows, view, out)
        return out.reshape((*shape[:axis], len(self.rows), *shape[axis + 1 :]))

    def apply_transposed(self, x: Floats, axis: int) -> Floats:
        """Return the transposed matrix times ``x`` along ``axis``: (..., m, ...) to (..., columns, ...)."""
        from bvbedit.spline import kernels

        view, shape = _as_three(x, axis)
        out = np.zeros((view.shape[0], self.columns, view.shape[2]))
        kernels.apply_banded_transposed(self.first, self.rows, view, out)
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
