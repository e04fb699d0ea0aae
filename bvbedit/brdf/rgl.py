"""An isotropic RGB measurement in the adaptive parameterisation of Dupuy & Jakob (2018)."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.geometry import Bools, Floats
from bvbedit.errors import BvbError


class RglBrdf(Brdf):
    """A measurement of the RGL database: the mean of f(wi, wo) and f(wo, wi), negative values taken as zero.

    For n elevations of the light ``theta_i`` (n,) in radians, increasing in [0, pi/2]: ``vndf`` (n, height, width),
    the density of visible normals, turns the half vector into a uniform sample, at which ``rgb`` (n, 3, rows, columns)
    is looked up; the result times ``ndf`` / (4 ``sigma``), where ``jacobian`` says so, is f_r times cos theta_o.
    ``ndf`` and ``sigma`` are images over (azimuth, elevation). The raw data are not reciprocal (2 to 11 % median) and
    beyond 85 degrees hardly measured: elevations above are held at 85 degrees, their azimuth kept.

    Raises BvbError for shapes that do not fit, values that are not finite, and densities that cannot be ones.
    """

    reliable_elevation = float(np.radians(85.0))
    reciprocal = True

    def __init__(
        self,
        *,
        theta_i: ArrayLike,
        sigma: ArrayLike,
        ndf: ArrayLike,
        vndf: ArrayLike,
        rgb: ArrayLike,
        jacobian: bool,
        description: str = "",
    ) -> None:
        fields = {"theta_i": theta_i, "sigma": sigma, "ndf": ndf, "vndf": vndf, "rgb": rgb}
        a = {name: np.array(value, dtype=np.float64, order="C") for name, value in fields.items()}
        _check(a)
        self.theta_i, self.sigma, self.ndf, self.rgb = a["theta_i"], a["sigma"], a["ndf"], a["rgb"]
        self.readings = self.rgb.size // 3
        self.jacobian = bool(jacobian)
        self.description = description
        self.vndf, self._conditional, self._marginal = _distributions(a["vndf"])
        for value in vars(self).values():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)

    def __repr__(self) -> str:
        return f"<RglBrdf {self.description!r}, {len(self.theta_i)} elevations, {self.rgb.shape[2:]} samples>"

    def _evaluate(self, wi: Floats, wo: Floats) -> tuple[Floats, Bools]:
        from bvbedit.brdf import rgl_kernels

        f = rgl_kernels.evaluate(
            wi,
            wo,
            self.reliable_elevation,
            self.theta_i,
            self.sigma,
            self.ndf,
            self.vndf,
            self._conditional,
            self._marginal,
            self.rgb,
            self.jacobian,
        )
        return f, np.ones(len(f), dtype=bool)


def _check(fields: Mapping[str, Floats]) -> None:
    n = len(fields["theta_i"]) if fields["theta_i"].ndim == 1 else 0
    leading: dict[str, tuple[int, ...]] = {"sigma": (), "ndf": (), "vndf": (n,), "rgb": (n, 3)}
    for name, shape in leading.items():
        got = fields[name].shape
        if n == 0 or got[:-2] != shape or len(got) != len(shape) + 2 or min(got[-2:]) < 2:
            wanted = ", ".join([*map(str, shape), "rows", "columns"])
            raise BvbError(
                f"The field {name} has shape {got}. With {n} elevations it needs ({wanted}), rows, columns > 1."
            )
    for name, values in fields.items():
        # Twice the exponent's range is left for products and sums.
        if not (np.abs(values) < 1e30).all():
            raise BvbError(f"The field {name} holds {values[~(np.abs(values) < 1e30)][0]}. Measured values are finite.")
    theta = fields["theta_i"]
    # float32 rounds pi/2 up.
    if theta[0] < 0 or theta[-1] > np.pi / 2 + 1e-6 or not (np.diff(theta) > 0).all():
        raise BvbError("The elevations theta_i do not increase within [0, pi/2]. Give radians, in order.")
    if fields["sigma"].min() < 1e-6:
        raise BvbError(f"The field sigma holds {fields['sigma'].min():g}. A projected area is positive.")
    for name in ("ndf", "vndf"):
        if fields[name].min() < 0:
            raise BvbError(f"The field {name} holds {fields[name].min():g}. A density is not negative.")
    if not (fields["vndf"].reshape(n, -1).max(axis=1) > 1e-30).all():
        raise BvbError("The field vndf has an image of zeros. A density integrates to one.")


def _distributions(vndf: Floats) -> tuple[Floats, Floats, Floats]:
    """Return ``vndf`` scaled to sum one over its cells, and its distribution functions (exact: it is bilinear).

    The one along x is (n, height, width), that of whole rows along y (n, height); both begin with zero.
    """
    conditional = _integral(vndf)
    marginal = _integral(conditional[..., -1])
    total = marginal[:, -1]
    return vndf / total[:, None, None], conditional / total[:, None, None], marginal / total[:, None]


def _integral(values: Floats) -> Floats:
    """Return the running trapezoid sums along the last axis, in units of a cell."""
    out = np.zeros_like(values)
    np.cumsum(0.5 * (values[..., 1:] + values[..., :-1]), axis=-1, out=out[..., 1:])
    return out
