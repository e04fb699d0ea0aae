"""The frontier of a cloud of points (cost, error): what no other point beats in both; its knee, and what halving costs.

Costs and errors are smaller the better. Nan is unknown, and never on a frontier.
"""

import numpy as np

from bvbedit.brdf.geometry import Floats

# Points of a frontier that a knee needs, and how far below the chord it is at least, as a share of its height.
FEWEST, CLEAR = 3, 0.05
# Points that are nearer to one another, as a share of the width of the frontier, cost the same.
SAME = 0.02
HOW_KNEE = (
    "The knee is the point of the frontier farthest below the straight line from its first to its last point, both "
    "axes logarithmic and scaled to 0 ... 1: the largest value of the difference curve of Kneedle (V. Satopää, J. "
    'Albrecht, D. Irwin, B. Raghavan, "Finding a Kneedle in a Haystack: Detecting Knee Points in System Behavior", '
    f"ICDCS Workshops 2011, doi 10.1109/ICDCSW.2011.20), without its smoothing. Of points whose costs are within "
    f"{SAME:.0%} of that width of one another the dearest counts. A frontier of fewer than {FEWEST} points, and one "
    f"that is nowhere {CLEAR:.0%} below that line, has none."
)


def frontier(costs: Floats, errors: Floats) -> list[int]:
    """Return the indices of the points that no other one beats: costs rise and errors fall along them.

    Of points that are equal in both the first is taken.
    """
    costs, errors = np.asarray(costs, dtype=np.float64), np.asarray(errors, dtype=np.float64)
    known = np.flatnonzero(np.isfinite(costs) & np.isfinite(errors))
    order = known[np.lexsort((known, errors[known], costs[known]))]
    kept: list[int] = []
    for i in order.tolist():
        if not kept or errors[i] < errors[kept[-1]]:
            kept.append(i)
    return kept


def apart(costs: Floats) -> list[int]:
    """Return which points of a frontier (n,) in order, all of it positive, cost clearly less than the next such one.

    By ``SAME`` of its width, on a logarithmic scale: less is chance, and a fall of the error there would be its knee.
    """
    if len(costs) == 0:
        return []
    x = np.log(np.asarray(costs))
    kept = [len(x) - 1]
    for i in range(len(x) - 2, -1, -1):
        if x[kept[-1]] - x[i] > SAME * (x[-1] - x[0]):
            kept.append(i)
    return kept[::-1]


def knee(costs: Floats, errors: Floats) -> int | None:
    """Return which point of a frontier (n,) in order, all of it positive, is its knee; None where there is none.

    ``HOW_KNEE`` says what that is, and the source.
    """
    if len(costs) < FEWEST:
        return None
    x, y = np.log(np.asarray(costs)), np.log(np.asarray(errors))
    if not (x[-1] > x[0] and y[0] > y[-1]):
        return None
    below = 1 - (x - x[0]) / (x[-1] - x[0]) - (y - y[-1]) / (y[0] - y[-1])
    best = int(np.argmax(below))
    return best if below[best] >= CLEAR else None


def cost_at(costs: Floats, errors: Floats, error: float) -> float | None:
    """Return what ``error`` costs on a frontier (n,) in order, by interpolation of logarithms; None outside of it."""
    if len(costs) == 0 or not errors[-1] <= error <= errors[0]:
        return None
    x, y = np.log(np.asarray(errors)[::-1]), np.log(np.asarray(costs)[::-1])
    return float(np.exp(np.interp(np.log(error), x, y)))


def cost_of_halving(costs: Floats, errors: Floats, error: float) -> float | None:
    """Return how many times more half of ``error`` costs than ``error``; None where the frontier ends before."""
    before, after = cost_at(costs, errors, error), cost_at(costs, errors, error / 2)
    return None if before is None or after is None else after / before


def mean_cost_of_halving(costs: Floats, errors: Floats) -> float | None:
    """Return how many times more half of the error costs on the mean of the whole frontier.

    That is of the power law through its two ends. None where they are less than a factor of two in error apart.
    """
    if len(costs) < 2 or errors[0] < 2 * errors[-1]:
        return None
    return float((costs[-1] / costs[0]) ** (np.log(2) / np.log(errors[0] / errors[-1])))
