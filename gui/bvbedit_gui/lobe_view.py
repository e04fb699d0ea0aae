"""The lobes' panel: light from one elevation, and how it leaves the material."""

from typing import TYPE_CHECKING, Any

import numpy as np

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.encodings import Encoding, Linear, Log, Root
from bvbedit_gui import lobes
from bvbedit_gui.areas import SceneArea
from bvbedit_gui.drawing import number
from bvbedit_gui.given import one_of, real
from bvbedit_gui.lobe_scene import VIEWS, Beside, LobeScene

if TYPE_CHECKING:
    from bvbedit_gui.viewer import Viewer

TEXT_SIZE = 13
# At 90 degrees itself no reflectance exists.
HIGHEST = 89.0
SCALES: dict[str, Encoding] = {"linear": Linear(), "root": Root(), "log": Log()}
BESIDE: tuple[Beside, ...] = ("none", "wire", "beside")
STARTS: dict[str, Any] = {"theta_i": 45.0, "lobe_scale": "auto", "lobe_beside": "wire", "lobe_note": ""}


class LobeView:
    """Shows the lobe of what the viewer shows, and that of what it is compared with."""

    def __init__(self, viewer: "Viewer") -> None:
        import pyvista as pv

        self._viewer = viewer
        self.state = viewer.state
        self.state.update(STARTS)
        self.queue = viewer.latest("lobes")
        self.plotter = pv.Plotter(off_screen=True, window_size=[480, 360])
        self.scene = LobeScene(self.plotter, TEXT_SIZE)
        self.scene.look_from("oblique")
        self.area = SceneArea(self.plotter, lambda *_: None, self.scene.resized, lambda: viewer.preview.hold())
        self.send: Any = lambda: None
        self.state.change("theta_i", "lobe_scale", "lobe_beside")(lambda **_: self.refresh())

    def refresh(self) -> None:
        """Draw the lobes anew."""
        shown, other = self._viewer.shown, self._viewer.other
        if shown is None:
            return
        theta_i = float(np.radians(real(self.state.theta_i, 45.0, 0.0, HIGHEST)))
        beside: Beside = one_of(self.state.lobe_beside, BESIDE, "wire") if other is not None else "none"
        wanted = other if beside != "none" else None
        self.queue.ask(
            lambda: (_lobe(shown, theta_i), None if wanted is None else _lobe(wanted, theta_i)),
            lambda made: self._show(made[0], made[1], theta_i, beside),
        )

    def _show(self, lobe: lobes.Lobe, other: lobes.Lobe | None, theta_i: float, beside: Beside) -> None:
        peaks = [one.peak for one in (lobe, other) if one is not None]
        # A black material has no length to scale by.
        peak = max(peaks) or 1.0
        scale = SCALES.get(one_of(self.state.lobe_scale, SCALES, "auto")) or lobes.fitting_scale(lobe)
        self.scene.show(lobe, scale, peak, theta_i, other=other, beside=beside)
        with self.state:
            told = f"peak {number(peaks[0])}/sr, {WORDS[scale.name]} radius"
            if len(peaks) > 1:
                told += f"; compared: peak {number(peaks[1])}/sr"
            self.state.lobe_note = told
            self._viewer.fresh("lobes")
        self.draw()

    def look_from(self, view: str) -> None:
        """Look at the lobes from a side."""
        self.scene.look_from(one_of(view, VIEWS, "oblique"))
        self.draw()

    def draw(self) -> None:
        """Send a picture of the scene as it is now."""
        self.area.moved()
        self.send()

    def close(self) -> None:
        """Free the window."""
        self.plotter.close()


WORDS = {"linear": "linear", "root": "cube-root", "log": "logarithmic"}


def _lobe(brdf: Brdf, theta_i: float) -> lobes.Lobe:
    return lobes.lobe(brdf, theta_i, lobes.COARSER)
