"""Whatever is looked at, from wherever: pictures are finite and nowhere negative."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bvbedit.brdf.analytic import GGX, Lambert, Schlick
from bvbedit.brdf.charts import HALF_DIFF
from bvbedit.brdf.encodings import Root
from bvbedit.brdf.materials import MATERIALS
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.render import render
from bvbedit.render.lights import ConstantEnvironment, LatLongEnvironment, PointLight, RectangleLight, Sun
from bvbedit.render.meshes import Mesh
from bvbedit.render.scene import Blob, Camera, MeshFile, Plane, Scene, Sphere
from bvbedit.spline.knots import clamped
from bvbedit.spline.tensor import TensorSpline
from tests.render.meters import BLACK, NARROW, WHITE, in_memory, measured, square

CHROME, SHARPEST = MATERIALS["chrome"].brdf, GGX(0.002, Schlick(0.9))
ONE = (1.0, 1.0, 1.0)
SKY = ConstantEnvironment()
HOT = LatLongEnvironment(np.where(np.arange(32).reshape(4, 8, 1) == 11, 1e4, 0.1) * np.ones(3))
ABOVE = PointLight((0, 0, 3), ONE)
SUN = Sun((1, -1, 1), ONE)


def spline_model(seed=0):
    """A B-spline volume of random control points."""
    control = np.random.default_rng(seed).uniform(0.0, 1.5, size=(6, 5, 4, 3))
    knots = [clamped(np.linspace(0, 1, n - 2)[1:-1], 3) for n in control.shape[:3]]
    return SplineBrdf(TensorSpline((3, 3, 3), knots, control), HALF_DIFF, Root())


ROUGH = spline_model()
MODELS = [WHITE, GGX(0.2, Schlick(0.5)), CHROME, SHARPEST, ROUGH]


def sound(model, scene, side=8, spp=4, seed=0):
    """The picture, which is sound."""
    picture = render(model, scene, width=side, height=side, spp=spp, seed=seed)
    assert np.isfinite(picture).all()
    assert picture.min() >= 0
    return picture


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize(
    ("position", "look_at", "fov"),
    [
        ((0, -5, 1e-12), (0, 0, 1e-12), 40),  # level, just above the plane
        ((0, -5, 1e-3), (0, 0, 0), NARROW),  # grazing the plane
        ((-5, 0, 2), (0, 0, 2), NARROW),  # touching the top of the sphere
        ((1 + 1e-9, 0, 1), (1 + 1e-9, 5, 1), 170),  # just outside the sphere
        ((0, 0, 9), (0, 1e-9, 0), NARROW),  # straight down
        ((0, -1e9, 1), (0, 0, 1), 1e-7),  # from far away
    ],
)
def test_cameras_at_extreme_places(model, position, look_at, fov):
    up = (0, 1, 0) if position[0] == position[1] else (0, 0, 1)
    scene = Scene(Camera(position, look_at, fov, up), [Sphere(), Plane(material=1)], HOT, [ABOVE, SUN], 3)
    sound(model, scene)


@pytest.mark.parametrize("model", MODELS)
def test_views_along_the_normal(model):
    for lights in ([], [PointLight((0, 0, 9), ONE)], [Sun((0, 0, 1), ONE)]):
        for thing in (Plane(material=1), Sphere((0, 0, -1))):
            seen = measured(model, (0, 0, 5), (0, 0, 0), [thing], SKY, lights)
            assert np.isfinite(seen).all()
            assert seen.min() >= 0


@pytest.mark.parametrize("model", [CHROME, SHARPEST])
def test_a_mirror_in_the_very_direction_of_a_lamp_shows_its_highest_value(model):
    # Half vectors are the normal, to the last digit.
    sun, lamp = Sun((0, 1, 1), ONE), PointLight((0, 2, 2), ONE)
    f = model.evaluate((0, 1, 1), (0, -1, 1))
    cosine = np.sqrt(0.5)
    for light, irradiance in [(sun, cosine), (lamp, cosine / 8)]:
        seen = measured(model, (0, -1, 1), (0, 0, 0), [Plane(material=1)], lights=[light])
        np.testing.assert_allclose(seen, f * irradiance, rtol=1e-3)


FLAP = [[0, 0, 0], [1, 0, 0], [0, 0, 1]]
BROKEN = {
    "with triangles without area": Mesh(
        [[-1, 0, 0], [1, 0, 0], [0, 1, 2], [0, 0, 0], [1, 0, 0]], [[0, 1, 2], [0, 1, 3], [1, 4, 1], [2, 2, 2]]
    ),
    "with normals to the inside": Mesh(
        [[-1, 0, 0], [1, 0, 0], [0, 1, 2]], [[0, 1, 2]], [[0, 1, -0.5], [0, 1, -0.5], [0, 1, 0.2]]
    ),
    "with normals across": Mesh([[-1, 0, 0], [1, 0, 0], [0, 1, 2]], [[0, 1, 2]], [[1, 0, 0], [-1, 0, 0], [0, 2, -1]]),
    "with normals that are none": Mesh(
        [[-1, 0, 0], [1, 0, 0], [0, 1, 2]], [[0, 1, 2]], [[np.nan] * 3, [0, 0, 0], [np.inf, 0, 0]]
    ),
    "with a needle": Mesh([[-1, 0, 0], [1, 0, 0], [0, 1e-7, 1e-7], [0, 0, 2]], [[0, 1, 2], [0, 1, 3]]),
    "turned over": Mesh([[-1, 0, 0], [1, 0, 0], [0, 1, 2]], [[2, 1, 0]]),
    "of two sheets in one place": Mesh([[-1, 0, 0], [1, 0, 0], [0, 1, 2]], [[0, 1, 2], [2, 1, 0]]),
}


@pytest.mark.parametrize("model", [WHITE, CHROME, ROUGH])
@pytest.mark.parametrize("broken", BROKEN)
def test_meshes(broken, model, monkeypatch):
    in_memory(monkeypatch, broken=BROKEN[broken])
    objects, lights = [MeshFile("broken"), Plane(-0.1)], [SUN, ABOVE]
    for y in (-4, 4):
        picture = sound(model, Scene(Camera((0.1, y, 1), (0, 0, 0.8), 30), objects, SKY, lights, 3))
        assert picture.max() > 0


def test_a_triangle_seen_edge_on(monkeypatch):
    in_memory(monkeypatch, flap=Mesh(FLAP, [[0, 1, 2]]))
    for position in [(3, 0, 0.2), (3, 1e-9, 0.2), (0.2, 0, 3)]:
        up = (0, 1, 0)
        for fov in (NARROW, 20):
            sound(CHROME, Scene(Camera(position, (0.1, 0, 0.1), fov, up), [MeshFile("flap")], HOT, [SUN, ABOVE], 4))


def test_both_sides_of_a_triangle_are_of_its_material(monkeypatch):
    in_memory(monkeypatch, roof=square(2.0, 1.0))
    colour = (0.2, 0.4, 0.6)
    for z in (0, 2):
        seen = measured([], (0.1, 0.2, z), (0.1, 0.2, 1), [MeshFile("roof", material=colour)], SKY, side=4)
        np.testing.assert_allclose(seen, colour, rtol=1e-5)


@pytest.mark.parametrize("model", MODELS)
def test_things_that_touch(model, monkeypatch):
    in_memory(monkeypatch, floor=square(2.0, 0.0))
    camera = Camera((0.2, -4, 1), (0, 0, 0.5), 40)
    for others in ([Plane(material=1)], [MeshFile("floor")], [Sphere((0, 0, -1), 1, 1)], [Sphere((0, 0, 0.8), 0.8)]):
        sound(model, Scene(camera, [Sphere(), *others], HOT, [SUN, ABOVE], 4))
    # Lamps on surfaces, within them, and through them.
    lights = [
        PointLight((0, 0, 2), ONE),
        PointLight((0.5, -1, 0), ONE),
        PointLight((0, 0, 1), ONE),
        RectangleLight((0, 0, 2), (0, 0, 3), 1, 1, ONE),
        RectangleLight((1, -1, 0), (1, -1, 1), 1, 1, ONE),
        RectangleLight((-1, -1, 0), (-1, -1, -1), 1, 1, ONE),
        RectangleLight((-1, 0, 1), (-1, -1, 1), 2, 2, ONE),
    ]
    sound(model, Scene(camera, [Sphere(), Plane(material=1)], BLACK, lights, 4))
    sound(model, Scene(camera, [Sphere(), MeshFile("floor")], SKY, lights, 4))


def test_a_camera_on_a_lamp():
    for look_at in [(0, 0, 0), (0.1, 0, 3), (1, 0, 2)]:
        up = (0, 1, 0)
        lamp = RectangleLight((0, 0, 2), (0, 0, 0), 1, 1, ONE)
        sound(WHITE, Scene(Camera((0, 0, 2), look_at, 60, up), [Plane(material=1)], SKY, [lamp], 2))


def test_without_light_all_is_black():
    camera = Camera((0, -5, 1), (0, 0, 1), 60)
    for lights in ([], [Sun((0, 0, 1), (0, 0, 0)), PointLight((0, 0, 5), (0, 0, 0))]):
        scene = Scene(camera, [Sphere(), Plane(), Blob()], BLACK, lights, 5)
        assert not sound(WHITE, scene).any()


@pytest.mark.parametrize("what", ["analytic", "mesh"])
@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_a_scene_of_any_size_looks_the_same(scale, what):
    def scene(s):
        body = Sphere((0, 0, s), s) if what == "analytic" else Blob(s, (0, 0, 0.01 * s))
        lights = [
            RectangleLight((0, -2 * s, 4 * s), (0, 0, 0), s, 2 * s, (6.0, 5.0, 4.0)),
            PointLight((-2 * s, -2 * s, 3 * s), (2 * s * s, 3 * s * s, 4 * s * s)),
            SUN,
        ]
        return Scene(Camera((0, -6 * s, 3 * s), (0, 0, 0.8 * s), 30), [body, Plane()], HOT, lights, 3)

    model = GGX(0.3, Schlick(0.5))
    usual, other = (sound(model, scene(s), side=16).astype(float) for s in (1.0, scale))
    off = ~np.isclose(usual, other, rtol=1e-3).all(axis=2)
    # Rays that just meet or miss an edge may turn out otherwise.
    assert off.mean() < (0.01 if what == "analytic" else 0.05)


coordinate = st.floats(-2, 2)
colour = st.tuples(*[st.floats(0, 1)] * 3)
material = st.one_of(st.integers(1, len(MODELS)), colour)
sphere = st.builds(
    Sphere, st.tuples(coordinate, coordinate, st.floats(-1, 2)), st.sampled_from([0.01, 0.5, 1.0, 1.5]), material
)
lamp = st.one_of(
    st.builds(PointLight, st.tuples(coordinate, coordinate, coordinate), colour),
    st.builds(Sun, st.sampled_from([(0, 0, 1), (1, 0, 0), (1, 1, 1), (0, -1, -1), (0, -1, 1e-9)]), colour),
    st.builds(
        RectangleLight,
        st.tuples(coordinate, coordinate, coordinate),
        st.sampled_from([(0, 0, 9), (0, 0, -9), (9, 0, 1), (3, 3, 3)]),
        st.sampled_from([1e-3, 1.0, 5.0]),
        st.sampled_from([1e-3, 1.0, 5.0]),
        colour,
    ),
)


@settings(max_examples=60)
@given(
    objects=st.lists(st.one_of(sphere, st.builds(Plane, st.floats(-2, 2), material, st.booleans())), max_size=3),
    with_blob=st.booleans(),
    environment=st.sampled_from([BLACK, SKY, HOT]),
    lights=st.lists(lamp, max_size=3),
    depth=st.integers(1, 5),
    position=st.tuples(st.floats(-9, 9), st.just(-6.0), st.floats(2.1, 9)),
    seed=st.integers(0, 2**63 - 1),
)
def test_random_scenes(objects, with_blob, environment, lights, depth, position, seed):
    objects = [*objects, Blob(0.7, (0.3, 0.2, -0.5), 2)] if with_blob or not objects else objects
    scene = Scene(Camera(position, (0, 0, 0), 40), objects, environment, lights, depth)
    sound(MODELS, scene, side=4, spp=2, seed=seed)


def test_no_energy_is_made_of_white_and_the_furnace(monkeypatch):
    # Whatever is in it, white diffuse things never show more than the furnace.
    in_memory(monkeypatch, floor=square(2.0, 0.3))
    objects = [Sphere((0, 0, 1)), Sphere((1, -1, 0.5), 0.5), Plane(material=ONE), MeshFile("floor")]
    for depth in (1, 2, 5):
        picture = sound(Lambert(1.0), Scene(Camera((0, -5, 2), (0, 0, 0.8), 40), objects, SKY, depth=depth))
        assert picture.max() <= 1 + 1e-5


@pytest.mark.parametrize(("radius", "distance"), [(1.0, 1e9), (1e-4, 1e5), (1e3, 1e4)])
def test_small_spheres_far_away_do_not_shade_themselves(radius, distance):
    fov = np.degrees(0.1 * radius / distance)
    camera = Camera((0, 0, distance), (0, 0, 0), fov, up=(0, 1, 0))
    picture = sound(WHITE, Scene(camera, [Sphere((0, 0, 0), radius)], BLACK, [Sun((0, 0, 1), ONE)], depth=1))
    np.testing.assert_allclose(picture, 1 / np.pi, rtol=5e-3)
