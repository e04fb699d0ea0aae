"""Fitting a B-spline volume to any BRDF: sample it on the chart's grid, encode, solve least squares."""

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.charts import IN_OUT, Chart, grid_points
from bvbedit.brdf.encodings import Encoding, Linear
from bvbedit.brdf.geometry import Bools, Floats
from bvbedit.brdf.measured import MeasuredBrdf, hold
from bvbedit.brdf.spline_brdf import SplineBrdf, check_fitting_chart, keep_faces
from bvbedit.errors import BvbError
from bvbedit.spline.arguments import one_per_axis, shown
from bvbedit.spline.fitting import FitResult, fit_weighted, loft
from bvbedit.spline.knots import place_knots

# The horizon itself, where reflectance need not exist, is looked at from this far above (radians).
HORIZON_MARGIN = 1e-4
# Larger values are artefacts of dividing by a vanishing cosine.
LARGEST_REFLECTANCE = 1e5
# What a node without data weighs, its value held from the nearest node with data. Left free, 48 KiB models of six
# measurements rose beyond 85 degrees to 35 ... 5e6 times the held value, and glittered; so they stay within 3.6 ... 220
# times, while log_cosine_rms rises by 0 ... 1 % on `grid` and 0 ... 11 % on `nodes` (1e-2: 0 ... 23 %).
HELD_WEIGHT = 1e-3

Progress = Callable[[float], None]


@dataclass(frozen=True)
class Samples:
    """Reflectance on a grid of a chart."""

    axes: tuple[Floats, Floats, Floats]
    values: Floats
    """(m_0, m_1, m_2, 3) encoded means over the symmetric partners that were measured."""
    weights: Floats
    """(m_0, m_1, m_2): the share of the symmetric partners that were measured."""
    clamped: float
    """The share of measured values that were negative and count as zero."""


def fit_net(
    brdf: Brdf,
    chart: Chart,
    encoding: Encoding,
    *,
    size: Sequence[int],
    degrees: Sequence[int] = (3, 3, 3),
    knots: str = "averaged",
    progress: Progress | None = None,
) -> SplineBrdf:
    """Return the B-spline volume of ``size`` control points that approximates ``brdf``, with a report.

    Directions that are one pair in the chart (its folds) are averaged. What stands in cells without data has no
    influence: there the value held from the nearest cell with data asks for ``HELD_WEIGHT`` of a cell's weight, so that
    the model has no freedom to run wild. The control points of degenerate faces are kept equal. The published
    configuration alone (``in-out``, ``linear``, ``piegl-tiller``) is lofted to the filled table with equal weights and
    free faces (Lee & Park 2008). Raises BvbError where size and degrees do not suit each other or the data.
    """
    check_fitting_chart(chart)
    size, degrees = one_per_axis(size, "Size"), one_per_axis(degrees, "Degrees")
    if len(size) != 3 or len(degrees) != 3:
        raise BvbError(
            f"Size {shown(size)} and degrees {shown(degrees)} are not three numbers each. Give one for each axis."
        )
    start = perf_counter()
    published = chart is IN_OUT and isinstance(encoding, Linear) and knots == "piegl-tiller"
    samples = sample(brdf, chart, encoding, partners=not published)
    vectors = [place_knots(knots, u, n, p) for u, n, p in zip(samples.axes, size, degrees, strict=True)]
    if published:
        model = _reported(loft(samples.values, samples.axes, vectors, degrees), samples, chart, encoding, "lofting")
    else:
        model = _constrained(samples, chart, encoding, vectors, degrees, progress)
    return model.told(knots=knots, seconds=perf_counter() - start)


def fit_over(
    brdf: Brdf,
    chart: Chart,
    encoding: Encoding,
    knots: Sequence[Floats],
    degrees: Sequence[int],
    *,
    progress: Progress | None = None,
) -> SplineBrdf:
    """Return the B-spline volume over given full knot vectors that approximates ``brdf``, as ``fit_net`` does.

    Raises BvbError where the knots or degrees are none, or ask for more control points than the grid has nodes.
    """
    check_fitting_chart(chart)
    start = perf_counter()
    model = _constrained(sample(brdf, chart, encoding), chart, encoding, knots, degrees, progress)
    return model.told(knots="given", seconds=perf_counter() - start)


def _constrained(
    samples: Samples,
    chart: Chart,
    encoding: Encoding,
    knots: Sequence[Floats],
    degrees: Sequence[int],
    progress: Progress | None,
) -> SplineBrdf:
    """Fit with weights and with equal control points on degenerate faces."""
    values = hold(samples.values, samples.weights > 0, chart.hold_order)
    first = loft(values, samples.axes, knots, degrees)
    result = fit_weighted(
        values,
        np.where(samples.weights > 0, samples.weights, HELD_WEIGHT),
        samples.axes,
        knots,
        degrees,
        start=first.spline.control,
        project=lambda control: keep_faces(control, chart),
        progress=progress,
    )
    return _reported(result, samples, chart, encoding, "weighted")


def _reported(result: FitResult, samples: Samples, chart: Chart, encoding: Encoding, solver: str) -> SplineBrdf:
    report: dict[str, Any] = {
        "solver": solver,
        "grid": [len(u) for u in samples.axes],
        "without_data": float(np.mean(samples.weights == 0)),
        "clamped": samples.clamped,
        "condition": [min(c, sys.float_info.max) for c in result.conditions],
        "iterations": result.iterations,
        "residual": result.residual,
        "notes": list(result.notes),
    }
    return SplineBrdf(result.spline, chart, encoding, report)


def sample(brdf: Brdf, chart: Chart, encoding: Encoding, *, partners: bool = True) -> Samples:
    """Return ``brdf`` on the grid of ``chart``, encoded.

    A measurement on that very chart is taken at its own nodes. Otherwise each node is the mean over the pairs that
    the chart cannot tell apart: the mirror image, and the exchange of wi and wo where the chart folds it but the BRDF
    does not. Without ``partners`` only the pair that ``chart.to_directions`` names is looked up.
    Raises BvbError where not one node has data behind it.
    """
    if isinstance(brdf, MeasuredBrdf) and brdf.chart is chart:
        weights = brdf.valid & _reliable(brdf, chart)
        values = encoding.encode(np.minimum(brdf.filled, LARGEST_REFLECTANCE))
        return _checked(Samples(brdf.axes, values, weights.astype(np.float64), brdf.clamped))
    wi, wo = chart.to_directions(grid_points(chart.grid))
    # A pair that is lifted off the horizon is another pair: it fills the node, and carries no weight.
    unmoved = np.minimum(wi[:, 2], wo[:, 2]) >= np.sin(HORIZON_MARGIN)
    wi, wo = _off_horizon(wi), _off_horizon(wo)
    shape = tuple(len(u) for u in chart.grid)
    clamped = brdf.clamped if isinstance(brdf, MeasuredBrdf) else 0.0
    pairs = [(wi, wo)]
    if partners:
        mirror = np.array([1.0, -1.0, 1.0])
        pairs.append((wi * mirror, wo * mirror))
        if chart.reciprocal and not brdf.reciprocal:
            pairs += [(o, i) for i, o in pairs]
    values, count = np.zeros((len(wi), 3)), np.zeros(len(wi))
    for i, o in pairs:
        f, trusted = brdf.evaluate_unit(i, o)
        y = encoding.encode(np.minimum(f, LARGEST_REFLECTANCE, out=f))
        if partners:
            trusted &= unmoved
            y[~trusted] = 0.0
        values += y
        count += trusted
    if partners:
        values /= np.maximum(count, 1.0)[:, None]
    return _checked(Samples(chart.grid, values.reshape(*shape, 3), (count / len(pairs)).reshape(shape), clamped))


def _checked(samples: Samples) -> Samples:
    if not samples.weights.any():
        raise BvbError(
            "No node of the chart has data behind it: the valid cells are too few or all near grazing. "
            "Measure, or mark valid, more of the table."
        )
    return samples


def _reliable(brdf: MeasuredBrdf, chart: Chart) -> Bools:
    """Return which nodes of the table have both directions within the reliable elevation, (n_0, n_1, n_2)."""
    wi, wo = chart.to_directions(grid_points(brdf.axes))
    lowest = np.cos(brdf.reliable_elevation)
    return np.asarray(np.minimum(wi[:, 2], wo[:, 2]) >= lowest).reshape(brdf.valid.shape)


def _off_horizon(w: Floats) -> Floats:
    """Return ``w`` (n, 3) with directions on the horizon lifted by ``HORIZON_MARGIN``, azimuth kept."""
    low = w[:, 2] < np.sin(HORIZON_MARGIN)
    w[low, :2] *= (np.cos(HORIZON_MARGIN) / np.hypot(w[low, 0], w[low, 1]))[:, None]
    w[low, 2] = np.sin(HORIZON_MARGIN)
    return w
