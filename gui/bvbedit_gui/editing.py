"""Editing: an edit is tried while its knobs move, then done or left; and the way back and forth in the history."""

import asyncio
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.edit.document import Document
from bvbedit.edit.operation import Edit
from bvbedit.edit.operations import OPERATIONS
from bvbedit.edit.structural import InsertKnots
from bvbedit.errors import BvbError
from bvbedit_gui import places as files
from bvbedit_gui import volume
from bvbedit_gui.given import one_of
from bvbedit_gui.knobs import edit_from, knobs_of, region_starts, starts
from bvbedit_gui.latest import Latest
from bvbedit_gui.words import of_error, of_notes

if TYPE_CHECKING:
    from bvbedit_gui.viewer import Viewer

# Edits that the panel offers: fitting has a panel of its own.
OFFERED = tuple(op for op in OPERATIONS if op != "fit")
# Edits whose knobs stand, at first, where they change nothing.
NEUTRAL = ("gain", "tint", "broaden", "sharpen", "raise_grazing", "blend")
STARTS: dict[str, Any] = {
    "history": [],
    "op": OFFERED[0],
    "live": True,
    "edit_note": "",
    "edit_pending": False,
    "can_undo": False,
    "can_redo": False,
    "named": "",
}


class Editing:
    """What the panel of edits does. ``pending`` is the edit that is being tried: of what, which, and what it makes."""

    def __init__(self, viewer: "Viewer") -> None:
        self._viewer = viewer
        self.state = viewer.state
        self.state.update({**STARTS, **starts(), **region_starts()})
        self.pending: tuple[Document, Edit, SplineBrdf] | None = None
        self.queue = Latest(viewer.pool, self._trial_failed, lambda: viewer.preview.hold())
        # Steps through the history are taken one after the other, however fast the keys are.
        self._stepping = asyncio.Lock()
        self.state.change("op", "live")(self._op_changed)
        self.state.change(*starts(), *region_starts())(self._knob_changed)

    @property
    def op(self) -> str:
        """The edit that is chosen in the panel."""
        return one_of(self.state.op, OFFERED, OFFERED[0])

    def _op_changed(self, **_: Any) -> None:
        self.state.error_edit = ""
        self.drop(redraw=True)
        self._viewer.picking.show_region()
        self.try_edit()

    def _knob_changed(self, **_: Any) -> None:
        self._viewer.picking.show_region()
        self.try_edit()

    def _is_touched(self) -> bool:
        # Which file or axis is meant says nothing yet, and stays chosen after an edit.
        knobs = [knob for knob in knobs_of(self.op) if knob.kind not in ("file", "axis")]
        return any(_differs(self.state[knob.state], knob.start) for knob in knobs)

    def try_edit(self) -> None:
        """Show what the edit in the panel would make of the model, without doing it."""
        state = self.state
        base = self._viewer.document
        if base is None:
            return
        if not self._is_touched() or not state.live:
            self.drop(redraw=True)
            return
        try:
            edit = self._edit()
        except BvbError as error:
            state.error_edit = of_error(error)
            self.drop(redraw=True)
            return
        state.error_edit = ""
        self.queue.ask(lambda: edit.apply(base.model), lambda model: self._show_pending(base, edit, model))

    def _edit(self) -> Edit:
        if self.op == "blend" and not self.state.knob_blend_partner:
            raise BvbError("Choose the other material first.")
        edit = edit_from(self.op, self.state)
        partner = getattr(edit, "partner", None)
        if partner is not None:
            edit = replace(edit, partner=self._viewer.session.places.path(str(partner), files.MODELS))  # type: ignore[call-arg]
        return edit

    def _show_pending(self, base: Document, edit: Edit, model: SplineBrdf) -> None:
        with self.state:
            if self._viewer.session.current is None or self._viewer.session.here.document is not base:
                return
            self.pending = base, edit, model
            self.state.edit_pending = True
            self.state.edit_note = of_notes(model)
            self._viewer.refresh()

    def _trial_failed(self, error: Exception) -> None:
        with self.state:
            self.drop(redraw=True)
            self._viewer.tell("edit", error)

    def drop(self, *, redraw: bool = False) -> None:
        """Leave the edit that is being tried; ``redraw`` the model without it."""
        self.queue.forget()
        was, self.pending = self.pending, None
        self.state.edit_pending = False
        self.state.edit_note = ""
        if redraw and was is not None:
            self._viewer.refresh()

    async def apply(self) -> None:
        """Do the edit in the panel: it becomes part of the history."""
        async with self._stepping:
            await self._apply()

    async def _apply(self) -> None:
        with self._viewer.telling("edit"):
            document, edit = self._viewer.session.document, self._edit()
            if self.op in NEUTRAL and not self._is_touched():
                raise BvbError("Nothing would change yet. Move a knob first.")
            await self.do(document, edit)

    async def do(self, document: Document, edit: Edit, model: SplineBrdf | None = None) -> None:
        """Make an edit to a document, whose result may be known, a step of its history.

        Raises BvbError as the edit does, and where the document has changed meanwhile.
        """
        known = self.pending
        if model is None and known is not None and known[0] is document and known[1] == edit:
            model = known[2]
        if model is None:
            self.state.edit_note = "working ..."
            self.state.flush()
            try:
                model = await asyncio.get_running_loop().run_in_executor(self._viewer.pool, edit.apply, document.model)
            finally:
                self.state.edit_note = ""
        if self._viewer.session.current is None or self._viewer.session.here.document is not document:
            raise BvbError("The document has changed meanwhile. Do it again.")
        self._viewer.session.do(edit, model)
        note = of_notes(model)
        self._reset_knobs(edit.op)
        self._viewer.changed()
        self.state.edit_note = note

    def cancel(self) -> None:
        """Put the knobs of the panel back, and show the model as it is."""
        self._reset_knobs(self.op)
        self.drop(redraw=True)
        self.state.error_edit = ""

    def _reset_knobs(self, op: str) -> None:
        if op in OFFERED:
            # What a file or an axis was chosen to be stays: the next edit often is of the same one.
            self.state.update({k.state: k.start for k in knobs_of(op) if k.kind not in ("file", "axis")})

    def reset_region(self) -> None:
        """Let edits act everywhere."""
        self.state.update(region_starts())
        self._viewer.picking.forget()

    async def insert_knot(self, axis: int, at: float) -> None:
        """Insert a knot where an axis of the volume was clicked."""
        with self.state:
            async with self._stepping:
                with self._viewer.telling("edit"):
                    await self.do(self._viewer.session.document, InsertKnots(axis=axis, at=round(at, 4)))
                    self.state.toast = f"A knot at {volume.place_on(self._viewer.chart, axis, at)}"

    async def undo(self) -> None:
        """Take the last edit back; an edit that is being tried is taken back first."""
        async with self._stepping:
            if self.pending is not None:
                self.cancel()
            elif self._viewer.document is not None and self._viewer.document.position > 0:
                await self._step_to(self._viewer.document.position - 1)

    async def redo(self) -> None:
        """Do the edit again that was taken back last."""
        async with self._stepping:
            document = self._viewer.document
            if document is not None and document.position < len(document.edits):
                await self._step_to(document.position + 1)

    async def go_to(self, position: int) -> None:
        """Go to a place in the history."""
        async with self._stepping:
            await self._step_to(position)

    async def _step_to(self, position: int) -> None:
        with self._viewer.telling("edit"):
            document = self._viewer.session.document
            steps, loop = range(len(document.edits) + 1), asyncio.get_running_loop()
            # A state that a long history has dropped is made again, which may take seconds.
            there = await loop.run_in_executor(self._viewer.pool, document.go_to, one_of(position, steps, -1))
            if self._viewer.session.current is not None and self._viewer.session.here.document is document:
                self._viewer.session.update(there)
                self._viewer.changed()

    def name_state(self) -> None:
        """Give the present state the name in the field."""
        with self._viewer.telling("edit"):
            self._viewer.session.update(self._viewer.session.document.named(str(self.state.named)))
            self.state.named = ""
            self._viewer.synchronise()
            self._viewer.saving.keep_soon()


def _differs(value: Any, start: Any) -> bool:
    if isinstance(value, list | tuple) and isinstance(start, list | tuple):
        return list(value) != list(start)
    return bool(value != start)
