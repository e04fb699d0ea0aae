"""What survives a crash: the unsaved document of a file, kept beside it in full precision."""

from dataclasses import replace
from os import PathLike
from pathlib import Path
from types import MappingProxyType

from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.edit.document import Document, digest
from bvbedit.edit.operations import edit_of
from bvbedit.errors import BvbError
from bvbedit.io import load
from bvbedit.io.bvb import load_recipe, save_bvb


def autosave_path(path: str | PathLike[str]) -> Path:
    """Return where the unsaved document of a file is kept, beside it."""
    named = Path(path)
    return named.with_name(f".{named.name}.autosave")


def autosave(document: Document, path: str | PathLike[str]) -> None:
    """Keep a document beside the file ``path``, in full precision, for the case of a crash.

    Raises BvbError where it cannot be written.
    """
    undone = [edit.to_dict() for edit in document.edits[document.position :]]
    # Of the states that can be redone, too.
    names = {name: k + len(document.past) for name, k in document.names.items()}
    recipe = {**document.recipe(), "undone": undone, "names": names}
    save_bvb(document.model, autosave_path(path), "float64", recipe=recipe)


def discard_autosave(path: str | PathLike[str]) -> None:
    """Remove what ``autosave`` kept, after a save or when it is not wanted."""
    autosave_path(path).unlink(missing_ok=True)


def recovered(path: str | PathLike[str]) -> Document | None:
    """Return the document that was kept beside a file when the program ended, or None where there is none.

    Its history is that of the file, and can be undone as far as the file itself can still be opened and leads to the
    same model. Raises BvbError where what was kept is damaged.
    """
    kept = autosave_path(path)
    if not kept.exists():
        return None
    model, recipe = load(kept), load_recipe(kept)
    if not isinstance(model, SplineBrdf) or recipe is None:
        raise BvbError(f"{kept} is no kept document. Remove it.")
    try:
        steps = [edit_of(step) for step in recipe["steps"]]
        undone = [edit_of(step) for step in recipe.get("undone", [])]
        source, named = dict(recipe["source"]), dict(recipe.get("names", {}))
    except (KeyError, TypeError, ValueError) as error:
        raise BvbError(f"{kept} has a history that cannot be read: {error!r}. Remove it.") from None
    try:
        opened = Document.open(path)
        if opened.past == tuple(steps[: len(opened.past)]) and opened.source == source:
            again = opened
            for edit in (*steps[len(opened.past) :], *undone):
                again = again.do(edit)
            again = again.undo(len(undone))
            if digest(again.model) == digest(model):
                names = {k: v - len(opened.past) for k, v in named.items() if v >= len(opened.past)}
                return replace(again, names=MappingProxyType(names))
    except BvbError:
        pass  # the file is gone, or a partner: then the model stands for itself
    return Document(MappingProxyType(source), tuple(steps), states=(model,))
