"""Edits that a net cannot follow exactly: the model's values are changed, and projected onto splines again."""

from collections.abc import Callable, Sequence

import numpy as np

from bvbedit.brdf.charts import grid_points
from bvbedit.brdf.geometry import Floats
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.brdf.structure import with_faces
from bvbedit.spline.projection import project
from bvbedit.spline.tensor import TensorSpline

# What a projection misses is measured at so many places of the parameter box, drawn by this seed.
CHECKS, SEED = 4096, 20081111

# Encoded values (n, 3) at parameters (n, 3) of the model's chart.
Encoded = Callable[[Floats], Floats]


def resampled(model: SplineBrdf, encoded: Encoded, knots: Sequence[Floats] | None = None) -> SplineBrdf:
    """Return the model that takes ``encoded`` values, over its own knots or others.

    ``report["refit_error"]`` tells by how much it misses them: the root mean square of log(1 + f cos theta_i cos
    theta_o), natural logarithms, over the parameter box. Values that are a spline over the knots are met exactly, and
    what is changed in some place changes no control points but those whose support it meets.
    """
    spline = model.spline if knots is None else TensorSpline(model.spline.degrees, knots, model.spline.control)

    def change(axes: Sequence[Floats]) -> Floats:
        before = spline.evaluate_grid(axes)
        return encoded(grid_points(tuple(axes))).reshape(before.shape) - before

    net = spline.control + project(change, spline.knots, spline.degrees).control
    edited = with_faces(spline.with_control(net), model)
    return edited.told(refit_error=distance(edited, encoded))


def distance(model: SplineBrdf, encoded: Encoded) -> float:
    """Return the root mean square difference of log(1 + f cos theta_i cos theta_o) to ``encoded`` values."""
    points = np.random.default_rng(SEED).random((CHECKS, 3))
    wi, wo = model.chart.to_directions(points)
    cosines = wi[:, 2:] * wo[:, 2:]
    with np.errstate(over="ignore"):
        ours, wanted = (
            np.log1p(cosines * model.encoding.decode(y))
            for y in (model.spline.evaluate_inside(points), encoded(points))
        )
    return float(np.sqrt(np.mean((ours - wanted) ** 2)))
