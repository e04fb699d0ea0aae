"""The viewer without its page: what is shown, beside what, and what follows when that changes.

Everything happens in one event loop. What takes longer than a frame is done in threads, of which only the newest
result is wanted, or in the worker's process; both hand their results back to the loop. Each panel has an object of its
own, which owns its variables of the page.
"""

import asyncio
from collections.abc import Callable, Coroutine, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.charts import HALF_DIFF, Chart
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.edit.document import Document
from bvbedit_gui.editing import Editing
from bvbedit_gui.energy_view import EnergyView
from bvbedit_gui.figures_view import FiguresView
from bvbedit_gui.fit_view import FitView
from bvbedit_gui.given import one_of
from bvbedit_gui.latest import Latest
from bvbedit_gui.lobe_view import LobeView
from bvbedit_gui.opening import Opening
from bvbedit_gui.picking import Picking
from bvbedit_gui.preview_view import PreviewView
from bvbedit_gui.saving import Saving
from bvbedit_gui.session import Session
from bvbedit_gui.themes import THEMES
from bvbedit_gui.volume_view import VolumeView
from bvbedit_gui.words import of_error, of_history

# Where messages appear: beside what they are about.
PLACES = ("open", "save", "edit", "fit", "volume", "lobes", "preview", "figures")
PANELS = ("volume", "lobes", "figures", "preview")
# What the state of the page is compared with, besides the source material and other documents.
NOTHING, SOURCE, BEFORE = "nothing", "source", "before"
STARTS: dict[str, Any] = {
    "theme": "light",
    "dialog": "",
    "against": NOTHING,
    "against_items": [],
    "unsaved": False,
    "kept_here": "",
    "is_model": False,
    "axis_names": ["", "", ""],
    "toast": "",
    "maximised": "",
    "tab": "edit",
}


class Viewer:
    """The controls of the page and what they do. ``server`` is a trame server, whether it runs or not."""

    def __init__(self, server: Any, session: Session, *, passes: bool = True) -> None:
        self.server = server
        self.state = server.state
        self.session = session
        self._begun: set[asyncio.Task[None]] = set()
        # What the material can be compared with: what the page's variable stands for, and its name.
        self._others: list[tuple[str, str]] = []
        self.pool = ThreadPoolExecutor(3, thread_name_prefix="viewer")
        for place in PLACES:
            self.state[f"error_{place}"] = ""
        for panel in PANELS:
            self.state[f"stale_{panel}"] = False
        self.state.update(STARTS)
        theme = THEMES[self.state.theme]
        self.volume = VolumeView(self, theme)
        self.lobes = LobeView(self)
        self.preview = PreviewView(self, theme, passes=passes)
        self.figures = FiguresView(self)
        self.energy = EnergyView(self)
        self.picking = Picking(self)
        self.opening = Opening(self)
        self.editing = Editing(self)
        self.fitting = FitView(self)
        self.saving = Saving(self)
        self.state.change("theme")(self._theme_changed)
        self.state.change("against")(self._against_changed)

    def started(self, method: Callable[..., Coroutine[Any, Any, None]]) -> Callable[..., Coroutine[Any, Any, None]]:
        """Return what begins a method and does not wait for its end.

        What a page asks for is handled one after the other: who waited for a fit would not hear that it is to stop.
        """

        async def start(*args: Any, **options: Any) -> None:
            async def whole() -> None:
                with self.state:
                    await method(*args, **options)

            task = asyncio.get_running_loop().create_task(whole())
            # The loop itself would not hold it.
            self._begun.add(task)
            task.add_done_callback(self._begun.discard)
            # It goes as far as it can at once: what the page asks for next comes after that.
            await asyncio.sleep(0)

        return start

    def start(self) -> None:
        """Show what is open already. Needs a running event loop."""
        self.opening.list_files()
        with self.state:
            self.arrived()

    def show_dialog(self, name: str) -> None:
        """Open a dialog, or close the open one."""
        self.state.dialog = name
        self.opening.list_files()
        if name == "save":
            self.saving.propose()
        if name == "recipe":
            with self.telling("save"):
                self.state.recipe = self.session.recipe()

    # What is shown

    @property
    def shown(self) -> Brdf | None:
        """What all pictures show: the model as the edit that is being tried makes it, or as it is; or a measurement."""
        if self.editing.pending is not None:
            return self.editing.pending[2]
        return None if self.session.current is None else self.session.here.shown

    @property
    def document(self) -> Document | None:
        """What is worked on, if that is a model."""
        return None if self.session.current is None else self.session.here.document

    @property
    def other(self) -> Brdf | None:
        """What it is compared with, if with anything."""
        if self.session.current is None:
            return None
        here, against = self.session.here, self.state.against
        if against == SOURCE:
            return here.reference
        if against == BEFORE:
            return None if here.document is None else here.document.at(0)
        return next((o.shown for key, o in self.session if against == f"document {key}"), None)

    @property
    def other_name(self) -> str:
        """The name of what it is compared with."""
        return next((title for value, title in self._others if value == self.state.against), "")

    @property
    def chart(self) -> Chart:
        """The chart over whose box the volume is shown."""
        shown = self.shown
        return shown.chart if isinstance(shown, SplineBrdf) else HALF_DIFF

    def refresh(self) -> None:
        """Draw everything anew: the material is another one."""
        self.volume.refresh()
        self.lobes.refresh()
        self.preview.refresh()
        self.figures.refresh()
        self.energy.refresh()

    def latest(self, place: str, rest: float = 0.0) -> Latest:
        """Return a queue of length one in the viewer's threads, whose failures are told at ``place``."""
        return Latest(self.pool, lambda error: self.tell(place, error), lambda: self.preview.hold(), rest)

    def tell(self, place: str, error: Exception | None) -> None:
        """Show why something could not be done where it was asked for, or take the words away."""
        with self.state:
            self.state[f"error_{place}"] = "" if error is None else of_error(error)
            self.fresh(place)

    def fresh(self, panel: str) -> None:
        """Say that a panel shows what it is to show, or why not."""
        if panel in PANELS:
            self.state[f"stale_{panel}"] = False

    @contextmanager
    def telling(self, place: str) -> Iterator[None]:
        """Tell what goes wrong inside at ``place``."""
        self.state[f"error_{place}"] = ""
        try:
            yield
        except Exception as error:  # what is not told looks as if the button did nothing
            self.state[f"error_{place}"] = of_error(error)

    def synchronise(self) -> None:
        """Let the page know what is open, what was done to it, and what can be done."""
        state, session = self.state, self.session
        state.documents = [
            {"key": key, "name": o.name, "unsaved": o.unsaved, "model": o.document is not None} for key, o in session
        ]
        state.current = session.current
        here, document = None if session.current is None else session.here, self.document
        state.is_model = document is not None
        state.unsaved = any(o.unsaved for _, o in session)
        state.can_undo = document is not None and document.position > 0
        state.can_redo = document is not None and document.position < len(document.edits)
        state.history = [] if document is None else of_history(document)
        symbols = [name.replace("theta", "θ").replace("phi", "φ") for name in self.chart.axes]
        state.axis_names = symbols
        self._others = [(NOTHING, "nothing")]
        if here is not None and document is not None:
            if here.reference is not None:
                self._others.append((SOURCE, here.reference_name))
            self._others.append((BEFORE, "before the edits"))
        self._others += [(f"document {key}", o.name) for key, o in session if key != session.current]
        state.against_items = [{"value": value, "title": title} for value, title in self._others]
        if state.against not in [value for value, _ in self._others]:
            state.against = NOTHING
        self.fitting.synchronise(here)
        state.kept_here = self.opening.kept_here
        self.figures.synchronise()
        self.volume.synchronise()

    def changed(self) -> None:
        """The document is another one: show it, tell it, and keep it for the case of a crash."""
        self.editing.drop()
        self.synchronise()
        self.refresh()
        self.editing.try_edit()
        self.saving.keep_soon()

    def arrived(self) -> None:
        """Another material is worked on: show it beside its source, and what can be done with it."""
        state = self.state
        state.dialog = ""
        state.against = NOTHING
        self.volume.forget_view()
        self.fitting.forget()
        # What is still seen is another material.
        state.update({f"stale_{panel}": self.session.current is not None for panel in PANELS})
        if self.session.current is not None:
            here = self.session.here
            if here.document is None:
                state.update({"tab": "fit", "fit_of": "source"})
            elif here.reference is not None:
                state.against = SOURCE
        self.changed()

    def _theme_changed(self, **_: Any) -> None:
        theme = THEMES[one_of(self.state.theme, THEMES, "light")]
        self.volume.recolour(theme)
        self.preview.recolour(theme)
        self.figures.refresh()

    def _against_changed(self, **_: Any) -> None:
        self.volume.synchronise()
        self.refresh()

    async def settled(self) -> None:
        """Return when all pictures show what they are to show, but for later passes of the preview."""
        while True:
            views = (self.editing, self.volume, self.lobes, self.figures, self.energy, self.saving)
            queues = [view.queue for view in views]
            busy = [queue for queue in queues if queue.busy]
            if not busy and not self.preview.first_pass_due:
                return
            for queue in busy:
                await queue.done()
            await asyncio.sleep(0.005)

    def end(self) -> None:
        """Keep what is unsaved, and end threads and processes."""
        self.saving.close()
        self.fitting.worker.close()
        self.preview.close()
        self.pool.shutdown(wait=True, cancel_futures=True)
        self.volume.close()
        self.lobes.close()
