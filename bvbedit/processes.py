"""Work that is shared by processes of our own: how they are started, what they are given, and when they end."""

import os
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import partial
from itertools import islice
from multiprocessing import get_context, parent_process
from threading import Thread
from types import ModuleType
from typing import Any, TypeVar

S = TypeVar("S")
T = TypeVar("T")

# Matrices are multiplied by one thread: by several the last bits are others, and a recipe would not make the same fit
# again. glibc (others do not read it) gives threads two heaps in all, in place of eight a core: what fits leave in so
# many never goes back to the system, and a worker had grown by 40 MB a material, to 1.5 GB after fifty.
SPAWNED = {"OPENBLAS_NUM_THREADS": "1", "MALLOC_ARENA_MAX": "2"}


@contextmanager
def spawning() -> Iterator[None]:
    """Let processes that are spawned meanwhile work as ``SPAWNED`` says, and not run the main module again.

    What is done in them is imported from its own module, and a script without a guard would start itself over and over.
    """
    main, before = sys.modules["__main__"], {name: os.environ.get(name) for name in SPAWNED}
    sys.modules["__main__"] = ModuleType("__main__")
    os.environ.update(SPAWNED)
    try:
        yield
    finally:
        sys.modules["__main__"] = main
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


@contextmanager
def processes(count: int) -> Iterator[Executor]:
    """Processes that share the processors, and end when they are left, or with the process that has started them."""
    # Spawned: a fork would inherit the locks of running threads.
    with spawning():
        executor = ProcessPoolExecutor(count, mp_context=get_context("spawn"), initializer=_begin, initargs=(count,))
        try:
            yield executor
        finally:
            executor.shutdown(wait=True, cancel_futures=True)


def as_done(
    executor: Executor, work: Callable[[S], T], items: Sequence[S], at_once: int | None = None
) -> Iterator[tuple[int, Future[T]]]:
    """Yield the number of each of the ``items`` with what became of ``work`` on it, as that becomes known.

    ``at_once`` are handed over at a time, or all: what is not begun when the iterator is closed is left undone, and
    Ctrl-C ends what ``processes`` do. What is not begun for want of a living process has that for its exception.
    """
    if isinstance(executor, ProcessPoolExecutor):
        work = partial(_attentive, work)
    left, running = iter(range(len(items))), dict[Future[T], int]()
    try:
        while True:
            for n in islice(left, None if at_once is None else at_once - len(running)):
                running[_submitted(executor, work, items[n])] = n
            if not running:
                return
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                yield running.pop(future), future
    finally:
        for future in running:
            future.cancel()


def _submitted(executor: Executor, work: Callable[[S], T], item: S) -> Future[T]:
    try:
        return executor.submit(work, item)
    except BrokenProcessPool as error:
        lost = Future[T]()
        lost.set_exception(error)
        return lost


def _attentive(work: Callable[[S], T], item: S) -> T:
    """Return what ``work`` returns; heed Ctrl-C only meanwhile, for a process that waits has nothing to tell of it."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        return work(item)
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def _begin(count: int) -> None:
    import numba

    _end_with_parent()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    numba.set_num_threads(max(1, min(numba.get_num_threads(), (os.cpu_count() or 1) // count)))


def _end_with_parent() -> None:
    """Let this process end when the one that has started it is gone.

    A worker of a pool would wait for work for ever where that one is killed, and keep its memory.
    """
    parent = parent_process()
    if parent is not None:
        Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(other: Any) -> None:
    other.join()
    os._exit(1)
