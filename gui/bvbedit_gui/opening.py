"""Opening and closing materials: files of the folder, samples, what was kept when the viewer ended."""

import asyncio
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from bvbedit.edit.autosave import autosave_path, discard_autosave
from bvbedit.errors import BvbError
from bvbedit_gui import places as files
from bvbedit_gui.given import one_of
from bvbedit_gui.session import Opened, kept_files, opened_file, opened_recovered, opened_sample, samples

if TYPE_CHECKING:
    from bvbedit_gui.viewer import Viewer

STARTS: dict[str, Any] = {
    "documents": [],
    "current": None,
    "closing": None,
    "material_files": [],
    "model_files": [],
    "scene_files": [],
    "kept_files": [],
    "opening": "",
}


class Opening:
    """What is open, and how that changes."""

    def __init__(self, viewer: "Viewer") -> None:
        self._viewer = viewer
        self.state = viewer.state
        self.state.update(STARTS)
        self.state.samples = [{"name": name, "about": about} for name, about in samples().items()]
        # Not the page's variable, which a page may set to anything.
        self._opening = ""
        self.state.folder = str(viewer.session.places.folder)
        self.state.change("current")(self._current_changed)
        self.state.change("dialog")(self._dialog_changed)

    def list_files(self) -> None:
        """Look anew at which files there are."""
        here = self._viewer.session.places
        self.state.material_files = here.files(files.MATERIALS)
        self.state.model_files = here.files(files.MODELS)
        self.state.scene_files = here.files(files.SCENES)
        self.state.kept_files = [
            here.shown(path) for path in kept_files(here) if path not in self._viewer.session.keeping
        ]

    async def open_file(self, name: str) -> None:
        """Open a file: a model to edit, or a measurement to fit."""
        with self._viewer.telling("open"):
            path = self._viewer.session.places.path(name, files.MATERIALS)
            known = self._viewer.session.find(path)
            if known is not None:
                self.go_to(known)
                return
            if self._opening:
                raise BvbError(f"{self._opening} is being opened. Wait a moment.")
            self._opening = self.state.opening = name
            self.state.flush()
            loop = asyncio.get_running_loop()
            try:
                self._opened(await loop.run_in_executor(self._viewer.pool, opened_file, path, path.name))
            finally:
                self._opening = self.state.opening = ""

    @property
    def kept_here(self) -> str:
        """The name of the file that is worked on, if something of it was kept when the viewer ended before."""
        session = self._viewer.session
        path = None if session.current is None else session.here.path
        return session.places.shown(path) if path is not None and session.was_kept(path) else ""

    def open_sample(self, name: str) -> None:
        """Open a sample material, to be fitted."""
        with self._viewer.telling("open"):
            self._opened(opened_sample(name))

    async def recover(self, name: str) -> None:
        """Open what was kept of a file when the program ended."""
        with self._viewer.telling("open"):
            path = self._viewer.session.places.path(name, files.MODELS)
            if not self._viewer.session.places.allowed(autosave_path(path)):
                raise BvbError(f"What was kept of {name} is a link to elsewhere. Remove it.")
            known = self._viewer.session.find(path)
            compared: dict[str, Any] = {}
            if known is not None:
                here = self._viewer.session[known]
                if here.unsaved:
                    raise BvbError(f"{name} is open, and has changes. Save it under another name, or close it.")
                compared = {n: getattr(here, n) for n in ("reference", "reference_name", "measurement")}
                self._viewer.session.close(known)
            loop = asyncio.get_running_loop()
            opened = await loop.run_in_executor(self._viewer.pool, opened_recovered, path, path.name)
            if opened is None:
                raise BvbError(f"Nothing was kept of {name}.")
            self._opened(replace(opened, **compared))

    def discard_kept(self, name: str) -> None:
        """Remove what was kept of a file."""
        with self._viewer.telling("open"):
            discard_autosave(self._viewer.session.places.path(name, files.MODELS))
        self.list_files()
        self._viewer.synchronise()

    def _opened(self, opened: Opened) -> None:
        self._viewer.session.add(opened)
        self._viewer.arrived()

    def go_to(self, key: int) -> None:
        self._viewer.session.current = key
        self._viewer.arrived()

    def _current_changed(self, current: Any, **_: Any) -> None:
        key = self._known(current)
        if key is not None and key != self._viewer.session.current:
            self.go_to(key)
        elif current != self._viewer.session.current:
            self.state.current = self._viewer.session.current

    def _dialog_changed(self, **_: Any) -> None:
        # Who leaves the dialogs about closing does not want to close: a later save is only a save.
        if self.state.dialog not in ("close", "save"):
            self.state.closing = None

    def _known(self, key: Any) -> int | None:
        """Return the key of an open document, or None for anything else that a page has sent."""
        return one_of(key, [known for known, _ in self._viewer.session], None)

    def close(self, key: int | None = None, *, discard: bool = False) -> None:
        """Close a document; what is unsaved is asked about first, unless it may be discarded."""
        with self._viewer.telling("open"):
            at = self._viewer.session.current if key is None else self._known(key)
            if at is None:
                return
            here = self._viewer.session[at]
            tried = self._viewer.editing.pending is not None and at == self._viewer.session.current
            if here.document is not None and (here.unsaved or tried) and not discard:
                self._viewer.session.current = at
                self.state.closing = at
                self.state.dialog = "close"
                self._viewer.changed()
                return
            self._viewer.session.close(at)
            self.state.closing = None
            self.list_files()
            self._viewer.arrived()
