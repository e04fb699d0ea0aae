"""Fitting: how a measurement becomes a model, and, as an edit, how a model becomes another of other size or kind."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, ClassVar, Literal

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.geometry import Floats
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.edit.operation import Edit
from bvbedit.edit.parameters import check_choices, check_numbers, choice, given, number
from bvbedit.edit.resampling import distance
from bvbedit.errors import BvbError
from bvbedit.fitting import LARGEST_BUDGET, Progress, fitted, wished
from bvbedit.spline.knots import MAX_DEGREE

Three = tuple[int, int, int]

# Control points along an axis: no data carry more.
LONGEST = 1000
# What a report calls that to which an edit fits.
SOURCE = "the model before"


@dataclass(frozen=True, kw_only=True)
class FitOptions:
    """How a measurement becomes a model; names, meanings and defaults are those of ``bvbedit.fit``.

    Raises BvbError for all that can be known to be wrong before there are data.
    """

    chart: Literal["auto", "in-out", "half-diff"] = choice(
        "half-diff (for sharp highlights), in-out (rough materials) or auto: the better one by a quick trial",
        default="auto",
    )
    encoding: Literal["auto", "linear", "root", "log"] = choice(
        "what is approximated: reflectance (linear), its cube root or its logarithm; auto: root or log", default="auto"
    )
    size: Three | None = number(1, LONGEST, "control points along each axis", whole=True, default=None)
    degrees: Three = number(0, MAX_DEGREE, "degree along each axis", whole=True, default=(3, 3, 3))
    knots: Literal["dominant", "free", "averaged", "piegl-tiller", "uniform"] = choice(
        "dominant (where the material has features), free (moved from there), averaged, piegl-tiller or uniform",
        default="dominant",
    )
    max_bytes: int | None = number(
        1,
        LARGEST_BUDGET,
        "largest file, in place of a size; its history is extra",
        unit="bytes",
        whole=True,
        default=None,
    )
    max_payload: int | None = number(
        1,
        LARGEST_BUDGET,
        "most of control points and knots alone, in place of a size",
        unit="bytes",
        whole=True,
        default=None,
    )
    tolerance: float | None = number(1e-12, 1e12, "largest metric, in place of a size", default=None)
    metric: Literal["log_cosine_rms", "fores", "relative_l1", "e_rms"] = choice(
        "what is to be small: log_cosine_rms, fores, relative_l1, or e_rms (the paper's, in-out and linear)",
        default="log_cosine_rms",
    )
    precision: Literal["auto", "float16", "float32", "float64", "quantised"] = choice(
        "how a file holds control points; auto is quantised, but float32 in the paper's configuration", default="auto"
    )
    thorough: bool = choice("more steps on the metric itself, seconds longer", default=False)

    def __post_init__(self) -> None:
        check_numbers(self)
        check_choices(self)
        wished(**self.options())
        if self.size is not None and any(n <= p for n, p in zip(self.size, self.degrees, strict=True)):
            least = ", ".join(str(p + 1) for p in self.degrees)
            raise BvbError(f"size is {list(self.size)}. Give at least {least} for degrees {list(self.degrees)}.")

    def options(self) -> dict[str, Any]:
        """Return the arguments of ``fitting.wished``, which are those of ``bvbedit.fit``."""
        return {f.name: getattr(self, f.name) for f in fields(FitOptions)}

    def to_dict(self) -> dict[str, Any]:
        """Return the options that are not left at their defaults, as TOML and JSON can hold them."""
        return given(self)

    def fitted(self, brdf: Brdf, progress: Progress | None = None) -> SplineBrdf:
        """Return the model; ``progress`` is told the share that is done, of each net that is tried.

        The report tells no source and no time, whose bytes would count: a recipe makes the same model again, bit for
        bit where OpenBLAS has as many threads (OPENBLAS_NUM_THREADS; the commands give it one).
        Raises BvbError where there is none within the bounds.
        """
        return fitted(brdf, wished(**self.options()), progress=progress)


@dataclass(frozen=True, kw_only=True)
class Fit(Edit, FitOptions):
    """The present model, fitted anew.

    ``max_bytes`` bounds the file that ``save`` makes of the model; the history that a document saves with it is extra.
    """

    op: Literal["fit"] = "fit"
    about: ClassVar[str] = "fitted anew: within bytes, to a tolerance, or in another chart, encoding, size or knots"

    def __post_init__(self) -> None:
        Edit.__post_init__(self)
        FitOptions.__post_init__(self)

    def apply(self, model: SplineBrdf) -> SplineBrdf:
        return self.fitted(model)

    def fitted(self, brdf: Brdf, progress: Progress | None = None) -> SplineBrdf:
        """Return the edited model, as ``apply`` does; ``progress`` is told the share done, of each net tried.

        Its report, but for ``notes`` and ``refit_error``, is that of a fit: its metrics are the distance to ``brdf``.
        """

        def more(model: SplineBrdf) -> Mapping[str, Any]:
            errors = model.report["metrics"]
            size = " x ".join(map(str, model.spline.size))
            note = (
                f"{model.chart.name}, {model.encoding.name}, {size}: {self.metric} to the model before "
                f"{errors['grid'][self.metric]:.3g} (grid), {errors['nodes'][self.metric]:.3g} (nodes)"
            )
            return {"refit_error": _refit_error(model, brdf), "notes": [*model.report["notes"], note]}

        return fitted(brdf, wished(**self.options(), source=SOURCE), more=more, progress=progress)


def _refit_error(model: SplineBrdf, brdf: Brdf) -> float:
    """Return the same figure as ``resampling`` has it."""

    def encoded(points: Floats) -> Floats:
        return model.encoding.encode(brdf.evaluate_unit(*model.chart.to_directions(points))[0])

    return distance(model, encoded)
