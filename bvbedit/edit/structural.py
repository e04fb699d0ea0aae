"""Edits of the net: finer or coarser, higher or lower degrees. See ``brdf.structure``."""

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from bvbedit.brdf import structure
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.brdf.storage import Storage, storage_named
from bvbedit.edit.operation import Edit
from bvbedit.edit.parameters import choice, number
from bvbedit.errors import BvbError
from bvbedit.spline.knots import MAX_DEGREE

Axis = Literal[0, 1, 2]
AXIS = "0, 1 or 2: theta_h, theta_d, phi_d or theta_i, theta_o, phi, as the model's chart has it"


# Control points that a net may grow to: 100 MB, a hundred times what a material needs.
LARGEST_NET = 1 << 22


def _spans(model: SplineBrdf, axis: int) -> int:
    return len(np.unique(model.spline.knots[axis])) - 1


def _check_larger(model: SplineBrdf, axis: int, more: int) -> None:
    """Raise BvbError where ``more`` control points along an axis would make the net too large."""
    size = [n + (more if a == axis else 0) for a, n in enumerate(model.spline.size)]
    if np.prod(size, dtype=float) > LARGEST_NET:
        shape = " x ".join(map(str, size))
        raise BvbError(f"The net would have {shape} control points, more than {LARGEST_NET:,} in all. Ask for fewer.")


@dataclass(frozen=True, kw_only=True)
class InsertKnots(Edit):
    """More control points, the same material. Source: ``TensorSpline.insert_knots``."""

    op: Literal["insert_knots"] = "insert_knots"
    axis: int = number(0, 2, AXIS, whole=True)
    at: tuple[float, ...] | float = number(0, 1, "chart parameters of the new knots")
    about: ClassVar[str] = "more control points in chosen places, the same material"

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "at", self.at if isinstance(self.at, tuple) else (self.at,))
        if not self.at:
            raise BvbError("at is empty. Give the chart parameter of at least one knot.")

    def apply(self, model: SplineBrdf) -> SplineBrdf:
        assert isinstance(self.at, tuple)  # since it was made
        _check_larger(model, self.axis, len(self.at))
        return structure.refine(model, self.axis, at=self.at)


@dataclass(frozen=True, kw_only=True)
class Refine(Edit):
    """Each span cut into equal parts, the same material."""

    op: Literal["refine"] = "refine"
    axis: int = number(0, 2, AXIS, whole=True)
    factor: int = number(2, 64, "parts of each span", whole=True, default=2)
    about: ClassVar[str] = "more control points everywhere, the same material"

    def apply(self, model: SplineBrdf) -> SplineBrdf:
        _check_larger(model, self.axis, (self.factor - 1) * _spans(model, self.axis))
        return structure.refine(model, self.axis, factor=self.factor)


@dataclass(frozen=True, kw_only=True)
class RemoveKnots(Edit):
    """As few knots as a tolerance allows."""

    op: Literal["remove_knots"] = "remove_knots"
    axis: int = number(0, 2, AXIS, whole=True)
    tolerance: float = number(0, 1e300, "largest change of the encoded value, certified")
    about: ClassVar[str] = "fewer control points, a bounded change"

    def apply(self, model: SplineBrdf) -> SplineBrdf:
        edited, bound = structure.remove(model, self.axis, self.tolerance)
        return edited.told(notes=[f"encoded values changed by at most {bound:.3g}"])


@dataclass(frozen=True, kw_only=True)
class Elevate(Edit):
    """A higher degree, the same material."""

    op: Literal["elevate"] = "elevate"
    axis: int = number(0, 2, AXIS, whole=True)
    by: int = number(1, MAX_DEGREE, "by how much", whole=True, default=1)
    about: ClassVar[str] = "a higher degree, the same material"

    def apply(self, model: SplineBrdf) -> SplineBrdf:
        _check_larger(model, self.axis, self.by * _spans(model, self.axis))
        return structure.elevate(model, self.axis, self.by)


@dataclass(frozen=True, kw_only=True)
class Reduce(Edit):
    """A lower degree, the nearest material."""

    op: Literal["reduce"] = "reduce"
    axis: int = number(0, 2, AXIS, whole=True)
    by: int = number(1, MAX_DEGREE, "by how much", whole=True, default=1)
    tolerance: float | None = number(0, 1e300, "refuse a larger change of the encoded value", default=None)
    about: ClassVar[str] = "a lower degree, the nearest material"

    def apply(self, model: SplineBrdf) -> SplineBrdf:
        edited, bound = structure.reduce(model, self.axis, self.by, self.tolerance)
        return edited.told(notes=[f"encoded values changed by at most {bound:.3g}"])


@dataclass(frozen=True, kw_only=True)
class Store(Edit):
    """Control points as a file holds them: what was saved, opened and edited on is replayed exactly by this step."""

    op: Literal["store"] = "store"
    precision: Literal["float16", "float32", "float64", "quantised"] = choice("how a file holds control points")
    step: float | None = number(0, 1e300, "of quantised control points, encoded values", default=None)
    about: ClassVar[str] = "rounded to what a file holds"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.precision != "quantised" or self.step is not None:
            Storage(self.precision, self.step)

    def apply(self, model: SplineBrdf) -> SplineBrdf:
        if self.precision == "quantised" and self.step is None:
            storage = storage_named(self.precision, model.spline.control)
        else:
            storage = Storage(self.precision, self.step)
        spline = model.spline
        return model.with_spline(spline.with_control(storage.rounded(spline.control))).stored_as(storage)
