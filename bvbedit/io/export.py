"""Any BRDF as a table that other tools read, and what is lost by that."""

import os

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.charts import HALF_DIFF, Rusinkiewicz
from bvbedit.brdf.goniophotometer import measure
from bvbedit.brdf.measured import MeasuredBrdf
from bvbedit.brdf.metrics import Comparison, estimate
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.io import save
from bvbedit.io.files import as_path, check_target

TABLES = (".binary", ".npz")


def export(brdf: Brdf, path: str | os.PathLike[str]) -> tuple[MeasuredBrdf, Comparison]:
    """Write ``brdf`` as a MERL table (.binary) or a table on its own chart (.npz), and return it and what it misses.

    The comparison is of the table, read between its nodes as this package does, to ``brdf``: zero where a measurement
    is written on its own nodes. Raises BvbError for another suffix, and where the file cannot be written.
    """
    check_target(path, TABLES)
    merl = as_path(path).suffix.lower() == ".binary"
    if isinstance(brdf, MeasuredBrdf) and (not merl or isinstance(brdf.chart, Rusinkiewicz)):
        table = brdf
    elif merl:
        table = measure(brdf, "merl")
    else:
        folded = isinstance(brdf, SplineBrdf) and brdf.chart is HALF_DIFF
        table = measure(brdf, "half-diff" if folded else "paper")
    save(table, path)
    return table, estimate(table, brdf)
