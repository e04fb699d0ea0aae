"""The analytic models as a fit sees them: lobes of shape parameters, scaled so that a search takes even steps in them.

f = diffuse/pi + the sum over lobes of specular S(shape), diffuse and specular RGB, as Ngan, Durand & Matusik,
"Experimental Analysis of BRDF Models", EGSR 2005, fitted them. S is that of the classes in ``bvbedit.brdf.analytic``.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import ClassVar

import numpy as np

from bvbedit.brdf.analytic import (
    GGX,
    Analytic,
    BlinnPhong,
    CookTorrance,
    CosineLobe,
    Lafortune,
    Lambert,
    Schlick,
    Sum,
    Ward,
)
from bvbedit.brdf.analytic.common import Pair
from bvbedit.brdf.geometry import Floats
from bvbedit.errors import BvbError
from bvbedit.spline.arguments import shown

Rgb = tuple[float, float, float]

# Widths of lobes (alpha, m; the root mean square slope but for a factor). Narrower ones than the least, a tenth of
# MERL's first half angle, fall between all samples.
WIDTHS = (1e-3, 1.5)
# Reflectance at normal incidence, as a share of that towards grazing.
F0 = (1e-3, 1.0)
# How much brighter (logarithm) a cosine lobe of Lafortune's is towards grazing than at normal incidence.
GROWTH = (-4.5, 4.5)


@dataclass(frozen=True)
class Lobe(ABC):
    """A lobe S of some shape parameters. ``x`` are these in the scale of a search: logarithms."""

    names: ClassVar[tuple[str, ...]]
    """Of the shape parameters, as the class that evaluates them has them."""

    @property
    @abstractmethod
    def bounds(self) -> tuple[Floats, Floats]:
        """The least and the largest ``x``."""

    @abstractmethod
    def start(self, theta: float, growth: float) -> Floats:
        """Return ``x`` of a lobe that falls to half its height at theta_h = ``theta`` (radians).

        ``growth`` in [0, 1] is how little it grows towards grazing.
        """

    @abstractmethod
    def lobe(self, pair: Pair, x: Floats) -> Floats:
        """Return S (n,) in 1/sr for specular albedo one."""

    @abstractmethod
    def values(self, x: Floats) -> tuple[float, ...]:
        """Return the shape parameters by their names."""

    @abstractmethod
    def model(self, diffuse: Rgb, specular: Rgb, x: Floats) -> Analytic:
        """Return a BRDF of this lobe over a diffuse part."""

    @abstractmethod
    def width(self, x: Floats) -> float:
        """Return a number that grows with the width, by which lobes are put in order."""


def _bounds(*each: tuple[float, float]) -> tuple[Floats, Floats]:
    low, high = np.log(each).T
    return low, high


@dataclass(frozen=True)
class BlinnPhongLobe(Lobe):
    """cos^n theta_h."""

    names = ("n",)

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        return _bounds((2 / WIDTHS[1] ** 2, 2 / WIDTHS[0] ** 2))

    def start(self, theta: float, _growth: float) -> Floats:
        return np.log([-math.log(2) / math.log(math.cos(theta))])

    def lobe(self, pair: Pair, x: Floats) -> Floats:
        return BlinnPhong(1.0, math.exp(x[0])).lobe(pair)

    def values(self, x: Floats) -> tuple[float, ...]:
        return (math.exp(x[0]),)

    def model(self, diffuse: Rgb, specular: Rgb, x: Floats) -> Analytic:
        return BlinnPhong(specular, math.exp(x[0]), diffuse)

    def width(self, x: Floats) -> float:
        return float(-x[0])


@dataclass(frozen=True)
class WardLobe(Lobe):
    """Ward's Gaussian of slopes, with bounded albedo."""

    names = ("alpha",)

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        return _bounds(WIDTHS)

    def start(self, theta: float, _growth: float) -> Floats:
        return np.log([math.tan(theta) / math.sqrt(math.log(2))])

    def lobe(self, pair: Pair, x: Floats) -> Floats:
        return Ward(1.0, math.exp(x[0])).lobe(pair)

    def values(self, x: Floats) -> tuple[float, ...]:
        return (math.exp(x[0]),)

    def model(self, diffuse: Rgb, specular: Rgb, x: Floats) -> Analytic:
        return Ward(specular, math.exp(x[0]), diffuse)

    def width(self, x: Floats) -> float:
        return float(x[0])


@dataclass(frozen=True)
class LafortuneLobe(Lobe):
    """(c_xy (wi.x wo.x + wi.y wo.y) + c_z wi.z wo.z)^n, to which ``side`` it points: -1 forward, 1 to the light.

    The search knows it by n and by n log |c_xy/c_z|, the logarithm of how much brighter it is towards grazing: c_xy/c_z
    itself moves by 1/n only. ``specular`` is its albedo at normal incidence for c_xy = -c_z: c_z^n = specular (n +
    2)/(2 pi).
    """

    side: float = -1.0
    names = ("n", "ratio")

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        # An angle from h is half of that from the mirror direction.
        low, high = _bounds((1.0, 0.5 / WIDTHS[0] ** 2))
        return np.append(low, GROWTH[0]), np.append(high, GROWTH[1])

    def start(self, theta: float, growth: float) -> Floats:
        return np.array([math.log(-math.log(2) / math.log(math.cos(min(2 * theta, 1.5)))), 2 - 2 * growth])

    def lobe(self, pair: Pair, x: Floats) -> Floats:
        n, ratio = self.values(x)
        base = np.maximum(ratio * pair.horizontal + pair.cos_i * pair.cos_o, 1e-300)
        return np.asarray((n + 2) / (2 * np.pi) * np.exp(n * np.log(base)))

    def values(self, x: Floats) -> tuple[float, ...]:
        n = math.exp(x[0])
        return n, self.side * math.exp(x[1] / n)

    def model(self, diffuse: Rgb, specular: Rgb, x: Floats) -> Analytic:
        n, ratio = self.values(x)
        c_z = tuple((s * (n + 2) / (2 * math.pi)) ** (1 / n) for s in specular)
        return Lafortune([CosineLobe(tuple(ratio * c for c in c_z), c_z, n)], diffuse)

    def width(self, x: Floats) -> float:
        return float(-x[0])


@dataclass(frozen=True)
class CookTorranceLobe(Lobe):
    """Beckmann's facets times Schlick's Fresnel term of one f0 for all channels."""

    names = ("m", "f0")

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        return _bounds(WIDTHS, F0)

    def start(self, theta: float, growth: float) -> Floats:
        return np.log([math.tan(theta) / math.sqrt(math.log(2)), 0.04 ** (1 - growth)])

    def lobe(self, pair: Pair, x: Floats) -> Floats:
        m, f0 = self.values(x)
        fresnel = Schlick(f0)
        return np.asarray(CookTorrance(m, fresnel).facets(pair) * _schlick(pair, f0))

    def values(self, x: Floats) -> tuple[float, ...]:
        return math.exp(x[0]), min(math.exp(x[1]), 1.0)

    def model(self, diffuse: Rgb, specular: Rgb, x: Floats) -> Analytic:
        m, f0 = self.values(x)
        return CookTorrance(m, Schlick(f0), specular, diffuse)

    def width(self, x: Floats) -> float:
        return float(x[0])


@dataclass(frozen=True)
class GGXLobe(Lobe):
    """GGX facets times Schlick's Fresnel term of one f0 for all channels."""

    names = ("alpha", "f0")

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        return _bounds(WIDTHS, F0)

    def start(self, theta: float, growth: float) -> Floats:
        return np.log([math.tan(theta) / math.sqrt(math.sqrt(2) - 1), 0.04 ** (1 - growth)])

    def lobe(self, pair: Pair, x: Floats) -> Floats:
        alpha, f0 = self.values(x)
        return np.asarray(GGX(alpha, Schlick(f0)).facets(pair) * _schlick(pair, f0))

    def values(self, x: Floats) -> tuple[float, ...]:
        return math.exp(x[0]), min(math.exp(x[1]), 1.0)

    def model(self, diffuse: Rgb, specular: Rgb, x: Floats) -> Analytic:
        alpha, f0 = self.values(x)
        return Sum([Lambert(diffuse), GGX(alpha, Schlick(f0))], [1.0, specular])

    def width(self, x: Floats) -> float:
        return float(x[0])


def _schlick(pair: Pair, f0: float) -> Floats:
    """Return Schlick's F (n,) of one channel."""
    rest = 1 - pair.cos_d
    squared = rest * rest
    return np.asarray(f0 + (1 - f0) * squared * squared * rest)


@dataclass(frozen=True)
class Parametric:
    """A model to fit: a diffuse part and lobes of one kind. ``others`` are what the last lobe may also be."""

    name: str
    lobes: tuple[Lobe, ...]
    others: tuple[Lobe, ...] = ()

    @cached_property
    def parameter_count(self) -> int:
        """How many numbers make a material: three for each colour, and the shape parameters."""
        return 3 + sum(3 + len(lobe.names) for lobe in self.lobes)

    def forms(self) -> tuple[tuple[Lobe, ...], ...]:
        """Return the rows of lobes that a search may start with."""
        return (self.lobes, *((*self.lobes[:-1], other) for other in self.others))


def assembled(lobes: Sequence[Lobe], colours: Floats, x: Sequence[Floats]) -> tuple[Analytic, dict[str, float]]:
    """Return the BRDF and the parameters by name of ``colours`` (1 + lobes, 3) and shapes; the narrowest lobe first."""
    rgb: list[Rgb] = [(float(r), float(g), float(b)) for r, g, b in colours]
    order = sorted(range(len(lobes)), key=lambda k: (lobes[k].width(x[k]), k))
    parameters = _named("diffuse", rgb[0])
    parts: list[Analytic] = []
    for place, k in enumerate(order):
        suffix = f"_{place + 1}" if len(order) > 1 else ""
        parameters |= _named(f"specular{suffix}", rgb[1 + k])
        parameters |= {f"{n}{suffix}": v for n, v in zip(lobes[k].names, lobes[k].values(x[k]), strict=True)}
        # The diffuse part goes with the first lobe.
        parts.append(lobes[k].model((0.0, 0.0, 0.0) if place else rgb[0], rgb[1 + k], x[k]))
    return parts[0] if len(parts) == 1 else Sum(parts), parameters


def _named(name: str, colour: Rgb) -> dict[str, float]:
    return {f"{name}_{channel}": value for channel, value in zip("rgb", colour, strict=True)}


_KINDS: dict[str, tuple[Lobe, tuple[Lobe, ...]]] = {
    "blinn-phong": (BlinnPhongLobe(), ()),
    "ward": (WardLobe(), ()),
    "lafortune": (LafortuneLobe(), (LafortuneLobe(side=1.0),)),
    "cook-torrance": (CookTorranceLobe(), ()),
    "ggx": (GGXLobe(), ()),
}

MODELS: Mapping[str, Parametric] = MappingProxyType(
    {
        name: Parametric(name, (lobe,) * count, others)
        for count in (1, 2)
        for name, (lobe, others) in ((kind if count == 1 else f"{kind} {count}", of) for kind, of in _KINDS.items())
    }
)
"""The models to fit by name; "... 2" has two lobes of the kind."""


def model_to_fit(name: str) -> Parametric:
    """Return the model called ``name``. Raises BvbError that lists the names where there is none."""
    if not isinstance(name, str) or name not in MODELS:
        raise BvbError(f"Unknown model {shown(name)}. Choose one of {', '.join(MODELS)}.")
    return MODELS[name]
