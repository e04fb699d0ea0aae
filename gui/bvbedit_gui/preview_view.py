"""The preview's panel: which scene, how bright, and beside what the picture stands."""

import asyncio
from typing import TYPE_CHECKING, Any

from bvbedit.brdf.base import Brdf
from bvbedit_gui import places as files
from bvbedit_gui.areas import PictureArea
from bvbedit_gui.given import one_of, real
from bvbedit_gui.preview import GAP, Layout, Preview, Seen, Wish, composed
from bvbedit_gui.themes import Theme

if TYPE_CHECKING:
    from bvbedit_gui.viewer import Viewer

SCENES = ("sphere", "studio", "furnace")
LAYOUTS: tuple[Layout, ...] = ("alone", "beside", "difference")
# Sides of the pictures that are rendered; they are scaled to the panel.
SIDES = (128, 192, 256, 320, 384, 512)
STARTS: dict[str, Any] = {
    "scene": "sphere",
    "exposure": 0.0,
    "layout": "beside",
    "preview_names": "",
    "preview_note": "",
}


class PreviewView:
    """Shows the picture of what the viewer shows, and that of what it is compared with."""

    def __init__(self, viewer: "Viewer", theme: Theme, *, passes: bool) -> None:
        self._viewer = viewer
        self.state = viewer.state
        self.state.update(STARTS)
        self.area = PictureArea(lambda *_: self._resized())
        self.area.background = _rgb(theme.paper)
        self.send: Any = lambda: None
        self.seen: Seen | None = None
        self._wish: Wish | None = None
        self._shown: Wish | None = None
        self._names = "", ""
        self._loop: asyncio.AbstractEventLoop | None = None
        self._preview = Preview(self._published, self._failed, passes=passes)
        self.state.change("scene")(lambda **_: self.refresh())
        self.state.change("layout")(lambda **_: self.refresh())
        self.state.change("exposure")(lambda **_: self.compose())

    def hold(self) -> None:
        """Let later passes rest a moment."""
        self._preview.hold()

    @property
    def first_pass_due(self) -> bool:
        """Whether the newest wish has no picture yet."""
        return self._wish is not self._shown

    @property
    def layout(self) -> Layout:
        """The layout that is asked for."""
        return one_of(self.state.layout, LAYOUTS, "alone")

    def refresh(self) -> None:
        """Make the picture anew."""
        shown = self._viewer.shown
        if shown is None:
            return
        other = None if self.layout == "alone" else self._viewer.other
        try:
            self._loop = asyncio.get_running_loop()
        except RuntimeError:
            return  # nobody could be told of the picture
        scene = self.state.scene
        if scene not in SCENES:
            with self._viewer.telling("preview"):
                scene = self._viewer.session.places.path(str(scene), files.SCENES)
            if self.state.error_preview:
                # Later passes of what was seen before would take the words away.
                self._wish = self._shown = None
                self._viewer.fresh("preview")
                return
        side = self._side(self._beside(other))
        names = self._viewer.session.here.name, self._viewer.other_name
        wish = Wish(shown, other, scene, side, names=names)
        self._wish = wish
        self._preview.ask(wish)

    def _resized(self) -> None:
        # Pictures that would be of the same size again are not made again: words that come with them could change the
        # room that they have, and so for ever.
        if self._wish is None or self._wish.side != self._side(self._beside(self._wish.other)):
            self.refresh()
        else:
            self.send()

    def _beside(self, other: Brdf | None) -> int:
        """Return how many pictures stand beside one another."""
        return 1 if other is None else 2 if self.layout == "beside" else 3

    def _side(self, beside: int) -> int:
        width, height = self.area.size
        room = min(height, (width - (beside - 1) * GAP) / beside)
        return max((side for side in SIDES if side <= room * 1.1), default=SIDES[0])

    def _published(self, wish: Wish, seen: Seen) -> None:
        loop = self._loop
        if loop is not None and not loop.is_closed():
            loop.call_soon_threadsafe(self._show, wish, seen)

    def _failed(self, wish: Wish, told: str) -> None:
        loop = self._loop
        if loop is not None and not loop.is_closed():
            loop.call_soon_threadsafe(self._tell, wish, told)

    def _tell(self, wish: Wish, told: str) -> None:
        self._shown = wish
        with self.state:
            self.state.error_preview = told
            self._viewer.fresh("preview")

    def _show(self, wish: Wish, seen: Seen) -> None:
        if wish is not self._wish:
            return
        self.seen, self._shown, self._names = seen, wish, wish.names
        with self.state:
            self.state.error_preview = ""
            self._viewer.fresh("preview")
            self.compose()

    def compose(self) -> None:
        """Lay the pictures out, at the exposure that is asked for."""
        seen = self.seen
        if seen is None:
            return
        exposure = real(self.state.exposure, 0.0, -10.0, 10.0)
        picture, found, gain = composed(seen, self.layout, exposure)
        names, note = self._names[0], f"{seen.samples} sample{'' if seen.samples == 1 else 's'} a pixel"
        if found is not None:
            parts = list(self._names)
            if self.layout == "difference":
                parts.append("their difference" + (f" x {gain:.0f}" if gain > 1 else ""))
            names = f"From the left: {', '.join(parts)}"
            note += f"; MAE {255 * found.mae:.2f}, PAE {255 * found.pae:.0f} of 255, at {seen.picture.shape[0]} pixels"
        self.state.preview_names = names
        self.state.preview_note = note
        self.area.show(picture)
        self.send()

    def recolour(self, theme: Theme) -> None:
        """Take another colour for the paper."""
        self.area.background = _rgb(theme.paper)
        self.send()

    def close(self) -> None:
        """End the thread."""
        self._preview.close()


def _rgb(colour: str) -> tuple[int, int, int]:
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)
