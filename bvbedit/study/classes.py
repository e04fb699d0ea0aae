"""Diffuse, glossy or mirror-like: told from how wide the material's highlight is.

Half-widths at a difference angle of 20 degrees were found to be, in degrees: 0.07 (measured chrome), 2.3 (satin), 5.1
(car paint), 7.7 (gold paint); white paper and teflon have no highlight there. Grazing directions, where nearly all
materials shine, do not count.
"""

from collections.abc import Sequence
from typing import Literal

from bvbedit.study.statistics import median
from bvbedit.study.table import Row, Table

Class = Literal["diffuse", "glossy", "mirror-like"]
CLASSES: tuple[Class, ...] = ("diffuse", "glossy", "mirror-like")
# Half-widths of the highlight (degrees) below which a material is mirror-like, and glossy.
MIRROR_LIKE, GLOSSY = 1.8, 10.0
HOW = (
    f"The class follows from the half-width of the highlight at a difference angle of 20°: mirror-like below "
    f"{MIRROR_LIKE:g}°, glossy below {GLOSSY:g}°, and diffuse where it is wider, or not twice as bright as the rest."
)


def highlight(rows: Sequence[Row]) -> float | None:
    """Return the half-width (degrees) of the highlight of the material that ``rows`` are of; None where unknown."""
    widths = [row.highlight for row in rows if row.highlight is not None]
    return median(widths) if widths else None


def class_of(width: float) -> Class:
    """Return the class of a material whose highlight has this half-width (degrees)."""
    if width < MIRROR_LIKE:
        return "mirror-like"
    return "glossy" if width < GLOSSY else "diffuse"


def highlights(table: Table) -> dict[str, float]:
    """Return the half-widths of highlights (degrees) by material, for those of which they are known."""
    found = {name: highlight([row for row in table.rows if row.material == name]) for name in table.materials}
    return {name: width for name, width in found.items() if width is not None}


def classes(table: Table) -> dict[Class, tuple[str, ...]]:
    """Return the materials of each class that has any, the widest highlight first; unknown ones are in none."""
    widths = highlights(table)
    sorted_names = sorted(widths, key=lambda name: -widths[name])
    found = {kind: tuple(n for n in sorted_names if class_of(widths[n]) == kind) for kind in CLASSES}
    return {kind: names for kind, names in found.items() if names}


def groups(table: Table) -> dict[str, tuple[str, ...]]:
    """Return the materials of each class that has any, and last those of unknown class."""
    found = {str(kind): names for kind, names in classes(table).items()}
    known = {name for names in found.values() for name in names}
    unknown = tuple(name for name in table.materials if name not in known)
    return found | {"class unknown": unknown} if unknown else found
