"""The directional albedo of a model over the elevation of the viewer, and whether it creates energy."""

from dataclasses import dataclass

import numpy as np

from bvbedit.brdf.albedo import albedo
from bvbedit.brdf.geometry import Floats
from bvbedit.brdf.repair import creates
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.errors import BvbError
from bvbedit_gui.plots.frames import CHANNELS
from bvbedit_gui.plots.ticks import number

# Degrees: every 2.5, and every degree near grazing, where albedos rise; at 90 itself the limit is meant.
ELEVATIONS = np.concatenate([np.arange(0.0, 80.0, 2.5), np.arange(80.0, 90.0), [89.5, 90.0]])


@dataclass(frozen=True, eq=False)
class AlbedoCurve:
    """Albedos at ``degrees`` (n,) of theta_o: ``value`` (n, 3) of each channel, right within ``error`` (n, 3)."""

    degrees: Floats
    value: Floats
    error: Floats
    reference: Floats | None
    """(n, 3) of what the model is compared with."""

    @property
    def creates_energy(self) -> tuple[tuple[float, float], ...]:
        """First and last of the ``degrees`` of each range in which a channel's albedo is certainly above 1."""
        inside = creates(self.value, self.error).any(axis=1)
        edges = np.flatnonzero(np.diff(np.concatenate([[False], inside, [False]]).astype(np.int8)))
        return tuple((float(self.degrees[a]), float(self.degrees[b - 1])) for a, b in edges.reshape(-1, 2))

    @property
    def largest(self) -> tuple[float, float, str]:
        """The largest albedo, the theta_o at which it is, in degrees, and its channel."""
        row, channel = np.unravel_index(int(np.argmax(self.value)), self.value.shape)
        return float(self.value[row, channel]), float(self.degrees[row]), CHANNELS[channel]

    @property
    def words(self) -> str:
        """Whether energy is created, and where."""
        largest, at, channel = self.largest
        ranges = self.creates_energy
        if not ranges:
            sure = "" if largest <= 1 else " (within error)"
            return f"creates no energy{sure}: at most {albedo_number(largest)} ({channel}, {at:g}°)"
        where = " and ".join(f"{a:g}°" if a == b else f"{a:g}° ... {b:g}°" for a, b in ranges)
        return f"creates energy at {where}: at most {albedo_number(largest)}"


def albedo_curve(model: SplineBrdf, reference: AlbedoCurve | None = None) -> AlbedoCurve:
    """Return the albedo of ``model`` at ``ELEVATIONS``, with that of ``reference``, such as the unedited model's.

    Raises BvbError for a model that is no SplineBrdf, and a reference at other elevations.
    """
    if reference is not None and not np.array_equal(reference.degrees, ELEVATIONS):
        raise BvbError("The reference is a curve at other elevations. Give what albedo_curve() returned.")
    found = albedo(model, np.radians(ELEVATIONS))
    for array in (found.value, found.error):
        array.setflags(write=False)
    return AlbedoCurve(ELEVATIONS, found.value, found.error, None if reference is None else reference.value)


def albedo_number(value: float) -> str:
    """Return ``value`` with three digits, or as many as tell it from 1."""
    return f"{value:.4f}" if value != 1 and abs(value - 1) < 0.005 else number(value)
