"""Running a study: cell after cell in processes, each kept as it is done, so that an interrupted one goes on."""

import json
import tomllib
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Executor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import tomlkit

from bvbedit.brdf.database import Generated, database
from bvbedit.brdf.materials import MATERIALS, material_named
from bvbedit.edit.recipe import Source
from bvbedit.errors import BvbError
from bvbedit.io import make_folder
from bvbedit.io.files import reading, replacing
from bvbedit.processes import as_done, processes
from bvbedit.study.cells import Task, measured, versions
from bvbedit.study.plan import Configuration, Plan
from bvbedit.study.table import RESULTS, Row, to_csv

SUFFIXES = (".binary", ".bsdf", ".npz")
PLAN, VERSIONS, CELLS = "plan.toml", "versions.json", "cells"
# Stands for all materials of the generated database.
DATABASE = "database"
# Seconds to wait for a scheduler.
PATIENCE = 10

Told = Callable[[int, int, dict[str, Any]], object]


def materials_of(paths: Sequence[Path]) -> dict[str, Source]:
    """Return the materials that paths name, by names of their own: files, folders, samples, or ``database``.

    Raises BvbError for a path that is nothing of it, a folder without materials, and none at all.
    """
    sources: list[Source] = []
    for path in paths:
        if path.is_dir():
            inside = sorted(file for file in path.iterdir() if file.suffix.lower() in SUFFIXES)
            if not inside:
                raise BvbError(f"{path} holds no materials. Name a folder with files in {', '.join(SUFFIXES)}.")
            sources += [Source(file=file) for file in inside]
        elif path.exists():
            sources.append(Source(file=path))
        elif str(path) == DATABASE:
            sources += [_sample(name) for name in database()]
        elif len(path.parts) == 1 and not path.suffix:
            sources.append(_sample(str(path)))
        else:
            raise BvbError(f"{path} does not exist. Name a file, a folder, or a sample material.")
    if not sources:
        raise BvbError("No materials. Name files, folders or sample materials.")
    names = [source.name for source in sources]
    return {
        (source.name if names.count(source.name) == 1 else f"{source.name} {n + 1}"): source
        for n, source in enumerate(sources)
    }


def _sample(name: str) -> Source:
    try:
        material = material_named(name)
    except BvbError:
        known = ", ".join(MATERIALS)
        raise BvbError(
            f"{name} is no file, no folder and no sample material. Samples: {known}, and {DATABASE} for a hundred more."
        ) from None
    if isinstance(material, Generated):
        return Source(sample=name, noise=material.noise, seed=material.noise_seed)
    return Source(sample=name)


def run_study(
    plan: Plan,
    materials: dict[str, Source],
    out: Path,
    *,
    jobs: int = 1,
    dask: str | None = None,
    told: Told | None = None,
) -> list[Row]:
    """Measure all cells that are not measured yet, and return all rows; ``out`` keeps them, and the table.

    ``jobs`` processes share the cells, or the workers of the Dask cluster at the address ``dask``, which must see the
    files. ``told`` is called with how many cells are done, how many there are, and the newest row. A cell that cannot
    be made is a row that says why. Results are the same whoever does it, but for times.
    Raises BvbError where ``out`` holds the results of another plan or of other materials, where it cannot be written,
    and where no cluster answers.
    """
    make_folder(out)
    make_folder(out / CELLS)
    _check_same(plan, materials, out)
    tasks = {
        _place(out, material, configuration): Task(
            material, _absolute(source), configuration, plan.pictures, plan.stride
        )
        for material, source in materials.items()
        for configuration in plan.configurations
    }
    done = sum(place.exists() for place in tasks)
    todo = {place: task for place, task in tasks.items() if not place.exists()}
    for place, row in _measured(todo, jobs, dask):
        _write(place, row)
        done += 1
        if told is not None:
            told(done, len(tasks), row)
    scenes = [Path(scene).stem for scene in plan.pictures.scenes]
    rows = [Row.of(json.loads(_text(place)), scenes) for place in tasks]
    with replacing(out / RESULTS) as stream:
        stream.write(to_csv(rows, scenes).encode())
    return rows


def _absolute(source: Source) -> Source:
    """Return a source that a process in another folder finds, too."""
    return source if source.file is None else replace(source, file=source.file.resolve())


def _measured(todo: dict[Path, Task], jobs: int, dask: str | None) -> Iterator[tuple[Path, dict[str, Any]]]:
    """Yield the rows as they are done."""
    if not todo:
        return
    if dask is not None:
        with _cluster(dask) as executor:
            yield from _rows(executor, todo)
        return
    # One process, too, is another than ours: what matrices are multiplied by there is known, and memory is given back.
    left = dict(todo)
    while left:
        count = min(jobs, len(left))
        try:
            with processes(count) as executor:
                for place, row in _rows(executor, dict(left), count):
                    del left[place]
                    yield place, row
        except BrokenProcessPool:
            # A process was lost, as when memory runs out, and with it what the others had in hand: the first ones left.
            # One by one it shows which cell it is that cannot be done.
            for place in list(left)[:count]:
                task = left.pop(place)
                try:
                    with processes(1) as executor:
                        (found,) = _rows(executor, {place: task}, 1)
                except BrokenProcessPool as error:
                    found = place, _lost(task, error)
                yield found


def _rows(
    executor: Executor, todo: dict[Path, Task], at_once: int | None = None
) -> Iterator[tuple[Path, dict[str, Any]]]:
    """Yield the rows as they are done. Raises BrokenProcessPool where a process is lost."""
    places = list(todo)
    for n, future in as_done(executor, measured, list(todo.values()), at_once):
        yield places[n], future.result()


def _lost(task: Task, error: BrokenProcessPool) -> dict[str, Any]:
    configuration = task.configuration
    return {
        "material": task.material,
        "configuration": configuration.name,
        "series": configuration.series,
        "kind": "spline" if configuration.fit is not None else "analytic",
        "status": "failed",
        "reason": f"the process ended: {error}",
    }


@contextmanager
def _cluster(address: str) -> Iterator[Executor]:
    try:
        import distributed
    except ImportError:
        raise BvbError("A Dask cluster needs the package distributed: pip install 'bvbedit[study]'.") from None
    try:
        client: Any = distributed.Client(address, timeout=PATIENCE, set_as_default=False)  # type: ignore[no-untyped-call]
    except (OSError, TimeoutError, ValueError) as error:
        raise BvbError(f"No Dask scheduler answers at {address} ({error}). Start one, or leave --dask out.") from None
    try:
        executor: Executor = client.get_executor(pure=False)
        yield executor
    finally:
        client.close()


def _place(out: Path, material: str, configuration: Configuration) -> Path:
    joined = sha256(json.dumps([material, configuration.name]).encode())
    return out / CELLS / f"{joined.hexdigest()[:24]}.json"


def _check_same(plan: Plan, materials: dict[str, Source], out: Path) -> None:
    """Keep what the results are of, or check that it is the same as before."""
    # As TOML and JSON have it: tuples are lists.
    told = json.loads(json.dumps(_told(plan, materials)))
    kept = out / PLAN
    if kept.exists():
        try:
            before = tomllib.loads(_text(kept))
        except ValueError:
            raise BvbError(f"{kept} is damaged. Remove {out}, or choose another --out.") from None
        other = next((what for what in told if before.get(what) != told[what]), None)
        if other is not None:
            raise BvbError(f"{out} holds results of other {other}. Choose another --out, or remove it.")
    elif any((out / CELLS).iterdir()):
        raise BvbError(f"{out} holds cells, but not their plan. Choose another --out, or remove it.")
    else:
        with replacing(kept) as stream:
            stream.write(tomlkit.dumps(told).encode())
    with replacing(out / VERSIONS) as stream:
        stream.write(json.dumps(dict(versions()), indent=1).encode())


def _told(plan: Plan, materials: dict[str, Source]) -> dict[str, Any]:
    """Return all that results depend on."""
    return {
        "plan": plan.to_dict(),
        "materials": {name: _sum(source) for name, source in materials.items()},
        "scenes": {scene: _bytes_sum(Path(scene)) for scene in plan.pictures.scenes if Path(scene).exists()},
    }


def _sum(source: Source) -> str:
    return repr(source) if source.file is None else _bytes_sum(source.file)


def _bytes_sum(path: Path) -> str:
    with reading(path) as stream:
        joined = sha256()
        while block := stream.read(1 << 20):
            joined.update(block)
    return joined.hexdigest()


def _write(place: Path, row: dict[str, Any]) -> None:
    with replacing(place) as stream:
        stream.write(json.dumps(row).encode())


def _text(path: Path) -> str:
    with reading(path) as stream:
        return stream.read().decode()


def failed(rows: Iterable[Row]) -> list[Row]:
    """Return the rows of cells that could not be made."""
    return [row for row in rows if row.status != "done"]
