"""How directions of light are drawn for a BRDF: densities over half vectors that are B-spline volumes themselves.

Lee & Park (2008) propose the pdf of a B-spline volume as another one. Here it is a density over half vectors h, given
wo, in s = 1 - cos theta_h and the azimuth phi of h relative to wo's: d omega_h = ds dphi, so that no Jacobian spoils
the peak. It is of degree one in each parameter, with control points that are never negative; the marginal and the
conditional distribution functions are splines of degree two, exact, and inverted by a quadratic equation.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bvbedit.brdf.charts import HALF_DIFF
from bvbedit.brdf.density import Density
from bvbedit.brdf.geometry import Floats, spherical
from bvbedit.errors import BvbError
from bvbedit.spline.tensor import TensorSpline

if TYPE_CHECKING:
    from bvbedit.brdf.base import Brdf

# Share of the directions drawn by the cosine: the density is never zero where the BRDF is not.
COSINE_SHARE = 0.05
# Nodes of theta_o and phi, and at least so many of s: as many for each knot of the model as make up that number.
ELEVATIONS, AZIMUTHS, HEIGHTS = 24, 13, 64
# Places in each span of s and of phi that its density is the mean of.
PLACES_S, PLACES_PHI = 3, 2
# Codes of a stored density for each factor of two.
STEPS_OF_OCTAVE = 4
# Elevations of wo stop so far above the horizon (radians).
LOWEST = 1e-3


@dataclass(frozen=True)
class HalfVectorDensity(Density):
    """A density of wi given wo: that of half vectors, and a small share by the cosine.

    ``spline`` has three parameters, theta_o / (pi/2), s and phi / pi, degree one in each, and one channel, never
    negative: its integral over s and phi in [0, pi] is the same for all theta_o.
    """

    spline: TensorSpline
    cosine_share: float = COSINE_SHARE

    @cached_property
    def _tables(self) -> tuple[Floats, ...]:
        """Nodes of theta_o, s and phi, values there, and their integrals, as the kernels want them."""
        nodes = [t[1:-1] for t in self.spline.knots]
        theta, s, phi = np.pi / 2 * nodes[0], np.array(nodes[1]), np.pi * nodes[2]
        p = self.spline.control[..., 0]
        rows = _running(p, phi)
        marginals = np.ascontiguousarray(rows[..., -1])
        columns = _running(marginals, s)
        total = columns[:, -1]
        return (
            theta,
            s,
            phi,
            np.ascontiguousarray(p / total[:, None, None]),
            np.ascontiguousarray(rows / total[:, None, None]),
            marginals / total[:, None],
            columns / total[:, None],
        )

    def sample(self, wo: Floats, u: Floats) -> tuple[Floats, Floats]:
        from bvbedit.brdf import sampling_kernels
        from bvbedit.jit import frozen

        wi, density = np.empty((len(wo), 3)), np.empty(len(wo))
        theta, s, phi, p, rows, marginals, columns = self._tables
        sampling_kernels.draw_directions(
            wo, frozen(u), theta, s, phi, p, rows, marginals, columns, self.cosine_share, wi, density
        )
        return wi, density

    def pdf(self, wi: Floats, wo: Floats) -> Floats:
        from bvbedit.brdf import sampling_kernels

        out = np.empty(len(wi))
        theta, s, phi, p, *_ = self._tables
        sampling_kernels.density_of(wi, wo, theta, s, phi, p, self.cosine_share, out)
        return out


def half_vector_density(brdf: "Brdf") -> HalfVectorDensity:
    """Return the density for ``brdf``: the mean over channels of f cos theta_i, as it falls on half vectors.

    A control point is the mean of what is to be approximated under its hat function: that is never negative, and the
    integral is kept. Black materials are sampled evenly over half vectors. Raises BvbError for values not finite.
    """
    theta, s, phi = _nodes(brdf)
    s_at, phi_at = _places(s, PLACES_S), _places(phi, PLACES_PHI)
    wo = spherical(np.minimum(theta, np.pi / 2 - LOWEST), 0.0)
    sin_h = np.sqrt(s_at * (2 - s_at))
    h = np.stack(
        np.broadcast_arrays(sin_h[:, None] * np.cos(phi_at), sin_h[:, None] * np.sin(phi_at), 1 - s_at[:, None]),
        axis=-1,
    )
    along = np.einsum("kc,ijc->kij", wo, h)
    wi = 2 * along[..., None] * h - wo[:, None, None]
    seen = (along > 0) & (wi[..., 2] > 0)
    value = np.zeros(along.shape)
    f = brdf.evaluate_unit(wi[seen], np.broadcast_to(wo[:, None, None], wi.shape)[seen])[0]
    if not np.isfinite(f).all():
        raise BvbError("The material gives values that are not finite. Check it.")
    value[seen] = f.mean(axis=1) * wi[seen][:, 2] * 4 * along[seen]
    # Sums of extreme reflectance leave the range of float64, and only its shape counts.
    largest = value.max(axis=(1, 2), keepdims=True)
    value = np.divide(value, largest, out=np.ones_like(value), where=largest > 0)
    control = np.einsum("ia,kab,jb->kij", _hat_means(s, s_at), value, _hat_means(phi, phi_at))
    return _density(control, theta, s, phi)


def coded(density: HalfVectorDensity) -> NDArray[np.uint8]:
    """Return the control points of a density in bytes: quarters of octaves below the largest of each theta_o, 0 for 0.

    Within 9 % of what they were, which changes the noise of samples by less, and nothing else. Differences modulo 256
    along s stand for them, so that they deflate to 4 KB.
    """
    p = density.spline.control[..., 0]
    with np.errstate(divide="ignore"):
        octaves = np.log2(p / p.max(axis=(1, 2), keepdims=True))
    codes = np.where(p > 0, np.clip(np.rint(255 + STEPS_OF_OCTAVE * octaves), 1, 255), 0).astype(np.uint8)
    return np.diff(codes, axis=1, prepend=np.uint8(0))


def decoded(codes: NDArray[np.uint8], brdf: "Brdf") -> HalfVectorDensity:
    """Return the density for ``brdf`` that ``coded`` made bytes of. Raises BvbError where it cannot be its own."""
    nodes = _nodes(brdf)
    size = tuple(len(x) for x in nodes)
    if codes.dtype != np.uint8 or codes.shape != size:
        raise BvbError(f"its pdf is {codes.dtype} of shape {codes.shape}, its knots ask for bytes of shape {size}.")
    codes = np.cumsum(codes, axis=1, dtype=np.uint8)
    control = np.where(codes > 0, np.exp2((codes.astype(np.float64) - 255) / STEPS_OF_OCTAVE), 0.0)
    if not codes.any(axis=(1, 2)).all():
        raise BvbError("its pdf is zero everywhere for some direction.")
    return _density(control, *nodes)


def _density(control: Floats, theta: Floats, s: Floats, phi: Floats) -> HalfVectorDensity:
    """Return the density with control points proportional to these (K, I, J) for each theta_o."""
    columns = _running(np.ascontiguousarray(_running(control, phi)[..., -1]), s)
    control = control / columns[:, -1, None, None]
    knots = [np.concatenate([[x[0]], x, [x[-1]]]) for x in (theta / theta[-1], s, phi / phi[-1])]
    return HalfVectorDensity(TensorSpline((1, 1, 1), knots, control[..., None]))


def _nodes(brdf: "Brdf") -> tuple[Floats, Floats, Floats]:
    """Return the nodes of theta_o, s and phi."""
    return np.linspace(0, np.pi / 2, ELEVATIONS), _heights(brdf), np.linspace(0, np.pi, AZIMUTHS)


def _heights(brdf: "Brdf") -> Floats:
    """Return nodes of s: the knots of theta_h where the model has them, else even in the root of theta_h."""
    u = np.linspace(0, 1, HEIGHTS + 1)
    if getattr(brdf, "chart", None) is HALF_DIFF and hasattr(brdf, "spline"):
        knots = np.unique(brdf.spline.knots[0])
        each = -(-HEIGHTS // (len(knots) - 1))
        u = np.interp(np.arange(each * (len(knots) - 1) + 1) / each, np.arange(len(knots)), knots)
    half = np.sin(np.pi / 4 * u**2)
    s: Floats = 2 * half * half
    s[-1] = 1.0
    return s


def _places(nodes: Floats, count: int) -> Floats:
    """Return ``count`` places in each interval of ``nodes``, the middles of equal parts."""
    inside = (np.arange(count) + 0.5) / count
    return np.asarray(nodes[:-1, None] + np.diff(nodes)[:, None] * inside).reshape(-1)


def _hat_means(nodes: Floats, places: Floats) -> Floats:
    """Return the matrix (nodes, places) of means under the hat function of each node."""
    hats = np.stack([np.interp(places, nodes, row) for row in np.eye(len(nodes))])
    weights = hats * np.repeat(np.diff(nodes), len(places) // (len(nodes) - 1))
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def _running(values: Floats, nodes: Floats) -> Floats:
    """Return integrals (..., n) along the last axis from the first node on, of what is linear between the nodes."""
    out = np.zeros_like(values)
    np.cumsum(0.5 * (values[..., 1:] + values[..., :-1]) * np.diff(nodes), axis=-1, out=out[..., 1:])
    return out
