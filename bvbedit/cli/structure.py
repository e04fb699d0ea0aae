"""Commands that edit a model's control net: refine, remove, elevate, reduce, blend."""

from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter, Token

from bvbedit.cli.models import Json
from bvbedit.cli.output import progress, report


def _numbers(_type: Any, tokens: tuple[Token, ...]) -> tuple[float, ...]:
    try:
        return tuple(float(part) for part in tokens[0].value.split(","))
    except ValueError:
        raise ValueError(f"{tokens[0].value!r} is no list of numbers. Give them like 0.25,0.5.") from None


Numbers = Annotated[tuple[float, ...], Parameter(converter=_numbers, n_tokens=1, accepts_keys=False)]


def refine(
    source: Path,
    target: Path,
    /,
    *,
    axis: int,
    at: Numbers | None = None,
    factor: int | None = None,
    as_json: Json = False,
) -> None:
    """Insert knots: more control points, the same material.

    Parameters
    ----------
    source
        The .bvb model to refine.
    target
        The .bvb file to write.
    axis
        0, 1 or 2: theta_h, theta_d, phi_d or theta_i, theta_o, phi, as the model's chart has it.
    at
        Parameters in 0 ... 1 where knots are inserted, in order, like 0.25,0.5.
    factor
        In place of them: into how many equal parts each span is cut.
    as_json
        Print one JSON object.
    """
    from bvbedit.brdf import structure
    from bvbedit.errors import BvbError

    if (at is None) == (factor is None):
        raise BvbError("Refining needs --at or --factor. Give one of them.")
    model = _opened(source, target)
    _finish(source, target, model, structure.refine(model, axis, at=at, factor=factor), as_json)


def remove(source: Path, target: Path, /, *, axis: int, tolerance: float, as_json: Json = False) -> None:
    """Remove as many knots as a tolerance allows: fewer control points, a bounded change.

    Parameters
    ----------
    source
        The .bvb model to simplify.
    target
        The .bvb file to write.
    axis
        0, 1 or 2, as the model's chart has it.
    tolerance
        Largest change of the encoded value, certified.
    as_json
        Print one JSON object.
    """
    from bvbedit.brdf import structure

    model = _opened(source, target)
    with progress(f"Removing knots of {source.name}"):
        edited, _ = structure.remove(model, axis, tolerance)
    _finish(source, target, model, edited, as_json)


def elevate(source: Path, target: Path, /, *, axis: int, by: int = 1, as_json: Json = False) -> None:
    """Raise the degree of an axis: the same material.

    Parameters
    ----------
    source
        The .bvb model to elevate.
    target
        The .bvb file to write.
    axis
        0, 1 or 2, as the model's chart has it.
    by
        By how much; at most to degree 16.
    as_json
        Print one JSON object.
    """
    from bvbedit.brdf import structure

    model = _opened(source, target)
    _finish(source, target, model, structure.elevate(model, axis, by), as_json)


def reduce(
    source: Path, target: Path, /, *, axis: int, by: int = 1, tolerance: float | None = None, as_json: Json = False
) -> None:
    """Lower the degree of an axis: the nearest such model, and a bound of the change.

    Parameters
    ----------
    source
        The .bvb model to reduce.
    target
        The .bvb file to write.
    axis
        0, 1 or 2, as the model's chart has it.
    by
        By how much; at most to degree 0.
    tolerance
        Refuse a larger change of the encoded value.
    as_json
        Print one JSON object.
    """
    from bvbedit.brdf import structure

    model = _opened(source, target)
    edited, _ = structure.reduce(model, axis, by, tolerance)
    _finish(source, target, model, edited, as_json)


def blend(a: Path, b: Path, target: Path, /, *, t: Numbers, space: str = "net", as_json: Json = False) -> None:
    """Mix two materials.

    Parameters
    ----------
    a
        The .bvb model at t = 0.
    b
        The .bvb model at t = 1.
    target
        The .bvb file to write.
    t
        How much of B: one number, or three for red, green and blue, like 0.2,0.5,0.8.
    space
        net (control points, exact), linear (reflectance) or log (log(1 + f/1e-3)).
    as_json
        Print one JSON object.
    """
    from bvbedit import api

    first = _opened(a, target)
    second = _opened(b, target)
    with progress(f"Blending {a.name} with {b.name}") as watch:
        mixed = api.blend(first, second, t[0] if len(t) == 1 else t, space, progress=watch)
    _finish(a, target, first, mixed.told(source=f"{a.name}, {b.name}"), as_json)


def _opened(source: Path, target: Path) -> Any:
    """Return the model in ``source``, once it is known that ``target`` can be written."""
    from bvbedit.brdf.spline_brdf import SplineBrdf
    from bvbedit.errors import BvbError
    from bvbedit.io import check_target, load

    check_target(target, (".bvb",))
    model = load(source)
    if not isinstance(model, SplineBrdf):
        raise BvbError(f"{source} is a measurement, not a model. Fit it first: bvbedit fit {source} {source.stem}.bvb")
    return model


def _finish(source: Path, target: Path, before: Any, after: Any, as_json: bool) -> None:
    """Save the edited model as the first was stored and tell what changed, what the storage rounds off included."""
    from bvbedit.brdf.structure import largest_change
    from bvbedit.io import save

    bytes_before = source.stat().st_size
    spline, storage = after.spline, before.storage
    change = largest_change(before, after.with_spline(spline.with_control(storage.rounded(spline.control))))
    save(after.stored_as(storage), target)
    result: dict[str, Any] = {
        "file": str(target),
        "size_before": list(before.spline.size),
        "size_after": list(after.spline.size),
        "degrees": list(after.spline.degrees),
        "bytes_before": bytes_before,
        "bytes_after": target.stat().st_size,
        "max_change": change,
    }
    if "metrics" in after.report:
        result["metrics"] = after.report["metrics"]
    report({**result, "notes": list(after.report.get("notes", []))}, as_json)
