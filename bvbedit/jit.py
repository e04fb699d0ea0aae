"""How hot loops are compiled: numba, with its cache where a cache can be written.

Modules that import this one pay for importing numba (0.25 s), so they are imported where they are needed.
"""

from collections.abc import Callable
from typing import Any, TypeVar

import numba
from numpy.typing import NDArray

F = TypeVar("F", bound=Callable[..., Any])
Array = TypeVar("Array", bound=NDArray[Any])


def _compile(function: F, **options: Any) -> F:
    try:
        return numba.njit(cache=True, error_model="numpy", **options)(function)  # type: ignore[no-any-return]
    except RuntimeError:
        # No cache directory can be written (a read-only installation): compile in each process instead.
        return numba.njit(**options)(function)  # type: ignore[no-any-return]


def kernel(function: F) -> F:
    """Compile ``function`` for one thread; kernels may call kernels.

    Its arguments are taken to be right: nothing is checked inside.
    """
    return _compile(function, nogil=True)


def inlined_kernel(function: F) -> F:
    """Compile ``function`` into whoever calls it: a small step of a hot loop.

    Otherwise each call would count references to the arrays handed over, atomically, which costs more than the work.
    """
    return _compile(function, nogil=True, forceinline=True)


def parallel_kernel(function: F) -> F:
    """Compile ``function`` with ``prange`` loops spread over numba's threads."""
    return _compile(function, nogil=True, parallel=True)


def frozen(array: Array) -> Array:
    """Return a read-only view: to numba a writable array is another type, and another compilation."""
    view = array.view()
    view.flags.writeable = False
    return view
