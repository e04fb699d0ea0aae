"""Pictures beside one another, with a line under each, and pictures of differences. All are 8-bit sRGB (h, w, 3)."""

import math
from collections.abc import Sequence
from numbers import Real
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bvbedit.errors import BvbError

if TYPE_CHECKING:
    from PIL import ImageDraw

Picture8 = NDArray[np.uint8]

PAPER, INK = 255, 40
LETTERS, MARGIN = 14, 5


def amplified_difference(a: ArrayLike, b: ArrayLike, factor: float = 8.0) -> Picture8:
    """Return |a - b| of two 8-bit pictures (h, w, 3), times ``factor``, clipped: black where they agree.

    Raises BvbError for pictures that are not uint8 or not of one size, and a factor that is not positive and finite.
    """
    first, second = _picture(a, "a"), _picture(b, "b")
    if first.shape != second.shape:
        raise BvbError(f"The pictures have shapes {first.shape} and {second.shape}. Give two of one size.")
    if not (isinstance(factor, Real) and 0 < factor < math.inf):
        raise BvbError(f"factor is {factor!r}. Give a positive number.")
    difference = np.abs(first.astype(np.float64) - second)
    return np.asarray(np.minimum(np.rint(difference * factor), 255), dtype=np.uint8)


def sheet(entries: Sequence[tuple[str, ArrayLike]], *, columns: int | None = None, gap: int = 8) -> Picture8:
    """Return labelled 8-bit pictures in rows of ``columns`` (all in one row by default) on white, ``gap`` pixels apart.

    ``entries``: (label, picture (h, w, 3) uint8); a label wider than its picture is cut, and without any labels the
    lines for them are left out. Pictures may differ in size: each column and row is as large as its largest. Raises
    BvbError for no pictures, pictures that are not uint8, columns below 1 and gaps outside 0 to 1000.
    """
    pictures = [_picture(p, f"picture {n}") for n, (_, p) in enumerate(entries)]
    labels = [str(label) for label, _ in entries]
    if not pictures:
        raise BvbError("A sheet needs at least one picture.")
    columns = len(pictures) if columns is None else min(columns, len(pictures))
    if columns < 1 or not 0 <= gap <= 1000:
        raise BvbError(f"columns is {columns}, gap is {gap}. Give at least one column, and a gap from 0 to 1000.")
    line = LETTERS + 2 * MARGIN if any(labels) else 0
    widths = [max(p.shape[1] for p in pictures[c::columns]) for c in range(columns)]
    heights = [max(p.shape[0] for p in pictures[r : r + columns]) + line for r in range(0, len(pictures), columns)]
    lefts = np.cumsum([0, *(w + gap for w in widths)])
    tops = np.cumsum([0, *(h + gap for h in heights)])
    out = np.full((tops[-1] - gap, lefts[-1] - gap, 3), PAPER, dtype=np.uint8)
    for n, p in enumerate(pictures):
        top, left = tops[n // columns], lefts[n % columns]
        out[top : top + p.shape[0], left : left + p.shape[1]] = p
    if not line:
        return out

    from PIL import Image, ImageDraw, ImageFont

    image = Image.fromarray(out)
    draw, font = ImageDraw.Draw(image), ImageFont.load_default(LETTERS)
    for n, label in enumerate(labels):
        row, column = divmod(n, columns)
        below = int(tops[row]) + heights[row] - line + MARGIN
        text = _cut(label, draw, font, widths[column])
        draw.text((int(lefts[column]) + 1, below), text, fill=(INK, INK, INK), font=font)
    return np.array(image)


def _cut(label: str, draw: "ImageDraw.ImageDraw", font: object, width: int) -> str:
    """Return as much of a label as fits, on one line."""
    label = " ".join(label.split())
    if draw.textlength(label, font=font) <= width:  # type: ignore[arg-type]
        return label
    while label and draw.textlength(label + "...", font=font) > width:  # type: ignore[arg-type]
        label = label[:-1]
    return label + "..."


def _picture(picture: ArrayLike, name: str) -> Picture8:
    p = np.asarray(picture)
    if p.dtype != np.uint8 or p.ndim != 3 or p.shape[-1] != 3 or p.size == 0:
        raise BvbError(f"{name} is {p.dtype} of shape {p.shape}. Give uint8 (height, width, 3), as tone_map returns.")
    return p
