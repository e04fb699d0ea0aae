"""Tables of reflectance on a chart as .npz: values (n_0, n_1, n_2, 3), valid, axis_0 ... axis_2, chart."""

import os

import numpy as np

from bvbedit.brdf.charts import chart_named
from bvbedit.brdf.measured import MeasuredBrdf
from bvbedit.errors import BvbError
from bvbedit.io.archive import Archive, write_archive
from bvbedit.io.files import reading, replacing

# In numbers, which take 8 bytes in memory however small they are stored. The paper's grid has 9 million values.
MOST_VALUES = 1 << 25
MOST_NODES = 1 << 17


def save_table(table: MeasuredBrdf, path: str | os.PathLike[str]) -> None:
    """Write ``table`` to ``path``, exactly.

    Raises BvbError for more values or nodes than ``load_table`` would take, and where the file cannot be written.
    """
    longest = max(len(nodes) for nodes in table.axes)
    if table.values.size > MOST_VALUES or longest > MOST_NODES:
        raise BvbError(
            f"{path}: {table.values.size:,} values and {longest:,} nodes on an axis are too much for a file. "
            f"Keep within {MOST_VALUES:,} and {MOST_NODES:,}."
        )
    arrays = {"chart": np.array(table.chart.name), "valid": table.valid, "values": table.values}
    arrays |= {f"axis_{a}": nodes for a, nodes in enumerate(table.axes)}
    with replacing(path) as stream:
        # Noise does not compress: a higher level costs seconds and saves a few percent.
        write_archive(stream, arrays, {}, level=1)


def load_table(path: str | os.PathLike[str]) -> MeasuredBrdf:
    """Return the table in the file ``path``. Raises BvbError for anything that is not a sound table."""
    with reading(path) as stream:
        archive = Archive(stream, str(path))
        axes = tuple(archive.array(f"axis_{a}", ("float64", "float32"), 1, MOST_NODES) for a in range(3))
        lengths = tuple(f"U{n}" for n in range(1, 65))
        chart = str(archive.array("chart", lengths, 0, 1))
        valid = archive.array("valid", ("bool",), 3, MOST_VALUES // 3)
        values = archive.array("values", ("float64", "float32"), 4, MOST_VALUES)
    try:
        return MeasuredBrdf(values, valid, axes, chart_named(chart))
    except BvbError as error:
        raise BvbError(f"{path} is not a sound table: {error}") from None
