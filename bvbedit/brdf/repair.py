"""Control points moved so that a model is nowhere negative and creates no energy: the steps of ``make_plausible``."""

import math

import numpy as np

from bvbedit.brdf.albedo import COARSE, Kept, albedo, albedo_value
from bvbedit.brdf.charts import HALF_PI, IN_OUT, Chart, grid_points
from bvbedit.brdf.geometry import Bools, Floats, elevation
from bvbedit.brdf.spline_brdf import SplineBrdf, face_spread
from bvbedit.brdf.structure import FACE_ROUNDING, with_faces
from bvbedit.errors import BvbError
from bvbedit.spline.basis import basis_values, collocation
from bvbedit.spline.tensor import TensorSpline

# Elevations of wo at which energy is looked at (radians): every half degree, every tenth beyond 85; and those at which
# a repaired model must not create any, twice as many.
ELEVATIONS = np.radians(np.concatenate([np.arange(170) / 2, np.arange(850, 901) / 10]))
WATCHED = np.radians(np.concatenate([np.arange(340) / 4, np.arange(1700, 1801) / 20]))
# Above 1 by so little is what a constant of albedo 1 may be found to be.
NOTHING = 1e-5
# Energy is taken down to GOAL where there is more than ENOUGH: between the elevations an albedo may swing up.
GOAL, ENOUGH = 1 - 3e-4, 1 - 1e-4
# Steps towards factors that change no more than they must, at most, and when they end: no logarithm moves so far. Then
# factors only fall, in longer and longer steps.
SETTLING, SETTLED, FALLING, LONGER = 16, 2e-4, 24, 1.4
# Of the logarithm by which an albedo is too high, for a factor that stands for wi and for wo; and the most that a
# factor rises in a step.
DAMPING, RISE = 0.5, 0.2
# Factors do not fall further: where that is not enough, they have nothing to do with it.
LEAST = 1e-3
# Encoded values above this, of the largest control point or of 1, are not negative but rounding.
ROUNDING = 1e-12
# Places in each span where negative values are looked for, where there are no more than so many places in all.
PLACES, MOST_PLACES = 4, 2_000_000
# Steps of raising; at first control points rise in proportion to their share, at last all that are involved do.
GENTLE, STEPS = 12, 24
# Part of a negative control point that goes beyond what is needed, more with each step: else minima between the places
# would be followed for ever.
EXCESS = 0.02


def rounding(spline: TensorSpline) -> float:
    """Return how far below zero a value of ``spline`` is taken for zero."""
    return ROUNDING * max(1.0, float(np.abs(spline.control).max()))


def lowest(spline: TensorSpline) -> tuple[Floats, Floats]:
    """Return the lowest value (3,) of each channel and its place (3, 3): on a grid, refined around its lowest node."""
    axes = _places(spline)
    return _refined(spline, axes, spline.evaluate_grid(axes))


def _places(spline: TensorSpline) -> list[Floats]:
    spans = [np.unique(t) for t in spline.knots]
    each = PLACES
    while each > 1 and math.prod(each * len(t) for t in spans) > MOST_PLACES:
        each -= 1
    inside = np.arange(each) / each
    return [np.append((t[:-1, None] + np.diff(t)[:, None] * inside).reshape(-1), t[-1]) for t in spans]


def _refined(spline: TensorSpline, axes: list[Floats], y: Floats) -> tuple[Floats, Floats]:
    """Return value and place of the minima of ``y`` (m_0, m_1, m_2, 3) on the grid of ``axes``, as ``lowest`` does."""
    values, places = np.empty(3), np.empty((3, 3))
    for c in range(3):
        at = np.unravel_index(int(np.argmin(y[..., c])), y.shape[:3])
        values[c], places[c] = y[(*at, c)], [x[i] for x, i in zip(axes, at, strict=True)]
        reach = [float(np.diff(x).max()) for x in axes]
        for _ in range(5):
            box = [np.clip(x + r * np.linspace(-1, 1, 7), 0.0, 1.0) for x, r in zip(places[c], reach, strict=True)]
            near = spline.evaluate_grid(box)[..., c]
            at = np.unravel_index(int(np.argmin(near)), near.shape)
            if near[at] < values[c]:
                values[c], places[c] = near[at], [x[i] for x, i in zip(box, at, strict=True)]
            reach = [r / 3 for r in reach]
    return values, places


def raised(model: SplineBrdf) -> SplineBrdf:
    """Return the model with negative control points raised towards zero until its spline is nowhere negative.

    Those alone that make it so somewhere, and by their share: a convex combination P - M of the positive and the
    negative ones is not below zero once the latter are multiplied by P/M. The same model where nothing must be done.
    """
    spline = model.spline
    constant = face_spread(spline.control, model.chart) <= FACE_ROUNDING * np.abs(spline.control).max()
    for step in range(STEPS):
        if spline.control.min() >= 0:
            break
        axes = _places(spline)
        y = spline.evaluate_grid(axes)
        limit = -rounding(spline)
        values, places = _refined(spline, axes, y)
        at = np.nonzero((y < limit).any(axis=-1))
        x = np.concatenate([np.stack([t[i] for t, i in zip(axes, at, strict=True)], axis=1), places[values < limit]])
        if len(x) == 0:
            break
        kept = _kept(spline, x, step)
        if constant:
            kept = _together(kept, model.chart)
        if model.chart is IN_OUT and is_symmetric(spline):
            kept = np.minimum(kept, kept.transpose(1, 0, 2, 3))
        spline = spline.with_control(np.where(spline.control < 0, spline.control * kept, spline.control) + 0.0)
    else:
        spline = spline.with_control(np.maximum(spline.control, 0.0))
    return model if spline is model.spline else model.with_spline(spline)


def _kept(spline: TensorSpline, x: Floats, step: int) -> Floats:
    """Return which part (n_0, n_1, n_2, 3) of negative control points may stay, so that no place ``x`` (m, 3) is."""
    control = spline.control.reshape(-1, 3)
    axes = [basis_values(t, p, x[:, a]) for a, (t, p) in enumerate(zip(spline.knots, spline.degrees, strict=True))]
    supports = []
    for offset in np.ndindex(*(p + 1 for p in spline.degrees)):
        at = np.ravel_multi_index([first + k for (first, _), k in zip(axes, offset, strict=True)], spline.size)
        weight = np.prod([values[:, k] for (_, values), k in zip(axes, offset, strict=True)], axis=0)
        supports.append((at, weight[:, None]))
    above, below, most = np.zeros((3, len(x), 3))
    for at, weight in supports:
        above += weight * np.maximum(control[at], 0.0)
        below += weight * np.maximum(-control[at], 0.0)
        np.maximum(most, np.where(control[at] < 0, weight, 0.0), out=most)
    part = np.divide(above, below, out=np.ones_like(above), where=below > above)
    part[part < 1] *= 1 - EXCESS * step
    kept = np.ones_like(control)
    for at, weight in supports:
        share = np.divide(weight, most, out=np.zeros_like(most), where=most > 0) if step < GENTLE else 1.0
        np.minimum.at(kept, at, 1 - (1 - part) * np.minimum(share, 1.0))
    return kept.reshape(spline.control.shape)


def _together(kept: Floats, chart: Chart) -> Floats:
    """Return the least of ``kept`` for all control points that a degenerate face wants equal."""
    out = kept.copy()
    for face in chart.degenerate_faces:
        layers = np.moveaxis(out, face.axis, 0)[: face.layers]
        layers[:] = layers.min(axis=(0, face.along + (face.along < face.axis)), keepdims=True)
    return out


def is_symmetric(spline: TensorSpline) -> bool:
    """Return whether axes 0 and 1 have the same knots and may be exchanged, up to rounding."""
    if spline.degrees[0] != spline.degrees[1] or not np.array_equal(spline.knots[0], spline.knots[1]):
        return False
    apart = np.abs(spline.control - spline.control.transpose(1, 0, 2, 3)).max()
    return bool(apart <= ROUNDING * np.abs(spline.control).max())


def creates(value: Floats, error: Floats) -> Bools:
    """Return where an albedo is certainly above 1."""
    return np.asarray(value > 1 + error)


def dimmed(model: SplineBrdf, *, colour: bool = False) -> tuple[SplineBrdf, Floats]:
    """Return the model f m(theta_i) m(theta_o) whose albedo is at most 1, and m (n, 3) of each channel.

    m <= 1 stands at the Greville abscissae of axis 1, times pi/2, linear in between; a control point is multiplied by
    what belongs to the pair of directions at its own. ``colour``: m is the same for all channels. m is found by damped
    steps, as Sinkhorn & Knopp (1967) balance a matrix: it falls where an albedo near by is above 1, and rises, up to 1,
    where none is.
    The same model where the albedo is nowhere above 1 by more than the quadrature's rounding.
    Raises BvbError for albedos that are not finite.
    """
    seen = albedo(model, ELEVATIONS)
    if not np.isfinite(seen.value).all():
        raise BvbError("The albedo leaves the range of float64. Scale the material down.")
    spline = model.spline
    nodes = HALF_PI * spline.greville[1]
    m = np.ones((len(nodes), 3))
    if not (seen.value > 1 + NOTHING).any():
        return model, m
    angles = [elevation(w) for w in model.chart.to_directions(grid_points(spline.greville))]
    kept: Kept = {}
    near = {len(t): _influence(spline, t) for t in (ELEVATIONS, WATCHED)}

    def applied(m: Floats) -> SplineBrdf:
        on = [np.stack([np.interp(angle, nodes, m[:, c]) for c in range(3)], axis=1) for angle in angles]
        factor = (on[0] * on[1]).reshape(spline.control.shape)
        return with_faces(spline.with_control(model.encoding.scaled(spline.control, factor)), model)

    for step in range(SETTLING):
        value = seen.value if step == 0 else albedo_value(applied(m), ELEVATIONS, COARSE, kept)
        if colour:
            value = np.broadcast_to(value.max(axis=1, keepdims=True), value.shape)
        last, m = m, _balanced(m, value, near[len(value)], DAMPING, rising=True)
        if np.abs(np.log(m / last)).max() < SETTLED:
            break
    for step in range(FALLING):
        edited = applied(m)
        value = albedo_value(edited, ELEVATIONS, kept=kept)
        if (value <= ENOUGH).all():
            value = albedo_value(edited, WATCHED, kept=kept)
            if (value <= ENOUGH).all():
                return edited, m
        if colour:
            value = np.broadcast_to(value.max(axis=1, keepdims=True), value.shape)
        m = _balanced(m, value, near[len(value)], DAMPING * LONGER**step, rising=False)
    # Nets too coarse to tell elevations apart: the whole material.
    while (value := albedo_value(applied(m), WATCHED, kept=kept)).max() > ENOUGH:
        most = np.full(3, value.max()) if colour else value.max(axis=0)
        m = m * np.where(most > ENOUGH, np.sqrt(GOAL / most), 1.0)
    return applied(m), m


def _balanced(m: Floats, value: Floats, near: Floats, damping: float, *, rising: bool) -> Floats:
    """Return the next factors (n, 3) from the albedo (k, 3), where ``near`` (k, n) is how much they have to do."""
    with np.errstate(divide="ignore"):
        over = np.log(value / GOAL)
    over = np.where(value > ENOUGH, over, np.minimum(over, 0.0))
    move = (near[:, :, None] * np.maximum(over, 0.0)[:, None]).max(axis=0)
    if rising:
        room = np.where(near[:, :, None] > 0.5, over[:, None], -RISE).max(axis=0)
        move = np.where(move > 0, move, np.clip(room, -RISE, 0.0))
    return np.asarray(np.clip(m * np.exp(-damping * move), LEAST, 1.0))


def _influence(spline: TensorSpline, theta: Floats) -> Floats:
    """Return the basis functions (k, n) of axis 1 at elevations, divided by the largest of each."""
    values = collocation(spline.knots[1], spline.degrees[1], np.minimum(theta / HALF_PI, 1.0)).dense()
    return np.asarray(values / values.max(axis=1, keepdims=True))
