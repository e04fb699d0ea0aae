"""The plot of an iso-parametric line: the model over its reference, and below what is between them."""

from typing import Literal

import numpy as np

from bvbedit.brdf.geometry import Floats
from bvbedit.errors import BvbError
from bvbedit.spline.arguments import shown
from bvbedit_gui.plots.frames import (
    CHANNELS,
    TEXT,
    TITLE,
    Frame,
    check_size,
    draw_channels,
    draw_frame,
    draw_legend,
    left_margin,
)
from bvbedit_gui.plots.lines import CONSTANT, IsoLine
from bvbedit_gui.plots.svg import Sheet, text_width
from bvbedit_gui.plots.ticks import angle_ticks, decades, linear_ticks, log_ticks, nice_step, number, numbers
from bvbedit_gui.themes import Theme

Scale = Literal["linear", "log"]
# A logarithmic axis ends so far below the peak, and never below what any measurement resolves (1/sr).
RANGE, FLOOR = 1e-7, 1e-6
# Pixels between ticks.
APART_ACROSS, APART_UP = 44.0, 26.0
MOST_TICKS = 9
# Rows of text above, below, and between the two frames.
ABOVE, BELOW, BETWEEN = 46.0, 38.0, 22.0
# The height of the residual's frame, of both.
SHARE, MOST_RESIDUAL = 0.27, 150.0
# A relative residual is drawn up to so many per cent: where the reference is nearly black it says little.
MOST_PERCENT = 100.0
# The residual's axis is never finer than this, in per cent or of the peak: rounding is not to look like a difference.
FINEST_PERCENT, FINEST = 1e-2, 1e-6
# Of the finest, what is called zero.
NOTHING = 1e-3
# Dots at knots stand no closer than this.
DOTS_APART = 12.0


def draw_iso_line(line: IsoLine, *, width: int, height: int, theme: Theme, scale: Scale = "linear") -> str:
    """Return the plot of ``line`` as SVG of ``width`` x ``height`` pixels.

    Thin lines are the model, bands below them the reference. On a ``log`` scale what is darker than the axis' end lies
    on it, and the residual is relative, in per cent. Raises BvbError for another scale, and sizes out of reach.
    """
    check_size(width, height)
    if scale not in ("linear", "log"):
        raise BvbError(f"scale is {shown(scale)}. Choose linear or log.")
    log = scale == "log"
    sheet = Sheet(width, height, theme.paper)
    space = height - ABOVE - BELOW
    lower = 0.0 if line.reference is None else min(SHARE * (space - BETWEEN), MOST_RESIDUAL)
    upper = space - lower - (BETWEEN if lower else 0.0)

    low, high = value_range(line, log=log)
    most = min(int(upper / APART_UP), MOST_TICKS)
    y_ticks = log_ticks(low, high, most) if log else linear_ticks(low, high, most)
    y_labels = decades(y_ticks) if log else numbers(y_ticks)
    if log and _darkest(line) < low:
        # What lies on the axis is as dark as that, or darker.
        clear = np.log(y_ticks / low) * upper > 0.6 * APART_UP * np.log(high / low)
        y_ticks = np.concatenate([[low], y_ticks[clear]])
        y_labels = [f"≤ {decades(y_ticks[:1])[0]}", *decades(y_ticks[1:])]
    residual, unit = residuals(line, low, log=log)
    finest = FINEST_PERCENT if log else FINEST * high
    limit = _residual_limit(residual, finest, log=log)
    r_ticks = np.array([-limit, 0.0, limit]) / 1.25
    r_labels = numbers(r_ticks) if lower else []
    left, right = left_margin(y_labels, r_labels), width - 16.0
    frame = Frame((left, ABOVE, right, ABOVE + upper), low, high, log)

    sheet.write(f"f {line.title}", (8, 19), theme.ink, TITLE, bold=_fits(f"f {line.title}", width), align="start")
    draw_legend(sheet, theme, 8, 37, bands="" if line.reference is None else "reference", knots=len(line.knots) > 0)
    x_places, x_labels, x_title = x_axis(line, right - left)
    draw_frame(sheet, frame, theme, (x_places, [] if lower else x_labels), (y_ticks, y_labels))
    sheet.write("f, 1/sr", (16, ABOVE + upper / 2), theme.ink, TEXT, align="middle", upwards=True)
    if line.reference is not None:
        draw_channels(sheet, frame, theme, line.parameter, line.reference, band=True)
    draw_channels(sheet, frame, theme, line.parameter, line.model, band=False)
    _draw_knots(sheet, frame, theme, line)
    for words in _remarks(line, log=log, floor=low):
        sheet.write(words, ((left + right) / 2, ABOVE + upper / 2), theme.ink, TEXT, align="middle")

    bottom = ABOVE + upper
    if lower:
        top = bottom + BETWEEN
        bottom = top + lower
        below = Frame((left, top, right, bottom), -limit, limit)
        draw_frame(sheet, below, theme, (x_places, x_labels), (r_ticks, r_labels))
        sheet.segments(below.points(np.array([0.0, 1.0]), np.zeros(2))[None], theme.ink, thick=0.8)
        draw_channels(sheet, below, theme, line.parameter, residual, band=False)
        sheet.write(_residual_words(residual, unit, finest, right - left), (left, top - 6), theme.ink, TEXT)
    sheet.write(x_title, ((left + right) / 2, height - 7), theme.ink, TEXT, align="middle")
    return sheet.text(f"Reflectance f in 1/sr {line.title}")


def value_range(line: IsoLine, *, log: bool) -> tuple[float, float]:
    """Return the ends of the upright axis in 1/sr; of a black material, too, they are apart and, if ``log``, positive.

    A linear axis begins at zero. A logarithmic one holds the smallest value, but no more than ``RANGE``.
    """
    seen = _seen(line)
    peak = float(seen.max(initial=0.0))
    if not log:
        return 0.0, 1.06 * peak if peak > 0 else 1.0
    if peak <= FLOOR:
        return FLOOR, 1000 * FLOOR
    floor = max(RANGE * peak, FLOOR)
    low = max(_darkest(line), floor)
    # Its end is written on the axis: one digit.
    if _darkest(line) < floor:
        return float(f"{low:.0e}"), 1.3 * peak
    # A line that hardly varies is shown between a third of it and three times as much, not as noise.
    middle = np.sqrt(low * peak)
    return max(min(low / 1.3, middle / 3), FLOOR), max(1.3 * peak, middle * 3)


def _seen(line: IsoLine) -> Floats:
    """Return all values (k,) of model and reference that are known."""
    both = line.model if line.reference is None else np.concatenate([line.model, line.reference])
    return np.asarray(both[np.isfinite(both)])


def _darkest(line: IsoLine) -> float:
    return float(_seen(line).min(initial=np.inf))


def residuals(line: IsoLine, floor: float, *, log: bool) -> tuple[Floats, str]:
    """Return model - reference (n, 3) in 1/sr, or if ``log`` in per cent of the reference or ``floor``; the unit."""
    if line.reference is None:
        return np.zeros_like(line.model), ""
    difference = line.model - line.reference
    return (100 * difference / np.maximum(line.reference, floor), "%") if log else (difference, "1/sr")


def x_axis(line: IsoLine, pixels: float) -> tuple[Floats, list[str], str]:
    """Return parameters and labels of the ticks of an axis of so many ``pixels``, and its title."""
    name = line.symbol
    if np.ptp(line.degrees) < CONSTANT:
        places = linear_ticks(0.0, 1.0, int(pixels / APART_ACROSS))
        return places, [f"{label} %" for label in numbers(100 * places)], f"{name}, share of its limit"
    places, labels = angle_ticks(line.parameter, line.degrees, pixels, APART_ACROSS)
    even = float(np.abs(np.diff(places, 2)).max(initial=0.0)) < 1e-6 and len(places) > 2
    return places, labels, f"{name}, degrees" if even else f"{name}, degrees (spaced as on the chart)"


def _draw_knots(sheet: Sheet, frame: Frame, theme: Theme, line: IsoLine) -> None:
    """Mark the knots on the lower axis and, where they are not too many, on the curves."""
    if len(line.knots) == 0:
        return
    bottom, xs = frame.box[3], frame.x(line.knots)
    ends = np.stack([np.full_like(xs, bottom - 3.5), np.full_like(xs, bottom + 3.5)], axis=-1)
    sheet.segments(np.stack([np.stack([xs, xs], axis=-1), ends], axis=-1), theme.ink, thick=1.2)
    dotted = np.zeros(len(xs), dtype=bool)
    last = -np.inf
    for k, x in enumerate(xs.tolist()):
        if x - last >= DOTS_APART:
            dotted[k], last = True, x
    for values, colour in zip(line.at_knots.T, theme.series, strict=True):
        points = frame.points(line.knots[dotted], values[dotted])
        points = points[np.isfinite(points).all(axis=1)]
        if len(points):
            # Short thick dashes: a dot is a square of three pixels here.
            half = np.array([1.75, 0.0])
            squares = np.stack([points - half, points + half], axis=1)
            sheet.segments(squares, colour, thick=3.5)


def _remarks(line: IsoLine, *, log: bool, floor: float) -> list[str]:
    """Return what has to be said where nothing is seen."""
    seen = _seen(line)
    if len(seen) == 0:
        return ["nothing reliable is known along this line"]
    if not seen.any():
        return [f"black: drawn at {number(floor)}" if log else "black"]
    return []


def _residual_limit(residual: Floats, finest: float, *, log: bool) -> float:
    """Return the end of the residual's axis, 1.25 times a round number."""
    seen = np.abs(residual[np.isfinite(residual)])
    largest = float(seen.max(initial=0.0))
    if log and seen.size:
        # Where all of it is far off, that is what is to be seen.
        largest = min(largest, max(MOST_PERCENT, 2 * float(np.median(seen))))
    return 1.25 * nice_step(max(largest, finest) / 1.25)


def _residual_words(residual: Floats, unit: str, finest: float, space: float) -> str:
    """Return what the residual is, and its largest value where there is ``space`` (pixels) for that."""
    relative = unit == "%"
    words = "relative residual, %" if relative else "model − reference, 1/sr"
    seen = np.where(np.isfinite(residual), np.abs(residual), -1.0)
    if seen.max() < 0:
        return f"{words}: nothing to compare"
    row, channel = np.unravel_index(int(np.argmax(seen)), seen.shape)
    largest = float(residual[row, channel])
    if abs(largest) < NOTHING * finest:
        return f"{words}: none"
    amount = ("+" if largest > 0 else "") + number(largest)
    most = f"{words}: at most {amount}{' %' if relative else ''} ({CHANNELS[channel]})"
    return most if text_width(most, TEXT) <= space else words


def _fits(title: str, width: int) -> bool:
    return text_width(title, TITLE, bold=True) <= width - 16
