"""The closed set of edits, by their names."""

from collections.abc import Mapping
from dataclasses import MISSING, Field, fields
from functools import cache
from typing import Annotated, Any

from bvbedit.edit.appearance import Broaden, Denoise, Gain, RaiseGrazing, Sharpen, Tint
from bvbedit.edit.combining import Blend, MakePlausible, MovePoints
from bvbedit.edit.fitting import Fit
from bvbedit.edit.operation import Edit, words_of
from bvbedit.edit.region import Region
from bvbedit.edit.structural import Elevate, InsertKnots, Reduce, Refine, RemoveKnots, Store
from bvbedit.errors import BvbError
from bvbedit.spline.arguments import shown

KINDS: tuple[type[Edit], ...] = (
    Gain,
    Tint,
    Broaden,
    Sharpen,
    RaiseGrazing,
    Denoise,
    Blend,
    MovePoints,
    MakePlausible,
    InsertKnots,
    Refine,
    RemoveKnots,
    Elevate,
    Reduce,
    Fit,
    Store,
)
OPERATIONS: Mapping[str, type[Edit]] = {str(kind.__dataclass_fields__["op"].default): kind for kind in KINDS}


def any_edit() -> Any:
    """Return the type of all edits, told apart by ``op``, as pydantic understands it."""
    from pydantic import Field

    union: Any = KINDS[0]
    for kind in KINDS[1:]:
        union = union | kind
    return Annotated[union, Field(discriminator="op")]


@cache
def _adapter() -> Any:
    from pydantic import TypeAdapter

    return TypeAdapter(any_edit())


def edit_of(parameters: Mapping[str, Any]) -> Edit:
    """Return the edit with these parameters, ``op`` among them, as TOML and JSON hold them.

    Raises BvbError, in one line, for an unknown operation or parameter, and for values that it cannot have.
    """
    from bvbedit.io.settings import checked

    if not isinstance(parameters, Mapping):
        raise BvbError(f"{shown(parameters)} is no edit. Give its op and its parameters.")
    value: Edit = checked(parameters, _adapter(), what="edit")
    return value


def edit_of_line(line: str) -> Edit:
    """Return the edit that a line tells, like ``tint rgb=1,0.8,0.6 theta_h=0..20``. Raises BvbError as ``edit_of``."""
    try:
        words = words_of(line)
    except ValueError as error:
        raise BvbError(str(error)) from None
    try:
        return edit_of(words)
    except BvbError as error:
        raise BvbError(f"{shown(line)}: {error}") from None


def overview() -> str:
    """Return a text for people: each operation with what it does, its parameters, their limits and defaults."""
    regional = {f.name for f in fields(Region)}
    out = []
    for op, kind in OPERATIONS.items():
        out.append(f"{op}: {kind.about}")
        for f in fields(kind):
            if f.name not in (*regional, "op", "label"):
                out.append(f"    {f.name:<12} {_described(f)}")
        if issubclass(kind, Region):
            out.append("    and a region")
    out.append("a region: angles FROM..TO; outside, the effect ends softly over falloff")
    out += [f"    {f.name:<12} {_described(f)}" for f in fields(Region)]
    return "\n".join(out)


def _described(f: "Field[Any]") -> str:
    limits = f.metadata.get("limits")
    about = str(limits.about if limits else f.metadata["about"])
    if limits:
        about += f", {limits}"
    if f.default is MISSING:
        return f"{about} (needed)"
    if f.default is None:
        return about
    if isinstance(f.default, tuple):
        return f"{about} ({','.join(map(str, f.default))})"
    return f"{about} ({str(f.default).lower() if isinstance(f.default, bool) else f.default})"
