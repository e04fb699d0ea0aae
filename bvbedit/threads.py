"""Work on large arrays on all threads: numpy and kernels let others run meanwhile.

A few layers at once stay in the cache, and their temporaries need no fresh memory from the system, whose pages cost
more than the arithmetic.
"""

from collections.abc import Callable, Iterable
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


def each_block(count: int, rows: int, work: Callable[[slice], T]) -> list[T]:
    """Return what ``work`` returns for consecutive slices of ``count`` layers of so many ``rows`` each.

    It must write to nothing but its own slice. Which slices there are does not depend on the number of threads.
    """
    layers = max(1, ROWS // max(rows, 1))
    return side_by_side(work, [slice(start, min(start + layers, count)) for start in range(0, count, layers)])
