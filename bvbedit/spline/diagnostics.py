"""What can be said of a spline for certain: bounds of its values and slopes, conditions, distances."""

from dataclasses import dataclass

import numpy as np

from bvbedit.errors import BvbError
from bvbedit.spline.basis import interpolation
from bvbedit.spline.compatible import make_compatible
from bvbedit.spline.knots import Floats
from bvbedit.spline.tensor import TensorSpline

# Parameters of each span at which a sampled distance looks.
SAMPLES = 4


@dataclass(frozen=True)
class Distance:
    """How far two splines are from one another, in the largest channel."""

    bound: float
    """No value differs by more: the largest control point of the difference over common knots."""
    sampled: float
    """The largest difference on a grid of four parameters in each span: no bound."""


def bounds(spline: TensorSpline) -> tuple[Floats, Floats]:
    """Return the smallest and the largest value (channels,) that the convex hull property allows the spline."""
    axes = tuple(range(spline.parameters))
    return spline.control.min(axis=axes), spline.control.max(axis=axes)


def slope_bounds(spline: TensorSpline, axis: int) -> tuple[Floats, Floats]:
    """Return bounds (channels,) of the derivative along ``axis``. Raises BvbError for an unknown axis."""
    return bounds(spline.derivative(axis))


def conditions(spline: TensorSpline) -> tuple[float, ...]:
    """Return for each axis the condition, in the maximum norm, of interpolating at its Greville abscissae.

    By so much an error of the values there can grow in the control points. Infinite where abscissae coincide.
    """
    return tuple(interpolation(t, p)[3] for t, p in zip(spline.knots, spline.degrees, strict=True))


def distance(a: TensorSpline, b: TensorSpline) -> Distance:
    """Return how far ``a`` is from ``b``. Raises BvbError for splines of other channels or domains."""
    if a.channels != b.channels:
        raise BvbError(f"{a.channels} and {b.channels} channels cannot be compared. Give equal numbers.")
    (a, b), _ = make_compatible(a, b)
    with np.errstate(over="ignore"):
        net = a.control - b.control
    difference = a.with_control(net)
    axes = []
    for t in difference.knots:
        values = np.unique(t)
        inside = values[:-1, None] + np.diff(values)[:, None] * (np.arange(SAMPLES) / SAMPLES)
        axes.append(np.append(inside.ravel(), values[-1]))
    return Distance(float(np.abs(difference.control).max()), float(np.abs(difference.evaluate_grid(axes)).max()))
