"""On which line of a TOML text each key and each entry of a list stands: tomllib does not tell."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from bvbedit.errors import BvbError

Key = str | int

# Tables and lists within each other. For keys of very many parts tomllib takes minutes and all memory, and what reads
# JSON, and Python's stack, end at some hundreds.
DEEPEST = 64

# A string may hold everything that structures a file, so strings and comments are tokens of their own.
_TOKEN = re.compile(
    r'''
      """ (?: \\. | [^\\] )*? (?: "{3,5} | \Z )    # up to two quotes may stand before the three that end it
    | \'\'\' .*? (?: '{3,5} | \Z )
    | " (?: \\. | [^"\\\n] )* "?              # without its end it is damaged, and must not be sought for long
    | ' [^'\n]* '?
    | \# [^\n]*
    | [ \t\r\ufeff]+
    | [^\s"'\#\[\]{},=.]+                    # a bare key, a number, a date or a word
    | .                                      # a mark, or a line's end
    ''',
    re.VERBOSE | re.DOTALL,
)


@dataclass
class Place:
    """A value's line, counted from 1, and the places in it by key or index. The whole text has line 0."""

    line: int
    depth: int = 0
    inside: dict[Key, "Place"] = field(default_factory=dict)
    # Whether [[headers]] made it: further keys then go to its last entry.
    is_tables: bool = False

    def at(self, key: Key, line: int) -> "Place":
        """Return the place of ``key``, which is on ``line`` if it was not there before."""
        if self.depth == DEEPEST:
            raise BvbError(f"line {line}: tables and lists are more than {DEEPEST} deep in each other. Flatten them.")
        return self.inside.setdefault(key, Place(line, self.depth + 1))

    def open_table(self) -> "Place":
        """Return where the keys of this table go."""
        return next(reversed(self.inside.values())) if self.is_tables else self

    def line_of(self, path: Sequence[Key]) -> int:
        """Return the line of ``path``, or that of the nearest part around it which is written; 0 where none is."""
        place = self
        for key in path:
            if key not in place.inside:
                break
            place = place.inside[key]
        return place.line


def line_of(text: str, path: Sequence[Key]) -> int:
    """Return the line, from 1, of the value at ``path`` in the TOML ``text``, such as ("objects", 1, "radius").

    A table is where its own header is, else where it is first named. What is not there counts as what encloses it,
    down to line 1. ``text`` is one that tomllib reads; of another, some line is returned.
    Raises BvbError where values are more than DEEPEST deep in each other.
    """
    return max(1, places(text).line_of(path))


def places(text: str) -> Place:
    """Return the lines of all that is written in the TOML ``text``.

    Raises BvbError, without a file's name, where values are more than DEEPEST deep in each other.
    """
    return _Reader(text).document()


def _tokens(text: str) -> Iterator[tuple[str, int]]:
    """Yield the tokens that matter and their lines; the end is an empty token for ever."""
    line = 1
    for found in _TOKEN.finditer(text):
        token = found.group()
        if token[0] not in " \t\r\ufeff#":
            yield token, line
        line += token.count("\n")
    while True:
        yield "", line


class _Reader:
    """Descends through the tokens. Each step takes at least one of them, so that damaged texts come to an end too."""

    def __init__(self, text: str) -> None:
        self._tokens = _tokens(text)
        self._token, self._line = next(self._tokens)

    def document(self) -> Place:
        root = table = Place(0)
        while self._token:
            if self._token == "[":
                table = self._header(root)
            elif self._token == "\n":
                self._take()
            else:
                self._pair(table)
        return root

    def _take(self) -> str:
        taken = self._token
        self._token, self._line = next(self._tokens)
        return taken

    def _header(self, root: Place) -> Place:
        """Take [a.b] or [[a.b]]; return the table that it opens."""
        line = self._line
        self._take()
        is_tables = self._token == "["
        if is_tables:
            self._take()
        table = self._named(root, line)
        while self._token == "]":
            self._take()
        if is_tables:
            table.is_tables = True
            return table.at(len(table.inside), line)
        # [a.b] may have named it before.
        table.line = line
        return table

    def _pair(self, table: Place) -> None:
        """Take key = value."""
        value = self._named(table, self._line)
        if self._token == "=":
            self._take()
            self._value(value)

    def _named(self, table: Place, line: int) -> Place:
        """Take a key, perhaps with dots; return its place below ``table``."""
        place = table.open_table().at(_key(self._take()), line)
        while self._token == ".":
            self._take()
            place = place.open_table().at(_key(self._take()), line)
        return place

    def _value(self, place: Place) -> None:
        if self._token == "[":
            self._list(place)
        elif self._token == "{":
            self._inline_table(place)
        else:
            self._take()
            # What is left of a number with a point, or of a date with a space.
            while self._token not in ("", "]", "}", ",", "\n"):
                self._take()

    def _list(self, place: Place) -> None:
        self._take()
        while self._token not in ("", "]"):
            if self._token in (",", "\n"):
                self._take()
            else:
                self._value(place.at(len(place.inside), self._line))
        self._take()

    def _inline_table(self, place: Place) -> None:
        self._take()
        while self._token not in ("", "}"):
            if self._token in (",", "\n"):
                self._take()
            else:
                self._pair(place)
        self._take()


def _key(token: str) -> str:
    """Return the key that ``token`` writes, bare or in quotes."""
    if token[:1] not in ("'", '"'):
        return token
    if token[0] == "'" or "\\" not in token:
        return token[1:-1]
    import tomllib

    try:
        return str(tomllib.loads(f"key = {token}")["key"])
    except tomllib.TOMLDecodeError:
        return token
