"""The volume over its parameter box: surfaces of equal value, slices, the control net, knots, and what the axes mean.

Pure functions from a BRDF to arrays and PyVista meshes in chart parameters [0, 1]^3; no window is opened here.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.charts import Chart, grid_points
from bvbedit.brdf.geometry import LUMINANCE, Floats
from bvbedit.brdf.spline_brdf import SplineBrdf

if TYPE_CHECKING:
    from pyvista import ImageData, PolyData, StructuredGrid

# What of the reflectance is shown: a mean by sight, a channel, or by how much it differs from a reference.
What = Literal["luminance", "red", "green", "blue", "difference"]
# The name of the point array by which meshes are coloured: levels, see ``Field``.
LEVEL = "level"
# Below this (1/sr) reflectance counts as black: a logarithm needs a floor, and no measurement resolves less.
FLOOR = 1e-6
# Surfaces inside one another that an eye can still tell apart.
MOST_SURFACES = 6
# Mantissas of iso-values, the roundest first: decades where the range holds three of them, finer steps otherwise.
MANTISSAS = ((1.0,), (1.0, 3.0), (1.0, 2.0, 5.0), (1.0, 1.5, 2.0, 3.0, 5.0, 7.0))
# The share of the box that may lie below the lowest iso-value: the last dark cells are mostly noise.
DARKEST = 2.0
# Nodes along each axis of what has no control points, and of slices.
NODES, SLICE_NODES = 81, 161


def luminance(rgb: Floats) -> Floats:
    """Return the luminance (...) of linear RGB (..., 3), in the same units."""
    return np.asarray(rgb @ LUMINANCE)


def scalar(rgb: Floats, what: What) -> Floats:
    """Return what is shown (...) of reflectance, or of a difference of reflectances, (..., 3)."""
    return luminance(rgb) if what in ("luminance", "difference") else rgb[..., ("red", "green", "blue").index(what)]


def box_nodes(brdf: Brdf) -> tuple[Floats, Floats, Floats]:
    """Return the nodes along each axis at which the box is sampled: about two for each control point, within limits."""
    size = brdf.spline.size if isinstance(brdf, SplineBrdf) else (0, 0, 0)
    counts = [min(max(2 * n + 1, NODES), 2 * NODES - 1) for n in size]
    return np.linspace(0, 1, counts[0]), np.linspace(0, 1, counts[1]), np.linspace(0, 1, counts[2])


def sampled(brdf: Brdf, chart: Chart, axes: tuple[Floats, Floats, Floats]) -> Floats:
    """Return the reflectance (n_0, n_1, n_2, 3) in 1/sr on the grid of a chart's parameters with these ``axes``."""
    if isinstance(brdf, SplineBrdf) and brdf.chart is chart:
        return brdf.encoding.decode(brdf.spline.evaluate_grid(axes))
    f = brdf.evaluate(*chart.to_directions(grid_points(axes)))
    return f.reshape(*(len(axis) for axis in axes), 3)


@dataclass(frozen=True)
class Field:
    """Values (n_0, n_1, n_2) in 1/sr on a regular grid of the box, and the levels by which they are drawn.

    Levels are logarithms to base 10 of values. Of differences, which have a sign, they are log10(1 + |value| / FLOOR)
    with that sign.
    """

    values: Floats
    signed: bool = False

    def level(self, value: Floats | float) -> Floats:
        """Return the levels (...) of values (...)."""
        value = np.asarray(value, dtype=np.float64)
        if self.signed:
            return np.asarray(np.sign(value) * np.log10(1 + np.abs(value) / FLOOR))
        return np.asarray(np.log10(np.maximum(value, FLOOR)))

    @cached_property
    def levels(self) -> Floats:
        """The levels of all values, the first axis running fastest, as VTK has it."""
        return self.level(self.values).ravel(order="F")

    @cached_property
    def ends(self) -> tuple[float, float]:
        """The smallest and the largest value that surfaces are worth being drawn at; of differences, of their sizes."""
        sizes = np.abs(self.values)
        low, high = float(np.percentile(sizes, DARKEST)), float(sizes.max())
        return max(low, FLOOR), max(high, FLOOR)

    @cached_property
    def bright(self) -> float:
        """What all but a thousandth of the box is below: beyond lie spikes at grazing, and little else."""
        return max(float(np.quantile(np.abs(self.values), 0.999)), FLOOR)


def field(
    brdf: Brdf,
    chart: Chart,
    what: What = "luminance",
    reference: Brdf | None = None,
    sample: Callable[[Brdf, Chart, tuple[Floats, Floats, Floats]], Floats] = sampled,
) -> Field:
    """Return what is shown of ``brdf`` over the parameter box of a chart; a difference to ``reference`` has a sign.

    ``sample`` is how the reference is sampled: a measurement takes 0.3 s, and may be known already.
    """
    axes = box_nodes(brdf)
    rgb = sampled(brdf, chart, axes)
    if what == "difference":
        assert reference is not None
        return Field(scalar(rgb - sample(reference, chart, axes), what), signed=True)
    return Field(scalar(rgb, what))


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


def grid(shown: Field) -> "ImageData":
    """Return the box's regular grid, carrying the levels of a field."""
    import pyvista as pv

    shape = shown.values.shape
    out = pv.ImageData(dimensions=shape, spacing=[1 / (m - 1) for m in shape])
    out.point_data[LEVEL] = shown.levels
    return out


def iso_surfaces(shown: Field, over: "ImageData", values: list[float]) -> "PolyData":
    """Return the surfaces on which the field has the given ``values`` (1/sr), carrying their levels, with normals.

    ``over`` is its ``grid``. Of a difference, those on which it has plus or minus a value. Empty where no value is met.
    Between nodes the level is taken to be linear.
    """
    import pyvista as pv

    levels = [float(shown.level(v)) for v in values]
    if shown.signed:
        levels += [-level for level in levels]
    if not levels:
        return pv.PolyData()
    surfaces: pv.PolyData = over.contour(levels, scalars=LEVEL, method="flying_edges", compute_normals=True)
    return surfaces


@dataclass(frozen=True)
class Slice:
    """A plane across one axis of the box: its nodes along the three axes, and what is shown there."""

    axes: tuple[Floats, Floats, Floats]
    field: Field


def slice_at(
    brdf: Brdf, chart: Chart, axis: int, at: float, what: What = "luminance", reference: Brdf | None = None
) -> Slice:
    """Return the plane where the parameter ``axis`` is ``at``."""
    line = np.linspace(0, 1, SLICE_NODES)
    across = np.array([at])
    axes = (across if axis == 0 else line, across if axis == 1 else line, across if axis == 2 else line)
    rgb = sampled(brdf, chart, axes)
    if what == "difference":
        assert reference is not None
        rgb = rgb - sampled(reference, chart, axes)
    return Slice(axes, Field(scalar(rgb, what), signed=what == "difference"))


def slice_mesh(plane: Slice) -> "StructuredGrid":
    """Return a slice as a mesh that carries levels."""
    import pyvista as pv

    mesh = pv.StructuredGrid(*np.meshgrid(*plane.axes, indexing="ij"))
    mesh.point_data[LEVEL] = plane.field.levels
    return mesh


def net_points(model: SplineBrdf) -> Floats:
    """Return the Greville abscissae (n, 3) of the control points, the last axis running fastest."""
    return np.clip(grid_points(tuple(model.spline.greville)), 0.0, 1.0)


def net_values(model: SplineBrdf, what: What = "luminance") -> Floats:
    """Return what is shown (n,), in 1/sr, of the decoded control points."""
    rgb = model.encoding.decode(model.spline.control).reshape(-1, 3)
    return scalar(rgb, "luminance" if what == "difference" else what)


def control_net(model: SplineBrdf) -> "PolyData":
    """Return the control points at their Greville abscissae, carrying the levels of their decoded luminance."""
    import pyvista as pv

    net = pv.PolyData(net_points(model))
    values = net_values(model)
    net.point_data[LEVEL] = Field(values).level(values)
    return net


def knot_planes(model: SplineBrdf, axis: int) -> "PolyData":
    """Return the outlines of the planes on which the interior knots of an axis lie; empty where there are none."""
    import pyvista as pv

    t = model.spline.knots[axis]
    inside = np.unique(t[(t > 0) & (t < 1)])
    if not len(inside):
        return pv.PolyData()
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]])
    loops = np.insert(np.broadcast_to(corners, (len(inside), 5, 2)), axis, inside[:, None], axis=2)
    first = 5 * np.arange(len(inside))[:, None]
    lines = np.concatenate([np.full_like(first, 5), first + np.arange(5)], axis=1)
    return pv.PolyData(loops.reshape(-1, 3), lines=lines.ravel())


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
            out.append(Axis(f"{symbol}, % of limit", tuple(ticks), tuple(labels)))
        else:
            out.append(Axis(symbol, tuple(ticks), tuple(f"{a:.3g}°" for a in lines[:, 0])))
    return out[0], out[1], out[2]


def place_on(chart: Chart, axis: int, at: float) -> str:
    """Return in words where a parameter lies on its axis: an angle, or a share where the angle depends on others."""
    symbol = chart.axes[axis].replace("theta", "θ").replace("phi", "φ")
    points = np.random.default_rng(0).random((8, 3))
    points[:, axis] = at
    angles = chart.angles(points)[:, axis]
    return f"{symbol} = {angles[0]:.4g}°" if np.ptp(angles) < 1e-9 else f"{100 * at:.3g} % of the largest {symbol}"
