"""What no real material does, and models may: create energy, be negative, depend on which way light goes.

``check`` finds it, ``make_plausible`` repairs it with a small change of the net and says what it changed.
"""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from bvbedit.brdf.albedo import Albedo, albedo, albedo_value, check_spline_brdf
from bvbedit.brdf.charts import HALF_PI
from bvbedit.brdf.geometry import Bools, Floats, spherical
from bvbedit.brdf.repair import ELEVATIONS, ROUNDING, creates, dimmed, is_symmetric, lowest, raised, rounding
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.brdf.structure import largest_change, with_faces
from bvbedit.spline.compatible import combine, make_compatible
from bvbedit.spline.tensor import TensorSpline, assembled

__all__ = ["Albedo", "Plausibility", "Repair", "albedo", "check", "make_plausible"]

CHANNELS = ("red", "green", "blue")
# Pairs of directions by which reciprocity is measured, the highest elevation among them, and their seed.
PAIRS, HIGHEST, SEED = 4096, np.radians(80.0), 2
# Reflectance below this part of the mean of all pairs is compared as if it were that: it is rounding near zero.
DARKEST = 1e-6
# Raising makes brighter, dimming may leave something negative: they take turns, and after so many nothing below zero
# is left in the net.
TURNS = 4


@dataclass(frozen=True)
class Plausibility:
    """What a model does that no real material does. Angles are in degrees, encoded values are those before clamping."""

    largest_albedo: tuple[float, float, float]
    """Of each channel, over all elevations of wo."""
    largest_albedo_at: tuple[float, float, float]
    """theta_o of each."""
    albedo_error: tuple[float, float, float]
    """The error of the quadrature there."""
    creates_energy: tuple[tuple[float, float], ...]
    """Ranges of theta_o in which the albedo of a channel is above 1 by more than its error."""
    least_control: float
    """The least control point: no encoded value is below it (convex hull)."""
    lowest: float
    """The lowest encoded value, on a grid refined around it."""
    lowest_at: dict[str, float]
    """Where that is, in the angles of the chart."""
    negative: bool
    """Whether it is below zero by more than rounding."""
    reciprocal: bool
    """Whether exchanging light and viewer changes nothing: by the chart, or because the net is symmetric."""
    reciprocity_largest: float
    """|f(wi, wo) - f(wo, wi)| over the mean of both, the largest of pairs up to 80 degrees."""
    reciprocity_mean: float

    @property
    def plausible(self) -> bool:
        """Whether no energy is created and light may go either way; a negative spline only means no reflectance."""
        return not self.creates_energy and self.reciprocal

    def to_dict(self) -> dict[str, Any]:
        """Return the findings by name, as JSON can hold them."""
        return {name: _plain(value) for name, value in asdict(self).items()}

    def text(self) -> str:
        """Return the findings in one line for people."""
        c = int(np.argmax(self.largest_albedo))
        where = f"{CHANNELS[c]}, {self.largest_albedo_at[c]:.3g} degrees"
        energy = f"albedo at most {self.largest_albedo[c]:.4g} ({where}): "
        ranges = " and ".join(f"from {a:.3g} to {b:.3g}" for a, b in self.creates_energy)
        energy += f"energy is created {ranges} degrees" if ranges else "no energy is created"
        negative = "nowhere negative"
        if self.negative:
            places = ", ".join(f"{name} {angle:.3g}" for name, angle in self.lowest_at.items())
            negative = f"black where the spline is negative, down to {self.lowest:.2g} ({places} degrees)"
        exchanged = "reciprocal"
        if not self.reciprocal:
            exchanged = (
                f"not reciprocal, by {100 * self.reciprocity_mean:.2g} % in the mean, "
                f"{100 * self.reciprocity_largest:.2g} % at most"
            )
        return f"{energy}; {negative}; {exchanged}"


@dataclass(frozen=True)
class Repair:
    """What ``make_plausible`` changed."""

    largest_change: float
    """A bound of how far encoded values were moved."""
    albedo_before: tuple[float, float, float]
    """The largest of each channel over elevations."""
    albedo_after: tuple[float, float, float]
    elevations: tuple[float, ...]
    """Degrees at which the factors stand; between them they are linear."""
    factors: tuple[tuple[float, float, float], ...]
    """m of f m(theta_i) m(theta_o), for each channel; empty where no energy was created."""
    raised: int
    """Numbers of the net that were raised since they made something negative."""
    raised_most: float
    averaged: bool
    """Whether the net was averaged with its transpose, for reciprocity."""

    def to_dict(self) -> dict[str, Any]:
        """Return the changes by name, as JSON can hold them."""
        return {name: _plain(value) for name, value in asdict(self).items()}

    def text(self) -> str:
        """Return the changes in one line for people."""
        parts = []
        if self.factors:
            least = np.min(self.factors, axis=1)
            first = self.elevations[int(np.argmax(least < 1))]
            parts.append(
                f"albedo at most {max(self.albedo_before):.4g} before, {max(self.albedo_after):.4g} now: "
                f"factors down to {least.min():.3g}, from {first:.3g} degrees on"
            )
        if self.raised:
            parts.append(f"{self.raised} numbers of the net raised by up to {self.raised_most:.2g}")
        if self.averaged:
            parts.append("averaged with light and viewer exchanged")
        if not parts:
            return "nothing to repair"
        return "; ".join([*parts, f"encoded values change by {self.largest_change:.2g} at most"])


def check(model: SplineBrdf) -> Plausibility:
    """Return what ``model`` does that no real material does.

    Albedos every half degree, every tenth beyond 85. Raises BvbError for what is no SplineBrdf.
    """
    check_spline_brdf(model)
    seen = albedo(model, ELEVATIONS)
    degrees = np.degrees(ELEVATIONS)
    at = np.argmax(seen.value, axis=0)
    channels = np.arange(3)
    values, places = lowest(model.spline)
    c = int(np.argmin(values))
    angles = model.chart.angles(places[c])
    reciprocal = _is_reciprocal(model)
    apart, mean = (0.0, 0.0) if reciprocal else _apart(model)
    return Plausibility(
        largest_albedo=_three(seen.value[at, channels]),
        largest_albedo_at=_three(degrees[at]),
        albedo_error=_three(seen.error[at, channels]),
        creates_energy=_ranges(degrees, np.asarray(creates(seen.value, seen.error).any(axis=1))),
        least_control=float(model.spline.control.min()),
        lowest=float(values[c]),
        lowest_at={name: float(x) for name, x in zip(model.chart.axes, angles, strict=True)},
        negative=bool(values[c] < -rounding(model.spline)),
        reciprocal=reciprocal,
        reciprocity_largest=apart,
        reciprocity_mean=mean,
    )


def make_plausible(
    model: SplineBrdf, *, energy: bool = True, colour: bool = True, negative: bool = False, reciprocity: bool = True
) -> tuple[SplineBrdf, Repair]:
    """Return the model with what is asked for repaired by a small change, and what was changed.

    ``reciprocity``: an ``in-out`` net is averaged with its transpose, over common knots. ``energy``: f m(theta_i)
    m(theta_o) takes the place of f, with m <= 1 such that the albedo is at most 1; the same m for all channels if the
    ``colour`` is to stay. ``negative``: control points are raised towards zero where the spline is below it; not by
    default, for reflectance is zero there already, and where a net dives far below zero beside a mirror's peak, raising
    it changes the look by much. A model that needs nothing is returned as it is.
    Raises BvbError for what is no SplineBrdf, and for albedos beyond float64.
    """
    check_spline_brdf(model)
    edited = model
    averaged = reciprocity and not _is_reciprocal(model)
    if averaged:
        edited = with_faces(combine([model.spline, _exchanged(model.spline)], [0.5, 0.5]), model)
    factors = np.ones((edited.spline.size[1], 3))
    count, most, turn = 0, 0.0, 0
    while True:
        before = edited
        if negative:
            edited = raised(edited)
            if turn >= TURNS and edited.spline.control.min() < 0:
                edited = edited.with_spline(edited.spline.with_control(np.maximum(edited.spline.control, 0.0)))
            up = edited.spline.control - before.spline.control
            count, most = max(count, int(np.count_nonzero(up))), max(most, float(up.max()))
        if energy:
            edited, more = dimmed(edited, colour=colour)
            factors = factors * more
        if edited is before:
            break
        turn += 1
    was, now = (albedo_value(m, ELEVATIONS).max(axis=0) for m in (model, edited))
    scaled = bool((factors < 1).any())
    return edited, Repair(
        largest_change=0.0 if edited is model else largest_change(model, edited),
        albedo_before=_three(was),
        albedo_after=_three(now),
        elevations=tuple(np.degrees(HALF_PI * edited.spline.greville[1]).tolist()) if scaled else (),
        factors=tuple(_three(row) for row in factors) if scaled else (),
        raised=count,
        raised_most=most,
        averaged=averaged,
    )


def _exchanged(spline: TensorSpline) -> TensorSpline:
    """Return the spline with axes 0 and 1 exchanged."""
    (p, q, r), (s, t, w) = spline.degrees, spline.knots
    return assembled((q, p, r), (t, s, w), spline.control.transpose(1, 0, 2, 3))


def _is_reciprocal(model: SplineBrdf) -> bool:
    """Return whether exchanging light and viewer changes nothing, up to rounding."""
    if model.chart.reciprocal or is_symmetric(model.spline):
        return True
    (a, b), _ = make_compatible(model.spline, _exchanged(model.spline))
    return bool(np.abs(a.control - b.control).max() <= ROUNDING * np.abs(a.control).max())


def _apart(model: SplineBrdf) -> tuple[float, float]:
    """Return |f(wi, wo) - f(wo, wi)| over the mean of both, the largest and the mean over random pairs."""
    rng = np.random.default_rng(SEED)
    theta = np.arccos(rng.uniform(np.cos(HIGHEST), 1.0, (2, PAIRS)))
    wi, wo = spherical(theta[0], 0.0), spherical(theta[1], rng.uniform(0.0, 2 * np.pi, PAIRS))
    f, g = model.evaluate_unit(wi, wo)[0], model.evaluate_unit(wo, wi)[0]
    mean = 0.5 * (f + g)
    least = max(DARKEST * float(mean.mean()), np.finfo(np.float64).tiny)
    apart = np.abs(f - g) / np.maximum(mean, least)
    return float(apart.max()), float(apart.mean())


def _ranges(degrees: Floats, inside: Bools) -> tuple[tuple[float, float], ...]:
    """Return the first and the last of ``degrees`` of each run of true in ``inside``."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], inside, [False]]).astype(np.int8)))
    return tuple((float(degrees[a]), float(degrees[b - 1])) for a, b in edges.reshape(-1, 2))


def _three(values: Floats) -> tuple[float, float, float]:
    r, g, b = (float(v) for v in values)
    return r, g, b


def _plain(value: Any) -> Any:
    """Return ``value`` with lists for tuples."""
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items()}
    return [_plain(v) for v in value] if isinstance(value, tuple) else value
