"""A frame with two axes on a sheet: from values to pixels, grid, ticks and legend."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bvbedit.brdf.geometry import Floats
from bvbedit.errors import BvbError
from bvbedit_gui.plots.svg import Box, Sheet, text_width
from bvbedit_gui.themes import Theme

CHANNELS = ("red", "green", "blue")
# Channels that coincide, as those of a grey material do, show through one another's gaps.
DASHES: tuple[tuple[float, ...] | None, ...] = (None, (7.0, 4.0), (2.0, 2.5))
THICK = 1.5
# What a curve is compared with lies below it as a broad band.
BAND, BAND_ALPHA = 5.0, 0.45
TITLE, TEXT = 13.0, 11.0
SMALLEST, LARGEST = (340, 200), (4000, 3000)
SAMPLE, GAP = 20.0, 10.0


@dataclass(frozen=True)
class Frame:
    """A ``box`` in pixels whose x runs over [0, 1] and whose y over [low, high], both positive if ``log``."""

    box: Box
    low: float
    high: float
    log: bool = False

    def x(self, share: Floats) -> Floats:
        """Return pixels from the left of the sheet for ``share`` of the axis, 0 to 1."""
        return np.asarray(self.box[0] + (self.box[2] - self.box[0]) * share)

    def y(self, values: Floats) -> Floats:
        """Return pixels from the top of the sheet; on a logarithmic axis what is below its end is put there."""
        ends = np.array([self.low, self.high])
        if self.log:
            values, ends = np.log(np.maximum(values, self.low)), np.log(ends)
        up = (values - ends[0]) / (ends[1] - ends[0])
        # A little outside is as good as far outside, and no number gets out of hand.
        return np.asarray(self.box[3] - (self.box[3] - self.box[1]) * np.clip(up, -1.0, 2.0))

    def points(self, share: Floats, values: Floats) -> Floats:
        """Return places (n, 2) on the sheet."""
        return np.stack([self.x(share), self.y(values)], axis=-1)

    @property
    def around(self) -> Box:
        """The box with room for the thickness of lines along its edges."""
        left, top, right, bottom = self.box
        return left - 1, top - 3, right + 1, bottom + 3


def check_size(width: int, height: int) -> None:
    """Raise BvbError for a picture in which nothing can be read, or which no screen shows."""
    for name, value, least, most in zip(("width", "height"), (width, height), SMALLEST, LARGEST, strict=True):
        if not least <= value <= most:
            raise BvbError(f"{name} is {value}. Choose {least} ... {most} pixels.")


def draw_frame(
    sheet: Sheet,
    frame: Frame,
    theme: Theme,
    x_ticks: tuple[Floats, Sequence[str]],
    y_ticks: tuple[Floats, Sequence[str]],
) -> None:
    """Draw grid, left and lower axis and the ticks' labels; ``x_ticks`` may have no labels."""
    left, top, right, bottom = frame.box
    xs, ys = frame.x(x_ticks[0]), frame.y(y_ticks[0])
    upright = [[(x, top), (x, bottom)] for x in xs.tolist()]
    across = [[(left, y), (right, y)] for y in ys.tolist()]
    sheet.segments(np.array(upright + across), theme.faint)
    sheet.line([(left, top), (left, bottom), (right, bottom)], theme.ink, thick=1.0)
    for x, label in zip(xs.tolist(), x_ticks[1], strict=False):
        sheet.write(label, (x, bottom + 15), theme.ink, TEXT, align="middle")
    for y, label in zip(ys.tolist(), y_ticks[1], strict=True):
        sheet.write(label, (left - 5, y + 4), theme.ink, TEXT, align="end")


def draw_channels(sheet: Sheet, frame: Frame, theme: Theme, share: Floats, values: Floats, *, band: bool) -> None:
    """Draw the three channels of ``values`` (n, 3), as bands to compare with or as thin lines."""
    for values_of, colour, dashes in zip(values.T, theme.series, DASHES, strict=True):
        points = frame.points(share, values_of)
        if band:
            sheet.line(points, colour, thick=BAND, alpha=BAND_ALPHA, inside=frame.around)
        else:
            sheet.line(points, colour, thick=THICK, dashes=dashes, inside=frame.around)


def draw_legend(
    sheet: Sheet, theme: Theme, left: float, baseline: float, *, bands: str = "", knots: bool = False
) -> None:
    """Draw what the lines mean from ``left`` on: the channels, the ``bands`` if they have a name, and knots."""
    x, middle = left, baseline - 4
    for name, colour, dashes in zip(CHANNELS, theme.series, DASHES, strict=True):
        sheet.line([(x, middle), (x + SAMPLE, middle)], colour, thick=THICK + 0.5, dashes=dashes)
        x = _name(sheet, theme, name, x + SAMPLE, baseline)
    if bands:
        third = SAMPLE / 3
        for k, colour in enumerate(theme.series):
            ends = [(x + k * third, middle), (x + (k + 1) * third, middle)]
            sheet.line(ends, colour, thick=BAND, alpha=BAND_ALPHA)
        x = _name(sheet, theme, bands, x + SAMPLE, baseline)
    if knots:
        sheet.segments(np.array([[(x + 3, middle - 4), (x + 3, middle + 4)]]), theme.ink, thick=1.2)
        _name(sheet, theme, "knots", x + 6, baseline)


def _name(sheet: Sheet, theme: Theme, name: str, x: float, baseline: float) -> float:
    """Write ``name`` after its sample and return where the next one begins."""
    sheet.write(name, (x + 4, baseline), theme.ink, TEXT)
    return x + 4 + text_width(name, TEXT) + GAP


def left_margin(*labels: Sequence[str]) -> float:
    """Return the pixels that the ``labels`` of upright axes and a title beside them need."""
    widest = max((text_width(label, TEXT) for of_axis in labels for label in of_axis), default=0.0)
    return float(np.ceil(widest)) + 5 + 22
