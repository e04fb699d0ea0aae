"""The volume's panel: what of the field is shown, and the scene that shows it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.charts import Chart
from bvbedit.brdf.geometry import Floats
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit_gui import volume
from bvbedit_gui.areas import SceneArea
from bvbedit_gui.drawing import number
from bvbedit_gui.given import one_of, real, whole
from bvbedit_gui.themes import COLOUR_MAP, Theme
from bvbedit_gui.volume_scene import DIFFERENCE_MAP, VIEWS, VolumeScene

if TYPE_CHECKING:
    from pyvista import ImageData

    from bvbedit_gui.viewer import Viewer

TEXT_SIZE = 13
# Colours run a little beyond the values, so that the outermost surfaces do not take the map's extreme colours.
MARGIN = 0.3
# Marks of the colour bar are no closer than this, in per cent of it.
APART = 10.0
# Exponents that a value in 1/sr can have at all.
DECADES = (-12.0, 300.0)
STARTS: dict[str, Any] = {
    "what": "luminance",
    "what_items": [],
    "iso": -1.0,
    "iso_low": -3.0,
    "iso_high": 1.0,
    "iso_text": "",
    "iso_count": 3,
    "iso_gap": 1.0,
    "opacity": 0.55,
    "show_net": False,
    "show_knots": False,
    **{f"slice_{n}_on": False for n in range(3)},
    **{f"slice_{n}": 0.5 for n in range(3)},
    "mode": "turn",
    "bar_css": "",
    "bar_ticks": [],
    "bar_title": "",
}
TITLES: dict[volume.What, str] = {
    "luminance": "luminance",
    "red": "red channel",
    "green": "green channel",
    "blue": "blue channel",
    "difference": "difference",
}


@dataclass(frozen=True)
class _Drawn:
    """What a thread has made for the scene: arrays, no meshes, see ``areas``."""

    chart: Chart
    field: volume.Field
    net: tuple[Floats, Floats] | None
    knots_of: SplineBrdf | None
    slices: list[volume.Slice | None]


class VolumeView:
    """Shows iso-surfaces, slices, net and knots of what the viewer shows."""

    def __init__(self, viewer: "Viewer", theme: Theme) -> None:
        import pyvista as pv

        self._viewer = viewer
        self.state = viewer.state
        self.state.update(STARTS)
        self.queue = viewer.latest("volume")
        self.plotter = pv.Plotter(off_screen=True, window_size=[640, 480])
        self.scene = VolumeScene(self.plotter, theme, TEXT_SIZE)
        self.scene.look_from("oblique")
        self.area = SceneArea(self.plotter, viewer_clicked(viewer), self.scene.resized, lambda: viewer.preview.hold())
        # The page's view, once there is a page: asked to send a picture.
        self.send: Any = lambda: None
        self.field: volume.Field | None = None
        self.grid: ImageData | None = None
        self._unseen = True
        # The iso-value that the user has chosen, and the one in its place where the field does not span it: while a
        # blend is dragged there and back, the choice must not be lost.
        self._chosen = self._instead = float(STARTS["iso"])
        self._kept: tuple[Brdf, Chart, tuple[int, ...], Floats] | None = None
        on = self.state.change
        on("what")(lambda **_: self.refresh())
        on("iso")(lambda **_: self._choose())
        on("iso", "iso_count", "iso_gap", "opacity")(lambda **_: self.show_surfaces())
        on("show_net", "show_knots", *(f"slice_{n}{s}" for n in range(3) for s in ("", "_on")))(
            lambda **_: self.refresh()
        )

    def forget_view(self) -> None:
        """Choose iso-values anew when the next material is shown: it is another one."""
        self._unseen = True

    def synchronise(self) -> None:
        """Offer what can be shown; a difference needs something to differ from."""
        items = [{"value": value, "title": title} for value, title in TITLES.items()]
        if self._viewer.other is None:
            items.pop()
            if self.what == "difference":
                self.state.what = "luminance"
        self.state.what_items = items

    @property
    def what(self) -> volume.What:
        """What is asked for."""
        return one_of(self.state.what, TITLES, "luminance")

    def refresh(self) -> None:
        """Draw the volume anew."""
        shown, other, chart = self._viewer.shown, self._viewer.other, self._viewer.chart
        if shown is None:
            return
        state = self.state
        what = self.what if other is not None or self.what != "difference" else "luminance"
        slices = [real(state[f"slice_{n}"], 0.5, 0.0, 1.0) if state[f"slice_{n}_on"] else None for n in range(3)]
        wanted = bool(state.show_net), bool(state.show_knots)
        self.queue.ask(lambda: _draw(shown, chart, what, other, slices, *wanted, self._sampled), self._show)

    def _sampled(self, brdf: Brdf, chart: Chart, axes: tuple[Floats, Floats, Floats]) -> Floats:
        """Return what ``volume.sampled`` does, and keep it for the next time: what is compared with seldom changes."""
        sizes = tuple(len(axis) for axis in axes)
        if self._kept is None or self._kept[:3] != (brdf, chart, sizes):
            self._kept = brdf, chart, sizes, volume.sampled(brdf, chart, axes)
        return self._kept[3]

    def _show(self, drawn: _Drawn) -> None:
        self.field, self.grid = drawn.field, volume.grid(drawn.field)
        low, high = drawn.field.ends
        with self.state:
            self._viewer.fresh("volume")
            self._bounds(drawn.field, low, high)
            self._colours(drawn.field, low, high)
            self.scene.show_chart(drawn.chart)
            self.scene.show_net(*(drawn.net or (None,)))
            knots_of = drawn.knots_of
            self.scene.show_knots(None if knots_of is None else [volume.knot_planes(knots_of, n) for n in range(3)])
            for axis, plane in enumerate(drawn.slices):
                self.scene.show_slice(axis, None if plane is None else volume.slice_mesh(plane))
            self._viewer.picking.show_region()
            self.show_surfaces()

    def _bounds(self, drawn: volume.Field, low: float, high: float) -> None:
        """Let the slider span what the field spans, and stand at a value that shows something."""
        state = self.state
        first, last = float(np.floor(20 * np.log10(low)) / 20), float(np.ceil(20 * np.log10(high)) / 20)
        last = max(last, first + 0.1)
        if (state.iso_low, state.iso_high) != (first, last):
            state.update({"iso_low": first, "iso_high": last})
        values = volume.iso_values(low, high)
        if self._unseen:
            self._unseen = False
            gap = float(np.log10(values[1] / values[0])) if len(values) > 1 else 0.5
            bright = [v for v in values if v <= drawn.bright] or values[:1]
            top = float(np.log10(bright[-1])) if values else last
            state.update({"iso_gap": min(round(gap, 2), 2.0), "iso_count": min(len(values), 3)})
            self._chosen = round(top, 3)
        else:
            self._choose()
        state.iso = self._instead = real(self._chosen, first, first, last)

    def _choose(self) -> None:
        """Keep the iso-value that the user has chosen."""
        if self.state.iso != self._instead:
            self._chosen = self._instead = self.state.iso

    def _colours(self, field: volume.Field, low: float, high: float) -> None:
        from matplotlib import colormaps

        first, last = float(field.level(low)), float(field.level(high))
        if field.signed:
            first = -last
        else:
            first, last = first - MARGIN, last + MARGIN
        self.scene.colour_by(first, last, signed=field.signed)
        stops = colormaps[DIFFERENCE_MAP if field.signed else COLOUR_MAP](np.linspace(0, 1, 17), bytes=True)
        css = ", ".join(f"rgb({r},{g},{b})" for r, g, b, _ in stops)
        values = volume.iso_values(low, high) or [high]
        # The largest values come first: they keep their marks where others would be too close.
        marks = [0.0, *(sign * v for v in values[::-1] for sign in (1, -1))] if field.signed else values[::-1]
        ticks: list[dict[str, Any]] = []
        for value in marks:
            at = round(100 * (float(field.level(value)) - first) / (last - first), 2)
            if all(abs(at - tick["at"]) >= APART for tick in ticks):
                ticks.append({"at": at, "text": number(value)})
        state = self.state
        state.bar_css = f"linear-gradient(to right, {css})"
        state.bar_ticks = ticks
        title = TITLES[self.what]
        state.bar_title = f"{title} of f, 1/sr" if not field.signed else "luminance: more (+) or less (-), 1/sr"

    @property
    def iso_values(self) -> list[float]:
        """The values of the surfaces, 1/sr: the slider's, and below it as many as are asked for."""
        state = self.state
        iso, gap = real(state.iso, 0.0, *DECADES), real(state.iso_gap, 1.0, 0.01, 10.0)
        count = whole(state.iso_count, 1, 1, volume.MOST_SURFACES)
        return [10 ** (iso - k * gap) for k in range(count) if iso - k * gap >= np.log10(volume.FLOOR)]

    def show_surfaces(self) -> None:
        """Show the surfaces of the values that are asked for."""
        if self.field is None or self.grid is None:
            return
        self._viewer.preview.hold()
        values = self.iso_values
        self.state.iso_text = ", ".join(number(v) for v in values)
        opacity = real(self.state.opacity, 0.5, 0.02, 1.0)
        self.scene.show_surfaces(volume.iso_surfaces(self.field, self.grid, values), opacity)
        self.draw()

    def look_from(self, view: str) -> None:
        """Look at the box from a side."""
        self.scene.look_from(one_of(view, VIEWS, "oblique"))
        self.draw()

    def recolour(self, theme: Theme) -> None:
        """Take other colours for paper and ink."""
        self.scene.recolour(theme)
        self.draw()

    def draw(self) -> None:
        """Send a picture of the scene as it is now."""
        self.area.moved()
        self.send()

    def close(self) -> None:
        """Free the window."""
        self.plotter.close()


def viewer_clicked(viewer: "Viewer") -> Any:
    """Return what is called with a place on the picture and whether shift was down."""
    return lambda x, y, shift: viewer.picking.clicked(x, y, shift)


def _draw(
    shown: Brdf,
    chart: Chart,
    what: volume.What,
    other: Brdf | None,
    slices: list[float | None],
    with_net: bool,
    with_knots: bool,
    sample: Callable[[Brdf, Chart, tuple[Floats, Floats, Floats]], Floats],
) -> _Drawn:
    field = volume.field(shown, chart, what, other, sample)
    # Here, in a thread, and not when the page waits for surfaces.
    _ = field.ends, field.bright, field.levels
    net, knots_of = None, None
    if isinstance(shown, SplineBrdf):
        if with_net:
            plain = volume.Field(field.values)
            net = volume.net_points(shown), plain.level(volume.net_values(shown, what))
        if with_knots:
            knots_of = shown
    planes = [
        None if at is None else volume.slice_at(shown, chart, axis, at, what, other) for axis, at in enumerate(slices)
    ]
    return _Drawn(chart, field, net, knots_of, planes)
