"""Edits with a partner or a target: another material mixed in, values put where they are wanted, physics restored."""

from dataclasses import dataclass
from os import fspath
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np

from bvbedit.brdf.blend import SPACES, blend
from bvbedit.brdf.geometry import Floats, spherical
from bvbedit.brdf.plausibility import make_plausible
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.edit.appearance import Regional, Rgb, face_projection
from bvbedit.edit.operation import Edit
from bvbedit.edit.parameters import choice, number
from bvbedit.edit.resampling import Encoded, resampled
from bvbedit.errors import BvbError
from bvbedit.io import load
from bvbedit.spline.compatible import make_compatible
from bvbedit.spline.sculpting import move_points

LARGEST_REFLECTANCE = 1e5
# A refit that misses less is hard to tell from what was wanted.
SEEN = 0.01


@dataclass(frozen=True, kw_only=True)
class Blend(Regional):
    """A share of another material, everywhere or in a region."""

    op: Literal["blend"] = "blend"
    partner: Path = choice("the .bvb file of the other material")
    t: float | Rgb = number(-1000, 1000, "share of the partner, or one for each of red, green and blue")
    space: Literal["auto", "net", "linear", "log"] = choice(
        "what is mixed: control points (net), reflectance (linear) or its logarithm (log); auto is net where both nets "
        "are alike and all is mixed, else linear",
        default="auto",
    )
    about: ClassVar[str] = "a hint of another material, or all of it"

    def with_partner(self) -> SplineBrdf:
        """Return the partner. Raises BvbError where the file holds no model."""
        other = load(self.partner)
        if not isinstance(other, SplineBrdf):
            raise BvbError(f"{self.partner} is a measurement, not a model. Fit it first.")
        return other

    def apply(self, model: SplineBrdf) -> SplineBrdf:
        other = self.with_partner()
        alike = model.chart is other.chart and model.encoding == other.encoding
        space = ("net" if alike and self.everywhere else "linear") if self.space == "auto" else self.space
        exact = space == "net" or (alike and model.encoding == SPACES[space])
        if self.everywhere and exact:
            return blend(model, other, self.t, space)
        if space == "net" and not alike:
            raise BvbError("The nets are of other charts or encodings and cannot be mixed. Choose space linear or log.")
        # Over the knots of both, that the partner's highlight is met as well; in another chart they mean nothing.
        united = make_compatible(model.spline, other.spline)[0][0] if model.chart is other.chart else model.spline
        mixed = resampled(model.with_spline(united), self._mixture(model, other, space))
        if model.chart is other.chart or mixed.report["refit_error"] <= SEEN:
            return mixed
        note = (
            f"{self.partner.name} is in chart {other.chart.name}, and what is sharp in it is lost between the knots of "
            f"this net in {model.chart.name}: fit one of the two in the chart of the other, then blend"
        )
        return mixed.told(notes=[note])

    def _mixture(self, model: SplineBrdf, other: SplineBrdf, space: str) -> Encoded:
        """Return the encoded values (n, 3) of the mixture at parameters (n, 3) of the model's chart."""
        between = SPACES[space] or model.encoding

        def encoded(points: Floats) -> Floats:
            y = model.spline.evaluate_inside(points)
            if model.chart is other.chart:
                partner = other.encoding.decode(other.spline.evaluate_inside(points))
            else:
                partner = other.evaluate_unit(*model.chart.to_directions(points))[0]
            share = self.weights(model.chart, points)[:, None] * np.atleast_1d(np.asarray(self.t, dtype=np.float64))
            a, b = between.encode(model.encoding.decode(y)), between.encode(partner)
            mixed = model.encoding.encode(between.decode((1 - share) * a + share * b))
            # Where nothing is mixed in, and the spline is below zero, it stays.
            return np.where(share == 0, y, mixed + np.minimum(y, 0.0) * np.clip(1 - share, 0.0, 1.0))

        return encoded

    def to_dict(self) -> dict[str, object]:
        return {**super().to_dict(), "partner": fspath(self.partner)}


@dataclass(frozen=True, kw_only=True)
class MovePoints(Edit):
    """Reflectance put where it is wanted: the least change of the net that brings it there (Bartels & Beatty 1989)."""

    op: Literal["move_points"] = "move_points"
    at: tuple[tuple[float, ...], ...] | tuple[float, ...] = number(
        0, 180, "theta_i, theta_o and phi of each place", unit="degrees"
    )
    rgb: tuple[tuple[float, ...], ...] | tuple[float, ...] = number(
        0, LARGEST_REFLECTANCE, "reflectance there", unit="1/sr"
    )
    about: ClassVar[str] = "as bright as wanted in chosen places"

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("at", "rgb"):
            given = getattr(self, name)
            rows = given if given and isinstance(given[0], tuple) else (given,)
            object.__setattr__(self, name, rows)
            if not all(isinstance(row, tuple) and len(row) == 3 for row in rows):
                raise BvbError(f"{name} is {given}. Give three numbers for each place.")
        if len(self.at) != len(self.rgb):
            raise BvbError(f"{len(self.at)} places and {len(self.rgb)} values given. Give one value for each place.")
        if any(max(place[:2]) > 90 for place in self.at):  # type: ignore[index]
            raise BvbError("theta_i and theta_o go up to 90 degrees. Give smaller ones.")

    def apply(self, model: SplineBrdf) -> SplineBrdf:
        theta_i, theta_o, phi = np.radians(np.array(self.at)).T
        points = model.chart.to_parameters(spherical(theta_i, 0.0), spherical(theta_o, phi))
        targets = model.encoding.encode(np.array(self.rgb))
        return model.with_spline(move_points(model.spline, points, targets, project=face_projection(model)))


@dataclass(frozen=True, kw_only=True)
class MakePlausible(Edit):
    """The least change that repairs what no real material does. See ``brdf.plausibility``."""

    op: Literal["make_plausible"] = "make_plausible"
    energy: bool = choice("no more light leaves than arrives", default=True)
    colour: bool = choice("all channels by the same factor, so that the colour stays", default=True)
    negative: bool = choice("raise the net where it is below zero and reflectance is zero", default=False)
    reciprocity: bool = choice("the same in both directions", default=True)
    about: ClassVar[str] = "no more light than arrives, the same in both directions"

    def apply(self, model: SplineBrdf) -> SplineBrdf:
        edited, repair = make_plausible(
            model, energy=self.energy, colour=self.colour, negative=self.negative, reciprocity=self.reciprocity
        )
        return edited.told(notes=[repair.text()])
