"""Work on large arrays on all threads: numpy and kernels let others run meanwhile.

A few layers at once stay in the cache, and their temporaries need no fresh memory from the system, whose pages cost
more than the arithmetic.
"""

import os
import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from multiprocessing import parent_process
from threading import Thread
from types import ModuleType
from typing import Any, TypeVar

S = TypeVar("S")
T = TypeVar("T")

# Rows of a block: three channels of them are 768 KB.
ROWS = 1 << 15


def side_by_side(work: Callable[[S], T], items: Iterable[S]) -> list[T]:
    """Return what ``work`` returns for each of the ``items``, in their order; it must write to nothing shared."""
    import numba

    with ThreadPoolExecutor(numba.get_num_threads()) as pool:
        return list(pool.map(work, items))


def in_turn(work: Callable[[S], T], items: Iterable[S]) -> Iterator[T]:
    """Yield what ``work`` returns for each of the ``items``, in their order, while others are worked on.

    Each is done by one thread: kernels inside do not spread over others. What was not begun when the iterator is closed
    is left undone.
    """
    import numba

    def alone() -> None:
        numba.set_num_threads(1)

    pool = ThreadPoolExecutor(numba.get_num_threads(), initializer=alone)
    try:
        yield from pool.map(work, items)
    finally:
        pool.shutdown(cancel_futures=True)


def each_block(count: int, rows: int, work: Callable[[slice], T]) -> list[T]:
    """Return what ``work`` returns for consecutive slices of ``count`` layers of so many ``rows`` each.

    It must write to nothing but its own slice. Which slices there are does not depend on the number of threads.
    """
    layers = max(1, ROWS // max(rows, 1))
    return side_by_side(work, [slice(start, min(start + layers, count)) for start in range(0, count, layers)])


@contextmanager
def one_matrix_thread() -> Iterator[None]:
    """Let processes that are spawned meanwhile multiply matrices by one thread, and not run the main module again.

    By several threads the last bits are others, and a recipe would not make the same fit again. What is done in them is
    imported from its own module, and a script without a guard would start itself over and over.
    """
    main, threads = sys.modules["__main__"], os.environ.get("OPENBLAS_NUM_THREADS")
    sys.modules["__main__"] = ModuleType("__main__")
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    try:
        yield
    finally:
        sys.modules["__main__"] = main
        if threads is None:
            del os.environ["OPENBLAS_NUM_THREADS"]
        else:
            os.environ["OPENBLAS_NUM_THREADS"] = threads


def end_with_parent() -> None:
    """Let this process end when the one that has started it is gone.

    A worker of a pool would wait for work for ever where that one is killed, and keep its memory.
    """
    parent = parent_process()
    if parent is not None:
        Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(other: Any) -> None:
    other.join()
    os._exit(1)
