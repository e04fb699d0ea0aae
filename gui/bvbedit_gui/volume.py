"""The volume over its parameter box: surfaces of equal reflectance, the control net, and what the axes mean.

Pure functions from a model to PyVista meshes in chart parameters [0, 1]^3; no window is opened here.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bvbedit.brdf.charts import Chart
from bvbedit.brdf.geometry import Floats
from bvbedit.brdf.spline_brdf import SplineBrdf

if TYPE_CHECKING:
    from pyvista import ImageData, PolyData

# The luminance of linear sRGB (ITU-R BT.709), by which surfaces and control points are placed and coloured.
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
# The name of the point array that carries it.
REFLECTANCE = "reflectance"
# Below this (1/sr) reflectance counts as black: a logarithm needs a floor, and no measurement resolves less.
FLOOR = 1e-6
# Surfaces inside one another that an eye can still tell apart.
MOST_SURFACES = 6
# Mantissas of iso-values, the roundest first: decades where the range holds three of them, finer steps otherwise.
MANTISSAS = ((1.0,), (1.0, 3.0), (1.0, 2.0, 5.0), (1.0, 1.5, 2.0, 3.0, 5.0, 7.0))


def luminance(rgb: Floats) -> Floats:
    """Return the luminance (...) of linear RGB (..., 3), in the same units."""
    return np.asarray(rgb @ LUMINANCE)


def sampled(model: SplineBrdf) -> "ImageData":
    """Return the model's luminance in 1/sr, no less than ``FLOOR``, on a regular grid of its parameter box.

    About two nodes for each control point, within limits that keep the picture smooth and the contouring fast.
    """
    import pyvista as pv

    shape = [min(max(2 * n + 1, 81), 161) for n in model.spline.size]
    rgb = model.encoding.decode(model.spline.evaluate_grid([np.linspace(0, 1, m) for m in shape]))
    grid = pv.ImageData(dimensions=shape, spacing=[1 / (m - 1) for m in shape])
    # VTK's first axis runs fastest.
    grid.point_data[REFLECTANCE] = np.maximum(luminance(rgb), FLOOR).ravel(order="F")
    return grid


def iso_values(low: float, high: float) -> list[float]:
    """Return at most ``MOST_SURFACES`` round values strictly inside (low, high): decades if the range has three.

    ``low`` and ``high`` in 1/sr, positive. A range too narrow for round values gets four equal ratios; an empty one,
    as a constant model has, gets none.
    """
    low = max(low, FLOOR)
    # Rounding alone makes the values of a constant model differ in the last digits.
    if not high > low * (1 + 1e-6):
        return []
    decades = 10.0 ** np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1)
    for mantissas in MANTISSAS:
        values = np.multiply.outer(decades, mantissas).ravel()
        values = values[(values > low) & (values < high)]
        if len(values) >= 3:
            # Thinned from the top: the highest values are the highlight.
            step = -(-len(values) // MOST_SURFACES)
            return [float(v) for v in values[::-1][::step][::-1]]
    return [float(v) for v in np.geomspace(low, high, 6)[1:-1]]


def iso_surfaces(grid: "ImageData", values: list[float]) -> "PolyData":
    """Return the surfaces on which ``sampled`` luminance has the given ``values`` (1/sr), carrying them.

    Empty where no value is met. Between nodes the logarithm of reflectance is taken to be linear.
    """
    import pyvista as pv

    logs = grid.copy()
    logs.point_data[REFLECTANCE] = np.log10(grid.point_data[REFLECTANCE])
    if not values:
        return pv.PolyData()
    surfaces: pv.PolyData = logs.contour(list(np.log10(values)), scalars=REFLECTANCE, method="flying_edges")
    surfaces.point_data[REFLECTANCE] = 10.0 ** surfaces.point_data[REFLECTANCE]
    return surfaces


def control_net(model: SplineBrdf) -> "PolyData":
    """Return the control points at their Greville abscissae, carrying the luminance (1/sr) of their decoded values."""
    import pyvista as pv

    points = np.stack(np.meshgrid(*model.spline.greville, indexing="ij"), axis=-1).reshape(-1, 3)
    net = pv.PolyData(points)
    net.point_data[REFLECTANCE] = np.maximum(luminance(model.encoding.decode(model.spline.control)), FLOOR).ravel()
    return net


@dataclass(frozen=True)
class Axis:
    """What to write along one edge of the parameter box."""

    title: str
    ticks: tuple[float, ...]
    """Chart parameters in [0, 1]."""
    labels: tuple[str, ...]


def axes(chart: Chart) -> tuple[Axis, Axis, Axis]:
    """Return titles, ticks and labels of the chart's three parameters, in degrees where a parameter is an angle.

    Where the angle at a tick depends on the other two parameters, as theta_d of ``half-diff`` does, the parameter is a
    fraction of the largest angle and is labelled as that.
    """
    ticks = np.linspace(0, 1, 4)
    angles = chart.angles(np.stack(np.meshgrid(ticks, ticks, ticks, indexing="ij"), axis=-1))
    out = []
    for axis, name in enumerate(chart.axes):
        symbol = name.replace("theta", "θ").replace("phi", "φ")
        lines = np.moveaxis(angles[..., axis], axis, 0).reshape(len(ticks), -1)
        if np.ptp(lines, axis=1).max() > 1e-9:
            labels = [f"{100 * t:.0f} %" for t in ticks]
            out.append(Axis(f"{symbol}, share of its\nlimit at the horizon", tuple(ticks), tuple(labels)))
        else:
            out.append(Axis(symbol, tuple(ticks), tuple(f"{a:.3g}°" for a in lines[:, 0])))
    return out[0], out[1], out[2]
