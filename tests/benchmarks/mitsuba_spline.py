"""A B-spline BRDF as a BSDF of Mitsuba 3, in Python, for its vectorised variants: what its own users would write."""

from types import ModuleType
from typing import Any

import numpy as np

from bvbedit.brdf.encodings import Linear, Log, Root
from bvbedit.brdf.spline_brdf import SplineBrdf

HALF_PI = np.pi / 2
# Equal bins for each control point, by which the span of a parameter is found.
BINS = 4


def register(mi: ModuleType, dr: ModuleType, name: str, model: SplineBrdf, alpha: float, cosine_share: float) -> None:
    """Let the BSDF ``name`` of Mitsuba be ``model``, sampled by a GGX lobe of roughness ``alpha`` and the cosine."""

    class SplineBsdf(mi.BSDF):  # type: ignore[misc, name-defined]
        def __init__(self, props: Any) -> None:
            mi.BSDF.__init__(self, props)
            flags = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide
            self.m_components = [flags]
            self.m_flags = flags
            self.volume = Volume(mi, dr, model)
            self.facets = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, alpha)

        def density(self, wi: Any, wo: Any) -> Any:
            h = dr.normalize(wi + wo)
            lobe = self.facets.pdf(wi, h) / (4.0 * dr.maximum(dr.dot(wo, h), 1e-12))
            return cosine_share * wo.z / dr.pi + (1.0 - cosine_share) * lobe

        def sample(self, _context: Any, si: Any, sample1: Any, sample2: Any, active: Any) -> Any:
            h, _ = self.facets.sample(si.wi, sample2)
            mirrored = mi.reflect(si.wi, h)
            wo = dr.select(sample1 < cosine_share, mi.warp.square_to_cosine_hemisphere(sample2), mirrored)
            active &= (si.wi.z > 0) & (wo.z > 0)
            bs = mi.BSDFSample3f()
            bs.wo, bs.eta, bs.sampled_component = wo, 1.0, 0
            bs.sampled_type = mi.UInt32(+mi.BSDFFlags.GlossyReflection)
            bs.pdf = dr.select(active, self.density(si.wi, wo), 0.0)
            weight = self.volume(wo, si.wi, active) * (wo.z / dr.maximum(bs.pdf, 1e-20))
            return bs, dr.select(active & (bs.pdf > 0), weight, 0.0)

        def eval(self, _context: Any, si: Any, wo: Any, active: Any) -> Any:
            active &= (si.wi.z > 0) & (wo.z > 0)
            return dr.select(active, self.volume(wo, si.wi, active) * wo.z, 0.0)

        def pdf(self, _context: Any, si: Any, wo: Any, active: Any) -> Any:
            active &= (si.wi.z > 0) & (wo.z > 0)
            return dr.select(active, self.density(si.wi, wo), 0.0)

        def eval_pdf(self, _context: Any, si: Any, wo: Any, active: Any) -> Any:
            active &= (si.wi.z > 0) & (wo.z > 0)
            f = self.volume(wo, si.wi, active) * wo.z
            return dr.select(active, f, 0.0), dr.select(active, self.density(si.wi, wo), 0.0)

    mi.register_bsdf(name, SplineBsdf)


class Volume:
    """A tricubic B-spline volume over a chart, encoded, as arrays of Dr.Jit."""

    def __init__(self, mi: ModuleType, dr: ModuleType, model: SplineBrdf) -> None:
        assert model.spline.degrees == (3, 3, 3)
        self.mi, self.dr, self.model = mi, dr, model
        self.size = model.spline.size
        self.knots = [mi.Float(t.astype(np.float32)) for t in model.spline.knots]
        self.bins, self.steps = zip(*(self._bins(t) for t in model.spline.knots), strict=True)
        # Four channels, so that a control point is one gather.
        control = np.concatenate([model.spline.control, np.zeros((*self.size, 1))], axis=-1)
        self.control = mi.Float(control.reshape(-1).astype(np.float32))

    def _bins(self, t: np.ndarray) -> tuple[Any, int]:
        """Return the span at the left end of each bin, and how many spans a bin can hold beyond it."""
        count = BINS * (len(t) - 4)
        edges = np.linspace(0, 1, count + 1).astype(np.float32)
        spans = np.clip(np.searchsorted(t.astype(np.float32), edges, side="right") - 1, 3, len(t) - 5)
        return self.mi.UInt32(spans[:-1].astype(np.uint32)), int(np.diff(spans).max())

    def __call__(self, wi: Any, wo: Any, active: Any) -> Any:
        """Return f."""
        mi, dr = self.mi, self.dr
        u = self.half_diff(wi, wo) if self.model.chart.name == "half-diff" else self.in_out(wi, wo)
        spans, weights = zip(*(self.basis(axis, x, active) for axis, x in enumerate(u)), strict=True)
        n1, n2 = self.size[1:]
        corner = ((spans[0] - 3) * n1 + spans[1] - 3) * n2 + spans[2] - 3
        total = mi.Vector4f(0.0)
        for i in range(4):
            for j in range(4):
                row = mi.Vector4f(0.0)
                for k in range(4):
                    point = dr.gather(mi.Vector4f, self.control, corner + ((i * n1 + j) * n2 + k), active)
                    row = dr.fma(point, weights[2][k], row)
                total = dr.fma(row, weights[0][i] * weights[1][j], total)
        return self.decoded(mi.Color3f(total.x, total.y, total.z))

    def basis(self, axis: int, x: Any, active: Any) -> tuple[Any, list[Any]]:
        """Return the span of ``x`` and its four basis functions (The NURBS Book, algorithm A2.2)."""
        mi, dr, knots = self.mi, self.dr, self.knots[axis]
        count = BINS * self.size[axis]
        span = dr.gather(mi.UInt32, self.bins[axis], mi.UInt32(dr.clip(x * count, 0, count - 1)), active)
        for _ in range(self.steps[axis]):
            later = (x >= dr.gather(mi.Float, knots, span + 1, active)) & (span < self.size[axis] - 1)
            span = dr.select(later, span + 1, span)
        t = [dr.gather(mi.Float, knots, span - 2 + m, active) for m in range(6)]
        out = [mi.Float(1.0)]
        for degree in range(1, 4):
            saved, raised = mi.Float(0.0), []
            for r in range(degree):
                right, left = t[3 + r], t[3 + r - degree]
                share = out[r] / (right - left)
                raised.append(saved + (right - x) * share)
                saved = (x - left) * share
            out = [*raised, saved]
        return span, out

    def half_diff(self, wi: Any, wo: Any) -> tuple[Any, Any, Any]:
        mi, dr = self.mi, self.dr
        s, k = wi + wo, wi - wo
        length, across = dr.norm(s), dr.norm(k)
        horizontal = dr.sqrt(s.x * s.x + s.y * s.y)
        theta_h, theta_d = dr.atan2(horizontal, s.z), dr.atan2(across, length)
        level = horizontal > 0
        inverse = dr.rcp(dr.select(level, horizontal, 1.0))
        cosine, sine = dr.select(level, s.x * inverse, 1.0), dr.select(level, s.y * inverse, 0.0)
        dx = (s.z * (cosine * k.x + sine * k.y) - horizontal * k.z) / length
        dy = cosine * k.y - sine * k.x
        phi_d = dr.atan2(dr.abs(dy), dr.abs(dx))
        sin_h, cos_h = horizontal / length, s.z / length
        theta_d_max = dr.atan2(cos_h, sin_h * dr.cos(phi_d))
        parts = dr.sqrt(theta_h / HALF_PI), theta_d / dr.maximum(theta_d_max, 1e-12), phi_d / HALF_PI
        u, v, w = (dr.clip(mi.Float(p), 0.0, 1.0) for p in parts)
        return u, v, w

    def in_out(self, wi: Any, wo: Any) -> tuple[Any, Any, Any]:
        mi, dr = self.mi, self.dr
        cross, dot = wi.x * wo.y - wi.y * wo.x, wi.x * wo.x + wi.y * wo.y
        theta_i, theta_o = (dr.atan2(dr.sqrt(d.x * d.x + d.y * d.y), d.z) / HALF_PI for d in (wi, wo))
        parts = theta_i, theta_o, dr.atan2(dr.abs(cross), dot) / np.pi
        u, v, w = (dr.clip(mi.Float(p), 0.0, 1.0) for p in parts)
        return u, v, w

    def decoded(self, y: Any) -> Any:
        dr, encoding = self.dr, self.model.encoding
        y = dr.maximum(y, 0.0)
        if isinstance(encoding, Root):
            return y * y * y if encoding.k == 3 else y**encoding.k
        if isinstance(encoding, Log):
            return encoding.eps * (dr.exp(y) - 1.0)
        assert isinstance(encoding, Linear)
        return y
