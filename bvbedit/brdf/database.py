"""A generated database: as many different materials as a study wants, each a few numbers drawn from a stated law.

Material k of a seed depends on these two numbers alone, however many are asked for. Its name, like "db-017-glossy",
says which it is, so that it need not be kept anywhere.

Finish (the width alpha of its lobe): of each twenty materials about 7 are matte (0.25 ... 0.7), 8 glossy (0.05 ...
0.25), 5 mirror-like (0.006 ... 0.05), evenly in log alpha. Kind, by finish: dielectric (a diffuse body under a rough
interface of index 1.3 ... 1.7), conductor (GGX or Beckmann facets; half of them with a haze of 5 to 30 % that is 2.5
to 6 times broader), coated (flakes or a diffuse body, or both, under a clear coat that covers 30 to 100 % of it).
Colour: hue evenly, saturation 0 ... 0.95, brightness 0.02 ... 0.85 evenly in its logarithm; of metals the usual warm
tints. Noise of the measurement: 0.3 to 5 %, evenly in its logarithm.
"""

import colorsys
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal, TypeVar, get_args

import numpy as np

from bvbedit.brdf.analytic import GGX, Analytic, Coated, CookTorrance, ExactFresnel, Lambert, Schlick, Sum
from bvbedit.brdf.goniophotometer import measure
from bvbedit.brdf.materials import Material
from bvbedit.brdf.measured import MeasuredBrdf
from bvbedit.errors import BvbError
from bvbedit.spline.arguments import is_whole, shown

T = TypeVar("T")
Finish = Literal["matte", "glossy", "mirror"]
Kind = Literal["dielectric", "conductor", "coated"]

FINISHES: Mapping[Finish, tuple[float, tuple[float, float], tuple[float, float, float]]] = MappingProxyType(
    {
        "matte": (0.35, (0.25, 0.7), (0.80, 0.08, 0.12)),
        "glossy": (0.40, (0.05, 0.25), (0.45, 0.30, 0.25)),
        "mirror": (0.25, (0.006, 0.05), (0.25, 0.50, 0.25)),
    }
)
"""Share of the materials, alpha from and to, and the shares of dielectrics, conductors and coated ones."""
NOISE = (0.003, 0.05)
MOST = 1000
# Steps of the golden section cover the shares evenly: of any hundred in a row each finish has its share to within two.
GOLDEN = (np.sqrt(5) - 1) / 2

_NAME = re.compile(r"db(\d{0,9})-(\d{3})(?:-([a-z]+))?")


@dataclass(frozen=True)
class Generated(Material):
    """A material of the database, and how it is measured."""

    noise: float = 0.0
    """Relative standard deviation of the readings."""
    noise_seed: int = 0
    finish: Finish = "matte"
    kind: Kind = "dielectric"
    alpha: float = 0.0
    """Width of its lobe; of a coated one, that of the coat."""

    def measured(self, grid: str = "merl") -> MeasuredBrdf:
        """Return its measurement, the same each time: ``measure`` with its own noise and seed."""
        return measure(self.brdf, grid, self.noise, self.noise_seed)


def database(count: int = 100, seed: int = 0) -> Mapping[str, Generated]:
    """Return ``count`` generated materials by name, in order.

    Raises BvbError for a count that is no whole number in 1 ... 1000 or a seed that is none in 0 ... 999999999.
    """
    if not is_whole(count) or not 1 <= count <= MOST:
        raise BvbError(f"count is {shown(count)}. Give a whole number in 1 ... {MOST}.")
    _check_seed(seed)
    return MappingProxyType({m.name: m for m in (_material(k, int(seed)) for k in range(count))})


def is_generated(name: object) -> bool:
    """Return whether ``name`` has the form of a name in the database, whether or not there is one."""
    return isinstance(name, str) and _NAME.fullmatch(name) is not None


def generated(name: str) -> Generated:
    """Return the material called ``name``, like "db-017-glossy", "db-017" for short, or "db5-017" for seed 5.

    Raises BvbError for another name, and one that has another finish.
    """
    match = _NAME.fullmatch(name) if isinstance(name, str) else None
    if match is None:
        raise BvbError(f"Unknown material {shown(name)}. In the database names are like db-017.")
    seed, k, finish = match.groups()
    found = _material(int(k), int(seed or 0))
    if finish not in (None, found.finish):
        raise BvbError(f"Unknown material {shown(name)}. That number is {found.name}.")
    return found


def _check_seed(seed: object) -> None:
    if not is_whole(seed) or not 0 <= seed < 10**9:
        raise BvbError(f"seed is {shown(seed)}. Give a whole number in 0 ... 999999999.")


def _material(k: int, seed: int) -> Generated:
    draw = _Draw(np.random.Generator(np.random.PCG64([seed, k])))
    # The seed turns the sequence, so that another one does not give each number the same finish.
    place = (0.5 + (k + 1) * GOLDEN + seed * np.sqrt(2)) % 1.0
    finish: Finish = _by_share(place, [(name, law[0]) for name, law in FINISHES.items()])
    _, widths, shares = FINISHES[finish]
    kind: Kind = _by_share(draw.between(0, 1), list(zip(get_args(Kind), shares, strict=True)))
    alpha = draw.evenly_in_log(*widths)
    make = {"dielectric": _dielectric, "conductor": _conductor, "coated": _coated}[kind]
    brdf, words = make(draw, alpha)
    name = f"db{seed or ''}-{k:03d}-{finish}"
    noise = draw.evenly_in_log(*NOISE)
    described = f"Generated: {finish} {kind}, {words}, alpha {alpha:.3g}, noise {100 * noise:.2g} %"
    return Generated(name, described, brdf, noise, 1000 * seed + k, finish, kind, alpha)


@dataclass
class _Draw:
    """Random numbers, one after the other."""

    generator: np.random.Generator

    def between(self, low: float, high: float) -> float:
        return float(low + (high - low) * self.generator.random())

    def evenly_in_log(self, low: float, high: float) -> float:
        return float(np.exp(self.between(np.log(low), np.log(high))))

    def colour(self) -> tuple[float, float, float]:
        """Return a diffuse albedo."""
        hue, saturation, value = self.between(0, 1), self.between(0, 0.95), self.evenly_in_log(0.02, 0.85)
        return colorsys.hsv_to_rgb(hue, saturation, value)

    def metal(self) -> tuple[float, float, float]:
        """Return a reflectance at normal incidence: grey to gold and copper, the blue darkest."""
        red, warmth = self.between(0.45, 0.97), self.between(0, 1) ** 2
        green = red * (1 - self.between(0.15, 0.5) * warmth)
        return red, green, green * (1 - 0.6 * warmth)


def _by_share(place: float, shares: Sequence[tuple[T, float]]) -> T:
    edges = np.cumsum([share for _, share in shares])
    return shares[min(int(np.searchsorted(edges, place, side="right")), len(shares) - 1)][0]


def _dielectric(draw: _Draw, alpha: float) -> tuple[Analytic, str]:
    colour, eta = draw.colour(), draw.between(1.3, 1.7)
    return Coated(Lambert(colour), GGX(alpha, ExactFresnel(eta))), f"body {_shown(colour)}, index {eta:.3g}"


def _conductor(draw: _Draw, alpha: float) -> tuple[Analytic, str]:
    colour = draw.metal()
    fresnel, beckmann, hazy = Schlick(colour), draw.between(0, 1) < 0.4, draw.between(0, 1) < 0.5
    share, factor = draw.evenly_in_log(0.05, 0.3), draw.between(2.5, 6)
    lobe: Analytic = CookTorrance(alpha, fresnel) if beckmann else GGX(alpha, fresnel)
    words = f"{'Beckmann' if beckmann else 'GGX'} facets {_shown(colour)}"
    if not hazy:
        return lobe, words
    haze = GGX(min(factor * alpha, 1.0), fresnel)
    return Sum([lobe, haze], [1 - share, share]), f"{words}, haze {share:.2g}"


def _coated(draw: _Draw, alpha: float) -> tuple[Analytic, str]:
    colour, flakes, cover = draw.colour(), draw.between(0, 1), draw.between(0.3, 1.0)
    metal, width, bend = Schlick(draw.metal()), draw.evenly_in_log(0.12, 0.45), draw.between(1.3, 1.6)
    # A quarter has no flakes. The weights of body and flakes add up to one.
    share = max(0.0, (flakes - 0.25) / 0.75)
    base = Sum([Lambert(colour), GGX(width, metal)], [1 - share, share])
    words = f"body {_shown(colour)}, flakes {share:.2g}, cover {cover:.2g}"
    return Coated(base, GGX(alpha, ExactFresnel(bend)), cover, bend), words


def _shown(colour: tuple[float, float, float]) -> str:
    return "/".join(f"{c:.2g}" for c in colour)
