"""The scene of the volume: its actors, made once, to which new meshes are given as the model or the view changes."""

from typing import TYPE_CHECKING, Any

import numpy as np

from bvbedit.brdf.charts import Chart
from bvbedit.brdf.geometry import Floats
from bvbedit_gui import volume
from bvbedit_gui.drawing import Point, add_box, axis_edges, look, on_screen
from bvbedit_gui.themes import COLOUR_MAP, Theme

if TYPE_CHECKING:
    from pyvista import Actor, DataSet, Plotter, PolyData

# Of differences: its ends are told apart by everybody, and its middle is pale.
DIFFERENCE_MAP = "PuOr_r"
# The cameras: where they stand and where they look; seen from the side of each axis, too.
BOX_EYE, BOX_FOCUS = (-1.5, -2.3, 1.6), (0.5, 0.5, 0.44)
VIEWS: dict[str, tuple[Point, Point]] = {
    "oblique": (BOX_EYE, BOX_FOCUS),
    "0": ((-4.0, 0.5, 0.5), (0.5, 0.5, 0.5)),
    "1": ((0.5, -4.0, 0.5), (0.5, 0.5, 0.5)),
    "2": ((0.5, 0.4999, 4.0), (0.5, 0.5, 0.5)),
}
# Half the height and width of the box itself, in its edge lengths, and lines of text that stand around it.
HALVES = {"oblique": (0.73, 0.72), "side": (0.52, 0.52)}
LINES = {"oblique": (5.0, 8.0), "side": (6.0, 9.0)}
# Control points are drawn in so many sizes, from the darkest to the brightest, as shares of the largest.
SIZES = (0.35, 0.5, 0.7, 1.0)
# Of an edit that is confined to a region: control points that belong to it.
SELECTED = "#e0218a"
PLANES = ("#0072b2", "#d55e00", "#009e73")


class VolumeScene:
    """Shows surfaces, slices, control net and knots in the parameter box of a chart, in one renderer of a plotter."""

    def __init__(self, plotter: "Plotter", theme: Theme, text_size: int) -> None:
        import pyvista as pv

        self.plotter = plotter
        self.text_size = text_size
        self._theme = theme
        self._chart: Chart | None = None
        self._view = "oblique"
        self.colours = pv.LookupTable(COLOUR_MAP)
        mesh: dict[str, Any] = {"show_scalar_bar": False, "reset_camera": False}
        self._surfaces = self._actor("surfaces", ambient=0.3, specular=0.0, **mesh)
        self._surfaces.prop.interpolation = "Phong"
        self._slices = [self._actor(f"slice {n}", lighting=False, **mesh) for n in range(3)]
        self._net = [self._actor(f"net {n}", style="points", lighting=False, **mesh) for n in range(len(SIZES))]
        self._knots = [
            self._actor(f"knots {n}", color=PLANES[n], opacity=0.35, lighting=False, line_width=1, **mesh)
            for n in range(3)
        ]
        self._selected = self._actor("selected", style="points", color=SELECTED, lighting=False, **mesh)
        self._marked = self._actor("marked", style="points", color=SELECTED, lighting=False, point_size=14, **mesh)
        for actor in (self._surfaces, *self._slices, *self._net):
            actor.mapper.lookup_table = self.colours
        self.recolour(theme)

    def _actor(self, name: str, **style: Any) -> "Actor":
        import pyvista as pv

        # An empty mesh cannot be added, but can be put in the place of another one later.
        placeholder = pv.PolyData(np.zeros((1, 3)))
        placeholder.point_data[volume.LEVEL] = np.zeros(1)
        if "color" not in style:
            style["scalars"] = volume.LEVEL
        actor: Actor = self.plotter.add_mesh(placeholder, name=name, **style)
        _give(actor, pv.PolyData())
        return actor

    def recolour(self, theme: Theme) -> None:
        """Take other colours for paper and ink."""
        self._theme = theme
        self.plotter.renderer.set_background(theme.paper)
        self._label()

    def show_chart(self, chart: Chart) -> None:
        """Label the axes with what the chart's parameters mean."""
        if chart is not self._chart:
            self._chart = chart
            self._label()

    def colour_by(self, low: float, high: float, *, signed: bool) -> None:
        """Let colours run between two levels."""
        colours: Any = self.colours
        colours.cmap = DIFFERENCE_MAP if signed else COLOUR_MAP
        self.colours.scalar_range = (low, high)
        for actor in (self._surfaces, *self._slices, *self._net):
            actor.mapper.scalar_range = (low, high)

    def show_surfaces(self, surfaces: "PolyData", opacity: float) -> None:
        """Show surfaces that carry their levels."""
        _give(self._surfaces, surfaces)
        self._surfaces.prop.opacity = opacity

    def show_slice(self, axis: int, mesh: "DataSet | None") -> None:
        """Show a slice that carries levels across an axis, or none."""
        _give(self._slices[axis], mesh)

    def show_net(self, points: Floats | None, levels: Floats | None = None) -> None:
        """Show control points (n, 3), sized and coloured by their levels (n,), or none."""
        import pyvista as pv

        if points is None or levels is None or not len(points):
            for actor in self._net:
                _give(actor, None)
            return
        low, high = self.colours.scalar_range
        rank = np.clip((levels - low) / max(high - low, 1e-12), 0, 1 - 1e-9)
        group = (rank * len(SIZES)).astype(int)
        largest = self._largest_point(len(points))
        for n, (actor, share) in enumerate(zip(self._net, SIZES, strict=True)):
            some = group == n
            mesh = pv.PolyData(points[some]) if some.any() else None
            if mesh is not None:
                mesh.point_data[volume.LEVEL] = levels[some]
            _give(actor, mesh)
            actor.prop.point_size = max(1.0, share * largest)

    def show_selected(self, points: Floats, marked: Floats | None = None) -> None:
        """Show which control points (n, 3) an edit reaches, and the one (3,) that was picked."""
        import pyvista as pv

        _give(self._selected, pv.PolyData(points) if len(points) else None)
        self._selected.prop.point_size = float(np.clip(0.5 * self._largest_point(len(points)), 2.0, 5.0))
        _give(self._marked, None if marked is None else pv.PolyData(marked[None]))

    def show_knots(self, planes: "list[PolyData] | None") -> None:
        """Show the outlines of the knot planes of the three axes, or none."""
        for n, actor in enumerate(self._knots):
            _give(actor, None if planes is None else planes[n])

    def look_from(self, view: str) -> None:
        """Look at the box from one of ``VIEWS``."""
        self._view = view
        eye, focus = VIEWS[view]
        kind = "oblique" if view == "oblique" else "side"
        half_height, half_width = (
            half * pixels / max(pixels - lines * self.text_size, pixels / 3)
            for half, lines, pixels in zip(HALVES[kind], LINES[kind], self._pixels()[::-1], strict=True)
        )
        look(self.plotter, eye, focus, half_height, half_width)
        self._label()

    def _pixels(self) -> tuple[float, float]:
        """Return width and height of the part of the window that the scene has."""
        left, bottom, right, top = self.plotter.renderer.viewport
        width, height = self.plotter.window_size
        return (right - left) * width, (top - bottom) * height

    def resized(self) -> None:
        """Let the box fill the picture, which has another size now."""
        self.look_from(self._view)

    def _label(self) -> None:
        if self._chart is not None:
            hidden = int(self._view) if self._view.isdigit() else None
            add_box(self.plotter, volume.axes(self._chart), self._theme.ink, self.text_size, hidden)

    def nearest_point(self, points: Floats, x: float, y: float, within: float) -> int | None:
        """Return which of ``points`` (n, 3) stands nearest to a place on the picture, in pixels from the lower left."""
        if not len(points):
            return None
        away = np.linalg.norm(on_screen(self.plotter, points) - [x, y], axis=1)
        nearest = int(np.argmin(away))
        return nearest if away[nearest] <= within else None

    def place_on_axis(self, x: float, y: float, within: float) -> tuple[int, float] | None:
        """Return the axis that is nearest to a place on the picture, and the parameter there; None where none is."""
        best: tuple[float, int, float] | None = None
        for axis, (a, b) in enumerate(on_screen(self.plotter, axis_edges().reshape(-1, 3)).reshape(3, 2, 2)):
            along = b - a
            t = float(np.clip(np.dot([x, y] - a, along) / max(np.dot(along, along), 1e-12), 0.0, 1.0))
            away = float(np.linalg.norm(a + t * along - [x, y]))
            if away <= within and (best is None or away < best[0]):
                best = away, axis, t
        return None if best is None else best[1:]

    def _largest_point(self, count: int) -> float:
        """Return pixels: a fifth of the mean distance of control points, were the box 30 lines of text high."""
        apart = 30 * self.text_size / np.cbrt(max(count, 1))
        return float(np.clip(apart / 5, self.text_size / 6, self.text_size / 1.5))


def _give(actor: "Actor", mesh: "DataSet | None") -> None:
    """Let an actor show another mesh, or nothing."""
    import pyvista as pv

    shown = mesh is not None and mesh.n_points > 0
    actor.visibility = shown
    actor.mapper.dataset = mesh if shown else pv.PolyData()
