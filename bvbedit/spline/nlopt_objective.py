"""What NLopt minimises, so that nothing is lost of what is raised in it, and nothing is kept of it afterwards."""

import weakref
from collections.abc import Callable
from typing import Any

from bvbedit.spline.knots import Floats

# The value of what is refused, for NLopt takes nan for a success: worse than any logarithm of an error, yet near enough
# for a line search to come back from.
REFUSED = 1e4


def set_objective(optimizer: Any, evaluate: Callable[[Floats, Floats], float | None]) -> list[BaseException]:
    """Let an ``nlopt.opt`` minimise ``evaluate``; return a list, which will hold what that raises.

    ``evaluate`` is given x (n,), its own, and an array (n,) or () for the slopes; it stops the search by None.
    """
    raised: list[BaseException] = []
    # NLopt holds its objective where Python's garbage collector does not see it: one that held the optimizer would keep
    # both, and all data, for ever.
    stop = weakref.WeakMethod(optimizer.force_stop)

    def objective(x: Floats, slopes: Floats) -> float:
        # NLopt may call again after an exception in here, and gives it out as an error of its own without a word.
        try:
            value = None if raised else evaluate(x.copy(), slopes)
            if value is not None:
                return value
        except BaseException as error:
            raised.append(error)
        force_stop = stop()
        if force_stop is not None:
            force_stop()
        return REFUSED

    optimizer.set_min_objective(objective)
    return raised
