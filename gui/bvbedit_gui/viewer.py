"""The viewer without its page: what each control does to the session, and what is drawn anew after it.

Everything happens in one event loop. What takes longer than a frame is done in threads, of which only the newest
result is wanted, or in the worker's process; both hand their results back to the loop.
"""

import asyncio
import logging
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.charts import HALF_DIFF, Chart
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.edit.autosave import autosave_path, discard_autosave
from bvbedit.edit.document import Document
from bvbedit.edit.fitting import Fit, FitOptions
from bvbedit.edit.operation import Edit
from bvbedit.edit.operations import OPERATIONS
from bvbedit.errors import BvbError
from bvbedit.io.export import TABLES, export
from bvbedit_gui import places as files
from bvbedit_gui import tasks
from bvbedit_gui.figures_view import FiguresView
from bvbedit_gui.given import one_of
from bvbedit_gui.knobs import edit_from, knobs_of, region_starts, starts
from bvbedit_gui.latest import Latest
from bvbedit_gui.lobe_view import LobeView
from bvbedit_gui.picking import Picking
from bvbedit_gui.preview_view import PreviewView
from bvbedit_gui.session import (
    Opened,
    Session,
    kept_files,
    opened_file,
    opened_recovered,
    opened_sample,
    samples,
)
from bvbedit_gui.themes import THEMES
from bvbedit_gui.volume_view import VolumeView
from bvbedit_gui.worker import Stopped, Worker

# Where messages appear: beside what they are about.
PLACES = ("open", "save", "edit", "fit", "volume", "lobes", "preview", "figures")
# What the state of the page is compared with, besides the source material and other documents.
NOTHING, SOURCE, BEFORE = "nothing", "source", "before"
# Edits that the panel offers: fitting has a panel of its own.
OFFERED = tuple(op for op in OPERATIONS if op != "fit")
FIT_STARTS: dict[str, Any] = {
    "fit_of": "model",
    "fit_chart": "auto",
    "fit_encoding": "auto",
    "fit_by": "bytes",
    "fit_kib": 16,
    "fit_tolerance": 0.01,
    "fit_size": [16, 12, 10],
    "fit_knots": "dominant",
    "fit_share": 0.0,
    "fitting": False,
    "fit_result": "",
    "can_fit_source": False,
}
PRECISIONS = ("as it is", "quantised", "float16", "float32", "float64")
# Seconds of quiet after which unsaved work is kept.
KEEPING = 1.0


class Viewer:
    """The controls of the page and what they do. ``server`` is a trame server, whether it runs or not."""

    def __init__(self, server: Any, session: Session, *, passes: bool = True) -> None:
        self.server = server
        self.state = server.state
        self.session = session
        self.pending: tuple[Document, Edit, SplineBrdf] | None = None
        self.worker = Worker()
        self._pool = ThreadPoolExecutor(3, thread_name_prefix="viewer")
        self._pending = Latest(self._pool, self._trial_failed)
        self._saving: asyncio.TimerHandle | None = None
        self._keepers = ThreadPoolExecutor(1, thread_name_prefix="keep")
        self._keep = Latest(self._keepers, lambda e: self.tell("save", e))
        self._start_state()
        theme = THEMES[self.state.theme]
        self.volume = VolumeView(self, theme)
        self.lobes = LobeView(self)
        self.preview = PreviewView(self, theme, passes=passes)
        self.figures = FiguresView(self)
        self.picking = Picking(self)
        self._watch()

    def _start_state(self) -> None:
        state = self.state
        for place in PLACES:
            state[f"error_{place}"] = ""
        state.update(
            {
                "documents": [],
                "current": None,
                "theme": "light",
                "dialog": "",
                "history": [],
                "against": NOTHING,
                "against_items": [],
                "op": "gain",
                "live": True,
                "edit_note": "",
                "edit_pending": False,
                "can_undo": False,
                "can_redo": False,
                "unsaved": False,
                "is_model": False,
                "axis_names": ["", "", ""],
                "closing": None,
                "save_name": "",
                "save_precision": "as it is",
                "save_pdf": False,
                "save_confirm": "",
                "saving": False,
                "recipe": "",
                "named": "",
                "material_files": [],
                "model_files": [],
                "scene_files": [],
                "kept_files": [],
                "samples": [{"name": n, "about": a} for n, a in samples().items()],
                "folder": str(self.session.places.folder),
                "opening": "",
                "toast": "",
                "maximised": "",
                "tab": "edit",
                **starts(),
                **region_starts(),
                **FIT_STARTS,
            }
        )

    def _watch(self) -> None:
        on = self.state.change
        on("theme")(self._theme_changed)
        on("against")(self._against_changed)
        on("op", "live")(self._op_changed)
        on(*starts(), *region_starts())(self._knob_changed)
        on("current")(self._current_changed)
        on("dialog")(self._dialog_changed)

    def start(self) -> None:
        """Show what is open already. Needs a running event loop."""
        self.list_files()
        with self.state:
            self._arrived()

    # What is shown

    @property
    def shown(self) -> Brdf | None:
        """What all pictures show: the model as the edit that is being tried makes it, or as it is; or a measurement."""
        if self.pending is not None:
            return self.pending[2]
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

    def latest(self, place: str) -> Latest:
        """Return a queue of length one in the viewer's threads, whose failures are told at ``place``."""
        return Latest(self._pool, lambda error: self.tell(place, error))

    def tell(self, place: str, error: Exception | None) -> None:
        """Show why something could not be done where it was asked for, or take the words away."""
        with self.state:
            self.state[f"error_{place}"] = "" if error is None else words(error)

    @contextmanager
    def telling(self, place: str) -> Iterator[None]:
        """Tell what goes wrong inside at ``place``."""
        self.state[f"error_{place}"] = ""
        try:
            yield
        except Exception as error:  # what is not told looks as if the button did nothing
            self.state[f"error_{place}"] = words(error)

    def _synchronise(self) -> None:
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
        state.history = [] if document is None else _told(document)
        symbols = [name.replace("theta", "θ").replace("phi", "φ") for name in self.chart.axes]
        state.axis_names = symbols
        items = [{"value": NOTHING, "title": "nothing"}]
        if here is not None and document is not None:
            if here.reference is not None:
                items.append({"value": SOURCE, "title": here.reference_name})
            items.append({"value": BEFORE, "title": "before the edits"})
        items += [{"value": f"document {key}", "title": o.name} for key, o in session if key != session.current]
        state.against_items = items
        if state.against not in [item["value"] for item in items]:
            state.against = NOTHING
        if here is not None and here.measurement is None:
            state.fit_of = "model"
        state.can_fit_source = here is not None and here.measurement is not None
        self.figures.synchronise()
        self.volume.synchronise()

    def _changed(self) -> None:
        """The document is another one: show it, tell it, and keep it for the case of a crash."""
        self._drop_pending()
        self._synchronise()
        self.refresh()
        self._try_edit()
        self._keep_soon()

    # Opening and closing

    def list_files(self) -> None:
        """Look anew at which files there are."""
        here = self.session.places
        self.state.material_files = here.files(files.MATERIALS)
        self.state.model_files = here.files(files.MODELS)
        self.state.scene_files = here.files(files.SCENES)
        self.state.kept_files = [here.shown(path) for path in kept_files(here) if path not in self.session.keeping]

    def show_dialog(self, name: str) -> None:
        """Open a dialog, or close the open one."""
        self.state.dialog = name
        self.list_files()
        if name == "save" and self.session.current is not None:
            here = self.session.here
            self.state.save_name = self._proposed_name(here)
            self.state.save_confirm = ""
        if name == "recipe":
            with self.telling("save"):
                self.state.recipe = self.session.recipe()

    def _proposed_name(self, here: Opened) -> str:
        if here.path is None:
            return f"{Path(here.name).stem}.bvb"
        if here.document is not None and here.document.needs(here.path):
            # Saved over what it began with, the history could not be replayed.
            return self.session.places.shown(here.path.with_stem(f"{here.path.stem}-edited"))
        return self.session.places.shown(here.path)

    async def open_file(self, name: str) -> None:
        """Open a file: a model to edit, or a measurement to fit."""
        with self.telling("open"):
            path = self.session.places.path(name, files.MATERIALS)
            known = self.session.find(path)
            if known is not None:
                self._go_to_document(known)
                return
            self.state.opening = name
            self.state.flush()
            loop = asyncio.get_running_loop()
            self._opened(await loop.run_in_executor(self._pool, opened_file, path, path.name))
        self.state.opening = ""

    def open_sample(self, name: str) -> None:
        """Open a sample material, to be fitted."""
        with self.telling("open"):
            self._opened(opened_sample(name))

    async def recover(self, name: str) -> None:
        """Open what was kept of a file when the program ended."""
        with self.telling("open"):
            path = self.session.places.path(name, files.MODELS)
            if not self.session.places.allowed(autosave_path(path)):
                raise BvbError(f"What was kept of {name} is a link to elsewhere. Remove it.")
            known = self.session.find(path)
            if known is not None:
                raise BvbError(f"{name} is open. Close it, then recover what was kept of it.")
            loop = asyncio.get_running_loop()
            opened = await loop.run_in_executor(self._pool, opened_recovered, path, path.name)
            if opened is None:
                raise BvbError(f"Nothing was kept of {name}.")
            self._opened(opened)

    def discard_kept(self, name: str) -> None:
        """Remove what was kept of a file."""
        with self.telling("open"):
            discard_autosave(self.session.places.path(name, files.MODELS))
        self.list_files()

    def _opened(self, opened: Opened) -> None:
        self.session.add(opened)
        self._arrived()

    def _go_to_document(self, key: int) -> None:
        self.session.current = key
        self._arrived()

    def _arrived(self) -> None:
        """Another material is worked on: show it beside its source, and what can be done with it."""
        state = self.state
        state.dialog = ""
        state.against = NOTHING
        self.volume.forget_view()
        if self.session.current is not None:
            here = self.session.here
            if here.document is None:
                state.update({"tab": "fit", "fit_of": "source"})
            elif here.reference is not None:
                state.against = SOURCE
        self._changed()

    def _current_changed(self, current: Any, **_: Any) -> None:
        key = self._known(current)
        if key is not None and key != self.session.current:
            self._go_to_document(key)
        elif current != self.session.current:
            self.state.current = self.session.current

    def _dialog_changed(self, **_: Any) -> None:
        # Who leaves the dialogs about closing does not want to close: a later save is only a save.
        if self.state.dialog not in ("close", "save"):
            self.state.closing = None

    def _known(self, key: Any) -> int | None:
        """Return the key of an open document, or None for anything else that a page has sent."""
        return one_of(key, [known for known, _ in self.session], None)

    def close(self, key: int | None = None, *, discard: bool = False) -> None:
        """Close a document; what is unsaved is asked about first, unless it may be discarded."""
        with self.telling("open"):
            at = self.session.current if key is None else self._known(key)
            if at is None:
                return
            if self.session[at].unsaved and self.session[at].document is not None and not discard:
                self.session.current = at
                self.state.closing = at
                self.state.dialog = "close"
                self._changed()
                return
            self.session.close(at)
            self.state.closing = None
            self._arrived()

    # Saving

    def save(self) -> None:
        """Save to the document's file; ask for a name where there is none, or where the history needs that file."""
        if self.session.current is None:
            return
        here = self.session.here
        if here.path is None or (here.document is not None and here.document.needs(here.path)):
            self.show_dialog("save")
            return
        self._save_model(here.path, None, pdf=False)

    async def save_as(self, *, over: bool = False) -> None:
        """Save, or export, under the name in the dialog; another file is replaced only when that was confirmed."""
        with self.telling("save"):
            name = str(self.state.save_name).strip()
            if name and not Path(name).suffix:
                name += ".bvb"
            path = self.session.places.path(name, (*files.MODELS, *TABLES))
            if path.exists() and path != self.session.here.path and not over:
                self.state.save_confirm = f"{name} exists. Replace it?"
                return
            self.state.save_confirm = ""
            if path.suffix.lower() in TABLES:
                await self._export(path)
                return
            precision = one_of(self.state.save_precision, PRECISIONS, "as it is")
            self._save_model(path, None if precision == "as it is" else precision, pdf=self.state.save_pdf is True)

    def _save_model(self, path: Path, precision: str | None, *, pdf: bool) -> None:
        with self.telling("save"):
            self._check_settled()
            self.session.save(path, precision=precision, pdf=pdf)
            closing, self.state.closing = self.state.closing, None
            self.state.dialog = ""
            self.state.toast = f"Saved {self.session.places.shown(path)}, {path.stat().st_size / 1024:.1f} KiB"
            self._synchronise()
            if closing is not None:
                self.close(closing)
        if self.state.error_save and self.state.dialog != "save":
            told = self.state.error_save
            self.show_dialog("save")
            self.state.error_save = told

    async def _export(self, path: Path) -> None:
        self._check_settled()
        model = self.session.here.model
        if any(o.measurement is not None and o.measurement.file == path for _, o in self.session):
            raise BvbError(f"{path.name} is a measurement that is open. Choose another name.")
        self.state.saving = True
        self.state.flush()
        try:
            _, missed = await asyncio.get_running_loop().run_in_executor(self._pool, export, model, path)
        finally:
            self.state.saving = False
        self.state.dialog = ""
        self.state.toast = (
            f"Exported {self.session.places.shown(path)}; read back, log_cosine_rms is {missed.grid.log_cosine_rms:.2g}"
        )

    def _check_settled(self) -> None:
        """Raise BvbError while an edit is being tried: it is seen, but would not be in the file."""
        if self.pending is not None:
            raise BvbError("An edit is being tried. Apply it or cancel it, then save.")

    def _keep_soon(self) -> None:
        if self._saving is not None:
            self._saving.cancel()
        with suppress(RuntimeError):  # no loop runs: nothing that could crash, either
            self._saving = asyncio.get_running_loop().call_later(KEEPING, self._keep_now)

    def _keep_now(self) -> None:
        self._saving = None
        self._keep.ask(self.session.keep, lambda _: None)

    # Editing

    @property
    def op(self) -> str:
        """The edit that is chosen in the panel."""
        return one_of(self.state.op, OFFERED, OFFERED[0])

    def _op_changed(self, **_: Any) -> None:
        self.state.error_edit = ""
        self._drop_pending(redraw=True)
        self.picking.show_region()
        self._try_edit()

    def _knob_changed(self, **_: Any) -> None:
        self.picking.show_region()
        self._try_edit()

    def _is_touched(self) -> bool:
        # Which file or axis is meant says nothing yet, and stays chosen after an edit.
        knobs = [knob for knob in knobs_of(self.op) if knob.kind not in ("file", "axis")]
        return any(_differs(self.state[knob.state], knob.start) for knob in knobs)

    def _try_edit(self) -> None:
        """Show what the edit in the panel would make of the model, without doing it."""
        state = self.state
        base = self.document
        if base is None:
            return
        if not self._is_touched() or not state.live:
            self._drop_pending(redraw=True)
            return
        try:
            edit = self._edit()
        except BvbError as error:
            state.error_edit = words(error)
            self._drop_pending(redraw=True)
            return
        state.error_edit = ""
        self._pending.ask(lambda: edit.apply(base.model), lambda model: self._show_pending(base, edit, model))

    def _edit(self) -> Edit:
        if self.op == "blend" and not self.state.knob_blend_partner:
            raise BvbError("Choose the other material first.")
        edit = edit_from(self.op, self.state)
        partner = getattr(edit, "partner", None)
        if partner is not None:
            edit = replace(edit, partner=self.session.places.path(str(partner), files.MODELS))  # type: ignore[call-arg]
        return edit

    def _show_pending(self, base: Document, edit: Edit, model: SplineBrdf) -> None:
        with self.state:
            if self.session.current is None or self.session.here.document is not base:
                return
            self.pending = base, edit, model
            self.state.edit_pending = True
            self.state.edit_note = _notes(model)
            self.refresh()

    def _trial_failed(self, error: Exception) -> None:
        with self.state:
            self._drop_pending(redraw=True)
            self.tell("edit", error)

    def _drop_pending(self, *, redraw: bool = False) -> None:
        self._pending.forget()
        was, self.pending = self.pending, None
        self.state.edit_pending = False
        self.state.edit_note = ""
        if redraw and was is not None:
            self.refresh()

    async def apply_edit(self) -> None:
        """Do the edit in the panel: it becomes part of the history."""
        with self.telling("edit"):
            document, edit = self.session.document, self._edit()
            await self._do(document, edit)

    async def _do(self, document: Document, edit: Edit, model: SplineBrdf | None = None) -> None:
        known = self.pending
        if model is None and known is not None and known[0] is document and known[1] == edit:
            model = known[2]
        if model is None:
            self.state.edit_note = "working ..."
            self.state.flush()
            try:
                model = await asyncio.get_running_loop().run_in_executor(self._pool, edit.apply, document.model)
            finally:
                self.state.edit_note = ""
        if self.session.current is None or self.session.here.document is not document:
            raise BvbError("The document has changed meanwhile. Do it again.")
        self.session.do(edit, model)
        note = _notes(model)
        self._reset_knobs(edit.op)
        self._changed()
        self.state.edit_note = note

    def cancel_edit(self) -> None:
        """Put the knobs of the panel back, and show the model as it is."""
        self._reset_knobs(self.op)
        self._drop_pending(redraw=True)
        self.state.error_edit = ""

    def _reset_knobs(self, op: str) -> None:
        if op in OFFERED:
            # What a file or an axis was chosen to be stays: the next edit often is of the same one.
            self.state.update({k.state: k.start for k in knobs_of(op) if k.kind not in ("file", "axis")})

    def reset_region(self) -> None:
        """Let edits act everywhere."""
        self.state.update(region_starts())
        self.picking.forget()

    async def insert_knot(self, axis: int, at: float) -> None:
        """Insert a knot where an axis of the volume was clicked."""
        from bvbedit.edit.structural import InsertKnots

        with self.state, self.telling("edit"):
            await self._do(self.session.document, InsertKnots(axis=axis, at=round(at, 4)))
            self.state.toast = f"A knot at {at:.4f} of {self.state.axis_names[axis]}"

    async def undo(self) -> None:
        """Take the last edit back; an edit that is being tried is taken back first."""
        if self.pending is not None:
            self.cancel_edit()
        elif self.document is not None and self.document.position > 0:
            await self.go_to(self.document.position - 1)

    async def redo(self) -> None:
        """Do the edit again that was taken back last."""
        if self.document is not None and self.document.position < len(self.document.edits):
            await self.go_to(self.document.position + 1)

    async def go_to(self, position: int) -> None:
        """Go to a place in the history."""
        with self.telling("edit"):
            document = self.session.document
            steps, loop = range(len(document.edits) + 1), asyncio.get_running_loop()
            # A state that a long history has dropped is made again, which may take seconds.
            there = await loop.run_in_executor(self._pool, document.go_to, one_of(position, steps, -1))
            if self.session.current is not None and self.session.here.document is document:
                self.session.update(there)
                self._changed()

    def name_state(self) -> None:
        """Give the present state the name in the field."""
        with self.telling("edit"):
            self.session.update(self.session.document.named(str(self.state.named)))
            self.state.named = ""
            self._synchronise()
            self._keep_soon()

    # Fitting

    def fit_options(self) -> dict[str, Any]:
        """Return the options in the panel. Raises BvbError for numbers that are none."""
        state = self.state
        options: dict[str, Any] = {
            "chart": state.fit_chart,
            "encoding": state.fit_encoding,
            "knots": state.fit_knots,
        }
        try:
            if state.fit_by == "bytes":
                options["max_bytes"] = round(1024 * float(state.fit_kib))
            elif state.fit_by == "tolerance":
                options["tolerance"] = float(state.fit_tolerance)
            elif state.fit_by == "size":
                options["size"] = tuple(int(n) for n in state.fit_size)
            elif state.fit_by != "knee":
                raise BvbError("Choose by what the size of the fit is found: bytes, tolerance, size or by itself.")
        except (TypeError, ValueError, OverflowError):
            raise BvbError("A field of the fit is no number. Fill it in.") from None
        return options

    async def fit(self) -> None:
        """Fit the measurement, or the present model anew, in another process."""
        state = self.state
        if self.worker.busy:
            return
        with self.telling("fit"):
            here = self.session.here
            key = self.session.current
            options = self.fit_options()
            state.update({"fitting": True, "fit_share": 0.0, "fit_result": ""})
            state.flush()
            if state.fit_of == "source":
                await self._fit_source(here, key, FitOptions(**options))
            else:
                document = here.known_document
                edit = Fit(**options)
                model = await self.worker.run(tasks.refitted, document.model, edit, progress=self._fit_progress)
                await self._do(document, edit, model)
            state.fit_result = _fit_words(self.session.here.model)
        state.fitting = False

    async def _fit_source(self, here: Opened, key: int | None, options: FitOptions) -> None:
        if here.measurement is None:
            raise BvbError("There is no measurement to fit. Open one, or fit the present model.")
        model = await self.worker.run(tasks.fitted, here.measurement, options, progress=self._fit_progress)
        document = Document.of_fit(model, options, **here.measurement.told())
        fitted = Opened(
            f"{Path(here.name).stem}.bvb",
            document,
            reference=here.reference,
            reference_name=here.reference_name,
            measurement=here.measurement,
        )
        if key is None or key not in self.session:
            raise Stopped("It was closed meanwhile.")
        if here.document is None:
            # The measurement stays as what the model is compared with.
            self.session.put(fitted, key)
            self.session.current = key
        else:
            self.session.add(fitted)
        self._arrived()
        self.state.tab = "fit"

    def _fit_progress(self, share: float) -> None:
        with self.state:
            self.state.fit_share = round(100 * share)

    def stop_fit(self) -> None:
        """Stop the fit."""
        self.worker.close()

    # Looks

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
            queues = [self._pending, self.volume.queue, self.lobes.queue, self.figures.queue, self._keep]
            busy = [queue for queue in queues if queue.busy]
            if not busy and not self.preview.first_pass_due:
                return
            for queue in busy:
                await queue.done()
            await asyncio.sleep(0.005)

    def end(self) -> None:
        """Keep what is unsaved, and end threads and processes."""
        if self._saving is not None:
            self._saving.cancel()
        self._keepers.shutdown(wait=True, cancel_futures=True)
        with suppress(BvbError, OSError):
            self.session.keep()
        self.worker.close()
        self.preview.close()
        self._pool.shutdown(wait=True, cancel_futures=True)
        self.volume.close()
        self.lobes.close()


def words(error: Exception) -> str:
    """Return what went wrong, in words for the page."""
    if isinstance(error, BvbError):
        return str(error)
    if isinstance(error, MemoryError):
        return "Not enough memory. Ask for less."
    if isinstance(error, OSError):
        return f"{error.strerror or error}: {error.filename or ''}"
    logging.getLogger(__name__).error("This should not have happened.", exc_info=error)
    return f"It failed unexpectedly: {error!r}. Please report this."


def _notes(model: SplineBrdf) -> str:
    notes = list(model.report.get("notes", []))
    missed = model.report.get("refit_error") or 0.0
    # Less than a thousandth of the largest value nobody sees.
    if missed > 1e-3 * abs(model.spline.control).max():
        notes.append(f"missed by at most {missed:.2g} (encoded; the largest is {abs(model.spline.control).max():.2g})")
    return "; ".join(notes)


def _told(document: Document) -> list[dict[str, Any]]:
    names = {position: name for name, position in document.names.items()}
    past = [{"position": -1, "line": edit.line(), "past": True, "here": False, "name": ""} for edit in document.past]
    start: dict[str, Any] = {"position": 0, "line": "as opened", "past": False, "here": document.position == 0}
    steps = [
        {"position": n + 1, "line": edit.line(), "past": False, "here": document.position == n + 1}
        for n, edit in enumerate(document.edits)
    ]
    return past + [{**step, "name": names.get(step["position"], "")} for step in (start, *steps)]


def _differs(value: Any, start: Any) -> bool:
    if isinstance(value, list | tuple) and isinstance(start, list | tuple):
        return list(value) != list(start)
    return bool(value != start)


def _fit_words(model: SplineBrdf) -> str:
    size = " x ".join(str(n) for n in model.spline.size)
    told = f"{model.chart.name}, {model.encoding.name}, {size}"
    metrics = model.report.get("metrics")
    if metrics:
        told += "; log_cosine_rms {:.3g} (grid), {:.3g} (nodes)".format(
            metrics["grid"]["log_cosine_rms"], metrics["nodes"]["log_cosine_rms"]
        )
    return told
