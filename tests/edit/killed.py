"""Children that write files without end, and are killed at times drawn by a seed."""

import itertools
import time
from collections.abc import Callable, Iterator
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np

from bvbedit.edit.appearance import Gain
from bvbedit.edit.autosave import autosave, discard_autosave
from bvbedit.edit.document import Document
from bvbedit.run import jobs_of, run

KILLS = 10
# The first child imports all modules, the others are forked from it.
CONTEXT = get_context("forkserver")
CONTEXT.set_forkserver_preload([__name__])


def kills(task: Callable[[Connection, Path], None], folder: Path, longest: float, seed: int = 0) -> Iterator[int]:
    """Yield after each time that the task was killed, within ``longest`` seconds after it had begun to write."""
    rng = np.random.default_rng(seed)
    for n in range(KILLS):
        ours, theirs = CONTEXT.Pipe()
        child = CONTEXT.Process(target=task, args=(theirs, folder), daemon=True)
        child.start()
        assert ours.poll(60), "the child never began"
        ours.recv()
        time.sleep(rng.uniform(0, longest))
        child.kill()
        child.join()
        assert child.exitcode == -9
        yield n


def brighter(document: Document, times: int) -> Document:
    """The document after so many gains."""
    for _ in range(times):
        document = document.do(Gain(factor=1.25))
    return document


def save_for_ever(tell: Connection, folder: Path) -> None:
    """Save a document that begins at start.bvb as model.bvb, with 1, 2, 3, 4, 1 ... edits."""
    start = Document.open(folder / "start.bvb")
    for times in itertools.cycle(range(1, 5)):
        brighter(start, times).save(folder / "model.bvb")
        if times == 1:
            tell.send(None)


def autosave_for_ever(tell: Connection, folder: Path) -> None:
    """Keep model.bvb with 1, 2, 3, 4, 1 ... more edits."""
    start = Document.open(folder / "model.bvb")
    for times in itertools.cycle(range(1, 5)):
        autosave(brighter(start, times), folder / "model.bvb")
        if times == 1:
            tell.send(None)


def edit_for_ever(tell: Connection, folder: Path) -> None:
    """What a session does: edits, each kept, then a save, by which what was kept is no longer needed."""
    document = Document.open(folder / "start.bvb")
    while True:
        for times in (1, 2):
            autosave(brighter(document, times), folder / "model.bvb")
        brighter(document, 2).save(folder / "model.bvb")
        discard_autosave(folder / "model.bvb")
        tell.send(None)


def run_for_ever(tell: Connection, folder: Path) -> None:
    """Make the outputs of look.toml again and again."""
    while True:
        run(jobs_of(folder / "look.toml"), again=True)
        tell.send(None)
