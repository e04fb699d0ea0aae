"""Pictures that come pass after pass: what each is, when the passes end, and whether the noise they tell is honest."""

import numpy as np
import pytest

from bvbedit.brdf.analytic import GGX, Schlick
from bvbedit.render import integrator, render
from bvbedit.render.integrator import render_passes
from bvbedit.render.lights import ConstantEnvironment, RectangleLight
from bvbedit.render.scene import Camera, Plane, Scene, Sphere
from tests.render.meters import WHITE, Scaled

MODEL = Scaled(0.5)
SMALL = {"width": 8, "height": 6}
LAMP = RectangleLight((1, -2, 4), (0, 0, 0), 2, 2, (6.0, 5.0, 4.0))
GLOSSY = Scene(
    Camera((0, -5, 2), (0, 0, 0.8), 40), [Sphere(), Plane()], ConstantEnvironment((0.3, 0.3, 0.3)), [LAMP], depth=2
)


@pytest.mark.parametrize("spp", [1, 2, 5, 16, 33])
def test_samples_rise_to_spp_and_the_last_picture_is_that_of_render(spp):
    passes = list(render_passes(MODEL, "sphere", spp=spp, **SMALL))
    samples = [p.samples for p in passes]
    assert samples == sorted(set(samples))
    assert (samples[0], samples[-1]) == (1, spp)
    assert np.array_equal(passes[-1].picture, render(MODEL, "sphere", spp=spp, **SMALL))
    for p in passes:
        assert (p.picture.dtype, p.picture.shape, p.noise.shape) == (np.float32, (6, 8, 3), (6, 8))


def test_after_any_pass_there_is_the_picture_of_so_many_samples():
    for p in render_passes(MODEL, "sphere", spp=9, seed=3, **SMALL):
        expected = render(MODEL, "sphere", spp=p.samples, seed=3, **SMALL)
        np.testing.assert_allclose(p.picture, expected, rtol=1e-6)


def test_the_noise_is_unknown_after_one_pass_and_told_after_the_second():
    first, second = render_passes(MODEL, "sphere", spp=2, **SMALL)
    assert np.isnan(first.noise).all()
    assert first.relative_noise == np.inf
    assert (second.noise >= 0).all()
    assert 0 < second.relative_noise < 1


def test_where_nothing_is_random_there_is_no_noise():
    *_, last = render_passes(WHITE, "furnace", spp=4, **SMALL)
    assert last.relative_noise < 1e-6


@pytest.mark.parametrize(("model", "scene"), [(MODEL, "sphere"), (GGX(0.1, Schlick(0.6)), GLOSSY)])
def test_the_noise_is_as_large_as_pictures_of_other_seeds_differ(model, scene):
    # Later samples fill the gaps that earlier ones leave, so that pictures are somewhat better than passes tell.
    for spp in (8, 32):
        lasts = [list(render_passes(model, scene, spp=spp, seed=seed, **SMALL))[-1] for seed in range(24)]
        grey = np.array([p.picture.mean(axis=2, dtype=float) for p in lasts])
        actual = np.sqrt(grey.var(axis=0, ddof=1).mean())
        told = np.sqrt(np.mean([np.square(p.noise, dtype=float) for p in lasts]))
        assert actual / 2 < told < 2.5 * actual, spp
        relative = [p.relative_noise for p in lasts]
        np.testing.assert_allclose(np.mean(relative), told / grey.mean(), rtol=0.2)


def test_passes_end_at_the_noise_that_is_asked_for():
    wanted = 0.05
    passes = list(render_passes(MODEL, "sphere", spp=4096, noise=wanted, **SMALL))
    assert passes[-1].relative_noise <= wanted
    assert all(p.relative_noise > wanted for p in passes[:-1])
    assert 2 < passes[-1].samples < 4096
    picture = render(MODEL, "sphere", spp=4096, noise=wanted, **SMALL)
    assert np.array_equal(picture, passes[-1].picture)


def test_no_pass_is_begun_after_the_time_limit(monkeypatch):
    assert [p.samples for p in render_passes(MODEL, "sphere", spp=64, time_limit=1e-9, **SMALL)] == [1]
    # A clock that is read once at the start and once after each pass.
    ticks = iter(range(100))
    monkeypatch.setattr(integrator, "perf_counter", lambda: next(ticks))
    assert [p.samples for p in render_passes(MODEL, "sphere", spp=64, time_limit=3, **SMALL)] == [1, 2, 4]


def test_who_stops_asking_keeps_what_there_is():
    seen = []
    passes = render_passes(MODEL, "sphere", spp=64, progress=seen.append, **SMALL)
    first, second = next(passes), next(passes)
    kept = first.picture.copy()
    passes.close()
    assert (first.samples, second.samples) == (1, 2)
    assert seen[-1] == pytest.approx(2 / 64)
    # No later pass wrote into an earlier picture.
    assert np.array_equal(first.picture, kept)
    np.testing.assert_array_equal(first.picture, render(MODEL, "sphere", spp=1, **SMALL))


def test_arguments_are_refused_before_the_first_pass():
    from bvbedit.errors import BvbError

    with pytest.raises(BvbError, match="spp is 0"):
        render_passes(MODEL, "sphere", spp=0)
    with pytest.raises(BvbError, match="model is int"):
        render_passes(3)
