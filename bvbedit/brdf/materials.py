"""Named sample materials, from matte paper to mirror chrome: something to start from without a measurement at hand.

They are analytic models with parameters chosen by hand. Three are named after the paper's materials and made to
resemble them in colour, width of the lobe, growth towards grazing and dynamic range; none is a fit of a measurement.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from bvbedit.brdf.analytic import (
    GGX,
    Analytic,
    Coated,
    CookTorrance,
    CosineLobe,
    ExactFresnel,
    Lafortune,
    Lambert,
    Schlick,
    Sum,
    Ward,
)
from bvbedit.errors import BvbError
from bvbedit.spline.arguments import shown


@dataclass(frozen=True)
class Material:
    """A BRDF with a name and one line that says what it looks like."""

    name: str
    description: str
    brdf: Analytic


VARNISH = ExactFresnel(1.5)

# Optical constants of the metals near 630, 540 and 460 nm, rounded from the tables in general use.
ALUMINIUM = ExactFresnel((1.4, 0.95, 0.65), (7.6, 6.5, 5.5))
CHROMIUM = ExactFresnel((3.1, 2.9, 2.1), (3.3, 3.3, 2.9))
COPPER = ExactFresnel((0.22, 1.0, 1.15), (3.6, 2.6, 2.5))

_ALL = (
    Material(
        "matte-paper",
        "White uncoated paper: diffuse, with a trace of gloss towards grazing",
        Sum([Lambert((0.80, 0.79, 0.75)), GGX(0.6, ExactFresnel(1.4))], [1.0, 0.5]),
    ),
    Material(
        "grey-felt",
        "Grey felt: diffuse, brighter back towards the light and at the rim",
        Lafortune(
            [CosineLobe(0.55, 0.40, 4.0), CosineLobe(-0.55, 0.25, 5.0)],
            diffuse=(0.26, 0.26, 0.28),
        ),
    ),
    Material(
        "teflon",
        "White teflon after the paper's: nearly Lambert, with a soft gloss that rises towards grazing",
        Coated(Lambert((0.36, 0.36, 0.35)), GGX(0.30, ExactFresnel(1.38))),
    ),
    Material(
        "black-rubber",
        "Black rubber: almost no diffuse part, a broad dull gloss",
        Sum([Lambert(0.018), GGX(0.42, ExactFresnel(1.52))]),
    ),
    Material(
        "satin-paint",
        "Rose satin paint: a soft gloss over a saturated colour",
        Coated(Lambert((0.62, 0.16, 0.24)), GGX(0.20, VARNISH)),
    ),
    Material(
        "blue-plastic",
        "Blue injection-moulded plastic: a clear white highlight over a deep colour",
        Coated(Lambert((0.03, 0.09, 0.42)), GGX(0.07, VARNISH)),
    ),
    Material(
        "white-ceramic",
        "Glazed white ceramic: bright diffuse body under a mirror-like glaze",
        Coated(Lambert((0.82, 0.80, 0.76)), GGX(0.012, VARNISH)),
    ),
    Material(
        "gold-metallic-paint",
        "Gold metallic paint after the paper's: broad golden flakes under a worn clear coat, little diffuse",
        Coated(
            Sum([Lambert((0.020, 0.010, 0.003)), GGX(0.13, Schlick((0.23, 0.165, 0.06)))]),
            GGX(0.30, VARNISH),
            cover=0.15,
            bend=1.5,
        ),
    ),
    Material(
        "car-paint",
        "Dark red metallic car paint: broad flakes and colour under a polished clear coat",
        Coated(
            Sum([Lambert((0.10, 0.008, 0.010)), Ward((0.55, 0.10, 0.08), 0.22)]),
            GGX(0.010, VARNISH),
            bend=1.5,
        ),
    ),
    Material(
        "blasted-aluminium",
        "Bead-blasted aluminium: a wide bright lobe of bare metal",
        CookTorrance(0.35, ALUMINIUM, specular=0.9, diffuse=0.02),
    ),
    Material(
        "copper",
        "Polished copper, slightly hazy",
        GGX(0.09, COPPER),
    ),
    Material(
        "chrome",
        "Mirror chrome after the paper's: a lobe less than a degree wide, and a haze six decades below it",
        Sum([GGX(0.007, CHROMIUM), GGX(0.25, CHROMIUM), Lambert(1.0)], [0.98, 0.002, 0.0006]),
    ),
)

MATERIALS: Mapping[str, Material] = MappingProxyType({m.name: m for m in _ALL})


def is_material(name: object) -> bool:
    """Return whether there is a sample material called ``name``, by hand or in the generated database."""
    if not isinstance(name, str):
        return False
    if name in MATERIALS:
        return True
    from bvbedit.brdf.database import generated

    try:
        return bool(generated(name))
    except BvbError:
        return False


def material_named(name: str) -> Material:
    """Return the sample material called ``name``, by hand or in the generated database (like "db-017").

    Raises BvbError that lists the names where there is none.
    """
    if isinstance(name, str) and name in MATERIALS:
        return MATERIALS[name]
    # Here, so that those who want none of the database do not load it.
    from bvbedit.brdf.database import generated, is_generated

    if is_generated(name):
        return generated(name)
    raise BvbError(f"Unknown material {shown(name)}. Choose one of {', '.join(MATERIALS)}, or db-000 ... db-999.")
