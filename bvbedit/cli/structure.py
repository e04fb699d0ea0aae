"""Commands that edit a model's control net: refine, remove, elevate, reduce, blend."""

from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter, Token

from bvbedit.cli.editing import edit_file
from bvbedit.cli.models import Json


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
    from bvbedit.edit.structural import InsertKnots, Refine
    from bvbedit.errors import BvbError

    if at is not None and factor is None:
        edit_file(source, target, [InsertKnots(axis=axis, at=at)], as_json)
    elif factor is not None and at is None:
        edit_file(source, target, [Refine(axis=axis, factor=factor)], as_json)
    else:
        raise BvbError("Refining needs --at or --factor. Give one of them.")


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
    from bvbedit.edit.structural import RemoveKnots

    edit_file(source, target, [RemoveKnots(axis=axis, tolerance=tolerance)], as_json)


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
    from bvbedit.edit.structural import Elevate

    edit_file(source, target, [Elevate(axis=axis, by=by)], as_json)


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
    from bvbedit.edit.structural import Reduce

    edit_file(source, target, [Reduce(axis=axis, by=by, tolerance=tolerance)], as_json)


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
    from bvbedit.edit.combining import Blend

    share: Any = t[0] if len(t) == 1 else t
    edit_file(a, target, [Blend(partner=b, t=share, space=space)], as_json)  # type: ignore[arg-type]
