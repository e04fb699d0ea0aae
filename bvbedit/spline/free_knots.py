"""Free knots: the interior knots of one axis are moved to where the splines over them leave least of the data.

The control points are eliminated (variable projection, Golub & Pereyra 1973): what is minimised is a function of the
knots alone, ||(I - P_t) L||^2 of the lines L of an axis, by a quasi-Newton method (NLopt, LD_LBFGS) on its exact
gradient. Knots stay in order whatever the method tries, as it moves the logarithms of their gaps.

Left to themselves, free knots gather within one spacing of the data, where a spline follows single data and runs wild
between them. So gaps do not shrink below a least one, and the equations must stay about as well conditioned as at the
start.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from bvbedit.errors import BvbError
from bvbedit.spline.adaptive import AxisLines
from bvbedit.spline.arguments import is_whole, shown
from bvbedit.spline.banded import SMALLEST_PIVOT
from bvbedit.spline.basis import Indices
from bvbedit.spline.knots import Floats, checked_knots
from bvbedit.spline.nlopt_objective import REFUSED, set_objective

# The three limits were chosen on the axes of three measurements in both charts, fitted at every other node and looked
# at between these (8 to 24 control points over 46 or 91 nodes, starts from dominant points). With them the error at the
# nodes falls to 0.93 of the start's, and without any to 0.92; but between the nodes it is 0.99 of the start's on
# average and three times at worst, and without any 3 times and 2e9 times. What changing one of them alone does:
# The least gap between knots, in mean spacings of the data. A fiftieth of one: at worst 2e6 times the start's error.
LEAST_GAP = 1.0
# Smaller gaps of the start keep at least this share of themselves. Half: at worst 4 times the start's error.
KEPT = 0.9
# How many times the start's condition may be reached. 10: at worst 8 times the start's error; any: 2e5 times.
CONDITION_GROWTH = 2.0
# A search ends where steps change the logarithm of the squared error by less.
TOLERANCE = 1e-6
# A squared error below this share of the lines' squared norm is rounding.
ROUNDING = 1e-30


@dataclass(frozen=True)
class FreeKnots:
    """Knots that were moved, and what that brought."""

    knots: Floats
    """The full clamped vector; the start itself where nothing better was found."""
    error: float
    """Squared norm of the residual of the lines, never above ``start_error``."""
    start_error: float
    evaluations: int
    """Knot vectors that were tried."""
    stopped: str
    """Why the search ended."""


def move_knots(
    lines: AxisLines,
    knots: Floats,
    degree: int,
    *,
    evaluations: int = 100,
    progress: Callable[[float], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> FreeKnots:
    """Return ``knots`` with the interior ones moved so that splines over them leave less of ``lines``; never more.

    ``knots`` is a full clamped vector on or around the data, best one from dominant points. Equal knots move as one. No
    gap becomes smaller than a mean spacing of the data or, where it was so at the start, than 0.9 times itself. Left as
    they are: nets without interior knots, degree 0, and vectors with a knot that stands degree + 1 times (a jump). At
    most ``evaluations`` vectors are tried; ``should_stop`` is asked before each one, and ends the search with the best
    so far. Deterministic.

    Raises BvbError for knots that are no clamped vector around the data, data that do not determine the control points
    over them or are not finite, and ``evaluations`` that are no whole number above zero.
    Source: G. H. Golub, V. Pereyra, "The differentiation of pseudo-inverses and nonlinear least squares problems whose
    variables separate", SIAM J. Numer. Anal. 10 (1973); D. L. B. Jupp, "Approximation to data by splines with free
    knots", SIAM J. Numer. Anal. 15 (1978), for the logarithms of gaps.
    """
    start = checked_knots(knots, degree)
    u = lines.parameters
    if not start[0] <= u[0] <= u[-1] <= start[-1]:
        raise BvbError(
            f"Data on [{u[0]:g}, {u[-1]:g}] lie outside the knots' [{start[0]:g}, {start[-1]:g}]. "
            "Knots must span the data."
        )
    if not is_whole(evaluations) or evaluations < 1:
        raise BvbError(f"{shown(evaluations)} evaluations are no search. Choose a whole number above zero.")
    functional = _Functional(lines, degree)
    first = functional.of(start)
    if first is None:
        raise BvbError(
            f"The data do not determine {len(start) - degree - 1} control points over these knots, or are not finite. "
            "Start from knots further apart, and finite data."
        )
    search = _Search(functional, start, first, evaluations, progress, should_stop)
    stopped = search.run()
    if progress is not None:
        progress(1.0)
    with np.errstate(over="ignore", under="ignore"):
        error, start_error = (float(np.ldexp(e, 2 * functional.exponent)) for e in (search.best_error, first.error))
    return FreeKnots(search.best_knots, error, start_error, search.count, stopped)


@dataclass(frozen=True)
class _Value:
    """What splines over one knot vector leave of the lines."""

    error: float
    condition: float
    """Estimate for the collocation matrix with columns of length one: what scattered weights do is not the knots'."""
    slopes: Floats
    """Derivatives of the error with respect to the distinct interior knots."""


class _Functional:
    """The variable-projection functional ||(I - P_t) L||^2 of an axis with lines L, scaled to numbers of order one."""

    def __init__(self, lines: AxisLines, degree: int) -> None:
        largest = float(np.abs(lines.factor).max(initial=0.0))
        # Squares of extreme data leave the range of float64.
        self.exponent = int(np.frexp(largest)[1]) if 0 < largest < np.inf else 0
        self.factor = np.ascontiguousarray(np.ldexp(lines.factor, -self.exponent))
        self.lines, self.degree = lines, degree
        self.scale = float(np.sum(self.factor**2))

    def of(self, knots: Floats) -> _Value | None:
        """Return the value at ``knots``, or None where the data do not determine the control points."""
        from bvbedit.jit import frozen
        from bvbedit.spline import free_knots_kernels, refinement_kernels

        p = self.degree
        matrix = self.lines.collocation(knots, p)
        m, k = matrix.rows.shape
        upper, cosines, sines = np.zeros((matrix.columns, k)), np.empty((m, k)), np.empty((m, k))
        refinement_kernels.rotations(matrix.first, matrix.rows, upper, cosines, sines)
        pivots = np.abs(upper[:, 0])
        if not pivots.min() > SMALLEST_PIVOT * pivots.max():
            return None
        control = np.empty((1, matrix.columns, self.factor.shape[1]))
        refinement_kernels.solve_rotated(matrix.first, upper, cosines, sines, self.factor[None], control)
        residual = self.factor - matrix.apply(control[0], 0)
        error = float(np.sum(residual**2))
        groups = _groups(knots, p)
        slopes = np.zeros(len(groups) - 1)
        if _movable(groups, p):
            # (I - P) takes all derivatives of the control points away (Golub & Pereyra), so that those of the basis
            # are left: d error = -2 <weights residual, dN c>.
            differences = np.diff(control[0], axis=0) / (knots[p + 1 : -1] - knots[1 : -p - 1])[:, None]
            right = (-2 * self.lines.roots)[:, None] * residual
            parameters = frozen(self.lines.parameters)
            free_knots_kernels.knot_slopes(frozen(knots), p, groups, parameters, right, differences, slopes)
        condition = free_knots_kernels.inverse_norm(upper)
        # One test for all: nan and infinities spread into the sum.
        if not np.isfinite(error + condition + float(np.sum(slopes))):
            return None
        return _Value(error, condition, slopes)


class _Gaps:
    """Knot vectors as functions of any real numbers x, one for each gap between distinct knots.

    gap = least + room softmax(x): order and least gaps hold for every x, and the ends do not move.
    """

    def __init__(self, knots: Floats, degree: int, spacing: float) -> None:
        self.start, self.degree = knots, degree
        self.groups = _groups(knots, degree)
        gaps = np.diff(self.breaks(knots))
        self.least = np.minimum(LEAST_GAP * spacing, KEPT * gaps)
        self.room = float(np.sum(gaps - self.least))
        self.x = np.log((gaps - self.least) / self.room)

    def breaks(self, knots: Floats) -> Floats:
        """Return the distinct knots."""
        return np.concatenate([knots[:1], knots[self.groups[:-1]], knots[-1:]])

    def knots(self, x: Floats) -> Floats:
        """Return the knot vector for ``x``."""
        interior = self.start[0] + np.cumsum(self.least + self.room * _softmax(x))[:-1]
        knots = self.start.copy()
        knots[self.groups[0] : self.groups[-1]] = np.repeat(interior, np.diff(self.groups))
        return knots

    def slopes(self, x: Floats, slopes: Floats) -> Floats:
        """Return derivatives with respect to ``x``, given those with respect to the distinct interior knots."""
        # Each gap moves all knots behind it.
        by_gap = np.append(np.cumsum(slopes[::-1])[::-1], 0.0)
        share = _softmax(x)
        return np.asarray(self.room * share * (by_gap - share @ by_gap))


@dataclass
class _Search:
    """One search for the smallest logarithm of the functional; it remembers the best knots itself."""

    functional: _Functional
    start: Floats
    first: _Value
    evaluations: int
    progress: Callable[[float], None] | None
    should_stop: Callable[[], bool] | None
    count: int = 0
    stopped: str = ""
    gaps: _Gaps = field(init=False)
    best_knots: Floats = field(init=False)
    best_error: float = field(init=False)

    def __post_init__(self) -> None:
        u = self.functional.lines.parameters
        self.gaps = _Gaps(self.start, self.functional.degree, (u[-1] - u[0]) / max(len(u) - 1, 1))
        self.best_knots, self.best_error = self.start, self.first.error

    def run(self) -> str:
        """Search, and return why it ended."""
        if not _movable(self.gaps.groups, self.functional.degree):
            return "no knot can be moved"
        if self.first.error <= ROUNDING * self.functional.scale:
            return "nothing is left to gain"
        import nlopt

        optimizer = nlopt.opt(nlopt.LD_LBFGS, len(self.gaps.x))
        raised = set_objective(optimizer, lambda x, slopes: None if self._over() else self._evaluate(x, slopes))
        optimizer.set_ftol_abs(TOLERANCE)
        reason = "converged"
        try:
            optimizer.optimize(self.gaps.x)
        except Exception:
            # Its line search often gives up by an exception, of a type that depends on the version.
            reason = "no better step was found"
        if raised:
            raise raised[0]
        return self.stopped or reason

    def _over(self) -> bool:
        if self.stopped:
            return True
        if self.should_stop is not None and self.should_stop():
            self.stopped = "stopped on request"
        elif self.count >= self.evaluations:
            self.stopped = "all evaluations were used"
        return bool(self.stopped)

    def _evaluate(self, x: Floats, slopes: Floats) -> float:
        """Return the logarithm at ``x`` and write its derivatives into ``slopes``, which may be empty."""
        self.count += 1
        knots = self.gaps.knots(x)
        ordered = bool((np.diff(self.gaps.breaks(knots)) > 0).all())  # false for nan, and where rounding joins knots
        value = self.functional.of(knots) if ordered else None
        if self.progress is not None:
            self.progress(self.count / self.evaluations)
        if value is None or value.condition > CONDITION_GROWTH * self.first.condition:
            # NLopt takes nan for a success.
            slopes[:] = 0.0
            return REFUSED
        if value.error < self.best_error:
            self.best_knots, self.best_error = knots, value.error
        error = value.error + ROUNDING * self.functional.scale
        if slopes.size:
            slopes[:] = self.gaps.slopes(x, value.slopes / error)
        return float(np.log(error / self.functional.scale))


def _groups(knots: Floats, degree: int) -> Indices:
    """Return the index of each distinct interior knot's first copy, and that of the right end."""
    interior = np.arange(degree + 1, len(knots) - degree)
    return interior[knots[interior] > knots[interior - 1]].astype(np.int64)


def _movable(groups: Indices, degree: int) -> bool:
    """Return whether there are interior knots, and none at which the spline may jump."""
    return len(groups) > 1 and int(np.diff(groups).max()) <= degree


def _softmax(x: Floats) -> Floats:
    e = np.exp(x - x.max())
    return np.asarray(e / e.sum())
