"""A measurement: a table of reflectance on a chart, with a mask of the cells that were really measured."""

from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.charts import Chart
from bvbedit.brdf.geometry import Bools, Floats
from bvbedit.errors import BvbError

# Between nodes the table is linear in log(1 + SCALE f): peaks of 1e4 beside 1e-3 ask for a logarithm.
SCALE = 1000.0


class MeasuredBrdf(Brdf):
    """A table on a chart, interpolated linearly in log(1 + 1000 f).

    ``values`` (n_0, n_1, n_2, 3) in 1/sr, linear RGB; ``valid`` (n_0, n_1, n_2); ``axes`` three increasing arrays of
    chart parameters in [0, 1]. What stands in invalid cells is forgotten: they take the value of the nearest valid
    cell below on the first axis of ``chart.hold_order`` (MERL: the next smaller theta_h), or failing that on the next.
    Negative values count as zero; ``clamped`` is their share among the valid ones. The arrays are kept read-only.

    Raises BvbError for shapes that do not fit, axes that do not increase, values that are not finite in valid cells,
    and tables without a valid cell.
    """

    reliable_elevation = float(np.radians(85.0))

    def __init__(self, values: ArrayLike, valid: ArrayLike, axes: tuple[ArrayLike, ...], chart: Chart) -> None:
        table = np.array(values, dtype=np.float64, order="C")
        mask = np.array(valid, dtype=bool, order="C")
        nodes = tuple(np.array(a, dtype=np.float64) for a in axes)
        shape = tuple(len(a) if a.ndim == 1 else -1 for a in nodes)
        if len(nodes) != 3 or min(shape) < 1 or table.shape != (*shape, 3) or mask.shape != shape:
            raise BvbError(
                f"Table values {table.shape}, valid {mask.shape} and axes {shape} do not belong together. "
                "Give values (n0, n1, n2, 3), valid (n0, n1, n2) and three axes of n0, n1 and n2 nodes."
            )
        for name, a in zip(chart.axes, nodes, strict=True):
            if not (np.isfinite(a).all() and a[0] >= 0 and a[-1] <= 1 and (np.diff(a) > 0).all()):
                raise BvbError(f"The table's {name} axis is not increasing in [0, 1]. Give chart parameters in order.")
        count = int(np.count_nonzero(mask))
        if count == 0:
            raise BvbError("Not one cell of the table is valid. There is nothing to evaluate or fit.")
        bad = ~np.isfinite(table).all(axis=-1) & mask
        if bad.any():
            where = tuple(np.argwhere(bad)[0])
            raise BvbError(f"Table cell {[int(i) for i in where]} holds {table[where].tolist()}. Mark it invalid.")
        if count < mask.size:
            table = hold(table, mask, chart.hold_order)
        below = table < 0
        self.clamped = float(np.count_nonzero(below[mask])) / (3 * count) if below.any() else 0.0
        if self.clamped or below.any():
            np.maximum(table, 0.0, out=table)
        for a in (table, mask, *nodes):
            a.setflags(write=False)
        self.values: Floats = table
        self.valid: Bools = mask
        self.axes: tuple[Floats, Floats, Floats] = (nodes[0], nodes[1], nodes[2])
        self.chart = chart

    @property
    def reciprocal(self) -> bool:  # type: ignore[override]
        """Whether the chart makes f(wi, wo) = f(wo, wi)."""
        return self.chart.reciprocal

    @cached_property
    def _logs(self) -> Floats:
        from bvbedit.brdf import table_kernels

        n = self.values.shape
        return table_kernels.log_table(self.values.reshape(n[0] * n[1], -1), SCALE).reshape(n)

    def _evaluate(self, wi: Floats, wo: Floats) -> tuple[Floats, Bools]:
        from bvbedit.brdf import table_kernels

        parameters = self.chart.to_parameters(wi, wo)
        return table_kernels.interpolate(parameters, *self.axes, self.chart.periodic[2], self._logs, self.valid, SCALE)


def hold(values: Floats, known: Bools, order: tuple[int, ...]) -> Floats:
    """Return ``values`` (n_0, n_1, n_2, c) with unknown nodes filled from known ones.

    Along the first axis of ``order`` each unknown node takes the value of the nearest known node below it, or above
    where there is none below; lines without any known node are served by the next axis.
    """
    values, known = values.copy(), known.copy()
    for axis in order:
        if known.all():
            break
        n = known.shape[axis]
        index = np.arange(n).reshape([-1 if a == axis else 1 for a in range(known.ndim)])
        below = np.maximum.accumulate(np.where(known, index, -1), axis=axis)
        above = np.flip(np.minimum.accumulate(np.flip(np.where(known, index, n), axis), axis=axis), axis)
        source = np.where(below >= 0, below, above)
        fill = ~known & (source < n)
        at = list(np.nonzero(fill))
        at[axis] = source[fill]
        values[fill] = values[tuple(at)]
        known |= fill
    return values
