"""The figures' panel: an iso-line of the volume, the albedo, and numbers."""

from typing import TYPE_CHECKING, Any

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.charts import Chart
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit_gui.given import one_of, real, whole
from bvbedit_gui.plots.albedo_picture import draw_albedo
from bvbedit_gui.plots.albedos import albedo_curve
from bvbedit_gui.plots.facts import figures
from bvbedit_gui.plots.line_picture import draw_iso_line
from bvbedit_gui.plots.lines import iso_line
from bvbedit_gui.themes import THEMES, Theme

if TYPE_CHECKING:
    from bvbedit_gui.viewer import Viewer

STARTS: dict[str, Any] = {
    "figure": "line",
    "line_axis": 0,
    "line_scale": "log",
    # As the page's observer of sizes sends it, which tells more besides.
    "figure_size": {"size": {"width": 480, "height": 300}},
    "figure_svg": "",
    "figure_rows": [],
}
# Seconds that figures wait for pictures, which eyes follow first.
REST = 0.12
SMALLEST, LARGEST = (380, 220), (1600, 1200)


class FiguresView:
    """Shows plots and numbers of what the viewer shows, beside what it is compared with."""

    def __init__(self, viewer: "Viewer") -> None:
        self._viewer = viewer
        self.state = viewer.state
        self.state.update(STARTS)
        self.queue = viewer.latest("figures", REST)
        self.state.change("figure", "line_axis", "line_scale", "probe", "figure_size")(lambda **_: self.refresh())

    def synchronise(self) -> None:
        """Leave what only a model has, where there is none."""
        if not self.state.is_model and self.state.figure != "line":
            self.state.figure = "line"

    def refresh(self) -> None:
        """Draw the plot that is chosen anew, or count anew."""
        shown, other, chart = self._viewer.shown, self._viewer.other, self._viewer.chart
        if shown is None:
            return
        state = self.state
        figure, theme = state.figure, THEMES[one_of(state.theme, THEMES, "light")]
        width, height = self._size()
        if figure == "line":
            axis, at = self._line()
            scale = "log" if state.line_scale == "log" else "linear"
            self.queue.ask(
                lambda: _line_svg(shown, other, chart, axis, at, width, height, theme, scale),
                lambda svg: self._show("figure_svg", svg),
            )
        elif figure == "albedo" and isinstance(shown, SplineBrdf):
            self.queue.ask(
                lambda: _albedo_svg(shown, other, width, height, theme), lambda svg: self._show("figure_svg", svg)
            )
        elif figure == "numbers" and isinstance(shown, SplineBrdf):
            self.queue.ask(
                lambda: [row._asdict() for row in figures(shown, other)],
                lambda rows: self._show("figure_rows", rows),
            )

    def _line(self) -> tuple[int, tuple[float, float, float]]:
        """Return the axis and the place of the line; a page may have sent anything."""
        state = self.state
        probe = state.probe if isinstance(state.probe, list) and len(state.probe) == 3 else [0.5] * 3
        u, v, w = (real(p, 0.5, 0.0, 1.0) for p in probe)
        return whole(state.line_axis, 0, 0, 2), (u, v, w)

    def _size(self) -> tuple[int, int]:
        told = self.state.figure_size
        given = told.get("size") if isinstance(told, dict) else None
        given = given if isinstance(given, dict) else {}
        (low, lower), (high, higher) = SMALLEST, LARGEST
        return whole(given.get("width"), low, low, high), whole(given.get("height"), lower, lower, higher)

    def _show(self, name: str, value: Any) -> None:
        with self.state:
            self.state.error_figures = ""
            self._viewer.fresh("figures")
            self.state[name] = value


def _line_svg(
    shown: Brdf,
    other: Brdf | None,
    chart: Chart,
    axis: int,
    at: tuple[float, float, float],
    width: int,
    height: int,
    theme: Theme,
    scale: Any,
) -> str:
    line = iso_line(shown, other, chart=chart, axis=axis, at=at)
    return draw_iso_line(line, width=width, height=height, theme=theme, scale=scale)


def _albedo_svg(shown: SplineBrdf, other: Brdf | None, width: int, height: int, theme: Theme) -> str:
    reference = albedo_curve(other) if isinstance(other, SplineBrdf) else None
    return draw_albedo(albedo_curve(shown, reference), width=width, height=height, theme=theme)
