"""Nets of n x n x 4n control points, as the paper's: which series they are of, and an axis of n."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from bvbedit.study.quantities import Quantity
from bvbedit.study.table import Row, Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# The measured rows of each series.
Sweep = dict[str, list[Row]]


def side(row: Row) -> int | None:
    """Return n of a net of n x n x 4n control points; None for another one."""
    axes = row.axes
    return axes[0] if axes is not None and axes[0] == axes[1] and axes[2] == 4 * axes[0] else None


def sweeps(table: Table) -> Sweep:
    """Return the measured rows of each series all of whose nets are n x n x 4n, at two n or more."""
    found: Sweep = {}
    for row in table.done:
        if row.kind == "spline":
            found.setdefault(row.series, []).append(row)
    return {
        series: rows
        for series, rows in found.items()
        if all(side(row) is not None for row in rows) and len({side(row) for row in rows}) > 1
    }


def known(found: Sweep, quantities: Sequence[Quantity]) -> Sweep:
    """Return the series with two n or more at which all of the quantities are known, and the rows in which they are."""
    kept = {s: [r for r in rows if all(q.value(r) is not None for q in quantities)] for s, rows in found.items()}
    return {series: rows for series, rows in kept.items() if len({side(row) for row in rows}) > 1}


def quoted(names: Sequence[str]) -> str:
    """Return ``names`` as a sentence has them."""
    marked = [f"“{name}”" for name in names]
    return marked[0] if len(marked) == 1 else f"{', '.join(marked[:-1])} and {marked[-1]}"


def number_sides(at: "Axes") -> None:
    """Put whole numbers on the axis of n."""
    from matplotlib.ticker import MaxNLocator

    at.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=8, steps=[1, 2, 4, 5, 10]))
