"""What the page tells in words."""

import logging
from typing import Any

from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.edit.combining import SEEN
from bvbedit.edit.document import Document
from bvbedit.errors import BvbError


def of_error(error: Exception) -> str:
    """Return what went wrong, in words for the page."""
    if isinstance(error, BvbError):
        return str(error)
    if isinstance(error, MemoryError):
        return "Not enough memory. Ask for less."
    if isinstance(error, OSError):
        return f"{error.strerror or error}: {error.filename or ''}"
    logging.getLogger(__name__).error("This should not have happened.", exc_info=error)
    return f"It failed unexpectedly: {error!r}. Please report this."


def of_notes(model: SplineBrdf) -> str:
    """Return what an edit has told of its result."""
    notes = list(model.report.get("notes", []))
    missed = model.report.get("refit_error") or 0.0
    if missed > SEEN:
        notes.append(f"the net cannot follow: log_cosine_rms {missed:.2g} off (0.01 is hard to see)")
    return "; ".join(notes)


def of_history(document: Document) -> list[dict[str, Any]]:
    """Return the lines of the history: what was done before the file was opened, the beginning, and each edit."""
    names = {position: name for name, position in document.names.items()}
    past = [{"position": -1, "line": edit.line(), "past": True, "here": False, "name": ""} for edit in document.past]
    start: dict[str, Any] = {"position": 0, "line": "as opened", "past": False, "here": document.position == 0}
    steps = [
        {"position": n + 1, "line": edit.line(), "past": False, "here": document.position == n + 1}
        for n, edit in enumerate(document.edits)
    ]
    return past + [{**step, "name": names.get(step["position"], "")} for step in (start, *steps)]


def of_fit(model: SplineBrdf) -> str:
    """Return what came of a fit."""
    size = " x ".join(str(n) for n in model.spline.size)
    told = f"{model.chart.name}, {model.encoding.name}, {size}"
    metrics = model.report.get("metrics")
    if metrics:
        told += "; log_cosine_rms {:.3g} (grid), {:.3g} (nodes)".format(
            metrics["grid"]["log_cosine_rms"], metrics["nodes"]["log_cosine_rms"]
        )
    return told
