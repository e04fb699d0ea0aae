"""Direct manipulation: control points moved so that the spline goes where it is wanted."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from bvbedit.errors import BvbError
from bvbedit.spline.arguments import real_array, shown
from bvbedit.spline.basis import basis_values
from bvbedit.spline.knots import Floats
from bvbedit.spline.tensor import TensorSpline

# Conditions times control points: a dense matrix of 256 MiB.
LARGEST_SYSTEM = 1 << 25
# Of the largest: smaller singular values are rounding, conditions that repeat one another.
RANK_TOLERANCE = 1e-10


def move_points(
    spline: TensorSpline,
    points: ArrayLike,
    targets: ArrayLike,
    keep: ArrayLike | None = None,
    *,
    project: Callable[[Floats], Floats] = lambda net: net,
) -> TensorSpline:
    """Return the spline that takes the values ``targets`` (k, channels) at ``points`` (k, d), changed least.

    Of all changes of the control points that do so, and that change nothing at the points ``keep`` (j, d), it is the
    one with the least sum of squares (Bartels & Beatty 1989, "A technique for the direct manipulation of spline
    curves").
    ``project`` is an orthogonal projection on nets (n_1, ..., n_d, 1) in which the change is to lie.
    Raises BvbError for no points, points outside the domain, other shapes, and targets that contradict one another.

    >>> flat = TensorSpline((2,), ([0, 0, 0, 1, 1, 1],), np.zeros((3, 1)))
    >>> move_points(flat, [[0.5]], [[1.0]]).evaluate([0.5]).round(12).tolist()
    [1.0]
    """
    x, wanted = real_array(points, "Points"), real_array(targets, "Targets")
    d = spline.parameters
    if x.ndim != 2 or x.shape[1] != d or len(x) == 0 or wanted.shape != (len(x), spline.channels):
        raise BvbError(
            f"Points {x.shape} and targets {wanted.shape} do not belong together. Give at least one point (k, {d}) and "
            f"targets (k, {spline.channels})."
        )
    if not np.isfinite(wanted).all():
        i = int(np.argwhere(~np.isfinite(wanted))[0][0])
        raise BvbError(f"Target {i} is {shown(wanted[i].tolist())}. Targets must be finite.")
    with np.errstate(over="ignore", invalid="ignore"):
        change = wanted - spline.evaluate(x)
    if not np.isfinite(change).all():
        i = int(np.argwhere(~np.isfinite(change))[0][0])
        raise BvbError(f"The way to target {i} leaves the range of float64. Choose smaller targets.")
    if keep is not None:
        still = real_array(keep, "Points to keep")
        if still.size == 0:
            still = np.empty((0, d))
        if still.ndim != 2 or still.shape[1] != d:
            raise BvbError(f"Points to keep have shape {still.shape}. Give them as (j, {d}).")
        spline.evaluate(still)
        x = np.concatenate([x, still])
        change = np.concatenate([change, np.zeros((len(still), spline.channels))])
    size = spline.size
    if len(x) * int(np.prod(size)) > LARGEST_SYSTEM:
        raise BvbError(f"{len(x)} points and {np.prod(size)} control points are too many at once. Move fewer points.")
    rows = np.zeros((len(x), *size))
    supports = [basis_values(t, p, x[:, a]) for a, (t, p) in enumerate(zip(spline.knots, spline.degrees, strict=True))]
    for i in range(len(x)):
        weight = np.ones(())
        for _, values in supports:
            weight = np.multiply.outer(weight, values[i])
        rows[i][tuple(slice(f[i], f[i] + v.shape[1]) for f, v in supports)] = weight
    rows = np.stack([project(row[..., None]) for row in rows]).reshape(len(x), -1)
    # Only control points that some condition sees: a handful of a volume's.
    seen = np.flatnonzero(rows.any(axis=0))
    delta, *_ = np.linalg.lstsq(rows[:, seen], change, rcond=RANK_TOLERANCE)
    missed = np.abs(rows[:, seen] @ delta - change).max(axis=1)
    if missed.max() > 1e-9 * max(np.abs(change).max(), np.finfo(np.float64).tiny):
        i = int(np.argmax(missed))
        what = f"target {i}" if i < len(wanted) else f"point {i - len(wanted)} to keep"
        raise BvbError(f"The spline cannot meet {what} beside the others: it misses it by {missed[i]:.3g}. Refine it.")
    net = spline.control.reshape(-1, spline.channels).copy()
    with np.errstate(over="ignore"):
        net[seen] += delta
    return spline.with_control(net.reshape(spline.control.shape))


def scale_region(
    spline: TensorSpline,
    box: Sequence[tuple[float, float]],
    gain: ArrayLike,
    falloff: float | Sequence[float] = 0.0,
) -> TensorSpline:
    """Return the spline with the control points whose Greville abscissae lie in ``box`` multiplied by ``gain``.

    ``box`` holds d intervals (a, b) in parameters, ``gain`` a number or one per channel. Outside the box the effect
    ends smoothly (a cubic smoothstep) over the distance ``falloff``, one for all axes or one for each.
    Raises BvbError for a box that holds no control point, gains not finite, and a falloff below zero.
    """
    intervals = spline._box(box)
    factor = real_array(gain, "Gain")
    if factor.shape not in ((), (spline.channels,)) or not np.isfinite(factor).all():
        raise BvbError(f"Gain is {shown(gain)}. Give one finite number, or {spline.channels}, one for each channel.")
    widths = real_array(falloff, "Falloff")
    widths = np.full(len(intervals), widths) if widths.ndim == 0 else widths
    if widths.shape != (len(intervals),) or not (widths >= 0).all() or not np.isfinite(widths).all():
        raise BvbError(f"Falloff is {shown(falloff)}. Give a length >= 0, or one for each axis.")
    weight = np.ones(())
    for (a, b), width, x in zip(intervals, widths, spline.greville, strict=True):
        away = np.maximum(np.maximum(a - x, x - b), 0.0)
        share = np.where(away == 0, 1.0, np.clip(1 - away / width, 0.0, 1.0) if width > 0 else 0.0)
        weight = np.multiply.outer(weight, share * share * (3 - 2 * share))
    if not weight.any():
        raise BvbError(f"No control point stands in the box {shown(intervals)}. Widen it, or refine the spline.")
    with np.errstate(over="ignore"):
        net = spline.control * (1 + (factor - 1) * weight[..., None])
    return spline.with_control(net)
