"""A simulated measurement: any BRDF as the table that an instrument would have made of it."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from bvbedit.brdf.base import Brdf, check_brdf
from bvbedit.brdf.charts import HALF_DIFF, IN_OUT, RUSINKIEWICZ, Chart, grid_points
from bvbedit.brdf.geometry import Floats
from bvbedit.brdf.measured import MeasuredBrdf
from bvbedit.errors import BvbError
from bvbedit.spline.arguments import is_real_within, is_whole, shown


@dataclass(frozen=True)
class Grid:
    """The nodes that an instrument visits: ``axes`` in parameters of ``chart``, none of them beyond ``limits``."""

    chart: Chart
    axes: tuple[Floats, Floats, Floats]
    limits: tuple[float, float, float] = (1.0, 1.0, 1.0)


# At 90 degrees proper f is not defined: the last node stands 1e-4 rad above the horizon.
_LAST = 1 - 1e-4 / (np.pi / 2)

GRIDS: Mapping[str, Grid] = MappingProxyType(
    {
        "merl": Grid(RUSINKIEWICZ, RUSINKIEWICZ.grid),
        "paper": Grid(IN_OUT, IN_OUT.grid, (_LAST, _LAST, 1.0)),
        "half-diff": Grid(HALF_DIFF, HALF_DIFF.grid, (1.0, _LAST, 1.0)),
    }
)

# A pair is in sight where both directions rise above the horizon by more than rounding.
HORIZON = 1e-9

# The instrument's additive noise is that of a grey of this reflectance (1/sr) lit at normal incidence ...
FLOOR = 5e-3
# ... over the cosine of the light's elevation, no less than that of half a degree above the horizon.
LEAST_COSINE = float(np.sin(np.radians(0.5)))
# The brightest reading (1/sr), about what published tables of mirrors hold, and the significant bits of a reading.
SATURATION = 1e4
BITS = 11


def measure(brdf: Brdf, grid: str = "merl", noise: float = 0.0, seed: int = 0) -> MeasuredBrdf:
    """Return the table that a goniophotometer makes of ``brdf``: values in 1/sr, linear RGB.

    ``grid`` "merl": 90 x 90 x 180 nodes on chart "rusinkiewicz"; nodes with a direction on or below the horizon are
    invalid (the published files are so masked too, give or take 4 degrees beyond it; above it they have no gaps).
    ``grid`` "paper": 91 x 91 x 361 nodes on chart "in-out", elevations capped at 90 degrees - 1e-4 rad, all valid.
    ``grid`` "half-diff": 91 x 91 x 91 nodes on chart "half-diff", theta_d as much below the horizon's.

    ``noise`` = 0 is the ideal instrument: valid nodes equal ``brdf.evaluate`` exactly. With ``noise`` > 0 each node and
    channel, mirror pairs and exchanged pairs included, is read independently with the standard deviation
    noise sqrt(f^2 + (5e-3 / cos theta_i)^2): ``noise`` relative to the value, as exposures are bracketed to the same
    photon count, and a floor of dark noise that the division by the light's cosine raises towards grazing (cos theta_i
    no less than 0.0087). Readings saturate at 1e4, are rounded to 11 significant bits, and are clamped at 0, as a
    negative value would mark an invalid cell in a MERL file: in the dark the mean is therefore a little too high.
    ``seed`` >= 0 chooses the readings (PCG64); the same seed gives the same table.

    Raises BvbError for no Brdf, an unknown grid, noise outside [0, 1] or a seed that is not a whole number >= 0.
    """
    check_brdf(brdf, "brdf")
    if not isinstance(grid, str) or grid not in GRIDS:
        raise BvbError(f"Unknown grid {shown(grid)}. Choose one of {', '.join(GRIDS)}.")
    if not is_real_within(noise, 0, 1):
        raise BvbError(f"noise is {shown(noise)}. Give a relative standard deviation from 0 to 1.")
    if not is_whole(seed) or seed < 0:
        raise BvbError(f"seed is {shown(seed)}. Give a whole number from 0 up.")
    where = GRIDS[grid]
    shape = tuple(len(a) for a in where.axes)
    values, valid = np.zeros((*shape, 3)), np.zeros(shape, dtype=bool)
    generator = np.random.Generator(np.random.PCG64(seed))
    # One layer of the first axis at a time keeps the directions and temporaries in megabytes.
    for i, u in enumerate(where.axes[0]):
        nodes = grid_points((np.array([u]), *where.axes[1:]))
        wi, wo = where.chart.to_directions(np.minimum(nodes, where.limits))
        seen = np.minimum(wi[:, 2], wo[:, 2]) > HORIZON
        wi, wo = wi[seen], wo[seen]
        f = brdf.evaluate(wi, wo)
        if noise > 0:
            f = _read(f, wi[:, 2], noise, generator)
        seen = seen.reshape(shape[1:])
        values[i][seen] = f
        valid[i] = seen
    return MeasuredBrdf(values, valid, where.axes, where.chart)


def _read(f: Floats, cos_i: Floats, noise: float, generator: np.random.Generator) -> Floats:
    """Return readings (n, 3) of ``f`` (n, 3): noisy, saturated, rounded, not negative."""
    floor = FLOOR / np.maximum(cos_i, LEAST_COSINE)
    # A shot and a floor that are both normal add up to one normal deviate.
    f = f + noise * np.hypot(f, floor[:, None]) * generator.standard_normal(f.shape)
    mantissa, exponent = np.frexp(np.clip(f, 0, SATURATION))
    return np.asarray(np.ldexp(np.round(mantissa * 2**BITS), exponent - BITS))
