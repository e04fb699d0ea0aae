"""The figure of bytes over n, for nets of n x n x 4n control points: the paper's Fig. 10."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from bvbedit.study.nets import known, number_sides, quoted, side, sweeps
from bvbedit.study.plots import Missing, Numbers, Plot, agreement
from bvbedit.study.quantities import BYTES, PAYLOAD, Quantity
from bvbedit.study.style import GREY, PALETTE, log_axis, panels, pretty
from bvbedit.study.table import Row, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def byte_plot(table: Table) -> Plot | Missing:
    """Return the figure of bytes over n."""
    title = "Bytes over n (the paper's Fig. 10)"
    quantities = (PAYLOAD, BYTES)
    found = known(sweeps(table), quantities)
    if not found:
        return Missing(title, "no series has nets of n x n x 4n control points at two n with these bytes")
    floats = all(row.precision == "float32" for rows in found.values() for row in rows)
    lines = []
    for series, rows in found.items():
        for n in sorted({n for n in map(side, rows) if n is not None}):
            for quantity in quantities:
                least, middle, most = _spread([r for r in rows if side(r) == n], quantity)
                lines.append((series, n, quantity.label, least, middle, most))
    words = (
        f"Bytes of net and interior knots, and of the compressed .bvb file, for {quoted(list(found))}: the median over "
        "the materials, and from the least to the most as a band where they differ. "
        + ("The grey line is 12 bytes per control point: three floats. " if floats else "")
        + agreement([row for rows in found.values() for row in rows], table.scenes)
    )

    def draw() -> "Figure":
        figure, (at,) = panels(1, 1, 3.0, width=4.6)
        ends: list[float] = []
        for i, (series, rows) in enumerate(found.items()):
            for quantity, dash, marker in zip(quantities, ("-", "--"), ("o", "s"), strict=True):
                x = sorted({n for n in map(side, rows) if n is not None})
                y = [_spread([r for r in rows if side(r) == n], quantity) for n in x]
                colour = PALETTE[i % len(PALETTE)]
                # The same nets in all series take the same bytes: what lies below is seen beside what lies above.
                thick = max(0.8, 2.2 - 0.9 * i)
                at.fill_between(x, [v[0] for v in y], [v[2] for v in y], color=colour, alpha=0.2, linewidth=0)
                label = pretty(f"{series}, {quantity.label}")
                at.plot(
                    x,
                    [v[1] for v in y],
                    dash,
                    color=colour,
                    marker=marker,
                    linewidth=thick,
                    markersize=3 * thick,
                    label=label,
                )
                ends += [v[0] for v in y] + [v[2] for v in y]
        if floats:
            every = np.array(sorted({n for rows in found.values() for n in map(side, rows) if n is not None}))
            at.plot(every, 48.0 * every**3, color=GREY, linewidth=0.8, zorder=0, label="12 bytes per control point")
        log_axis(at.yaxis, min(ends), max(ends))
        number_sides(at)
        at.set(xlabel="n", ylabel="bytes")
        at.legend(loc="upper left")
        return figure

    return Plot(
        "fig10-bytes", title, words, Numbers(("series", "n", "bytes of", "least", "median", "most"), tuple(lines)), draw
    )


def _spread(rows: Sequence[Row], quantity: Quantity) -> tuple[float, float, float]:
    values = [v for v in (quantity.floored(row) for row in rows) if v is not None]
    return min(values), float(np.median(values)), max(values)
