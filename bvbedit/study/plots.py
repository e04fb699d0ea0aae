"""What a figure of a report is: how it is drawn, what it says, and the numbers behind it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from bvbedit.study.quantities import Quantity, column, pae
from bvbedit.study.statistics import pearson, spearman
from bvbedit.study.table import Row

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Cell = str | int | float | None


@dataclass(frozen=True)
class Numbers:
    """A table behind a figure."""

    header: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]


@dataclass(frozen=True)
class Plot:
    """A figure that can be drawn."""

    name: str
    """Of its files and of its place in the page."""
    title: str
    words: str
    """What it shows, in short."""
    numbers: Numbers
    draw: Callable[[], "Figure"]


@dataclass(frozen=True)
class Missing:
    """A figure that cannot be drawn, and why."""

    title: str
    why: str


def pairs_of(rows: Sequence[Row], x: Quantity, y: Quantity) -> list[tuple[float, float]]:
    """Return the values of both quantities in the rows that have both."""
    found = [(x.value(row), y.value(row)) for row in rows]
    return [(a, b) for a, b in found if a is not None and b is not None]


def agreement(rows: Sequence[Row], scenes: Sequence[str]) -> str:
    """Return in words how e_max correlates with the largest error of each scene's picture over ``rows``."""
    told = []
    for scene in scenes:
        pairs = pairs_of(rows, column("e_max", "E_max"), pae(scene))
        x, y = [a for a, _ in pairs], [b for _, b in pairs]
        r, rho = pearson(x, y), spearman(x, y)
        if r is None or rho is None:
            told.append(f"in {scene} it is undefined ({len(pairs)} cells know both, or one does not vary)")
        else:
            told.append(f"r = {r:.2f} in {scene} (of ranks {rho:.2f}; {len(pairs)} cells)")
    return f"Correlation of E_max with PAE over the cells shown: {'; '.join(told)}." if told else ""
