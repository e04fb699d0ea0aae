"""What a column of a study's table is: its type, unit, meaning and limits, and how its values are read and written."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, Literal

Kind = Literal["text", "count", "number"]
Value = str | int | float | None

NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|inf")
COUNT = re.compile(r"\d{1,16}")
# Larger counts are not exact as floats; nothing that is counted here comes near.
LARGEST_COUNT = 1 << 53
KEY = "column"


@dataclass(frozen=True)
class Column:
    """One column: what its values are."""

    name: str
    kind: Kind
    unit: str
    """Empty for texts, counts without a unit and ratios."""
    meaning: str
    required: bool = False
    """Whether it may not be empty."""
    choices: tuple[str, ...] = ()
    low: float = 0.0
    high: float = math.inf
    infinite: bool = False
    """Whether a number may be infinite."""
    form: str = ""
    """A regular expression that texts match."""
    is_time: bool = False
    """Whether it differs from run to run."""

    def read(self, text: str) -> Value:
        """Return the value that ``text`` says; None for the empty text. Raises ValueError with words that fit in."""
        if not text:
            if self.required:
                raise ValueError("is empty. Each cell needs it")
            return None
        if self.kind == "count":
            if not COUNT.fullmatch(text) or int(text) > LARGEST_COUNT:
                raise ValueError(f"{text[:60]!r} is no whole number from 0 to 2^53")
            return self.checked(int(text))
        if self.kind == "number":
            if not NUMBER.fullmatch(text):
                raise ValueError(f"{text[:60]!r} is no number")
            return self.checked(float(text))
        return self.checked(text)

    def checked(self, value: Any) -> Value:
        """Return ``value`` as a plain text, int or float; None as it is. Raises ValueError with words that fit in."""
        if value is None or value == "":
            if self.required:
                raise ValueError("is empty. Each cell needs it")
            return None
        if self.kind == "text":
            return self._checked_text(value)
        if isinstance(value, str | bool):
            raise ValueError(f"{value!r} is no number")
        if self.kind == "count":
            if int(value) != value:
                raise ValueError(f"{value} is no whole number")
            value = int(value)
        else:
            value = float(value)
        if math.isnan(value) or (math.isinf(value) and not self.infinite):
            raise ValueError(f"{value} is not finite")
        if not self.low <= value <= self.high:
            raise ValueError(f"{value:g} is outside of {self.low:g} ... {self.high:g}")
        return value  # type: ignore[no-any-return]

    def _checked_text(self, value: Any) -> str:
        if not isinstance(value, str):
            raise ValueError(f"{value!r} is no text")
        if any(c in value for c in "\r\n\0"):
            raise ValueError("has more than one line")
        if self.choices and value not in self.choices:
            raise ValueError(f"{value[:60]!r} is none of {', '.join(self.choices)}")
        if self.form and not re.fullmatch(self.form, value):
            raise ValueError(f"{value[:60]!r} is not like 20x20x80")
        return value

    def written(self, value: Value) -> str:
        """Return ``value`` as text: numbers as the shortest text that reads back the same, None as nothing."""
        checked = self.checked(value)
        if checked is None:
            return ""
        return repr(checked) if self.kind == "number" else str(checked)


def text(meaning: str, **more: Any) -> Any:
    """Return a field of a dataclass that is a column of texts; ``more`` as in Column."""
    return _field("text", "", meaning, more)


def count(unit: str, meaning: str, **more: Any) -> Any:
    """Return a field of a dataclass that is a column of whole numbers; ``more`` as in Column."""
    return _field("count", unit, meaning, more)


def number(unit: str, meaning: str, **more: Any) -> Any:
    """Return a field of a dataclass that is a column of numbers; ``more`` as in Column."""
    return _field("number", unit, meaning, more)


def _field(kind: Kind, unit: str, meaning: str, more: Mapping[str, Any]) -> Any:
    metadata = {KEY: {"kind": kind, "unit": unit, "meaning": meaning, **more}}
    return field(metadata=metadata) if more.get("required") else field(default=None, metadata=metadata)


def columns_of(kind: type) -> tuple[Column, ...]:
    """Return the columns that the fields of the dataclass ``kind`` are, in their order."""
    return tuple(Column(f.name, **f.metadata[KEY]) for f in fields(kind) if KEY in f.metadata)
