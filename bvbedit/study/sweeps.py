"""Figures of errors over n, for nets of n x n x 4n control points: the paper's Fig. 5, 6 and 7."""

from collections.abc import Sequence, Set
from typing import TYPE_CHECKING, Any

import numpy as np

from bvbedit.study.classes import groups
from bvbedit.study.nets import Sweep, known, number_sides, quoted, side, sweeps
from bvbedit.study.plots import Missing, Numbers, Plot, agreement
from bvbedit.study.quantities import E_AVG, E_AVG_45, E_MAX, E_MAX_45, Quantity, mae, pae
from bvbedit.study.statistics import median
from bvbedit.study.style import GREY, PALETTE, legend, log_axis, looks, panels, pretty
from bvbedit.study.table import Row, Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# So many materials have a colour each; more are told apart by class.
MOST_COLOURS = 7
LINES = ("-", "--", ":", "-.")


def sweep_plots(table: Table) -> list[Plot | Missing]:
    """Return the figures of errors over n."""
    wanted: list[tuple[str, str, tuple[Quantity, ...], str]] = [
        (
            "fig5-errors-45",
            "Errors at θ_i = 45° over n (the paper's Fig. 5)",
            (E_MAX_45, E_AVG_45),
            "Largest and mean length of the RGB error over the nodes with θ_i = 45°",
        ),
        (
            "fig6-errors",
            "Errors over all angles over n (the paper's Fig. 6)",
            (E_MAX, E_AVG),
            "Largest and mean length of the RGB error over all nodes",
        ),
        *(
            (
                f"fig7-image-errors-{scene}",
                f"Errors of the picture “{scene}” over n (the paper's Fig. 7)",
                (mae(scene), pae(scene)),
                "Mean and largest error of the tone-mapped picture against that of the measurement",
            )
            for scene in table.scenes
        ),
    ]
    found = sweeps(table)
    plots: list[Plot | Missing] = []
    for name, title, quantities, words in wanted:
        kept = known(found, quantities)
        if not kept:
            plots.append(Missing(title, "no series has nets of n x n x 4n control points at two n with these errors"))
            continue
        plots.append(_error_plot(table, kept, name, title, quantities, words))
    return plots


def _error_plot(
    table: Table, found: Sweep, name: str, title: str, quantities: tuple[Quantity, ...], words: str
) -> Plot:
    every = [row for rows in found.values() for row in rows]
    materials = [m for m in table.materials if any(row.material == m for row in every)]
    few = len(materials) <= MOST_COLOURS
    series = list(found)
    shared = set.intersection(*({side(row) for row in rows} for rows in found.values()))
    rose = (
        "What grows from one n to the next larger one that all these series have: "
        + "; ".join(f"{pretty_words(q.label)} in {_rises(found, q, shared)}" for q in quantities)
        if len(shared) > 1
        else "These series share no two n, so that how often they grow is not compared"
    )
    said = (
        f"{words}, for nets of n x n x 4n control points; {quoted(series)}. "
        + ("A colour for each material. " if few else "A thin line for each material, the median bold. ")
        + f"{rose}. "
        + agreement(every, table.scenes)
    )

    def draw() -> "Figure":
        if few:
            return _by_material(found, materials, quantities)
        return _by_class(table, found, materials, quantities)

    return Plot(name, title, said, _pivot(found, materials, quantities), draw)


def pretty_words(label: str) -> str:
    """Return a label as a sentence has it: without the scene."""
    return label.split(",")[0]


def _line(rows: Sequence[Row], quantity: Quantity) -> tuple[list[int], list[float]]:
    """Return n and the quantity along one material's rows, n rising; of configurations with the same n the first."""
    values: dict[int, float] = {}
    for row in rows:
        n, value = side(row), quantity.floored(row)
        if n is not None and value is not None:
            values.setdefault(n, value)
    return sorted(values), [values[n] for n in sorted(values)]


def _rises(found: Sweep, quantity: Quantity, shared: Set[int | None]) -> str:
    """Return in words in how many steps to a larger n the quantity grows, and by what: the paper saw errors fluctuate.

    Only ``shared`` n count, so that the steps of all series are alike.
    """
    told = []
    for series, rows in found.items():
        steps: list[float] = []
        for material in dict.fromkeys(row.material for row in rows):
            own = [row for row in rows if row.material == material and side(row) in shared]
            values = np.asarray(_line(own, quantity)[1])
            with np.errstate(divide="ignore", invalid="ignore"):
                steps += (values[1:] / values[:-1]).tolist()
        grown = [factor for factor in steps if factor > 1]
        by = f" (the median by {_percent(median(grown))}, the largest by {_percent(max(grown))})" if grown else ""
        told.append(f"{len(grown)} of {len(steps)} steps of “{series}”{by}")
    return " and ".join(told)


def _percent(factor: float) -> str:
    percent = 100 * (factor - 1)
    return f"{percent:,.0f} %" if percent >= 10 else f"{percent:.2g} %"


def _by_material(found: Sweep, materials: Sequence[str], quantities: Sequence[Quantity]) -> "Figure":
    from matplotlib.lines import Line2D

    figure, axes = panels(len(quantities), 2, 2.7, share=False)
    chosen = looks(materials)
    for at, quantity in zip(axes, quantities, strict=True):
        ends: list[float] = []
        for dash, rows in zip(_dashes(found), found.values(), strict=True):
            for material in materials:
                x, y = _line([r for r in rows if r.material == material], quantity)
                colour, marker = chosen[material]
                at.plot(x, y, dash, color=colour, marker=marker, markersize=3)
                ends += [v for v in y if v > 0]
        _finish(at, quantity, ends, bottom=True)
    handles = [Line2D([], [], color=c, marker=m, markersize=4, label=pretty(n)) for n, (c, m) in chosen.items()]
    if len(found) > 1:
        handles += [
            Line2D([], [], color=GREY, linestyle=d, label=pretty(s)) for d, s in zip(_dashes(found), found, strict=True)
        ]
    legend(figure, handles, 4)
    return figure


def _by_class(table: Table, found: Sweep, materials: Sequence[str], quantities: Sequence[Quantity]) -> "Figure":
    from matplotlib.lines import Line2D

    shown = {label: [m for m in names if m in materials] for label, names in groups(table).items()}
    shown = {label: names for label, names in shown.items() if names}
    figure, axes = panels(len(quantities) * len(shown), len(shown), 2.2, share=False)
    colours = {series: PALETTE[i % len(PALETTE)] for i, series in enumerate(found)}
    for row, quantity in enumerate(quantities):
        line = axes[row * len(shown) : (row + 1) * len(shown)]
        ends: list[float] = []
        for at, (label, names) in zip(line, shown.items(), strict=True):
            for series, rows in found.items():
                gathered: dict[int, list[float]] = {}
                for material in names:
                    x, y = _line([r for r in rows if r.material == material], quantity)
                    at.plot(x, y, color=colours[series], linewidth=0.4, alpha=0.4)
                    for n, value in zip(x, y, strict=True):
                        gathered.setdefault(n, []).append(value)
                    ends += [v for v in y if v > 0]
                x = sorted(gathered)
                middle = [float(np.median(gathered[n])) for n in x]
                # White below: a median is to be seen over a hundred lines of its own colour.
                at.plot(x, middle, color="white", linewidth=3.4)
                at.plot(
                    x,
                    middle,
                    color=colours[series],
                    linewidth=2.0,
                    marker="o",
                    markersize=3.5,
                    markeredgecolor="white",
                    markeredgewidth=0.5,
                )
            if row == 0:
                at.set_title(f"{label} ({len(names)})")
        for i, at in enumerate(line):
            _finish(at, quantity, ends, bottom=row == len(quantities) - 1, left=i == 0)
            if ends:
                at.set_ylim(min(ends) / 1.3, max(ends) * 1.3)
    handles: list[Any] = [
        Line2D([], [], color=c, linewidth=2, label=pretty(f"{s}, median")) for s, c in colours.items()
    ]
    legend(figure, [*handles, Line2D([], [], color=GREY, linewidth=0.5, label="one material")], 4)
    return figure


def _dashes(found: Sweep) -> list[Any]:
    return [LINES[i % len(LINES)] for i in range(len(found))]


def _finish(at: "Axes", quantity: Quantity, ends: Sequence[float], *, bottom: bool, left: bool = True) -> None:
    if ends:
        log_axis(at.yaxis, min(ends), max(ends))
    number_sides(at)
    if bottom:
        at.set_xlabel("n")
    if left:
        at.set_ylabel(pretty(quantity.axis))
    else:
        at.tick_params(axis="y", which="both", labelleft=False)


def _pivot(found: Sweep, materials: Sequence[str], quantities: Sequence[Quantity]) -> Numbers:
    every = sorted({n for rows in found.values() for n in map(side, rows) if n is not None})
    lines: list[tuple[str | float | None, ...]] = []
    for series, rows in found.items():
        for material in materials:
            own = {side(r): r for r in reversed(rows) if r.material == material}
            for quantity in quantities:
                if own:
                    values = (quantity.value(own[n]) if n in own else None for n in every)
                    lines.append((series, material, quantity.axis, *values))
    return Numbers(("series", "material", "quantity", *(f"n = {n}" for n in every)), tuple(lines))
