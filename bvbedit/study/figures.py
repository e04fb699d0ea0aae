"""All figures of a report, in their order."""

from bvbedit.study.correlations import correlation_plots
from bvbedit.study.frontier_plots import frontier_plots
from bvbedit.study.plots import Missing, Plot
from bvbedit.study.sweeps import sweep_plots
from bvbedit.study.table import Table


def figures(table: Table) -> list[Plot | Missing]:
    """Return the figures of ``table``: the paper's (5, 6, 7, 10, 8, 9), then frontiers per class and material."""
    return [*sweep_plots(table), *correlation_plots(table), *frontier_plots(table)]
