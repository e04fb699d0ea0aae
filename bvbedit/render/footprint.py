"""Where a scene looks at a material, and what it counts there: weights for a fit that serves this scene."""

from dataclasses import dataclass
from os import PathLike

import numpy as np
from numpy.typing import NDArray

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.charts import Chart
from bvbedit.brdf.geometry import Floats
from bvbedit.brdf.losses import Loss
from bvbedit.brdf.problem import Weights
from bvbedit.brdf.sample_sets import draw
from bvbedit.brdf.samples import looked_up
from bvbedit.errors import BvbError
from bvbedit.render.prepared import PreparedScene
from bvbedit.render.scene import Scene

# The picture whose look-ups are counted.
SIDE, SPP, SEED = 128, 16, 0
# Pairs of each of the metric's sample sets that the look-ups are compared with.
PAIRS = 200_000
# Cells of a chart along each axis: some hundred look-ups and pairs for each.
CELLS = (24, 24, 12)
# What the scene does not look at counts this share of the mean, so that the model does not run wild there.
UNSEEN = 1e-3


@dataclass(frozen=True)
class Footprint:
    """The look-ups of a scene: pairs of directions (n, 3), (n, 3), and what a squared error counts at each (n,)."""

    wi: Floats
    wo: Floats
    counts: Floats

    def density(self, chart: Chart, cells: tuple[int, int, int] = CELLS) -> Floats:
        """Return which share of what counts falls into each of the ``cells`` of a chart's parameter box."""
        return _histogram(chart.to_parameters(self.wi, self.wo), self.counts, cells)


def footprint(brdf: Brdf, scene: str | PathLike[str] | Scene) -> Footprint:
    """Return where ``scene`` looks at ``brdf``, and what errors count there on an 8-bit screen at exposure 0.

    An error of f changes a pixel by the light that arrives there, and the screen by the slope of its curve, 0 where it
    is clipped. Errors at all look-ups of a pixel are taken to have one sign, as those of a smooth model nearly have.
    Raises BvbError where the scene shows no model, or is black or white all over.
    """
    prepared = PreparedScene(brdf, scene, width=SIDE, height=SIDE, spp=SPP, seed=SEED)
    asked = prepared.look_ups(brdf)
    radiance = prepared.shade(brdf).reshape(-1, 3).astype(np.float64)
    # The derivative of sRGB's curve (IEC 61966-2-1).
    slope = np.where(radiance <= 0.0031308, 12.92, 1.055 / 2.4 * np.maximum(radiance, 0.0031308) ** (1 / 2.4 - 1))
    seen = asked.light * np.where(radiance < 1, slope, 0.0)[asked.pixel]
    whole = np.zeros_like(radiance)
    np.add.at(whole, asked.pixel, seen)
    counts = np.einsum("nc,nc->n", seen, whole[asked.pixel])
    if not counts.any():
        raise BvbError("The scene shows nothing of the model that a screen could tell. Light it, or choose another.")
    return Footprint(asked.wi, asked.wo, counts)


def scene_weights(brdf: Brdf, scene: str | PathLike[str] | Scene, loss: Loss) -> Weights:
    """Return what multiplies the weights of the metric ``loss`` in a fit of ``brdf``, so that ``scene`` counts.

    The metric's weights are the density of its sample sets times the square of its slope; this is the footprint over
    both, in cells of whatever chart is asked for, and linear in between.
    """
    found = footprint(brdf, scene)
    known = looked_up(brdf, draw(brdf, PAIRS))
    wi, wo = known.pairs.wi, known.pairs.wo
    slope = loss.slope(known.f, wi[:, 2:], wo[:, 2:])
    counted = np.einsum("nc,nc->n", slope, slope)
    for part in known.pairs.parts():
        counted[part] /= max(counted[part].sum(), np.finfo(float).tiny)
    of_charts: dict[str, Floats] = {}

    def weights(chart: Chart, points: Floats) -> Floats:
        if chart.name not in of_charts:
            metric = _smoothed(_histogram(chart.to_parameters(wi, wo), counted, CELLS))
            metric = np.maximum(metric, UNSEEN * np.mean(metric))
            of_charts[chart.name] = np.maximum(_smoothed(found.density(chart)) / metric, UNSEEN)
        return _between(of_charts[chart.name], points)

    return weights


def _histogram(points: Floats, counts: Floats, cells: tuple[int, int, int]) -> Floats:
    """Return the share of ``counts`` (n,) in each of the cells of the unit cube."""
    at = np.minimum((points * cells).astype(np.intp), np.subtract(cells, 1))
    flat = np.ravel_multi_index(tuple(at.T), cells)
    shares = np.bincount(flat, counts, minlength=int(np.prod(cells))).reshape(cells)
    return np.asarray(shares / shares.sum())


def _smoothed(values: Floats) -> Floats:
    """Return means over neighbouring cells, weighted 1, 2, 1 along each axis: fewer cells are left to chance."""
    for axis in range(values.ndim):
        padded = np.pad(values, [(1, 1) if a == axis else (0, 0) for a in range(values.ndim)], mode="edge")
        before, here, after = (np.take(padded, range(k, k + values.shape[axis]), axis=axis) for k in range(3))
        values = (before + 2 * here + after) / 4
    return values


def _between(values: Floats, points: Floats) -> Floats:
    """Return values (n,) at ``points`` (n, 3), linear between the middles of cells."""
    out = np.zeros(len(points))
    places = np.clip(points * values.shape - 0.5, 0, np.subtract(values.shape, 1))
    first = np.minimum(places.astype(np.intp), np.subtract(values.shape, 2))
    right = places - first
    for corner in np.ndindex(2, 2, 2):
        share: NDArray[np.float64] = np.prod(np.where(corner, right, 1 - right), axis=1)
        out += share * values[tuple((first + corner).T)]
    return out
