"""What an edit is: a small frozen value that turns one model into another, can be told in a line, and read again.

A line is the name of the operation and its parameters, ``tint rgb=1,0.8,0.6 theta_h=0..20``: lists are separated by
commas, lists of lists by semicolons, intervals are written with two dots, and texts with spaces in quotes; double
quotes inside of these keep a text that looks like a number or a list.
"""

import shlex
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.edit.parameters import check_choices, check_numbers, given
from bvbedit.spline.arguments import shown


@dataclass(frozen=True, kw_only=True)
class Edit(ABC):
    """One edit. Subclasses are frozen dataclasses with a field ``op``, their name, that has one value."""

    op: str
    label: str | None = None
    """What the step is called where its parameters are set from outside."""
    about: ClassVar[str]
    """What it does to the look, in a line."""

    def __post_init__(self) -> None:
        check_numbers(self)
        check_choices(self)

    @abstractmethod
    def apply(self, model: SplineBrdf) -> SplineBrdf:
        """Return the edited model. Its report may tell a ``refit_error`` and ``notes``.

        Raises BvbError where the edit cannot be made to this model.
        """

    def to_dict(self) -> dict[str, Any]:
        """Return ``op`` and the parameters that are not left at their defaults, as TOML and JSON can hold them."""
        return {"op": self.op, **given(self)}

    def line(self) -> str:
        """Return the edit in a line, which ``edit_of_line`` reads."""
        told = self.to_dict()
        words = [told.pop("op")]
        words += [f"{name}={shlex.quote(_written(name, value))}" for name, value in told.items()]
        return " ".join(words)


# Parameters that are intervals of angles.
INTERVALS = ("theta_h", "theta_d", "phi_d", "theta_i", "theta_o", "phi")


def words_of(line: str) -> Mapping[str, Any]:
    """Return ``op`` and the parameters in a line, as TOML would hold them. Raises ValueError, in words, for no line."""
    try:
        op, *words = shlex.split(line)
    except ValueError:
        raise ValueError(
            f"{shown(line)} is no edit. Write one like tint rgb=1,0.8,0.6 theta_h=0..20 in its place."
        ) from None
    out: dict[str, Any] = {"op": op}
    for word in words:
        name, equals, text = word.partition("=")
        if not equals or not name or not text:
            raise ValueError(
                f"{shown(word)} in {shown(line)} is no parameter. Write parameters like factor=1.5 after the name."
            )
        if name in out:
            raise ValueError(f"{name} is given twice in {shown(line)}. Give it once.")
        out[name] = value_of(text)
    return out


def value_of(text: str) -> Any:
    """Return the value that a text of the command line stands for: a number, a truth, a list, an interval, a text."""
    if len(text) > 1 and text[0] == text[-1] == '"':
        return text[1:-1]
    if ";" in text:
        return [value_of(part) if "," in part else [value_of(part)] for part in text.split(";")]
    if "," in text:
        return [value_of(part) for part in text.split(",")]
    ends = text.split("..")
    if len(ends) == 2 and all(isinstance(_number(end), int | float) for end in ends):
        return [_number(end) for end in ends]
    return {"true": True, "false": False}.get(text, _number(text))


def _number(text: str) -> int | float | str:
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


def _written(name: str, value: Any) -> str:
    if isinstance(value, list):
        nested = any(isinstance(inner, list) for inner in value)
        if name in INTERVALS:
            return "..".join(_written("", inner) for inner in value)
        return (";" if nested else ",").join(_written("", inner) for inner in value)
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float) and value.is_integer() and abs(value) < 1e15:
        return str(int(value))
    if isinstance(value, str):
        return value if value and value_of(value) == value else f'"{value}"'
    return repr(value)
