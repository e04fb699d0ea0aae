"""What scenes are drawn with: text, the parameter box, arrows, rings and cameras, put into the current renderer."""

from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast

import numpy as np

from bvbedit.brdf.geometry import Floats, spherical
from bvbedit_gui.volume import Axis

if TYPE_CHECKING:
    from pyvista import Plotter

Point = tuple[float, float, float]


def number(value: float) -> str:
    """Return ``value`` with three digits, for people."""
    return f"{float(f'{value:.3g}'):,.0f}" if 1000 <= abs(value) < 1e6 else f"{value:.3g}"


def font(bold: bool = False) -> str:
    """Return the path of a font with Greek letters, which VTK's own lack; matplotlib brings it."""
    import matplotlib

    return str(
        Path(matplotlib.get_data_path()) / "fonts" / "ttf" / ("DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf")
    )


def add_box(
    plotter: "Plotter", axes: tuple[Axis, Axis, Axis], colour: str, text_size: int, hidden: int | None = None
) -> None:
    """Add the unit cube's edges, and ticks and titles along the three edges that the camera sees outermost.

    ``text_size`` in pixels; ``hidden`` is the axis that the camera looks along. What was there before is replaced.
    """
    import pyvista as pv

    line: dict[str, Any] = {"color": colour, "line_width": text_size / 12, "lighting": False, "reset_camera": False}
    plotter.add_mesh(pv.Cube(bounds=(0, 1, 0, 1, 0, 1)).extract_all_edges(), name="box", **line)
    # A line of text in units of the scene, which zooming and the size of the picture change.
    _, bottom, _, top = plotter.renderer.viewport
    text = text_size * 2 * plotter.camera.parallel_scale / ((top - bottom) * plotter.window_size[1])
    # For each axis: where its edge begins, the way outwards from it as the camera sees it, and where the title stands
    # along and off the edge. The upright one is titled at its top, where it takes no width.
    edges = (
        (np.array([0.0, 0.0, 0.0]), np.array([0.25, -0.7, -0.7]), 0.6, 3.2 * text),
        (np.array([0.0, 0.0, 0.0]), np.array([-0.8, 0.0, -0.5]), 0.52, 6.2 * text),
        (np.array([0.0, 1.0, 0.0]), np.array([-0.8, 0.6, 0.0]), 1 + 1.3 * text, 1.2 * text),
    )
    for n, (axis, (start, outwards, middle, off)) in enumerate(zip(axes, edges, strict=True)):
        along = np.eye(3)[n]
        at = np.array([start + t * along for t in axis.ticks])
        ticks = np.stack([at, at + 0.5 * text * outwards], axis=1).reshape(-1, 3)
        plotter.add_mesh(pv.line_segments_from_points(ticks), name=f"ticks {n}", **line)
        labels, named = ([], []) if n == hidden else (list(axis.labels), [axis.title])
        write_at(plotter, at + (2.2 if n else 1.6) * text * outwards, labels, colour, text_size, f"labels {n}")
        title = (start + middle * along + off * outwards)[None]
        write_at(plotter, title, named, colour, text_size, f"title {n}")


def axis_edges() -> Floats:
    """Return the ends (3, 2, 3) of the edges of the box along which the axes are written."""
    starts = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    return np.stack([starts, starts + np.eye(3)], axis=1)


def _show(plotter: "Plotter", name: str, mesh: Any, **style: Any) -> None:
    """Show a mesh by this name; where one is shown already, it only gets another shape: a new actor takes 2 ms."""
    known = plotter.actors.get(name)
    if known is None:
        plotter.add_mesh(mesh, name=name, **style)
    else:
        cast(Any, known).mapper.dataset = mesh


def add_arrow(plotter: "Plotter", start: Floats, end: Floats, colour: str, name: str) -> None:
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
    _show(plotter, name, arrow, color=colour, ambient=0.5, reset_camera=False)


def add_ground(plotter: "Plotter", radii: list[float], places: tuple[float, ...], colour: str, text_size: int) -> None:
    """Add rings of these radii and rays every 30 degrees on the plane of the surface, around ``places`` along x."""
    import pyvista as pv

    line: dict[str, Any] = {"color": colour, "line_width": text_size / 15, "lighting": False, "reset_camera": False}
    phi = np.linspace(0, 2 * np.pi, 181)
    middles = [np.array([x, 0.0, 0.0]) for x in places]
    circles = [pv.lines_from_points(x + r * spherical(np.pi / 2, phi)) for r in (1.0, *radii) for x in middles]
    _show(plotter, "rings", pv.merge(circles), **line)
    rays = spherical(np.pi / 2, np.radians(np.arange(0, 180, 30)))
    segments = np.concatenate([x + np.stack([-rays, rays], axis=1).reshape(-1, 3) for x in middles])
    _show(plotter, "rays", pv.line_segments_from_points(segments), **line)


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
        font_file=font(bold),
        justification_horizontal=align,
        justification_vertical="top",
    )
    plotter.add_actor(actor, reset_camera=False, pickable=False)


def write_at(plotter: "Plotter", points: Floats, labels: list[str], colour: str, text_size: int, name: str) -> None:
    """Write ``labels`` centred at ``points`` (n, 3) of the scene, in front of everything; without any, remove them."""
    if not labels:
        cast(Any, plotter).remove_actor(name, reset_camera=False)
        return
    # PyVista's decorator hides the signature from type checkers.
    cast(Any, plotter).add_point_labels(
        points,
        labels,
        name=name,
        shape=None,
        show_points=False,
        always_visible=True,
        bold=False,
        font_size=text_size,
        font_file=font(),
        text_color=colour,
        justification_horizontal="center",
        justification_vertical="center",
        reset_camera=False,
    )


def look(plotter: "Plotter", position: Point, focus: Point, half_height: float, half_width: float) -> None:
    """Look at ``focus`` without perspective, so that half the height and width (scene units) fit into the panel."""
    left, bottom, right, top = plotter.renderer.viewport
    width, height = plotter.window_size
    aspect = (right - left) * width / ((top - bottom) * height)
    plotter.camera_position = [position, focus, (0, 0, 1)]
    plotter.camera.parallel_projection = True
    plotter.camera.parallel_scale = max(half_height, half_width / aspect)
    plotter.renderer.reset_camera_clipping_range()


def on_screen(plotter: "Plotter", points: Floats) -> Floats:
    """Return where ``points`` (n, 3) of the scene stand on the picture (n, 2), in pixels from its lower left corner."""
    renderer = plotter.renderer
    matrix = renderer.camera.GetCompositeProjectionTransformMatrix(renderer.GetTiledAspectRatio(), -1, 1)
    projection = np.array([[matrix.GetElement(i, j) for j in range(4)] for i in range(4)])
    seen = np.concatenate([points, np.ones((len(points), 1))], axis=1) @ projection.T
    width, height = plotter.window_size
    return np.asarray((seen[:, :2] / seen[:, 3:] + 1) / 2 * [width, height])
