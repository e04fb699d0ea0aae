"""Scene values: what they are, and what they refuse; and what the named scenes look like."""

import numpy as np
import pytest

from bvbedit.brdf.analytic import Lambert
from bvbedit.errors import BvbError
from bvbedit.io.exr import write_exr
from bvbedit.render import render
from bvbedit.render.lights import (
    ConstantEnvironment,
    GradientEnvironment,
    LatLongEnvironment,
    Panorama,
    PointLight,
    RectangleLight,
    Sky,
    Sun,
    directions_of_texels,
)
from bvbedit.render.scene import Blob, Camera, MeshFile, Plane, Scene, Sphere
from bvbedit.render.scene_file import NAMES, scene_of, scene_with_environment

CAMERA = Camera((0, -5, 1), (0, 0, 1), 30)
ONE = (1.0, 1.0, 1.0)


def test_the_cameras_frame_is_orthonormal_and_right_handed():
    right, up, forward = Camera((1, -5, 3), (0, 2, 1), 30).frame()
    np.testing.assert_allclose(np.cross(right, up), -forward, atol=1e-15)
    assert forward @ (-1, 7, -2) == pytest.approx(np.sqrt(54))
    assert right[2] == pytest.approx(0)
    assert up[2] > 0


@pytest.mark.parametrize("look_at", [(0, 0, 0), (0, 0, 9), (3, -2, 1), (1, 0, 2), (0, 1e-13, 0)])
def test_the_frame_of_a_lamp_is_orthonormal_faces_what_it_looks_at_and_stands_upright(look_at):
    lamp = RectangleLight((0, 0, 2), look_at, 1.0, 2.0, ONE)
    along_width, along_height, normal = lamp.frame()
    np.testing.assert_allclose(lamp.frame() @ lamp.frame().T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(np.cross(along_width, along_height), normal, atol=1e-12)
    away = np.subtract(look_at, lamp.centre)
    assert normal @ away == pytest.approx(np.linalg.norm(away))
    assert along_width[2] == pytest.approx(0)
    assert along_height[2] > -1e-12


def test_texel_directions():
    d = directions_of_texels(90, 180)
    np.testing.assert_allclose(np.linalg.norm(d, axis=-1), 1)
    assert d[0, 0, 2] > 0.999
    assert d[44, 90, 1] > 0.99
    assert d[44, 135, 0] > 0.99


def test_a_gradient_as_texels():
    texels = GradientEnvironment((1, 0, 0), (0, 1, 0), (0, 0, 1)).texels()
    n = len(texels)
    np.testing.assert_allclose(texels[[0, n // 2, n - 1], 0], np.eye(3), atol=2 / n)
    np.testing.assert_allclose(texels[n // 4, 0], (0.5, 0.5, 0), atol=2 / n)


@pytest.mark.parametrize("name", NAMES)
def test_named_scenes_leave_paper_between_black_and_white(name):
    picture = render(Lambert(0.8), name, width=32, height=32, spp=16)
    on_the_sphere = picture[12:20, 12:20]
    assert on_the_sphere.min() > 0.2
    assert on_the_sphere.max() < 1.0


def test_the_ground_of_the_sphere_scene_melts_into_the_background():
    picture = render(Lambert(0.0), "sphere", width=24, height=24, spp=64)
    edge = picture[:8, 0].mean(axis=1)
    assert np.abs(np.diff(edge)).max() < 0.03


@pytest.mark.parametrize("name", NAMES)
def test_named_scenes_ask_for_one_model(name):
    assert scene_of(name).models() == 1


def test_how_many_models_a_scene_asks_for():
    blob, mesh = Blob(material=7), MeshFile("a.ply", material=2)
    assert Scene(CAMERA, [Sphere(), blob, mesh, Plane()]).models() == 7
    assert Scene(CAMERA, [Plane(), Sphere(material="chrome")]).models() == 0


def test_a_panorama_from_a_file(tmp_path):
    path = tmp_path / "Room.EXR"
    panorama = np.full((4, 8, 3), 0.25, dtype=np.float32)
    write_exr(path, panorama)
    assert np.array_equal(scene_with_environment(path).environment.texels(), panorama)
    picture = render(Lambert(1.0), path, width=16, height=16, spp=2)
    np.testing.assert_allclose(picture, 0.25, rtol=1e-5)
    np.testing.assert_array_equal(render(Lambert(1.0), str(path), width=16, height=16, spp=2), picture)
    np.testing.assert_array_equal(Panorama(str(path), 4.0).texels(), 4 * panorama)


def test_a_panorama_is_copied_and_read_only():
    mine = np.ones((2, 4, 3))
    panorama = LatLongEnvironment(mine)
    mine[:] = 7
    assert panorama.texels().max() == 1
    with pytest.raises(ValueError, match="read-only"):
        panorama.picture[0, 0, 0] = 2


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Camera((0, 0, 0), (0, 0, 0), 30), "nowhere"),
        (lambda: Camera((0, 0, 9), (0, 0, 0), 30), "own up"),
        (lambda: Camera((0, -5, 0), (0, 0, 0), 30, (0, 0, 0)), "own up"),
        (lambda: Camera((0, -5, 0), (0, 0, 0), 0.0), "vertical_fov_degrees"),
        (lambda: Camera((0, -5, 0), (0, 0, 0), 180), "vertical_fov_degrees"),
        (lambda: Camera((0, -5, 0), (0, 0, 0), np.nan), "vertical_fov_degrees"),
        (lambda: Camera((0, np.nan, 0), (0, 0, 0), 30), "position"),
        (lambda: Camera((0, 0), (0, 0, 0), 30), "position"),
        (lambda: Camera("above", (0, 0, 0), 30), "position"),
        (lambda: Sphere((0, 0, 1), 0.0), "radius"),
        (lambda: Sphere((0, 0, 1), np.inf), "radius"),
        (lambda: Sphere((0, 0, 1), "large"), "radius"),
        (lambda: Sphere(material=0), "material is 0"),
        (lambda: Sphere(material=1001), "material is 1001"),
        (lambda: Sphere(material=True), "material is True"),
        (lambda: Sphere(material=""), "material is ''"),
        (lambda: Sphere(material=1.0), "material is 1.0"),
        (lambda: Plane(0.0, (0.5, 0.5, 1.1)), "material"),
        (lambda: Plane(0.0, (0.5, 0.5)), "material"),
        (lambda: Plane(0.0, (0.5, -0.5, 0.5)), "material"),
        (lambda: Plane(np.nan), "height"),
        (lambda: MeshFile("a.ply", 0.0), "mesh scale"),
        (lambda: MeshFile("a.ply", 1.0, (0, 0, np.inf)), "mesh translation"),
        (lambda: Blob(-1.0), "blob scale"),
        (lambda: ConstantEnvironment((1, -1, 1)), "radiance"),
        (lambda: GradientEnvironment((1, 1, 1), (1, 1, 1), (np.inf, 1, 1)), "nadir"),
        (lambda: LatLongEnvironment(np.ones((4, 8))), "shape"),
        (lambda: LatLongEnvironment(np.ones((0, 8, 3))), "shape"),
        (lambda: LatLongEnvironment(-np.ones((4, 8, 3))), "negative"),
        (lambda: LatLongEnvironment(np.full((4, 8, 3), np.nan)), "nan"),
        (lambda: Panorama("a.exr", 0.0), "gain"),
        (lambda: Sky((0, 0, 0)), "zero"),
        (lambda: Sky((0, 0, 1), turbidity=0), "turbidity"),
        (lambda: Sky((0, 0, 1), ground=(-1, 0, 0)), "ground"),
        (lambda: Sun((0, 0, 0), (1, 1, 1)), "zero"),
        (lambda: Sun((0, 0, 1), (1, 1, -1)), "irradiance"),
        (lambda: PointLight((0, 0, np.nan), ONE), "position"),
        (lambda: PointLight((0, 0, 1), (-1, 1, 1)), "intensity"),
        (lambda: RectangleLight((0, 0, 1), (0, 0, 1), 1, 1, ONE), "look_at"),
        (lambda: RectangleLight((0, 0, 1), (0, 0, 0), 0, 1, ONE), "width"),
        (lambda: RectangleLight((0, 0, 1), (0, 0, 0), 1, np.inf, ONE), "height"),
        (lambda: RectangleLight((0, 0, 1), (0, 0, 0), 1, 1, (-1, 1, 1)), "radiance"),
        (lambda: Scene(Camera((0, -0.5, 1), (0, 0, 1), 30), [Sphere()]), "inside"),
        (lambda: Scene(CAMERA, [Sphere((0, 0, 5)), Plane(2.0)]), "above the plane"),
        (lambda: Scene(CAMERA, []), "no objects"),
        (lambda: Scene(CAMERA, [Sphere()], depth=0), "depth is 0"),
        (lambda: Scene(CAMERA, [Sphere()], depth=17), "depth is 17"),
        (lambda: Scene(CAMERA, [Sphere()], depth=1.5), "depth is 1.5"),
        (lambda: scene_of("mars"), "sphere, studio, furnace"),
        (lambda: scene_of(["sphere"]), "scene is list"),
    ],
)
def test_what_is_refused(make, words):
    with pytest.raises(BvbError, match=words):
        make()


def test_spheres_may_sink_into_the_ground_and_into_each_other():
    Scene(CAMERA, [Sphere((0, 0, 0.5)), Sphere((0.5, 0, 0.5)), Plane()])


@pytest.mark.parametrize("scale", [1e-300, 1.0, 1e300])
def test_a_suns_direction_is_normalised(scale):
    np.testing.assert_allclose(Sun((3 * scale, 0, 4 * scale), (1, 1, 1)).direction, (0.6, 0, 0.8), rtol=1e-15)
