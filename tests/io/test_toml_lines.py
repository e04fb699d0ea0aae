"""Each key of a TOML text is found on the line where it was written, however it was written."""

import tomllib
from dataclasses import dataclass, field

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from bvbedit import BvbError
from bvbedit.io.toml_lines import DEEPEST, line_of, places

TEXT = (
    '''# [camera] is not here
name = "a # b [objects]"  # nor here: x = 1

[camera]
position = [
    0,  # [0, 9]
    -5.5, 1e3,
]
lens.focus = 3
lens."f stop".best = 2.8
when = 1979-05-27 07:32:00

[[objects]]
kind = "sphere"
radius = 1

[[objects]]
note = """
[[objects]]
radius = 3 \\""" still
""""
other = \'\'\'
radius = 4\'\'\'
radius = 2
parts = [{ a = 1, b.c = [
    { d = 1 }, { d = 2 },
    { d = 3 }
] }, { a = 2 }]
  [objects.skin]
  colour = "red"
  [[objects.skin.layers]]
  "odd \\u00e4.key" = 1
  'it'''
    + """' = 5
[objects.skin.layers.base]
x = 1

[light.sun]
[light]
"""
)


@pytest.mark.parametrize(
    ("path", "line"),
    [
        ((), 1),
        (("name",), 2),
        (("camera",), 4),
        (("camera", "position"), 5),
        (("camera", "position", 0), 6),
        (("camera", "position", 2), 7),
        (("camera", "position", 3), 5),
        (("camera", "lens"), 9),
        (("camera", "lens", "f stop", "best"), 10),
        (("camera", "when"), 11),
        (("camera", "missing", "deeper"), 4),
        (("objects",), 13),
        (("objects", 0, "radius"), 15),
        (("objects", 1), 17),
        (("objects", 1, "note"), 18),
        (("objects", 1, "other"), 22),
        (("objects", 1, "radius"), 24),
        (("objects", 1, "parts", 0, "b", "c"), 25),
        (("objects", 1, "parts", 0, "b", "c", 1, "d"), 26),
        (("objects", 1, "parts", 0, "b", "c", 2), 27),
        (("objects", 1, "parts", 1, "a"), 28),
        (("objects", 1, "skin", "colour"), 30),
        (("objects", 1, "skin", "layers", 0, "odd ä.key"), 32),
        (("objects", 1, "skin", "layers", 0, "it"), 33),
        (("objects", 1, "skin", "layers", 0, "base", "x"), 35),
        (("light", "sun"), 37),
        (("light",), 38),
        (("objects", 2), 13),
        (("nothing",), 1),
    ],
)
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_keys_are_found_where_they_are_written(path, line, end):
    text = TEXT.replace("\n", end)
    tomllib.loads(text)
    assert line_of(text, path) == line
    assert line_of("\ufeff" + text, path) == line


@dataclass
class Writer:
    """Writes a random document and keeps on which line each of its keys and entries came to stand."""

    data: st.DataObject
    text: str = ""
    lines: dict[tuple, int] = field(default_factory=dict)
    names: int = 0

    @property
    def line(self) -> int:
        return self.text.count("\n") + 1

    def pick(self, *choices):
        return self.data.draw(st.sampled_from(choices))

    def key(self) -> tuple[str, str]:
        """Return a new key and how it is written."""
        self.names += 1
        n = self.names
        return self.pick(
            (f"k{n}", f"k{n}"),
            (str(n), str(n)),
            (f"a.b = [{n}] # c", f'"a.b = [{n}] # c"'),
            (f'"{n}\\', f"'\"{n}\\'"),
            (f'ä"{n}', f'"\\u00e4\\"{n}"'),
        )

    def dotted(self, path: tuple) -> tuple:
        """Write a key, perhaps with dots; return its path."""
        line = self.line
        parts = [self.key() for _ in range(self.pick(1, 1, 2, 3))]
        self.text += self.pick(".", " . ").join(written for _, written in parts)
        for key, _ in parts:
            path = (*path, key)
            self.lines[path] = line
        return path

    def gap(self) -> str:
        return self.pick("", " ", "\n", '  # [x] = \' """\n\t', "\r\n")

    def value(self, path: tuple, depth: int) -> None:
        kind = self.pick("plain", "plain", "list", "table") if depth else "plain"
        if kind == "plain":
            self.text += self.pick(
                "1", "-1.5e3", "nan", "true", "1979-05-27 07:32:00.5", '"[x] \\" # {"', "'\\'", "''", '""',
                '"""\n[x]\ny = 1 \\""" "" \n"""""', "'''\n[[x]] '' \n''''", '""""""', "''''''",
            )  # fmt: skip
        elif kind == "list":
            self.text += "["
            for n in range(self.pick(0, 1, 2, 3)):
                self.text += self.gap()
                self.lines[(*path, n)] = self.line
                self.value((*path, n), depth - 1)
                self.text += self.gap() + ","
            self.text += self.gap() + "]"
        else:
            self.text += "{"
            for n in range(self.pick(0, 1, 2, 3)):
                self.text += ", " if n else ""
                self.pair(path, depth - 1)
            self.text += "}"

    def pair(self, path: tuple, depth: int) -> None:
        path = self.dotted(path)
        self.text += self.pick("=", " = ")
        self.value(path, depth)

    def document(self) -> None:
        """Write some pairs, then tables below each other, single and in rows."""
        opened: list[tuple] = [()]
        for n in range(self.pick(1, 3, 6)):
            if n:
                opened.append(self.header(opened))
            for _ in range(self.pick(0, 1, 3)):
                self.text += self.pick("", "\n", "# a = 1\n", "  ")
                self.pair(opened[-1], 3)
                self.text += self.pick("\n", " # ''' [b]\n", "\r\n")

    def header(self, opened: list[tuple]) -> tuple:
        rows = [path for path in opened if path and isinstance(path[-1], int)]
        # Only the last row of several can be named again.
        newest = [path for path in opened if all((*path[:n], path[n] + 1) not in self.lines for n in indices(path))]
        path = self.pick(*newest)
        again = [row for row in rows if row in newest]
        is_row = self.pick(True, False)
        if again and self.pick(True, False):
            row = self.pick(*again)
            path, is_row = (*row[:-1], row[-1] + 1), True
            names = [key for key in row if isinstance(key, str)]
        else:
            key, _ = self.key()
            names = [*(key for key in path if isinstance(key, str)), key]
            path = (*path, key)
            self.lines[path] = self.line
            path = (*path, 0) if is_row else path
        self.lines[path] = self.line
        written = ".".join(f'"{name}"' if "\\" not in name and '"' not in name else basic(name) for name in names)
        self.text += f"[[ {written} ]]\n" if is_row else f"[{written}] # ]\n"
        return path


def indices(path: tuple) -> list[int]:
    return [n for n, key in enumerate(path) if isinstance(key, int)]


def basic(name: str) -> str:
    return '"' + name.replace("\\", "\\\\").replace('"', '\\"') + '"'


def found_in(value: object, path: tuple = ()) -> set[tuple]:
    """Return the paths of all that is in a read document."""
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return {path}.union(*(found_in(content, (*path, key)) for key, content in inner))


@given(st.data())
@settings(max_examples=100)
def test_every_key_of_random_documents_is_found_on_its_line(data):
    writer = Writer(data)
    writer.document()
    assert found_in(tomllib.loads(writer.text)) == {(), *writer.lines}
    found = places(writer.text)
    assert {path: found.line_of(path) for path in writer.lines} == writer.lines


@given(st.text(alphabet="[]{}=.,\"'\\#\n\r a1\ufeff"))
@example('"""\\')
@example("[[[")
@example('"\\uD800"=1')
@example("[[a]]\n[a]\nx=1\na.b=1\n[a.c]\n[a.")
def test_damaged_texts_come_to_an_end(text):
    assert 1 <= line_of(text, ("a", 0)) <= text.count("\n") + 1


@pytest.mark.parametrize(
    "text",
    ["\n" + "a." * 100_000 + "a = 1", "\nx = " + "[" * 100_000, "\nx = " + "{a=" * 100_000, "\n[" + "a." * 99 + "a]"],
)
def test_what_is_too_deep_is_told(text):
    with pytest.raises(BvbError, match=f"^line 2: .* more than {DEEPEST} deep"):
        places(text)


@pytest.mark.parametrize("text", ['"""' * 99_999, "'''" * 99_999, '"\n' * 99_999, '"""\\' * 50_000, "x" * 300_000])
def test_long_damaged_texts_take_no_long_time(text):
    assert line_of(text, ()) == 1
