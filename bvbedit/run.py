"""A recipe made for one material or for many: read, fit if it is a measurement, edited, written; what is done stays."""

import json
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from hashlib import sha256
from pathlib import Path
from time import perf_counter
from typing import Any, Literal

import numpy as np

from bvbedit.brdf.albedo import albedo
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.edit.combining import Blend
from bvbedit.edit.recipe import Output, Recipe, Source, read_recipe
from bvbedit.errors import BvbError
from bvbedit.io import check_target, make_folder
from bvbedit.io.bvb import load_recipe
from bvbedit.io.export import export
from bvbedit.io.files import reading
from bvbedit.processes import as_done, processes

# Where many materials are run, and the recipe names no file for each.
EACH = Output("{name}.bvb")
# Degrees at which the albedo of what was made is looked at.
ELEVATIONS = range(0, 90, 3)


@dataclass(frozen=True)
class Job:
    """One material to run a recipe on."""

    recipe: Path
    settings: tuple[str, ...]
    source: Source
    folder: Path
    """Where the outputs go."""
    many: bool
    """Whether it is one of several, so that outputs must be told apart by its name."""


@dataclass(frozen=True)
class Outcome:
    """What became of a material."""

    source: str
    status: Literal["made", "up to date", "failed"]
    outputs: tuple[Path, ...] = ()
    seconds: float = 0.0
    error: str | None = None
    notes: tuple[str, ...] = ()
    """What a user should know: what the steps said, and where energy is created."""

    def to_dict(self) -> dict[str, Any]:
        """Return it as JSON can hold it."""
        return {**asdict(self), "outputs": [str(path) for path in self.outputs]}


def jobs_of(
    recipe: str | os.PathLike[str],
    settings: Sequence[str] = (),
    sources: Sequence[Path] = (),
    folder: Path | None = None,
) -> list[Job]:
    """Return what a recipe asks for: its own source, or each of ``sources`` in its place.

    ``folder`` is where the outputs go, by default the recipe's. All that can be known before the first step is made is
    checked; a source that cannot be read fails by itself. Raises BvbError for a mistake in the recipe, a missing
    partner, outputs that meet one another, a source or a partner, and outputs that cannot be written.
    """
    read = read_recipe(recipe, settings)
    read.check_partners()
    if not sources and read.source is None:
        raise BvbError(f"{recipe} names no source. Give it one, or name materials with --on.")
    if not sources and not read.outputs:
        raise BvbError(f"{recipe} names no outputs. Add [[outputs]] with a file.")
    chosen = [Source(file=path) for path in sources] if sources else [s for s in (read.source,) if s is not None]
    target = Path(recipe).parent if folder is None else folder
    if folder is not None:
        make_folder(folder)
    jobs = [Job(Path(recipe), tuple(settings), source, target, bool(sources)) for source in chosen]
    partners = [edit.partner for edit in read.steps if isinstance(edit, Blend)]
    needed = {path.resolve() for path in (*partners, *(s.file for s in chosen if s.file is not None))}
    made: dict[Path, Source] = {}
    for job in jobs:
        for _, path in _outputs(read, job):
            check_target(path, (path.suffix.lower(),))
            place = path.resolve()
            if place in made and made[place] is job.source:
                raise BvbError(f"{path} would be made twice. Give each output a file of its own.")
            if place in made:
                raise BvbError(
                    f"{path} would be made of {made[place]} and of {job.source}. Put {{name}} into its name."
                )
            made[place] = job.source
            if place in needed:
                raise BvbError(f"{path} is a source or a partner itself. Choose another output, or --out a folder.")
    return jobs


def run(
    jobs: Sequence[Job], workers: int = 1, *, again: bool = False, progress: Callable[[Outcome], object] | None = None
) -> list[Outcome]:
    """Return what became of all jobs, in their order: one that fails does not stop the others.

    ``workers`` processes share them. What is up to date is left as it is, unless ``again``.
    """
    outcomes: list[Outcome | None] = [None] * len(jobs)
    for n, outcome in _outcomes(jobs, workers, again):
        outcomes[n] = outcome
        if progress is not None:
            progress(outcome)
    return [outcome for outcome in outcomes if outcome is not None]


def _outcomes(jobs: Sequence[Job], workers: int, again: bool) -> Iterator[tuple[int, Outcome]]:
    if workers == 1 or len(jobs) == 1:
        for n, job in enumerate(jobs):
            yield n, attempt(job, again)
        return
    count = min(workers, len(jobs))
    with processes(count) as executor:
        for n, future in as_done(executor, partial(attempt, again=again), jobs, count):
            error = future.exception()
            if error is None:
                yield n, future.result()
            elif isinstance(error, Exception):
                # The process itself was lost, as it is when memory runs out.
                words = f"the process ended: {error}. Run it again with fewer jobs."
                yield n, Outcome(str(jobs[n].source), "failed", error=words)
            else:
                raise error


def attempt(job: Job, again: bool = False) -> Outcome:
    """Return what became of one job; what goes wrong is told, not raised."""
    start = perf_counter()
    try:
        recipe = read_recipe(job.recipe, job.settings)
        outputs = _outputs(recipe, job)
        paths = tuple(path for _, path in outputs)
        key = _key(recipe, job)
        if not again and _are_current(paths, key):
            return Outcome(str(job.source), "up to date", paths, perf_counter() - start)
        notes = _make(recipe, job, outputs, key)
    except BvbError as error:
        return Outcome(str(job.source), "failed", (), perf_counter() - start, str(error))
    except MemoryError:
        return Outcome(str(job.source), "failed", (), perf_counter() - start, "Not enough memory. Run fewer jobs.")
    return Outcome(str(job.source), "made", paths, perf_counter() - start, notes=notes)


def _make(recipe: Recipe, job: Job, outputs: Sequence[tuple[Output, Path]], key: str) -> tuple[str, ...]:
    """Make the outputs, and return what a user should know."""
    source = job.source.read()
    fitted = not isinstance(source, SplineBrdf)
    model = source if isinstance(source, SplineBrdf) else recipe.fit.fitted(source)
    # Of another material than the recipe's own the digest says nothing.
    asked = recipe if not job.many or recipe.source is None else replace(recipe, source=None)
    document = asked.apply(model, job.source, fitted=fitted)
    # Models first: tables are known to be done by being no older.
    for output, path in sorted(outputs, key=lambda made: made[1].suffix.lower() != ".bvb"):
        if path.suffix.lower() == ".bvb":
            document.save(path, precision=output.precision, pdf=output.pdf, made=key)
        else:
            export(document.model, path)
    theta = np.radians(list(ELEVATIONS))
    seen = albedo(document.model, theta)
    notes = [f"{edit.op}: {note}" for n, edit in enumerate(document.edits) for note in _notes(document.at(n + 1))]
    if (seen.value > 1 + seen.error).any():
        worst = int(np.argmax(seen.value.max(axis=1)))
        notes.append(f"energy is created: albedo {seen.value[worst].max():.3g} at {ELEVATIONS[worst]} degrees")
    return tuple(notes)


def _notes(model: SplineBrdf) -> list[str]:
    return list(model.report.get("notes", []))


def _outputs(recipe: Recipe, job: Job) -> list[tuple[Output, Path]]:
    """Return the outputs and where they go; with many materials each has the material's name in it."""
    name = job.source.name
    outputs = recipe.outputs or (EACH,)
    if job.many:
        alone = len(outputs) == 1
        outputs = tuple(o if "{name}" in o.file else replace(o, file=_told_apart(Path(o.file), alone)) for o in outputs)
    return [(output, output.path(job.folder, name)) for output in outputs]


def _told_apart(file: Path, alone: bool) -> str:
    return file.with_name("{name}" + ("" if alone else f"-{file.stem}") + file.suffix).as_posix()


def _key(recipe: Recipe, job: Job) -> str:
    """Return a text that changes with all that an output depends on."""
    partners = [_sum(edit.partner) for edit in recipe.steps if isinstance(edit, Blend)]
    steps = [edit.to_dict() | ({"partner": None} if isinstance(edit, Blend) else {}) for edit in recipe.steps]
    outputs = [asdict(output) for output in recipe.outputs]
    told = json.dumps([_source_sum(job.source), recipe.fit.to_dict(), steps, partners, outputs], sort_keys=True)
    return sha256(told.encode()).hexdigest()


def _source_sum(source: Source) -> str:
    return _sum(source.file) if source.file is not None else repr(source)


def _sum(path: Path) -> str:
    with reading(path) as stream:
        joined = sha256()
        while block := stream.read(1 << 20):
            joined.update(block)
    return joined.hexdigest()


def _are_current(paths: Sequence[Path], key: str) -> bool:
    """Return whether the outputs are what the job would make.

    A model says what it was made of. A table cannot: it is current beside a model that is, and is not older. A job that
    makes tables alone is never known to be done.
    """
    models = [path for path in paths if path.suffix.lower() == ".bvb"]
    try:
        if not models or not all(path.exists() and (load_recipe(path) or {}).get("made") == key for path in models):
            return False
    except BvbError:
        return False
    oldest = min(path.stat().st_mtime_ns for path in models)
    return all(path.exists() and path.stat().st_mtime_ns >= oldest for path in paths)
