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
# Matrices are multiplied by one thread: by several the last bits are others, and a recipe would not make the same fit
# again. glibc (others do not read it) gives threads two heaps in all, in place of eight a core: what fits leave in so
# many never goes back to the system, and a worker had grown by 40 MB a material, to 1.5 GB after fifty.
SPAWNED = {"OPENBLAS_NUM_THREADS": "1", "MALLOC_ARENA_MAX": "2"}


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
