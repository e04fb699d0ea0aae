"""How many control points a budget of bytes holds, and how a fitted net is made to keep it.

What deflation makes of a net is known only when it is there: a quick fit tells, and the step of a quantised net gives
the last percent.
"""

from collections.abc import Callable

import numpy as np

from bvbedit.brdf.plan import Plan
from bvbedit.brdf.samples import Samples
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.brdf.storage import Storage
from bvbedit.errors import BvbError
from bvbedit.io.bvb import dumps

# Bytes that a control point of three channels takes, to begin with.
BYTES_OF_POINT = {"float16": 5.5, "float32": 11.0, "float64": 22.0, "quantised": 1.9}
TRIES = 6
CLOSE_ENOUGH = 0.98
# Shares of the step that are tried where bytes are left, and where they are lacking: beyond the last one, fewer control
# points are better.
SMALLER_STEPS = (1 / 8, 1 / 4, 1 / 2)
LARGER_STEPS = (1.05, 1.1, 1.15, 1.2, 1.25, 1.3, 1.4, 1.5)
# What a report adds to a file, as long as it is not written: the quick fits that estimate a size have none.
REPORT_BYTES = 1100

Bytes = Callable[[SplineBrdf], int]


def file_bytes(model: SplineBrdf) -> int:
    """Return the bytes of the file that ``model`` is saved as."""
    return len(dumps(model))


def payload_bytes(model: SplineBrdf) -> int:
    """Return the bytes of the control net and the interior knots of ``model`` as stored."""
    return model.storage.payload_bytes(model.spline.control, model.spline.degrees)


def first_guess(budget: int, precision: str) -> int:
    """Return about how many control points ``budget`` bytes hold."""
    return max(1, int(budget / BYTES_OF_POINT[precision]))


def size_within(made: Plan, samples: Samples, budget: int, precision: str, count: Bytes) -> tuple[int, ...]:
    """Return the largest net on the plan's walk whose quick fit takes about ``budget`` bytes as ``count`` has it.

    Raises BvbError where the smallest net takes more.
    """
    problem = made.problem
    allowance = budget - (REPORT_BYTES if count is file_bytes else 0)

    def taken(size: tuple[int, ...]) -> int:
        spline = made.lofted(size)
        storage = made.storage(precision, samples.errors_of(spline, problem.encoding, problem.loss))
        return count(SplineBrdf(spline, problem.chart, problem.encoding, storage=storage))

    points = first_guess(allowance, precision)
    found: tuple[int, ...] | None = None
    for _ in range(TRIES):
        walk = made.walk(max(points, 1))
        size, full = walk[-1], len(walk) > 1 or np.prod(walk[0]) <= points
        used = taken(size)
        if used <= allowance and (found is None or np.prod(size) > np.prod(found)):
            found = size
        if CLOSE_ENOUGH * allowance <= used <= allowance:
            break
        if used > allowance and not (full and len(walk) > 1):
            break
        if used < allowance and np.prod(size) < 0.9 * points:
            break  # the data carry no more
        points = int(np.prod(size) * 0.99 * allowance / used)
    if found is None:
        smallest = made.walk(1)[0]
        need = taken(smallest)
        # What the report of so small a net takes is known when it is written.
        if need > budget:
            raise BvbError(
                f"{budget} bytes hold no net of degrees {made.degrees}: the smallest takes {need}. Allow more."
            )
        found = smallest
    return found


def kept_within(model: SplineBrdf, budget: int, count: Bytes) -> SplineBrdf | None:
    """Return ``model`` stored in at most ``budget`` bytes, or None where that would cost more than it is worth."""
    fits = count(model) <= budget
    step = model.storage.step
    if step is None:
        return model if fits else None
    # Bytes that control points have no use for make the step smaller.
    for share in SMALLER_STEPS if fits else LARGER_STEPS:
        restored = model.stored_as(Storage(model.storage.precision, step * share))
        if count(restored) <= budget:
            return restored
    return model if fits else None
