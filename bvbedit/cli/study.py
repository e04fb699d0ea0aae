"""Commands of studies: study, and what is told from it."""

from pathlib import Path
from typing import TYPE_CHECKING

from cyclopts import App

from bvbedit.cli.models import Json
from bvbedit.cli.output import progress, report

if TYPE_CHECKING:
    from bvbedit.study.table import Row

study_app = App(name="study", help="Measure what accuracy costs in bytes and time, over materials and configurations.")
study_app.command("bvbedit.cli.study_report:report", help="Write the report of a study.")


@study_app.default
def study(
    *materials: Path,
    out: Path = Path("study"),
    plan: Path | None = None,
    jobs: int = 1,
    dask: str | None = None,
    as_json: Json = False,
) -> None:
    """Fit each material in each configuration of a plan, and measure errors, bytes and times. Interrupted, it goes on.

    Parameters
    ----------
    materials
        Files, folders with files, names of sample materials (bvbedit sample list), or database: a hundred generated.
    out
        The folder that the results go to: results.csv, and a file for each cell, by which it goes on.
    plan
        A plan in TOML, in place of 40 configurations: the paper's, both charts over bytes, degrees, precisions, and
        analytic models.
    jobs
        Processes that share the work. Each takes up to 1 GB.
    dask
        The address of a Dask scheduler whose workers share the work instead.
    as_json
        Print one JSON object.
    """
    from time import perf_counter

    from bvbedit.errors import BvbError
    from bvbedit.study.plan import default_plan, read_plan
    from bvbedit.study.run import failed, materials_of, run_study
    from bvbedit.study.table import RESULTS

    if not 1 <= jobs <= 256:
        raise BvbError(f"jobs is {jobs}. Give 1 to 256.")
    start = perf_counter()
    read = default_plan() if plan is None else read_plan(plan)
    chosen = materials_of(materials)
    with progress(f"Measuring {len(chosen)} x {len(read.configurations)}") as share:
        told = None if share is None else lambda done, total, _: share(done / total)
        rows = run_study(read, chosen, out, jobs=jobs, dask=dask, told=told)
    lost = failed(rows)
    report(
        {
            "file": str(out / RESULTS),
            "materials": len(chosen),
            "configurations": len(read.configurations),
            "cells": len(rows),
            "failed": len(lost),
            **({"first_failure": _reason(lost[0])} if lost else {}),
            "seconds": perf_counter() - start,
        },
        as_json,
    )


def _reason(row: "Row") -> str:
    return f"{row.material}, {row.configuration}: {row.reason}"
