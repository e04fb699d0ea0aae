"""Iso-parametric lines: reflectance along one axis of a chart, the other two parameters kept."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.charts import HALF_PI, Chart
from bvbedit.brdf.geometry import Floats
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.errors import BvbError
from bvbedit.spline.arguments import is_real_within, shown

# Even places along a line: a multiple of the nodes of all measurements, and a quarter of a degree where an axis has 90.
EVEN = 361
# Places in each span between knots.
IN_SPAN = 6
# Where a place stands off the straight line between its neighbours by more than this share of the whole height, on a
# linear or on a logarithmic scale, more are put beside it, in so many rounds. A mirror's peak is half a degree wide.
OFF, ROUNDS, MOST = 0.002, 3, 2400
# For that the logarithmic scale ends so far below the peak.
DECADES = 1e-5
# An angle that is constant along a line is so up to rounding (degrees).
CONSTANT = 1e-6


@dataclass(frozen=True, eq=False)
class IsoLine:
    """Reflectance along the line through ``at`` (chart parameters) on which only ``axis`` changes. Arrays read-only."""

    chart: Chart
    axis: int
    at: tuple[float, float, float]
    parameter: Floats
    """(n,) increasing from 0 to 1."""
    degrees: Floats
    """(n,) the angle of the axis on this very line."""
    model: Floats
    """(n, 3) in 1/sr; nan where the model has nothing to say."""
    reference: Floats | None
    """(n, 3) in 1/sr; nan where nothing reliable was measured."""
    knots: Floats
    """(m,) the knots of the axis, once each; none where the model is no spline on this chart."""
    at_knots: Floats
    """(m, 3) the model there."""
    title: str
    """Which line this is, in words."""

    @property
    def symbol(self) -> str:
        """The angle of the axis, such as θ_h."""
        return _symbol(self.chart, self.axis)


def iso_line(
    model: Brdf, reference: Brdf | None, *, chart: Chart, axis: int, at: tuple[float, float, float]
) -> IsoLine:
    """Return ``model`` and ``reference`` along ``axis`` (0, 1 or 2) of ``chart`` through ``at``, parameters in [0, 1].

    Raises BvbError for another axis, and a place outside the unit cube.
    """
    if axis not in (0, 1, 2):
        raise BvbError(f"axis is {shown(axis)}. A chart has axes 0, 1 and 2.")
    if len(at) != 3 or not all(is_real_within(x, 0.0, 1.0) for x in at):
        raise BvbError(f"at is {shown(at)}. Give three chart parameters in 0 ... 1.")
    place = (float(at[0]), float(at[1]), float(at[2]))
    on_chart = isinstance(model, SplineBrdf) and model.chart is chart
    knots = np.unique(model.spline.knots[axis]) if isinstance(model, SplineBrdf) and on_chart else np.zeros(0)
    brdfs = [model] if reference is None else [model, reference]

    parameter = _places(knots, place[axis])
    with _one_thread():
        values = _values(brdfs, chart, axis, place, parameter)
        for _ in range(ROUNDS):
            more = _missing(parameter, values)
            if len(more) == 0 or len(more) + len(parameter) > MOST:
                break
            order = np.argsort(np.concatenate([parameter, more]), kind="stable")
            values = np.concatenate([values, _values(brdfs, chart, axis, place, more)], axis=1)[:, order]
            parameter = np.concatenate([parameter, more])[order]

    angles = chart.angles(_points(axis, place, parameter))
    others = ", ".join(_fixed(chart, other, angles[:, other], place[other]) for other in range(3) if other != axis)
    arrays = [parameter, np.asarray(angles[:, axis]), values[0], knots, values[0][np.searchsorted(parameter, knots)]]
    for array in (*arrays, values):
        array.setflags(write=False)
    return IsoLine(
        chart=chart,
        axis=axis,
        at=place,
        parameter=arrays[0],
        degrees=arrays[1],
        model=arrays[2],
        reference=None if reference is None else values[1],
        knots=arrays[3],
        at_knots=arrays[4],
        title=f"along {_symbol(chart, axis)} at {others}",
    )


@contextmanager
def _one_thread() -> Iterator[None]:
    """Keep the kernels that this thread calls to itself.

    So few points gain nothing from more threads, and on a busy machine these wait for one another: 100 ms were seen.
    """
    import numba

    before = numba.get_num_threads()
    numba.set_num_threads(1)
    try:
        yield
    finally:
        numba.set_num_threads(before)


def _places(knots: Floats, own: float) -> Floats:
    """Return where to look first: even places, the ``knots`` and places between them, and ``own``."""
    inside = np.arange(IN_SPAN) / IN_SPAN
    between = (knots[:-1, None] + np.diff(knots)[:, None] * inside).ravel()
    return np.unique(np.concatenate([np.linspace(0.0, 1.0, EVEN), between, knots, [own]]))


def _missing(parameter: Floats, values: Floats) -> Floats:
    """Return more places (k,), in the middle of the stretches on both sides of where some of ``values`` bends."""
    t = np.diff(parameter)
    share = (t[:-1] / (t[:-1] + t[1:]))[:, None]
    with np.errstate(invalid="ignore"):
        bends = np.zeros(len(parameter), dtype=bool)
        for v in values:
            peak = float(np.nanmax(v)) if np.isfinite(v).any() else 0.0
            if peak <= 0:
                continue
            for scaled in (v / peak, np.log(np.maximum(v / peak, DECADES)) / np.log(DECADES)):
                straight = scaled[:-2] * (1 - share) + scaled[2:] * share
                bends[1:-1] |= (np.abs(scaled[1:-1] - straight) > OFF).any(axis=1)
    return np.asarray((parameter[:-1] + 0.5 * t)[bends[:-1] | bends[1:]])


def _points(axis: int, at: tuple[float, float, float], parameter: Floats) -> Floats:
    points = np.tile(np.array(at), (len(parameter), 1))
    points[:, axis] = parameter
    return points


def _values(brdfs: list[Brdf], chart: Chart, axis: int, at: tuple[float, float, float], parameter: Floats) -> Floats:
    """Return what each of ``brdfs`` says (k, n, 3), nan where no data stand behind it."""
    wi, wo = chart.to_directions(_points(axis, at, parameter))
    out = np.empty((len(brdfs), len(parameter), 3))
    for values, brdf in zip(out, brdfs, strict=True):
        values[:], trusted = brdf.evaluate_unit(wi, wo)
        if brdf.reliable_elevation >= HALF_PI:
            # At the horizon itself rounding decides whether it counts as beyond.
            smaller = np.minimum(wi[:, 2], wo[:, 2])
            trusted = trusted | ((smaller >= 0) & (smaller < np.finfo(np.float64).eps))
        values[~trusted] = np.nan
    return out


def _symbol(chart: Chart, axis: int) -> str:
    return chart.axes[axis].replace("theta", "θ").replace("phi", "φ")


def _fixed(chart: Chart, axis: int, degrees: Floats, parameter: float) -> str:
    """Return the fixed parameter of ``axis`` in words: its angle where that is one, else the share of its limit."""
    if np.ptp(degrees) < CONSTANT:
        return f"{_symbol(chart, axis)} = {float(f'{degrees[0]:.3g}'):g}°"
    return f"{_symbol(chart, axis)} = {float(f'{100 * parameter:.3g}'):g} %"
