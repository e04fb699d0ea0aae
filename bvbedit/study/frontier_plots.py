"""Figures of frontiers: for each trade one with a panel per class, and more with a panel per material."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from bvbedit.study.classes import groups
from bvbedit.study.plots import Missing, Numbers, Plot, agreement
from bvbedit.study.style import GREY, legend, log_axis, looks, panels, pretty
from bvbedit.study.table import Table
from bvbedit.study.trades import Cloud, Trade, cloud_of_class, cloud_of_material, trades

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Panels beside one another, and on one page.
ACROSS, ON_A_PAGE = 4, 20
LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
Looks = dict[str, tuple[str, str]]


def class_clouds(table: Table) -> list[tuple[Trade, Cloud]]:
    """Return what can be had in each trade for each class of materials."""
    return [
        (trade, cloud_of_class(table, f"{label} ({len(names)})", names, trade))
        for trade in trades(table)
        for label, names in groups(table).items()
    ]


def frontier_plots(table: Table) -> list[Plot | Missing]:
    """Return the figures of frontiers: first all per class, then all per material."""
    per_class = class_clouds(table)
    materials = [name for names in groups(table).values() for name in names]
    first: list[Plot | Missing] = []
    then: list[Plot | Missing] = []
    for trade in trades(table):
        of_classes = [found for t, found in per_class if t is trade or t.name == trade.name]
        of_classes = [found for found in of_classes if found.points]
        title = f"Frontier per class: {trade.title}"
        if not of_classes:
            first.append(Missing(title, "no cell knows both"))
            continue
        first.append(_plot(table, trade, f"frontier-{trade.name}", title, of_classes, _class_words(of_classes)))
        clouds = [c for c in (cloud_of_material(table, name, trade) for name in materials) if c.points]
        pages = [clouds[i : i + ON_A_PAGE] for i in range(0, len(clouds), ON_A_PAGE)]
        for n, page in enumerate(pages, 1):
            part = f", {n} of {len(pages)}" if len(pages) > 1 else ""
            name = f"materials-{trade.name}" + (f"-{n}" if len(pages) > 1 else "")
            words = "The same for each material by itself, sorted by class and the width of the highlight."
            then.append(_plot(table, trade, name, f"Frontier per material: {trade.title}{part}", page, words))
    return first + then


def _class_words(clouds: Sequence[Cloud]) -> str:
    dropped = {name: None for found in clouds for name in found.dropped}
    words = (
        "Geometric means over the materials of each class, of the number in brackets. The black line is the frontier "
        "of the splines: no other one is better in both. The star is its knee. Letters are analytic models, which "
        "stand on no frontier."
    )
    if dropped:
        words += (
            f" Left out where they are known for no more than half of the materials of a class: {', '.join(dropped)}."
        )
    return words


def _plot(table: Table, trade: Trade, name: str, title: str, clouds: Sequence[Cloud], words: str) -> Plot:
    knees = [f"{c.label}: {c.knee.configuration}" for c in clouds if c.knee is not None]
    materials = {c.label for c in clouds} & set(table.materials) or set(table.materials)
    rows = [row for row in table.done if row.material in materials]
    said = f"{words} {'Knees: ' + '; '.join(knees) + '. ' if knees else 'No frontier has a knee. '}"
    said += agreement(rows, table.scenes)
    # The same look for the same series in all figures.
    series = looks(list(dict.fromkeys(row.series for row in table.rows if row.kind == "spline")))
    analytic = list(dict.fromkeys(row.configuration for row in table.rows if row.kind == "analytic"))
    letters = {n: LETTERS[i] if i < len(LETTERS) else "*" for i, n in enumerate(analytic)}
    return Plot(name, title, said, _numbers(trade, clouds), lambda: _draw(trade, clouds, series, letters))


def _numbers(trade: Trade, clouds: Sequence[Cloud]) -> Numbers:
    lines = []
    for found in clouds:
        for point in (*found.edge, *(p for p in found.points if p.analytic)):
            what = "knee" if point == found.knee else "analytic" if point.analytic else ""
            lines.append((found.label, point.configuration, point.cost, point.error, what))
    return Numbers(("of", "on the frontier", trade.cost.axis, trade.error.axis, ""), tuple(lines))


def _draw(trade: Trade, clouds: Sequence[Cloud], series: Looks, letters: dict[str, str]) -> "Figure":
    small = len(clouds) > 3
    # Three beside one another leave no gap where four would.
    columns = 3 if not small or (len(clouds) % ACROSS and len(clouds) % 3 == 0) else ACROSS
    columns = min(columns, len(clouds))
    figure, axes = panels(len(clouds), columns, 1.75 if small else 2.9)
    for at, found in zip(axes, clouds, strict=True):
        _panel(at, found, series, letters, small)
    costs = [p.cost for found in clouds for p in found.points]
    errors = [p.error for found in clouds for p in found.points]
    for i, at in enumerate(axes):
        log_axis(at.xaxis, min(costs), max(costs), minor=not small)
        log_axis(at.yaxis, min(errors), max(errors), minor=not small)
        at.tick_params(axis="y", which="both", labelleft=i % columns == 0)
        if i >= len(axes) - columns:
            at.set_xlabel(pretty(trade.cost.axis), fontsize=6.5 if small else 8)
    figure.supylabel(pretty(trade.error.axis), fontsize=8)
    legend(figure, _handles(clouds, series, letters), 4)
    return figure


def _panel(at: "Axes", found: Cloud, series: Looks, letters: dict[str, str], small: bool) -> None:
    size = 2.6 if small else 4.0
    for name, (colour, marker) in series.items():
        own = [p for p in found.points if p.series == name and not p.analytic]
        at.plot(
            [p.cost for p in own],
            [p.error for p in own],
            linestyle="",
            marker=marker,
            color=colour,
            markersize=size,
            markeredgewidth=0,
            alpha=0.9,
        )
    if found.edge:
        at.plot([p.cost for p in found.edge], [p.error for p in found.edge], color="black", linewidth=0.9, zorder=1.5)
    for point in found.points:
        if point.analytic:
            letter = letters[point.configuration]
            at.annotate(letter, (point.cost, point.error), ha="center", va="center", fontsize=5.5 if small else 7)
            # An annotation alone would not widen the axes.
            at.plot(
                [point.cost], [point.error], linestyle="", marker="o", color="#dddddd", markersize=size + 3, zorder=1
            )
    if found.knee is not None:
        star = 8 if small else 12
        at.plot(
            [found.knee.cost],
            [found.knee.error],
            marker="*",
            color="white",
            markersize=star,
            markeredgecolor="black",
            markeredgewidth=0.9,
            zorder=4,
        )
    at.set_title(pretty(found.label), fontsize=7.5 if small else 8.5)


def _handles(clouds: Sequence[Cloud], series: Looks, letters: dict[str, str]) -> list[Any]:
    from matplotlib.lines import Line2D

    shown = {p.series for found in clouds for p in found.points if not p.analytic}
    handles: list[Any] = [
        Line2D([], [], linestyle="", marker=m, color=c, markersize=4.5, markeredgewidth=0, label=pretty(name))
        for name, (c, m) in series.items()
        if name in shown
    ]
    handles.append(Line2D([], [], color="black", linewidth=0.9, label="frontier"))
    if any(found.knee is not None for found in clouds):
        handles.append(
            Line2D([], [], linestyle="", marker="*", color="white", markeredgecolor="black", markersize=9, label="knee")
        )
    seen = {p.configuration for found in clouds for p in found.points if p.analytic}
    handles += [
        Line2D(
            [],
            [],
            linestyle="",
            marker=rf"$\mathrm{{{letter}}}$",
            color=GREY if letter == "*" else "black",
            markersize=5,
            markeredgewidth=0.1,
            label=pretty(name),
        )
        for name, letter in letters.items()
        if name in seen
    ]
    return handles
