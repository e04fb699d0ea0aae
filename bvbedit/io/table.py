"""Tables of reflectance on a chart as .npz: values (n_0, n_1, n_2, 3), valid, axis_0 ... axis_2, chart."""

import os

import numpy as np

from bvbedit.brdf.charts import chart_named
from bvbedit.brdf.measured import MeasuredBrdf
from bvbedit.errors import BvbError
from bvbedit.io.archive import Archive, write_archive
from bvbedit.io.files import reading, replacing

# The paper's grid in float64 takes 68 MiB.
LARGEST_VALUES = 1 << 28
LARGEST_AXIS = 1 << 20


def save_table(table: MeasuredBrdf, path: str | os.PathLike[str]) -> None:
    """Write ``table`` to ``path``, exactly. Raises BvbError where the file cannot be written."""
    arrays = {"chart": np.array(table.chart.name), "valid": table.valid, "values": table.values}
    arrays |= {f"axis_{a}": nodes for a, nodes in enumerate(table.axes)}
    with replacing(path) as stream:
        # Noise does not compress: a higher level costs seconds and saves a few percent.
        write_archive(stream, arrays, {}, level=1)


def load_table(path: str | os.PathLike[str]) -> MeasuredBrdf:
    """Return the table in the file ``path``. Raises BvbError for anything that is not a sound table."""
    with reading(path) as stream:
        archive = Archive(stream, str(path))
        axes = tuple(archive.array(f"axis_{a}", ("float64", "float32"), 1, LARGEST_AXIS) for a in range(3))
        lengths = tuple(f"U{n}" for n in range(1, 65))
        chart = str(archive.array("chart", lengths, 0, 1024))
        valid = archive.array("valid", ("bool",), 3, LARGEST_VALUES // 24)
        values = archive.array("values", ("float64", "float32"), 4, LARGEST_VALUES)
    try:
        return MeasuredBrdf(values, valid, axes, chart_named(chart))
    except BvbError as error:
        raise BvbError(f"{path} is not a sound table: {error}") from None
