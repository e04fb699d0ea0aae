"""Where knots go, and features against noise: python -m tests.benchmarks.dominant [FILE ...].

First, for given measurements or the generated ones: the error that an axis' splines leave of its lines, over dominant
points and free knots, relative to that over Piegl & Tiller's knots (9.68/9.69) and averaged ones, at equal numbers of
control points; for tables with equal weights and with those of the metric. Then the same for other values of the
parameters that Park & Lee (2007) do not publish. Last, simulated measurements of known materials (5 % multiplicative
noise and a floor): how far fits are from the material, relative to the measurement.
"""

import sys
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

import bvbedit
from bvbedit.brdf.base import Brdf
from bvbedit.brdf.charts import HALF_DIFF, IN_OUT, Chart
from bvbedit.brdf.encodings import Root
from bvbedit.brdf.fit import fit_net
from bvbedit.brdf.goniophotometer import measure
from bvbedit.brdf.losses import loss_named
from bvbedit.brdf.materials import MATERIALS
from bvbedit.brdf.measured import hold
from bvbedit.brdf.metrics import estimate
from bvbedit.brdf.plan import try_charts
from bvbedit.brdf.problem import pose, tabulate
from bvbedit.spline import adaptive
from bvbedit.spline.adaptive import AxisLines, axis_lines, dominant_knots
from bvbedit.spline.free_knots import move_knots
from bvbedit.spline.knots import place_knots

SIZES = range(10, 41, 5)
LOSS = loss_named("log_cosine_rms")
NOISE = 0.05
NETS = ((12, 8, 4), (20, 14, 5), (30, 20, 8), (45, 40, 14))
PARAMETERS: list[dict[str, Any]] = [
    {"MIX": 0.5, "CANDIDATES": 3},
    {"MIX": 0.0, "CANDIDATES": 3},
    {"MIX": 0.3, "CANDIDATES": 3},
    {"MIX": 0.7, "CANDIDATES": 3},
    {"MIX": 0.9, "CANDIDATES": 3},
    {"MIX": 0.5, "CANDIDATES": 1},
    {"MIX": 0.5, "CANDIDATES": 6},
]


def lines_of(brdf: Brdf, chart: Chart, weighted: bool) -> tuple[AxisLines, ...]:
    """Return the lines of a material in a chart, cube roots, with the metric's weights or equal ones."""
    table = tabulate(brdf, chart)
    if weighted:
        (trial,) = try_charts(brdf, [chart], [Root()], LOSS, degrees=(3, 3, 3), points=8000)
        problem = pose(table, Root(), LOSS, trial.balance)
        return axis_lines(problem.values, problem.weights, table.axes)
    known = np.any(np.stack(table.trusted), axis=0)
    values = hold(np.mean([Root().encode(s) for s in table.sides], axis=0), known, chart.hold_order)
    return axis_lines(values, np.ones(known.shape), table.axes)


def ratios(lines: AxisLines, free: bool = True) -> dict[str, list[float]]:
    """Return the errors over dominant points (and free knots), relative to those of knots placed without a look."""
    path = dominant_knots(lines, 3, max(SIZES))
    out: dict[str, list[float]] = {}
    for n in SIZES:
        if n > path.most:
            continue
        ours = {"dominant": path.error_of(n)}
        if free:
            ours["free"] = move_knots(lines, path.of(n), 3).error
        for placement in ("piegl-tiller", "averaged"):
            theirs = lines.error(place_knots(placement, lines.parameters, n, 3), 3)
            for name, error in ours.items():
                out.setdefault(f"{name} / {placement}", []).append(float(np.sqrt(error / theirs)))
    return out


def placement(cases: dict[tuple[str, str, str], tuple[AxisLines, ...]]) -> Table:
    columns = [f"{ours} / {theirs}" for ours in ("dominant", "free") for theirs in ("piegl-tiller", "averaged")]
    table = Table("weights", "chart", "material", *columns)
    medians: dict[tuple[str, str], dict[str, list[float]]] = {}
    for (weights, chart, name), lines in cases.items():
        found = [ratios(x) for x in lines]
        merged = {c: [r for f in found for r in f.get(c, [])] for c in columns}
        table.add_row(weights, chart, name, *(f"{np.median(merged[c]):.3f}" for c in columns))
        for c in columns:
            medians.setdefault((weights, chart), {}).setdefault(c, []).extend(merged[c])
    table.add_section()
    for (weights, chart), all_of in medians.items():
        table.add_row(weights, chart, "median of all", *(f"{np.median(all_of[c]):.3f}" for c in columns))
    return table


def parameters(cases: dict[tuple[str, str, str], tuple[AxisLines, ...]]) -> Table:
    table = Table("MIX", "CANDIDATES", "dominant / piegl-tiller: median", "geometric mean", "s for three axes")
    for values in PARAMETERS:
        for name, value in values.items():
            setattr(adaptive, name, value)
        found, seconds = [], 0.0
        for lines in cases.values():
            start = perf_counter()
            found += [r for x in lines for r in ratios(x, free=False)["dominant / piegl-tiller"]]
            seconds += perf_counter() - start
        row = (f"{np.median(found):.4f}", f"{np.exp(np.mean(np.log(found))):.4f}", f"{seconds / len(cases):.3f}")
        table.add_row(*(str(v) for v in values.values()), *row)
    for name, value in PARAMETERS[0].items():
        setattr(adaptive, name, value)
    return table


def noise() -> Table:
    """Return how far fits of noisy measurements are from the material, relative to the measurement."""
    labels = [" x ".join(map(str, net)) for net in NETS]
    table = Table("material", "knots", "measurement, grid / nodes", *labels, "48 KiB", "the knee")
    for name, material in MATERIALS.items():
        measured = measure(material.brdf, "merl", noise=NOISE, seed=1)
        own = estimate(measured, material.brdf)

        def relative(model: Brdf, truth: Brdf = material.brdf, own: Any = own) -> str:
            found = estimate(model, truth)
            pairs = ((found.grid, own.grid), (found.nodes, own.nodes))
            return " / ".join(f"{a.log_cosine_rms / b.log_cosine_rms:.3f}" for a, b in pairs)

        for knots in ("dominant", "averaged"):
            nets = [relative(fit_net(measured, HALF_DIFF, Root(), size=net, knots=knots)) for net in NETS]
            automatic = []
            for options in ({"max_bytes": 48 * 1024}, {}):
                automatic.append(relative(bvbedit.fit(measured, knots=knots, **options)))
            level = f"{own.grid.log_cosine_rms:.5f} / {own.nodes.log_cosine_rms:.5f}"
            table.add_row(name, knots, level, *nets, *automatic)
        table.add_section()
    return table


def main() -> None:
    paths = [Path(a) for a in sys.argv[1:]]
    sources: dict[str, Brdf] = {p.stem: bvbedit.load(p) for p in paths}
    sources = sources or {n: measure(m.brdf, "merl") for n, m in MATERIALS.items()}
    cases = {
        (weights, chart.name, name): lines_of(brdf, chart, weights == "metric")
        for weights in ("equal", "metric")
        for chart in (HALF_DIFF, IN_OUT)
        for name, brdf in sources.items()
    }
    console = Console(width=170)
    console.print(placement(cases))
    console.print(parameters(cases))
    console.print(noise())


if __name__ == "__main__":
    main()
