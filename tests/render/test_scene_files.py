"""Scenes in files: what they say is what is rendered, beside which folder, and how mistakes in them are told."""

import numpy as np
import pytest

from bvbedit.brdf.analytic import Lambert
from bvbedit.brdf.charts import HALF_DIFF
from bvbedit.brdf.encodings import Linear
from bvbedit.brdf.materials import MATERIALS
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.errors import BvbError
from bvbedit.io import save
from bvbedit.io.exr import write_exr
from bvbedit.render import render
from bvbedit.render.lights import (
    ConstantEnvironment,
    GradientEnvironment,
    Panorama,
    PointLight,
    RectangleLight,
    Sky,
    Sun,
)
from bvbedit.render.scene import Blob, Camera, MeshFile, Plane, Scene, Sphere
from bvbedit.render.scene_file import NAMES, read_scene, scene_of
from bvbedit.spline.tensor import TensorSpline
from tests.spline.refusals import refusal

WHOLE = """\
depth = 3

[camera]
position = [0, -6, 2]
look_at = [0.0, 0.0, 1.0]
vertical_fov_degrees = 30
up = [0.1, 0.0, 1.0]

[environment]
kind = "gradient"
zenith = [0.1, 0.2, 0.3]
horizon = [0.4, 0.5, 0.6]
nadir = [0, 0, 0]

[[objects]]
kind = "sphere"
centre = [1.0, 0.0, 1.0]
radius = 0.5
material = 2

[[objects]]
kind = "plane"
height = -1
material = [0.2, 0.3, 0.4]
direct_light_only = true

[[objects]]
kind = "mesh"
file = "bodies/jug.ply"
scale = 2
translation = [0, 0, 1]
material = "chrome"

[[objects]]
kind = "blob"
material = "paints/mine.bvb"

[[lights]]
kind = "sun"
direction = [0, 0, 1]
irradiance = [1, 2, 3]

[[lights]]
kind = "point"
position = [1, 2, 3]
intensity = [4, 5, 6]

[[lights]]
kind = "rectangle"
centre = [0, 0, 5]
look_at = [0, 0, 0]
width = 1
height = 2.5
radiance = [7, 8, 9]
"""
SMALL = {"width": 8, "height": 8, "spp": 2}


def written(folder, text, name="scene.toml"):
    path = folder / name
    path.write_text(text)
    return path


def simple(material="1", kind="sphere", rest="", environment='kind = "constant"'):
    return f"""\
[camera]
position = [0, -6, 2]
look_at = [0, 0, 1]
vertical_fov_degrees = 30
[environment]
{environment}
[[objects]]
kind = "{kind}"
material = {material}
{rest}
"""


def test_a_file_says_field_by_field_what_the_values_are(tmp_path):
    expected = Scene(
        Camera((0, -6, 2), (0, 0, 1), 30, (0.1, 0, 1)),
        [
            Sphere((1, 0, 1), 0.5, 2),
            Plane(-1, (0.2, 0.3, 0.4), True),
            MeshFile(str(tmp_path / "bodies/jug.ply"), 2.0, (0, 0, 1), "chrome"),
            Blob(material=str(tmp_path / "paints/mine.bvb")),
        ],
        GradientEnvironment((0.1, 0.2, 0.3), (0.4, 0.5, 0.6), (0, 0, 0)),
        [
            Sun((0, 0, 1), (1, 2, 3)),
            PointLight((1, 2, 3), (4, 5, 6)),
            RectangleLight((0, 0, 5), (0, 0, 0), 1.0, 2.5, (7, 8, 9)),
        ],
        depth=3,
    )
    assert read_scene(written(tmp_path, WHOLE)) == expected
    assert scene_of(str(written(tmp_path, WHOLE, "Mine.TOML"))) == expected


@pytest.mark.parametrize("name", NAMES)
def test_named_scenes_are_files_like_others(name):
    assert isinstance(scene_of(name), Scene)


@pytest.mark.parametrize(
    ("text", "environment"),
    [
        ('kind = "constant"\nradiance = [1, 2, 3]', ConstantEnvironment((1, 2, 3))),
        ('kind = "sky"\nsun_direction = [0, 3, 4]\nturbidity = 5', Sky((0, 3, 4), 5)),
    ],
)
def test_environments(text, environment, tmp_path):
    assert read_scene(written(tmp_path, simple(environment=text))).environment == environment


def test_a_panorama_lies_beside_the_file(tmp_path, monkeypatch):
    (tmp_path / "rooms").mkdir()
    write_exr(tmp_path / "rooms" / "grey.exr", np.full((2, 4, 3), 0.25, dtype=np.float32))
    path = written(tmp_path, simple(environment='kind = "panorama"\nfile = "rooms/grey.exr"\ngain = 2.0'))
    monkeypatch.chdir("/")
    assert read_scene(path).environment == Panorama(str(tmp_path / "rooms/grey.exr"), 2.0)
    np.testing.assert_allclose(render(Lambert(1.0), path, **SMALL), 0.5, rtol=1e-5)


def test_a_material_is_meant_by_the_name_of_a_sample_or_lies_beside_the_file(tmp_path, monkeypatch):
    control = np.full((2, 2, 2, 3), 0.25 / np.pi)
    model = SplineBrdf(TensorSpline((1, 1, 1), [[0, 0, 1, 1]] * 3, control), HALF_DIFF, Linear())
    (tmp_path / "paints").mkdir()
    save(model, tmp_path / "paints" / "grey.bvb")
    monkeypatch.chdir("/")
    beside, named = (
        render([], written(tmp_path, simple(material)), **SMALL) for material in ('"paints/grey.bvb"', '"copper"')
    )
    assert beside[4, 4, 0] == pytest.approx(0.25, rel=0.05)
    np.testing.assert_array_equal(named, render(MATERIALS["copper"].brdf, written(tmp_path, simple()), **SMALL))


def test_a_mesh_lies_beside_the_file(tmp_path, monkeypatch):
    (tmp_path / "bodies").mkdir()
    written(tmp_path / "bodies", "v -1 0 0\nv 1 0 0\nv 1 0 2\nv -1 0 2\nf 1 2 3 4\n", "wall.obj")
    path = written(tmp_path, simple("[0.2, 0.4, 0.6]", "mesh", 'file = "bodies/wall.obj"'))
    monkeypatch.chdir("/")
    picture = render([], path, **SMALL)
    np.testing.assert_allclose(picture[4, 4], (0.2, 0.4, 0.6), rtol=1e-5)
    np.testing.assert_allclose(picture[0, 0], 1.0)


def test_models_go_by_number(tmp_path):
    text = simple("2") + '[[objects]]\nkind = "sphere"\ncentre = [0, 9, 1]\nmaterial = 1\n'
    picture = render([Lambert(1.0), Lambert(0.25)], written(tmp_path, text), **SMALL)
    assert picture[4, 4, 0] == pytest.approx(0.25)
    assert "asks for 2 models, 1 given" in refusal(lambda: render(Lambert(0.5), written(tmp_path, text), **SMALL))


@pytest.mark.parametrize(
    ("old", "new", "where", "words"),
    [
        ("radius = 0.5", "radius = 0", "table", "objects[0]: sphere radius is 0"),
        ("radius = 0.5", 'radius = "big"', "key", "objects[0].radius is 'big'"),
        ("radius = 0.5", "radiuss = 0.5", "key", "objects[0].radiuss is not known. Did you mean radius?"),
        ("material = 2", "material = 0", "table", "material is 0"),
        ("material = 2", "material = true", "key", "objects[0].material is true"),
        ("material = 2", "material = [1, 0]", "key", "objects[0].material"),
        ("material = [0.2, 0.3, 0.4]", "material = [2, 0, 0]", "table", "material is (2.0, 0.0, 0.0)"),
        ("height = -1", "height = 3", None, "The camera is not above the plane"),
        ("direct_light_only = true", "direct_light_only = 1", "key", "objects[1].direct_light_only is 1"),
        (
            'kind = "blob"',
            'kind = "cube"',
            "key",
            "objects[3].kind is 'cube'. Give 'sphere', 'plane', 'mesh' or 'blob'",
        ),
        ('kind = "sun"', 'kind = "moon"', "key", "lights[0].kind is 'moon'. Give 'sun', 'point' or 'rectangle'"),
        ('kind = "gradient"', 'kind = "fog"', "key", "environment.kind is 'fog'"),
        ('file = "bodies/jug.ply"\n', "", "table", "objects[2].file is missing"),
        ("intensity = [4, 5, 6]", "intensity = [4, 5]", "key", "lights[1].intensity"),
        ("intensity = [4, 5, 6]", "intensity = [4, 5, -6]", "table", "light intensity is"),
        ("look_at = [0, 0, 0]", "look_at = [0, 0, 5]", "table", "look_at"),
        ("vertical_fov_degrees = 30", "vertical_fov_degrees = 200", "table", "vertical_fov_degrees is 200"),
        ("vertical_fov_degrees = 30", "vertical_fov = 0.5", "key", "vertical_fov is not known"),
        ("depth = 3", "depth = 99", None, "depth is 99"),
        ("depth = 3", "depth = 1.5", "key", "depth is 1.5"),
        ("depth = 3", "width = 3", "key", "width is not known"),
    ],
)
def test_mistakes_are_told_with_their_line_and_key(old, new, where, words, tmp_path):
    assert WHOLE.count(old) == 1
    path = written(tmp_path, WHOLE.replace(old, new))
    with pytest.raises(BvbError) as caught:
        read_scene(path)
    told = str(caught.value)
    assert "\n" not in told
    assert words in told
    before = WHOLE[: WHOLE.index(old)]
    if where == "key":
        assert told.startswith(f"{path}, line {before.count(chr(10)) + 1}: ")
    elif where == "table":
        header = before.rindex("\n[") + 1
        assert told.startswith(f"{path}, line {before[:header].count(chr(10)) + 1}: ")
    else:
        assert told.startswith(f"{path}: ")


def test_missing_files_are_named(tmp_path):
    for text, missing in [
        (simple('"paints/none.bvb"'), "paints/none.bvb"),
        (simple("1", "mesh", 'file = "none.ply"'), "none.ply"),
        (simple(environment='kind = "panorama"\nfile = "none.exr"'), "none.exr"),
    ]:
        told = refusal(lambda text=text: render(Lambert(0.5), written(tmp_path, text), **SMALL))
        assert str(tmp_path / missing) in told
        assert "does not exist" in told
    assert "does not exist" in refusal(lambda: scene_of(tmp_path / "none.toml"))
    assert "does not exist" in refusal(lambda: render(Lambert(0.5), tmp_path / "none.exr", **SMALL))


def test_files_that_hold_something_else_are_named(tmp_path):
    written(tmp_path, "nothing", "text.bvb")
    written(tmp_path, "nothing", "text.ply")
    for text, wrong in [
        (simple('"text.bvb"'), "text.bvb"),
        (simple("1", "mesh", 'file = "text.ply"'), "text.ply"),
        (simple(environment='kind = "panorama"\nfile = "text.bvb"'), "text.bvb"),
    ]:
        assert wrong in refusal(lambda text=text: render(Lambert(0.5), written(tmp_path, text), **SMALL))


def test_a_name_that_is_no_sample_is_looked_for_beside_the_file(tmp_path):
    told = refusal(lambda: render([], written(tmp_path, simple('"crome"')), **SMALL))
    assert str(tmp_path / "crome") in told
