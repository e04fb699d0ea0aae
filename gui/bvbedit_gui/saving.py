"""Saving, exporting, and keeping what is unsaved for the case of a crash."""

import asyncio
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bvbedit.errors import BvbError
from bvbedit.io.export import TABLES, export
from bvbedit_gui import places as files
from bvbedit_gui.given import one_of
from bvbedit_gui.latest import Latest
from bvbedit_gui.session import Opened

if TYPE_CHECKING:
    from bvbedit_gui.viewer import Viewer

PRECISIONS = ("as it is", "quantised", "float16", "float32", "float64")
# Seconds of quiet after which unsaved work is kept.
KEEPING = 1.0
STARTS: dict[str, Any] = {
    "save_name": "",
    "save_precision": "as it is",
    "save_pdf": False,
    "save_confirm": "",
    "saving": False,
    "recipe": "",
}


class Saving:
    """Writes the document that is worked on, where and how the page says."""

    def __init__(self, viewer: "Viewer") -> None:
        self._viewer = viewer
        self.state = viewer.state
        self.state.update(STARTS)
        # Not the page's variable, which a page may set to anything.
        self._busy = False
        self._due: asyncio.TimerHandle | None = None
        self._keepers = ThreadPoolExecutor(1, thread_name_prefix="keep")
        self.queue = Latest(self._keepers, lambda error: viewer.tell("save", error))

    def propose(self) -> None:
        """Fill in the dialog of saving."""
        if self._viewer.session.current is not None:
            self.state.save_name = self._proposed_name(self._viewer.session.here)
            self.state.save_confirm = ""

    def _proposed_name(self, here: Opened) -> str:
        if here.path is None:
            return f"{Path(here.name).stem}.bvb"
        if here.document is not None and here.document.needs(here.path):
            # Saved over what it began with, the history could not be replayed.
            return self._viewer.session.places.shown(here.path.with_stem(f"{here.path.stem}-edited"))
        return self._viewer.session.places.shown(here.path)

    async def save(self) -> None:
        """Save to the document's file; ask for a name where there is none, or where the history needs that file."""
        if self._viewer.session.current is None:
            return
        here = self._viewer.session.here
        if here.path is None or (here.document is not None and here.document.needs(here.path)):
            self._viewer.show_dialog("save")
            return
        await self._save_model(here.path, None, pdf=False)

    async def save_as(self, *, over: bool = False) -> None:
        """Save, or export, under the name in the dialog; another file is replaced only when that was confirmed."""
        with self._viewer.telling("save"):
            name = str(self.state.save_name).strip()
            if name and not Path(name).suffix:
                name += ".bvb"
            path = self._viewer.session.places.path(name, (*files.MODELS, *TABLES))
            if path.exists() and path != self._viewer.session.here.path and not over:
                self.state.save_confirm = f"{name} exists. Replace it?"
                return
            self.state.save_confirm = ""
            if path.suffix.lower() in TABLES:
                await self._export(path)
                return
            precision = one_of(self.state.save_precision, PRECISIONS, "as it is")
            await self._save_model(
                path, None if precision == "as it is" else precision, pdf=self.state.save_pdf is True
            )

    async def _save_model(self, path: Path, precision: str | None, *, pdf: bool) -> None:
        with self._viewer.telling("save"):
            if self._busy:
                return
            self._check_settled()
            document, key = self._viewer.session.check_save(path), self._viewer.session.current
            assert key is not None  # there is a document
            self._busy = self.state.saving = True
            self.state.flush()
            try:
                # Its density may have to be built first, and a network's disk be waited for.
                await asyncio.get_running_loop().run_in_executor(
                    self._viewer.pool, partial(document.save, path, precision=precision, pdf=pdf)
                )
            finally:
                self._busy = self.state.saving = False
            self._viewer.session.saved(path, document, key)
            closing, self.state.closing = self.state.closing, None
            self.state.dialog = ""
            self.state.toast = f"Saved {self._viewer.session.places.shown(path)}, {path.stat().st_size / 1024:.1f} KiB"
            self._viewer.synchronise()
            if closing is not None:
                self._viewer.opening.close(closing)
        if self.state.error_save and self.state.dialog != "save":
            told = self.state.error_save
            self._viewer.show_dialog("save")
            self.state.error_save = told

    async def _export(self, path: Path) -> None:
        if self._busy:
            return
        self._check_settled()
        model = self._viewer.session.here.model
        if any(o.measurement is not None and o.measurement.file == path for _, o in self._viewer.session):
            raise BvbError(f"{path.name} is a measurement that is open. Choose another name.")
        self._busy = self.state.saving = True
        self.state.flush()
        try:
            _, missed = await asyncio.get_running_loop().run_in_executor(self._viewer.pool, export, model, path)
        finally:
            self._busy = self.state.saving = False
        self.state.dialog = ""
        shown, error = self._viewer.session.places.shown(path), missed.grid.log_cosine_rms
        self.state.toast = f"Exported {shown}; read back, log_cosine_rms is {error:.2g}"

    def _check_settled(self) -> None:
        """Raise BvbError while an edit is being tried: it is seen, but would not be in the file."""
        if self._viewer.editing.pending is not None:
            raise BvbError("An edit is being tried. Apply it or cancel it, then save.")

    def keep_soon(self) -> None:
        if self._due is not None:
            self._due.cancel()
        with suppress(RuntimeError):  # no loop runs: nothing that could crash, either
            self._due = asyncio.get_running_loop().call_later(KEEPING, self._keep_now)

    def _keep_now(self) -> None:
        self._due = None
        self.queue.ask(self._viewer.session.keep, lambda _: None)

    def close(self) -> None:
        """Keep what is unsaved now, and end the thread."""
        if self._due is not None:
            self._due.cancel()
        self._keepers.shutdown(wait=True, cancel_futures=True)
        with suppress(BvbError, OSError):
            self._viewer.session.keep()
