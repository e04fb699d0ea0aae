"""MERL's .binary format (Matusik et al. 2003): three int32, then float64 in planes R, G, B.

Cell theta_h, theta_d, phi_d stands at phi_d + P (theta_d + 90 theta_h), P = 180 or, without reciprocity, 360. Nodes
are the lower bin edges: theta_h = 90 (i/90)^2 degrees, theta_d = j degrees, phi_d = k degrees. Values are multiplied
by 1/1500, 1.15/1500 and 1.66/1500; a raw value below zero marks an invalid cell.
"""

import os

import numpy as np

from bvbedit.brdf.charts import RUSINKIEWICZ, RUSINKIEWICZ_360
from bvbedit.brdf.geometry import Floats
from bvbedit.brdf.measured import MeasuredBrdf
from bvbedit.errors import BvbError
from bvbedit.io.files import reading, replacing

SCALE = np.array([1.0, 1.15, 1.66]) / 1500.0
CHARTS = {(90, 90, 180): RUSINKIEWICZ, (90, 90, 360): RUSINKIEWICZ_360}
HEADER = 12
INVALID = -1.0


def load_merl(path: str | os.PathLike[str]) -> MeasuredBrdf:
    """Return the table in the file ``path``, in 1/sr.

    Raises BvbError for dimensions other than 90 x 90 x 180 and 90 x 90 x 360, a length that does not belong to them,
    nan or infinite values, and files without a valid cell.
    """
    with reading(path) as stream:
        dims = tuple(int(n) for n in np.frombuffer(stream.read(HEADER).ljust(HEADER, b"\0"), "<i4"))
        if dims not in CHARTS:
            raise BvbError(
                f"{path} claims {' x '.join(map(str, dims))} cells. A MERL file has 90 x 90 x 180 or 90 x 90 x 360."
            )
        count = 3 * dims[0] * dims[1] * dims[2]
        size, expected = os.fstat(stream.fileno()).st_size, HEADER + 8 * count
        if size != expected:
            raise BvbError(f"{path} has {size:,} bytes in place of {expected:,}. Get the file again, whole.")
        raw = np.fromfile(stream, "<f8", count).reshape(3, -1)
    if not np.isfinite(raw).all():
        channel, cell = (int(i) for i in np.argwhere(~np.isfinite(raw))[0])
        raise BvbError(f"{path}: cell {cell} of channel {channel} is {raw[channel, cell]}. Mark it invalid with -1.")
    valid = (raw >= 0).all(axis=0)
    raw *= SCALE[:, None]
    chart = CHARTS[dims[0], dims[1], dims[2]]
    try:
        return MeasuredBrdf(np.moveaxis(raw.reshape(3, *dims), 0, -1), valid.reshape(dims), chart.grid, chart)
    except BvbError as error:
        raise BvbError(f"{path} is not a sound measurement: {error}") from None


def save_merl(table: MeasuredBrdf, path: str | os.PathLike[str]) -> None:
    """Write ``table``, on MERL's nodes, to ``path``; reading it returns every valid value to 1 ulp.

    Raises BvbError for a table on other nodes, and where the file cannot be written.
    """
    on_grid = table.chart in CHARTS.values() and all(
        len(a) == len(b) and np.allclose(a, b, rtol=0, atol=1e-12)
        for a, b in zip(table.axes, table.chart.grid, strict=True)
    )
    if not on_grid:
        raise BvbError(f"{path}: the table is not on MERL's nodes ({table.chart.name}). Export the model to .binary.")
    raw = np.empty((3, table.valid.size))
    for c in range(3):
        raw[c] = _raw(table.values[..., c].reshape(-1), SCALE[c])
    raw[:, ~table.valid.reshape(-1)] = INVALID
    with replacing(path) as stream:
        stream.write(np.array(table.valid.shape, "<i4").tobytes())
        stream.write(np.ascontiguousarray(raw, "<f8").data)


def _raw(values: Floats, scale: float) -> Floats:
    """Return r with r * scale within one ulp of ``values``: the quotient, or a neighbour where that is nearer."""
    raw = values / scale
    for candidate in (np.nextafter(raw, 0), np.nextafter(raw, np.inf)):
        nearer = np.abs(candidate * scale - values) < np.abs(raw * scale - values)
        raw = np.where(nearer, candidate, raw)
    return raw
