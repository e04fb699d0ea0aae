"""All figures of a report, in their order."""

import re
from dataclasses import replace

from bvbedit.study.byte_plot import byte_plot
from bvbedit.study.correlations import correlation_plots
from bvbedit.study.frontier_plots import frontier_plots
from bvbedit.study.plots import Missing, Plot
from bvbedit.study.sweeps import sweep_plots
from bvbedit.study.table import Table


def figures(table: Table) -> list[Plot | Missing]:
    """Return the figures of ``table``: the paper's (5, 6, 7, 10, 8, 9), then frontiers per class and material.

    Their names are fit for files on any system, and no two are the same.
    """
    found: list[Plot | Missing] = []
    names: set[str] = set()
    for plot in (*sweep_plots(table), byte_plot(table), *correlation_plots(table), *frontier_plots(table)):
        if isinstance(plot, Plot):
            # Scenes may be files in folders.
            plain = re.sub(r"[^a-z0-9.-]+", "-", plot.name.lower()).strip("-.")
            name = next(n for i in range(len(names) + 1) if (n := plain if i == 0 else f"{plain}-{i + 1}") not in names)
            names.add(name)
            found.append(replace(plot, name=name))
        else:
            found.append(plot)
    return found
