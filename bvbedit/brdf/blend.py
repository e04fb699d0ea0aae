"""Two materials mixed: their control nets exactly, or what they reflect, refitted where nets cannot say it."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.encodings import Linear, Log
from bvbedit.brdf.fit import Progress, fit_over
from bvbedit.brdf.geometry import Bools, Floats
from bvbedit.brdf.metrics import estimate
from bvbedit.brdf.sample_sets import LARGEST_REFLECTANCE
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.brdf.structure import FACE_ROUNDING, with_faces
from bvbedit.errors import BvbError
from bvbedit.spline import compatible
from bvbedit.spline.arguments import shown
from bvbedit.spline.tensor import TensorSpline

# The encodings in which the two spaces of reflectance are mixed; a net in that encoding is mixed exactly.
SPACES = {"net": None, "linear": Linear(), "log": Log(1e-3)}


class Mixture(Brdf):
    """decode((1 - t) encode(f_a) + t encode(f_b)) in the encoding of a space, t as ``blend`` takes it."""

    reliable_elevation = float(np.pi / 2)

    def __init__(self, a: SplineBrdf, b: SplineBrdf, t: "Floats | TensorSpline", encoding: Linear | Log) -> None:
        self.a, self.b, self.t, self.encoding = a, b, t, encoding

    @property
    def reciprocal(self) -> bool:  # type: ignore[override]
        """Whether both materials are."""
        return self.a.reciprocal and self.b.reciprocal

    def _evaluate(self, wi: Floats, wo: Floats) -> tuple[Floats, Bools]:
        t = self.t
        if isinstance(t, TensorSpline):
            t = t.evaluate(self.a.chart.to_parameters(wi, wo))
        # Beyond what a fit takes in, 1e5 /sr, the clamp keeps extrapolated mixtures in the range of float64.
        y_a, y_b = (
            self.encoding.encode(np.minimum(m.evaluate_unit(wi, wo)[0], LARGEST_REFLECTANCE)) for m in (self.a, self.b)
        )
        return self.encoding.decode((1 - t) * y_a + t * y_b), np.ones(len(wi), dtype=bool)


def blend(
    a: SplineBrdf,
    b: SplineBrdf,
    t: "ArrayLike | TensorSpline",
    space: str = "net",
    *,
    progress: Progress | None = None,
) -> SplineBrdf:
    """Return the material between ``a`` (t = 0) and ``b`` (t = 1), with a report of how it was mixed.

    ``t`` is a number, three (one for each of R, G and B), or a spline over the unit cube of the chart of ``a`` with one
    or three channels. Outside [0, 1] it extrapolates, and the report notes so. The spaces:

    - ``net``: control points are mixed, exactly; both models need the same chart and encoding.
    - ``linear``: (1 - t) f_a + t f_b.
    - ``log``: log(1 + f / 1e-3) is mixed.

    The last two are exact on nets where both models have that encoding and one chart. Otherwise the mixture is sampled
    and refitted in the chart and encoding of ``a``, over the knots of both if they share the chart and else those of
    ``a``; ``report["metrics"]`` tells how far the model is from the mixture.
    Raises BvbError for models that are none, an unknown space, nets that cannot be mixed, and another ``t``.
    """
    for model in (a, b):
        if not isinstance(model, SplineBrdf):
            raise BvbError(f"{shown(model)} is no model. Fit measurements first, then blend the models.")
    if not isinstance(space, str) or space not in SPACES:
        raise BvbError(f"Unknown space {shown(space)}. Choose one of {', '.join(SPACES)}.")
    share = _share(t)
    encoding = SPACES[space]
    alike = a.chart is b.chart and a.encoding == b.encoding
    if space == "net" and not alike:
        raise BvbError(
            f"Nets of {_kind(a)} and of {_kind(b)} cannot be mixed. Choose space linear or log, or fit both alike."
        )
    told: dict[str, Any] = {"space": space, "t": None if isinstance(share, TensorSpline) else share.tolist()}
    if isinstance(share, TensorSpline):
        outside = bool(share.control.min() < 0 or share.control.max() > 1)
    else:
        outside = bool((share < 0).any() or (share > 1).any())
        if not share.any() or (share == 1).all():
            end = b if share.any() else a
            return end.with_spline(end.spline).told(blend={**told, "exact": True}, notes=[])
    notes = ["t lies outside [0, 1]: the mixture extrapolates"] if outside else []
    if encoding is None or (alike and a.encoding == encoding):
        _, merged = compatible.make_compatible(a.spline, b.spline)
        if merged:
            notes.append(f"{len(merged)} knots that were equal up to rounding were united")
        spline = compatible.blend(a.spline, b.spline, share)
        model = with_faces(spline, a, b)
        moved = float(np.abs(model.spline.control - spline.control).max())
        exact = moved <= FACE_ROUNDING * float(np.abs(spline.control).max())
        if not exact:
            notes.append(f"t is not flat at a degenerate face: encoded values were changed by up to {moved:.3g} there")
        return model.told(blend={**told, "exact": exact}, notes=notes)
    mixture = Mixture(a, b, share, encoding)
    like = compatible.make_compatible(a.spline, b.spline)[0][0] if a.chart is b.chart else a.spline
    fitted = fit_over(mixture, a.chart, a.encoding, like.knots, like.degrees, progress=progress).stored_as(a.storage)
    metrics = estimate(fitted, mixture).to_dict()
    notes = [
        *notes,
        "sampled and refitted: metrics tell how far the model is from the mixture",
        *fitted.report["notes"],
    ]
    return fitted.told(blend={**told, "exact": False}, metrics=metrics, notes=notes)


def _share(t: "ArrayLike | TensorSpline") -> "Floats | TensorSpline":
    if isinstance(t, TensorSpline):
        if t.parameters != 3 or t.channels not in (1, 3) or t.domain != ((0.0, 1.0),) * 3:
            raise BvbError(f"t is {t!r}. Give a spline of 3 parameters on [0, 1] and 1 or 3 channels, or numbers.")
        return t
    return compatible.checked_factor(t, 3, "t")


def _kind(model: SplineBrdf) -> str:
    parameters = model.encoding.to_dict()
    name = parameters.pop("name")
    settings = ", ".join(f"{k} = {v:g}" for k, v in parameters.items())
    return f"{model.chart.name}, {name}" + (f" ({settings})" if settings else "")
