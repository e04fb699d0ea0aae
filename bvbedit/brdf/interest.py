"""What a fit is for, where it is not the metric: pairs of directions, and what an error of reflectance counts there."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bvbedit.brdf.charts import Chart
from bvbedit.brdf.geometry import Floats
from bvbedit.brdf.losses import PictureError

# Cells of a chart along each axis: some ten pairs for each. With half as many more along each axis, chrome gained 1
# to 5 % and satin lost a tenth.
CELLS = (24, 24, 12)


@dataclass(frozen=True)
class Interest:
    """Pairs of directions (n, 3), (n, 3), and what a squared error of the ``loss`` counts at each (n, 3)."""

    wi: Floats
    wo: Floats
    counts: Floats
    loss: PictureError

    def shares(self, chart: Chart, cells: tuple[int, int, int] = CELLS) -> Floats:
        """Return which share of what counts falls into each of the ``cells`` of a chart's parameter box."""
        return _histogram(chart.to_parameters(self.wi, self.wo), self.counts.sum(axis=1), cells)

    def density(self, chart: Chart, points: Floats) -> Floats:
        """Return how densely what counts lies at chart parameters (n, 3), with the mean one over the box: (n,)."""
        return _between(float(np.prod(CELLS)) * _smoothed(self.shares(chart)), points)


def _histogram(points: Floats, counts: Floats, cells: tuple[int, int, int]) -> Floats:
    """Return the share of ``counts`` (n,) in each of the cells of the unit cube."""
    at = np.minimum((points * cells).astype(np.intp), np.subtract(cells, 1))
    flat = np.ravel_multi_index(tuple(at.T), cells)
    shares = np.bincount(flat, counts, minlength=int(np.prod(cells))).reshape(cells)
    return np.asarray(shares / shares.sum())


def _smoothed(values: Floats) -> Floats:
    """Return means over neighbouring cells, weighted 1, 2, 1 along each axis: fewer cells are left to chance."""
    for axis in range(values.ndim):
        padded = np.pad(values, [(1, 1) if a == axis else (0, 0) for a in range(values.ndim)], mode="edge")
        before, here, after = (np.take(padded, range(k, k + values.shape[axis]), axis=axis) for k in range(3))
        values = (before + 2 * here + after) / 4
    return values


def _between(values: Floats, points: Floats) -> Floats:
    """Return values (n,) at ``points`` (n, 3), linear between the middles of cells."""
    out = np.zeros(len(points))
    places = np.clip(points * values.shape - 0.5, 0, np.subtract(values.shape, 1))
    first = np.minimum(places.astype(np.intp), np.subtract(values.shape, 2))
    right = places - first
    for corner in np.ndindex(2, 2, 2):
        share: NDArray[np.float64] = np.prod(np.where(corner, right, 1 - right), axis=1)
        out += share * values[tuple((first + corner).T)]
    return out
