"""A sheet in pixels to draw lines, areas and words on, and its SVG text: matplotlib's SVG backend used as a pen.

Axes and figures of matplotlib take 45 ms for such a plot, mostly for ticks; its renderer alone takes 3. Nothing is
kept between sheets and nothing global is changed, so that several threads may draw at once.

Words are text and not outlines: crisper, a third of the bytes, a fifth of the time. Their widths are those of
DejaVu Sans, about the widest of the fonts that may stand in for it, so that what fits with it is never cut.
"""

import hashlib
import re
from collections.abc import Sequence
from functools import lru_cache
from io import StringIO
from typing import Any, Literal

import numpy as np
from matplotlib.backend_bases import GraphicsContextBase
from matplotlib.backends.backend_svg import RendererSVG
from matplotlib.font_manager import FontProperties
from matplotlib.path import Path
from matplotlib.textpath import TextToPath
from matplotlib.transforms import Affine2D, Bbox

from bvbedit.brdf.geometry import Floats

# DejaVu comes with matplotlib; Verdana and Bitstream Vera have the same widths.
FAMILY = "DejaVu Sans, Verdana, Bitstream Vera Sans, sans-serif"
# Corners nearer than this to a straight line (pixels) are left out.
SIMPLER = 1 / 9
NO_METADATA = {"Date": None, "Creator": None, "Format": None, "Type": None}

Align = Literal["start", "middle", "end"]
# Left, top, right, bottom in pixels from the upper left corner.
Box = tuple[float, float, float, float]


class Sheet:
    """A drawing of ``width`` x ``height`` pixels on ``paper``; places (x, y) are from its upper left corner."""

    def __init__(self, width: int, height: int, paper: str) -> None:
        self.width, self.height = width, height
        self._stream = StringIO()
        # The backend is not typed.
        renderer: Any = RendererSVG
        self._pen = renderer(width, height, self._stream, image_dpi=72, metadata=NO_METADATA)
        # The renderer counts from the bottom.
        self._upright = Affine2D().scale(1, -1).translate(0, height)
        self.area([(0, 0), (width, 0), (width, height), (0, height)], paper)

    def line(
        self,
        points: Sequence[tuple[float, float]] | Floats,
        colour: str,
        *,
        thick: float = 1.0,
        dashes: Sequence[float] | None = None,
        alpha: float = 1.0,
        inside: Box | None = None,
    ) -> None:
        """Draw a line through ``points`` (n, 2), broken where they are nan, and cut at the box ``inside``."""
        path = Path(np.asarray(points, dtype=np.float64))
        path.should_simplify, path.simplify_threshold = True, SIMPLER
        context = self._context(colour, alpha, inside)
        context.set_linewidth(thick)
        if dashes is not None:
            context.set_dashes(0, list(dashes))
        self._pen.draw_path(context, path, self._upright)

    def segments(self, pairs: Floats, colour: str, *, thick: float = 1.0) -> None:
        """Draw lines apart from one another, between the two points each of ``pairs`` (n, 2, 2)."""
        corners = np.asarray(pairs, dtype=np.float64).reshape(-1, 2)
        context = self._context(colour, 1.0, None)
        context.set_linewidth(thick)
        path = Path(corners, np.tile(np.array([Path.MOVETO, Path.LINETO], dtype=np.uint8), len(corners) // 2))
        self._pen.draw_path(context, path, self._upright)

    def area(
        self,
        points: Sequence[tuple[float, float]] | Floats,
        colour: str,
        *,
        alpha: float = 1.0,
        inside: Box | None = None,
    ) -> None:
        """Fill the polygon with corners ``points`` (n, 2)."""
        context = self._context(colour, alpha, inside)
        context.set_linewidth(0.0)
        path = Path(np.asarray(points, dtype=np.float64), closed=False)
        self._pen.draw_path(context, path, self._upright, context.get_rgb())

    def write(
        self,
        text: str,
        at: tuple[float, float],
        colour: str,
        size: float,
        *,
        align: Align = "start",
        bold: bool = False,
        upwards: bool = False,
    ) -> None:
        """Write ``text`` of ``size`` pixels, its baseline at the ``align`` end or middle of it there."""
        x, y = (f"{v:.1f}".removesuffix(".0") for v in at)
        attributes = {"x": x, "y": y, "fill": colour, "font-size": f"{size:g}"}
        if align != "start":
            attributes["text-anchor"] = align
        if bold:
            attributes["font-weight"] = "bold"
        if upwards:
            attributes["transform"] = f"rotate(-90 {x} {y})"
        self._pen.writer.element("text", text, attrib=attributes)

    def text(self, title: str) -> str:
        """Return the drawing as an SVG element, named ``title`` for who does not see it. Ends the sheet."""
        self._pen.finalize()
        drawn = self._stream.getvalue()
        body = drawn[drawn.index("</defs>") + len("</defs>") : drawn.rindex("</svg>")]
        # Within one page the names of two drawings must differ, and those of the same drawing must not change.
        names = dict.fromkeys(re.findall(r' id="([^"]*)"', body))
        digest = hashlib.sha256()
        for number, name in enumerate(names):
            body = body.replace(name, f"@{number}@")
        body = re.sub(r"\s*\n\s*", "\n", body).strip()
        digest.update(body.encode())
        body = re.sub(r"@(\d+)@", rf"p{digest.hexdigest()[:8]}-\1", body)
        head = (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{self.width}" height="{self.height}" '
            f'viewBox="0 0 {self.width} {self.height}" role="img" font-family="{FAMILY}" stroke-linejoin="round">'
        )
        return f"{head}\n<title>{_escaped(title)}</title>\n{body}\n</svg>\n"

    def _context(self, colour: str, alpha: float, inside: Box | None) -> GraphicsContextBase:
        context: GraphicsContextBase = self._pen.new_gc()
        context.set_foreground(colour)
        context.set_capstyle("butt")
        context.set_joinstyle("round")
        if alpha < 1:
            context.set_alpha(alpha)
        if inside is not None:
            left, top, right, bottom = inside
            context.set_clip_rectangle(Bbox([[left, self.height - bottom], [right, self.height - top]]))
        return context


@lru_cache(maxsize=2048)
def text_width(text: str, size: float, *, bold: bool = False) -> float:
    """Return the width of ``text`` of ``size`` pixels, in pixels."""
    font = FontProperties(family=["DejaVu Sans"], weight="bold" if bold else "normal", size=size)
    return float(TextToPath().get_text_width_height_descent(text, font, ismath=False)[0])


def _escaped(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
