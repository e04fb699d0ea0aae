"""What is open in the viewer: materials with their documents, as values. Knows nothing of pages or pictures."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.materials import MATERIALS, material_named
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.edit.autosave import autosave, autosave_path, discard_autosave, recovered
from bvbedit.edit.document import Document
from bvbedit.edit.operation import Edit
from bvbedit.edit.paths import relative_to
from bvbedit.edit.recipe import Source, to_toml
from bvbedit.errors import BvbError
from bvbedit.io import load
from bvbedit_gui.places import MODELS, Places


@dataclass(frozen=True)
class Opened:
    """A material: a model with its history, what it is compared with, or a measurement that has no model yet."""

    name: str
    document: Document | None = None
    path: Path | None = None
    """The .bvb file that it was opened from or saved to."""
    saved: Document | None = None
    """What that file holds."""
    reference: Brdf | None = None
    """The material that the model is an approximation of, or another one to compare with."""
    reference_name: str = ""
    measurement: Source | None = None
    """How a recipe names the reference, where that can be fitted."""
    kept: Path | None = None
    """The file beside which it was kept when the program ended, for one that was recovered."""

    @property
    def shown(self) -> Brdf:
        """The model, or the measurement where there is none."""
        if self.document is not None:
            return self.document.model
        assert self.reference is not None  # one of the two is always there
        return self.reference

    @property
    def model(self) -> SplineBrdf:
        """The model. Raises BvbError where there is none yet."""
        return self.known_document.model

    @property
    def known_document(self) -> Document:
        """The document. Raises BvbError where there is none yet."""
        if self.document is None:
            raise BvbError(f"{self.name} is a measurement. Fit it first.")
        return self.document

    @property
    def unsaved(self) -> bool:
        """Whether its file, if there is one, holds something else."""
        if self.document is None:
            return False
        return self.saved is None or self.document.lines != self.saved.lines or self.document.names != self.saved.names

    def with_document(self, document: Document) -> "Opened":
        """Return the material after an edit, an undo or a redo."""
        return replace(self, document=document)


class Session:
    """The open materials, and which of them is worked on. Each is a value; the session says which ones stand."""

    def __init__(self, places: Places) -> None:
        self.places = places
        self._opened: dict[int, Opened] = {}
        self._next = 1
        # What we keep for the case of a crash: beside which file, and what of it was kept last.
        self._kept: dict[int, tuple[Path, Document | None]] = {}
        self.current: int | None = None

    def __iter__(self) -> Iterator[tuple[int, Opened]]:
        return iter(list(self._opened.items()))

    def __contains__(self, key: object) -> bool:
        return key in self._opened

    def __getitem__(self, key: int) -> Opened:
        return self._opened[key]

    @property
    def here(self) -> Opened:
        """The material that is worked on. Raises BvbError where nothing is open."""
        if self.current is None:
            raise BvbError("Nothing is open. Open a material or a sample first.")
        return self._opened[self.current]

    @property
    def document(self) -> Document:
        """The document that is worked on. Raises BvbError where there is none."""
        return self.here.known_document

    def add(self, opened: Opened) -> int:
        """Open a material, and work on it; return its key. Its name is made one that no other has."""
        names = {o.name for o in self._opened.values()}
        name, n = opened.name, 2
        while name in names:
            name, n = f"{opened.name} ({n})", n + 1
        key, self._next = self._next, self._next + 1
        self._opened[key] = replace(opened, name=name)
        if opened.kept is not None:
            self._kept[key] = opened.kept, None
        self.current = key
        return key

    def put(self, opened: Opened, key: int | None = None) -> None:
        """Let a value stand for the material that is worked on, or another one."""
        at = self.current if key is None else key
        assert at is not None
        self._opened[at] = opened

    def close(self, key: int) -> None:
        """Close a material; what was kept of it for the case of a crash is not wanted any more."""
        del self._opened[key]
        self._forget(key)
        if self.current == key:
            self.current = next(reversed(self._opened), None)

    def find(self, path: Path) -> int | None:
        """Return the key of the material that was opened from ``path`` or saved to it."""
        return next((key for key, o in self._opened.items() if o.path == path), None)

    def update(self, document: Document) -> None:
        """Let a document stand for the one that is worked on."""
        self.put(self.here.with_document(document))

    def do(self, edit: Edit, model: SplineBrdf | None = None) -> None:
        """Edit the document that is worked on; ``model``: what the edit makes of it, where that is known."""
        document = self.document
        self.update(document.do(edit) if model is None else document.done(edit, model))

    def check_save(self, path: Path) -> Document:
        """Return the document that is worked on. Raises BvbError where it may not be saved as ``path``."""
        other = self.find(path)
        if other is not None and other != self.current:
            raise BvbError(f"{path.name} is open as another document. Close that first, or choose another name.")
        document = self.document
        if document.needs(path):
            raise BvbError(f"{path.name} is what the history needs, and would be lost. Choose another name.")
        return document

    def saved(self, path: Path, document: Document, key: int) -> None:
        """Go on with the file to which a document was saved; it may have been edited on meanwhile."""
        if key not in self._opened:
            return
        self.put(replace(self._opened[key], name=path.name, path=path, saved=document), key)
        self._forget(key)
        discard_autosave(path)

    def recipe(self) -> str:
        """Return how the model came about, as a recipe. Raises BvbError where there is no model."""
        here = self.here
        # Not the file itself: the recipe may need it, and is to be compared with it.
        output = f"{(here.path or Path(here.name)).stem}-again.bvb"
        return to_toml(relative_to(self.places.folder, here.known_document.recipe()), [output])

    def keep(self) -> None:
        """Keep what is unsaved beside its file, for the case of a crash; may be called in another thread.

        Raises BvbError where something cannot be kept, after all the others were.
        """
        failed = None
        for key, opened in self:
            try:
                self._keep(key, opened)
            except BvbError as error:
                failed = error
        if failed is not None:
            raise failed

    def _keep(self, key: int, opened: Opened) -> None:
        document = opened.document
        if document is None or not opened.unsaved:
            self._forget(key)
            return
        place, last = self._kept.get(key, (None, None))
        if place is None:
            place = self._keeping_place(opened)
        if last is document:
            return
        self._kept[key] = place, document
        autosave(document, place)
        # Closed or saved meanwhile, it is not to be offered.
        now = self._opened.get(key)
        if now is None or not now.unsaved:
            self._kept.pop(key, None)
            discard_autosave(place)

    @property
    def keeping(self) -> set[Path]:
        """The files beside which something is kept that is open now."""
        return {place for place, _ in self._kept.values()}

    def _forget(self, key: int) -> None:
        place, _ = self._kept.pop(key, (None, None))
        if place is not None:
            discard_autosave(place)

    def was_kept(self, path: Path) -> bool:
        """Return whether something of a file was kept when the viewer ended before, and can be recovered."""
        kept = autosave_path(path)
        return kept.exists() and path not in self.keeping and self.places.allowed(kept)

    def _keeping_place(self, opened: Opened) -> Path:
        """Return the file, which need not exist, beside which a material is kept: one that no other is kept beside."""
        if opened.path is not None and not self.was_kept(opened.path):
            return opened.path
        # Something of the file was kept before, and is still to be recovered.
        taken = self.keeping | {o.path for _, o in self}
        stem = Path(opened.name).stem
        path, n = self.places.folder / f"{stem}.bvb", 2
        while path in taken or path.exists() or autosave_path(path).exists():
            path, n = self.places.folder / f"{stem} ({n}).bvb", n + 1
        return path


def opened_file(path: Path, name: str) -> Opened:
    """Return the material in a file: a model with its history, or a measurement. Raises BvbError as ``load`` does."""
    if path.suffix.lower() in MODELS:
        document = Document.open(path)
        return Opened(name, document, path, document)
    brdf = load(path)
    if isinstance(brdf, SplineBrdf):
        document = Document.of(brdf, file=str(path))
        return Opened(name, document, None, document)
    return Opened(name, reference=brdf, reference_name=name, measurement=Source(file=path))


def opened_sample(name: str) -> Opened:
    """Return a sample material, still to be fitted: it is its own measurement, without noise."""
    return Opened(name, reference=material_named(name).brdf, reference_name=name, measurement=Source(sample=name))


def opened_recovered(path: Path, name: str) -> Opened | None:
    """Return what was kept of a file when the program ended, or None. Raises BvbError where it is damaged."""
    document = recovered(path)
    if document is None:
        return None
    saved = None
    if path.exists():
        opened = Document.open(path)
        saved = opened if opened.source == document.source else None
    return Opened(name, document, path if path.exists() else None, saved, kept=path)


def kept_files(places: Places) -> list[Path]:
    """Return the files in the folder, or named, of which something unsaved was kept."""
    inside = (path for folder in places.folders() for path in folder.glob(".*.bvb.autosave"))
    found = {path.with_name(path.name[1 : -len(".autosave")]) for path in inside if places.allowed(path)}
    found |= {path for path in places.named if autosave_path(path).exists()}
    return sorted(found)


def samples() -> dict[str, str]:
    """Return the names of the sample materials, and what each looks like."""
    return {name: material.description for name, material in MATERIALS.items()}
