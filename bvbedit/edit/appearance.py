"""Edits of the look: brighter, of another colour, sharper, smoother, brighter towards grazing."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from bvbedit.brdf.charts import HALF_DIFF, grid_points
from bvbedit.brdf.geometry import LUMINANCE, Floats
from bvbedit.brdf.plausibility import albedo
from bvbedit.brdf.spline_brdf import SplineBrdf, face_spread, keep_faces
from bvbedit.brdf.structure import FACE_ROUNDING, with_faces
from bvbedit.edit.operation import Edit
from bvbedit.edit.parameters import choice, number
from bvbedit.edit.parts import Part, body_of
from bvbedit.edit.region import Region
from bvbedit.edit.resampling import distance, resampled
from bvbedit.errors import BvbError
from bvbedit.spline.projection import projector
from bvbedit.spline.smoothing import smooth

Rgb = tuple[float, float, float]

LARGEST_GAIN = 1e6
PART = "the whole material, what depends on the half angle (highlight) or does not (body)"
# The least share of a colour's luminance that a channel may have after its hue was turned.
PUREST = 0.01
# Elevations over which the energy is averaged, weighted by cosine and solid angle.
ELEVATIONS = np.arcsin(np.sqrt((np.arange(12) + 0.5) / 12))


@dataclass(frozen=True, kw_only=True)
class Regional(Edit, Region):
    """An edit that may be confined to a region of angles."""

    def __post_init__(self) -> None:
        Edit.__post_init__(self)
        Region.__post_init__(self)


def scaled(model: SplineBrdf, factor: Floats) -> SplineBrdf:
    """Return the model times ``factor`` (n_0, n_1, n_2, 3 or 1), given at the Greville abscissae of its control points.

    Exact for a constant factor where the encoding is homogeneous; otherwise the reflectance is multiplied by the spline
    that has these control points, and resampled. Control points whose factor is 1 stay as they are.
    """
    spline, encoding = model.spline, model.encoding
    if encoding.homogeneous:
        return with_faces(spline.with_control(encoding.scaled(spline.control, factor)), model)
    factors = spline.with_control(np.broadcast_to(factor, spline.control.shape))

    def encoded(points: Floats) -> Floats:
        return encoding.scaled(spline.evaluate_inside(points), np.maximum(factors.evaluate_inside(points), 0.0))

    net = np.where(factors.control == 1, spline.control, resampled(model, encoded).spline.control)
    edited = with_faces(spline.with_control(net), model)
    return edited.told(refit_error=distance(edited, encoded))


def face_projection(model: SplineBrdf) -> Callable[[Floats], Floats]:
    """Return ``keep_faces`` where the model has constant degenerate faces, as all but the paper's plain fit have."""
    net = model.spline.control
    if face_spread(net, model.chart) <= FACE_ROUNDING * np.abs(net).max():
        return lambda net: keep_faces(net, model.chart)
    return lambda net: net


def recoloured(model: SplineBrdf, change: Floats, part: Part, region: Region) -> SplineBrdf:
    """Return the model with a part of it multiplied by a colour matrix ``change`` (3, 3) within a region."""
    body = None if part == "all" else body_of(model)

    def encoded(points: Floats) -> Floats:
        y = model.spline.evaluate_inside(points)
        f = model.encoding.decode(y)
        least = np.zeros_like(f) if body is None else np.minimum(body(points), f)
        changed = least if part == "body" else f - least
        weights = region.weights(model.chart, points)[:, None]
        wanted = in_gamut(f + weights * (changed @ change.T - changed), f)
        # What is black because the spline is below zero there stays below: cut off, it would ring.
        return model.encoding.encode(wanted) + np.minimum(y, 0.0)

    return resampled(model, encoded)


def in_gamut(f: Floats, before: Floats) -> Floats:
    """Return colours (n, 3) with no channel below a small share of the luminance: those that have one pale a little.

    Where ``before`` (n, 3) had a lower share it may stay, so that what was not changed is not paled.
    """
    grey, was = (np.maximum(c @ LUMINANCE, 0.0)[:, None] for c in (f, before))
    lowest = f.min(axis=1, keepdims=True)
    share = np.divide(before.min(axis=1, keepdims=True), was, out=np.zeros_like(was), where=was > 0)
    purest = np.minimum(PUREST, share)
    room = (1 - purest) * grey
    paled = grey + (f - grey) * np.divide(room, grey - lowest, out=np.zeros_like(room), where=grey > lowest)
    # Rounding must not pale what keeps its share.
    return np.asarray(np.where(lowest < (1 - 1e-12) * purest * grey, paled, f))


@dataclass(frozen=True, kw_only=True)
class Gain(Regional):
    """The reflectance times a factor."""

    op: Literal["gain"] = "gain"
    factor: float = number(0, LARGEST_GAIN, "how many times as bright")
    part: Part = choice(PART, default="all")
    about: ClassVar[str] = "brighter or darker, all of it, a part, or a region of angles"

    def apply(self, model: SplineBrdf) -> SplineBrdf:
        if self.part != "all":
            return recoloured(model, self.factor * np.eye(3), self.part, self)
        return scaled(model, 1 + (self.factor - 1) * self.net_weights(model)[..., None])


@dataclass(frozen=True, kw_only=True)
class Tint(Regional):
    """Another colour: a factor for each of R, G and B, or the hue turned and the saturation changed.

    Hue and saturation are the matrices that keep luminance and grey (W3C, Filter Effects, feColorMatrix).
    """

    op: Literal["tint"] = "tint"
    rgb: Rgb | None = number(0, LARGEST_GAIN, "factors of red, green and blue, linear", default=None)
    hue: float = number(-180, 180, "turn of the hue, from red to yellow to green", unit="degrees", default=0.0)
    saturation: float = number(0, 10, "0 is grey, 1 leaves the colour", default=1.0)
    part: Part = choice(PART, default="all")
    about: ClassVar[str] = "warmer, cooler, greyer, of another hue"

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.rgb is None) == (self.hue == 0 and self.saturation == 1):
            raise BvbError("tint needs rgb, or hue and saturation. Give one of the two ways.")

    def apply(self, model: SplineBrdf) -> SplineBrdf:
        if self.rgb is None:
            return recoloured(model, colour_matrix(self.hue, self.saturation), self.part, self)
        if self.part != "all":
            return recoloured(model, np.diag(self.rgb), self.part, self)
        return scaled(model, 1 + (np.array(self.rgb) - 1) * self.net_weights(model)[..., None])


def colour_matrix(hue: float, saturation: float) -> Floats:
    """Return the matrix (3, 3) that turns the hue by degrees and multiplies the saturation; grey stays, and luminance.

    The turn is about the grey axis in the plane of equal luminance, in which it is a rotation of chromaticities.
    """
    grey = np.outer(np.ones(3), LUMINANCE)
    # Two directions without luminance that are orthogonal to each other and span that plane.
    a = np.cross(LUMINANCE, np.ones(3))
    b = np.cross(a, LUMINANCE)
    basis = np.stack([np.ones(3), a / np.linalg.norm(a), b / np.linalg.norm(b)], axis=1)
    c, s = np.cos(np.radians(hue)), np.sin(np.radians(hue))
    turn = basis @ np.array([[1, 0, 0], [0, c, s], [0, -s, c]]) @ np.linalg.inv(basis)
    return np.asarray(grey + saturation * (turn - grey))


@dataclass(frozen=True, kw_only=True)
class Broaden(Edit):
    """A broader highlight, by a map of half angles: tan theta_h grows by ``factor``.

    That turns GGX or Beckmann lobes of roughness alpha into those of factor times alpha, but for their height, and for
    shadowing, which moves along: half-widths are within 5 % up to alpha 0.16, and 10 % off at alpha 0.375. In the
    half-diff chart the knots are moved along, so that the lobe is met as well as it was.
    """

    op: Literal["broaden"] = "broaden"
    factor: float = number(0.05, 20, "how many times as broad; below 1 sharper")
    keep_energy: bool = choice("whether the mean albedo stays", default=True)
    part: Part = choice(PART, default="all")
    about: ClassVar[str] = "a broader or sharper highlight"

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_highlight(self.part)

    def apply(self, model: SplineBrdf) -> SplineBrdf:
        body = None if self.part == "all" else body_of(model)
        gain = 1.0

        def encoded(points: Floats) -> Floats:
            moved = self._moved(model, points)
            y = model.spline.evaluate_inside(moved)
            if body is None:
                return y
            highlight = np.maximum(model.encoding.decode(y) - body(moved), 0.0)
            return model.encoding.encode(body(points) + gain * highlight)

        knots = list(model.spline.knots)
        if model.chart is HALF_DIFF:
            # The mapped half angle of a knot is where the old one was.
            knots[0] = _mapped(knots[0], self.factor)
        edited = resampled(model, encoded, knots)
        if not self.keep_energy:
            return edited
        below = 0.0
        if body is not None:
            below = _energy(resampled(model, lambda points: model.encoding.encode(body(points))))
        before, after = _energy(model) - below, _energy(edited) - below
        # One factor for all channels: the highlight keeps its colour.
        gain = before / after if before > 0 and after > 0 else 1.0
        if body is None:
            error = edited.report["refit_error"]
            kept = scaled(edited, np.full((1, 1, 1, 1), gain))
            return kept.told(refit_error=error, notes=[f"times {gain:.3g}, to keep the mean albedo"])
        note = f"the highlight times {gain:.3g}, to keep the mean albedo"
        return resampled(model, encoded, knots).told(notes=[note])

    def _moved(self, model: SplineBrdf, points: Floats) -> Floats:
        """Return the parameters whose values come to stand at ``points``."""
        halves = (
            points.copy() if model.chart is HALF_DIFF else HALF_DIFF.to_parameters(*model.chart.to_directions(points))
        )
        halves[:, 0] = _mapped(halves[:, 0], 1 / self.factor)
        if model.chart is HALF_DIFF:
            return halves
        return model.chart.to_parameters(*HALF_DIFF.to_directions(halves))


def _energy(model: SplineBrdf) -> float:
    """Return the luminance of the mean albedo."""
    return float(albedo(model, ELEVATIONS).value.mean(axis=0) @ LUMINANCE)


def _check_highlight(part: Part) -> None:
    if part == "body":
        raise BvbError("The body has no highlight to broaden or sharpen. Choose part all or highlight.")


def _mapped(u: Floats, factor: float) -> Floats:
    """Return u = sqrt(theta_h / (pi/2)) after tan theta_h has grown by ``factor``; 0 and 1 stay."""
    theta = np.pi / 2 * u * u
    mapped = np.sqrt(np.clip(np.arctan2(factor * np.sin(theta), np.cos(theta)) / (np.pi / 2), 0.0, 1.0))
    # The cosine of pi/2 is rounded.
    return np.asarray(np.where(u == 1, 1.0, mapped))


@dataclass(frozen=True, kw_only=True)
class Sharpen(Edit):
    """A sharper highlight: ``broaden`` by one over the factor."""

    op: Literal["sharpen"] = "sharpen"
    factor: float = number(0.05, 20, "how many times as sharp")
    keep_energy: bool = choice("whether the mean albedo stays", default=True)
    part: Part = choice(PART, default="all")
    about: ClassVar[str] = "a sharper highlight"

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_highlight(self.part)

    def apply(self, model: SplineBrdf) -> SplineBrdf:
        return Broaden(factor=1 / self.factor, keep_energy=self.keep_energy, part=self.part).apply(model)


@dataclass(frozen=True, kw_only=True)
class RaiseGrazing(Edit):
    """Brighter towards grazing difference angles, as Fresnel reflection is: times 1 + amount (1 - cos theta_d)^power.

    Source of the form: Schlick, "An inexpensive BRDF model for physically-based rendering", 1994.
    """

    op: Literal["raise_grazing"] = "raise_grazing"
    amount: float = number(-1, 1000, "by how much at 90 degrees: 1 doubles, -1 makes black")
    power: float = number(0.5, 20, "5 as Fresnel's, less reaches farther from grazing", default=5.0)
    about: ClassVar[str] = "a brighter or darker edge"

    def apply(self, model: SplineBrdf) -> SplineBrdf:
        spline, encoding = model.spline, model.encoding

        def factor(points: Floats) -> Floats:
            if model.chart is not HALF_DIFF:
                points = HALF_DIFF.to_parameters(*model.chart.to_directions(points))
            theta_d = np.radians(HALF_DIFF.angles(points)[:, 1])
            return np.asarray(1 + self.amount * (1 - np.cos(theta_d)) ** self.power)[:, None]

        points = np.clip(grid_points(tuple(spline.greville)), 0.0, 1.0)
        edited = scaled(model, factor(points).reshape(*spline.size, 1))
        missed = distance(edited, lambda p: encoding.scaled(spline.evaluate_inside(p), factor(p)))
        return edited.told(refit_error=missed)


@dataclass(frozen=True, kw_only=True)
class Denoise(Regional):
    """A smoother net: second differences of control points are penalised (Eilers & Marx 1996)."""

    op: Literal["denoise"] = "denoise"
    strength: float = number(0, 1e6, "weight of the penalty; at 1 data and penalty count alike", default=0.1)
    about: ClassVar[str] = "smoother, by a penalty on the curvature of the net"

    def apply(self, model: SplineBrdf) -> SplineBrdf:
        spline = model.spline
        weights = self.net_weights(model)[..., None]
        axes = [projector(t, p)[0] for t, p in zip(spline.knots, spline.degrees, strict=True)]
        values = spline.evaluate_grid(axes)
        result, _ = smooth(
            values,
            np.ones(values.shape[:-1]),
            axes,
            spline.knots,
            spline.degrees,
            strength=self.strength,
            project=face_projection(model),
        )
        net = spline.control + weights * (result.spline.control - spline.control)
        return with_faces(spline.with_control(net), model)
