"""What a spline becomes when its values are changed: a projection that is exact for splines, and local.

A control point is read off the values in one span of its support alone: the polynomial through them has exactly the
p + 1 basis functions of that span as its coefficients (a local linear projector; Lyche & Schumaker 1975, "Local spline
approximation methods"). So whatever is a spline over the knots comes back as it was, and a change of the values changes
no control points but those whose support it meets.
"""

from collections.abc import Callable, Sequence
from functools import reduce

import numpy as np

from bvbedit.spline.banded import Banded
from bvbedit.spline.basis import basis_values
from bvbedit.spline.knots import Floats, greville
from bvbedit.spline.tensor import TensorSpline

# Of the range of values: a smooth function that is a cubic in each span needs less (a parabola's vertex a third).
OVERSHOOT = 1.0
# Of the largest value: what misses the values by no more is a spline, met up to rounding.
ROUNDING = 1e-9


def projector(knots: Floats, degree: int) -> tuple[Floats, Banded]:
    """Return parameters (m,) where values are read, increasing, and the matrix (n, m) from them to control points.

    ``knots`` is a full clamped knot vector. The parameters are Chebyshev's p + 1 in each span that is read.
    """
    p, n = degree, len(knots) - degree - 1
    spans = np.flatnonzero(np.diff(knots) > 0)
    left, right = knots[spans], knots[spans + 1]
    # Of the spans in the support of a control point the one whose middle is nearest to its Greville abscissa: there
    # its basis function is large.
    away = np.abs((left + right) / 2 - greville(knots, p)[:, None])
    supported = (spans >= np.arange(n)[:, None]) & (spans <= np.arange(n)[:, None] + p)
    read = np.argmin(np.where(supported, away, np.inf), axis=1)
    used, place = np.unique(read, return_inverse=True)
    nodes = 0.5 - 0.5 * np.cos((np.arange(p + 1) + 0.5) * np.pi / (p + 1))
    points = left[used, None] + (right - left)[used, None] * nodes
    rows = np.empty((n, p + 1))
    for k, span in enumerate(spans[used]):
        _, values = basis_values(knots, p, points[k])
        inverse = np.linalg.inv(values)
        for i in np.flatnonzero(place == k):
            rows[i] = inverse[i - (span - p)]
    return points.reshape(-1), Banded((place * (p + 1)).astype(np.int64), rows, len(used) * (p + 1))


def project(
    values: Callable[[Sequence[Floats]], Floats], knots: Sequence[Floats], degrees: Sequence[int]
) -> TensorSpline:
    """Return the spline over ``knots`` that ``values`` projects to.

    ``values`` is handed d axes of parameters (m_a,) and returns values on their grid (m_1, ..., m_d, channels). Where
    they are no spline, as at a jump, a control point leaves the range of those that it is read off by at most
    ``OVERSHOOT`` of that range.
    """
    axes = [projector(t, p) for t, p in zip(knots, degrees, strict=True)]
    points = [x for x, _ in axes]
    net = low = high = read = values(points)
    for axis, (_, matrix) in enumerate(axes):
        net = matrix.apply(net, axis)
    spline = TensorSpline(degrees, knots, net)
    missed = np.abs(spline.evaluate_grid(points) - read)
    for axis, (_, matrix) in enumerate(axes):
        low, high = _ends(np.minimum, low, matrix, axis), _ends(np.maximum, high, matrix, axis)
        missed = _ends(np.maximum, missed, matrix, axis)
    margin = OVERSHOOT * (high - low)
    # A spline may be wilder than its values, as that of a net like a chessboard is.
    held = np.clip(net, low - margin, high + margin)
    return spline.with_control(np.where(missed > ROUNDING * np.abs(read).max(), held, net))


def _ends(extreme: np.ufunc, values: Floats, matrix: Banded, axis: int) -> Floats:
    """Return the least or the largest of the values that each row of the matrix reads along an axis."""
    read = (np.take(values, matrix.first + k, axis=axis) for k in range(matrix.rows.shape[1]))
    return reduce(extreme, read)
