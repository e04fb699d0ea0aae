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
CLOSE_ENOUGH, AIM = 0.97, 0.985
# Shares of the step that are tried where bytes are left, and where they are lacking: beyond the last one, fewer control
# points are better.
SMALLER_STEPS = (1 / 8, 1 / 4, 1 / 2)
LARGER_STEPS = (1.05, 1.1, 1.15, 1.2, 1.25, 1.3, 1.4, 1.5)
# Half the step adds a bit to each number, of which deflation leaves between so much:
LEAST_BITS, MOST_BITS = 0.6, 1.1
# What a report adds to a file, as long as it is not written: the quick fits that estimate a size have none.
REPORT_BYTES = 1100
# Of that, what is measured of the stored model.
MEASURED_BYTES = 400

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
        storage = made.storage(precision, spline, samples)
        return count(SplineBrdf(spline, problem.chart, problem.encoding, storage=storage))

    points = first_guess(allowance, precision)
    found: tuple[int, ...] | None = None
    before: tuple[int, int] | None = None
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
        # Finer nets have smaller steps, so that bytes grow faster than control points: a power, from the last two.
        tried, growth = int(np.prod(size)), 1.0
        if before is not None and before[0] != tried:
            growth = float(np.clip(np.log(used / before[1]) / np.log(tried / before[0]), 1.0, 2.0))
        points, before = int(tried * (AIM * allowance / used) ** (1 / growth)), (tried, used)
        if made.walk(max(points, 1))[-1] == size:
            break
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


def reserved(count: Bytes) -> int:
    """Return how many bytes are kept for what is measured of a stored model."""
    return MEASURED_BYTES if count is file_bytes else 0


def kept_within(
    model: SplineBrdf, budget: int, count: Bytes, measured: Callable[[SplineBrdf], SplineBrdf] | None = None
) -> SplineBrdf | None:
    """Return ``model`` stored in at most ``budget`` bytes, or None where that would cost more than it is worth.

    ``measured`` adds to the report what is known only when it is stored; these bytes count too.
    """
    if measured is None:
        return _stored_within(model, budget, count)
    allowance = budget - reserved(count)
    for _ in range(TRIES):
        stored = _stored_within(model, allowance, count)
        if stored is None:
            return None
        told = measured(stored)
        excess = count(told) - budget
        if excess <= 0:
            return told
        allowance -= excess
    return None


def _stored_within(model: SplineBrdf, budget: int, count: Bytes) -> SplineBrdf | None:
    used, step = count(model), model.storage.step
    fits = used <= budget
    if step is None:
        return model if fits else None
    # Bytes that control points have no use for make the step smaller.
    shares = np.array(SMALLER_STEPS if fits else LARGER_STEPS)
    least = used - model.spline.control.size / 8 * np.log2(shares) * (LEAST_BITS if fits else MOST_BITS)
    for share in shares[least <= budget]:
        restored = model.stored_as(Storage(model.storage.precision, step * float(share)))
        if count(restored) <= budget:
            return restored
    return model if fits else None
