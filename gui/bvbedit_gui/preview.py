"""The preview: a picture at once after an edit, from rays that were traced before, then better and better ones.

Runs in a thread of its own, one picture after the other; what is newly asked for ends what is being made.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from threading import Condition, Thread
from time import monotonic, sleep
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.geometry import Bools, Floats
from bvbedit.errors import BvbError
from bvbedit.render.image_metrics import PictureComparison, compare_pictures
from bvbedit.render.integrator import Picture, render_passes
from bvbedit.render.prepared import PreparedScene
from bvbedit.render.tonemap import tone_map

Layout = Literal["alone", "beside", "difference"]
# Samples of the picture that is shown at once, and of the last one.
FIRST, LAST = 1, 64
# Until so many samples the picture from traced rays is less noisy, or as good.
BETTER = 2
# Differences are amplified until the largest is white, but no more than this: beyond, it is noise of the last bit.
LARGEST_GAIN = 64
GAP = 4
# Seconds that later passes rest after something was moved, and between looks at whether that is over.
HOLD, PAUSE = 0.4, 0.02


@dataclass(frozen=True)
class Wish:
    """What is to be seen."""

    model: Brdf
    other: Brdf | None
    scene: str | Path
    side: int
    """Pixels of a picture along each side."""
    last: int = LAST
    names: tuple[str, str] = ("", "")
    """Of the material and of what it is compared with, for words about the pictures."""


@dataclass(frozen=True)
class Seen:
    """The pictures so far, linear, and how many samples stand behind each pixel."""

    picture: Picture
    other: Picture | None
    samples: int
    noise: float
    """The standard error over the mean; infinite where it is not known yet."""


class Patient(Brdf):
    """A material that waits before it is evaluated, as long as ``wait`` does: in all threads that render it."""

    def __init__(self, material: Brdf, wait: Callable[[], object]) -> None:
        self._material, self._wait = material, wait
        self.reliable_elevation = material.reliable_elevation

    def evaluate_unit(self, wi: Floats, wo: Floats) -> tuple[Floats, Bools]:
        self._wait()
        return self._material.evaluate_unit(wi, wo)

    def _evaluate(self, wi: Floats, wo: Floats) -> tuple[Floats, Bools]:
        return self._material._evaluate(wi, wo)


class Overtaken(Exception):  # noqa: N818  (it is no error: something newer was asked for)
    """What is being made is not wanted any more."""


class Preview:
    """Makes the pictures of the newest wish; ``publish`` is called in its thread with each, ``failed`` with words."""

    def __init__(
        self, publish: Callable[[Wish, Seen], object], failed: Callable[[Wish, str], object], *, passes: bool = True
    ) -> None:
        self._publish, self._failed = publish, failed
        self._passes = passes
        self._wish: Wish | None = None
        self._done: Wish | None = None
        self._ended = False
        self._held = 0.0
        self._changed = Condition()
        self._prepared: dict[tuple[str, int, int], PreparedScene] = {}
        self._thread = Thread(target=self._work, name="preview", daemon=True)
        self._thread.start()

    def ask(self, wish: Wish) -> None:
        """Make the pictures of this wish, and leave what was wished before."""
        with self._changed:
            self._wish = wish
            self._changed.notify_all()

    def hold(self) -> None:
        """Let later passes rest a moment: who moves something waits for another picture."""
        self._held = monotonic() + HOLD

    @property
    def busy(self) -> bool:
        """Whether the newest wish is still being worked on."""
        with self._changed:
            return self._wish is not None and self._wish is not self._done

    def close(self) -> None:
        """End the thread."""
        with self._changed:
            self._ended = True
            self._changed.notify_all()
        self._thread.join(10)

    def _work(self) -> None:
        while True:
            with self._changed:
                while not self._ended and (self._wish is None or self._wish is self._done):
                    self._changed.wait()
                if self._ended:
                    return
                wish = self._wish
            assert wish is not None
            try:
                self._make(wish)
            except Overtaken:
                continue
            except BvbError as error:
                self._failed(wish, str(error))
            except MemoryError:
                self._failed(wish, "Not enough memory for the preview. Make the window smaller.")
            except Exception as error:  # a thread that dies would leave the page without a preview, and without a word
                self._failed(wish, f"The preview failed unexpectedly: {error!r}. Please report this.")
            with self._changed:
                self._done = wish

    def _check(self, wish: Wish) -> None:
        with self._changed:
            if self._ended or self._wish is not wish:
                raise Overtaken

    def _make(self, wish: Wish) -> None:
        prepared = self._scene(wish)
        self._check(wish)
        first = prepared.shade(wish.model)
        self._publish(wish, Seen(first, None if wish.other is None else prepared.shade(wish.other), FIRST, np.inf))
        if not self._passes:
            return

        def go_on(_: float = 0.0) -> None:
            self._check(wish)
            while monotonic() < self._held:
                sleep(PAUSE)
                self._check(wish)

        go_on()
        options: dict[str, Any] = {
            "width": wish.side,
            "height": wish.side,
            "spp": wish.last,
            "progress": go_on,
            "density": wish.model.density,
        }
        ours = render_passes(Patient(wish.model, go_on), wish.scene, **options)
        theirs = None if wish.other is None else render_passes(Patient(wish.other, go_on), wish.scene, **options)
        for estimate in ours:
            beside = None if theirs is None else next(theirs).picture
            if estimate.samples > BETTER:
                seen = Seen(estimate.picture, beside, estimate.samples, estimate.relative_noise)
                self._check(wish)
                self._publish(wish, seen)

    def _scene(self, wish: Wish) -> PreparedScene:
        """Return the scene's rays, traced once for each scene and size; a few are kept."""
        # A scene's file may have been changed since.
        changed = wish.scene.stat().st_mtime_ns if isinstance(wish.scene, Path) and wish.scene.exists() else 0
        key = str(wish.scene), changed, wish.side
        if key not in self._prepared:
            while len(self._prepared) > 1:
                del self._prepared[next(iter(self._prepared))]
            self._prepared[key] = PreparedScene(
                wish.model, wish.scene, width=wish.side, height=wish.side, spp=FIRST, density=wish.model.density
            )
        return self._prepared[key]


def composed(seen: Seen, layout: Layout, exposure: float) -> tuple[NDArray[np.uint8], PictureComparison | None, float]:
    """Return the 8-bit picture of a layout, how far the two pictures differ, and by how much that is amplified."""
    ours = tone_map(seen.picture, exposure)
    if seen.other is None or layout == "alone":
        return ours, None, 1.0
    theirs = tone_map(seen.other, exposure)
    found = compare_pictures(seen.picture, seen.other, exposure)
    gap = np.full((ours.shape[0], GAP, 3), 128, dtype=np.uint8)
    if layout == "beside":
        return np.concatenate([ours, gap, theirs], axis=1), found, 1.0
    difference = np.abs(ours.astype(np.int16) - theirs)
    gain = float(2 ** np.floor(np.log2(255 / max(int(difference.max()), 1))))
    gain = min(gain, LARGEST_GAIN)
    shown = np.minimum(difference * gain, 255).astype(np.uint8)
    return np.concatenate([ours, gap, theirs, gap, shown], axis=1), found, gain
