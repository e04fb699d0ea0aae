"""What pydantic finds wrong in read settings, told in words for whoever wrote them: key, value and way out.

The words for what is wanted instead come from the JSON schema of the kind, which is the same for models, dataclasses
and unions, so no field needs a text of its own.
"""

import difflib
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

from bvbedit.io.toml_lines import Key
from bvbedit.spline.arguments import LONGEST_SHOWN, shown

if TYPE_CHECKING:
    from pydantic import TypeAdapter
    from pydantic_core import ErrorDetails

KeyPath = tuple[Key, ...]
Told = dict[KeyPath, str]

# Names of JSON schema's types: of one, and of several in a list.
_ONE = {"number": "a number", "integer": "a whole number", "string": "a text", "boolean": "true or false"}
_SEVERAL = {"number": "numbers", "integer": "whole numbers", "string": "texts", "object": "tables", "array": "lists"}
_UNKNOWN = ("extra_forbidden", "unexpected_keyword_argument")
# Lists whose entries people count, from one, and what they call one of them.
_COUNTED = {"steps": "step", "outputs": "output"}


def name_of(path: Sequence[Key]) -> str:
    """Return a key path as people write it: objects[1].radius, or step 3: factor."""
    if len(path) > 1 and path[0] in _COUNTED and isinstance(path[1], int):
        inner = name_of(path[2:])
        return f"{_COUNTED[str(path[0])]} {path[1] + 1}{': ' if inner else ''}{inner}"
    name = ""
    for key in path:
        if isinstance(key, int):
            name += f"[{key}]"
        else:
            bare = len(key) <= LONGEST_SHOWN and key.isascii() and key.replace("-", "_").replace("_", "0").isalnum()
            name += f"{'.' if name else ''}{key if bare else shown(key)}"
    return name


def told(
    errors: Iterable["ErrorDetails"], data: dict[str, Any], kind: "TypeAdapter[Any]", what: str, refused: Told
) -> Told:
    """Return a sentence and a way out for each of pydantic's ``errors`` in ``data``, by the path of the wrong value.

    Those in ``refused``, found before, are added; what the values around them say of them is dropped. A misspelt key is
    one mistake, though its right name is missing too. Where every branch of a union is refused, only what is wrong
    deepest inside stays.
    """
    shape = _Shape(kind)
    found: dict[KeyPath, ErrorDetails] = {}
    for error in errors:
        found.setdefault(_place(error, data), error)
    absent = dict.fromkeys(path for path, error in found.items() if _is_absent(error))
    unknown = dict.fromkeys(path for path, error in found.items() if error["type"] in _UNKNOWN)
    wrong = (found.keys() - absent.keys() - unknown.keys()) | refused.keys()
    outer = {path[:n] for path in wrong for n in range(len(path))}

    sentences, meant = _unknown_keys(unknown, absent, data, shape, what)
    for path, error in found.items():
        if not (path in unknown or path in meant or path in outer):
            sentences[path] = _sentence(path, error, data, shape, what)
    for path, sentence in refused.items():
        if not any(path[:n] in unknown for n in range(len(path) + 1)):
            sentences[path] = sentence
    return sentences


def _unknown_keys(
    unknown: Iterable[KeyPath], absent: Iterable[KeyPath], data: dict[str, Any], shape: "_Shape", what: str
) -> tuple[Told, set[KeyPath]]:
    """Return the sentences on ``unknown`` keys, and which of the ``absent`` ones they were meant to be."""
    sentences: Told = {}
    meant: set[KeyPath] = set()
    missing: dict[KeyPath, list[str]] = {}
    for path in absent:
        missing.setdefault(path[:-1], []).append(str(path[-1]))
    for path in unknown:
        table, key = path[:-1], str(path[-1])
        allowed = shape.keys(table, data)
        lacking = [name for name in missing.get(table, ()) if (*table, name) not in meant]
        likely = _likest(key, lacking) or _likest(key, [name for name in allowed if name not in _at(data, table)])
        if likely:
            meant.add((*table, likely))
            way_out = f"Did you mean {likely}?"
        elif allowed:
            way_out = f"Keys of {name_of(table) or 'the ' + what}: {', '.join(allowed)}."
        else:
            way_out = "Remove it."
        sentences[path] = f"{name_of(path)} is not known. {way_out}"
    return sentences, meant


def _sentence(path: KeyPath, error: "ErrorDetails", data: dict[str, Any], shape: "_Shape", what: str) -> str:
    name, kind = name_of(path), error["type"]
    wanted = shape.wanted(path, data)
    if _is_absent(error):
        return f"{name} is missing. " + (f"Give {wanted}." if wanted else "Add it.")
    if kind in ("value_error", "assertion_error"):
        # The classes' own texts already name the value and the way out.
        text = str(error["ctx"]["error"])
        return f"{name}: {text}" if name else text
    value = _at(data, path)
    is_list = kind in ("missing", "too_long", "too_short") and isinstance(value, list)
    if wanted and (is_list or kind.endswith("_type") or kind in ("literal_error", "enum", "union_tag_invalid")):
        # A number in quotes, perhaps with its unit.
        if isinstance(value, str) and "number" in wanted and value.strip()[:1] in tuple("+-.0123456789"):
            wanted += ", without quotes or a unit"
        return f"{name} is {_shown(value)}. Give {wanted}."
    should = " ".join(error["msg"].split()).replace("Input should", "It should")
    return f"{name or 'The ' + what} is {_shown(value)}. {should}."


def _is_absent(error: "ErrorDetails") -> bool:
    """Return whether a key is missing; pydantic says the same of the entries that a list is too short by."""
    return error["type"] == "union_tag_not_found" or (error["type"] == "missing" and isinstance(error["loc"][-1], str))


def _place(error: "ErrorDetails", data: Any) -> KeyPath:
    """Return the path in ``data`` that ``error`` is about.

    Pydantic's own also names the branches of unions, which are no keys, but may be called like one.
    """
    location: KeyPath = error["loc"]
    end: KeyPath = ()
    if error["type"] == "missing":
        location, end = location[:-1], location[-1:] if _is_absent(error) else ()
    elif error["type"] in ("union_tag_not_found", "union_tag_invalid"):
        end = (error["ctx"]["discriminator"].strip("'"),)
    candidates: dict[KeyPath, Any] = {(): data}
    for step in location:
        for path, value in list(candidates.items()):
            if _has(value, step):
                candidates[(*path, step)] = value[step]
    equal = [path for path, value in candidates.items() if value == error["input"]]
    return (*max(equal or candidates, key=len), *end)


def _has(value: object, key: Key) -> bool:
    if isinstance(value, dict):
        return isinstance(key, str) and key in value
    return isinstance(value, list) and isinstance(key, int) and 0 <= key < len(value)


def _at(data: Any, path: KeyPath) -> Any:
    for key in path:
        data = data[key] if _has(data, key) else None
    return data


def _likest(name: str, keys: Sequence[str]) -> str | None:
    """Return which of ``keys`` was probably meant by ``name``, whatever its capitals and dashes."""
    if len(name) > LONGEST_SHOWN:
        return None  # its comparison would take long
    plain = {key.lower().replace("-", "_"): key for key in keys}
    close = difflib.get_close_matches(name.lower().replace("-", "_"), plain, n=1)
    return plain[close[0]] if close else None


def _shown(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return "a table" if isinstance(value, dict) else shown(value)


class _Shape:
    """What a kind allows at each path, by its JSON schema."""

    def __init__(self, kind: "TypeAdapter[Any]") -> None:
        from pydantic.errors import PydanticInvalidForJsonSchema
        from pydantic.json_schema import GenerateJsonSchema

        class Quiet(GenerateJsonSchema):
            """Says nothing of defaults that JSON cannot hold: only the types matter here."""

            ignored_warning_kinds = {"skipped-choice", "non-serializable-default", "skipped-discriminator"}  # noqa: RUF012

        try:
            self._whole = kind.json_schema(schema_generator=Quiet)
        except PydanticInvalidForJsonSchema:
            self._whole = {}  # then pydantic's own words must do

    def keys(self, path: KeyPath, data: object) -> list[str]:
        """Return the keys that the table at ``path`` may have, in their order."""
        return list(dict.fromkeys(key for schema in self._reach(path, data) for key in schema.get("properties", ())))

    def wanted(self, path: KeyPath, data: object) -> str:
        """Return what may stand at ``path``, such as "a number or a list of 3 numbers"; empty where all may."""
        names = list(dict.fromkeys(name for schema in self._reach(path, data) for name in self._names(schema)))
        return " or ".join(filter(None, [", ".join(names[:-1]), *names[-1:]]))

    def _reach(self, path: KeyPath, data: object) -> list[dict[str, Any]]:
        schemas = list(self._open(self._whole, data))
        for key in path:
            data = _at(data, (key,))
            schemas = [
                opened for schema in schemas for inner in _inside(schema, key) for opened in self._open(inner, data)
            ]
        return schemas

    def _open(self, schema: dict[str, Any], data: object) -> Iterator[dict[str, Any]]:
        """Yield the schemas that ``schema`` stands for; of a union with kinds, if possible the one that data chose."""
        if "$ref" in schema:
            schema = self._whole["$defs"][schema["$ref"].removeprefix("#/$defs/")]
            yield from self._open(schema, data)
            return
        branches = schema.get("anyOf") or schema.get("oneOf")
        if branches is None:
            yield schema
            return
        choice = schema.get("discriminator", {})
        tag = _at(data, (choice.get("propertyName"),))
        if isinstance(tag, str) and tag in choice.get("mapping", {}):
            branches = [{"$ref": choice["mapping"][tag]}]
        for branch in branches:
            yield from self._open(branch, data)

    def _names(self, schema: dict[str, Any]) -> list[str]:
        if "const" in schema or "enum" in schema:
            return [_shown(value) for value in schema.get("enum", [schema.get("const")])]
        kind = schema.get("type")
        if kind == "array":
            return [f"a list{self._length(schema)}"]
        if kind == "object":
            return ["a table"]
        return [_ONE[kind]] if kind in _ONE else []

    def _length(self, schema: dict[str, Any]) -> str:
        """Return how many entries of what a list has: " of 3 numbers"."""
        low, high = schema.get("minItems", 0), schema.get("maxItems")
        if low == high:
            count = f"{low} "
        elif high is None:
            count = f"at least {low} " if low else ""
        else:
            count = f"{low} to {high} "
        entries = schema.get("prefixItems") or [schema.get("items")]
        kinds = {opened.get("type") for entry in entries if entry for opened in self._open(entry, None)}
        noun = _SEVERAL.get(str(kinds.pop()), "") if len(kinds) == 1 else ""
        return f" of {count}{noun or 'entries'}" if count or noun else ""


def _inside(schema: dict[str, Any], key: Key) -> list[dict[str, Any]]:
    if isinstance(key, str):
        inner = schema.get("properties", {}).get(key, schema.get("additionalProperties"))
    else:
        fixed = schema.get("prefixItems", [])
        inner = fixed[key] if key < len(fixed) else schema.get("items")
    return [inner] if isinstance(inner, dict) else []
