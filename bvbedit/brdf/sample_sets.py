"""The pairs of directions over which errors are counted: the set ``grid`` and the set ``nodes``.

``grid`` is the paper's grid of 91 x 91 x 361 nodes on ``in-out`` up to 80 degrees; ``nodes`` are those of a MERL table
with both elevations under 80 degrees, the valid ones of the table itself where the BRDF is one.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bvbedit.brdf.base import BLOCK, Brdf
from bvbedit.brdf.charts import IN_OUT, RUSINKIEWICZ, Chart, Rusinkiewicz, grid_points
from bvbedit.brdf.geometry import Bools, Floats
from bvbedit.brdf.measured import MeasuredBrdf
from bvbedit.threads import each_block

# The horizon itself, where reflectance need not exist, is looked at from this far above (radians).
HORIZON_MARGIN = 1e-4
# Larger values are artefacts of dividing by a vanishing cosine.
LARGEST_REFLECTANCE = 1e5
HIGHEST_ELEVATION = float(np.radians(80.0))
# Nodes at 80 degrees belong to the grid: rounding must not decide.
MARGIN = 1e-9
SETS = ("grid", "nodes")
# Of the nodes drawn at random that few are under 80 degrees, so that so many more are drawn.
DRAWN_FOR_ONE = 2


@dataclass(frozen=True)
class Pairs:
    """Pairs of directions drawn from the sets."""

    wi: Floats
    """(N, 3) unit vectors, those of ``grid`` first."""
    wo: Floats
    """(N, 3)."""
    counts: tuple[int, int]
    """How many belong to each set."""

    def parts(self) -> tuple[slice, slice]:
        """Return the places of each set."""
        return slice(0, self.counts[0]), slice(self.counts[0], sum(self.counts))


def table_behind(brdf: Brdf) -> tuple[Chart, tuple[Floats, Floats, Floats], Bools | None]:
    """Return chart, axes and valid cells (None: all) of the MERL table whose nodes are the set of ``brdf``."""
    if isinstance(brdf, MeasuredBrdf) and isinstance(brdf.chart, Rusinkiewicz):
        return brdf.chart, brdf.axes, brdf.valid
    return RUSINKIEWICZ, (*RUSINKIEWICZ.grid[:2], RUSINKIEWICZ.grid[2][::2]), None


def node_blocks(brdf: Brdf, stride: int) -> Iterator[tuple[Floats, Floats]]:
    """Yield the set ``nodes``, every ``stride``-th of each axis, as blocks of pairs (n, 3)."""
    chart, axes, valid = table_behind(brdf)
    points = grid_points(tuple(x[::stride] for x in axes))
    if valid is not None:
        points = points[valid[::stride, ::stride, ::stride].reshape(-1)]
    lowest = np.cos(HIGHEST_ELEVATION)
    for start in range(0, len(points), BLOCK):
        wi, wo = chart.to_directions(points[start : start + BLOCK])
        keep = np.minimum(wi[:, 2], wo[:, 2]) > lowest
        if keep.any():
            yield wi[keep], wo[keep]


def draw(brdf: Brdf, count: int, seed: int = 0) -> Pairs:
    """Return about ``count`` pairs of each set, drawn one from each of equal stretches of the set; ``seed`` chooses."""
    generator = np.random.Generator(np.random.PCG64(seed))
    u, v, w = IN_OUT.grid
    inside = np.flatnonzero(np.pi / 2 * u <= HIGHEST_ELEVATION + MARGIN)
    shape = (len(inside), len(inside), len(w))
    at = _stratified(int(np.prod(shape)), count, generator)
    i, j, k = np.unravel_index(at, shape)
    grid = IN_OUT.to_directions(np.stack([u[i], v[j], w[k]], axis=-1))
    chart, axes, valid = table_behind(brdf)
    cells = tuple(len(a) for a in axes)
    at = _stratified(int(np.prod(cells)), DRAWN_FOR_ONE * count, generator)
    if valid is not None:
        at = at[valid.reshape(-1)[at]]
    i, j, k = np.unravel_index(at, cells)
    wi, wo = chart.to_directions(np.stack([axes[0][i], axes[1][j], axes[2][k]], axis=-1))
    keep = np.minimum(wi[:, 2], wo[:, 2]) > np.cos(HIGHEST_ELEVATION)
    nodes = wi[keep], wo[keep]
    both = [np.concatenate(pair) for pair in zip(grid, nodes, strict=True)]
    return Pairs(both[0], both[1], (len(grid[0]), len(nodes[0])))


def _stratified(total: int, count: int, generator: np.random.Generator) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Return ``count`` increasing numbers below ``total``, or all of them where that is fewer."""
    if count >= total:
        return np.arange(total)
    # Each stretch is longer than one, so that none is drawn twice but for rounding, which does no harm.
    return ((np.arange(count) + generator.random(count)) * (total / count)).astype(np.int64)


def densities(chart: Chart, axes: tuple[Floats, Floats, Floats], inside: float) -> Floats:
    """Return how densely the sets lie at the nodes of a grid of ``chart``: (2, m_0, m_1, m_2), each with the mean one.

    A set is even in its own chart's parameters, so that its density is the quotient of the charts' Jacobians. On faces
    where that is 0/0 or infinite it is taken ``inside`` of a node's distance from the face: about the mean of a cell.
    """
    margins = np.array([inside / max(len(u) - 1, 1) for u in axes])
    shape = tuple(len(u) for u in axes)
    out = np.ones((2, *shape))

    def fill(part: slice) -> None:
        points = np.clip(grid_points((axes[0][part], *axes[1:])), margins, 1 - margins)
        wi, wo = chart.to_directions(points)
        looked_at = np.minimum(wi[:, 2], wo[:, 2]) >= np.cos(HIGHEST_ELEVATION + np.pi / 2 * margins.max())
        for density, of in zip(out, (IN_OUT, RUSINKIEWICZ), strict=True):
            found = looked_at.astype(np.float64)
            if of is not chart:
                there = np.clip(of.to_parameters(wi, wo), margins, 1 - margins)
                found *= chart.jacobian(points) / of.jacobian(there)
            density[part] = found.reshape(-1, *shape[1:])

    each_block(shape[0], shape[1] * shape[2], fill)
    return np.asarray(out / out.mean(axis=(1, 2, 3), keepdims=True))
