"""What one panel shows: meshes, labels and camera put into the current renderer of a PyVista plotter.

Knows nothing of windows, layouts or files, so that a picture and an interactive view can share it.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast

import numpy as np

from bvbedit.brdf.encodings import Encoding
from bvbedit.brdf.geometry import Floats, spherical
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit_gui import lobes, volume

if TYPE_CHECKING:
    from pyvista import Plotter, PolyData

# vtkTextProperty: take the font from a file.
VTK_FONT_FILE = 4
# Safe for the colour-blind, and its lightness rises steadily, so that it survives a grey print.
COLOUR_MAP = "viridis"
PAPER, INK = "#ffffff", "#202124"
# Lobes are coloured at full brightness: white paint and chrome would vanish on white.
NIGHT, CHALK, FAINT = "#33373d", "#eceff1", "#767d85"
LIGHT, MIRROR = "#ffb000", "#56b4e9"
SCALE_WORDS = {"linear": "linear", "root": "cube root", "log": "logarithmic"}
# The cameras: where they stand and where they look.
BOX_EYE, BOX_FOCUS = (-1.5, -2.3, 1.6), (0.5, 0.5, 0.36)
LOBE_EYE, LOBE_FOCUS = (0.9, -4.0, 1.7), (0.0, 0.0, 0.46)
# How far ticks and their labels stand off the parameter box, in edge lengths.
TICK, TICK_LABEL = 0.025, 0.08
# The share of the box that may lie below the lowest iso-value: the last dark cells are mostly noise.
DARKEST = 2.0


def show_volume(plotter: "Plotter", model: SplineBrdf, *, text_size: int) -> None:
    """Show iso-surfaces and control net of ``model`` in its parameter box, with its axes and a colour bar.

    ``text_size`` in pixels.
    """
    plotter.renderer.set_background(PAPER)
    grid = volume.sampled(model)
    reflectance = np.asarray(grid.point_data[volume.REFLECTANCE])
    low, high = float(np.percentile(reflectance, DARKEST)), float(reflectance.max())
    values = volume.iso_values(low, high)
    net = volume.control_net(model)
    # The map's ends lie a little outside the values, so that the outermost surfaces do not take its extreme colours.
    ends = np.log10([values[0], values[-1]] if values else [low, high])
    colours: dict[str, Any] = {
        "scalars": "log10",
        "cmap": COLOUR_MAP,
        "clim": [ends[0] - 0.3, ends[1] + 0.3],
        "show_scalar_bar": False,
    }
    if values:
        surfaces = volume.iso_surfaces(grid, values)
        surfaces.point_data["log10"] = np.log10(surfaces.point_data[volume.REFLECTANCE])
        plotter.add_mesh(surfaces, opacity=0.5, smooth_shading=True, ambient=0.3, specular=0.0, **colours)
    net.point_data["log10"] = np.log10(net.point_data[volume.REFLECTANCE])
    size = _point_size(model.spline.size, text_size)
    points = plotter.add_mesh(net, style="points", point_size=size, lighting=False, **colours)
    _add_box(plotter, volume.axes(model.chart), text_size)
    _look(plotter, BOX_EYE, BOX_FOCUS, half_height=1.1, half_width=0.87)
    points.mapper.lookup_table.annotations = {float(np.log10(v)): number(v) for v in values or [high]}
    # PyVista's decorator hides the signature from type checkers.
    bar = cast(Any, plotter).add_scalar_bar(
        title="luminance of f, 1/sr",
        mapper=points.mapper,
        n_labels=0,
        vertical=False,
        width=0.7,
        height=0.075,
        position_x=0.15,
        position_y=0.04,
        color=INK,
        title_font_size=text_size,
        label_font_size=text_size,
        unconstrained_font_size=True,
    )
    for style in (bar.GetTitleTextProperty(), bar.GetAnnotationTextProperty()):
        style.SetFontFamily(VTK_FONT_FILE)
        style.SetFontFile(_font())


def number(value: float) -> str:
    """Return ``value`` with three digits, for people."""
    return f"{float(f'{value:.3g}'):,.0f}" if 1000 <= value < 1e6 else f"{value:.3g}"


def _point_size(size: tuple[int, ...], text_size: int) -> float:
    """Return pixels: a fifth of the mean distance of the control points, were the box 30 lines of text high."""
    return float(np.clip(30 * text_size / np.cbrt(np.prod(size)) / 5, text_size / 10, text_size / 2))


def _add_box(plotter: "Plotter", axes: tuple[volume.Axis, volume.Axis, volume.Axis], text_size: int) -> None:
    """Add the unit cube's edges, and ticks and titles along the three edges that the camera sees outermost."""
    import pyvista as pv

    line: dict[str, Any] = {"color": INK, "line_width": text_size / 12, "lighting": False}
    plotter.add_mesh(pv.Cube(bounds=(0, 1, 0, 1, 0, 1)).extract_all_edges(), **line)
    # For each axis: where its edge begins, the way outwards from it as the camera sees it, and where the title stands
    # along and off the edge. The upright one is titled at its top, where it takes no width.
    edges = (
        (np.array([0.0, 0.0, 0.0]), np.array([0.0, -0.7, -0.7]), 0.5, 0.23),
        (np.array([0.0, 0.0, 0.0]), np.array([-0.7, 0.0, -0.7]), 0.5, 0.27),
        (np.array([0.0, 1.0, 0.0]), np.array([-0.8, 0.6, 0.0]), 1.09, TICK_LABEL),
    )
    for number, (axis, (start, outwards, middle, off)) in enumerate(zip(axes, edges, strict=True)):
        along = np.eye(3)[number]
        at = np.array([start + t * along for t in axis.ticks])
        ticks = np.stack([at, at + TICK * outwards], axis=1).reshape(-1, 3)
        plotter.add_mesh(pv.line_segments_from_points(ticks), **line)
        _write_at(plotter, at + TICK_LABEL * outwards, list(axis.labels), INK, text_size)
        _write_at(plotter, (start + middle * along + off * outwards)[None], [axis.title], INK, text_size)


def show_lobe(
    plotter: "Plotter",
    mesh: "PolyData",
    scale: Encoding,
    peak: float,
    theta_i: float,
    *,
    title: str,
    text_size: int,
) -> None:
    """Show a ``lobes.lobe`` with its ground grid and the incident and mirror directions.

    ``peak`` (1/sr) is the length drawn as radius 1, so that lobes shown with one peak and one scale can be compared;
    what is longer is cut there. ``theta_i`` in radians; ``title`` one line or more; ``text_size`` in pixels.
    """
    small = round(0.85 * text_size)
    plotter.renderer.set_background(NIGHT)
    drawn = lobes.scaled(mesh, scale, peak)
    _add_ground(plotter, lobes.rings(scale, peak), drawn, small)
    plotter.add_mesh(
        drawn,
        scalars=lobes.COLOUR,
        rgb=True,
        smooth_shading=True,
        ambient=0.45,
        diffuse=0.6,
        specular=0.0,
        show_scalar_bar=False,
    )
    incident, mirror = spherical(theta_i, np.pi), spherical(theta_i, 0.0)
    # Side by side where they would cover one another.
    apart = np.array([0.06 if np.sin(theta_i) < 0.06 else 0.0, 0.0, 0.0])
    _add_arrow(plotter, 1.25 * incident - apart, 1.02 * incident - apart, LIGHT)
    _add_arrow(plotter, 1.02 * mirror + apart, 1.25 * mirror + apart, MIRROR)
    _look(plotter, LOBE_EYE, LOBE_FOCUS, half_height=0.9, half_width=1.3)
    write(plotter, title, (0.03, 0.96), CHALK, text_size)
    write(plotter, f"{SCALE_WORDS[scale.name]} radius", (0.03, 0.1), CHALK, small)
    write(plotter, "light", (0.97, 0.96), LIGHT, small, align="right")
    write(plotter, "mirror", (0.97, 0.88), MIRROR, small, align="right")


def _add_ground(plotter: "Plotter", marks: list[tuple[float, float]], mesh: "PolyData", text_size: int) -> None:
    """Add rings of known length and rays every 30 degrees on the plane of the surface, labelled where not hidden."""
    import pyvista as pv

    line: dict[str, Any] = {"color": FAINT, "line_width": text_size / 15, "lighting": False}
    phi = np.linspace(0, 2 * np.pi, 181)
    for radius in (1.0, *(radius for _, radius in marks)):
        plotter.add_mesh(pv.lines_from_points(radius * spherical(np.pi / 2, phi)), **line)
    rays = spherical(np.pi / 2, np.radians(np.arange(0, 180, 30)))
    plotter.add_mesh(pv.line_segments_from_points(np.stack([-rays, rays], axis=1).reshape(-1, 3)), **line)
    for length, radius in marks:
        # Front left: beside the lobe, and the rings are well apart there.
        at = radius * spherical(np.pi / 2, np.radians(-140.0))
        if not lobes.hides(mesh, at, np.subtract(LOBE_EYE, LOBE_FOCUS)):
            _write_at(plotter, at[None], [number(length)], CHALK, text_size)


def _add_arrow(plotter: "Plotter", start: Floats, end: Floats, colour: str) -> None:
    """Add an arrow between two points, its head and shaft of fixed thickness."""
    import pyvista as pv

    length = float(np.linalg.norm(end - start))
    arrow = pv.Arrow(
        start=start,
        direction=end - start,
        scale=length,
        tip_length=0.12 / length,
        tip_radius=0.035 / length,
        shaft_radius=0.011 / length,
    )
    plotter.add_mesh(arrow, color=colour, ambient=0.5)


def write(
    plotter: "Plotter",
    text: str,
    corner: tuple[float, float],
    colour: str,
    text_size: int,
    *,
    bold: bool = False,
    align: Literal["left", "right"] = "left",
) -> None:
    """Write ``text`` with its upper corner on the ``align`` side at a point of the panel, (0, 0) to (1, 1)."""
    import pyvista as pv

    # VTK takes $ for a formula, and | for a column with no way to write the character itself.
    actor = pv.Text(text.replace("$", "\\$").replace("|", "∣"), position=corner)
    actor.GetActualPositionCoordinate().SetCoordinateSystemToNormalizedViewport()
    actor.prop = pv.TextProperty(
        color=colour,
        font_size=text_size,
        font_file=_font(bold),
        justification_horizontal=align,
        justification_vertical="top",
    )
    plotter.add_actor(actor, reset_camera=False, pickable=False)


def _write_at(plotter: "Plotter", points: Floats, labels: list[str], colour: str, text_size: int) -> None:
    """Write ``labels`` centred at ``points`` (n, 3) of the scene, in front of everything."""
    plotter.add_point_labels(
        points,
        labels,
        shape=None,
        show_points=False,
        always_visible=True,
        bold=False,
        font_size=text_size,
        font_file=_font(),
        text_color=colour,
        justification_horizontal="center",
        justification_vertical="center",
        reset_camera=False,
    )


def _font(bold: bool = False) -> str:
    """Return the path of a font with Greek letters, which VTK's own lack; matplotlib comes with PyVista."""
    import matplotlib

    return str(
        Path(matplotlib.get_data_path()) / "fonts" / "ttf" / ("DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf")
    )


def _look(
    plotter: "Plotter",
    position: tuple[float, float, float],
    focus: tuple[float, float, float],
    half_height: float,
    half_width: float,
) -> None:
    """Look at ``focus`` without perspective, so that half the height and width (scene units) fit into the panel."""
    left, bottom, right, top = plotter.renderer.viewport
    width, height = plotter.window_size
    aspect = (right - left) * width / ((top - bottom) * height)
    plotter.camera_position = [position, focus, (0, 0, 1)]
    plotter.camera.parallel_projection = True
    plotter.camera.parallel_scale = max(half_height, half_width / aspect)
    plotter.renderer.reset_camera_clipping_range()
