"""Areas of the page that show pictures made here: scenes that are turned and clicked, and ready-made pictures.

Each is what trame-rca calls a remote controlled area: it is told its size and what the mouse does, and asked for its
pixels, first at once and then, when nothing has moved for a moment, once more for a picture to keep.

VTK is used in one thread alone, that of the page's events. It frees objects under a lock of its own, and tells Python
of it there; another thread that holds the interpreter and makes or frees an object meanwhile waits for that lock, and
neither ever goes on. What is made in other threads is arrays.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bvbedit_gui.given import real, whole

if TYPE_CHECKING:
    from pyvista import Plotter

Pixels = NDArray[np.uint8]
# Pixels that an area may have along a side.
SMALLEST, LARGEST = 16, 8192
# A press and a release within so many pixels are a click; beyond that something was dragged.
CLICK = 4
# Samples of a pixel in pictures that have come to rest; while something moves, they would take half as long again.
SAMPLES = 8


def _size(width: Any, height: Any) -> tuple[int, int]:
    return whole(width, SMALLEST, SMALLEST, LARGEST), whole(height, SMALLEST, SMALLEST, LARGEST)


class SceneArea:
    """A PyVista plotter: dragging turns it, a click is reported. Smoothed only when it has come to rest."""

    def __init__(
        self,
        plotter: "Plotter",
        clicked: Callable[[float, float, bool], object],
        resized: Callable[[], object],
        touched: Callable[[], object] = lambda: None,
    ) -> None:
        from trame_rca.rca import VtkRemoteControlledArea

        self._plotter = plotter
        plotter.disable_anti_aliasing()
        window: Any = plotter.render_window
        window.SetMultiSamples(0)
        self._render_window = window
        self._window = VtkRemoteControlledArea(self._render_window)
        self._clicked, self._resized, self._touched = clicked, resized, touched
        self._pressed: tuple[float, float] | None = None
        self._moved = True
        self.drawn = 0

    def moved(self) -> None:
        """Say that the next picture is one of many."""
        self._moved = True

    @property
    def img_cols_rows(self) -> tuple[Pixels, int, int]:
        """Pixels (rows, columns, 3), columns and rows."""
        # Larger pictures that are scaled down (ssaa) would blur the text.
        self._render_window.SetMultiSamples(0 if self._moved else SAMPLES)
        self._moved = False
        self.drawn += 1
        pixels: tuple[Pixels, int, int] = self._window.img_cols_rows
        return pixels

    def process_resize_event(self, width: int, height: int) -> None:
        """Take another size, in pixels."""
        self.moved()
        size = _size(width, height)
        if tuple(self._plotter.window_size) != size:
            self._window.process_resize_event(*size)
            self._resized()

    def process_interaction_event(self, event: dict[str, Any]) -> None:
        """Turn the scene, or report a click with its place and whether the shift key was down."""
        self.moved()
        self._touched()
        kind = event.get("type")
        if not isinstance(kind, str):
            return
        here = real(event.get("x"), -1.0), real(event.get("y"), -1.0)
        if kind == "LeftButtonPress":
            self._pressed = here
        self._window.process_interaction_event(event)
        if kind == "LeftButtonRelease" and self._pressed is not None:
            x, y = self._pressed
            self._pressed = None
            if np.hypot(here[0] - x, here[1] - y) <= CLICK:
                self._clicked(x, y, bool(event.get("shiftKey")))


class PictureArea:
    """A picture, as large as its area allows, in the middle of it."""

    def __init__(self, resized: Callable[[int, int], object]) -> None:
        self.size = (320, 240)
        self.background = (0, 0, 0)
        self._resized = resized
        self._picture: Pixels | None = None
        self.drawn = 0

    def show(self, picture: Pixels | None) -> None:
        """Show another picture (h, w, 3), or nothing."""
        self._picture = picture

    @property
    def img_cols_rows(self) -> tuple[Pixels, int, int]:
        """Pixels (rows, columns, 3), columns and rows."""
        from PIL import Image

        width, height = self.size
        out = np.empty((height, width, 3), dtype=np.uint8)
        out[:] = self.background
        self.drawn += 1
        picture = self._picture
        if picture is not None:
            h, w = picture.shape[:2]
            scale = min(width / w, height / h)
            size = max(1, round(w * scale)), max(1, round(h * scale))
            if size != (w, h):
                picture = np.asarray(Image.fromarray(picture).resize(size, Image.Resampling.BICUBIC))
            left, top = (width - size[0]) // 2, (height - size[1]) // 2
            out[top : top + size[1], left : left + size[0]] = picture
        return out, width, height

    def process_resize_event(self, width: int, height: int) -> None:
        """Take another size, in pixels."""
        size = _size(width, height)
        if size != self.size:
            self.size = size
            self._resized(*size)

    def process_interaction_event(self, event: dict[str, Any]) -> None:
        """Nothing can be done with a picture."""
