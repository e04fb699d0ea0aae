"""A BRDF as chart + encoding + B-spline volume: the BVB of Lee & Park (2008), with any chart and encoding."""

from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.charts import FITTING_CHARTS, Chart, chart_named
from bvbedit.brdf.density import Density
from bvbedit.brdf.encodings import Encoding, check_encoding
from bvbedit.brdf.geometry import Bools, Floats
from bvbedit.brdf.storage import FLOAT32, Storage
from bvbedit.errors import BvbError
from bvbedit.spline.arguments import shown
from bvbedit.spline.tensor import TensorSpline


class SplineBrdf(Brdf):
    """A B-spline volume of encoded RGB reflectance over the unit cube of a chart.

    ``spline`` has three parameters on [0, 1] and three channels. ``report`` tells how the model was fitted, as JSON
    can hold it; an edited model (``with_spline``) has none, since it would no longer be true. ``storage`` is how a file
    holds the control points, unless another way is asked for; here they are as exact as they came. ``density`` is that
    by which directions are drawn, where it is known; an edited model builds its own.
    Raises BvbError for a spline of another shape or domain, charts that only tables have, no Encoding, no Storage.
    """

    reliable_elevation = float(np.pi / 2)

    def __init__(
        self,
        spline: TensorSpline,
        chart: Chart,
        encoding: Encoding,
        report: Mapping[str, Any] | None = None,
        *,
        storage: Storage = FLOAT32,
        density: Density | None = None,
    ) -> None:
        if spline.parameters != 3 or spline.channels != 3 or spline.domain != ((0.0, 1.0),) * 3:
            raise BvbError(f"{spline!r} on {spline.domain} is no BRDF. Give 3 parameters on [0, 1] and 3 channels.")
        check_fitting_chart(chart)
        check_encoding(encoding)
        if not isinstance(storage, Storage):
            raise BvbError(f"{shown(storage)} is no way to store a net. Give one like Storage('float16').")
        self.spline = spline
        self.chart = chart
        self.encoding = encoding
        self.storage = storage
        self.report: Mapping[str, Any] = MappingProxyType(dict(report or {}))
        if density is not None:
            # What the property would have to build first.
            self.__dict__["density"] = density

    def __repr__(self) -> str:
        return f"<SplineBrdf {self.chart.name}, {self.encoding.name}, size {self.spline.size}>"

    def __reduce__(self) -> tuple[Any, ...]:
        # Charts are told apart by identity, which a copy in another process would lose.
        return _from_parts, (self.spline, self.chart.name, self.encoding, dict(self.report), self.storage)

    @property
    def reciprocal(self) -> bool:  # type: ignore[override]
        """Whether the chart makes f(wi, wo) = f(wo, wi)."""
        return self.chart.reciprocal

    def with_spline(self, spline: TensorSpline) -> "SplineBrdf":
        """Return the model with the same chart, encoding and storage and an edited ``spline``."""
        return SplineBrdf(spline, self.chart, self.encoding, storage=self.storage)

    def stored_as(self, storage: Storage) -> "SplineBrdf":
        """Return the same model, for files that hold its control points in another way."""
        return SplineBrdf(self.spline, self.chart, self.encoding, self.report, storage=storage)

    def told(self, **more: Any) -> "SplineBrdf":
        """Return the same model with ``more`` in its report."""
        return SplineBrdf(self.spline, self.chart, self.encoding, {**self.report, **more}, storage=self.storage)

    def albedo(self, theta_o: ArrayLike) -> Floats:
        """Return the directional albedo (..., 3) for elevations ``theta_o`` (...) of wo, in radians.

        Raises BvbError for elevations outside [0, pi/2]. ``plausibility.albedo`` tells the error, too.
        """
        from bvbedit.brdf.albedo import albedo_value

        return albedo_value(self, theta_o)

    def _evaluate(self, wi: Floats, wo: Floats) -> tuple[Floats, Bools]:
        f = self.encoding.decode(self.spline.evaluate_inside(self.chart.to_parameters(wi, wo)))
        return f, np.ones(len(f), dtype=bool)


def _from_parts(
    spline: TensorSpline, chart: str, encoding: Encoding, report: Mapping[str, Any], storage: Storage
) -> SplineBrdf:
    return SplineBrdf(spline, chart_named(chart), encoding, report, storage=storage)


def check_fitting_chart(chart: Chart) -> None:
    """Raise BvbError for a chart that only tables have, and for no chart."""
    if not isinstance(chart, Chart):
        raise BvbError(f"{shown(chart)} is no chart. Give what chart_named() returns.")
    if chart.name not in FITTING_CHARTS:
        raise BvbError(f"Chart {chart.name!r} is for tables only. A model lives in {' or '.join(FITTING_CHARTS)}.")


def keep_faces(control: Floats, chart: Chart) -> Floats:
    """Return the nearest net (n_0, n_1, n_2, c) that is constant where the chart's degenerate faces demand it.

    An orthogonal projection: the faces' groups of equal control points are nested or disjoint, so that taking the
    means one face after the other is exact. A net with a single layer on an axis keeps that one.
    """
    out = np.array(control)
    for layers, across in _faces(out, chart):
        low, high = layers.min(axis=across, keepdims=True), layers.max(axis=across, keepdims=True)
        # The mean of equal numbers may be another, by rounding.
        layers[:] = np.where(low == high, low, layers.mean(axis=across, keepdims=True))
    return out


def face_spread(control: Floats, chart: Chart) -> float:
    """Return by how much control points differ (largest difference of a channel) that a degenerate face wants equal."""
    return max((float(np.ptp(layers, axis=across).max()) for layers, across in _faces(control, chart)), default=0.0)


def _faces(control: Floats, chart: Chart) -> Iterator[tuple[Floats, tuple[int, int]]]:
    """Yield, for each degenerate face, a view of its layers and the axes of that view across which they are equal."""
    for face in chart.degenerate_faces:
        # After moveaxis the axis ``along`` stands one place later if it came before the face's own.
        along = face.along + (face.along < face.axis)
        yield np.moveaxis(control, face.axis, 0)[: face.layers], (0, along)
