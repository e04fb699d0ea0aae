"""A scene that is traced once shows any models as a rendering with the same density does."""

import doctest

import numpy as np
import pytest

from bvbedit.brdf.analytic import GGX, Lambert, Schlick
from bvbedit.render import integrator, prepared, render
from bvbedit.render.lights import ConstantEnvironment, LatLongEnvironment, PointLight, RectangleLight, Sun
from bvbedit.render.prepared import PreparedScene
from bvbedit.render.scene import Blob, Camera, Plane, Scene, Sphere
from tests.render.meters import Scaled
from tests.spline.refusals import refusal

SIZE = {"width": 12, "height": 9, "spp": 5, "seed": 4}
PANORAMA = LatLongEnvironment(np.random.default_rng(7).uniform(size=(6, 12, 3)) ** 12)
LAMPS = [
    Sun((1, -1, 2), (1.0, 0.9, 0.8)),
    PointLight((-2, -2, 3), (2.0, 3.0, 4.0)),
    RectangleLight((0, -2, 4), (0, 0, 0), 1, 2, (6.0, 5.0, 4.0)),
]
# Two models, the second on two objects, and two materials of the scene's own.
FULL = Scene(
    Camera((0, -6, 3), (0, 0, 0.8), 45),
    [
        Sphere((-1.2, 0, 0.9), 0.9, 2),
        Plane(0.0, (0.6, 0.3, 0.2)),
        Blob(0.8, (1.2, 0, 0.01), 1),
        Sphere((0, -1.5, 0.4), 0.4, "copper"),
        Sphere((0, 1.5, 0.6), 0.6, 2),
    ],
    PANORAMA,
    LAMPS,
    depth=3,
)
MODELS = [GGX(0.3, Schlick((0.9, 0.6, 0.3))), Lambert((0.2, 0.5, 0.8))]
OTHERS = [Scaled(0.3), GGX(0.1, Schlick(0.6))]


def densities(models):
    return [m.density for m in models]


def test_shading_the_prepared_models_is_rendering_them():
    picture = PreparedScene(MODELS, FULL, **SIZE).shade(MODELS)
    np.testing.assert_allclose(picture, render(MODELS, FULL, **SIZE), rtol=1e-5, atol=1e-7)


def test_shading_other_models_is_rendering_them_by_the_densities_of_the_prepared_ones():
    ready = PreparedScene(MODELS, FULL, **SIZE)
    expected = render(OTHERS, FULL, density=densities(MODELS), **SIZE)
    np.testing.assert_allclose(ready.shade(OTHERS), expected, rtol=1e-5, atol=1e-7)
    # And the prepared ones are still there.
    np.testing.assert_array_equal(ready.shade(MODELS), PreparedScene(MODELS, FULL, **SIZE).shade(MODELS))


def test_other_densities_may_be_given():
    ready = PreparedScene(MODELS, FULL, density=densities(OTHERS), **SIZE)
    np.testing.assert_allclose(ready.shade(OTHERS), render(OTHERS, FULL, **SIZE), rtol=1e-5, atol=1e-7)


@pytest.mark.parametrize("wave", [1, 100])
def test_how_the_work_is_cut_does_not_matter(wave, monkeypatch):
    expected = PreparedScene(MODELS[0], "sphere", **SIZE)
    monkeypatch.setattr(integrator, "WAVE", wave)
    ready = PreparedScene(MODELS[0], "sphere", **SIZE)
    np.testing.assert_allclose(ready.shade(OTHERS[0]), expected.shade(OTHERS[0]), rtol=1e-6)
    assert len(ready.look_ups(MODELS[0]).pixel) == len(expected.look_ups(MODELS[0]).pixel)


@pytest.mark.parametrize("density", [Scaled(1.0).density, Lambert(0.5).density])
def test_with_direct_light_alone_the_picture_is_linear_in_the_material(density):
    scene = Scene(FULL.camera, [Sphere(), Plane()], PANORAMA, LAMPS)
    ready = PreparedScene(Scaled(1.0), scene, density=density, **SIZE)
    black, once, twice = (ready.shade(Scaled(f)).astype(float) for f in (0.0, 0.2, 0.4))
    np.testing.assert_allclose(twice - black, 2 * (once - black), rtol=1e-5, atol=1e-6)
    assert (once - black).max() > 0.05


def test_what_the_scene_itself_is_made_of_is_asked_once_and_stays(monkeypatch):
    asked, ask = [], prepared._asked
    monkeypatch.setattr(prepared, "_asked", lambda material, *rest: asked.append(material) or ask(material, *rest))
    ready = PreparedScene(MODELS, FULL, **SIZE)
    fixed = [material for material in asked if material not in MODELS]
    assert fixed
    assert len(fixed) == len(asked)
    del asked[:]
    ready.shade(MODELS), ready.shade(OTHERS)
    assert {id(material) for material in asked} == {id(m) for m in MODELS + OTHERS}
    # Under direct light the plane looks the same beside any models.
    direct = Scene(FULL.camera, FULL.objects, FULL.environment, FULL.lights)
    ready = PreparedScene(MODELS, direct, **SIZE)
    first, second = ready.shade(MODELS), ready.shade(OTHERS)
    same = (first == second).all(axis=2)
    assert same[-1, 0]
    assert same[-1, -1]
    assert 0.2 < same.mean() < 0.9


class Bent(Scaled):
    """A material, changed by a little of another."""

    def __init__(self, material, share, other):
        self.parts = material, share, other

    def _evaluate(self, wi, wo):
        material, share, other = self.parts
        f, trusted = material._evaluate(wi, wo)
        return f + share * other._evaluate(wi, wo)[0], trusted


def test_look_ups_tell_how_pixels_change_with_the_models():
    # The derivative of the picture, with light that goes from model to model, by central differences.
    ready, change, step = PreparedScene(MODELS, FULL, **SIZE), Scaled(1.0), 1e-3
    higher, lower = (
        ready.shade([Bent(m, sign * step, change) for m in MODELS]).astype(float).reshape(-1, 3) for sign in (1, -1)
    )
    told = ready.look_ups(MODELS)
    by_pixel = np.zeros_like(higher)
    np.add.at(by_pixel, told.pixel, change.evaluate_unit(told.wi, told.wo)[0] * told.light)
    np.testing.assert_allclose(by_pixel, (higher - lower) / (2 * step), rtol=2e-3, atol=2e-3 * by_pixel.max())
    assert (by_pixel > 0.1).any()


def test_with_direct_light_alone_look_ups_times_reflectance_are_the_picture():
    scene = Scene(FULL.camera, [Sphere()], PANORAMA, LAMPS)
    ready, model = PreparedScene(MODELS[0], scene, **SIZE), OTHERS[0]
    told = ready.look_ups(MODELS[0])
    seen = ready.shade(Lambert(0.0)).astype(float).reshape(-1, 3)
    np.add.at(seen, told.pixel, model.evaluate_unit(told.wi, told.wo)[0] * told.light)
    np.testing.assert_allclose(seen, ready.shade(model).reshape(-1, 3), rtol=1e-5, atol=1e-7)


def test_a_picture_that_shows_no_model_asks_for_nothing():
    for objects in ([Plane()], [Sphere((0, 99, 0), 1, 1)]):
        scene = Scene(Camera((0, 0, 5), (0, 0, 0), 20, (0, 1, 0)), objects, PANORAMA)
        told = PreparedScene(MODELS[0], scene, **SIZE).look_ups(MODELS[0])
        assert (told.wi.shape, told.light.shape, told.pixel.shape) == ((0, 3), (0, 3), (0,))


def test_black_models_leave_the_light_of_the_scene():
    scene = Scene(FULL.camera, [Sphere()], ConstantEnvironment((0.25, 0.5, 0.75)), LAMPS[:2])
    picture = PreparedScene(MODELS[0], scene, **SIZE).shade(Lambert(0.0))
    np.testing.assert_array_equal(picture[0, 0], (0.25, 0.5, 0.75))
    assert picture[4, 6].max() == 0


def test_a_camera_that_sees_no_surface_sees_the_sky():
    scene = Scene(Camera((0, 0, 5), (0, 1, 6), 20), [Sphere()], ConstantEnvironment((0.25, 0.5, 0.75)), depth=3)
    picture = PreparedScene(MODELS[0], scene, **SIZE).shade(MODELS[0])
    np.testing.assert_array_equal(picture, np.broadcast_to((0.25, 0.5, 0.75), (9, 12, 3)))


def test_what_is_refused():
    ready = PreparedScene(MODELS, FULL, **SIZE)
    assert "1 models given, 2 prepared for" in refusal(lambda: ready.shade(MODELS[0]))
    assert "3 models given, 2 prepared for" in refusal(lambda: ready.shade([*MODELS, MODELS[0]]))
    assert "model is str" in refusal(lambda: ready.shade(["chrome", "copper"]))
    assert "asks for 2 models, 1 given" in refusal(lambda: PreparedScene(MODELS[0], FULL, **SIZE))
    assert "spp is 0" in refusal(lambda: PreparedScene(MODELS, FULL, spp=0))
    assert "density is int" in refusal(lambda: PreparedScene(MODELS, FULL, density=3))


def test_more_paths_than_memory_holds_are_refused():
    told = refusal(lambda: PreparedScene(MODELS[0], "sphere", width=8192, height=8192, spp=4))
    assert "16,777,216 paths" in told
    assert "16,777,216 paths" in refusal(lambda: PreparedScene(MODELS[0], "sphere", width=4096, height=4097, spp=1))


def test_the_example_is_true():
    assert doctest.testmod(prepared) == (0, 3)
