"""The directional albedo of a B-spline model by quadrature: Gauss's rule in pieces between whatever breaks smoothness.

For ``in-out`` light is integrated over theta_i and phi, span by span. For ``half-diff`` half vectors h are, over
u (theta_h = pi/2 u^2) and their azimuth phi_h relative to that of wo, on exactly the arc where wi is above the horizon:
cos phi_h > -cot theta_o cot 2 theta_h. So nothing jumps inside, and knots near u = 0 resolve any highlight.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bvbedit.brdf.charts import HALF_PI, IN_OUT
from bvbedit.brdf.geometry import Floats
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.errors import BvbError
from bvbedit.spline.arguments import real_array, shown

Indices = NDArray[np.intp]
# Quadratures over half vectors, by rule and elevations.
Kept = dict[tuple[tuple[int, int], bytes], tuple[Indices, Floats, Floats]]

# Gauss points in each piece along u or theta_i, and along an azimuth: of the value, and of the rule that tells its
# error. On fits of materials the value is right within 3e-4 of itself at any theta_o, and tells less than 1e-3.
FINE, COARSE = (5, 6), (4, 5)
EXTRA = 2
# What the differences of the two are multiplied by, and what is added, of the value.
CAUTION, FLOOR = 2.0, 1e-4
# Pieces are no wider than this, in parameters.
WIDEST = 0.1, 0.25
# Where circles of half vectors that nearly pass through wo are cut off, in widths of what is beyond.
GRADED = np.array([1.0, 4.0, 16.0, 64.0])
# The horizon itself is a limit: wo stands this far above it (radians).
LOWEST = 1e-6
# Points that are evaluated at once.
BLOCK = 1 << 19


@dataclass(frozen=True)
class Albedo:
    """The share of light from all around that goes towards wo: ``value`` (..., 3), right within ``error`` (..., 3)."""

    value: Floats
    error: Floats


def albedo(model: SplineBrdf, theta_o: ArrayLike) -> Albedo:
    """Return the integral of f cos theta_i over wi, for elevations ``theta_o`` (...) of wo in radians, with its error.

    By reciprocity it is the share of light from there that is reflected. At pi/2 the limit from above the horizon is
    meant. Raises BvbError for what is no SplineBrdf, and for elevations outside [0, pi/2].
    """
    return _of(model, _checked(model, theta_o), FINE, COARSE)


def albedo_value(
    model: SplineBrdf, theta_o: ArrayLike, rule: tuple[int, int] = FINE, kept: Kept | None = None
) -> Floats:
    """Return what ``albedo`` does without its error (..., 3), in 3/5 of the time.

    ``kept`` is a dictionary, empty at first, that makes it quicker for models with the same knots.
    """
    return _of(model, _checked(model, theta_o), rule, kept=kept).value


def check_spline_brdf(value: object) -> None:
    """Raise BvbError where ``value`` is no SplineBrdf."""
    if not isinstance(value, SplineBrdf):
        raise BvbError(f"{shown(value)} is no B-spline model. Fit one first.")


def _checked(model: SplineBrdf, theta_o: ArrayLike) -> Floats:
    check_spline_brdf(model)
    theta = real_array(theta_o, "Elevations")
    if not ((theta >= 0) & (theta <= HALF_PI)).all():
        raise BvbError(f"Elevations are {shown(theta_o)}. Give angles from the normal in radians, 0 to pi/2.")
    return theta


def _of(model: SplineBrdf, theta: Floats, *rules: tuple[int, int], kept: Kept | None = None) -> Albedo:
    """Return the albedo at ``theta`` (...) by the first rule; the error is zero unless there is a second one."""
    flat = theta.reshape(-1)
    value, square = np.zeros((2, flat.size, 3))
    step = max(1, BLOCK // (3 * FINE[0] * FINE[1] * sum(model.spline.size[::2])))
    with np.errstate(over="ignore", invalid="ignore"):
        for start in range(0, flat.size, step):
            block = flat[start : start + step]
            if model.chart is IN_OUT:
                (which, parts), *others = (_over_light(model, block, rule) for rule in rules)
            else:
                (which, parts), *others = (_over_half_vectors(model, block, rule, kept) for rule in rules)
            np.add.at(value, start + which, parts)
            for _, other in others:
                # Of the pieces: in their sum differences may cancel by chance.
                np.add.at(square, start + which, (parts - other) ** 2)
        error = CAUTION * np.sqrt(square) + FLOOR * value
    return Albedo(value.reshape(*theta.shape, 3), error.reshape(*theta.shape, 3))


def _over_light(model: SplineBrdf, theta: Floats, rule: tuple[int, int]) -> tuple[Indices, Floats]:
    """Return for pieces of theta_i to which elevation they belong (k,), and their integrals (k, 3)."""
    breaks = _breaks(model.spline.knots[0], WIDEST[0])
    # On a grid more points cost little, and near grazing an exponential of cubics wants them.
    counts = rule[0] + EXTRA, rule[1] + EXTRA
    (u, du), (w, dw) = _composite(breaks, counts[0]), _composite(_breaks(model.spline.knots[2], WIDEST[1]), counts[1])
    theta_i = HALF_PI * u
    # Both halves of the circle.
    du, dw = HALF_PI * du * np.sin(theta_i) * np.cos(theta_i), 2 * np.pi * dw
    f = model.encoding.decode(model.spline.evaluate_grid((u, np.minimum(theta / HALF_PI, 1.0), w)))
    rings = np.einsum("uewc,w->uec", f, dw) * du[:, None, None]
    parts = rings.reshape(len(breaks) - 1, counts[0], len(theta), 3).sum(axis=1)
    return np.tile(np.arange(len(theta)), len(parts)), parts.reshape(-1, 3)


def _over_half_vectors(
    model: SplineBrdf, theta: Floats, rule: tuple[int, int], kept: Kept | None
) -> tuple[Indices, Floats]:
    """Return for pieces of theta_h to which elevation they belong (k,), and their integrals (k, 3)."""
    from bvbedit.brdf import plausibility_kernels

    key = (rule, theta.tobytes())
    found = None if kept is None else kept.get(key)
    which, points, weights = _half_vectors(model.spline.knots[0], theta, rule) if found is None else found
    if kept is not None:
        kept[key] = which, points, weights
    parts = np.empty((len(which), 3))
    f = model.encoding.decode(model.spline.evaluate_inside(points))
    plausibility_kernels.weighted_sums(f, weights, 3 * rule[0] * rule[1], parts)
    return which, parts


def _half_vectors(u_knots: Floats, theta: Floats, rule: tuple[int, int]) -> tuple[Indices, Floats, Floats]:
    """Return to which elevation pieces belong (k,), parameters (k * n, 3) of the n points of each, and weights."""
    from bvbedit.brdf import plausibility_kernels

    theta = np.minimum(theta, HALF_PI - LOWEST)
    # Circles of h are cut by the horizon from the first on, pass through wo at the second, and end at the third.
    own = np.sqrt(np.stack([0.5 - theta / np.pi, 2 * theta / np.pi, 0.5 + theta / np.pi], axis=1))
    # Before the second everything turns the quicker the closer that is to the horizon.
    before = own[:, 1:2] - (own[:, 2:] - own[:, 1:2]) * GRADED
    knots = _breaks(u_knots, WIDEST[0])
    cuts = np.concatenate([np.broadcast_to(knots, (len(theta), len(knots))), own, before], axis=1)
    cuts = np.sort(np.clip(cuts, 0.0, own[:, 2:]), axis=1)
    which, piece = np.nonzero(np.diff(cuts, axis=1) > 0)
    start, end = cuts[which, piece], cuts[which, piece + 1]
    (x, dx), (y, dy) = _gauss(rule[0]), _gauss(rule[1])
    u = (start[:, None] + (end - start)[:, None] * x).reshape(-1)
    du = ((end - start)[:, None] * dx).reshape(-1)
    each = 3 * rule[0] * rule[1]
    points, weights = np.empty((each * len(which), 3)), np.empty(each * len(which))
    plausibility_kernels.half_vector_points(theta, np.repeat(which, rule[0]), u, du, y, dy, points, weights)
    return which, points, weights


def _breaks(knots: Floats, widest: float) -> Floats:
    """Return the knots once each, with wider spans cut evenly."""
    t = np.unique(knots)
    parts = np.ceil(np.diff(t) / widest - 1e-9).astype(int)
    return np.concatenate(
        [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(t[:-1], t[1:], parts, strict=True)] + [t[-1:]]
    )


def _composite(breaks: Floats, count: int) -> tuple[Floats, Floats]:
    """Return nodes and weights of Gauss's rule of ``count`` points between all ``breaks``."""
    x, dx = _gauss(count)
    width = np.diff(breaks)[:, None]
    return (breaks[:-1, None] + width * x).reshape(-1), (width * dx).reshape(-1)


def _gauss(count: int) -> tuple[Floats, Floats]:
    """Return nodes and weights (count,) of Gauss's rule on [0, 1]."""
    x, dx = np.polynomial.legendre.leggauss(count)
    return 0.5 * (x + 1), 0.5 * dx
