"""Models put together: weighted sums, and a clear coat over a base."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bvbedit.brdf.analytic.common import Analytic, Colour, Pair, colour, number
from bvbedit.brdf.analytic.densities import Mixture
from bvbedit.brdf.analytic.microfacet import GGX
from bvbedit.brdf.density import Density
from bvbedit.brdf.geometry import Floats
from bvbedit.errors import BvbError
from bvbedit.spline.arguments import shown


@dataclass(frozen=True)
class Sum(Analytic):
    """f = the sum of the parts, each times its weight (one number or RGB; 1 where no weights are given).

    Raises BvbError for no parts, parts that are not analytic, weights of another number or outside [0, 1000].
    """

    parts: Sequence[Analytic]
    weights: Sequence[Colour] | None = None

    def __post_init__(self) -> None:
        parts = _models("Sum", self.parts)
        try:
            weights = (1.0,) * len(parts) if self.weights is None else tuple(self.weights)
        except TypeError:
            weights = ()
        if len(weights) != len(parts):
            raise BvbError(f"Sum: {len(weights)} weights for {len(parts)} parts. Give one weight to each part.")
        object.__setattr__(self, "parts", parts)
        object.__setattr__(
            self, "weights", tuple(colour("Sum", f"weights[{i}]", w, 0.0, 1000.0) for i, w in enumerate(weights))
        )

    @property
    def density(self) -> Density:
        used = [part.density for part, w in zip(self.parts, self.weights or (), strict=True) if np.any(w)]
        return Mixture(used or [part.density for part in self.parts])

    def reflectance(self, pair: Pair) -> Floats:
        f = np.zeros((len(pair), 3))
        for part, weight in zip(self.parts, self.weights or (), strict=True):
            f += part.reflectance(pair) * np.asarray(weight)
        return f


@dataclass(frozen=True)
class Coated(Analytic):
    """A base seen through a clear coat: f = cover f_coat + T(theta_i) T(theta_o) f_base(wi', wo') / bend^2.

    ``coat`` is the rough outer face, T = 1 - cover F_coat(theta) what passes through it, once inwards and once
    outwards, and ``cover`` in [0, 1] the share of the surface that is coated. ``bend`` is the refractive index by which
    the directions wi', wo' inside are bent (Snell): 1 leaves them, and a lobe of the base its shape; 1.5 is a real
    varnish, under which a lobe is wider and grows less towards grazing. The division by bend^2 is the change of solid
    angle, with which the base sends out no more than it does uncoated; light that the coat throws back inside is lost.
    A reduced form of Weidlich & Wilkie, "Arbitrarily layered micro-facet surfaces", GRAPHITE 2007.
    Raises BvbError for a base that is not analytic, a coat that is not GGX, cover outside [0, 1], bend outside [1, 3].
    """

    base: Analytic
    coat: GGX
    cover: float = 1.0
    bend: float = 1.0

    def __post_init__(self) -> None:
        _models("Coated", [self.base])
        if not isinstance(self.coat, GGX):
            raise BvbError(f"Coated: coat is {shown(self.coat)}. Give a GGX.")
        object.__setattr__(self, "cover", number("Coated", "cover", self.cover, 0.0, 1.0))
        object.__setattr__(self, "bend", number("Coated", "bend", self.bend, 1.0, 3.0))

    @property
    def density(self) -> Density:
        return Mixture([self.base.density, self.coat.density])

    def reflectance(self, pair: Pair) -> Floats:
        passed_in = 1 - self.cover * self.coat.fresnel(pair.cos_i)
        passed_out = 1 - self.cover * self.coat.fresnel(pair.cos_o)
        f = self.base.reflectance(pair if self.bend == 1 else pair.refracted(self.bend))
        f *= passed_in * passed_out / self.bend**2
        f += self.cover * self.coat.reflectance(pair)
        return f


def _models(model: str, parts: object) -> tuple[Analytic, ...]:
    found = tuple(parts) if isinstance(parts, Sequence) else ()
    if not found or not all(isinstance(part, Analytic) for part in found):
        raise BvbError(f"{model}: {shown(parts)} are not analytic BRDFs. Give Lambert, GGX, Ward and the like.")
    return found
