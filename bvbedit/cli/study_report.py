"""Commands that read a study: its report, and what to use by what it measured."""

from pathlib import Path

from bvbedit.cli.models import Json
from bvbedit.cli.output import progress
from bvbedit.cli.output import report as tell


def report(folder: Path, /, *, out: Path | None = None, as_json: Json = False) -> None:
    """Write the report of a study: a page with all figures and tables, and each figure as PNG and SVG.

    Parameters
    ----------
    folder
        The folder that `bvbedit study` wrote; figures go to its figures/.
    out
        The page to write; report.html in the folder if not given.
    as_json
        Print one JSON object.
    """
    from bvbedit.io import check_target
    from bvbedit.study.report import write_report

    if out is not None:
        check_target(out, (".html", ".htm"))
    with progress(f"Drawing {folder}") as watch:
        written = write_report(folder, out, progress=watch)
    table = written.table
    tell(
        {
            "file": str(written.page),
            "figures": [str(path) for path in written.figures] if as_json else len(written.figures),
            "materials": len(table.materials),
            "configurations": len(table.configurations),
            "cells": len(table.rows),
            "failed": len(table.failed),
            "notes": [f"not drawn: {m.title}: {m.why}" for m in written.missing],
        },
        as_json,
    )


def recommend(
    material: str,
    /,
    *,
    study: Path = Path("study"),
    scene: str | None = None,
    max_error: float | None = None,
    max_bytes: int | None = None,
    max_time: float | None = None,
    as_json: Json = False,
) -> None:
    """Tell which configuration to use for a material, by what a study measured.

    Parameters
    ----------
    material
        A material of the study by name, or the file that was measured.
    study
        The folder that `bvbedit study` wrote.
    scene
        Judge by the largest error of this scene's picture (PAE, a share of white), not by log-cosine RMS.
    max_error
        The smallest file whose error is within this.
    max_bytes
        The least error in a file of at most so many bytes.
    max_time
        The least error within so many nanoseconds per evaluation; with a scene, seconds to render it.
    as_json
        Print one JSON object.
    """
    from bvbedit.study.recommend import recommend as advised
    from bvbedit.study.table import read_study

    table = read_study(study)
    # A file may be named as it lies there; the study knows it by its stem.
    stem = Path(material).stem
    is_file = material not in table.materials and stem in table.materials
    advice = advised(
        table,
        stem if is_file else material,
        scene=scene,
        max_error=max_error,
        max_bytes=max_bytes,
        max_time=max_time,
        source=material if is_file else None,
    )
    tell(advice.to_dict(), as_json)
