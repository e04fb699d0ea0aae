"""What resampling on a fitting chart's grid costs: python -m tests.benchmarks.resampling [FILE ...].

Each measurement (by default the generated ones) is taken to the grid of ``half-diff``, as every fit does, interpolated
from there, and compared with itself. The floor is what folding alone costs: the chart averages mirror images. A
grid of 1 stands for the 91 x 91 x 61 nodes on which the chart fits.
"""

import sys
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

import bvbedit
from bvbedit.brdf.base import Brdf
from bvbedit.brdf.charts import HalfDiff
from bvbedit.brdf.encodings import Log
from bvbedit.brdf.geometry import Bools, Floats
from bvbedit.brdf.goniophotometer import measure
from bvbedit.brdf.losses import loss_named
from bvbedit.brdf.materials import MATERIALS
from bvbedit.brdf.measured import MeasuredBrdf
from bvbedit.brdf.problem import pose, tabulate

DENSITIES = (0.5, 1.0, 2.0)
STRIDE = 3


class Folded(Brdf):
    """The mean of a BRDF over the pairs that half-diff cannot tell apart, in the logarithm that is interpolated."""

    def __init__(self, brdf: Brdf) -> None:
        self.brdf = brdf

    def _evaluate(self, wi: Floats, wo: Floats) -> tuple[Floats, Bools]:
        mirror = np.array([1.0, -1.0, 1.0])
        pairs = [(wi, wo), (wi * mirror, wo * mirror), (wo, wi), (wo * mirror, wi * mirror)]
        logs = [np.log1p(1000 * self.brdf.evaluate_unit(i, o)[0]) for i, o in pairs]
        return np.expm1(np.mean(logs, axis=0)) / 1000, np.ones(len(wi), bool)


def resampled(brdf: Brdf, density: float) -> MeasuredBrdf:
    """Return ``brdf`` as a table on the half-diff grid, with ``density`` nodes for each of the chart's own."""
    chart = HalfDiff()
    u, v, w = (np.linspace(0, 1, round(density * (len(u) - 1)) + 1) for u in chart.fitting_grid)
    table = tabulate(brdf, chart, (u, v, w))
    encoding = Log(1e-3)
    posed = pose(table, encoding, loss_named("log_cosine_rms"), (1.0, 1.0))
    return MeasuredBrdf(encoding.decode(posed.values), np.any(table.trusted, axis=0), table.axes, chart)


def main() -> None:
    paths = [Path(a) for a in sys.argv[1:]]
    sources = {p.stem: bvbedit.load(p) for p in paths} or {n: measure(m.brdf, "merl") for n, m in MATERIALS.items()}
    columns = ["floor", *(f"grid x {d:g}" for d in DENSITIES)]
    table = Table("log_cosine_rms on grid / nodes", *columns)
    for name, brdf in sources.items():
        others = [Folded(brdf), *(resampled(brdf, d) for d in DENSITIES)]
        errors = [bvbedit.compare(other, brdf, stride=STRIDE) for other in others]
        table.add_row(name, *(f"{e.grid.log_cosine_rms:.5f} / {e.nodes.log_cosine_rms:.5f}" for e in errors))
    Console(width=120).print(table)


if __name__ == "__main__":
    main()
