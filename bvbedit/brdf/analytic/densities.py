"""Densities of the analytic models' own lobes, drawn by inverting their distribution functions."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bvbedit.brdf.density import Density
from bvbedit.brdf.geometry import Floats

NORMAL = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Cosine(Density):
    """cos theta_i / pi: a Lambertian surface."""

    def sample(self, wo: Floats, u: Floats) -> tuple[Floats, Floats]:
        # Here, so that whoever evaluates models only does not wait for numba.
        from bvbedit.brdf.sampling_kernels import draw_by_cosine

        wi, density = np.empty((len(wo), 3)), np.empty(len(wo))
        draw_by_cosine(u, wi, density)
        return wi, density

    def pdf(self, wi: Floats, _wo: Floats) -> Floats:
        return np.asarray(np.maximum(wi[:, 2], 0.0) / np.pi)


@dataclass(frozen=True)
class Beckmann(Density):
    """Half vectors by D cos theta_h, D = exp(-tan^2 theta_h / m^2) / (pi m^2 cos^4 theta_h): Cook-Torrance's, Ward's.

    Source: Walter et al. 2007, equation 28.
    """

    m: float

    def sample(self, wo: Floats, u: Floats) -> tuple[Floats, Floats]:
        tan2 = -(self.m**2) * np.log1p(-u[:, 0])
        return _mirrored(self, wo, _at_slope(tan2, 2 * np.pi * u[:, 1]))

    def pdf(self, wi: Floats, wo: Floats) -> Floats:
        h, along = _half(wi, wo)
        sin2, cos2 = h[:, 0] ** 2 + h[:, 1] ** 2, h[:, 2] ** 2
        m2 = self.m**2
        with np.errstate(divide="ignore", over="ignore", under="ignore"):
            density = np.exp(-sin2 / (m2 * cos2)) / (np.pi * m2 * cos2 * h[:, 2]) / (4 * along)
        return np.where((h[:, 2] > 0) & (along > 0), density, 0.0)


@dataclass(frozen=True)
class HalfPower(Density):
    """Half vectors by (n + 1)/(2 pi) cos^n theta_h: Blinn-Phong's.

    Source: PBRT, first edition, section 15.5 (sampling the Blinn distribution).
    """

    n: float

    def sample(self, wo: Floats, u: Floats) -> tuple[Floats, Floats]:
        # 1/cos^2 - 1 by expm1, so that narrow lobes keep their digits.
        tan2 = np.expm1(-2 / (self.n + 1) * np.log1p(-u[:, 0]))
        return _mirrored(self, wo, _at_slope(tan2, 2 * np.pi * u[:, 1]))

    def pdf(self, wi: Floats, wo: Floats) -> Floats:
        h, along = _half(wi, wo)
        seen = (h[:, 2] > 0) & (along > 0)
        sin2 = np.minimum(h[:, 0] ** 2 + h[:, 1] ** 2, 1 - 1e-15)
        power = np.exp(0.5 * self.n * np.log1p(-sin2))
        return np.where(seen, (self.n + 1) / (2 * np.pi) * power / (4 * np.where(seen, along, 1.0)), 0.0)


@dataclass(frozen=True)
class VisibleGGX(Density):
    """Half vectors by G1(wo) (wo.h) D / cos theta_o: those GGX facets that the viewer sees.

    Source: Heitz, "Sampling the GGX distribution of visible normals", JCGT 7(4), 2018; drawn from spherical caps,
    Dupuy & Benyoub, "Sampling visible GGX normals with spherical caps", HPG 2023.
    """

    alpha: float

    def sample(self, wo: Floats, u: Floats) -> tuple[Floats, Floats]:
        a = np.array([self.alpha, self.alpha, 1.0])
        straight = _unit(wo * a)
        phi = 2 * np.pi * u[:, 1]
        z = (1 - u[:, 0]) * (1 + straight[:, 2]) - straight[:, 2]
        radius = np.sqrt(np.clip(1 - z * z, 0.0, 1.0))
        h = _unit((np.stack([radius * np.cos(phi), radius * np.sin(phi), z], axis=-1) + straight) * a)
        return _mirrored(self, wo, h)

    def pdf(self, wi: Floats, wo: Floats) -> Floats:
        h, along = _half(wi, wo)
        a2 = self.alpha**2
        D = 1 / (np.pi * a2 * (h[:, 2] ** 2 + (h[:, 0] ** 2 + h[:, 1] ** 2) / a2) ** 2)
        # G1 / cos theta_o with the cosine cancelled, so that the horizon needs no care.
        visible = 2 / (wo[:, 2] + np.sqrt(a2 * (wo[:, 0] ** 2 + wo[:, 1] ** 2) + wo[:, 2] ** 2))
        return np.where((h[:, 2] > 0) & (along > 0), visible * D / 4, 0.0)


@dataclass(frozen=True)
class CosinePower(Density):
    """(n + 1)/(2 pi) cos^n of the angle to (c_xy wo.x, c_xy wo.y, c_z wo.z): a lobe of Lafortune's model.

    What points below the horizon is rejected.
    """

    c_xy: float
    c_z: float
    n: float

    def _axis(self, wo: Floats) -> Floats:
        axis = wo * [self.c_xy, self.c_xy, self.c_z]
        return np.where((np.abs(axis).max(axis=1) > 0)[:, None], _unit(axis), NORMAL)

    def sample(self, wo: Floats, u: Floats) -> tuple[Floats, Floats]:
        axis = self._axis(wo)
        x, y = _frame(axis)
        cosine, phi = (1 - u[:, 0]) ** (1 / (self.n + 1)), 2 * np.pi * u[:, 1]
        sine = np.sqrt(np.maximum(1 - cosine * cosine, 0.0))
        wi = x * (sine * np.cos(phi))[:, None] + y * (sine * np.sin(phi))[:, None] + axis * cosine[:, None]
        return _kept(wi, self.pdf(wi, wo))

    def pdf(self, wi: Floats, wo: Floats) -> Floats:
        cosine = np.clip(np.einsum("nc,nc->n", wi, self._axis(wo)), 0.0, 1.0)
        return np.where(wi[:, 2] > 0, (self.n + 1) / (2 * np.pi) * cosine**self.n, 0.0)


class Mixture(Density):
    """One of several densities, each with its share of the samples; shares are scaled to sum up to one."""

    def __init__(self, parts: Sequence[Density], shares: Sequence[float] | None = None) -> None:
        given = np.ones(len(parts)) if shares is None else np.asarray(shares, dtype=np.float64)
        given = given if given.sum() > 0 else np.ones(len(parts))
        self.parts = tuple(parts)
        self.shares: Floats = given / given.sum()

    def sample(self, wo: Floats, u: Floats) -> tuple[Floats, Floats]:
        edges = np.concatenate([[0.0], np.cumsum(self.shares)])
        edges[-1] = 1.0
        which = np.clip(np.searchsorted(edges, u[:, 0], side="right") - 1, 0, len(self.parts) - 1)
        wi = np.empty((len(wo), 3))
        rejected = np.zeros(len(wo), dtype=bool)
        for k, part in enumerate(self.parts):
            mine = which == k
            # What is left of the number that chose is even in [0, 1) again.
            rest = np.clip((u[mine, 0] - edges[k]) / (edges[k + 1] - edges[k]), 0.0, np.nextafter(1.0, 0.0))
            wi[mine], density = part.sample(wo[mine], np.stack([rest, u[mine, 1]], axis=-1))
            rejected[mine] = density == 0
        return _kept(wi, np.where(rejected, 0.0, self.pdf(wi, wo)))

    def pdf(self, wi: Floats, wo: Floats) -> Floats:
        return np.asarray(sum(share * part.pdf(wi, wo) for share, part in zip(self.shares, self.parts, strict=True)))


def _unit(v: Floats) -> Floats:
    return np.asarray(v / np.maximum(np.linalg.norm(v, axis=1), np.finfo(float).tiny)[:, None])


def _half(wi: Floats, wo: Floats) -> tuple[Floats, Floats]:
    """Return h (n, 3) and wo.h (n,)."""
    h = _unit(wi + wo)
    return h, np.einsum("nc,nc->n", wo, h)


def _at_slope(tan2: Floats, phi: Floats) -> Floats:
    """Return the normals (n, 3) whose slope has the square ``tan2``."""
    cosine = 1 / np.sqrt(1 + tan2)
    sine = np.sqrt(tan2) * cosine
    return np.stack([sine * np.cos(phi), sine * np.sin(phi), cosine], axis=-1)


def _frame(axis: Floats) -> tuple[Floats, Floats]:
    """Return two unit vectors (n, 3) at right angles to ``axis`` (n, 3) and to one another."""
    helper = np.where((np.abs(axis[:, 2]) < 0.9)[:, None], NORMAL, [1.0, 0.0, 0.0])
    x = _unit(np.cross(helper, axis))
    return x, np.cross(axis, x)


def _mirrored(density: Density, wo: Floats, h: Floats) -> tuple[Floats, Floats]:
    """Return the mirror images of ``wo`` in ``h`` and their density."""
    along = np.einsum("nc,nc->n", wo, h)
    wi = 2 * along[:, None] * h - wo
    wi[along <= 0] = -NORMAL
    return _kept(wi, density.pdf(wi, wo))


def _kept(wi: Floats, density: Floats) -> tuple[Floats, Floats]:
    """Return the samples, rejected where they are below the horizon or have no density."""
    kept = (wi[:, 2] > 0) & (density > 0)
    return np.where(kept[:, None], wi, NORMAL), np.where(kept, density, 0.0)
