"""The spline's structure edited under a model: finer or coarser nets, higher or lower degrees, same look.

Where the control points of a chart's degenerate faces are equal, as in every constrained fit, they stay so.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from bvbedit.brdf.charts import grid_points
from bvbedit.brdf.spline_brdf import SplineBrdf, face_spread, keep_faces
from bvbedit.spline.diagnostics import distance
from bvbedit.spline.tensor import TensorSpline

# Of the largest control point: a larger spread on a face was there on purpose, as in the paper's plain fit.
FACE_ROUNDING = 1e-12


def refine(model: SplineBrdf, axis: int, *, at: ArrayLike | None = None, factor: int | None = None) -> SplineBrdf:
    """Return the same material with knots ``at`` (chart parameters) inserted, or each span cut into ``factor`` parts.

    Raises BvbError as ``TensorSpline.insert_knots`` and ``refine`` do.
    """
    spline = model.spline.refine(axis, factor) if at is None else model.spline.insert_knots(axis, at)
    return with_faces(spline, model)


def elevate(model: SplineBrdf, axis: int, by: int = 1) -> SplineBrdf:
    """Return the same material with the degree of ``axis`` raised. Raises BvbError beyond degree 16."""
    return with_faces(model.spline.elevate(axis, by), model)


def remove(model: SplineBrdf, axis: int, tolerance: float) -> tuple[SplineBrdf, float]:
    """Return the model without the knots of ``axis`` that ``tolerance`` allows to go, and the bound of the change.

    Both are in encoded values. Raises BvbError for an unknown axis or a negative tolerance.
    """
    spline, bound = model.spline.remove_knots(axis, tolerance, held=_held(model, axis))
    edited = with_faces(spline, model)
    return edited, bound + _moved(spline, edited)


def reduce(model: SplineBrdf, axis: int, by: int = 1, tolerance: float | None = None) -> tuple[SplineBrdf, float]:
    """Return the nearest model with the degree of ``axis`` lowered, and the bound of the change in encoded values.

    Raises BvbError below degree 0, and where the bound passes ``tolerance``.
    """
    spline, bound = model.spline.reduce(axis, by, tolerance, held=_held(model, axis))
    edited = with_faces(spline, model)
    return edited, bound + _moved(spline, edited)


def with_faces(spline: TensorSpline, *models: SplineBrdf) -> SplineBrdf:
    """Return the first of the ``models`` with ``spline``, degenerate faces made constant where they were in all."""
    model = models[0]
    constant = all(
        face_spread(m.spline.control, m.chart) <= FACE_ROUNDING * np.abs(m.spline.control).max() for m in models
    )
    return model.with_spline(spline.with_control(keep_faces(spline.control, model.chart)) if constant else spline)


def _held(model: SplineBrdf, axis: int) -> tuple[int, int] | None:
    """Return how many layers of control points at either end a degenerate face or the end value needs unchanged."""
    layers: Sequence[int] = [face.layers for face in model.chart.degenerate_faces if face.axis == axis]
    if not layers or axis not in range(3) or sum(layers) + 1 > model.spline.size[axis]:
        return None
    return max(layers), 1


def _moved(spline: TensorSpline, edited: SplineBrdf) -> float:
    return float(np.abs(spline.control - edited.spline.control).max())


def largest_change(before: SplineBrdf, after: SplineBrdf) -> float:
    """Return by how much the encoded value of ``before`` changes at most.

    In one chart and encoding that is a bound, by the control points over common knots; otherwise the largest difference
    on the grid of the chart of ``before``, in its encoding.
    """
    if before.chart is after.chart and before.encoding == after.encoding:
        return distance(before.spline, after.spline).bound
    y = before.spline.evaluate_grid(before.chart.grid)
    wi, wo = before.chart.to_directions(grid_points(before.chart.grid))
    f, _ = after.evaluate_unit(wi, wo)
    return float(np.abs(before.encoding.encode(f) - np.maximum(y, 0.0).reshape(-1, 3)).max())
