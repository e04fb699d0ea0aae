"""Scene values: what they refuse, the named scenes, and a panorama from a file."""

import numpy as np
import pytest

from bvbedit.brdf.analytic import Lambert
from bvbedit.errors import BvbError
from bvbedit.io.exr import write_exr
from bvbedit.render import render
from bvbedit.render.named_scenes import SCENES, scene_named, scene_with_environment
from bvbedit.render.scene import (
    Camera,
    ConstantEnvironment,
    GradientEnvironment,
    LatLongEnvironment,
    Plane,
    Scene,
    Sphere,
    Sun,
    directions_of_texels,
)

CAMERA = Camera((0, -5, 1), (0, 0, 1), 0.5)


def test_the_cameras_frame_is_orthonormal_and_right_handed():
    right, up, forward = Camera((1, -5, 3), (0, 2, 1), 0.5).frame()
    np.testing.assert_allclose(np.cross(right, up), -forward, atol=1e-15)
    assert forward @ (-1, 7, -2) == pytest.approx(np.sqrt(54))
    assert right[2] == pytest.approx(0)
    assert up[2] > 0


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


@pytest.mark.parametrize("name", list(SCENES))
def test_named_scenes_leave_paper_between_black_and_white(name):
    scene = scene_named(name)
    assert isinstance(scene, Scene)
    picture = render(Lambert(0.8), name, width=32, height=32, spp=16)
    on_the_sphere = picture[12:20, 12:20]
    assert on_the_sphere.min() > 0.2
    assert on_the_sphere.max() < 1.0


@pytest.mark.parametrize("name", ["sphere", "studio"])
def test_the_ground_of_named_scenes_melts_into_the_background(name):
    picture = render(Lambert(0.0), name, width=24, height=24, spp=256)
    edge = picture[:8, 0].mean(axis=1)
    assert np.abs(np.diff(edge)).max() < 0.03


def test_a_panorama_from_a_file(tmp_path):
    path = tmp_path / "Room.EXR"
    panorama = np.full((4, 8, 3), 0.25, dtype=np.float32)
    write_exr(path, panorama)
    assert np.array_equal(scene_with_environment(path).environment.texels(), panorama)
    picture = render(Lambert(1.0), path, width=16, height=16, spp=2)
    np.testing.assert_allclose(picture, 0.25, rtol=1e-5)
    np.testing.assert_array_equal(render(Lambert(1.0), str(path), width=16, height=16, spp=2), picture)


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
        (lambda: Camera((0, 0, 0), (0, 0, 0), 0.5), "nowhere"),
        (lambda: Camera((0, 0, 9), (0, 0, 0), 0.5), "own up"),
        (lambda: Camera((0, -5, 0), (0, 0, 0), 0.0), "vertical_fov"),
        (lambda: Camera((0, -5, 0), (0, 0, 0), np.nan), "vertical_fov"),
        (lambda: Camera((0, np.nan, 0), (0, 0, 0), 1.0), "position"),
        (lambda: Camera((0, 0), (0, 0, 0), 1.0), "position"),
        (lambda: Camera("above", (0, 0, 0), 1.0), "position"),
        (lambda: Sphere((0, 0, 1), 0.0), "radius"),
        (lambda: Sphere((0, 0, 1), np.inf), "radius"),
        (lambda: Sphere((0, 0, 1), "large"), "radius"),
        (lambda: Plane(0.0, (0.5, 0.5, 1.1)), "albedo"),
        (lambda: Plane(np.nan), "height"),
        (lambda: ConstantEnvironment((1, -1, 1)), "radiance"),
        (lambda: GradientEnvironment((1, 1, 1), (1, 1, 1), (np.inf, 1, 1)), "nadir"),
        (lambda: LatLongEnvironment(np.ones((4, 8))), "shape"),
        (lambda: LatLongEnvironment(np.ones((0, 8, 3))), "shape"),
        (lambda: LatLongEnvironment(-np.ones((4, 8, 3))), "negative"),
        (lambda: LatLongEnvironment(np.full((4, 8, 3), np.nan)), "nan"),
        (lambda: Sun((0, 0, 0), (1, 1, 1)), "zero"),
        (lambda: Sun((0, 0, 1), (1, 1, -1)), "irradiance"),
        (lambda: Scene(Camera((0, -0.5, 1), (0, 0, 1), 0.5), Sphere(), ConstantEnvironment()), "inside"),
        (lambda: Scene(CAMERA, Sphere((0, 0, 0.5)), ConstantEnvironment(), Plane()), "sinks"),
        (lambda: Scene(CAMERA, Sphere((0, 0, 5)), ConstantEnvironment(), Plane(2.0)), "above the ground"),
        (lambda: scene_named("mars"), "sphere, studio, furnace"),
        (lambda: scene_named(["sphere"]), "sphere, studio, furnace"),
    ],
)
def test_what_is_refused(make, words):
    with pytest.raises(BvbError, match=words):
        make()


@pytest.mark.parametrize("scale", [1e-300, 1.0, 1e300])
def test_a_suns_direction_is_normalised(scale):
    np.testing.assert_allclose(Sun((3 * scale, 0, 4 * scale), (1, 1, 1)).direction, (0.6, 0, 0.8), rtol=1e-15)
