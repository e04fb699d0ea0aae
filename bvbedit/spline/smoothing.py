"""Smoothing splines: least squares with a penalty on the differences of the net, as strong as the noise asks for.

Eilers & Marx (1996, "Flexible smoothing with B-splines and penalties") take more control points than the data need and
penalise second differences of neighbours, so that a single number sets the smoothness and no knot has to be chosen.
Craven & Wahba (1979, "Smoothing noisy data with spline functions") find that number by generalised cross-validation:
the one by which a datum left out would be predicted best, told without leaving any out.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from bvbedit.errors import BvbError
from bvbedit.spline.arguments import is_real_within, shown
from bvbedit.spline.fitting import (
    FitResult,
    _checked_data,
    _checked_weights,
    along_all,
    diagonalised,
    fit_weighted,
    marginal_axes,
    outer_sum,
)
from bvbedit.spline.knots import Floats, greville

# Beyond this strength rounding shows, and all that is penalised is long gone.
LARGEST_STRENGTH = 1e15
# Control points closer than this share of their mean distance are penalised as if they were so far apart: else the
# curvature between knots that all but coincide would be all that the penalty sees of an axis.
SHORTEST_STEP = 0.1
# At the ends of the search no mode is damped by more than this, or all that the penalty sees by all but this.
END = 1e-3
# Strengths tried in each decade; the score has one broad valley, seldom two.
PER_DECADE = 3
# Steps of the golden section: they shrink two thirds of a decade below a hundredth of one.
STEPS = 10
GOLDEN = (5**0.5 - 1) / 2
# Data of weight zero take the values of ever less smoothed others: wide gaps are filled first, then their rims.
FILLINGS = (1e6, 1e5, 1e4, 1e3, 1e2, 1e1, 1.0)


@dataclass(frozen=True)
class Smoothing:
    """How strongly data are smoothed, and what that says about them."""

    strength: float
    """Weight of the penalty: at one, data and penalty have equal mean diagonals in the equations, on every axis."""
    degrees_of_freedom: float
    """Trace of the hat matrix, which maps the data of one channel to their fitted values."""
    noise: float
    """Estimated standard deviation of sqrt(weight) (datum - truth)."""
    strengths: Floats
    """(k,): what was tried, increasing."""
    gcv: Floats
    """(k,): square root of the score of each, an error in the unit of ``noise``."""
    notes: tuple[str, ...] = ()
    """What a user should know: that the best strength is at an end of those tried."""


def choose_strength(
    values: Floats,
    weights: Floats,
    parameters: Sequence[Floats],
    knots: Sequence[Floats],
    degrees: Sequence[int],
    independent: float | None = None,
) -> Smoothing:
    """Return the strength of smoothing that generalised cross-validation finds best for data on a grid.

    Arguments as of ``smooth``. The score is N |sqrt(W) (V - y)|^2 / (N - N/M trace H)^2, N the number of data with
    weight, M how many of them are ``independent``, by default all, and H the hat matrix, common to all channels. W is
    replaced by the product of its marginals: then each axis has a basis in which its normal matrix is one and its
    penalty diagonal, and for every strength the trace and the residual are sums over the modes. Data of weight zero are
    replaced by a smooth continuation of the others. The least score is searched on a logarithmic grid, from no
    smoothing to multilinear functions, and then by a golden section.

    Errors that hang together are seen as features unless M says so: where k neighbours in each place share a reading,
    as after an interpolation, only N/k tell something new (the effective number of data; Altman, 1990, "Kernel
    smoothing of data with correlated errors"). Raises BvbError as ``smooth`` does. Source: Craven & Wahba (1979).
    """
    values, parameters, knots, degrees = _checked_data(values, parameters, knots, degrees)
    weights = _checked_weights(weights, values.shape[:-1])
    return _Problem(values, weights, parameters, knots, degrees, _checked_count(independent)).best()


def smooth(
    values: Floats,
    weights: Floats,
    parameters: Sequence[Floats],
    knots: Sequence[Floats],
    degrees: Sequence[int],
    *,
    start: Floats | None = None,
    project: Callable[[Floats], Floats] = lambda control: control,
    strength: float | None = None,
    independent: float | None = None,
    tolerance: float = 1e-3,
    max_iterations: int = 200,
    progress: Callable[[float], None] | None = None,
) -> tuple[FitResult, Smoothing]:
    """Return the spline that minimises sum weights (V - values)^2 + strength sum_a s_a |D_a C|^2, and how smooth it is.

    ``values`` (m_1, ..., m_d, c), ``weights`` (m_1, ..., m_d) >= 0, the d axes ``parameters`` (m_a,) and ``knots`` as
    for ``fit_weighted``, and ``start``, ``project``, ``tolerance`` and ``max_iterations`` too; without a start it is
    the solution for the product of the weights' marginals. ``strength`` is in 0 ... 1e15, or chosen by
    ``choose_strength``, to which ``independent`` data are told. Where weights are far below that product the penalty
    alone continues the spline, which takes long to settle: the default tolerance is reached in 1 to 40 iterations, when
    the fit of the other data is final.

    D_a are the ``second_differences`` of the net along axis a; |.|^2 sums over the lines along that axis through the
    nodes of the others, weighed by their marginals (Wood, 2006, "Low-rank scale-invariant tensor product smooths"; the
    matrices are those of Xiao, Li & Ruppert, 2013, "Fast bivariate P-splines: the sandwich smoother"), which unlike the
    sum over rows of the net does not count a line twice where knots are dense. s_a is the trace of the normal matrix of
    axis a over that of D_a^T D_a: so the axes are comparable whatever their units and sizes, and an average control
    point is held by the penalty along each axis as by the data if the strength is one.

    Raises BvbError as ``fit_weighted`` does, and for a strength that is no number in that range.
    Source: Eilers & Marx (1996).
    """
    values, parameters, knots, degrees = _checked_data(values, parameters, knots, degrees)
    weights = _checked_weights(weights, values.shape[:-1])
    if strength is not None and not is_real_within(strength, 0.0, LARGEST_STRENGTH):
        raise BvbError(
            f"Strength {shown(strength)} cannot smooth. Choose one in 0 ... {LARGEST_STRENGTH:g}, or none to find it."
        )
    problem = _Problem(values, weights, parameters, knots, degrees, _checked_count(independent))
    smoothing = problem.best() if strength is None else problem.told([float(strength)], float(strength))
    result = fit_weighted(
        values,
        weights,
        parameters,
        knots,
        degrees,
        start=problem.net(smoothing.strength) if start is None else start,
        project=project,
        penalty=[smoothing.strength**0.5 * e for e in problem.rows],
        tolerance=tolerance,
        max_iterations=max_iterations,
        progress=progress,
    )
    return result, smoothing


def _checked_count(independent: float | None) -> float:
    if independent is not None and not is_real_within(independent, 1.0, 1e300):
        raise BvbError(f"{shown(independent)} data cannot be independent. Give a number from 1 up, or none for all.")
    return np.inf if independent is None else float(independent)


def second_differences(knots: Floats, degree: int) -> Floats:
    """Return D (n - 2, n), or (0, n) for fewer than three control points: second differences that vanish on lines.

    A spline is a line just where its net is one over the Greville abscissae g, which plain differences (1, -2, 1) take
    for granted to be equidistant. These are divided differences at g, in steps of the mean one: the second derivative
    of the parabola through three neighbours, h_1 and h_2 apart, times 4 h_1 h_2 / (h_1 + h_2)^2, which is next to one
    and keeps the difference of two coinciding control points bounded. Equidistant ones have (1, -2, 1) again.
    Source: Eilers & Marx (1996); for other knots Li & Cao (2022, "General P-splines for non-uniform B-splines"), whose
    differences have another factor to each row.
    """
    h = np.diff(greville(knots, degree))
    n = len(h) + 1
    out = np.zeros((max(n - 2, 0), n))
    if n > 2:
        i, both = np.arange(n - 2), h[:-1] + h[1:]
        # Of three coinciding abscissae the one in the middle.
        share = np.divide(h[:-1], both, out=np.full(n - 2, 0.5), where=both > 0)
        mean = h.mean()
        factor = (mean / np.maximum(0.5 * both, SHORTEST_STEP * mean)) ** 2
        out[i, i], out[i, i + 1], out[i, i + 2] = 2 * (1 - share) * factor, -2 * factor, 2 * share * factor
    return out


def _ratio(factor: Floats, differences: Floats) -> float:
    """Return trace R^T R / trace D^T D, the scale of an axis; one where there are no differences."""
    return float(np.vdot(factor, factor) / np.vdot(differences, differences)) if differences.size else 1.0


def _split(images: Sequence[Floats], values: Floats) -> tuple[Floats, float]:
    """Return the coefficients (n_1, ..., n_d, c) of ``values`` in the columns of ``images``, and |what they leave|^2.

    That is a sum axis by axis: the difference of two sums would be rounding where data have little noise.
    """
    left = 0.0
    for a, image in enumerate(images):
        shape = values.shape
        lines = values.reshape(int(np.prod(shape[:a])), shape[a], -1)
        inside = image.T @ lines
        rest = lines - image @ inside
        left += float(np.vdot(rest, rest))
        values = inside.reshape(*shape[:a], -1, *shape[a + 1 :])
    return values, left


class _Problem:
    """The penalised problem under separable weights, in the basis that makes it diagonal."""

    def __init__(
        self,
        values: Floats,
        weights: Floats,
        parameters: Sequence[Floats],
        knots: Sequence[Floats],
        degrees: Sequence[int],
        independent: float,
    ) -> None:
        known = weights > 0
        largest = weights.max()
        axes, marginals, _ = marginal_axes(weights / largest, parameters, knots, degrees)
        differences = [second_differences(t, p) for t, p in zip(knots, degrees, strict=True)]
        self.rows = [_ratio(a.factor, e) ** 0.5 * e for a, e in zip(axes, differences, strict=True)]
        """(k_a, n_a): sqrt(s_a) D_a."""
        modes = [diagonalised(a, e) for a, e in zip(axes, self.rows, strict=True)]
        self._bases = [m[0] for m in modes]
        self._damping = outer_sum([m[2] for m in modes])
        roots = [np.sqrt(w) for w in marginals]
        # (m_a, n_a): sqrt(W_a) A_a T_a, of orthonormal columns.
        images = [r[:, None] * a.matrix.apply(b, 0) for a, b, r in zip(axes, self._bases, roots, strict=True)]
        self._count, self._channels = int(known.sum()), values.shape[-1]
        self._alike = max(1.0, self._count / independent)
        # The product of the marginals stands for the weights of those data that have any.
        replaced = float(along_all([w[None] for w in marginals], known[..., None].astype(np.float64)).sum())
        self._unit = float(np.sqrt(largest) * np.sqrt((weights / largest).sum() / replaced))
        # Squares of extreme data leave the range of float64. What has no weight has no influence.
        values = values if known.all() else np.where(known[..., None], values, 0.0)
        self._exponent = int(np.frexp(max(values.max(), -values.min()))[1])
        values = np.ldexp(values, -self._exponent)
        for strength in () if known.all() else FILLINGS:
            self._coefficients = along_all([i.T * r for i, r in zip(images, roots, strict=True)], values)
            fitted = self._solved(strength)
            for a in reversed(range(len(axes))):
                fitted = axes[a].matrix.apply(fitted, a)
            values = np.where(known[..., None], values, fitted)
        for a, root in enumerate(roots):
            values = values * root.reshape(-1, *[1] * (values.ndim - a - 1))
        self._coefficients, self._outside = _split(images, values)
        self._energy = np.sum(self._coefficients**2, axis=-1)

    def _solved(self, strength: float) -> Floats:
        return along_all(self._bases, self._coefficients / (1.0 + strength * self._damping[..., None]))

    def net(self, strength: float) -> Floats:
        """Return the net (n_1, ..., n_d, c) that solves the problem."""
        return np.ldexp(self._solved(strength), self._exponent)

    def _residual(self, strength: float) -> tuple[float, float]:
        """Return |sqrt(W) (V - y)|^2 of a mean channel, and trace H."""
        lost = strength * self._damping
        lost /= 1.0 + lost
        total = self._outside + float(np.vdot(lost * lost, self._energy))
        return total / self._channels, lost.size - float(lost.sum())

    def _score(self, strength: float) -> float:
        """Return the square root of the score; infinite where as many degrees of freedom as data are left."""
        residual, used = self._residual(strength)
        free = self._count - self._alike * used
        return float(np.sqrt(self._count * residual) / free) if free > 0 else np.inf

    def told(self, strengths: Sequence[float], strength: float, *notes: str) -> Smoothing:
        """Return what there is to know of ``strength``, and the scores of ``strengths``."""
        residual, used = self._residual(strength)
        free = self._count - self._alike * used
        noise = np.sqrt(residual / free) if free > 0 else np.nan
        scores = [self._score(s) for s in strengths]
        noise, *gcv = (self._unit * np.ldexp([noise, *scores], self._exponent)).tolist()
        return Smoothing(strength, used, noise, np.array(strengths), np.array(gcv), notes)

    def best(self) -> Smoothing:
        """Return the strength of least score."""
        seen = self._damping[self._damping > 0]
        if seen.size == 0:
            return self.told([0.0], 0.0, "fewer than three control points on every axis leave nothing to smooth")
        low, high = END / seen.max(), min(1.0 / (END * seen.min()), LARGEST_STRENGTH)
        logs = np.linspace(np.log(low), np.log(high), 2 + int(PER_DECADE * np.log10(high / low)))
        strengths = np.exp(logs).tolist()
        scores = np.array([self._score(s) for s in strengths])
        # Of equal ones the strongest.
        k = len(scores) - 1 - int(np.argmin(scores[::-1]))
        if k == 0:
            return self.told(strengths, strengths[0], "the data are predicted best without any smoothing")
        if k == len(scores) - 1:
            return self.told(strengths, strengths[-1], "the data are predicted best by a multilinear function")
        return self.told(strengths, self._golden(logs[k - 1], logs[k + 1]))

    def _golden(self, a: float, b: float) -> float:
        """Return the strength of least score between exp(a) and exp(b), by a golden section."""
        c, d = b - GOLDEN * (b - a), a + GOLDEN * (b - a)
        at_c, at_d = self._score(np.exp(c)), self._score(np.exp(d))
        for _ in range(STEPS):
            if at_c < at_d:
                b, d, at_d = d, c, at_c
                c = b - GOLDEN * (b - a)
                at_c = self._score(np.exp(c))
            else:
                a, c, at_c = c, d, at_d
                d = a + GOLDEN * (b - a)
                at_d = self._score(np.exp(d))
        return float(np.exp(c if at_c < at_d else d))
