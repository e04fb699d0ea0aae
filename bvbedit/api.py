"""The few verbs of the Python surface, composed from the rooms."""

from collections.abc import Callable, Sequence
from typing import Any

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.blend import blend
from bvbedit.brdf.charts import FITTING_CHARTS, Chart, chart_named
from bvbedit.brdf.encodings import encoding_named
from bvbedit.brdf.fit import fit_net
from bvbedit.brdf.metrics import Comparison, compare
from bvbedit.brdf.spline_brdf import SplineBrdf, payload_bytes
from bvbedit.errors import BvbError
from bvbedit.io import load, save
from bvbedit.io.bvb import PRECISIONS, dumps
from bvbedit.render import render
from bvbedit.spline.arguments import one_per_axis
from bvbedit.spline.knots import checked_degree

__all__ = ["Comparison", "blend", "compare", "fit", "load", "render", "save"]

DEFAULT_MAX_BYTES = 48 * 1024
# Every fifth node of each axis: 0.1 s in place of several, and enough to tell a good fit from a bad one.
REPORT_STRIDE = 5
# How many control points the axes of a chart get, relative to one another. For `half-diff` the best of nine
# proportions at 4,000 points in the geometric mean over six measured materials; for `in-out` the paper's n, n, 4n.
PROPORTIONS = {"half-diff": (9.0, 3.6, 1.0), "in-out": (1.0, 1.0, 4.0)}


def fit(
    brdf: Brdf,
    *,
    chart: str = "half-diff",
    encoding: str = "root",
    size: Sequence[int] | None = None,
    degrees: Sequence[int] = (3, 3, 3),
    knots: str = "averaged",
    max_bytes: int | None = None,
    max_payload: int | None = None,
    precision: str = "float32",
    progress: Callable[[float], None] | None = None,
) -> SplineBrdf:
    """Return an editable B-spline volume that approximates ``brdf``, with a report.

    ``chart``: ``half-diff`` (sharp highlights) or ``in-out`` (the paper's); ``encoding``: ``linear``, ``root`` or
    ``log``; ``size``: control points along each axis; ``knots``: ``averaged``, ``piegl-tiller`` or ``uniform``.
    In place of ``size``: ``max_bytes`` bounds the saved file, ``max_payload`` the control net and interior knots, both
    as stored in ``precision`` (float16, float32 or float64). With none of the three the bound is 48 KiB.
    ``report["metrics"]`` compares the model with ``brdf`` on every fifth node of each axis.

    Raises BvbError for unknown names, a net larger than the data, and bounds too small for any net.

    >>> from bvbedit.brdf.analytic import Lambert
    >>> model = fit(Lambert((0.5, 0.5, 0.5)), size=(4, 4, 4))
    >>> round(float(model.evaluate([0, 0, 1], [1, 0, 1])[0]), 6)
    0.159155
    """
    if sum(x is not None for x in (size, max_bytes, max_payload)) > 1:
        raise BvbError("size, max_bytes and max_payload exclude each other. Give one of them.")
    if chart not in FITTING_CHARTS:
        chart_named(chart)
        raise BvbError(f"Chart {chart!r} is for tables only. Fit in one of {', '.join(FITTING_CHARTS)}.")
    if precision not in PRECISIONS:
        raise BvbError(f"Unknown precision {precision!r}. Choose one of {', '.join(PRECISIONS)}.")
    degrees = tuple(checked_degree(p) for p in one_per_axis(degrees, "Degrees"))
    if len(degrees) != 3:
        raise BvbError(f"{len(degrees)} degrees given. Give three, one for each axis.")
    fitting_chart = chart_named(chart)

    def model_of(net: Sequence[int]) -> SplineBrdf:
        model = fit_net(
            brdf, fitting_chart, encoding_named(encoding), size=net, degrees=degrees, knots=knots, progress=progress
        )
        metrics: dict[str, Any] = {"stride": REPORT_STRIDE, **compare(model, brdf, stride=REPORT_STRIDE).to_dict()}
        return model.told(metrics=metrics)

    if size is not None:
        return model_of(size)
    if max_payload is not None:
        return model_of(_largest_net(fitting_chart, degrees, precision, max_payload))
    bound = DEFAULT_MAX_BYTES if max_bytes is None else max_bytes
    allowance = bound
    while True:
        # What meta.json, the zip's directory and deflation do to a file is known only when it is written.
        model = model_of(_largest_net(fitting_chart, degrees, precision, allowance))
        excess = len(dumps(model, precision)) - bound
        if excess <= 0:
            return model
        allowance -= excess


def _largest_net(chart: Chart, degrees: Sequence[int], precision: str, payload: int) -> tuple[int, int, int]:
    """Return the largest net in the chart's proportions whose payload is within ``payload`` bytes."""
    smallest = [p + 1 for p in degrees]
    largest = [len(u) for u in chart.grid]
    best = None
    for step in range(1, 100 * max(largest)):
        net = tuple(
            min(max(round(share * step / 100), low), high)
            for share, low, high in zip(PROPORTIONS[chart.name], smallest, largest, strict=True)
        )
        if payload_bytes(net, degrees, precision) > payload:
            break
        best = net
    if best is None:
        need = payload_bytes(smallest, degrees, precision)
        raise BvbError(
            f"{payload} bytes hold no net of degrees {tuple(degrees)}: the smallest takes {need}. Allow more."
        )
    return best[0], best[1], best[2]
