"""The scene of the lobes: how light from one direction leaves a model, and the material that it is compared with."""

from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from bvbedit.brdf.encodings import Encoding
from bvbedit.brdf.geometry import Floats, spherical
from bvbedit_gui import lobes
from bvbedit_gui.drawing import Point, add_arrow, add_ground, look, number, write_at
from bvbedit_gui.lobes import Lobe

if TYPE_CHECKING:
    from pyvista import Actor, Plotter

# Lobes are coloured at full brightness: white paint and chrome would vanish on white, so it is night in all themes.
NIGHT, CHALK, FAINT = "#33373d", "#eceff1", "#767d85"
LIGHT, MIRROR = "#ffb000", "#56b4e9"
LOBE_EYE, LOBE_FOCUS = (0.9, -4.0, 1.7), (0.0, 0.0, 0.46)
# How far apart lobes stand that are shown beside one another.
APART = 2.1
VIEWS: dict[str, tuple[Point, Point]] = {
    "oblique": (LOBE_EYE, LOBE_FOCUS),
    "side": ((0.0, -4.0, 0.47), (0.0, 0.0, 0.46)),
    "top": ((0.0, -0.001, 4.0), (0.0, 0.0, 0.46)),
}
Beside = Literal["none", "wire", "beside"]


class LobeScene:
    """Shows the lobe of a model, and another one as a wire over it or beside it, in one renderer of a plotter."""

    def __init__(self, plotter: "Plotter", text_size: int) -> None:
        self.plotter = plotter
        self.text_size = text_size
        plotter.renderer.set_background(NIGHT)
        style: dict[str, Any] = {"rgb": True, "specular": 0.0, "show_scalar_bar": False, "reset_camera": False}
        self._model = self._actor("model", ambient=0.45, diffuse=0.6, **style)
        self._model.prop.interpolation = "Phong"
        self._other = self._actor("other", ambient=0.45, diffuse=0.6, **style)
        self._other.prop.interpolation = "Phong"
        self._width = 1.3
        self._view = "oblique"
        # What is written at the rings and where: to write anew takes as long as to draw.
        self._written: dict[int, tuple[object, ...]] = {}

    def _actor(self, name: str, **style: Any) -> "Actor":
        import pyvista as pv

        placeholder = pv.PolyData(np.zeros((1, 3)))
        placeholder.point_data[lobes.COLOUR] = np.zeros((1, 3), dtype=np.uint8)
        actor: Actor = self.plotter.add_mesh(placeholder, name=name, scalars=lobes.COLOUR, **style)
        actor.visibility = False
        return actor

    def show(
        self,
        lobe: Lobe,
        scale: Encoding,
        peak: float,
        theta_i: float,
        *,
        other: Lobe | None = None,
        beside: Beside = "none",
    ) -> None:
        """Show a lobe with its ground grid and the incident and mirror directions.

        ``peak`` (1/sr) is the length drawn as radius 1, so that lobes shown with one peak and one scale can be
        compared; what is longer is cut there. ``theta_i`` in radians. ``other`` is a second lobe, as a wire over the
        first or beside it.
        """
        vertices = lobes.points(lobe, scale, peak)
        self._model.mapper.dataset = lobes.surface(lobe, vertices)
        self._model.visibility = True
        self._other.visibility = other is not None and beside != "none"
        shift = APART if self._other.visibility and beside == "beside" else 0.0
        self._model.position = (-shift / 2, 0.0, 0.0)
        if other is not None and beside != "none":
            mesh_of = lobes.wire if beside == "wire" else lobes.surface
            self._other.mapper.dataset = mesh_of(other, lobes.points(other, scale, peak))
            self._other.position = (shift / 2, 0.0, 0.0)
        self._ground(scale, peak, vertices, shift)
        self._directions(theta_i, shift)
        width = 1.3 + shift / 2
        if width != self._width:
            self._width = width
            self.look_from(self._view)

    def look_from(self, view: str) -> None:
        """Look at the lobes from one of ``VIEWS``."""
        self._view = view
        eye, focus = VIEWS[view]
        look(self.plotter, eye, focus, half_height=0.9 if view != "top" else 1.3, half_width=self._width)

    def resized(self) -> None:
        """Let the lobes fill the picture, which has another size now."""
        self.look_from(self._view)

    def _ground(self, scale: Encoding, peak: float, vertices: Floats, shift: float) -> None:
        small = round(0.85 * self.text_size)
        marks = lobes.rings(scale, peak)
        middles = (0.0,) if shift == 0 else (-shift / 2, shift / 2)
        add_ground(self.plotter, [radius for _, radius in marks], middles, FAINT, self.text_size)
        for n, (length, radius) in enumerate(marks):
            # Front left: beside the lobe, and the rings are well apart there.
            at = radius * spherical(np.pi / 2, np.radians(-140.0))
            hidden = lobes.hides(vertices, at, np.subtract(LOBE_EYE, LOBE_FOCUS))
            place = at - [shift / 2, 0.0, 0.0]
            told = ("", *place) if hidden else (number(length), *place)
            if self._written.get(n) != told:
                self._written[n] = told
                write_at(self.plotter, place[None], [told[0]] if told[0] else [], CHALK, small, f"ring {n}")

    def _directions(self, theta_i: float, shift: float) -> None:
        incident, mirror = spherical(theta_i, np.pi), spherical(theta_i, 0.0)
        # Side by side where they would cover one another.
        apart = np.array([0.06 if np.sin(theta_i) < 0.06 else 0.0, 0.0, 0.0])
        middle = np.array([-shift / 2, 0.0, 0.0])
        add_arrow(self.plotter, 1.25 * incident - apart + middle, 1.02 * incident - apart + middle, LIGHT, "light")
        add_arrow(self.plotter, 1.02 * mirror + apart + middle, 1.25 * mirror + apart + middle, MIRROR, "mirror")
