"""A measurement: a table of reflectance on a chart, with a mask of the cells that were really measured."""

from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.charts import Chart
from bvbedit.brdf.geometry import Bools, Floats
from bvbedit.errors import BvbError
from bvbedit.spline.arguments import one_per_axis, real_array
from bvbedit.spline.knots import increasing

# Between nodes the table is linear in log(1 + SCALE f): peaks of 1e4 beside 1e-3 ask for a logarithm.
SCALE = 1000.0
# SCALE times a larger value would leave the range of float64.
LARGEST = 1e300
LOG_BLOCK = 1 << 14


class MeasuredBrdf(Brdf):
    """A table on a chart, interpolated linearly in log(1 + 1000 f).

    ``values`` (n_0, n_1, n_2, 3) in 1/sr, linear RGB; ``valid`` (n_0, n_1, n_2); ``axes`` three increasing arrays of
    chart parameters in [0, 1]. What stands in invalid cells is forgotten: they take the value of the nearest valid
    cell below on the first axis of ``chart.hold_order`` (MERL: the next smaller theta_h), or failing that on the next.
    ``values`` has zeros there, ``filled`` what is evaluated.
    Negative values count as zero; ``clamped`` is their share among the valid ones. The arrays are kept read-only.

    Raises BvbError for shapes that do not fit, axes that do not increase, values beyond 1e300 or not finite in valid
    cells, and tables without a valid cell.
    """

    reliable_elevation = float(np.radians(85.0))

    def __init__(self, values: ArrayLike, valid: ArrayLike, axes: tuple[ArrayLike, ...], chart: Chart) -> None:
        table = np.array(real_array(values, "Table values"), order="C")
        mask = np.array(real_array(valid, "Table valid", bool), order="C")
        nodes = tuple(np.array(real_array(a, "Table axis")) for a in one_per_axis(axes, "Table axes"))
        shape = tuple(len(a) if a.ndim == 1 else -1 for a in nodes)
        if len(nodes) != 3 or min(shape) < 1 or table.shape != (*shape, 3) or mask.shape != shape:
            raise BvbError(
                f"Table values {table.shape}, valid {mask.shape} and axes {shape} do not belong together. "
                "Give values (n0, n1, n2, 3), valid (n0, n1, n2) and three axes of n0, n1 and n2 nodes."
            )
        for name, a in zip(chart.axes, nodes, strict=True):
            if not (increasing(a) and a[0] >= 0 and a[-1] <= 1):
                raise BvbError(f"The table's {name} axis is not increasing in [0, 1]. Give chart parameters in order.")
        count = int(np.count_nonzero(mask))
        if count == 0:
            raise BvbError("Not one cell of the table is valid. There is nothing to evaluate or fit.")
        if count < mask.size:
            table[~mask] = 0.0
        lowest, highest = table.min(), table.max()
        if not -LARGEST <= lowest <= highest <= LARGEST:  # false for nan too
            where = tuple(int(i) for i in np.argwhere(~(np.abs(table) <= LARGEST))[0][:3])
            raise BvbError(f"Table cell {where} holds {table[where].tolist()}. Mark it invalid.")
        self.clamped = 0.0
        if lowest < 0:
            self.clamped = float(np.count_nonzero(table < 0)) / (3 * count)
            np.maximum(table, 0.0, out=table)
        for a in (table, mask, *nodes):
            a.setflags(write=False)
        self.readings = count
        self.values: Floats = table
        self.valid: Bools = mask
        self.axes: tuple[Floats, Floats, Floats] = (nodes[0], nodes[1], nodes[2])
        self.chart = chart

    @property
    def reciprocal(self) -> bool:  # type: ignore[override]
        """Whether the chart makes f(wi, wo) = f(wo, wi)."""
        return self.chart.reciprocal

    @cached_property
    def filled(self) -> Floats:
        """The table (n_0, n_1, n_2, 3) without holes."""
        return self.values if self.valid.all() else hold(self.values, self.valid, self.chart.hold_order)

    @cached_property
    def _logs(self) -> Floats:
        """log(1 + SCALE f), as log(u) x/(u - 1) with u = 1 + x rounded: exact; numpy's log is quicker than log1p."""
        logs = np.empty_like(self.filled)
        values, out = self.filled.reshape(-1), logs.reshape(-1)
        # In blocks that stay in the cache.
        for start in range(0, len(values), LOG_BLOCK):
            block = slice(start, start + LOG_BLOCK)
            x = SCALE * values[block]
            u = 1.0 + x
            rounded = u - 1.0
            np.log(u, out=u)
            np.divide(u, rounded, out=u, where=rounded != 0)
            np.copyto(u, 1.0, where=rounded == 0)
            np.multiply(u, x, out=out[block])
        return logs

    def _evaluate(self, wi: Floats, wo: Floats) -> tuple[Floats, Bools]:
        from bvbedit.brdf import table_kernels

        parameters = self.chart.to_parameters(wi, wo)
        logs, valid = table_kernels.interpolate(parameters, *self.axes, self.chart.periodic[2], self._logs, self.valid)
        # numpy's vector expm1 here, not the scalar one in the kernel: 15 times faster.
        return np.expm1(logs, out=logs) / SCALE, valid


def hold(values: Floats, known: Bools, order: tuple[int, ...]) -> Floats:
    """Return ``values`` (n_0, n_1, n_2, c) with unknown nodes filled from known ones.

    Along the first axis of ``order`` each unknown node takes the value of the nearest known node below it, or above
    where there is none below; lines without any known node are served by the next axis.
    """
    values, known = values.copy(), known.copy()
    for axis in order:
        v, k = np.moveaxis(values, axis, 0), np.moveaxis(known, axis, 0)
        upwards = [(i, i - 1) for i in range(1, len(k))]
        downwards = [(i, i + 1) for i in reversed(range(len(k) - 1))]
        for i, neighbour in upwards + downwards:
            fill = k[neighbour] & ~k[i]
            if fill.any():
                v[i][fill] = v[neighbour][fill]
                k[i] |= fill
    return values
