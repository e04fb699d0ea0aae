"""What fits reach for their bytes: python -m tests.benchmarks.accuracy [FILE ...] [--plots DIR].

For given measurements or, without any, the generated ones: the automatic fit at 48 KiB, 375 KiB (thorough), a payload
of 2,700 bytes, and at the knee, beside the paper's configuration (in-out, linear, piegl-tiller, 20 x 20 x 80, float32:
375 KiB before deflation), the floor (the raw data against itself averaged over mirror pairs) and, where published
weights exist, Neural-BRDF (Sztrajman et al. 2021, 675 float32 weights). Then what each way of storing brings at 48 KiB,
and with --plots the error over the bytes for averaged, dominant and free knots. Errors are log_cosine_rms over 200,000
pairs of each sample set, of the file as it is read back.
"""

import sys
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

import bvbedit
from bvbedit.brdf.base import Brdf
from bvbedit.brdf.geometry import Bools, Floats
from bvbedit.brdf.goniophotometer import measure
from bvbedit.brdf.materials import MATERIALS
from bvbedit.brdf.metrics import estimate
from bvbedit.brdf.problem import MIRROR
from bvbedit.io.bvb import dumps, loads

KIB = 1024
PAPER: dict[str, Any] = {
    "chart": "in-out",
    "encoding": "linear",
    "size": (20, 20, 80),
    "knots": "piegl-tiller",
    "precision": "float32",
}
BUDGETS: dict[str, dict[str, Any]] = {
    "48 KiB": {"max_bytes": 48 * KIB},
    "375 KiB": {"max_bytes": 375 * KIB, "thorough": True},
    "payload 2,700": {"max_payload": 2700},
    "payload 2,700, float16": {"max_payload": 2700, "precision": "float16"},
    "the knee": {},
}
# log_cosine_rms of Neural-BRDF's published weights on `grid` and `nodes`.
NEURAL = {
    "cc_ibiza_sunset_rgb": (0.0114, 0.0425),
    "satin_rosaline_rgb": (0.0159, 0.0673),
    "paper_white_rgb": (0.0020, 0.0021),
}
PAIRS = 200_000
CURVE = (3, 6, 12, 24, 48, 96, 192)
LINES = {"averaged": "#999999", "dominant": "#0072b2", "free": "#d55e00"}


class Mirrored(Brdf):
    """The mean of a BRDF and its mirror image, in the logarithm in which tables are interpolated."""

    reciprocal = True

    def __init__(self, brdf: Brdf) -> None:
        self.brdf = brdf

    def _evaluate(self, wi: Floats, wo: Floats) -> tuple[Floats, Bools]:
        logs = [np.log1p(1000 * self.brdf.evaluate_unit(i, o)[0]) for i, o in ((wi, wo), (wi * MIRROR, wo * MIRROR))]
        return np.expm1(np.mean(logs, axis=0)) / 1000, np.ones(len(wi), bool)


def errors(model: Brdf, truth: Brdf) -> np.ndarray:
    """Return log_cosine_rms on grid and nodes."""
    found = estimate(model, truth, PAIRS, seed=11)
    return np.array([found.grid.log_cosine_rms, found.nodes.log_cosine_rms])


def fitted(brdf: Brdf, options: dict[str, Any]) -> tuple[Any, int, float]:
    """Return the model as read back from its file, the bytes of that, and seconds."""
    start = perf_counter()
    model = bvbedit.fit(brdf, **options)
    seconds = perf_counter() - start
    content = dumps(model)
    return loads(content), len(content), seconds


def budgets(sources: dict[str, Brdf]) -> tuple[Table, Table]:
    """Return the table of all fits, and that of their summary."""
    columns = ("chart", "size", "file", "payload", "grid", "nodes", "x paper", "x neural", "mean", "s")
    table = Table("material", "fit", *columns)
    means: dict[str, list[float]] = {label: [] for label in BUDGETS}
    worst: dict[str, list[float]] = {label: [] for label in BUDGETS}
    neural: dict[str, list[float]] = {label: [] for label in BUDGETS}
    for name, brdf in sources.items():
        paper, size, seconds = fitted(brdf, PAPER)
        base = errors(paper, brdf)
        floor = errors(Mirrored(brdf), brdf)
        for label, e in (("the paper", base), ("floor of mirror pairs", floor)):
            row = ["in-out", "20 x 20 x 80", f"{size:,}"] if e is base else ["", "", ""]
            ratio = f"{e[0] / base[0]:.3f} {e[1] / base[1]:.3f}"
            time = f"{seconds:.1f}" if e is base else ""
            table.add_row(name, label, *row, "", f"{e[0]:.6f}", f"{e[1]:.6f}", ratio, "", "", time)
        for label, options in BUDGETS.items():
            model, count, seconds = fitted(brdf, options)
            e = errors(model, brdf)
            r = e / base
            means[label].append(float(np.sqrt(r.prod())))
            worst[label].append(float(r.max()))
            text = ""
            if name in NEURAL:
                n = e / np.array(NEURAL[name])
                neural[label] += n.tolist()
                text = f"{n[0]:.3f} {n[1]:.3f}"
            table.add_row(
                name,
                label,
                f"{model.chart.name} {model.encoding.name}",
                " x ".join(map(str, model.spline.size)),
                f"{count:,}",
                f"{model.storage.payload_bytes(model.spline.control, model.spline.degrees):,}",
                f"{e[0]:.6f}",
                f"{e[1]:.6f}",
                f"{r[0]:.3f} {r[1]:.3f}",
                text,
                f"{means[label][-1]:.3f}",
                f"{seconds:.1f}",
            )
        table.add_section()
    summary = Table("x paper", "largest ratio", "largest mean", "median mean", "x neural: largest", "median")
    for label in BUDGETS:
        n = neural[label]
        summary.add_row(
            label,
            f"{max(worst[label]):.3f}",
            f"{max(means[label]):.3f}",
            f"{median(means[label]):.3f}",
            f"{max(n):.3f}" if n else "",
            f"{median(n):.3f}" if n else "",
        )
    return table, summary


def storage(sources: dict[str, Brdf]) -> Table:
    """Return what each way of storing brings at 48 KiB."""
    ways = ("float32", "float16", "quantised")
    table = Table("48 KiB: geometric mean of grid and nodes", *ways)
    for name, brdf in sources.items():
        row = []
        for precision in ways:
            model, _, _ = fitted(brdf, {"max_bytes": 48 * KIB, "precision": precision})
            points = int(np.prod(model.spline.size))
            row.append(f"{np.sqrt(errors(model, brdf).prod()):.6f} ({points:,} points)")
        table.add_row(name, *row)
    return table


def plot(name: str, brdf: Brdf, folder: Path) -> None:
    """Write the error over the bytes, for both sets, to ``folder``/NAME.png."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, panels = pyplot.subplots(1, 2, figsize=(11, 4.5), layout="constrained", sharey=True)
    model, size, _ = fitted(brdf, PAPER)
    base = errors(model, brdf)
    for panel, label, e in zip(panels, ("grid", "nodes"), base, strict=True):
        panel.plot([size / KIB], [e], "k*", markersize=13, label="the paper, 20 x 20 x 80")
        panel.set(title=f"{name}: {label}", xlabel="file, KiB", ylabel="log cosine RMS", xscale="log", yscale="log")
        panel.grid(True, which="both", color="0.92")
    for knots, colour in LINES.items():
        points = []
        for budget in CURVE:
            model, size, _ = fitted(brdf, {"max_bytes": budget * KIB, "knots": knots})
            points.append((size / KIB, *errors(model, brdf)))
        found = np.array(points)
        for i, panel in enumerate(panels):
            panel.plot(found[:, 0], found[:, i + 1], "o-", color=colour, label=f"{knots} knots")
    panels[0].legend(frameon=False)
    figure.savefig(folder / f"{name}.png", dpi=100)
    pyplot.close(figure)


def main() -> None:
    arguments = sys.argv[1:]
    folder = None
    if "--plots" in arguments:
        i = arguments.index("--plots")
        folder = Path(arguments[i + 1])
        folder.mkdir(parents=True, exist_ok=True)
        del arguments[i : i + 2]
    paths = [Path(a) for a in arguments]
    sources: dict[str, Brdf] = {p.stem: bvbedit.load(p) for p in paths}
    sources = sources or {n: measure(m.brdf, "merl") for n, m in MATERIALS.items()}
    console = Console(width=170)
    for table in (*budgets(sources), storage(sources)):
        console.print(table)
    if folder is not None:
        for name, brdf in sources.items():
            plot(name, brdf, folder)
            console.print(folder / f"{name}.png")


if __name__ == "__main__":
    main()
