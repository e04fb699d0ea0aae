"""The few verbs of the Python surface, composed from the rooms."""

from collections.abc import Callable, Sequence
from os import PathLike
from time import perf_counter
from typing import TYPE_CHECKING

from bvbedit.brdf.base import Brdf, check_brdf
from bvbedit.brdf.blend import blend
from bvbedit.brdf.fit import AUTO
from bvbedit.brdf.geometry import Floats
from bvbedit.brdf.metrics import Comparison, compare
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.errors import BvbError
from bvbedit.fitting import fitted, wished
from bvbedit.io import load, save
from bvbedit.render import render

if TYPE_CHECKING:
    from bvbedit.render.scene import Scene

__all__ = ["Comparison", "blend", "compare", "fit", "load", "render", "save"]


def fit(
    brdf: Brdf,
    *,
    chart: str = AUTO,
    encoding: str = AUTO,
    size: Sequence[int] | None = None,
    degrees: Sequence[int] = (3, 3, 3),
    knots: str = "dominant",
    max_bytes: int | None = None,
    max_payload: int | None = None,
    tolerance: float | None = None,
    metric: str = "log_cosine_rms",
    weights: Callable[[Floats], Floats] | None = None,
    scene: "str | PathLike[str] | Scene | None" = None,
    precision: str = AUTO,
    thorough: bool = False,
    smoothing: float | str | None = None,
    source: str = "",
    progress: Callable[[float], None] | None = None,
) -> SplineBrdf:
    """Return an editable B-spline volume that approximates ``brdf``, with a report.

    ``chart``: ``half-diff`` (sharp highlights), ``in-out`` (the paper's), or ``auto``: the better one by a quick fit.
    ``encoding``: ``linear``, ``root``, ``log``, or ``auto``. ``knots``: ``dominant`` (where the material has features),
    ``free`` (moved from there by NLopt), ``averaged``, ``piegl-tiller`` (the paper's) or ``uniform``.

    How large: ``size``, control points along each axis; ``max_bytes``, of the saved file; ``max_payload``, bytes of
    the control net and interior knots as stored; or ``tolerance``, of the metric over both of its sample sets. They
    exclude each other. With none of them the net is as large as the knee of the error curve asks for.

    ``metric`` names what is to be small: ``log_cosine_rms``, ``fores``, ``relative_l1``, or ``e_rms``, the root mean
    square of the paper's error E: in its chart and encoding alone, and lofted as the paper does, over any knots.
    ``weights``, a function of chart parameters (n, 3) that returns (n,) >= 0, multiplies the weights that
    follow from it. ``scene``, as ``render`` has it, replaces both: what counts is what that scene shows of the
    material, on an 8-bit screen; ``tolerance`` then bounds the root mean square error of its pixels, 0 ... 1
    (``picture_rms``). ``precision``: ``quantised`` (``auto``, but ``float32`` in the paper's configurations; it adds
    4 % to the error), ``float16``, ``float32`` or ``float64``.
    ``smoothing`` penalises differences of the net, for noisy data: a strength, or ``auto`` for the one that generalised
    cross-validation finds. ``thorough`` takes more steps on the metric itself and seconds longer. ``source`` names the
    data in the report, whose bytes count too.

    ``report`` tells what was tried, the error curve, how sound the model is, and how far from ``brdf``, measured over
    50,000 pairs of each sample set (``report["metrics"]``).

    Raises BvbError for unknown names, a net larger than the data, bounds too small for any net, and a tolerance that
    cannot be reached.

    >>> from bvbedit.brdf.analytic import Lambert
    >>> model = fit(Lambert((0.5, 0.5, 0.5)), size=(4, 4, 4))
    >>> round(float(model.evaluate([0, 0, 1], [1, 0, 1])[0]), 5)
    0.15915
    """
    start = perf_counter()
    check_brdf(brdf, "brdf")
    wish = wished(
        chart=chart,
        encoding=encoding,
        size=size,
        degrees=degrees,
        knots=knots,
        max_bytes=max_bytes,
        max_payload=max_payload,
        tolerance=tolerance,
        metric=metric,
        weights=weights,
        precision=precision,
        thorough=thorough,
        smoothing=smoothing,
        source=source,
    )
    interest = None
    if scene is not None:
        if weights is not None:
            raise BvbError("weights and scene exclude each other. Give one of them.")
        from bvbedit.render.footprint import footprint

        interest = footprint(brdf, scene)
    return fitted(brdf, wish, interest=interest, more=lambda _: {"seconds": perf_counter() - start}, progress=progress)
