"""The generated database as files: one for each material, the same bytes however many processes make them."""

import os
import shutil
import zipfile
import zlib
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from bvbedit.brdf.database import Generated, generated
from bvbedit.brdf.goniophotometer import GRIDS
from bvbedit.errors import BvbError
from bvbedit.io import check_target, make_folder, save
from bvbedit.io.merl import HEADER
from bvbedit.processes import as_done, processes
from bvbedit.spline.arguments import is_whole, shown

GridName = Literal["merl", "paper"]
SUFFIXES: dict[GridName, str] = {"merl": ".binary", "paper": ".npz"}
MOST_JOBS = 256
# Bytes that a reading of 11 significant bits takes in a table, deflated: 1.8 were measured.
STORED = 3
# What the system needs besides: a disk that is full to the last byte serves nobody.
SPARE = 64 << 20


@dataclass(frozen=True)
class Written:
    """A material's file."""

    name: str
    file: Path
    status: Literal["made", "kept"]
    """Kept: it was there, and whole."""
    bytes: int
    noise: float
    description: str

    def to_dict(self) -> dict[str, Any]:
        """Return it as JSON can hold it."""
        return {**asdict(self), "file": str(self.file)}


def write_database(
    materials: Sequence[Generated],
    folder: str | os.PathLike[str],
    *,
    grid: GridName = "merl",
    jobs: int = 1,
    progress: Callable[[float], None] | None = None,
) -> list[Written]:
    """Measure each of the ``materials`` on ``grid``, with its own noise, and write it to NAME.binary or NAME.npz.

    ``folder`` is made if it is missing. Files that are there and whole stay, so that a run that was stopped is gone on
    with; each file appears only when it is complete. ``jobs`` processes share the work, and the files do not depend on
    how many. ``progress`` is called with the share done.
    Raises BvbError, before anything is written, for an unknown grid, jobs that are none in 1 ... 256, a folder that
    cannot be written and a disk without room for all; later, for a file that cannot be written.
    """
    if grid not in SUFFIXES:
        raise BvbError(f"Unknown grid {shown(grid)}. Choose one of {', '.join(SUFFIXES)}.")
    if not is_whole(jobs) or not 1 <= jobs <= MOST_JOBS:
        raise BvbError(f"--jobs is {shown(jobs)}. Give a number in 1 ... {MOST_JOBS}.")
    place = Path(folder)
    make_folder(place)
    files = {m.name: place / f"{m.name}{SUFFIXES[grid]}" for m in materials}
    for file in files.values():
        check_target(file, (SUFFIXES[grid],))
    missing = [m.name for m in materials if not is_whole_file(files[m.name], grid)]
    _check_room(place, len(missing), grid)
    for count, _ in enumerate(_made([(name, files[name], grid) for name in missing], int(jobs)), start=1):
        if progress is not None:
            progress(count / len(missing))
    made = set(missing)
    return [
        Written(
            m.name,
            files[m.name],
            "made" if m.name in made else "kept",
            files[m.name].stat().st_size,
            m.noise,
            m.description,
        )
        for m in materials
    ]


def most_bytes(grid: GridName) -> int:
    """Return the bytes of a file on ``grid``: exactly for MERL's, more than was ever seen for a table."""
    nodes = int(np.prod([len(axis) for axis in GRIDS[grid].axes]))
    if grid == "merl":
        return HEADER + 24 * nodes
    return 3 * STORED * nodes


def is_whole_file(file: Path, grid: GridName) -> bool:
    """Return whether ``file`` is there with all its bytes; those of a table are checked by their CRC-32."""
    try:
        if grid == "merl":
            with file.open("rb") as stream:
                header = stream.read(HEADER)
            shape = np.array([len(axis) for axis in GRIDS[grid].axes], "<i4").tobytes()
            return header == shape and file.stat().st_size == most_bytes(grid)
        with zipfile.ZipFile(file) as archive:
            return "values.npy" in archive.namelist() and archive.testzip() is None
    except (OSError, zipfile.BadZipFile, EOFError, ValueError, NotImplementedError, zlib.error):
        return False


def _check_room(folder: Path, count: int, grid: GridName) -> None:
    """Raise BvbError where ``count`` more files do not fit on the disk."""
    if count == 0:
        return
    need, free = count * most_bytes(grid), shutil.disk_usage(folder).free
    if need + SPARE > free:
        raise BvbError(
            f"{folder}: {count} files take up to {need / 1e9:.1f} GB, and {free / 1e9:.1f} GB are free. "
            "Make room, or ask for fewer with --count."
        )


Task = tuple[str, Path, GridName]


def _made(tasks: Sequence[Task], jobs: int) -> Iterator[str]:
    if jobs == 1 or len(tasks) < 2:
        for task in tasks:
            yield _make(task)
        return
    count = min(jobs, len(tasks))
    try:
        with processes(count) as executor:
            for _, future in as_done(executor, _make, tasks, count):
                yield future.result()
    except BrokenProcessPool:
        raise BvbError("A process was lost, as it is when memory runs out. Run it again with fewer jobs.") from None


def _make(task: Task) -> str:
    name, file, grid = task
    save(generated(name).measured(grid), file)
    return name
