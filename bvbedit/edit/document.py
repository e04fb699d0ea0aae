"""A document: a model, the edits that led to it, and the way back.

Documents are values: each edit, undo and redo returns a new one, and what an old one showed stays.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from hashlib import sha256
from os import PathLike
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from bvbedit.brdf.plausibility import Plausibility, check
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.brdf.structure import largest_change
from bvbedit.edit.combining import Blend
from bvbedit.edit.fitting import FitOptions
from bvbedit.edit.operation import Edit
from bvbedit.edit.operations import edit_of
from bvbedit.edit.paths import relative_to, seen_from
from bvbedit.edit.structural import Store
from bvbedit.errors import BvbError
from bvbedit.io import load
from bvbedit.io.bvb import load_recipe, save_bvb

# Bytes of control points that a history keeps; of older states every eighth stays, the others are made again.
LARGEST_HISTORY = 1 << 26
EACH = 8


@dataclass(frozen=True)
class Document:
    """A model with its history: ``states[k]`` is what the first k ``edits`` make of the source, None if dropped."""

    source: Mapping[str, Any]
    """What the history began with, as a recipe tells it: a file or a sample, and the digest of the first model."""
    past: tuple[Edit, ...] = ()
    """Edits made before the file was opened: they are recorded, but cannot be undone."""
    edits: tuple[Edit, ...] = ()
    states: tuple[SplineBrdf | None, ...] = ()
    position: int = 0
    """How many of the edits are in force; those behind can be redone."""
    names: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))
    """Positions that were given a name."""

    @classmethod
    def of(cls, model: SplineBrdf, **source: Any) -> "Document":
        """Return a new document of a model; ``source`` tells a recipe where it came from, like file="gold.bvb"."""
        return cls(MappingProxyType({**source, "digest": digest(model)}), states=(model,))

    @classmethod
    def of_fit(cls, model: SplineBrdf, options: FitOptions, **source: Any) -> "Document":
        """Return a new document of what ``options.fitted`` made of a measurement, for a recipe to make it again.

        ``source`` tells which: file="gold.binary", or sample="gold", noise=0.01, seed=1; see ``Source.told``.
        """
        return cls.of(model, **source, fit=options.to_dict())

    @classmethod
    def open(cls, path: str | PathLike[str]) -> "Document":
        """Return the document in a .bvb file. Raises BvbError for what is none, and for a measurement."""
        model = load(path)
        if not isinstance(model, SplineBrdf):
            raise BvbError(f"{path} is a measurement, not a model. Fit it first: bvbedit fit {path} MODEL.bvb")
        recipe = load_recipe(path)
        if recipe is None:
            return cls.of(model, file=str(path))
        try:
            folder = Path(path).parent
            past = tuple(seen_from(folder, edit_of(step)) for step in recipe["steps"])
            source = dict(recipe["source"])
            if "file" in source:
                source["file"] = str(folder / source["file"])
        except (KeyError, TypeError, ValueError) as error:
            raise BvbError(f"{path} has a recipe that cannot be read: {error!r}. Export the model and go on.") from None
        stored = Store(precision=model.storage.precision, step=model.storage.step)  # type: ignore[arg-type]
        return cls(MappingProxyType(source), (*past, stored), states=(model,))

    @property
    def model(self) -> SplineBrdf:
        """What the document shows."""
        return self.at(self.position)

    def at(self, state: "int | str") -> SplineBrdf:
        """Return the model after so many edits, or at a named state. Raises BvbError for one that there is not."""
        position = self._position(state)
        start = position
        while self.states[start] is None:
            start -= 1
        model = self.states[start]
        assert model is not None  # the first one is always kept
        for edit in self.edits[start:position]:
            model = edit.apply(model)
        return model

    def do(self, edit: Edit) -> "Document":
        """Return the document with one more edit; what could be redone is gone. Raises BvbError as the edit does."""
        return self.done(edit, edit.apply(self.model))

    def done(self, edit: Edit, model: SplineBrdf) -> "Document":
        """Return the document with one more edit that made ``model`` of its own, perhaps in another process."""
        n = self.position
        edits, states = (*self.edits[:n], edit), (*self.states[: n + 1], model)
        names = MappingProxyType({name: k for name, k in self.names.items() if k <= n})
        return replace(self, edits=edits, states=_thinned(states), position=n + 1, names=names)

    def undo(self, by: int = 1) -> "Document":
        """Return the document before the last edits. Raises BvbError where there are not so many."""
        return self.go_to(self.position - by)

    def redo(self, by: int = 1) -> "Document":
        """Return the document with edits done again that were undone. Raises BvbError where there are not so many."""
        return self.go_to(self.position + by)

    def go_to(self, state: "int | str") -> "Document":
        """Return the document at any state of its history. Raises BvbError for one that there is not.

        A state that was dropped is made again, once.
        """
        position = self._position(state)
        states = (*self.states[:position], self.at(position), *self.states[position + 1 :])
        return replace(self, position=position, states=states)

    def named(self, name: str) -> "Document":
        """Return the document with a name for its present state, to go back to or compare with."""
        if not name.strip():
            raise BvbError("A state cannot be called nothing. Give a name.")
        return replace(self, names=MappingProxyType({**self.names, name: self.position}))

    @property
    def lines(self) -> tuple[str, ...]:
        """The edits in force, a line each, those made before the file was opened first."""
        return tuple(edit.line() for edit in (*self.past, *self.edits[: self.position]))

    def recipe(self) -> dict[str, Any]:
        """Return how the model came about, as JSON and TOML can hold it."""
        steps = [edit.to_dict() for edit in (*self.past, *self.edits[: self.position])]
        names = {name: k + len(self.past) for name, k in self.names.items() if k <= self.position}
        return {"source": dict(self.source), "steps": steps, **({"names": names} if names else {})}

    def needs(self, path: str | PathLike[str]) -> bool:
        """Return whether the history would be lost with a file: it began with that, or blended it in."""
        place = Path(path).resolve()
        edits = (*self.past, *self.edits[: self.position])
        if any(isinstance(edit, Blend) and edit.partner.resolve() == place for edit in edits):
            return True
        # With a past, the file is what was saved since, and stands for its source no more.
        begun = self.source.get("file")
        return begun is not None and Path(begun).resolve() == place and bool(edits) and not self.past

    def save(
        self, path: str | PathLike[str], *, precision: str | None = None, pdf: bool = False, made: str | None = None
    ) -> None:
        """Write the model with its recipe to a .bvb file, and perhaps what it was ``made`` of, by which that is known.

        Raises BvbError where that cannot be done.
        """
        recipe = relative_to(Path(path).parent, self.recipe())
        save_bvb(self.model, path, precision, pdf=pdf, recipe=recipe if made is None else {**recipe, "made": made})

    def changes(self, state: "int | str" = 0) -> "Changes":
        """Return what has changed since a state. Raises BvbError for one that there is not."""
        before, after = self.at(state), self.model
        return Changes(before, after)

    def _position(self, state: "int | str") -> int:
        position = self.names.get(state, -1) if isinstance(state, str) else state
        if not 0 <= position <= len(self.edits):
            known = ", ".join(self.names) or "none"
            if isinstance(state, str):
                raise BvbError(f"No state is called {state!r}. Named states: {known}.")
            raise BvbError(
                f"There is no state {state}: the history has {len(self.edits)} edits. Go to 0 or up to that."
            )
        return position


@dataclass(frozen=True)
class Changes:
    """What an edit has done: how far encoded values moved, and what physics says before and after."""

    before: SplineBrdf
    after: SplineBrdf

    @property
    def max_change(self) -> float:
        """The largest change of the encoded value."""
        return largest_change(self.before, self.after)

    def plausibility(self) -> tuple[Plausibility, Plausibility]:
        """Return albedo, negative values and reciprocity before and after."""
        return check(self.before), check(self.after)


def digest(model: SplineBrdf) -> str:
    """Return a text that tells one net, its knots, chart and encoding from any other."""
    joined = sha256(f"{model.chart.name} {model.encoding}".encode())
    for array in (*model.spline.knots, model.spline.control):
        joined.update(np.ascontiguousarray(array).tobytes())
    return joined.hexdigest()[:32]


def _thinned(states: tuple[SplineBrdf | None, ...]) -> tuple[SplineBrdf | None, ...]:
    """Return the states without so many of the oldest that their nets fit into memory; every eighth stays."""
    total = sum(s.spline.control.nbytes for s in states if s is not None)
    out = list(states)
    for k in range(1, len(out) - 1):
        if total <= LARGEST_HISTORY:
            break
        state = out[k]
        if k % EACH and state is not None:
            total -= state.spline.control.nbytes
            out[k] = None
    return tuple(out)
