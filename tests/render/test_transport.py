"""How light travels: ways of finding it agree, energy is kept, lamps light by their geometry, surfaces one another.

Truths come from closed forms, quadrature, and a brute-force Monte Carlo that shares nothing with the renderer.
"""

from itertools import combinations, pairwise

import numpy as np
import pytest

from bvbedit.brdf.analytic import GGX, Lambert, Schlick
from bvbedit.brdf.charts import HALF_DIFF
from bvbedit.brdf.encodings import Root
from bvbedit.brdf.geometry import spherical
from bvbedit.brdf.materials import MATERIALS
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.render import render
from bvbedit.render.lights import ConstantEnvironment, LatLongEnvironment, PointLight, RectangleLight, Sun
from bvbedit.render.meshes import Mesh, _ball
from bvbedit.render.scene import Camera, MeshFile, Plane, Scene, Sphere
from bvbedit.render.shading import shade
from bvbedit.render.stage import make_stage
from bvbedit.render.trace import trace
from bvbedit.spline.knots import clamped
from bvbedit.spline.tensor import TensorSpline
from tests.render.meters import BLACK, WHITE, in_memory, measured, meter, square, unit

FURNACE = ConstantEnvironment()
ONE = (1.0, 1.0, 1.0)
# The plane is looked at from 50 degrees, from the side of -y: mirrors show what is in this direction.
VIEW = np.radians(50)
VIEWER, MIRRORED = (0, -np.sin(VIEW), np.cos(VIEW)), np.array((0, np.sin(VIEW), np.cos(VIEW)))
# A pixel of a pass of a wave is one estimate, so that their spread tells the error of their mean.
SIDE, SPP = 24, 16


def spline_model():
    """A B-spline volume with a soft highlight, brighter towards grazing."""
    h, d, p = np.meshgrid(*(np.linspace(0, 1, n) for n in (8, 5, 4)), indexing="ij")
    grey = 0.35 + 0.8 * np.exp(-((4 * h) ** 2)) + 0.2 * d**2 + 0.05 * p
    knots = [clamped(np.linspace(0, 1, n - 2)[1:-1], 3) for n in (8, 5, 4)]
    return SplineBrdf(TensorSpline((3, 3, 3), knots, grey[..., None] * [1.0, 0.8, 0.6]), HALF_DIFF, Root())


def ball(radius=1.0, centre=(0.0, 0.0, 0.0)):
    points, triangles = _ball()
    return Mesh(points * radius + centre, triangles, points)


def hot_spot(towards, radiance, ambient=0.2):
    """A dim panorama with a bright texel in a direction."""
    picture = np.full((24, 48, 3), ambient)
    x, y, z = towards
    row, column = int(np.arccos(z) / np.pi * 24), int((0.5 + np.arctan2(x, y) / (2 * np.pi)) * 48)
    picture[row, column] = np.array((1.0, 0.8, 0.5)) * radiance
    return LatLongEnvironment(picture)


def lamp_towards(direction, side, radiance):
    """A square lamp at distance 3 that faces the origin."""
    return RectangleLight(3 * unit(*direction), (0, 0, 0), side, side, radiance)


def estimate(scene, model, strategy, seed):
    """What a strategy finds: the mean (3,) and its standard error (3,)."""
    stage = make_stage(scene, [model])
    wave = trace(stage, (0, 0, SPP, np.uint64(seed)), SIDE * SIDE * SPP, (SIDE, SIDE), strategy)
    seen = shade(wave, lambda level, n, part: stage.materials[n].evaluate_unit(level.wi[part], level.wo[part])[0])
    pixels = seen.reshape(-1, SPP, 3).mean(axis=1)
    return pixels.mean(axis=0), pixels.std(axis=0, ddof=1) / SIDE


PANORAMA = hot_spot(MIRRORED, 60.0)
RECTANGLE = lamp_towards(np.add(MIRRORED, (0.1, 0, 0)), 1.2, (4.0, 3.0, 2.0))
LAMPS = [RECTANGLE, PointLight((1, 1, 2), (3.0, 2.0, 1.0)), Sun((-1, 1, 2), (1.0, 0.5, 2.0))]
LIT_BY = {
    "panorama": (PANORAMA, [], 1),
    "rectangle": (BLACK, [RECTANGLE], 1),
    "all": (PANORAMA, LAMPS, 1),
    "all, between a sphere and the plane": (PANORAMA, LAMPS, 3),
}
SEEN = {"Lambert": Lambert((0.9, 0.5, 0.2)), "GGX": GGX(0.3, Schlick(0.6)), "plastic": MATERIALS["blue-plastic"].brdf}


@pytest.mark.parametrize("model", SEEN)
@pytest.mark.parametrize("light", LIT_BY)
def test_all_ways_of_finding_direct_light_agree(light, model):
    environment, lamps, depth = LIT_BY[light]
    objects = [Plane(material=1), Sphere((1.2, 0.6, 0.7), 0.7, 1)][: 1 if depth == 1 else 2]
    scene = Scene(meter(VIEWER, (0, 0, 0)), objects, environment, lamps, depth)
    for seed in (1, 2):
        found = [estimate(scene, SEEN[model], strategy, seed) for strategy in ("both", "density", "lights")]
        for (mean, error), (other, its_error) in combinations(found, 2):
            np.testing.assert_array_less(np.abs(mean - other), 3 * np.hypot(error, its_error))
        # Errors small enough to tell a light that is counted twice, or half.
        assert all((error < 0.08 * mean).all() for mean, error in found)


@pytest.mark.parametrize("environment", [BLACK, hot_spot(MIRRORED, 0.0)])
def test_all_ways_agree_on_a_mirror_that_shows_a_small_lamp(environment):
    # The lamp, of half a degree, is larger than the lobe of the chrome, and ends within it.
    lamp = lamp_towards(MIRRORED, 0.06, (40.0, 30.0, 20.0))
    scene = Scene(meter(VIEWER, (0, 0, 0)), [Plane(material=1)], environment, [lamp])
    found = [estimate(scene, MATERIALS["chrome"].brdf, strategy, 3) for strategy in ("both", "density", "lights")]
    for (mean, error), (other, its_error) in combinations(found, 2):
        np.testing.assert_array_less(np.abs(mean - other), 3 * np.hypot(error, its_error))
    assert all((error < 0.05 * mean).all() for mean, error in found)


def test_both_ways_together_are_hardly_worse_than_the_better_one():
    for model, side in [("Lambert", 0.1), ("plastic", 6.0)]:
        lamp = lamp_towards(MIRRORED, side, ONE)
        scene = Scene(meter(VIEWER, (0, 0, 0)), [Plane(material=1)], BLACK, [lamp])
        both, density, lights = (estimate(scene, SEEN[model], way, 4)[1] for way in ("both", "density", "lights"))
        assert (both < 2 * np.minimum(density, lights) + 1e-6).all()
        assert (both < 0.5 * np.maximum(density, lights)).all()


def albedo(model, theta):
    """Directional albedo (3,) by the midpoint rule."""
    t, p = np.meshgrid((np.arange(300) + 0.5) * np.pi / 600, (np.arange(360) + 0.5) * np.pi / 180, indexing="ij")
    wi, wo = spherical(t, p).reshape(-1, 3), np.broadcast_to(spherical(theta, 0.0), (t.size, 3))
    weight = (np.cos(t) * np.sin(t)).reshape(-1, 1) * (np.pi / 600) * (np.pi / 180)
    return (model.evaluate(wi, wo) * weight).sum(axis=0)


@pytest.mark.parametrize("degrees", [0.0, 40.0, 75.0])
@pytest.mark.parametrize("model", [Lambert((0.9, 0.5, 0.2)), GGX(0.3, Schlick(0.6)), spline_model()])
def test_a_plane_in_the_furnace_shows_the_directional_albedo(model, degrees):
    theta = np.radians(degrees)
    viewer = (0, -np.sin(theta), np.cos(theta))
    seen = measured(model, viewer, (0, 0, 0), [Plane(material=1)], FURNACE, side=32, spp=16)
    np.testing.assert_allclose(seen, albedo(model, theta), rtol=5e-3)


def test_interreflection_in_an_integrating_sphere_is_a_geometric_series(monkeypatch):
    # A lamp of intensity I in the middle of a Lambert cavity: irradiance I / R^2, times albedo at each further surface.
    in_memory(monkeypatch, cavity=ball(2.0))
    rho, intensity = np.array((0.9, 0.5, 0.2)), np.array((3.0, 2.0, 1.0))
    camera, lamp = Camera((0.3, 0.2, -0.1), (1, 1, 1), 60), PointLight((0, 0, 0), intensity)
    for depth in (1, 2, 3, 8, 16):
        scene = Scene(camera, [MeshFile("cavity")], BLACK, [lamp], depth)
        expected = rho / np.pi * intensity / 4 * (1 - rho**depth) / (1 - rho)
        picture = render(Lambert(rho), scene, width=4, height=4, spp=2)
        np.testing.assert_allclose(picture, np.broadcast_to(expected, (4, 4, 3)), rtol=2e-3)


def test_where_nothing_is_absorbed_the_furnace_is_white_up_to_the_paths_that_are_cut_off():
    # White sphere, white plane: a path sees 1 where it escapes, and 0 where it would meet one more surface.
    pictures = []
    for depth in (1, 2, 4, 16):
        scene = Scene(Camera((0, -4, 1.5), (0, 0, 0.6), 40), [Sphere(), Plane(material=ONE)], FURNACE, depth=depth)
        pictures.append(render(WHITE, scene, width=12, height=12, spp=16).astype(float))
    for fewer, more in pairwise(pictures):
        assert (fewer <= more + 1e-5).all()
    assert all(p.min() >= 0 and p.max() <= 1 + 1e-5 for p in pictures)
    assert pictures[0].mean() < 0.85
    assert pictures[-1].mean() > 0.995


def test_a_lone_plane_meets_no_second_surface():
    for depth in (1, 16):
        seen = measured([], (0, 0, 1), (0, 0, 0), [Plane(material=(0.2, 0.4, 0.6))], FURNACE, depth=depth, side=4)
        np.testing.assert_allclose(seen, (0.2, 0.4, 0.6), rtol=1e-5)


def test_a_plane_of_direct_light_only_sees_lamps_and_sky_but_no_other_surface():
    lamps, ground = [Sun((1, 1, 1), ONE), PointLight((3, 3, 3), ONE)], (0.2, 0.4, 0.6)
    options = {"environment": FURNACE, "lights": lamps, "side": 8, "spp": 8}
    to_plane, to_sphere = ((1.5, -0.5, 0.01), (1.5, -0.5, 0)), ((0, -2, 0), (0, 0, 1))
    for view, differs in [(to_plane, True), (to_sphere, False)]:
        alone, direct, full = (
            measured(WHITE, *np.add(view, (0, 0, 0.01)), [Sphere(), Plane(0.0, ground, only)], depth=d, **options)
            for only, d in [(True, 2), (True, 1), (False, 2)]
        )
        assert np.array_equal(alone, direct if differs else full)
        assert (full > direct + 0.01).all()


def corner_factor(a, b, c):
    """Form factor from a plane element to a parallel rectangle a x b at distance c, one corner of it overhead.

    Source: Siegel & Howell, "Thermal Radiation Heat Transfer", appendix on configuration factors.
    """
    x, y = a / c, b / c
    u, v = np.sqrt(1 + x * x), np.sqrt(1 + y * y)
    return (x / u * np.arctan(y / u) + y / v * np.arctan(x / v)) / (2 * np.pi)


@pytest.mark.parametrize("height", [0.3, 1.0, 4.0])
@pytest.mark.parametrize("offset", [0.0, 0.7])
def test_a_rectangle_lights_a_parallel_plane_by_its_form_factor(height, offset):
    a, b, rho, radiance = 0.8, 0.5, np.array((0.9, 0.5, 0.2)), np.array((1.0, 2.0, 3.0))
    lamp = RectangleLight((offset, 0, height), (offset, 0, 0), 2 * a, 2 * b, radiance)
    factor = 2 * (corner_factor(offset + a, b, height) + corner_factor(a - offset, b, height))
    seen = measured(Lambert(rho), (0, 0, 0.01), (0, 0, 0), [Plane(material=1)], BLACK, [lamp], side=16, spp=64)
    np.testing.assert_allclose(seen, rho * radiance * factor, rtol=3e-3)


def test_the_light_of_a_point_falls_with_the_square_of_the_distance():
    intensity = np.array((1.0, 2.0, 3.0))
    for place in [(0, 0, 1), (0, 0, 2), (0, 0, 20), (3, -4, 12), (30, -40, 120)]:
        squared = np.dot(place, place)
        expected = 0.5 / np.pi * intensity * place[2] / np.sqrt(squared) / squared
        seen = measured([], (0, 0, 0.1), (0, 0, 0), [Plane()], lights=[PointLight(place, intensity)])
        np.testing.assert_allclose(seen, expected, rtol=1e-6)


def test_the_back_of_a_rectangle_is_black_and_lights_nothing():
    down = RectangleLight((0, 0, 2), (0, 0, 0), 2, 2, ONE)
    up = RectangleLight((0, 0, 2), (0, 0, 3), 2, 2, ONE)
    for lamp, shines in [(down, True), (up, False)]:
        for way in ("both", "density", "lights"):
            scene = Scene(meter((0, 0, 1), (0, 0, 0)), [Plane(material=1)], FURNACE, [lamp])
            ahead = Scene(meter((0, 0, 1), (0, 0, 2)), [Plane(material=1)], FURNACE, [lamp])
            below = estimate(scene, WHITE, way, 5)[0]
            hidden = 4 * corner_factor(1, 1, 2)
            np.testing.assert_allclose(below, 1.0 if shines else 1 - hidden, rtol=0.02)
            np.testing.assert_array_equal(estimate(ahead, WHITE, way, 5)[0], float(shines))


@pytest.mark.parametrize("what", ["mesh", "sphere", "rectangle"])
@pytest.mark.parametrize("lamp", ["sun", "point", "small rectangle"])
def test_what_is_between_a_lamp_and_the_plane_throws_a_shadow(what, lamp, monkeypatch):
    in_memory(monkeypatch, roof=square(1.0, 2.0))
    light = {
        "sun": Sun((0, 0, 1), ONE),
        "point": PointLight((0, 0, 4), ONE),
        "small rectangle": RectangleLight((0, 0, 4), (0, 0, 0), 0.002, 0.002, ONE),
    }[lamp]
    objects, lights = [Plane()], [light]
    if what == "mesh":
        objects.append(MeshFile("roof"))
    elif what == "sphere":
        objects.append(Sphere((0, 0, 2), 0.5))
    else:
        lights.append(RectangleLight((0, 0, 2), (0, 0, 3), 1, 1, (0, 0, 0)))
    # The roof is half as wide as its shadow by a lamp at twice its height.
    edge = 0.5 if lamp == "sun" else 1.0
    for x, shaded in [(0.0, True), (0.9 * edge, True), (-0.9 * edge, True), (1.2 * edge, False), (-1.2 * edge, False)]:
        free, seen = (measured(WHITE, (x, 0, 0.01), (x, 0, 0), objects[:n], BLACK, lights[:n], side=2) for n in (1, 2))
        assert free.min() > 0
        np.testing.assert_allclose(seen, 0 if shaded else free, rtol=1e-5)


@pytest.mark.parametrize("what", ["mesh", "sphere", "rectangle"])
def test_what_is_behind_a_lamp_throws_no_shadow(what, monkeypatch):
    in_memory(monkeypatch, roof=square(9.0, 2.001))
    more = {
        "mesh": ([MeshFile("roof")], []),
        "sphere": ([Sphere((0, 0, 4.001), 2.0)], []),
        "rectangle": ([], [RectangleLight((0, 0, 2.001), (0, 0, 0), 9, 9, (0, 0, 0))]),
    }[what]
    for light in [PointLight((0, 0, 2), ONE), RectangleLight((0, 0, 2), (0, 0, 0), 0.2, 0.2, ONE)]:
        free, seen = (
            measured(Lambert(0.0), (0.5, 0, 0.01), (0.5, 0, 0), [Plane(), *objects], BLACK, [light, *lights], side=2)
            for objects, lights in [([], []), more]
        )
        np.testing.assert_allclose(seen, free, rtol=1e-4)  # meshes lift the places that are lit


def test_a_fine_mesh_of_a_sphere_looks_like_the_sphere(monkeypatch):
    in_memory(monkeypatch, ball=ball(1.0, (0, 0, 1)))
    camera, sky = Camera((0, -6, 2), (0, 0, 0.9), 30), LatLongEnvironment(np.linspace(0, 1, 96).reshape(4, 8, 3))
    pictures = [
        render(
            GGX(0.3, Schlick(0.6)), Scene(camera, [body, Plane()], sky, LAMPS, 3), width=24, height=24, spp=4
        ).astype(float)
        for body in (Sphere(), MeshFile("ball"))
    ]
    # The random numbers are the same, so that only silhouettes and edges of shadows differ.
    off = np.abs(pictures[1] - pictures[0]).max(axis=2) > 0.02 * pictures[0].mean()
    assert off.mean() < 0.04
    np.testing.assert_allclose(pictures[1].mean(axis=(0, 1)), pictures[0].mean(axis=(0, 1)), rtol=5e-3)


@pytest.mark.parametrize("far", [(0, 0, 0), (3e5, -2e5, 0)])
def test_shadows_of_meshes_far_from_the_origin_are_as_sharp_as_at_the_origin(far, monkeypatch):
    in_memory(monkeypatch, floor=square(4.0), roof=square(1.0, 0.2))
    objects = [MeshFile(name, 1.0, far, (1.0, 1.0, 1.0)) for name in ("floor", "roof")]
    for x, shaded in [(0.0, True), (0.45, True), (0.55, False)]:
        seen = measured(
            [], np.add(far, (x, 0, 0.1)), np.add(far, (x, 0, 0)), objects, lights=[Sun((0, 0, 1), ONE)], side=2
        )
        np.testing.assert_allclose(seen, 0.0 if shaded else 1 / np.pi, rtol=1e-3)


def test_where_a_shading_normal_turns_away_from_the_viewer_the_surfaces_own_takes_its_place(monkeypatch):
    flat = square(2.0)
    in_memory(monkeypatch, leaning=Mesh(flat.vertices, flat.triangles, np.tile([1.0, 0.0, 0.1], (4, 1))))
    objects = [MeshFile("leaning", material=(0.2, 0.4, 0.6))]
    for turned_away, x in [(True, -1), (False, 1)]:
        seen = measured([], (x, 0, 1), (0, 0, 0), objects, FURNACE, side=8, spp=8)
        if turned_away:
            np.testing.assert_allclose(seen, (0.2, 0.4, 0.6), rtol=1e-5)
        else:  # half of what the leaning normal sees is below the surface
            np.testing.assert_allclose(seen, np.array((0.2, 0.4, 0.6)) * (1 + 0.1 / np.sqrt(1.01)) / 2, rtol=0.05)


def cosine_drawn(rng, normals):
    """Directions (n, 3) by the cosine: a point on the unit sphere around the tip of the normal."""
    v = rng.normal(size=normals.shape)
    d = normals + v / np.linalg.norm(v, axis=1, keepdims=True)
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def meets_unit_ball(origins, directions):
    """Whether rays meet the ball of radius 1 around (0, 0, 1) that they start outside of."""
    to = np.array((0.0, 0.0, 1.0)) - origins
    along = (to * directions).sum(axis=1)
    return (along > 0) & ((to * to).sum(axis=1) - along**2 < 1)


def test_a_sphere_and_a_coloured_plane_light_each_other_as_brute_force_tells():
    rho, ground, sun = np.array((0.9, 0.8, 0.7)), np.array((0.8, 0.3, 0.1)), Sun((-1, -1, 1), (2.0, 1.5, 1.0))
    rng, n = np.random.default_rng(6), 200_000
    normal = unit(-0.5, -0.6, -0.4)
    place = np.add(normal, (0, 0, 1))
    # From the sphere: sky, or the plane under sky and sun.
    first = cosine_drawn(rng, np.broadcast_to(normal, (n, 3)))
    down = first[:, 2] < 0
    spot = place + first * np.where(down, -place[2] / np.where(down, first[:, 2], -1.0), 0.0)[:, None]
    second = cosine_drawn(rng, np.broadcast_to((0.0, 0.0, 1.0), (n, 3)))
    lit = ~meets_unit_ball(spot, np.broadcast_to(sun.direction, (n, 3)))
    escaped = ~meets_unit_ball(spot, second)
    of_sun = np.array(sun.irradiance) * sun.direction[2] / np.pi
    light = np.where(down[:, None], ground * (escaped[:, None] + lit[:, None] * of_sun), 1.0)
    direct = np.array(sun.irradiance) * max(normal @ sun.direction, 0.0) / np.pi
    on_sphere, error = rho * (light.mean(axis=0) + direct), rho * light.std(axis=0) / np.sqrt(n)
    options = {"environment": FURNACE, "lights": [sun], "depth": 2, "side": 32, "spp": 32}
    objects = [Sphere(), Plane(material=ground)]
    seen = measured(Lambert(rho), place + 0.1 * normal, place, objects, **options)
    np.testing.assert_array_less(np.abs(seen - on_sphere), 5 * error + 1e-4)

    # From the plane, beside the sphere: sky and sun, or the sphere under sky and sun.
    place = np.array((1.1, 0.9, 0.0))
    first = cosine_drawn(rng, np.broadcast_to((0.0, 0.0, 1.0), (n, 3)))
    met = meets_unit_ball(np.broadcast_to(place, (n, 3)), first)
    to = np.array((0.0, 0.0, 1.0)) - place
    along = (to * first).sum(axis=1)
    t = along - np.sqrt(np.maximum(1 - (to @ to - along**2), 0.0))
    normals = place + t[:, None] * first - (0.0, 0.0, 1.0)
    second = cosine_drawn(rng, normals)
    of_sun = np.array(sun.irradiance) * np.maximum(normals @ sun.direction, 0.0)[:, None] / np.pi
    light = np.where(met[:, None], rho * ((second[:, 2] > 0)[:, None] + of_sun), 1.0)
    shaded = meets_unit_ball(place[None], np.array([sun.direction]))[0]
    assert shaded
    on_plane, error = ground * light.mean(axis=0), ground * light.std(axis=0) / np.sqrt(n)
    seen = measured(Lambert(rho), np.add(place, (0.001, 0.001, 0.003)), place, objects, **options)
    np.testing.assert_array_less(np.abs(seen - on_plane), 5 * error + 1e-4)
