"""Analytic models fitted to any BRDF, under the metric by which B-spline models are fitted and judged.

What is minimised is the product of the metric over both sample sets. A search (NLopt, LD_SLSQP) is led by gradients:
exact ones for colours, by differences of the lobe alone for shapes. With six measurements LD_LBFGS and LD_VAR2 came to
the same errors in about the same time, methods without gradients (LN_SBPLX, LN_BOBYQA) took 3 to 10 times as long for
the same or worse. Errors may have several minima: there are several starts, on few pairs of directions, and the best
goes on on many. Of those measurements, 8 starts found what 40 or 64 did.
"""

import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np

from bvbedit.brdf.analytic import Analytic
from bvbedit.brdf.analytic_models import MODELS, Lobe, Parametric, assembled, model_to_fit
from bvbedit.brdf.analytic_objective import Objective
from bvbedit.brdf.base import Brdf, check_brdf
from bvbedit.brdf.geometry import Floats
from bvbedit.brdf.losses import loss_named
from bvbedit.brdf.samples import drawn
from bvbedit.errors import BvbError
from bvbedit.spline.arguments import is_whole, shown
from bvbedit.spline.nlopt_objective import REFUSED, set_objective

__all__ = ["MODELS", "AnalyticFit", "fit_analytic"]

# Pairs drawn from each set for the starts, and for the search that goes on from the best of them. With 20,000 fits of
# chrome took half the time and were as good to 1 %, but the error told by the pairs was up to 11 % off; now it is 2 %.
FEW, MANY = 2_500, 60_000
# Objectives evaluated in each search, at most; most end before.
EVALUATIONS, LAST_EVALUATIONS = 150, 300
# A search ends where steps change the logarithm of the squared error by less.
TOLERANCE, LAST_TOLERANCE = 1e-7, 1e-10
# Starts agree where they end within this share of the best error.
AGREED = 0.01
# Errors below this share of the values' own size are hardly followed, by the starts and by the last search: where a
# model can be exact, the logarithm of the error would have a cusp, at which searches creep.
ROUNDING, LAST_ROUNDING = 1e-3, 1e-4
# How far starts are spread around the width that the material shows: a factor of e to this power either way.
SPREAD = 1.2
# Every so many-th start has another last lobe, where there is a choice.
OTHERS = 4
# How much broader than the first a second lobe starts (logarithm).
BROADER = (0.5, 2.2)


@dataclass(frozen=True)
class AnalyticFit:
    """An analytic model of a material, and how it came about."""

    model: Analytic
    """Evaluates, samples, has a pdf."""
    name: str
    parameters: Mapping[str, float]
    """diffuse_r, diffuse_g, diffuse_b, specular_r ..., and the shape by the names of its class; of two lobes with _1
    (the narrower) and _2."""
    error: float
    """The geometric mean of the metric over both sets, from the pairs drawn."""
    errors: tuple[float, float]
    """The metric over ``grid`` and over ``nodes``."""
    starts: int
    agreed: int
    """How many starts ended within 1 % of the best error."""
    evaluations: int

    @property
    def parameter_count(self) -> int:
        """How many numbers make the model."""
        return len(self.parameters)


def fit_analytic(
    brdf: Brdf,
    name: str,
    *,
    seed: int = 0,
    starts: int = 8,
    metric: str = "log_cosine_rms",
    progress: Callable[[float], None] | None = None,
) -> AnalyticFit:
    """Return the model called ``name`` (of ``MODELS``) that is nearest to ``brdf`` by ``metric`` over both sample sets.

    Pairs are drawn from the sets as for B-spline fits; those without data behind them have no weight. ``seed`` chooses
    the pairs and the ``starts``, of which the first is read off the material, and the others lie around it at random;
    the same seed gives the same model. ``progress`` is called with the share done.

    Each albedo stays within 1, as a model that is to be rendered needs it. Free ones would follow grazing highlights
    further: a satin paint with "ggx" to 0.036 in place of 0.057, and reflect more than arrives beyond 80 degrees.

    Raises BvbError for no Brdf, an unknown name or metric, a seed that is no whole number >= 0, starts that are none in
    1 ... 1000, a material without data behind any pair, and one that no start can follow.
    Source: A. Ngan, F. Durand, W. Matusik, "Experimental Analysis of BRDF Models", EGSR 2005.
    """
    check_brdf(brdf, "brdf")
    kind, loss = model_to_fit(name), loss_named(metric)
    if not is_whole(seed) or seed < 0:
        raise BvbError(f"seed is {shown(seed)}. Give a whole number from 0 up.")
    if not is_whole(starts) or not 1 <= starts <= 1000:
        raise BvbError(f"starts is {shown(starts)}. Give a whole number in 1 ... 1000.")
    few = Objective(drawn(brdf, FEW, seed), kind.lobes, loss, ROUNDING)
    if not len(few.pair):
        raise BvbError(
            "No data stand behind any of the pairs that were drawn. Give a measurement with more valid cells."
        )
    ends: list[_Search] = []
    for lobes, x in _starts(kind, few, starts, np.random.Generator(np.random.PCG64(seed))):
        ends.append(_Search(few.of(lobes), x).run())
        if progress is not None:
            progress(0.7 * len(ends) / starts)
    best = min(ends, key=lambda end: end.best)
    if not best.best < REFUSED:
        raise BvbError(f"{name} cannot follow this material from any start. Check its values, or try another model.")
    many = Objective(drawn(brdf, MANY, seed), best.objective.lobes, loss, LAST_ROUNDING)
    last = _Search(many, best.best_x).run(LAST_EVALUATIONS, LAST_TOLERANCE)
    if progress is not None:
        progress(1.0)
    errors = many.metrics(last.best_x)
    model, parameters = assembled(many.lobes, *many.parts_of(last.best_x))
    # Logarithms of squares of the error, over both sets.
    agreed = sum(end.best - best.best <= 2 * math.log1p(AGREED) for end in ends)
    evaluations = sum(end.count for end in ends) + last.count
    return AnalyticFit(model, name, parameters, math.sqrt(errors[0] * errors[1]), errors, starts, agreed, evaluations)


@dataclass
class _Search:
    """One search from one start; it remembers the best itself."""

    objective: Objective
    start: Floats
    best: float = REFUSED
    best_x: Floats = field(init=False)
    count: int = 0

    def __post_init__(self) -> None:
        low, high = self.objective.bounds
        self.start = np.clip(self.start, low, high)
        self.best_x = self.start

    def run(self, evaluations: int = EVALUATIONS, tolerance: float = TOLERANCE) -> "_Search":
        """Search, and return itself."""
        import nlopt

        optimizer = nlopt.opt(nlopt.LD_SLSQP, len(self.start))
        low, high = self.objective.bounds
        raised = set_objective(optimizer, self._evaluate)
        optimizer.set_lower_bounds(low)
        optimizer.set_upper_bounds(high)
        optimizer.set_ftol_abs(tolerance)
        optimizer.set_maxeval(evaluations)
        # Rounding ends a line search by an exception, of a type that depends on the version: the best is kept.
        with suppress(Exception):
            optimizer.optimize(self.start)
        if raised:
            raise raised[0]
        return self

    def _evaluate(self, x: Floats, slopes: Floats) -> float:
        self.count += 1
        slopes[:] = 0.0
        # NLopt takes nan for a success.
        if not np.isfinite(x).all():
            return REFUSED
        with np.errstate(all="ignore"):
            value = self.objective(x, slopes)
        if not (math.isfinite(value) and np.isfinite(slopes).all()):
            slopes[:] = 0.0
            return REFUSED
        if value < self.best:
            self.best, self.best_x = value, x
        return value


def _starts(
    kind: Parametric, objective: Objective, count: int, generator: np.random.Generator
) -> list[tuple[tuple[Lobe, ...], Floats]]:
    """Return ``count`` rows of lobes and where to start with them."""
    theta = _half_height(objective)
    forms = kind.forms()
    found = []
    for n in range(count):
        # What the last lobe may also be is tried once in a while.
        lobes = forms[1 + n // OTHERS % (len(forms) - 1)] if len(forms) > 1 and n % OTHERS == 3 else forms[0]
        spread, broader, *growth = generator.random(2 + len(lobes))
        width, factor = (
            (0.0, 1.2) if n == 0 else (SPREAD * (2 * spread - 1), float(np.interp(broader, (0, 1), BROADER)))
        )
        shapes = []
        for k, lobe in enumerate(lobes):
            half = min(theta * math.exp(width + k * factor), 0.8)
            shapes.append(lobe.start(half, 0.5 if n == 0 else growth[k]))
        shapes = [np.clip(x, *lobe.bounds) for lobe, x in zip(lobes, shapes, strict=True)]
        found.append((lobes, objective.of(lobes).coloured(shapes)))
    return found


# Edges of half angles (radians) between which the height of the highlight is looked at, and the difference angle up to
# which it is.
HALF_ANGLES = np.radians(90.0) * np.linspace(0, 0.85, 35) ** 2
STEEPEST = math.cos(math.radians(60.0))


def _half_height(objective: Objective) -> float:
    """Return the half angle (radians) at which the highlight falls to half of its height over the diffuse part."""
    pair = objective.pair
    seen = pair.cos_d > STEEPEST
    theta, f = np.arctan(np.sqrt(pair.tan2_h[seen])), objective.f.mean(axis=0)[seen]
    which = np.digitize(theta, HALF_ANGLES) - 1
    heights = np.array([np.median(f[which == k]) if (which == k).any() else np.nan for k in range(len(HALF_ANGLES))])
    known = np.flatnonzero(np.isfinite(heights))
    if len(known) < 2:
        return 0.2
    heights = heights[known]
    body = float(heights.min())
    below = np.flatnonzero(heights - body < 0.5 * (heights[0] - body))
    return float(np.clip(HALF_ANGLES[known[below[0]]] if len(below) else 0.5, 3e-3, 0.5))
