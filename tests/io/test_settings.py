"""Settings are read as they are written, and every mistake is told in one line: file, line, key and way out."""

import datetime
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from pydantic import BaseModel, Field

from bvbedit import BvbError
from bvbedit.io.settings import LARGEST, read_settings
from tests.io import files

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Camera:
    position: Vector
    vertical_fov_degrees: float
    look_at: Vector = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if self.position == self.look_at:
            raise BvbError("The camera looks nowhere. Move look_at (say, to 0 0 1).")


@dataclass(frozen=True, slots=True)
class Sphere:
    kind: Literal["sphere"]
    radius: float = 1.0
    # Named like a kind: pydantic's paths have the kinds among the keys.
    sphere: Vector | None = None

    def __post_init__(self) -> None:
        if self.radius <= 0:
            raise BvbError(f"sphere radius is {self.radius!r}. Give a positive finite number.")


@dataclass(frozen=True)
class Box:
    kind: Literal["box"]
    corners: tuple[Vector, Vector]
    colour: float | Vector = 0.5


class Note(BaseModel):
    """A model that would let unknown keys pass by itself."""

    text: str
    day: datetime.date | None = None
    weight: int = Field(1, gt=0)


@dataclass(frozen=True)
class Scene:
    camera: Camera
    objects: tuple[Annotated[Sphere | Box, Field(discriminator="kind")], ...] = ()
    quality: Literal["draft", "fine"] = "fine"
    shadows: bool = True
    names: list[str] = field(default_factory=list)
    weights: dict[str, float] = field(default_factory=dict)
    note: Note | None = None
    size: tuple[int, int] = (1, 1)

    def __post_init__(self) -> None:
        if len(self.objects) > 5:
            raise BvbError("The scene is crowded. Leave something out.")


SOUND = """# A studio.
quality = "draft"
size = [640, 480]

[camera]
position = [0, -5.5, 2]
vertical_fov_degrees = 45

[[objects]]
kind = "sphere"
radius = 2
sphere = [1, 2, 3]

[[objects]]
kind = "box"
corners = [
    [0, 0, 0],
    [1, 1, 1],
]
colour = [1, 0, 0]

[weights]
"a b" = 3

[note]
text = "ä"
day = 2024-02-29
"""


def read(tmp_path: Path, content: str | bytes, kind: Any = Scene) -> Any:
    path = tmp_path / "studio.toml"
    return read_settings(files.written(path, content if isinstance(content, bytes) else content.encode()), kind)


def refusal(tmp_path: Path, content: str | bytes, kind: Any = Scene) -> str:
    """Return what is told of ``content``, without the folder of its file."""
    with pytest.raises(BvbError) as refused:
        read(tmp_path, content, kind)
    told = str(refused.value)
    assert len(told.splitlines()) == 1
    assert told.startswith(f"{tmp_path}/")
    return told.removeprefix(f"{tmp_path}/")


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize("mark", ["", "\ufeff"])
def test_what_is_written_is_read(end, mark, tmp_path):
    scene = read(tmp_path, mark + SOUND.replace("\n", end))
    assert scene == Scene(
        camera=Camera((0.0, -5.5, 2.0), 45.0),
        objects=(Sphere("sphere", 2.0, (1.0, 2.0, 3.0)), Box("box", ((0.0,) * 3, (1.0,) * 3), (1.0, 0.0, 0.0))),
        quality="draft",
        weights={"a b": 3.0},
        note=Note(text="ä", day=datetime.date(2024, 2, 29)),
        size=(640, 480),
    )
    assert [type(x) for x in (scene.camera.position[0], scene.objects[0].radius)] == [float, float]


def test_unions_and_models_are_kinds_too(tmp_path):
    either = Annotated[Sphere | Box, Field(discriminator="kind")]
    assert read(tmp_path, 'kind = "sphere"', either) == Sphere("sphere")
    assert read(tmp_path, 'text = "a"', Note) == Note(text="a")
    assert refusal(tmp_path, "", either) == "studio.toml: kind is missing. Give 'sphere' or 'box'."
    assert refusal(tmp_path, "\nkind = 3", either) == "studio.toml, line 2: kind is 3. Give 'sphere' or 'box'."
    assert refusal(tmp_path, "txt = 'a'", Note) == "studio.toml, line 1: txt is not known. Did you mean text?"


CAMERA = "[camera]\nposition = [0, -5, 2]\nvertical_fov_degrees = 45\n"


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        # Unknown keys, at every depth.
        ("vertical_fov_degrees", "vertical_fov_degres", "7: camera.vertical_fov_degres is not known. "
         "Did you mean vertical_fov_degrees?"),
        ("vertical_fov_degrees", "Vertical-FOV-degrees", "7: camera.Vertical-FOV-degrees is not known. "
         "Did you mean vertical_fov_degrees?"),
        ("quality", "qualty", "2: qualty is not known. Did you mean quality?"),
        ("[camera]", "[kamera]", "5: kamera is not known. Did you mean camera?"),
        ("quality", "xyz", "2: xyz is not known. "
         "Keys of the scene: camera, objects, quality, shadows, names, weights, note, size."),
        ("radius = 2", "'a b' = 2", "11: objects[0].'a b' is not known. Keys of objects[0]: kind, radius, sphere."),
        ("radius = 2", "heigth.x = 2", "11: objects[0].heigth is not known. "
         "Keys of objects[0]: kind, radius, sphere."),
        ("text = ", "tint = 1\ntext = ", "26: note.tint is not known. Keys of note: text, day, weight."),
        # Missing keys, told where their table begins.
        ("position = [0, -5.5, 2]", "", "5: camera.position is missing. Give a list of 3 numbers."),
        ('kind = "sphere"', "", "9: objects[0].kind is missing. Give 'sphere' or 'box'."),
        ('text = "ä"', "", "25: note.text is missing. Give a text."),
        # Wrong values.
        ("radius = 2", "radius = 'big'", "11: objects[0].radius is 'big'. Give a number."),
        ("radius = 2", "radius = '2'", "11: objects[0].radius is '2'. Give a number, without quotes or a unit."),
        ("= 45", "= '45 deg'", "7: camera.vertical_fov_degrees is '45 deg'. "
         "Give a number, without quotes or a unit."),
        ("radius = 2", "radius = true", "11: objects[0].radius is true. Give a number."),
        ("radius = 2", "radius = [2]", "11: objects[0].radius is [2]. Give a number."),
        ("radius = 2", "radius = {a = 2}", "11: objects[0].radius is a table. Give a number."),
        ("radius = 2", "radius = 2024-02-29", "11: objects[0].radius is '2024-02-29'. "
         "Give a number, without quotes or a unit."),
        ("radius = 2", "radius = nan", "11: objects[0].radius is nan. Give a finite number."),
        ("radius = 2", "radius = -inf", "11: objects[0].radius is -inf. Give a finite number."),
        ("radius = 2", "radius = 1e999", "11: objects[0].radius is inf. Give a finite number."),
        ("[1, 1, 1]", "[1, nan, 1]", "18: objects[1].corners[1][1] is nan. Give a finite number."),
        ("radius = 2", "radius = 0x" + "f" * 9999, "11: objects[0].radius is a whole number beyond 64 bits. "
         "Give a smaller one."),
        ("[1, 1, 1]", "[1, '1', 1]", "18: objects[1].corners[1][1] is '1'. Give a number, without quotes or a unit."),
        ("[1, 1, 1]", "[1, 1]", "18: objects[1].corners[1] is [1, 1]. Give a list of 3 numbers."),
        ("[1, 1, 1]", "[1]", "18: objects[1].corners[1] is [1]. Give a list of 3 numbers."),
        ("[1, 1, 1]", "[1, 1, 1, 1]", "18: objects[1].corners[1] is [1, 1, 1, 1]. Give a list of 3 numbers."),
        ("[1, 1, 1]", "1", "18: objects[1].corners[1] is 1. Give a list of 3 numbers."),
        ("sphere = [1, 2, 3]", "sphere = [1, false, 3]", "12: objects[0].sphere[1] is false. Give a number."),
        ("sphere = [1, 2, 3]", "sphere = 1", "12: objects[0].sphere is 1. Give a list of 3 numbers."),
        ("colour = [1, 0, 0]", "colour = 'red'", "20: objects[1].colour is 'red'. "
         "Give a number or a list of 3 numbers."),
        ("colour = [1, 0, 0]", "colour = [1, 0, 'r']", "20: objects[1].colour[2] is 'r'. Give a number."),
        ('kind = "box"', 'kind = "cube"', "15: objects[1].kind is 'cube'. Give 'sphere' or 'box'."),
        ('quality = "draft"', 'quality = "good"', "2: quality is 'good'. Give 'draft' or 'fine'."),
        ('quality = "draft"', "shadows = 1", "2: shadows is 1. Give true or false."),
        ('quality = "draft"', "shadows = 'true'", "2: shadows is 'true'. Give true or false."),
        ('quality = "draft"', "names = 'a'", "2: names is 'a'. Give a list of texts."),
        ('quality = "draft"', "names = ['a', 1]", "2: names[1] is 1. Give a text."),
        ("size = [640, 480]", "size = [640, 480.0]", "3: size[1] is 480.0. Give a whole number."),
        ('"a b" = 3', '"a b" = "3"', "23: weights.'a b' is '3'. Give a number, without quotes or a unit."),
        ("day = 2024-02-29", "weight = 0", "27: note.weight is 0. It should be greater than 0."),
        ("day = 2024-02-29", "day = 7", "27: note.day is 7. Give a text."),
        # What the classes say themselves.
        ("radius = 2", "radius = -2", "9: objects[0]: sphere radius is -2.0. Give a positive finite number."),
        ("position = [0, -5.5, 2]", "position = [0, 0, 0]", "5: camera: The camera looks nowhere. "
         "Move look_at (say, to 0 0 1)."),
        # What is no TOML.
        ('quality = "draft"', "quality = draft", "2, column 11: Invalid value. "
         "Put texts in quotes, and leave no value out."),
        ("[camera]", "[camera", "5, column 8: Expected ']' at the end of a table declaration. Correct the line."),
        ("radius = 2", "radius = 2 radius", "11, column 12: Expected newline or end of document after a statement. "
         "Correct the line."),
        ("[note]", "[camera]", "25, column 8: Cannot declare ('camera',) twice. Write each key and table once."),
        ("day = 2024-02-29", "day = '", "27: Expected \"'\", at the end of the file. Correct the line."),
        ("day = 2024-02-29", "day = [1", "27: Unclosed array, at the end of the file. Correct the line."),
        ("radius = 2", "radius = " + "[" * 999, "11: tables and lists are more than 64 deep in each other. "
         "Flatten them."),
    ],
)  # fmt: skip
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_each_mistake_is_told_with_its_line_and_key(old, new, told, end, tmp_path):
    assert SOUND.count(old) == 1
    content = SOUND.replace(old, new).replace("\n", end)
    assert refusal(tmp_path, content) == f"studio.toml, line {told}"


def test_what_is_wrong_with_the_whole_has_no_line(tmp_path):
    assert refusal(tmp_path, "") == "studio.toml: camera is missing. Give a table."
    crowd = CAMERA + "[[objects]]\nkind = 'sphere'\n" * 6
    assert refusal(tmp_path, crowd) == "studio.toml: The scene is crowded. Leave something out."


@pytest.mark.parametrize("wrong", ["[objects]\nkind = 'sphere'", "objects = 3", "objects = 'sphere'"])
def test_a_table_for_a_list_is_told(wrong, tmp_path):
    assert ": objects is " in (told := refusal(tmp_path, wrong + "\n" + CAMERA if "[" not in wrong else CAMERA + wrong))
    assert told.endswith(". Give a list of tables.")


def test_the_first_of_several_is_told_and_how_many_more_there_are(tmp_path):
    two = SOUND.replace("radius = 2", "radius = 'a'").replace("quality", "qualty")
    assert refusal(tmp_path, two) == (
        "studio.toml, line 2: qualty is not known. Did you mean quality? There is 1 more mistake."
    )
    # In the order of the file, though the fields have another.
    four = two.replace("[1, 1, 1]", "[inf, 1]").replace("= 45", "= '45'")
    assert refusal(tmp_path, four).endswith("Did you mean quality? There are 3 more mistakes.")
    assert refusal(tmp_path, four.replace("qualty", "quality")).startswith("studio.toml, line 7: camera.")


def test_a_number_that_is_none_is_told_before_what_a_class_makes_of_it(tmp_path):
    content = SOUND.replace("[0, -5.5, 2]", "[nan, 0, 0]")
    assert refusal(tmp_path, content) == "studio.toml, line 6: camera.position[0] is nan. Give a finite number."
    unknown = "\nnothing = [1, nan]\n" + CAMERA
    assert refusal(tmp_path, unknown).startswith("studio.toml, line 2: nothing is not known. Keys of the scene: ")
    assert "more" not in refusal(tmp_path, unknown)


def test_long_values_and_keys_are_cut(tmp_path):
    for wrong in (f"quality = '{'x' * 9999}'", f"quality = [{'1, ' * 9999}]", f"{'x' * 9999} = 1", f"x = {'y' * 9999}"):
        assert len(refusal(tmp_path, wrong + "\n" + CAMERA)) < 300


def test_files_that_cannot_be_read_are_told(tmp_path):
    with pytest.raises(BvbError, match=r"nothing\.toml does not exist\. Check the name\.$"):
        read_settings(tmp_path / "nothing.toml", Scene)
    with pytest.raises(BvbError, match=r"is a folder\. Name a file\.$"):
        read_settings(tmp_path, Scene)
    assert refusal(tmp_path, b"# " + b"x" * LARGEST) == (
        "studio.toml is larger than 1 MB, so it is no scene. Check the name."
    )
    huge = "studio.toml has a whole number of too many digits. Give a smaller one."
    assert refusal(tmp_path, f"x = {'9' * 9999}") == huge


@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
def test_other_encodings_are_told(mark, tmp_path):
    content = mark + b"a = 1\nb = 'gr\xfcn'\nc = 2\n"
    way_out = "is not UTF-8. Save the file as UTF-8."
    assert refusal(tmp_path, content) == f"studio.toml, line 2: the byte 0xfc {way_out}"
    assert refusal(tmp_path, SOUND.encode("utf-16")) == f"studio.toml, line 1: the byte 0xff {way_out}"
    assert refusal(tmp_path, b"\x00\xff\x10binary") == f"studio.toml, line 1: the byte 0xff {way_out}"


def test_the_file_is_named_as_it_was_given(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    files.written(tmp_path / "a.toml", b"text = 'a'\nx = 1")
    with pytest.raises(BvbError, match=r"^a\.toml, line 2: x is not known"):
        read_settings("a.toml", Note)
    with pytest.raises(BvbError, match=r"^\.\./.*/a\.toml, line 2: x is"):
        read_settings(f"../{tmp_path.name}/a.toml", Note)


def test_kinds_that_json_cannot_describe_are_told_in_pydantics_words(tmp_path):
    @dataclass(frozen=True)
    class Odd:
        n: int
        done: Callable[[], int] = lambda: 0

    assert refusal(tmp_path, "n = 'a'", Odd) == "studio.toml, line 1: n is 'a'. It should be a valid integer."
    assert refusal(tmp_path, "m = 1\nn = 1", Odd) == "studio.toml, line 1: m is not known. Remove it."


@pytest.mark.filterwarnings("error")
def test_defaults_without_json_are_no_hindrance(tmp_path):
    @dataclass(frozen=True)
    class Odd:
        n: int
        z: Any = complex

    assert refusal(tmp_path, "n = 'a'", Odd) == "studio.toml, line 1: n is 'a'. Give a whole number."


def test_importing_the_reader_imports_neither_pydantic_nor_tomllib():
    code = "import sys, bvbedit.io.settings; print({'pydantic', 'tomllib'} & set(sys.modules))"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=os.environ)
    assert run.stdout == "set()\n"


PIECES = [
    "[",
    "]",
    "[[",
    "=",
    "'",
    '"',
    '"""',
    "\n",
    "\r",
    ".",
    ",",
    "{",
    "}",
    "nan",
    "1",
    "#",
    "\\",
    "kind",
    "\0",
    "é",
]


@given(st.data())
def test_damaged_texts_are_read_or_refused_in_one_line(tmp_path_factory, data):
    content = SOUND
    for _ in range(data.draw(st.integers(1, 4))):
        start = data.draw(st.integers(0, len(content)))
        end = min(len(content), start + data.draw(st.integers(0, 30)))
        content = content[:start] + data.draw(st.sampled_from(["", *PIECES])) + content[end:]
    read_or_refused(tmp_path_factory.getbasetemp() / "studio.toml", content.encode())


@given(st.lists(st.sampled_from([*PIECES, *SOUND.split()])).map("".join).map(str.encode) | st.binary())
@example(b"\xef\xbb\xbf")
@example(b"a" * 999 + b"='" + b"\n" * 99)
def test_random_texts_are_read_or_refused_in_one_line(tmp_path_factory, content):
    read_or_refused(tmp_path_factory.getbasetemp() / "studio.toml", content)


@given(st.data())
def test_sound_toml_with_wrong_values_is_read_or_refused_in_one_line(tmp_path_factory, data):
    """The texts above seldom come past tomllib."""
    values = ["1", "-1", "nan", "true", "'sphere'", "'box'", "[]", "[1, 2, 3]", "[[1, 2, 3], [1, 2]]", "{}", "07:32:00"]
    values += ["18446744073709551616", "{ kind = 'box', x = inf }", "[{ kind = 'sphere', sphere = { radius = 1 } }]"]
    lines = SOUND.splitlines()
    for n, line in enumerate(lines):
        if " = " in line and not line.endswith("[") and data.draw(st.integers(0, 3)) == 0:
            key = data.draw(st.sampled_from([line.split(" = ")[0], "k", "'a\\n'", "kind.x", "sphere"]))
            lines[n] = f"{key} = {data.draw(st.sampled_from(values))}"
    read_or_refused(tmp_path_factory.getbasetemp() / "studio.toml", "\n".join(lines).encode())


def read_or_refused(path: Path, content: bytes) -> None:
    refused = None
    try:
        assert isinstance(read_settings(files.written(path, content), Scene), Scene)
    except BvbError as error:
        refused = str(error)
    assert refused is None or (refused.startswith(str(path)) and len(refused.splitlines()) == 1)
