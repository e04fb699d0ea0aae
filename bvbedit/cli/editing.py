"""Commands that edit by words: edit, run, history."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from bvbedit.cli.models import Json
from bvbedit.cli.output import progress, report

if TYPE_CHECKING:
    from bvbedit.edit.document import Document
    from bvbedit.edit.operation import Edit

MOST_JOBS = 256


def edit(
    source: Path | None = None,
    target: Path | None = None,
    /,
    *,
    op: Annotated[list[str] | None, Parameter(negative="")] = None,
    operations: Annotated[bool, Parameter(negative="")] = False,
    precision: str | None = None,
    as_json: Json = False,
) -> None:
    """Edit a model in words, like --op "tint rgb=1,0.8,0.6 theta_h=0..20"; --operations lists what can be done.

    Parameters
    ----------
    source
        The .bvb model to edit.
    target
        The .bvb file to write; it keeps the history.
    op
        An edit, in quotes; give --op again for each further one.
    operations
        List the operations with their parameters, limits and defaults.
    precision
        float16, float32, float64 or quantised, in place of the model's own.
    as_json
        Print one JSON object.
    """
    from bvbedit.edit.operations import edit_of_line, overview
    from bvbedit.errors import BvbError

    if operations:
        print(overview())
        return
    if source is None or target is None or not op:
        raise BvbError('Nothing to do. Write it like: bvbedit edit IN.bvb OUT.bvb --op "gain factor=1.5"')
    edit_file(source, target, [edit_of_line(line) for line in op], as_json, precision)


def edit_file(source: Path, target: Path, edits: "Sequence[Edit]", as_json: bool, precision: str | None = None) -> None:
    """Make edits to the model in a file, write it with its history, and tell what changed."""
    from bvbedit.edit.combining import Blend
    from bvbedit.edit.document import Document
    from bvbedit.errors import BvbError
    from bvbedit.io import check_target

    check_target(target, (".bvb",))
    document = Document.open(source)
    partners = [each.partner.resolve() for each in edits if isinstance(each, Blend)]
    if target.resolve() in partners or (target.resolve() == source.resolve() and not document.past):
        raise BvbError(f"{target} is what the history needs, and would be lost. Write to another file.")
    bytes_before = source.stat().st_size
    steps = []
    with progress(f"Editing {source.name}") as watch:
        for n, each in enumerate(edits):
            try:
                document = document.do(each)
            except BvbError as error:
                raise BvbError(
                    f"{each.op}: {error}" if len(edits) == 1 else f"edit {n + 1} ({each.op}): {error}"
                ) from None
            told = document.model.report
            missed, notes = told.get("refit_error"), told.get("notes", [])
            steps.append(
                {"edit": each.line(), **({} if missed is None else {"refit_error": missed}), "notes": list(notes)}
            )
            if watch is not None:
                watch((n + 1) / len(edits))
    document.save(target, precision=precision)
    report(
        {**_told(document, target), "steps": steps, "bytes_before": bytes_before, "bytes_after": target.stat().st_size},
        as_json,
    )


def _told(document: "Document", target: Path) -> dict[str, Any]:
    """Return what an edited file has become, what its storage rounds off included."""
    from bvbedit.edit.document import Changes
    from bvbedit.io import load

    before, saved = document.at(0), load(target)
    changes = Changes(before, saved)  # type: ignore[arg-type]
    was, now = changes.plausibility()
    return {
        "file": str(target),
        "size_before": list(before.spline.size),
        "size_after": list(document.model.spline.size),
        "degrees": list(document.model.spline.degrees),
        "max_change": changes.max_change,
        "plausibility": {"before": was.text(), "after": now.text()},
    }


def run(
    recipe: Path,
    /,
    *,
    set_: Annotated[list[str] | None, Parameter(name="--set", negative="")] = None,
    on: Annotated[list[Path] | None, Parameter(consume_multiple=True, negative="")] = None,
    out: Path | None = None,
    jobs: int = 1,
    again: Annotated[bool, Parameter(negative="")] = False,
    as_json: Json = False,
) -> None:
    """Make a recipe: for its own source, or for many materials.

    Parameters
    ----------
    recipe
        A TOML file of source, steps and outputs.
    set_
        Change a parameter of a step by its label or number, like warm.rgb=1,0.7,0.5.
    on
        Materials in place of the recipe's source: models or measurements.
    out
        The folder to write into; by default that of the recipe. Made if it is not there.
    jobs
        How many materials at once.
    again
        Make also what is up to date.
    as_json
        Print one JSON object.
    """
    from bvbedit.errors import BvbError
    from bvbedit.run import jobs_of
    from bvbedit.run import run as run_all

    if not 1 <= jobs <= MOST_JOBS:
        raise BvbError(f"--jobs is {jobs}. Give a number in 1 ... {MOST_JOBS}.")
    work = jobs_of(recipe, set_ or [], on or [], out)
    done = 0
    with progress(recipe.name) as watch:

        def tell(_: object) -> None:
            nonlocal done
            done += 1
            if watch is not None:
                watch(done / len(work))

        outcomes = run_all(work, jobs, again=again, progress=tell)
    failed = [outcome for outcome in outcomes if outcome.status == "failed"]
    if failed and len(outcomes) == 1:
        raise BvbError(str(failed[0].error))
    if as_json:
        report({"recipe": str(recipe), "materials": [o.to_dict() for o in outcomes]}, True)
    else:
        width = max(len(Path(o.source).name) for o in outcomes)
        for o in outcomes:
            what = (
                o.error if o.status == "failed" else "; ".join([", ".join(str(path) for path in o.outputs), *o.notes])
            )
            print(f"{Path(o.source).name:<{width}}  {o.status:<10}  {o.seconds:6.2f} s  {what}")
    if failed:
        raise BvbError(f"{len(failed)} of {len(outcomes)} could not be made: {failed[0].source}: {failed[0].error}")


def history(
    source: Path,
    /,
    *,
    recipe: Annotated[bool, Parameter(negative="")] = False,
    until: int | None = None,
    as_json: Json = False,
) -> None:
    """Tell how a model came about.

    Parameters
    ----------
    source
        The .bvb model.
    recipe
        Print a recipe in TOML that makes the same model again; bvbedit run makes it.
    until
        The first so many steps only: the way back to before the others.
    as_json
        Print one JSON object.
    """
    from bvbedit.edit.document import Document
    from bvbedit.edit.recipe import to_toml
    from bvbedit.errors import BvbError
    from bvbedit.io.bvb import load_recipe

    if recipe and as_json:
        raise BvbError("--recipe and --json exclude each other. Give one of them.")
    document = Document.open(source)
    told = load_recipe(source)
    if told is None:
        if recipe:
            raise BvbError(f"{source} has no history: it was fitted or saved without one. Edit it first.")
        told = {"source": dict(document.source), "steps": []}
    if until is not None:
        if not 0 <= until <= len(told["steps"]):
            raise BvbError(f"--until is {until}. The history has {len(told['steps'])} steps: give 0 up to that.")
        told = {**told, "steps": told["steps"][:until]}
        told.pop("names", None)
    if recipe:
        # Seen from the file's own folder, in which a recipe is best put.
        kept = {key: value for key, value in told.items() if key != "made"}
        print(to_toml(kept, [f"{source.stem}-again.bvb"], document.model.storage.precision), end="")
        return
    if as_json:
        report({"file": str(source), "source": told["source"], "steps": told["steps"]}, True)
        return
    lines = document.lines[: len(told["steps"])]
    print(f"from {told['source'].get('file') or told['source'].get('sample') or 'a model without a file'}")
    for n, line in enumerate(lines, 1):
        print(f"{n:3}  {line}")
    if not lines:
        print("no edits")
