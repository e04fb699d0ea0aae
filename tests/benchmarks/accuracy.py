"""What each configuration reaches, in bytes, seconds and errors: python -m tests.benchmarks.accuracy [FILE ...].

The paper's configuration against ``half-diff`` with ``log`` and ``root`` at 48 KiB, for given measurements or, without
any, the generated ones. Errors over all nodes of the metrics' sample sets; times are medians of three fits.
"""

import sys
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any

from rich.console import Console
from rich.table import Table

import bvbedit
from bvbedit.brdf.goniophotometer import measure
from bvbedit.brdf.materials import MATERIALS
from bvbedit.io.bvb import dumps

CONFIGURATIONS: dict[str, dict[str, Any]] = {
    "paper": {"chart": "in-out", "encoding": "linear", "size": (20, 20, 80), "knots": "piegl-tiller"},
    "half-diff log": {"chart": "half-diff", "encoding": "log", "max_bytes": 48 * 1024},
    "half-diff root": {"chart": "half-diff", "encoding": "root", "max_bytes": 48 * 1024},
}
ROUNDS = 3


def main() -> None:
    paths = [Path(a) for a in sys.argv[1:]]
    sources = {p.stem: bvbedit.load(p) for p in paths} or {n: measure(m.brdf, "merl") for n, m in MATERIALS.items()}
    table = Table("material", "configuration", "rms grid", "rms nodes", "rel. L1", "E_avg", "E_max", "bytes", "fit s")
    for name, brdf in sources.items():
        for label, options in CONFIGURATIONS.items():
            times = []
            for _ in range(ROUNDS):
                start = perf_counter()
                model = bvbedit.fit(brdf, **options)
                times.append(perf_counter() - start)
            found = bvbedit.compare(model, brdf)
            errors = (found.grid.log_cosine_rms, found.nodes.log_cosine_rms, found.grid.relative_l1)
            paper = (found.paper.e_avg, found.paper.e_max)
            figures = [*(f"{e:.5f}" for e in errors), *(f"{e:.4g}" for e in paper), f"{len(dumps(model)):,}"]
            table.add_row(name, label, *figures, f"{median(times):.2f}")
        table.add_section()
    Console(width=140).print(table)


if __name__ == "__main__":
    main()
