"""Files that edits and recipes name, as seen from the folder of the file that names them, so that both may move."""

import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from bvbedit.edit.combining import Blend
from bvbedit.edit.operation import Edit


def seen_from(folder: Path, edit: Edit) -> Edit:
    """Return an edit whose partner was told as seen from a folder."""
    return replace(edit, partner=folder / edit.partner) if isinstance(edit, Blend) else edit


def relative_to(folder: Path, recipe: dict[str, Any]) -> dict[str, Any]:
    """Return a recipe, as JSON and TOML hold it, with its paths as seen from a folder."""
    out = {**recipe, "source": dict(recipe["source"]), "steps": [dict(step) for step in recipe["steps"]]}
    for table, key in _named(out):
        table[key] = Path(os.path.relpath(table[key], folder)).as_posix()
    return out


def _named(recipe: dict[str, Any]) -> Iterator[tuple[dict[str, Any], str]]:
    """Yield each table of a recipe that names a file, and the key under which it does."""
    if "file" in recipe["source"]:
        yield recipe["source"], "file"
    for step in recipe["steps"]:
        if "partner" in step:
            yield step, "partner"
