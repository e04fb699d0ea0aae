"""The integrator against closed forms: furnace, sun, sky, shadow, ground, panorama; and its promises about seeds."""

import subprocess
import sys

import numba
import numpy as np
import pytest

import bvbedit.render as room
from bvbedit.brdf.analytic import Lambert
from bvbedit.brdf.base import Brdf
from bvbedit.errors import BvbError
from bvbedit.render import integrator, render
from bvbedit.render.scene import (
    Camera,
    ConstantEnvironment,
    GradientEnvironment,
    LatLongEnvironment,
    Plane,
    Scene,
    Sphere,
    Sun,
)

BLACK = ConstantEnvironment((0, 0, 0))
WHITE = Lambert(1.0)
# So narrow a view that every ray of a picture is the same to 1e-6: a light meter.
NARROW = 1e-6


class Recorder(Brdf):
    """Black, and remembers the directions it was asked at."""

    def _evaluate(self, wi, wo):
        self.wi, self.wo = wi.copy(), wo.copy()
        return np.zeros((len(wi), 3)), np.ones(len(wi), dtype=bool)


class Scaled(Brdf):
    def __init__(self, factor):
        self.factor = factor

    def _evaluate(self, wi, wo):
        f = self.factor * (wi[:, :1] + wo[:, 2:] ** 4 + 1.5)
        return np.repeat(f, 3, axis=1), np.ones(len(wi), dtype=bool)


class Value(Brdf):
    def __init__(self, value):
        self.value = value

    def _evaluate(self, wi, _):
        return np.full((len(wi), 3), self.value), np.ones(len(wi), dtype=bool)


def unit(*v):
    return np.array(v) / np.linalg.norm(v)


def meter(position, look_at):
    """A camera that measures one ray."""
    along = np.subtract(look_at, position)
    up = (0, 0, 1) if np.hypot(along[0], along[1]) > 0 else (0, 1, 0)
    return Camera(position, look_at, NARROW, up)


def sphere_radiance(normal, environment, *, sun=None, ground=None, sphere=None, model=WHITE, spp=1):
    """The radiance that the sphere sends along its normal."""
    sphere = sphere or Sphere()
    camera = meter(np.add(sphere.centre, 3 * np.asarray(normal)), sphere.centre)
    return render(model, Scene(camera, sphere, environment, ground, sun), width=1, height=1, spp=spp)[0, 0]


def ground_radiance(x, y, environment, *, sun=None, spp=1):
    scene = Scene(meter((x, y, 0.01), (x, y, 0)), Sphere(), environment, Plane(0.0, (0.2, 0.4, 0.6)), sun)
    return render(WHITE, scene, width=1, height=1, spp=spp)[0, 0]


def inside_sphere(scene, width, height, margin=0.02):
    """Pixels whose centre's ray passes the sphere's centre well within its radius."""
    right, up, forward = scene.camera.frame()
    reach = np.tan(scene.camera.vertical_fov / 2)
    a = ((np.arange(width) + 0.5) / width * 2 - 1) * reach * width / height
    b = (1 - (np.arange(height) + 0.5) / height * 2) * reach
    d = forward + a[None, :, None] * right + b[:, None, None] * up
    d /= np.linalg.norm(d, axis=-1, keepdims=True)
    to_centre = np.subtract(scene.sphere.centre, scene.camera.position)
    return np.linalg.norm(np.cross(d, to_centre), axis=-1) < scene.sphere.radius - margin


@pytest.mark.parametrize("albedo", [(1.0, 1.0, 1.0), (0.1, 0.5, 0.8), (0.0, 0.0, 0.0)])
def test_a_lambert_sphere_in_the_white_furnace_shows_its_albedo(albedo):
    scene = Scene(Camera((0, -5, 2), (0, 0, 1), 0.5), Sphere(), ConstantEnvironment())
    picture = render(Lambert(albedo), scene, width=50, height=40, spp=8)
    inside = inside_sphere(scene, 50, 40, margin=0.1)
    assert 400 < inside.sum() < 1600
    np.testing.assert_allclose(picture[inside], np.broadcast_to(albedo, (inside.sum(), 3)), atol=1e-5)
    np.testing.assert_allclose(picture[:2], 1.0, atol=1e-6)  # above the sphere: nothing but the furnace


def test_the_named_furnace_with_a_white_sphere_is_white_to_the_last_pixel():
    np.testing.assert_allclose(render(WHITE, "furnace", width=40, height=40, spp=4), 1.0, atol=1e-5)


def test_sun_on_lambert():
    sun = Sun((1, -2, 3), (3.0, 2.0, 1.0))
    rho = np.array((0.9, 0.5, 0.2))
    rng = np.random.default_rng(1)
    for _ in range(20):
        n = unit(*rng.normal(size=3))
        expected = rho / np.pi * sun.irradiance * max(n @ sun.direction, 0)
        np.testing.assert_allclose(
            sphere_radiance(n, BLACK, sun=sun, model=Lambert(rho)), expected, rtol=1e-4, atol=1e-5
        )


def test_a_sun_below_the_horizon_lights_nothing_where_there_is_a_ground():
    sun = Sun((0, 0, -1), (1, 1, 1))
    assert sphere_radiance((0, 0, -1), BLACK, sun=sun, sphere=Sphere((0, 0, 9)))[0] == pytest.approx(1 / np.pi)
    # In a raised scene the meter below the sphere is still above the ground.
    ground = Plane(0.0, (1, 1, 1))
    assert sphere_radiance((0, 0, -1), BLACK, sun=sun, ground=ground, sphere=Sphere((0, 0, 9)))[0] == 0
    assert ground_radiance(5, 0, BLACK, sun=sun)[0] == 0


def test_directions_reach_the_material_in_the_frame_of_the_surface():
    model = Recorder()
    sun = Sun((1, -2, 3), (1, 1, 1))
    scene = Scene(Camera((3, -6, 4), (0.4, -0.5, 1.3), NARROW), Sphere(), BLACK, None, sun)
    render(model, scene, width=1, height=1, spp=1)
    # The hit by an independent formula, and the tangent along the parallel towards the east.
    o, d = np.array((3, -6, 3)), unit(-2.6, 5.5, -2.7)
    n = o + d * (-(o @ d) - np.sqrt((o @ d) ** 2 - o @ o + 1))
    t = unit(*np.cross((0, 0, 1), n))
    frame = np.stack([t, np.cross(n, t), n])
    np.testing.assert_allclose(model.wi, [frame @ sun.direction], atol=1e-5)
    np.testing.assert_allclose(model.wo, [frame @ -d], atol=1e-5)


@pytest.mark.parametrize("normal", [(0, 0, 1), (0, -1, 0), (0, 0, -1), (0.6, 0.0, 0.8)])
def test_gradient_sky_against_quadrature(normal):
    sky = GradientEnvironment((0.2, 0.5, 2.0), (1.0, 0.7, 0.4), (0.3, 0.1, 0.0))
    theta = (np.arange(400) + 0.5) * np.pi / 400
    phi = (np.arange(400) + 0.5) * 2 * np.pi / 400
    T, P = np.meshgrid(theta, phi, indexing="ij")
    w = np.stack([np.sin(T) * np.cos(P), np.sin(T) * np.sin(P), np.cos(T)], axis=-1)
    share = np.abs(1 - T / (np.pi / 2))[..., None]
    radiance = np.where(
        T[..., None] < np.pi / 2,
        share * np.array(sky.zenith) + (1 - share) * np.array(sky.horizon),
        share * np.array(sky.nadir) + (1 - share) * np.array(sky.horizon),
    )
    weight = np.maximum(w @ normal, 0) * np.sin(T) * (np.pi / 400) * (2 * np.pi / 400) / np.pi
    expected = np.einsum("tp,tpk->k", weight, radiance)
    np.testing.assert_allclose(sphere_radiance(normal, sky, spp=4096), expected, rtol=1e-3)


def test_half_the_sky_is_hidden_by_a_black_ground():
    n = np.array((0.8, 0.0, 0.6))
    value = sphere_radiance(n, ConstantEnvironment(), ground=Plane(0.0, (0, 0, 0)), spp=4096)
    np.testing.assert_allclose(value, (1 + n[2]) / 2, rtol=1e-3)


def test_the_ground_lights_the_sphere_from_below():
    # High above its ground a sphere's shadow is too small to matter.
    sun, ground, sphere = Sun((0, 1, 2), (2, 2, 2)), Plane(0.0, (0.2, 0.4, 0.6)), Sphere((0, 0, 1000))
    bounce = np.array(ground.albedo) * (2 * sun.direction[2] / np.pi + 1)
    value = sphere_radiance((0, 0, -1), ConstantEnvironment(), sun=sun, ground=ground, sphere=sphere, spp=256)
    np.testing.assert_allclose(value, bounce, rtol=1e-3)


def test_the_ground_is_in_shadow_where_the_line_to_the_sun_passes_the_sphere():
    sun = Sun((-1, -1, 1), (2.0, 1.0, 0.5))
    rng = np.random.default_rng(2)
    bright = np.array((0.2, 0.4, 0.6)) * sun.irradiance * sun.direction[2] / np.pi
    seen = {True: 0, False: 0}
    for x, y in rng.uniform(-2, 4, size=(60, 2)):
        away = np.linalg.norm(np.cross((-x, -y, 1), sun.direction))
        if np.hypot(x, y) < 1.1 or abs(away - 1) < 1e-3:  # the meter would touch the sphere; the edge itself
            continue
        shaded = away < 1 and np.dot((-x, -y, 1), sun.direction) > 0
        seen[shaded] += 1
        np.testing.assert_allclose(ground_radiance(x, y, BLACK, sun=sun), 0 if shaded else bright, rtol=1e-5)
    assert min(seen.values()) > 5


@pytest.mark.parametrize("r", [1.2, 2.0, 5.0])
def test_the_sphere_dims_the_sky_on_the_ground_by_its_form_factor(r):
    # A sphere wholly above a plane element's horizon, seen at distance d and angle theta: F = cos(theta) (R/d)^2.
    d2 = r * r + 1
    expected = np.array((0.2, 0.4, 0.6)) * (1 - 1 / np.sqrt(d2) / d2)
    np.testing.assert_allclose(ground_radiance(r, 0, ConstantEnvironment(), spp=4096), expected, rtol=2e-3)


def test_missed_rays_show_the_texel_they_point_at():
    picture = np.random.default_rng(3).uniform(size=(4, 8, 3))
    for row, column in [(0, 0), (1, 3), (1, 4), (2, 7), (3, 5)]:
        theta, azimuth = (row + 0.5) * np.pi / 4, (column + 0.5 - 4) * 2 * np.pi / 8
        d = np.array((np.sin(theta) * np.sin(azimuth), np.sin(theta) * np.cos(azimuth), np.cos(theta)))
        scene = Scene(meter(5 * d, 6 * d), Sphere((0, 0, 0)), LatLongEnvironment(picture))
        np.testing.assert_allclose(
            render(WHITE, scene, width=1, height=1, spp=1)[0, 0], picture[row, column], rtol=1e-4
        )


def test_a_panorama_seen_by_the_camera_is_not_mirrored():
    picture = np.zeros((8, 16, 3))
    picture[:, 9:12, 0] = 1.0  # red right of the centre, which is +y
    picture[:, 4:7, 1] = 1.0  # green left of it
    picture[:4, :, 2] = 1.0  # blue above
    scene = Scene(Camera((0, 0, 0), (0, 1, 0), np.radians(90)), Sphere((0, -9, 0)), LatLongEnvironment(picture))
    seen = render(WHITE, scene, width=16, height=16, spp=16)
    assert seen[:, 12:, 0].min() > 0.5 > 0.01 > seen[:, :8, 0].max()
    assert seen[:, :4, 1].min() > 0.5 > 0.01 > seen[:, 8:, 1].max()
    assert seen[:5, :, 2].min() > 0.9 > 0.1 > seen[-5:, :, 2].max()


@pytest.mark.parametrize(
    ("direction", "texels"),
    [
        ((1, 0, 0), np.s_[3:5, 11:13]),
        ((-1, 0, 0), np.s_[3:5, 3:5]),
        ((0, 1, 0), np.s_[3:5, 7:9]),
        ((0, -1, 0), np.s_[3:5, [0, 15]]),
        ((0, 0, 1), np.s_[0, :]),
        ((0, 0, -1), np.s_[7, :]),
    ],
)
def test_a_bright_patch_lights_the_side_that_faces_it(direction, texels):
    picture = np.zeros((8, 16, 3))
    picture[texels] = 5.0
    panorama = LatLongEnvironment(picture)
    towards = sphere_radiance(direction, panorama, spp=256)[0]
    away = sphere_radiance(np.negative(direction), panorama, spp=256)[0]
    assert towards > 0.1
    assert away == 0


@pytest.mark.parametrize("scene", ["sphere", "studio"])
def test_one_seed_is_one_picture_on_any_number_of_threads(scene):
    options = {"width": 40, "height": 30, "spp": 9, "seed": 5}
    first = render(Scaled(1.0), scene, **options)
    threads = numba.get_num_threads()
    try:
        numba.set_num_threads(1)
        assert np.array_equal(render(Scaled(1.0), scene, **options), first)
    finally:
        numba.set_num_threads(threads)
    assert not np.array_equal(render(Scaled(1.0), scene, **{**options, "seed": 6}), first)


def test_pictures_of_two_materials_differ_by_nothing_but_the_materials():
    options = {"width": 40, "height": 30, "spp": 4}
    black, once, twice = (render(Scaled(f), "sphere", **options).astype(float) for f in (0.0, 0.1, 0.2))
    np.testing.assert_allclose(twice - black, 2 * (once - black), rtol=1e-5, atol=1e-6)
    assert (once - black).max() > 0.1


@pytest.mark.parametrize(("wave", "samples"), [(1, 1), (50, 3), (10**6, 10**6)])
def test_how_the_work_is_cut_does_not_matter(monkeypatch, wave, samples):
    expected = render(Scaled(0.3), "sphere", width=20, height=15, spp=10)
    monkeypatch.setattr(integrator, "WAVE", wave)
    monkeypatch.setattr(integrator, "SAMPLES_PER_WAVE", samples)
    np.testing.assert_allclose(render(Scaled(0.3), "sphere", width=20, height=15, spp=10), expected, rtol=1e-6)


def test_progress_rises_to_one():
    seen = []
    picture = render(WHITE, "sphere", width=64, height=48, spp=600, progress=seen.append)
    assert seen == sorted(seen)
    assert seen[-1] == 1.0
    assert len(seen) > 10
    assert picture.shape == (48, 64, 3)
    assert picture.dtype == np.float32


def test_importing_the_room_does_not_import_numba():
    rooms = "bvbedit.render, bvbedit.render.sheet, bvbedit.render.image_metrics"
    code = f"import sys, {rooms}; assert 'numba' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_the_room_is_also_the_verb():
    assert room(WHITE, "furnace", width=2, height=1, spp=1).shape == (1, 2, 3)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"width": 0}, "width is 0"),
        ({"height": 8193}, "height is 8193"),
        ({"width": 2.5}, "width is 2.5"),
        ({"spp": 0}, "spp is 0"),
        ({"spp": 65537}, "spp is 65537"),
        ({"seed": -1}, "seed is -1"),
        ({"seed": 2**63}, "seed is"),
        ({"scene": "moon"}, "sphere, studio, furnace"),
        ({"scene": 3}, "scene is int"),
        ({"scene": "nowhere.exr"}, "nowhere.exr"),
        ({"model": "chrome"}, "model is str"),
        ({"model": Value(np.nan)}, "not finite"),
        ({"model": Value(np.inf)}, "not finite"),
        ({"model": Value(1e300)}, "float32"),
    ],
)
def test_what_a_caller_may_not_ask(options, words):
    arguments = {"model": WHITE, "width": 8, "height": 8, "spp": 1, **options}
    with pytest.raises(BvbError, match=words):
        render(arguments.pop("model"), **arguments)


def test_seed_and_spp_take_numpy_integers():
    assert render(WHITE, width=np.int64(2), height=1, spp=np.uint8(1), seed=2**63 - 1).shape == (1, 2, 3)
