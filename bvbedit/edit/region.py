"""Where an edit acts: intervals of angles, with a soft edge."""

from dataclasses import dataclass

import numpy as np

from bvbedit.brdf.charts import HALF_DIFF, IN_OUT, Chart
from bvbedit.brdf.geometry import Floats
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.edit.parameters import check_numbers, number
from bvbedit.errors import BvbError

Interval = tuple[float, float]

# Of half/difference angles, and of elevations and the azimuth between them.
HALF_ANGLES, PLAIN_ANGLES = ("theta_h", "theta_d", "phi_d"), ("theta_i", "theta_o", "phi")


@dataclass(frozen=True, kw_only=True)
class Region:
    """Pairs of directions whose angles (degrees) lie in all the intervals that are given; without any, all pairs.

    ``theta_h``, ``theta_d``, ``phi_d`` are half and difference angles as the half-diff chart folds them, ``theta_i``,
    ``theta_o`` the elevations and ``phi`` the azimuth between the directions, 0 on the same side, 180 on the mirror
    side. A pair whose directions are exchanged belongs to the region as well, so that edits keep reciprocity.
    Raises BvbError for intervals that are empty or leave the range of their angle.
    """

    theta_h: Interval | None = number(0, 90, "half angle", unit="degrees", default=None)
    theta_d: Interval | None = number(0, 90, "difference angle", unit="degrees", default=None)
    phi_d: Interval | None = number(0, 90, "difference azimuth, folded", unit="degrees", default=None)
    theta_i: Interval | None = number(0, 90, "elevation of the light", unit="degrees", default=None)
    theta_o: Interval | None = number(0, 90, "elevation of the viewer", unit="degrees", default=None)
    phi: Interval | None = number(0, 180, "azimuth between light and viewer", unit="degrees", default=None)
    falloff: float = number(0, 90, "width of the soft edge outside", unit="degrees", default=5.0)

    def __post_init__(self) -> None:
        check_numbers(self)
        for name in (*HALF_ANGLES, *PLAIN_ANGLES):
            interval = getattr(self, name)
            pair = isinstance(interval, tuple) and len(interval) == 2
            if interval is not None and not (pair and interval[0] <= interval[1]):
                given = list(interval) if isinstance(interval, tuple) else interval
                raise BvbError(f"{name} is {given}. Give two angles, the smaller one first.")

    @property
    def everywhere(self) -> bool:
        """Whether all pairs of directions belong to it."""
        return all(getattr(self, name) is None for name in (*HALF_ANGLES, *PLAIN_ANGLES))

    def weights(self, chart: Chart, points: Floats) -> Floats:
        """Return how much the ``points`` (..., 3) of a chart belong to the region (...): 1 inside, 0 beyond the edge.

        Beyond each interval it falls as a cubic smoothstep over ``falloff`` degrees; the product of all counts.
        """
        shape = points.shape[:-1]
        flat = np.ascontiguousarray(points.reshape(-1, 3))
        out = np.ones(len(flat))
        wanted = {name: getattr(self, name) for name in (*HALF_ANGLES, *PLAIN_ANGLES)}
        wanted = {name: interval for name, interval in wanted.items() if interval is not None}
        if any(name in HALF_ANGLES for name in wanted):
            halves = chart.angles(flat) if chart is HALF_DIFF else _half_angles(chart, flat)
            for k, name in enumerate(HALF_ANGLES):
                if name in wanted:
                    out *= self._share(halves[:, k], wanted[name])
        if any(name in PLAIN_ANGLES for name in wanted):
            theta_i, theta_o, phi = _plain_angles(chart, flat).T
            if "phi" in wanted:
                out *= self._share(phi, wanted["phi"])
            out *= np.maximum(self._elevations(theta_i, theta_o), self._elevations(theta_o, theta_i))
        return out.reshape(shape)

    def net_weights(self, model: SplineBrdf) -> Floats:
        """Return how much each control point (n_0, n_1, n_2) belongs to it, by its Greville abscissae.

        Raises BvbError where none does.
        """
        grid = np.stack(np.meshgrid(*model.spline.greville, indexing="ij"), axis=-1)
        out = self.weights(model.chart, np.clip(grid, 0.0, 1.0))
        if not out.any():
            raise BvbError("No control point lies in the region. Widen it or its falloff, or refine the model there.")
        return out

    def _elevations(self, theta_i: Floats, theta_o: Floats) -> Floats:
        out = np.ones(len(theta_i))
        for angles, interval in ((theta_i, self.theta_i), (theta_o, self.theta_o)):
            if interval is not None:
                out *= self._share(angles, interval)
        return out

    def _share(self, angles: Floats, interval: Interval) -> Floats:
        # Rounding of angles must not put the ends of an interval outside.
        away = np.maximum(np.maximum(interval[0] - angles, angles - interval[1]) - 1e-9, 0.0)
        share = np.clip(1 - away / self.falloff, 0.0, 1.0) if self.falloff > 0 else (away == 0).astype(np.float64)
        return np.asarray(share * share * (3 - 2 * share))


def _half_angles(chart: Chart, points: Floats) -> Floats:
    return HALF_DIFF.angles(HALF_DIFF.to_parameters(*chart.to_directions(points)))


def _plain_angles(chart: Chart, points: Floats) -> Floats:
    """Return theta_i, theta_o and phi in degrees (n, 3)."""
    if chart is IN_OUT:
        return np.asarray(IN_OUT.angles(points))
    wi, wo = chart.to_directions(points)
    elevations = [np.arctan2(np.hypot(w[:, 0], w[:, 1]), w[:, 2]) for w in (wi, wo)]
    cross, dot = wi[:, 0] * wo[:, 1] - wi[:, 1] * wo[:, 0], np.einsum("nc,nc->n", wi[:, :2], wo[:, :2])
    return np.asarray(np.degrees(np.stack([*elevations, np.arctan2(np.abs(cross), dot)], axis=-1)))
