"""Body and highlight: a material split into what does not depend on the half vector, and the rest.

What light scattered below the surface leaves behind depends on the half angle hardly at all, and on the difference
angles slowly; what the surface mirrors falls off with the half angle (Rusinkiewicz 1998 chose his angles for that). So
the body is, for each difference angle, the least of all half angles, and the highlight is what is left.
"""

from collections.abc import Callable
from functools import partial
from typing import Literal

import numpy as np

from bvbedit.brdf.charts import HALF_DIFF, grid_points
from bvbedit.brdf.geometry import Floats
from bvbedit.brdf.spline_brdf import SplineBrdf

Part = Literal["all", "body", "highlight"]

# Where the least is looked for: half angles up to 75 degrees, for beyond all pairs are grazing; and relative
# difference angles and difference azimuths, between which it is linear.
HALF_ANGLES = np.sqrt(np.arange(76) / 90)
DIFFERENCES, AZIMUTHS = np.linspace(0, 1, 46), np.linspace(0, 1, 10)


def body_of(model: SplineBrdf) -> Callable[[Floats], Floats]:
    """Return the function that gives the body's reflectance (n, 3) at parameters (n, 3) of the model's chart."""
    points = grid_points((HALF_ANGLES, DIFFERENCES, AZIMUTHS))
    if model.chart is HALF_DIFF:
        y = model.spline.evaluate_grid((HALF_ANGLES, DIFFERENCES, AZIMUTHS))
    else:
        y = model.spline.evaluate_inside(model.chart.to_parameters(*HALF_DIFF.to_directions(points)))
    f = model.encoding.decode(y).reshape(len(HALF_ANGLES), len(DIFFERENCES), len(AZIMUTHS), 3)
    return partial(_body, model, f.min(axis=0))


def _body(model: SplineBrdf, table: Floats, points: Floats) -> Floats:
    if model.chart is not HALF_DIFF:
        points = HALF_DIFF.to_parameters(*model.chart.to_directions(points))
    v, w = points[:, 1] * (len(DIFFERENCES) - 1), points[:, 2] * (len(AZIMUTHS) - 1)
    i = np.minimum(v.astype(np.intp), len(DIFFERENCES) - 2)
    j = np.minimum(w.astype(np.intp), len(AZIMUTHS) - 2)
    a, b = (v - i)[:, None], (w - j)[:, None]
    low = (1 - b) * table[i, j] + b * table[i, j + 1]
    return np.asarray((1 - a) * low + a * ((1 - b) * table[i + 1, j] + b * table[i + 1, j + 1]))
