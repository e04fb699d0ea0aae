"""Pictures against closed forms: furnace, sun, sky, shadow, ground, panorama; and what is promised about seeds."""

import subprocess
import sys

import numba
import numpy as np
import pytest

import bvbedit.render as room
from bvbedit.brdf.analytic import Lambert
from bvbedit.brdf.base import Brdf
from bvbedit.brdf.materials import MATERIALS
from bvbedit.errors import BvbError
from bvbedit.render import integrator, render
from bvbedit.render.lights import ConstantEnvironment, GradientEnvironment, LatLongEnvironment, Sun
from bvbedit.render.scene import Camera, Plane, Scene, Sphere
from tests.render.meters import BLACK, NARROW, WHITE, Scaled, measured, meter, unit

COLOUR = (0.2, 0.4, 0.6)
GROUND = Plane(0.0, COLOUR)
TWO = Scene(Camera((0, -5, 2), (0, 0, 1), 40), [Sphere(), Plane(material=2)])


class Recorder(Brdf):
    """Black, and remembers the directions it was asked at."""

    def _evaluate(self, wi, wo):
        self.wi, self.wo = wi.copy(), wo.copy()
        return np.zeros((len(wi), 3)), np.ones(len(wi), dtype=bool)


class Value(Brdf):
    def __init__(self, value):
        self.value = value

    def _evaluate(self, wi, _):
        return np.full((len(wi), 3), self.value), np.ones(len(wi), dtype=bool)


def sphere_radiance(normal, environment, *others, sun=(), sphere=None, model=WHITE, side=1, spp=1, depth=1):
    """The radiance that the sphere sends along its normal."""
    sphere = sphere or Sphere()
    position = np.add(sphere.centre, 3 * np.asarray(normal))
    return measured(
        model, position, sphere.centre, [sphere, *others], environment, sun, depth=depth, side=side, spp=spp
    )


def ground_radiance(x, y, environment, *, sun=(), side=1, spp=1):
    return measured(WHITE, (x, y, 0.01), (x, y, 0), [Sphere(), GROUND], environment, sun, side=side, spp=spp)


def inside_sphere(scene, width, height, margin):
    """Pixels whose centre's ray passes the sphere's centre well within its radius."""
    sphere = scene.objects[0]
    right, up, forward = scene.camera.frame()
    reach = np.tan(np.radians(scene.camera.vertical_fov_degrees) / 2)
    a = ((np.arange(width) + 0.5) / width * 2 - 1) * reach * width / height
    b = (1 - (np.arange(height) + 0.5) / height * 2) * reach
    d = forward + a[None, :, None] * right + b[:, None, None] * up
    d /= np.linalg.norm(d, axis=-1, keepdims=True)
    to_centre = np.subtract(sphere.centre, scene.camera.position)
    return np.linalg.norm(np.cross(d, to_centre), axis=-1) < sphere.radius - margin


@pytest.mark.parametrize("albedo", [(1.0, 1.0, 1.0), (0.1, 0.5, 0.8), (0.0, 0.0, 0.0)])
def test_a_lambert_sphere_in_the_white_furnace_shows_its_albedo(albedo):
    scene = Scene(Camera((0, -5, 2), (0, 0, 1), 28.6), [Sphere()], ConstantEnvironment())
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
        value = sphere_radiance(n, BLACK, sun=[sun], model=Lambert(rho))
        np.testing.assert_allclose(value, expected, rtol=1e-4, atol=1e-5)


def test_a_sun_below_the_horizon_lights_nothing_where_there_is_a_ground():
    sun = Sun((0, 0, -1), (1, 1, 1))
    high = Sphere((0, 0, 9))
    assert sphere_radiance((0, 0, -1), BLACK, sun=[sun], sphere=high)[0] == pytest.approx(1 / np.pi)
    # In a raised scene the meter below the sphere is still above the ground.
    assert sphere_radiance((0, 0, -1), BLACK, Plane(0.0, (1, 1, 1)), sun=[sun], sphere=high)[0] == 0
    assert ground_radiance(5, 0, BLACK, sun=[sun])[0] == 0


def test_directions_reach_the_material_in_the_frame_of_the_surface():
    model = Recorder()
    sun = Sun((1, -2, 3), (1, 1, 1))
    scene = Scene(Camera((3, -6, 4), (0.4, -0.5, 1.3), NARROW), [Sphere()], BLACK, [sun])
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
    np.testing.assert_allclose(sphere_radiance(normal, sky, side=16, spp=64), expected, rtol=1e-3)


def test_half_the_sky_is_hidden_by_a_black_ground():
    n = np.array((0.8, 0.0, 0.6))
    value = sphere_radiance(n, ConstantEnvironment(), Plane(0.0, (0, 0, 0)), side=16, spp=64, depth=2)
    np.testing.assert_allclose(value, (1 + n[2]) / 2, rtol=3e-3)


def test_the_ground_lights_the_sphere_from_below_where_light_may_meet_two_surfaces():
    # High above its ground a sphere's shadow is too small to matter.
    sun, sphere = Sun((0, 1, 2), (2, 2, 2)), Sphere((0, 0, 1000))
    below = (0, 0, -1), ConstantEnvironment(), GROUND
    bounce = np.array(COLOUR) * (2 * sun.direction[2] / np.pi + 1)
    np.testing.assert_allclose(
        sphere_radiance(*below, sun=[sun], sphere=sphere, side=8, spp=16, depth=2), bounce, rtol=1e-3
    )
    assert np.array_equal(sphere_radiance(*below, sun=[sun], sphere=sphere, side=8, spp=16, depth=1), np.zeros(3))


def test_the_ground_is_in_shadow_where_the_line_to_the_sun_passes_the_sphere():
    sun = Sun((-1, -1, 1), (2.0, 1.0, 0.5))
    rng = np.random.default_rng(2)
    bright = np.array(COLOUR) * sun.irradiance * sun.direction[2] / np.pi
    seen = {True: 0, False: 0}
    for x, y in rng.uniform(-2, 4, size=(60, 2)):
        away = np.linalg.norm(np.cross((-x, -y, 1), sun.direction))
        if np.hypot(x, y) < 1.1 or abs(away - 1) < 1e-3:  # the meter would touch the sphere; the edge itself
            continue
        shaded = away < 1 and np.dot((-x, -y, 1), sun.direction) > 0
        seen[shaded] += 1
        np.testing.assert_allclose(ground_radiance(x, y, BLACK, sun=[sun]), 0 if shaded else bright, rtol=1e-5)
    assert min(seen.values()) > 5


@pytest.mark.parametrize("r", [1.2, 2.0, 5.0])
def test_the_sphere_dims_the_sky_on_the_ground_by_its_form_factor(r):
    # A sphere wholly above a plane element's horizon, seen at distance d and angle theta: F = cos(theta) (R/d)^2.
    d2 = r * r + 1
    expected = np.array(COLOUR) * (1 - 1 / np.sqrt(d2) / d2)
    np.testing.assert_allclose(ground_radiance(r, 0, ConstantEnvironment(), side=16, spp=64), expected, rtol=2e-3)


def test_missed_rays_show_the_texel_they_point_at():
    picture = np.random.default_rng(3).uniform(size=(4, 8, 3))
    for row, column in [(0, 0), (1, 3), (1, 4), (2, 7), (3, 5)]:
        theta, azimuth = (row + 0.5) * np.pi / 4, (column + 0.5 - 4) * 2 * np.pi / 8
        d = np.array((np.sin(theta) * np.sin(azimuth), np.sin(theta) * np.cos(azimuth), np.cos(theta)))
        seen = measured(WHITE, 5 * d, 6 * d, [Sphere((0, 0, 0))], LatLongEnvironment(picture))
        np.testing.assert_allclose(seen, picture[row, column], rtol=1e-4)


def test_a_panorama_seen_by_the_camera_is_not_mirrored():
    picture = np.zeros((8, 16, 3))
    picture[:, 9:12, 0] = 1.0  # red right of the centre, which is +y
    picture[:, 4:7, 1] = 1.0  # green left of it
    picture[:4, :, 2] = 1.0  # blue above
    scene = Scene(Camera((0, 0, 0), (0, 1, 0), 90), [Sphere((0, -9, 0))], LatLongEnvironment(picture))
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
    towards = sphere_radiance(direction, panorama, side=4, spp=8)[0]
    away = sphere_radiance(np.negative(direction), panorama, side=4, spp=8)[0]
    assert towards > 0.1
    assert away == 0


@pytest.mark.parametrize("up", [(0, 0, 1), (1, 0, 0), (0, 0, -1), (1, 0, 1)])
def test_a_pixel_is_the_mean_of_all_that_it_covers(up):
    # The horizon of a black plane halves it, whichever way the camera is rolled.
    scene = Scene(Camera((0, 0, 1), (0, 5, 1), 60, up), [Plane(material=(0, 0, 0))], ConstantEnvironment())
    picture = render([], scene, width=1, height=1, spp=1024)
    np.testing.assert_allclose(picture[0, 0], 0.5, atol=0.005)


def test_every_object_shows_its_own_material():
    colours = np.random.default_rng(4).uniform(size=(6, 3))
    objects = [
        Sphere((0, 0, 0), 1, tuple(colours[0])),
        Plane(-9, tuple(colours[1])),
        Sphere((4, 0, 0), 1, 2),
        Sphere((8, 0, 0), 1, 1),
        Sphere((12, 0, 0), 1, tuple(colours[0])),
    ]
    models = [Lambert(colours[2]), Lambert(colours[3])]
    sun = Sun((0, 0, 1), (np.pi, np.pi, np.pi))
    for x, colour in [(0, 0), (4, 3), (8, 2), (12, 0), (20, 1)]:
        seen = measured(models, (x, 0, 2), (x, 0, 0), objects, lights=[sun])
        np.testing.assert_allclose(seen, colours[colour], rtol=1e-5)


def test_a_sample_material_is_meant_by_its_name():
    options = {"width": 6, "height": 6, "spp": 2}
    camera, sky = Camera((0, -5, 1), (0, 0, 1), 28), ConstantEnvironment()
    named = render([], Scene(camera, [Sphere(material="copper")], sky), **options)
    assert np.array_equal(render(MATERIALS["copper"].brdf, Scene(camera, [Sphere()], sky), **options), named)


@pytest.mark.parametrize("scene", ["sphere", "studio"])
def test_one_seed_is_one_picture_on_any_number_of_threads(scene):
    options = {"width": 40, "height": 30, "spp": 9, "seed": 5}
    first = render(Scaled(1.0), scene, **options)
    threads = numba.get_num_threads()
    try:
        for count in (1, numba.config.NUMBA_NUM_THREADS):
            numba.set_num_threads(count)
            assert np.array_equal(render(Scaled(1.0), scene, **options), first)
    finally:
        numba.set_num_threads(threads)
    assert not np.array_equal(render(Scaled(1.0), scene, **{**options, "seed": 6}), first)


def test_pictures_of_two_materials_differ_by_nothing_but_the_materials():
    options = {"width": 40, "height": 30, "spp": 4, "density": Scaled(1.0).density}
    black, once, twice = (render(Scaled(f), "sphere", **options).astype(float) for f in (0.0, 0.3, 0.6))
    np.testing.assert_allclose(twice - black, 2 * (once - black), rtol=1e-5, atol=1e-6)
    assert (once - black).max() > 0.1


def test_any_density_that_is_nowhere_zero_gives_the_same_picture_but_for_noise():
    options = {"width": 16, "height": 16, "spp": 64}
    own, other = (render(Scaled(1.0), "sphere", density=d, **options) for d in (None, WHITE.density))
    assert not np.array_equal(own, other)
    np.testing.assert_allclose(own.mean(axis=(0, 1)), other.mean(axis=(0, 1)), rtol=2e-3)


@pytest.mark.parametrize(("wave", "passes", "largest"), [(1, (1, 1, 2), 4), (50, (3,), 3), (10**6, (10**6,), 10**6)])
def test_how_the_work_is_cut_does_not_matter(monkeypatch, wave, passes, largest):
    expected = render(Scaled(0.3), "sphere", width=6, height=5, spp=6)
    monkeypatch.setattr(integrator, "WAVE", wave)
    monkeypatch.setattr(integrator, "PASSES", passes)
    monkeypatch.setattr(integrator, "LARGEST_PASS", largest)
    np.testing.assert_allclose(render(Scaled(0.3), "sphere", width=6, height=5, spp=6), expected, rtol=1e-6)


def test_progress_rises_to_one(monkeypatch):
    monkeypatch.setattr(integrator, "WAVE", 4000)
    seen = []
    picture = render(WHITE, "sphere", width=32, height=24, spp=17, progress=seen.append)
    assert seen == sorted(seen)
    assert 0 < seen[0] < seen[-1] == 1.0
    assert len(seen) > 6
    assert picture.shape == (24, 32, 3)
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
        ({"noise": 0}, "noise is 0"),
        ({"noise": np.nan}, "noise is nan"),
        ({"time_limit": -1.0}, "time_limit is -1"),
        ({"time_limit": "1 h"}, "time_limit is '1 h'"),
        ({"scene": "moon"}, "sphere, studio, furnace"),
        ({"scene": 3}, "scene is int"),
        ({"scene": "nowhere.exr"}, "nowhere.exr"),
        ({"scene": "nowhere.toml"}, "nowhere.toml"),
        ({"model": "chrome"}, "model is str"),
        ({"model": [WHITE, "chrome"]}, "model is str"),
        ({"model": []}, "asks for 1 models, 0 given"),
        ({"scene": TWO}, "asks for 2 models, 1 given"),
        ({"density": WHITE}, "density is Lambert"),
        ({"scene": TWO, "model": [WHITE, WHITE], "density": [WHITE.density]}, "1 densities .* 2 models"),
        ({"model": Value(np.nan)}, "not finite"),
        ({"model": Value(np.inf)}, "not finite"),
        ({"model": Value(1e300)}, "float32"),
    ],
)
def test_what_a_caller_may_not_ask(options, words):
    arguments = {"model": WHITE, "width": 8, "height": 8, "spp": 1, **options}
    with pytest.raises(BvbError, match=words) as caught:
        render(arguments.pop("model"), **arguments)
    assert "\n" not in str(caught.value)


def test_seed_and_spp_take_numpy_integers():
    assert render(WHITE, width=np.int64(2), height=1, spp=np.uint8(1), seed=2**63 - 1).shape == (1, 2, 3)


def test_a_scene_of_nothing_but_its_own_materials_needs_no_model():
    scene = Scene(meter((0, 0, 3), (0, 0, 1)), [Sphere(material=COLOUR)], ConstantEnvironment())
    np.testing.assert_allclose(render([], scene, width=1, height=1, spp=1)[0, 0], COLOUR, rtol=1e-5)
