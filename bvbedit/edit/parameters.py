"""Parameters of edits: what they mean, in which unit and within which limits, for people, for files and for sliders."""

from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field, fields
from functools import cache
from numbers import Real
from typing import Any, Literal, get_args, get_origin, get_type_hints

from bvbedit.errors import BvbError
from bvbedit.spline.arguments import shown


@dataclass(frozen=True)
class Limits:
    """What a number may be."""

    low: float
    high: float
    unit: str
    about: str
    whole: bool = False

    def __str__(self) -> str:
        ends = [f"{end:,.0f}" if self.whole else f"{end:g}" for end in (self.low, self.high)]
        return " ... ".join(ends) + (f" {self.unit}" if self.unit else "")

    def checked(self, value: Any, name: str) -> Any:
        """Return numbers, single or in tuples, as floats or ints. Raises BvbError for what is none or out of bounds."""
        if isinstance(value, tuple | list):
            return tuple(self.checked(inner, name) for inner in value)
        is_one = isinstance(value, int if self.whole else Real) and not isinstance(value, bool)
        if not is_one or not self.low <= value <= self.high:
            what = "whole numbers" if self.whole else "numbers"
            raise BvbError(f"{name} is {shown(value)}. Give {what} in {self}.")
        return int(value) if self.whole else float(value)


def number(low: float, high: float, about: str, *, unit: str = "", default: Any = MISSING, whole: bool = False) -> Any:
    """Return the field of a dataclass for a number, or a tuple of them, within limits."""
    return field(default=default, metadata={"limits": Limits(low, high, unit, about, whole)})


def choice(about: str, *, default: Any = MISSING) -> Any:
    """Return the field of a dataclass for what is no number."""
    return field(default=default, metadata={"about": about})


def limits_of(kind: type) -> Mapping[str, Limits]:
    """Return the limits of the numbers among the fields of an edit's class."""
    return {f.name: f.metadata["limits"] for f in fields(kind) if "limits" in f.metadata}


def check_numbers(value: Any) -> None:
    """Check all numbers among the fields of a frozen dataclass that is being made. None is what was left out."""
    for name, limits in limits_of(type(value)).items():
        given = getattr(value, name)
        if given is not None:
            object.__setattr__(value, name, limits.checked(given, name))


def check_choices(value: Any) -> None:
    """Check all texts among the fields of a frozen dataclass that are one of several."""
    kind: Any = type(value)
    for name, allowed in _choices(kind).items():
        if getattr(value, name) not in allowed:
            raise BvbError(f"{name} is {shown(getattr(value, name))}. Choose one of {', '.join(allowed)}.")


@cache
def _choices(kind: type) -> Mapping[str, tuple[str, ...]]:
    hints = get_type_hints(kind)
    return {f.name: get_args(hints[f.name]) for f in fields(kind) if get_origin(hints[f.name]) is Literal}


def given(value: Any) -> dict[str, Any]:
    """Return the fields of a dataclass that are not left at their defaults, as TOML and JSON can hold them."""
    return {
        f.name: _plain(inner)
        for f, inner in ((f, getattr(value, f.name)) for f in fields(value))
        if inner is not None and (f.default is MISSING or inner != f.default)
    }


def _plain(value: Any) -> Any:
    return [_plain(inner) for inner in value] if isinstance(value, tuple) else value
