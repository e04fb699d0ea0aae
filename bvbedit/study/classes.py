"""Diffuse, glossy or mirror-like: told from how far the material's largest reflectance is above its mean.

The ratio r_max / r_avg of the RGB vector's length over the paper's nodes is 1 for a Lambertian. Of real measurements it
was found to be 12 (white paper) and 286 (teflon, most of it near grazing), 2,015 (satin) and 3,472 (car paint), and
7,911 (chrome). Grazing directions count, which is its weakness: a matt material that shines at grazing angles, as an
analytic one without noise does, is put too high.
"""

from collections.abc import Sequence
from typing import Literal

from bvbedit.study.statistics import median
from bvbedit.study.table import Row, Table

Class = Literal["diffuse", "glossy", "mirror-like"]
CLASSES: tuple[Class, ...] = ("diffuse", "glossy", "mirror-like")
# Ratios from which a material is glossy, and mirror-like.
GLOSSY, MIRROR_LIKE = 500.0, 5000.0
HOW = (
    f"The class follows from r_max / r_avg, the largest by the mean length of the material's RGB vector over the "
    f"paper's nodes, 1 for a Lambertian: diffuse below {GLOSSY:,.0f}, glossy below {MIRROR_LIKE:,.0f}, mirror-like "
    f"from there. Grazing directions count, so that a matt material that shines at grazing angles is put too high."
)


def contrast(rows: Sequence[Row]) -> float | None:
    """Return r_max / r_avg of the material that ``rows`` are of; None where it is unknown or black."""
    ratios = [row.r_max / row.r_avg for row in rows if row.r_max is not None and row.r_avg]
    return median(ratios) if ratios else None


def class_of(ratio: float) -> Class:
    """Return the class of a material with this ``ratio`` r_max / r_avg."""
    if ratio < GLOSSY:
        return "diffuse"
    return "glossy" if ratio < MIRROR_LIKE else "mirror-like"


def contrasts(table: Table) -> dict[str, float]:
    """Return r_max / r_avg by material, for those of which it is known."""
    found = {name: contrast([row for row in table.rows if row.material == name]) for name in table.materials}
    return {name: ratio for name, ratio in found.items() if ratio is not None}


def classes(table: Table) -> dict[Class, tuple[str, ...]]:
    """Return the materials of each class that has any, by their ratio; those of unknown ratio are in none."""
    ratios = contrasts(table)
    sorted_names = sorted(ratios, key=lambda name: ratios[name])
    found = {kind: tuple(n for n in sorted_names if class_of(ratios[n]) == kind) for kind in CLASSES}
    return {kind: names for kind, names in found.items() if names}


def groups(table: Table) -> dict[str, tuple[str, ...]]:
    """Return the materials of each class that has any, and last those of unknown class."""
    found = {str(kind): names for kind, names in classes(table).items()}
    known = {name for names in found.values() for name in names}
    unknown = tuple(name for name in table.materials if name not in known)
    return found | {"class unknown": unknown} if unknown else found
