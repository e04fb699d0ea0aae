"""What a fit is to come near to: a BRDF on the grid of a chart, encoded, each node with the weight it deserves.

The metric is to be small over the sample sets. To first order it is a sum of squares of the encoded value with the
weight D (T'(f) f'(y))^2, D being the density of the sets in chart parameters; see ``losses``. Or, for an interest, D is
what its pairs count there.
"""

import weakref
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.charts import HALF_DIFF, IN_OUT, Chart, grid_points
from bvbedit.brdf.encodings import Encoding
from bvbedit.brdf.geometry import Bools, Floats
from bvbedit.brdf.interest import Interest
from bvbedit.brdf.losses import Loss, PictureError
from bvbedit.brdf.measured import MeasuredBrdf, hold
from bvbedit.brdf.sample_sets import HIGHEST_ELEVATION, HORIZON_MARGIN, LARGEST_REFLECTANCE, densities, draw
from bvbedit.errors import BvbError
from bvbedit.spline.arguments import real_array, shown
from bvbedit.spline.tensor import TensorSpline
from bvbedit.threads import each_block

# What an error counts at parameters (n, 3) of a chart: (n,).
Weights = Callable[[Chart, Floats], Floats]

MIRROR = np.array([1.0, -1.0, 1.0])
# Variances below this share of the square of the value are rounding.
ROUNDING = 1e-12
# Densities on the faces of a chart are taken so much of a node's distance inside.
INSIDE = 0.5
# Where no sample set looks (beyond 80 degrees), the density that keeps the model at the data, of the sets' mean. With
# 1e-3 models of 48 KiB reached 1e5 /sr there, E_avg rose to 476, and lobes grew spikes at grazing; with 0.1 it is 0.002
# ... 0.17. More costs the metric: with 1 gold paint has 1.35 times the error, as a mean of `grid` and `nodes`.
BEYOND = 0.1
# A secant counts up to so many times the square of the tangent.
LARGEST_SECANT = 1e4
# The same at nodes without data, their value held from the nearest node with data.
HELD = 0.1
# In a fit for an interest, errors of the encoded value count at least this share of the mean one, so that the model
# does not run wild where hardly a pair is asked. With 0.01 a rim pixel was 36/255 off (ibiza sunset, 12 KiB), not 5;
# with 0.1 chrome and satin have 4 to 6 % more error.
UNASKED = 0.03
# There too, errors of f are taken to be at least so many times the mean f: with a tenth, chrome has 5 % more error on
# average, and at 6 KiB a pixel that is 65/255 off, not 10.
LEAST_ERROR = 3.0


@dataclass(frozen=True)
class Table:
    """A BRDF looked up on the grid of a chart."""

    chart: Chart
    axes: tuple[Floats, Floats, Floats]
    sides: tuple[Floats, ...]
    """Reflectance (m_0, m_1, m_2, 3) of each of the pairs of directions that the chart cannot tell apart."""
    trusted: tuple[Bools, ...]
    """(m_0, m_1, m_2) for each side: whether data stand behind it."""
    densities: Floats
    """(2, m_0, m_1, m_2): of the sample sets, each with the mean one."""
    shares: Floats
    """(2, sides): how much of each set lies on each side."""
    cosines: tuple[Floats, Floats]
    """(m_0, m_1, m_2, 1) of the elevations, none below that of 80 degrees, beyond which no set looks."""
    clamped: float
    """The share of measured values that were negative and count as zero."""


@dataclass(frozen=True)
class Problem:
    """A weighted least-squares problem on a grid, posed for a metric."""

    table: Table
    encoding: Encoding
    loss: Loss
    """The metric that is to be small."""
    surrogate: Loss
    """The metric whose weights least squares is given."""
    balance: tuple[float, float]
    """What an error over each of the sample sets counts."""
    values: Floats
    """(m_0, m_1, m_2, 3) encoded means over the sides, held where no data are."""
    weights: Floats
    """(m_0, m_1, m_2)."""
    variance: Floats | None
    """(m_0, m_1, m_2): of the noise of ``values``, summed over channels, where several sides of equal standing tell."""

    @property
    def chart(self) -> Chart:
        """The chart of the grid."""
        return self.table.chart


def tabulate(
    brdf: Brdf, chart: Chart, axes: tuple[Floats, Floats, Floats] | None = None, *, mirrored: bool = True
) -> Table:
    """Return ``brdf`` on a grid of ``chart``, by default the one on which it fits.

    A measurement on that very chart is taken at its own nodes. Otherwise each node is looked up at all pairs that the
    chart cannot tell apart and the BRDF may: the mirror image, and the exchange of wi and wo where the chart folds it;
    only at the one that ``chart.to_directions`` names unless ``mirrored``.
    The tables of the BRDF that was last asked for are kept while it lives: fits of one measurement follow each other.
    Raises BvbError where not one node has data behind it.
    """
    kept = _kept.of(brdf)
    key = chart.name, None if axes is None else tuple(u.tobytes() for u in axes), mirrored
    if key not in kept:
        kept[key] = _tabulated(brdf, chart, axes, mirrored)
    return kept[key]


class _Kept:
    """Tables of one BRDF, the last one; 330 MB after fits of all kinds to a MERL file."""

    def __init__(self) -> None:
        self._brdf: weakref.ref[Brdf] | None = None
        self._tables: dict[Any, Table] = {}

    def of(self, brdf: Brdf) -> dict[Any, Table]:
        """Return the tables of ``brdf``, after forgetting those of any other."""
        if self._brdf is None or self._brdf() is not brdf:
            self._brdf, self._tables = weakref.ref(brdf, self._forget), {}
        return self._tables

    def _forget(self, gone: "weakref.ref[Brdf]") -> None:
        if self._brdf is gone:
            self._brdf, self._tables = None, {}


_kept = _Kept()


def _tabulated(brdf: Brdf, chart: Chart, axes: tuple[Floats, Floats, Floats] | None, mirrored: bool) -> Table:
    if isinstance(brdf, MeasuredBrdf) and brdf.chart is chart:
        return _own(brdf, chart)
    axes = grid_of(brdf, chart) if axes is None else axes
    shape = tuple(len(u) for u in axes)
    alike: list[Callable[[Floats, Floats], tuple[Floats, Floats]]] = [lambda i, o: (i, o)]
    # Exchanging wi and wo exchanges theta_i and theta_o and mirrors the pair: of a reciprocal BRDF one side tells both.
    exchanged = chart is IN_OUT and brdf.reciprocal and np.array_equal(axes[0], axes[1])
    if mirrored and tells_mirrored(brdf) and not exchanged:
        alike += [lambda i, o: (i * MIRROR, o * MIRROR)]
    if mirrored and chart.reciprocal and not brdf.reciprocal:
        alike += [lambda i, o, pair=pair: pair(o, i) for pair in tuple(alike)]  # type: ignore[misc]
    sides = tuple(np.empty((*shape, 3)) for _ in alike)
    trusted = tuple(np.empty(shape, dtype=bool) for _ in alike)
    cosines = np.empty((*shape, 1)), np.empty((*shape, 1))

    def look_up(part: slice) -> None:
        layers = (part.stop - part.start, *shape[1:])
        wi, wo = chart.to_directions(grid_points((axes[0][part], *axes[1:])))
        # A pair that is lifted off the horizon is another pair: it fills the node, and carries no weight.
        unmoved = np.minimum(wi[:, 2], wo[:, 2]) >= np.sin(HORIZON_MARGIN)
        wi, wo = off_horizon(wi), off_horizon(wo)
        for cosine, w in zip(cosines, (wi, wo), strict=True):
            cosine[part] = _cosine(w).reshape(*layers, 1)
        for side, backing, pair in zip(sides, trusted, alike, strict=True):
            f, backed = brdf.evaluate_unit(*pair(wi, wo))
            side[part] = np.minimum(f, LARGEST_REFLECTANCE, out=f).reshape(*layers, 3)
            backing[part] = (backed & unmoved).reshape(layers)

    each_block(shape[0], shape[1] * shape[2], look_up)
    if mirrored and tells_mirrored(brdf) and exchanged:
        sides, trusted = (*sides, sides[0].swapaxes(0, 1)), (*trusted, trusted[0].swapaxes(0, 1))
    shares = np.full((2, len(sides)), 1 / len(sides))
    if len(sides) > 1 and not chart.reciprocal:
        shares[:] = [_sidedness(brdf, s) for s in (0, 1)]
    clamped = brdf.clamped if isinstance(brdf, MeasuredBrdf) else 0.0
    return _checked(Table(chart, axes, sides, trusted, densities(chart, axes, INSIDE), shares, cosines, clamped))


def grid_of(brdf: Brdf, chart: Chart) -> tuple[Floats, Floats, Floats]:
    """Return the axes of the grid of ``chart`` on which ``brdf`` is fitted."""
    return brdf.axes if isinstance(brdf, MeasuredBrdf) and brdf.chart is chart else chart.fitting_grid


def charts_for(brdf: Brdf, charts: Sequence[Chart], size: Sequence[int]) -> tuple[Chart, ...]:
    """Return those of the ``charts`` whose grids carry ``size`` control points. Raises BvbError where none does."""
    carried = {c: [len(u) for u in grid_of(brdf, c)] for c in charts}
    able = tuple(c for c, most in carried.items() if all(n <= m for n, m in zip(size, most, strict=True)))
    if not able:
        limits = ", ".join(f"{' x '.join(map(str, most))} in {c.name}" for c, most in carried.items())
        raise BvbError(f"{shown(list(size))} control points are more than the data carry. Choose at most {limits}.")
    return able


def tells_mirrored(brdf: Brdf) -> bool:
    """Return whether ``brdf`` may tell a pair from its mirror image: on a folded chart both are one reading."""
    return getattr(brdf, "chart", None) not in (IN_OUT, HALF_DIFF)


def _own(brdf: MeasuredBrdf, chart: Chart) -> Table:
    """Return the measurement at its own nodes."""
    wi, wo = chart.to_directions(grid_points(brdf.axes))
    shape = brdf.valid.shape
    reliable = (np.minimum(wi[:, 2], wo[:, 2]) >= np.cos(brdf.reliable_elevation)).reshape(shape)
    return _checked(
        Table(
            chart,
            brdf.axes,
            (np.minimum(brdf.filled, LARGEST_REFLECTANCE),),
            (brdf.valid & reliable,),
            densities(chart, brdf.axes, INSIDE),
            np.ones((2, 1)),
            (_cosine(wi).reshape(*shape, 1), _cosine(wo).reshape(*shape, 1)),
            brdf.clamped,
        )
    )


def _checked(table: Table) -> Table:
    if not any(t.any() for t in table.trusted):
        raise BvbError(
            "No node of the chart has data behind it: the valid cells are too few or all near grazing. "
            "Measure, or mark valid, more of the table."
        )
    return table


def _cosine(w: Floats) -> Floats:
    """Return the cosines (n,) of the elevations of ``w`` (n, 3), none below that of the sets' highest."""
    return np.asarray(np.maximum(w[:, 2], np.cos(HIGHEST_ELEVATION)))


def _sidedness(brdf: Brdf, which: int) -> tuple[float, float]:
    """Return how much of a sample set lies on the side that a chart's own pairs are on, and how much on the other.

    The paper's grid has phi in 0 ... 180 degrees and MERL's nodes have phi_d in 0 ... 180 degrees: each is on one side
    of the mirror plane only. The chart does not know the side, but the data may, and the metric does.
    """
    pairs = draw(brdf, 4096)
    part = pairs.parts()[which]
    wi, wo = pairs.wi[part], pairs.wo[part]
    cross = wi[:, 0] * wo[:, 1] - wi[:, 1] * wo[:, 0]
    left, right = np.count_nonzero(cross > HORIZON_MARGIN), np.count_nonzero(cross < -HORIZON_MARGIN)
    if left + right == 0:  # tables with large holes may leave a set without a pair
        return 0.5, 0.5
    return left / (left + right), right / (left + right)


def off_horizon(w: Floats) -> Floats:
    """Return ``w`` (n, 3) with directions on the horizon lifted by ``HORIZON_MARGIN``, azimuth kept."""
    low = w[:, 2] < np.sin(HORIZON_MARGIN)
    w[low, :2] *= (np.cos(HORIZON_MARGIN) / np.hypot(w[low, 0], w[low, 1]))[:, None]
    w[low, 2] = np.sin(HORIZON_MARGIN)
    return w


def pose(
    table: Table,
    encoding: Encoding,
    loss: Loss,
    balance: Sequence[float],
    weights: Weights | Interest | None = None,
    surrogate: Loss | None = None,
) -> Problem:
    """Return the least-squares problem for a table.

    ``balance``: what an error over each of the sets counts. ``weights`` multiplies the weights built in,
    which are those of the metric ``surrogate``, or of ``loss`` itself; an interest replaces all of these.
    Raises BvbError where these are not finite, negative, all zero, or of another shape.
    """
    if isinstance(weights, Interest):
        return _posed_for(weights, table, encoding)
    shape = table.densities.shape[1:]
    mean, count = float(sum(balance)), len(table.sides)

    def shares(part: slice) -> list[Floats]:
        wanted = [lam * d[part] for lam, d in zip(balance, table.densities, strict=True)]
        return [
            np.where(trusted[part], sum(s * w for s, w in zip(share, wanted, strict=True)) + BEYOND * mean / count, 0.0)
            for trusted, share in zip(table.trusted, table.shares.T, strict=True)
        ]

    values, density, variance = _averaged(table, encoding, shares)
    known = density > 0
    if not known.all():
        values = hold(values, known, table.chart.hold_order)
    density = np.where(known, density, HELD * mean)
    if weights is not None:
        total = density.sum()
        density = density * checked_weights(weights, table.chart, grid_points(table.axes)).reshape(shape)
        if not density.any():
            raise BvbError("weights are zero at all nodes. Return numbers above zero where the model is to be good.")
        density = density * (total / density.sum())
    surrogate = loss if surrogate is None else surrogate
    weight = density * _squared_slopes(table, encoding, surrogate, values)
    return Problem(table, encoding, loss, surrogate, (float(balance[0]), float(balance[1])), values, weight, variance)


def _posed_for(interest: Interest, table: Table, encoding: Encoding) -> Problem:
    """Return the problem for an interest: what is held where no data are is a value like others, as it is seen."""
    every = [np.ones_like(t) for t in table.trusted]
    shown = replace(table, trusted=tuple(every))
    values, density, variance = _averaged(shown, encoding, lambda part: [t[part] / len(every) for t in every])
    density = interest.density(table.chart, grid_points(table.axes)).reshape(density.shape)
    weight = density * _squared_secants(interest.loss, encoding, values)
    weight += UNASKED * weight.mean()
    return Problem(table, encoding, interest.loss, interest.loss, (1.0, 1.0), values, weight, variance)


def _squared_secants(loss: PictureError, encoding: Encoding, values: Floats) -> Floats:
    """Return the mean over channels (m_0, m_1, m_2) of (dT/dy)^2, over errors as large as the mean f, or larger.

    The slope of a power is zero at black, where errors would seem to cost nothing.
    """
    shape = values.shape[:-1]
    squared = np.empty(shape)

    def fill(part: slice) -> None:
        f = encoding.decode(values[part])
        g = f + LEAST_ERROR * loss.mean
        none = np.empty(0)
        rise = loss.transform(g, none, none) - loss.transform(f, none, none)
        squared[part] = np.mean((rise / (encoding.encode(g) - values[part])) ** 2, axis=-1)

    each_block(shape[0], shape[1] * shape[2], fill)
    return squared


def _averaged(
    table: Table, encoding: Encoding, shares: Callable[[slice], list[Floats]]
) -> tuple[Floats, Floats, Floats | None]:
    """Return encoded means over the sides by their ``shares``, the shares' sum, and the variance of the means."""
    shape = table.densities.shape[1:]
    tells = table.chart.reciprocal and len(table.sides) > 1
    values, density = np.empty_like(table.sides[0]), np.empty(shape)
    variance = np.empty(shape) if tells else None

    def average(part: slice) -> None:
        parts = shares(part)
        density[part] = np.sum(parts, axis=0)
        filled = np.where(density[part] > 0, density[part], 1.0)[..., None]
        mixed, squares = np.zeros_like(values[part]), np.zeros_like(density[part])
        for weight, side in zip(parts, table.sides, strict=True):
            y = encoding.encode(side[part])
            y_share = (weight[..., None] / filled) * y
            mixed += y_share
            if tells:
                squares += np.einsum("...c,...c->...", y, y_share)
        values[part] = mixed
        if variance is not None:
            # Of the mean over k sides, from their spread; a single side tells nothing.
            others = np.maximum(np.sum([t[part] for t in table.trusted], axis=0) - 1, 1)
            found = np.maximum(squares - np.einsum("...c,...c->...", mixed, mixed), 0.0) / others
            variance[part] = np.where(found < ROUNDING * squares, 0.0, found)

    each_block(shape[0], shape[1] * shape[2], average)
    return values, density, variance


def _squared_slopes(table: Table, encoding: Encoding, loss: Loss, values: Floats) -> Floats:
    """Return the mean over channels (m_0, m_1, m_2) of (T'(f) f'(y))^2, for a power other than 2 reweighted."""
    shape = values.shape[:-1]
    squared = np.empty(shape)

    def expected(part: slice) -> Floats:
        return loss.expected(encoding.decode(values[part]), *(c[part] for c in table.cosines))

    rows = shape[1] * shape[2]
    size = 1.0
    if loss.power != 2:
        size = sum(each_block(shape[0], rows, lambda part: float(np.abs(expected(part)).sum()))) / values.size

    def fill(part: slice) -> None:
        y = values[part]
        slope = loss.slope(encoding.decode(y), *(c[part] for c in table.cosines)) * encoding.slope(y)
        if loss.power != 2:
            slope = slope * np.sqrt(loss.reweighting(expected(part), size))
        squared[part] = np.einsum("...c,...c->...", slope, slope) / 3

    each_block(shape[0], rows, fill)
    # Where all channels are black their slope may be zero: the model is to be black there too.
    return np.maximum(squared, 1e-9 * squared.max()) if squared.any() else np.ones(shape)


def secants(problem: Problem, spline: TensorSpline) -> Floats:
    """Return by what the weights (m_0, m_1, m_2) should grow where a first fit is far off: one, or more.

    The weights are squares of the metric's slope at the data. Where that vanishes, as at the foot of a highlight, an
    error of the encoded value seems to cost nothing, but one that is large does: there the secant is what counts.
    """
    shape = problem.weights.shape
    fitted = spline.evaluate_grid(problem.table.axes)
    out = np.empty(shape)

    def fill(part: slice) -> None:
        y, off = problem.values[part], fitted[part] - problem.values[part]
        cosines = [c[part] for c in problem.table.cosines]
        loss, encoding = problem.surrogate, problem.encoding
        f = encoding.decode(y)
        moved = loss.transform(encoding.decode(fitted[part]), *cosines) - loss.transform(f, *cosines)
        tangent = loss.slope(f, *cosines) * encoding.slope(y)
        first, real = np.sum((tangent * off) ** 2, axis=-1), np.sum(moved**2, axis=-1)
        out[part] = np.clip(np.divide(real, first, out=np.ones_like(real), where=first > 0), 1.0, LARGEST_SECANT)

    each_block(shape[0], shape[1] * shape[2], fill)
    return out


def on_any_chart(weights: Callable[[Floats], Floats] | None) -> Weights | None:
    """Return a function of chart parameters (n, 3) as weights. Raises BvbError where it is none."""
    if weights is None:
        return None
    if not callable(weights):
        raise BvbError(f"weights is {shown(weights)}. Give a function of chart parameters (n, 3).")
    return lambda _chart, points: weights(points)


def checked_weights(weights: Weights, chart: Chart, points: Floats) -> Floats:
    """Return weights (n,) at ``points``, the largest as 1. Raises BvbError where they are no finite numbers >= 0."""
    found = real_array(weights(chart, points), "Weights")
    if found.shape != (len(points),) or not np.isfinite(found).all() or (found < 0).any():
        raise BvbError(
            f"weights returned {shown(found)} for {len(points):,} points. "
            "Return finite numbers >= 0, one for each point (n, 3)."
        )
    return found / (found.max(initial=0.0) or 1.0)
