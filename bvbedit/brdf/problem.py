"""What a fit is to come near to: a BRDF on the grid of a chart, encoded, each node with the weight it deserves.

The metric is to be small over the sample sets. To first order it is a sum of squares of the encoded value with the
weight D (T'(f) f'(y))^2, D being the density of the sets in chart parameters; see ``losses``.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.charts import HALF_DIFF, IN_OUT, Chart, grid_points
from bvbedit.brdf.encodings import Encoding
from bvbedit.brdf.geometry import Bools, Floats
from bvbedit.brdf.losses import Loss
from bvbedit.brdf.measured import MeasuredBrdf, hold
from bvbedit.brdf.sample_sets import HIGHEST_ELEVATION, HORIZON_MARGIN, LARGEST_REFLECTANCE, densities, draw
from bvbedit.errors import BvbError
from bvbedit.spline.arguments import real_array, shown

Weights = Callable[[Floats], Floats]

MIRROR = np.array([1.0, -1.0, 1.0])
# Layers of the first axis that are looked up at once.
LAYERS = 12
# Variances below this share of the square of the value are rounding.
ROUNDING = 1e-12
# Densities on the faces of a chart are taken so much of a node's distance inside.
INSIDE = 0.5
# Where no sample set looks (beyond 80 degrees), the density that keeps the model at the data, of the sets' mean. With
# 1e-3 models of 48 KiB reached 1e5 /sr there, E_avg rose to 476, and lobes grew spikes at grazing; with 0.1 it is 0.002
# ... 0.17. More costs the metric: with 1 gold paint has 1.35 times the error, as a mean of `grid` and `nodes`.
BEYOND = 0.1
# The same at nodes without data, their value held from the nearest node with data.
HELD = 0.1


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
    Raises BvbError where not one node has data behind it.
    """
    if isinstance(brdf, MeasuredBrdf) and brdf.chart is chart:
        return _own(brdf, chart)
    axes = chart.fitting_grid if axes is None else axes
    shape = tuple(len(u) for u in axes)
    reflected = 2 if mirrored and tells_mirrored(brdf) else 1
    count = reflected * (2 if mirrored and chart.reciprocal and not brdf.reciprocal else 1)
    sides = tuple(np.empty((*shape, 3)) for _ in range(count))
    trusted = tuple(np.empty(shape, dtype=bool) for _ in range(count))
    cosines = np.empty((*shape, 1)), np.empty((*shape, 1))
    # A few layers at once keep the directions in megabytes.
    for start in range(0, shape[0], LAYERS):
        part = slice(start, start + LAYERS)
        layers = (len(axes[0][part]), *shape[1:])
        wi, wo = chart.to_directions(grid_points((axes[0][part], *axes[1:])))
        # A pair that is lifted off the horizon is another pair: it fills the node, and carries no weight.
        unmoved = np.minimum(wi[:, 2], wo[:, 2]) >= np.sin(HORIZON_MARGIN)
        wi, wo = off_horizon(wi), off_horizon(wo)
        for cosine, w in zip(cosines, (wi, wo), strict=True):
            cosine[part] = _cosine(w).reshape(*layers, 1)
        pairs = [(wi, wo), (wi * MIRROR, wo * MIRROR)][:reflected]
        pairs += [(o, i) for i, o in pairs][: count - len(pairs)]
        for k, (i, o) in enumerate(pairs):
            f, backed = brdf.evaluate_unit(i, o)
            sides[k][part] = np.minimum(f, LARGEST_REFLECTANCE, out=f).reshape(*layers, 3)
            trusted[k][part] = (backed & unmoved).reshape(layers)
    shares = np.full((2, count), 1 / count)
    if reflected > 1 and not chart.reciprocal:
        shares[:] = [_sidedness(brdf, s) for s in (0, 1)]
    clamped = brdf.clamped if isinstance(brdf, MeasuredBrdf) else 0.0
    return _checked(Table(chart, axes, sides, trusted, densities(chart, axes, INSIDE), shares, cosines, clamped))


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
    table: Table, encoding: Encoding, loss: Loss, balance: Sequence[float], weights: Weights | None = None
) -> Problem:
    """Return the least-squares problem for a table.

    ``balance``: what an error over each of the sets counts. ``weights`` (n, 3) -> (n,) multiplies the weights built in.
    Raises BvbError where these are not finite, negative, all zero, or of another shape.
    """
    shape = table.densities.shape[1:]
    wanted = [lam * d for lam, d in zip(balance, table.densities, strict=True)]
    mean = float(sum(balance))
    parts = [
        np.where(trusted, sum(s * w for s, w in zip(share, wanted, strict=True)) + BEYOND * mean / len(table.sides), 0)
        for trusted, share in zip(table.trusted, table.shares.T, strict=True)
    ]
    density = np.sum(parts, axis=0)
    known = density > 0
    filled = np.where(known, density, 1.0)[..., None]
    values, squares = np.zeros_like(table.sides[0]), np.zeros(shape)
    tells = table.chart.reciprocal and len(parts) > 1
    for part, side in zip(parts, table.sides, strict=True):
        y = encoding.encode(side)
        share = part[..., None] / filled
        values += share * y
        if tells:
            squares += np.einsum("...c,...c->...", y, share * y)
    variance = None
    if tells:
        # Of the mean over k sides, from their spread; a single side tells nothing.
        others = np.maximum(np.sum(table.trusted, axis=0) - 1, 1)
        variance = np.maximum(squares - np.einsum("...c,...c->...", values, values), 0.0) / others
        variance[variance < ROUNDING * squares] = 0.0
    if not known.all():
        values = hold(values, known, table.chart.hold_order)
    density = np.where(known, density, HELD * mean)
    if weights is not None:
        total = density.sum()
        density = density * checked_weights(weights, grid_points(table.axes)).reshape(shape)
        if not density.any():
            raise BvbError("weights are zero at all nodes. Return numbers above zero where the model is to be good.")
        density = density * (total / density.sum())
    f = encoding.decode(values)
    slope = loss.slope(f, *table.cosines) * encoding.slope(values)
    if loss.power != 2:
        slope = slope * np.sqrt(loss.reweighting(loss.expected(f, *table.cosines)))
    squared = np.einsum("...c,...c->...", slope, slope) / 3
    # Where all channels are black their slope may be zero: the model is to be black there too.
    squared = np.maximum(squared, 1e-9 * squared.max()) if squared.any() else np.ones_like(squared)
    return Problem(table, encoding, loss, (float(balance[0]), float(balance[1])), values, density * squared, variance)


def checked_weights(weights: Weights, points: Floats) -> Floats:
    """Return ``weights(points)`` (n,), the largest as 1. Raises BvbError where they are no finite numbers >= 0."""
    if not callable(weights):
        raise BvbError(f"weights is {shown(weights)}. Give a function of chart parameters (n, 3).")
    found = real_array(weights(points), "Weights")
    if found.shape != (len(points),) or not np.isfinite(found).all() or (found < 0).any():
        raise BvbError(
            f"weights returned {shown(found)} for {len(points):,} points. "
            "Return finite numbers >= 0, one for each point (n, 3)."
        )
    return found / (found.max(initial=0.0) or 1.0)
