"""Reading what people write, in TOML, into checked values: every mistake is told with its file, line, key and way out.

The kinds are plain dataclasses or pydantic models that need to declare nothing: no key is allowed that they do not
name, at any depth, and values are not converted: but a whole number may stand for a real one, a list for a tuple, and
a text for what Python writes as one, such as a Path.
"""

import datetime
import json
import math
import os
from collections.abc import Callable, Mapping
from typing import Any, TypeVar, overload

from bvbedit.errors import BvbError
from bvbedit.io.files import reading
from bvbedit.io.mistakes import KeyPath, Told, name_of, told
from bvbedit.io.toml_lines import places
from bvbedit.spline.arguments import LONGEST_SHOWN

T = TypeVar("T")
Change = Callable[[dict[str, Any]], None]

# Bytes. What a person writes is a hundredth of it, and a file with nothing but mistakes takes seconds.
LARGEST = 1_000_000


@overload
def read_settings(
    path: str | os.PathLike[str], kind: type[T], *, what: str = "scene", change: Change | None = None
) -> T: ...
@overload
def read_settings(
    path: str | os.PathLike[str], kind: Any, *, what: str = "scene", change: Change | None = None
) -> Any: ...
def read_settings(path: str | os.PathLike[str], kind: Any, *, what: str = "scene", change: Change | None = None) -> Any:
    """Return the value of ``kind`` in the TOML file ``path``; ``what`` is the file's noun in messages.

    ``kind`` is a dataclass, a pydantic model, or an annotated union of them. Errors that its classes raise of
    themselves (BvbError, any ValueError) are told in their own words. ``change`` may alter what was read before it is
    checked.
    Raises BvbError for a file that cannot be read, is no TOML in UTF-8, or does not fit ``kind``: in one line, with the
    first mistake in the file and how many more there are.
    """
    text = _text(path, what)
    try:
        lines = places(text)
    except BvbError as error:
        raise BvbError(f"{path}, {error}") from None
    data = _parsed(text, path)
    if change is not None:
        change(data)
    value, mistakes = _validated(data, kind, what)
    if not mistakes:
        return value
    # The whole file has no line, so what is wrong with it comes first.
    first = min(mistakes, key=lines.line_of)
    line = lines.line_of(first)
    raise BvbError(f"{path}{f', line {line}' if line else ''}: {mistakes[first]}{_others(mistakes)}")


def line_of(path: str | os.PathLike[str], key: KeyPath, what: str = "scene") -> int:
    """Return the line of a key, like ("objects", 1), in a file that ``read_settings`` has read; 0 for none."""
    return places(_text(path, what)).line_of(key)


def checked(data: Mapping[str, Any], kind: Any, *, what: str) -> Any:
    """Return the value of ``kind`` that ``data`` holds, as TOML or JSON would. Raises BvbError as ``read_settings``.

    ``kind`` may be pydantic's adapter of it: to make one takes long where the kind is a large union.
    """
    value, mistakes = _validated(data, kind, what)
    if mistakes:
        raise BvbError(f"{next(iter(mistakes.values()))}{_others(mistakes)}")
    return value


def _validated(data: Mapping[str, Any], kind: Any, what: str) -> tuple[Any, Told]:
    """Return the value of ``kind``, or the mistakes."""
    refused: Told = {}
    plain = {key: _plain(value, (key,), refused) for key, value in data.items()}

    from pydantic import TypeAdapter, ValidationError

    adapter = kind if isinstance(kind, TypeAdapter) else TypeAdapter(kind)
    try:
        # Strictly read from JSON, lists become tuples and tables dataclasses; strictly read from Python, they do not.
        return adapter.validate_json(json.dumps(plain), strict=True, extra="forbid"), refused
    except ValidationError as error:
        return None, told(error.errors(include_url=False), plain, adapter, what, refused)


def _others(mistakes: Told) -> str:
    others = len(mistakes) - 1
    return ["", " There is 1 more mistake.", f" There are {others} more mistakes."][min(others, 2)]


def _text(path: str | os.PathLike[str], what: str) -> str:
    with reading(path) as stream:
        raw = stream.read(LARGEST + 1)
    if len(raw) > LARGEST:
        raise BvbError(f"{path} is larger than {LARGEST // 1_000_000} MB, so it is no {what}. Check the name.")
    try:
        # Windows' editors write a mark before the text.
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        # The positions count from behind that mark.
        behind = error.object[: error.start]
        line = behind.count(b"\n") + 1
        wrong = error.object[error.start]
        raise BvbError(f"{path}, line {line}: the byte {wrong:#04x} is not UTF-8. Save the file as UTF-8.") from None


def _parsed(text: str, path: str | os.PathLike[str]) -> dict[str, Any]:
    import tomllib

    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise BvbError(f"{path}, {_syntax(' '.join(str(error).split()), text)}") from None
    except ValueError:
        # Python itself refuses whole numbers of thousands of digits.
        raise BvbError(f"{path} has a whole number of too many digits. Give a smaller one.") from None


def _syntax(message: str, text: str) -> str:
    """Return tomllib's ``message`` with its line first and a way out."""
    reason, _, place = message.rpartition(" (at ")
    if reason == "Invalid value":
        way_out = "Put texts in quotes, and leave no value out."
    elif reason.startswith(("Cannot", "Duplicate")):
        way_out = "Write each key and table once."
    else:
        way_out = "Correct the line."
    if len(reason) > LONGEST_SHOWN:
        reason = reason[:LONGEST_SHOWN] + " ..."
    if place.startswith("line "):
        return f"{place.removesuffix(')')}: {reason}. {way_out}"
    last = text.rstrip().count("\n") + 1
    return f"line {last}: {reason or message}, at the end of the file. {way_out}"


def _plain(value: Any, path: KeyPath, refused: Told) -> Any:
    """Return ``value`` as JSON can hold it. Numbers that are none to calculate with go into ``refused``; 1 is for them.

    Dates become texts, from which pydantic makes dates again if the kind wants them.
    """
    if isinstance(value, dict):
        return {key: _plain(inner, (*path, key), refused) for key, inner in value.items()}
    if isinstance(value, list):
        return [_plain(inner, (*path, n), refused) for n, inner in enumerate(value)]
    if isinstance(value, float) and not math.isfinite(value):
        refused[path] = f"{name_of(path)} is {value}. Give a finite number."
        return 1
    if isinstance(value, int) and not -(2**63) <= value < 2**63:
        # Not shown: Python refuses to write out the longest.
        refused[path] = f"{name_of(path)} is a whole number beyond 64 bits. Give a smaller one."
        return 1
    if isinstance(value, (datetime.date, datetime.time)):
        return value.isoformat()
    return value
