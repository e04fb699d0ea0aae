"""The plot of a directional albedo: three channels, a line at 1, and what is above it."""

from itertools import pairwise

import numpy as np

from bvbedit.brdf.geometry import Floats
from bvbedit_gui.plots.albedos import AlbedoCurve, albedo_number
from bvbedit_gui.plots.frames import (
    TEXT,
    TITLE,
    Frame,
    check_size,
    draw_channels,
    draw_frame,
    draw_legend,
    left_margin,
)
from bvbedit_gui.plots.svg import Sheet, text_width
from bvbedit_gui.plots.ticks import angle_ticks, linear_ticks, numbers
from bvbedit_gui.themes import Theme

ABOVE, BELOW = 64.0, 38.0
APART_ACROSS, APART_UP = 44.0, 26.0
SHADE = 0.3


def draw_albedo(curve: AlbedoCurve, *, width: int, height: int, theme: Theme) -> str:
    """Return the plot of ``curve`` as SVG of ``width`` x ``height`` pixels. Raises BvbError for sizes out of reach."""
    check_size(width, height)
    sheet = Sheet(width, height, theme.paper)
    shown = curve.value if curve.reference is None else np.concatenate([curve.value, curve.reference])
    # The line at 1 is always seen: how far a dark material is below it matters.
    high = 1.06 * max(1.0, float(shown.max()))
    upper = height - ABOVE - BELOW
    ticks = linear_ticks(0.0, high, int(upper / APART_UP))
    labels = numbers(ticks)
    left, right = left_margin(labels), width - 16.0
    frame = Frame((left, ABOVE, right, ABOVE + upper), 0.0, high)

    share = curve.degrees / 90
    sheet.write("Directional albedo", (8, 19), theme.ink, TITLE, bold=True)
    words = curve.words
    if text_width(words, TEXT) > width - 16:
        words = f"creates energy in {len(curve.creates_energy)} ranges: at most {albedo_number(curve.largest[0])}"
    bold = bool(curve.creates_energy) and text_width(words, TEXT, bold=True) <= width - 16
    sheet.write(words, (8, 37), theme.ink, TEXT, bold=bold)
    draw_legend(sheet, theme, 8, 55, bands="" if curve.reference is None else "reference")
    draw_frame(sheet, frame, theme, angle_ticks(share, curve.degrees, right - left, APART_ACROSS), (ticks, labels))
    for channel in curve.value.T:
        for corners in above_one(share, channel):
            sheet.area(frame.points(corners[:, 0], corners[:, 1]), theme.warning, alpha=SHADE)
    sheet.segments(frame.points(np.array([0.0, 1.0]), np.ones(2))[None], theme.ink, thick=1.0)
    if curve.reference is not None:
        draw_channels(sheet, frame, theme, share, curve.reference, band=True)
    draw_channels(sheet, frame, theme, share, curve.value, band=False)
    middle = (left + right) / 2
    sheet.write("albedo", (16, ABOVE + upper / 2), theme.ink, TEXT, align="middle", upwards=True)
    sheet.write("θ_o, degrees", (middle, height - 7), theme.ink, TEXT, align="middle")
    return sheet.text(f"Directional albedo over θ_o in degrees: {curve.words}")


def above_one(x: Floats, y: Floats) -> list[Floats]:
    """Return the polygons (k, 2) between the line through ``x``, ``y`` (n,) and the height 1, where it is above."""
    step = np.diff(y)
    crossing = np.flatnonzero((y[:-1] > 1) != (y[1:] > 1))
    at = x[crossing] + (1 - y[crossing]) / step[crossing] * np.diff(x)[crossing]
    ends = np.concatenate([x[:1], at, x[-1:]])
    out = []
    for a, b in pairwise(ends):
        inside = (x > a) & (x < b)
        above = np.concatenate([[np.interp(a, x, y)], y[inside], [np.interp(b, x, y)]])
        if above.max() > 1 + 1e-12 and above.mean() > 1:
            along = np.concatenate([[a], x[inside], [b]])
            corners = np.stack([along, np.maximum(above, 1.0)], axis=-1)
            out.append(np.concatenate([[[a, 1.0]], corners, [[b, 1.0]]]))
    return out
