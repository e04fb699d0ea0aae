"""Figures over many materials with one configuration: the paper's Fig. 8 (correlations) and Fig. 9 (sorted by AE)."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from bvbedit.brdf.geometry import Floats
from bvbedit.study.nets import side
from bvbedit.study.plots import Missing, Numbers, Plot, agreement
from bvbedit.study.quantities import E_AVG, E_MAX, R_AVG, R_MAX, Quantity, mae, pae
from bvbedit.study.statistics import FEWEST, pearson
from bvbedit.study.style import PALETTE, legend, log_axis, panels, pretty
from bvbedit.study.table import Row, Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# The paper's n.
REFERENCE_SIDE = 20
# Names along an axis of one panel that can still be read.
MOST_NAMES = 50
# Series fall so far below their maximum that a linear axis would show them at zero.
FLAT = 0.05


def series_of(scene: str) -> dict[str, Quantity]:
    """Return the quantities by their names in the paper's figures."""
    return {"ME": E_MAX, "AE": E_AVG, "MR": R_MAX, "AR": R_AVG, "PAE": pae(scene), "MAE": mae(scene)}


def reference_rows(table: Table, scene: str) -> list[Row]:
    """Return the rows of the one configuration by which materials are compared, in which all six figures are known.

    It is the spline with the most such rows; of these one of n x n x 4n, of these the series "paper", of these the one
    whose n is nearest to 20, and the first.
    """
    quantities = series_of(scene).values()
    rows: dict[str, list[Row]] = {}
    for row in table.done:
        if row.kind == "spline" and all(q.value(row) is not None for q in quantities):
            rows.setdefault(row.configuration, []).append(row)

    def rank(found: Sequence[Row]) -> tuple[int, bool, bool, int]:
        n = side(found[0])
        distance = 0 if n is None else -abs(n - REFERENCE_SIDE)
        return len(found), n is not None, found[0].series == "paper", distance

    return max(rows.values(), key=rank, default=[])


def correlation_plots(table: Table) -> list[Plot | Missing]:
    """Return Fig. 8 and Fig. 9 for each scene of ``table``."""
    plots: list[Plot | Missing] = []
    for scene in table.scenes:
        rows = reference_rows(table, scene)
        titles = (
            f"Correlations, with pictures of “{scene}” (the paper's Fig. 8)",
            f"Materials sorted by AE, with pictures of “{scene}” (the paper's Fig. 9)",
        )
        if len(rows) < FEWEST:
            why = f"fewer than {FEWEST} materials have all six figures with one and the same configuration"
            plots += [Missing(title, why) for title in titles]
            continue
        plots += [_matrix_plot(rows, scene, titles[0]), _sorted_plot(rows, scene, titles[1])]
    if not table.scenes:
        plots.append(Missing("Correlations and sorted materials (the paper's Fig. 8 and 9)", "the study has no scene"))
    return plots


def correlation_matrix(rows: Sequence[Row], quantities: Sequence[Quantity]) -> Floats:
    """Return the linear correlations (k, k) of the quantities over ``rows``, all known; nan where one is constant."""
    values = [[q.value(row) or 0.0 for row in rows] for q in quantities]
    found = [[pearson(a, b) for b in values] for a in values]
    return np.array([[np.nan if r is None else r for r in line] for line in found])


def _matrix_plot(rows: Sequence[Row], scene: str, title: str) -> Plot:
    named = series_of(scene)
    matrix = correlation_matrix(rows, list(named.values()))
    words = (
        f"Linear (Pearson) correlations over {len(rows)} materials with the configuration “{rows[0].configuration}”: "
        "ME and AE are the largest and the mean error, MR and AR the largest and the mean length of the material's own "
        f"RGB vector, PAE and MAE the largest and the mean error of the picture. {agreement(rows, [scene])}"
    )

    def draw() -> "Figure":
        from matplotlib.colors import LinearSegmentedColormap

        figure, (at,) = panels(1, 1, 3.1, width=3.7)
        # Vermilion through white to blue, which no common colour blindness mixes up.
        colours = LinearSegmentedColormap.from_list("correlation", (PALETTE[3], "white", PALETTE[0]))
        # A mesh, not an image: the page and the SVG hold no pixels.
        edges = np.arange(len(named) + 1) - 0.5
        at.grid(False)
        at.pcolormesh(edges, edges, matrix, cmap=colours, vmin=-1, vmax=1, edgecolors="white", linewidth=0.5)
        at.set_aspect("equal")
        at.invert_yaxis()
        at.set_xticks(range(len(named)), list(named))
        at.set_yticks(range(len(named)), list(named))
        at.tick_params(length=0)
        for i, line in enumerate(matrix):
            for j, r in enumerate(line):
                colour = "white" if abs(r) > 0.75 else "black"
                text = "–" if np.isnan(r) else f"{r:.2f}".replace("-", "−")
                at.text(j, i, text, ha="center", va="center", color=colour, fontsize=8)
        return figure

    lines = [
        (name, *(None if np.isnan(r) else float(r) for r in line)) for name, line in zip(named, matrix, strict=True)
    ]
    return Plot(f"fig8-correlations-{scene}", title, words, Numbers(("", *named), tuple(lines)), draw)


def _sorted_plot(rows: Sequence[Row], scene: str, title: str) -> Plot:
    named = series_of(scene)
    ordered = sorted(rows, key=lambda row: (E_AVG.value(row) or 0.0, row.material))
    largest = {name: max(q.value(row) or 0.0 for row in rows) for name, q in named.items()}
    shares = {n: [(q.value(row) or 0.0) / (largest[n] or 1.0) for row in ordered] for n, q in named.items()}
    logarithmic = any(np.median(v) < FLAT for v in shares.values())
    words = (
        f"{len(rows)} materials with the configuration “{rows[0].configuration}”, sorted by AE; each series is divided "
        f"by its maximum. {'Shares of zero are not drawn. ' if logarithmic else ''}{agreement(rows, [scene])}"
    )

    def draw() -> "Figure":
        from matplotlib.lines import Line2D

        parts = np.array_split(np.arange(len(ordered)), -(-len(ordered) // MOST_NAMES))
        figure, axes = panels(len(parts), 1, 3.0, share=False)
        marks = ("o", "s", "^", "v", "D", "P")
        positive = [v for values in shares.values() for v in values if v > 0]
        for at, part in zip(axes, parts, strict=True):
            for name, colour, mark in zip(named, PALETTE, marks, strict=False):
                thick = 1.8 if name == "AE" else 0.8
                at.plot(
                    part, [shares[name][i] for i in part], color=colour, marker=mark, markersize=2.6, linewidth=thick
                )
            _names(at, [ordered[i].material for i in part], part)
            if logarithmic and positive:
                log_axis(at.yaxis, min(positive), 1.0)
                at.set_ylim(min(positive) * 0.7, 1.4)
            else:
                at.set_ylim(0, 1.05)
            at.set_ylabel("share of the maximum")
        handles: list[Any] = [
            Line2D([], [], color=c, marker=m, markersize=4, label=pretty(f"{n}, at most {_shown(largest[n], q)}"))
            for (n, q), c, m in zip(named.items(), PALETTE, marks, strict=False)
        ]
        legend(figure, handles, 3)
        return figure

    lines = [(i + 1, row.material, *(q.value(row) for q in named.values())) for i, row in enumerate(ordered)]
    header = ("rank", "material", *(f"{name} ({q.unit})" for name, q in named.items()))
    return Plot(f"fig9-sorted-{scene}", title, words, Numbers(header, tuple(lines)), draw)


def _shown(value: float, quantity: Quantity) -> str:
    text = f"{value:,.0f}" if value >= 1000 else f"{value:.3g}"
    return text if quantity.unit.startswith("share") else f"{text} {quantity.unit}"


def _names(at: "Axes", names: Sequence[str], places: Any) -> None:
    at.set_xticks(places, [pretty(name) for name in names], rotation=90 if len(names) > 8 else 20, fontsize=6)
    if len(names) <= 8:
        for label in at.get_xticklabels():
            label.set(ha="right", rotation_mode="anchor")
    at.set_xlim(places[0] - 0.6, places[-1] + 0.6)
