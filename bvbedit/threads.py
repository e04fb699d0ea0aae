"""Work on large arrays on all threads: numpy and kernels let others run meanwhile.

A few layers at once stay in the cache, and their temporaries need no fresh memory from the system, whose pages cost
more than the arithmetic.
"""

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

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
