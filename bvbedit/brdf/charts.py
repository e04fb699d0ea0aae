"""Charts: maps between pairs of directions and the unit cube in which a table or a spline volume lives."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bvbedit.brdf.geometry import Floats
from bvbedit.errors import BvbError
from bvbedit.spline.arguments import shown

HALF_PI = np.pi / 2


@dataclass(frozen=True)
class DegenerateFace:
    """The face parameter[axis] = 0, on which all parameters ``along`` are one and the same pair of directions.

    A model must be constant along it: its first ``layers`` layers of control points are equal to one another and do
    not vary ``along``. Two layers where the parameter is the square root of the angle from the pole: a function that
    is Lipschitz in the angle has derivative zero in its square root, and a net that ignores this has a cusp so sharp
    that 1e-9 rad show.
    """

    axis: int
    along: int
    layers: int


class Chart(ABC):
    """A map from pairs of unit vectors (wi, wo) above the horizon to parameters in the unit cube [0, 1]^3."""

    name: str
    axes: tuple[str, str, str]
    """The angle behind each axis; ``angles`` gives its value in degrees."""
    periodic: tuple[bool, bool, bool] = (False, False, False)
    degenerate_faces: tuple[DegenerateFace, ...] = ()
    reciprocal: bool
    """Whether (wi, wo) and (wo, wi) have the same parameters."""
    grid: tuple[Floats, Floats, Floats]
    """The nodes on which the chart's measurements are taken."""
    fitting_grid: tuple[Floats, Floats, Floats]
    """The nodes on which data are resampled before a fit; ``tests/benchmarks`` tells what that costs."""
    trial_grid: tuple[Floats, Floats, Floats]
    """Fewer nodes, to try whether the chart suits a material at all."""
    hold_order: tuple[int, int, int]
    """The axes along which a node without data takes the value of its smaller neighbour, the first choice first."""

    @abstractmethod
    def to_parameters(self, wi: Floats, wo: Floats) -> Floats:
        """Return parameters (n, 3) in [0, 1] of unit vectors ``wi``, ``wo`` (n, 3) on or above the horizon."""

    @abstractmethod
    def to_directions(self, parameters: Floats) -> tuple[Floats, Floats]:
        """Return one pair of unit vectors (n, 3), (n, 3) for ``parameters`` (n, 3) in [0, 1]."""

    @abstractmethod
    def jacobian(self, parameters: Floats) -> Floats:
        """Return d wi d wo / (du dv dw) (...) in sr^2, all pairs folded onto ``parameters`` (..., 3) counted."""

    @abstractmethod
    def angles(self, parameters: Floats) -> Floats:
        """Return the angles (..., 3) in degrees named by ``axes`` for ``parameters`` (..., 3)."""

    def __repr__(self) -> str:
        return f"<chart {self.name}>"

    def __reduce__(self) -> tuple[object, ...]:
        # Charts are told apart by identity: in another process, and in a copy, each is the one of its name.
        return chart_named, (self.name,)


class InOut(Chart):
    """The paper's chart: u = theta_i/(pi/2), v = theta_o/(pi/2), w = |phi_i - phi_o|/pi folded to [0, pi].

    w = 0 is the side of the light (retro-reflection), w = 1 the mirror side. Its grid is the paper's: 1 degree in the
    thetas, half a degree in phi.
    """

    name = "in-out"
    axes = ("theta_i", "theta_o", "phi")
    degenerate_faces = (DegenerateFace(axis=0, along=2, layers=1), DegenerateFace(axis=1, along=2, layers=1))
    reciprocal = False
    grid = (np.arange(91) / 90, np.arange(91) / 90, np.arange(361) / 360)
    fitting_grid = (np.arange(91) / 90, np.arange(91) / 90, np.arange(151) / 150)
    trial_grid = (np.arange(46) / 45, np.arange(46) / 45, np.arange(61) / 60)
    hold_order = (0, 1, 2)

    def to_parameters(self, wi: Floats, wo: Floats) -> Floats:
        from bvbedit.brdf import chart_kernels

        return chart_kernels.in_out_parameters(wi, wo)

    def to_directions(self, parameters: Floats) -> tuple[Floats, Floats]:
        from bvbedit.brdf import chart_kernels

        return chart_kernels.in_out_directions(parameters)

    def jacobian(self, parameters: Floats) -> Floats:
        theta_i, theta_o = HALF_PI * parameters[..., 0], HALF_PI * parameters[..., 1]
        folds, azimuths = 2.0, 2 * np.pi
        return np.asarray(np.sin(theta_i) * np.sin(theta_o) * HALF_PI**2 * np.pi * folds * azimuths)

    def angles(self, parameters: Floats) -> Floats:
        return np.asarray(parameters * (90.0, 90.0, 180.0))


class HalfDiff(Chart):
    """Half/difference angles (Rusinkiewicz 1998), folded for reciprocity and mirror symmetry, fitted to the horizon.

    u = sqrt(theta_h/(pi/2)); v = theta_d/theta_d_max with theta_d_max = atan2(cos theta_h, sin theta_h |cos phi_d|),
    the difference angle at which one of the directions reaches the horizon; w = phi_d/(pi/2) folded to [0, pi/2].
    The grid holds MERL's own nodes in theta_h and phi_d, and is nowhere coarser than MERL's one degree in theta_d.
    """

    name = "half-diff"
    axes = ("theta_h", "theta_d", "phi_d")
    degenerate_faces = (DegenerateFace(axis=0, along=2, layers=2), DegenerateFace(axis=1, along=2, layers=1))
    reciprocal = True
    grid = (np.arange(91) / 90, np.arange(91) / 90, np.arange(91) / 90)
    fitting_grid = (np.arange(91) / 90, np.arange(91) / 90, np.arange(61) / 60)
    trial_grid = (np.arange(91) / 90, np.arange(91) / 90, np.arange(19) / 18)
    hold_order = (1, 0, 2)

    def to_parameters(self, wi: Floats, wo: Floats) -> Floats:
        from bvbedit.brdf import chart_kernels

        return chart_kernels.half_diff_parameters(wi, wo)

    def to_directions(self, parameters: Floats) -> tuple[Floats, Floats]:
        from bvbedit.brdf import chart_kernels

        return chart_kernels.half_diff_directions(parameters)

    def _horizon(self, parameters: Floats) -> tuple[Floats, Floats]:
        """Return theta_h and theta_d_max (radians)."""
        theta_h, phi_d = HALF_PI * parameters[..., 0] ** 2, HALF_PI * parameters[..., 2]
        theta_d_max = np.arctan2(np.cos(theta_h), np.sin(theta_h) * np.abs(np.cos(phi_d)))
        return theta_h, np.where(np.cos(theta_h) < 1e-12, HALF_PI, theta_d_max)

    def jacobian(self, parameters: Floats) -> Floats:
        theta_h, theta_d_max = self._horizon(parameters)
        theta_d = parameters[..., 1] * theta_d_max
        folds, azimuths = 4.0, 2 * np.pi
        half_vector = 4 * np.cos(theta_d) * np.sin(theta_h) * np.sin(theta_d)
        return np.asarray(
            half_vector * theta_d_max * (np.pi * parameters[..., 0]) * HALF_PI * folds * azimuths, dtype=np.float64
        )

    def angles(self, parameters: Floats) -> Floats:
        theta_h, theta_d_max = self._horizon(parameters)
        return np.degrees(np.stack([theta_h, parameters[..., 1] * theta_d_max, HALF_PI * parameters[..., 2]], axis=-1))


class Rusinkiewicz(Chart):
    """The chart of a MERL table: u = sqrt(theta_h/(pi/2)), v = theta_d/(pi/2), w = phi_d/period, not folded.

    With period pi (MERL's 180 bins) reciprocity holds, as exchanging wi and wo adds pi to phi_d. Part of the cube lies
    below the horizon, so that this is a chart for tables, not for fitting.
    """

    axes = ("theta_h", "theta_d", "phi_d")
    periodic = (False, False, True)
    degenerate_faces = HalfDiff.degenerate_faces
    hold_order = (0, 1, 2)

    def __init__(self, name: str, period: float) -> None:
        bins = round(np.degrees(period))
        self.name, self.period = name, period
        self.reciprocal = bins == 180
        self.grid = (np.arange(90) / 90, np.arange(90) / 90, np.arange(bins) / bins)
        self.fitting_grid = self.trial_grid = self.grid

    def to_parameters(self, wi: Floats, wo: Floats) -> Floats:
        from bvbedit.brdf import chart_kernels

        return chart_kernels.rusinkiewicz_parameters(wi, wo, self.period)

    def to_directions(self, parameters: Floats) -> tuple[Floats, Floats]:
        """Return one pair; either may lie below the horizon."""
        from bvbedit.brdf import chart_kernels

        return chart_kernels.rusinkiewicz_directions(parameters, self.period)

    def jacobian(self, parameters: Floats) -> Floats:
        theta_h, theta_d = HALF_PI * parameters[..., 0] ** 2, HALF_PI * parameters[..., 1]
        folds, azimuths = 2 * np.pi / self.period, 2 * np.pi
        half_vector = 4 * np.cos(theta_d) * np.sin(theta_h) * np.sin(theta_d)
        return np.asarray(
            half_vector * (np.pi * parameters[..., 0]) * HALF_PI * self.period * folds * azimuths, dtype=np.float64
        )

    def angles(self, parameters: Floats) -> Floats:
        return np.asarray(
            np.stack(
                [90 * parameters[..., 0] ** 2, 90 * parameters[..., 1], np.degrees(self.period) * parameters[..., 2]],
                axis=-1,
            )
        )


IN_OUT = InOut()
HALF_DIFF = HalfDiff()
RUSINKIEWICZ = Rusinkiewicz("rusinkiewicz", np.pi)
RUSINKIEWICZ_360 = Rusinkiewicz("rusinkiewicz-360", 2 * np.pi)

CHARTS: dict[str, Chart] = {c.name: c for c in (IN_OUT, HALF_DIFF, RUSINKIEWICZ, RUSINKIEWICZ_360)}
FITTING_CHARTS = (IN_OUT.name, HALF_DIFF.name)


def chart_named(name: str) -> Chart:
    """Return the chart called ``name``. Raises BvbError that lists the names where there is none."""
    if not isinstance(name, str) or name not in CHARTS:
        raise BvbError(f"Unknown chart {shown(name)}. Choose one of {', '.join(CHARTS)}.")
    return CHARTS[name]


def grid_points(axes: tuple[ArrayLike, ...]) -> Floats:
    """Return all nodes (n_0 * n_1 * ..., d) of the grid with the given axes, the last axis running fastest."""
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes)).astype(np.float64)
