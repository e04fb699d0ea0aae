"""How large a net has to be: the error over the number of control points, its knee, and the size for a tolerance."""

from dataclasses import dataclass
from itertools import pairwise, permutations
from typing import Any

import numpy as np

from bvbedit.brdf.plan import Plan
from bvbedit.brdf.samples import Samples

# The curve is walked in doublings from here.
FIRST_POINTS = 125
# Twice the control points are worth having while they take away at least this share of the error.
WORTH_DOUBLING = 0.15
# Errors that differ by less are the same.
AS_GOOD = 0.02
# Times that control points are moved from one axis to another.
TRADES = 6
# No control points are worth having for smaller errors. Of log_cosine_rms it is a hundredth of the smallest step of an
# 8-bit picture in the middle of its range.
UNSEEN = 2e-5
# What is left of an error when noise is taken away is not certain to better than this share of it.
CERTAIN = 0.1


@dataclass(frozen=True)
class Step:
    """A net on the way: what a quick fit of this size is off by."""

    size: tuple[int, ...]
    grid: float
    """The metric over the set ``grid``."""
    nodes: float
    """The metric over the set ``nodes``."""

    @property
    def points(self) -> int:
        """The number of control points."""
        return int(np.prod(self.size))

    def score(self, noise: tuple[float, float] = (0.0, 0.0), smallest: float = 0.0) -> float:
        """Return the geometric mean of the metric over both sets, without the ``noise`` of what it is measured by.

        Errors below ``smallest`` count as so large.
        """
        errors = [max(e, smallest) for e in (self.grid, self.nodes)]
        signal = [max(e * e - n * n, (CERTAIN * e) ** 2) for e, n in zip(errors, noise, strict=True)]
        return float((signal[0] * signal[1]) ** 0.25)

    def to_dict(self) -> dict[str, Any]:
        """Return the figures with three digits."""
        return {"size": list(self.size), "grid": float(f"{self.grid:.3g}"), "nodes": float(f"{self.nodes:.3g}")}


def error_curve(made: Plan, samples: Samples, most: int) -> list[Step]:
    """Return the nets on the greedy walk whose control points double, up to ``most``, each lofted and measured."""
    walk = made.walk(most)
    points = [int(np.prod(size)) for size in walk]
    wanted = FIRST_POINTS * 2.0 ** np.arange(0, np.log2(max(most / FIRST_POINTS, 1.0)) + 1e-9)
    chosen = sorted({int(np.searchsorted(points, min(w, points[-1]))) for w in wanted} | {len(walk) - 1})
    return [step_of(made, samples, walk[i]) for i in chosen]


def step_of(made: Plan, samples: Samples, size: tuple[int, ...]) -> Step:
    """Return what a quick fit of ``size`` is off by."""
    problem = made.problem
    errors = samples.errors_of(made.lofted(size), problem.encoding, problem.loss)
    return Step(size, *samples.metrics(errors, problem.loss))


def traded(made: Plan, samples: Samples, size: tuple[int, ...]) -> tuple[int, ...]:
    """Return a net of no more control points, moved between axes for as long as that makes quick fits better.

    The walk takes what axes gain to add up. Of weights that are far from separable it does not.
    """
    points, best = int(np.prod(size)), step_of(made, samples, size)
    for _ in range(TRADES):
        tried = [step_of(made, samples, n) for n in _neighbours(made, best.size, points)]
        found = min(tried, key=Step.score, default=best)
        if found.score() > (1 - AS_GOOD) * best.score():
            break
        best = found
    return best.size


def _neighbours(made: Plan, size: tuple[int, ...], points: int) -> list[tuple[int, ...]]:
    """Return nets of at most so many control points: a tenth of an axis is given to another one."""
    nets = []
    for giver, taker in permutations(range(len(size)), 2):
        net = list(size)
        net[giver] = max(size[giver] - max(1, round(size[giver] / 10)), made.paths[giver].fewest)
        net[taker] = min(points * net[taker] // int(np.prod(net)), made.paths[taker].most)
        if net[giver] < size[giver] and net[taker] > size[taker]:
            nets.append(tuple(net))
    return nets


def knee(curve: list[Step], noise: tuple[float, float] = (0.0, 0.0)) -> Step:
    """Return the smallest net beyond which no doubling of the control points takes away ``WORTH_DOUBLING``.

    Nor is there any worth in errors below ``UNSEEN``.

    ``noise``: standard deviations over both sets of the data that the nets were measured by.
    """
    for step, larger in reversed(list(pairwise(curve))):
        doublings = np.log2(larger.points / step.points)
        if larger.score(noise, UNSEEN) < step.score(noise, UNSEEN) * (1 - WORTH_DOUBLING) ** doublings:
            return larger
    return curve[0]


def sufficient(curve: list[Step], noise: tuple[float, float] = (0.0, 0.0)) -> Step:
    """Return the smallest net that is as good as the best one, up to ``AS_GOOD``: no control points without effect."""
    best = min(step.score(noise) for step in curve)
    return next(step for step in curve if step.score(noise) <= (1 + AS_GOOD) * best)


def points_for(curve: list[Step], tolerance: float) -> int:
    """Return about how many control points bring the metric over both sets down to ``tolerance``, by interpolation."""
    points = np.log([s.points for s in curve])
    errors = np.log([max(s.grid, s.nodes, 1e-300) for s in curve])
    below = np.flatnonzero(errors <= np.log(tolerance))
    if len(below) == 0:
        return curve[-1].points * 2
    i = int(below[0])
    if i == 0:
        return curve[0].points
    share = (errors[i - 1] - np.log(tolerance)) / (errors[i - 1] - errors[i])
    return int(np.exp(points[i - 1] + share * (points[i] - points[i - 1])))
