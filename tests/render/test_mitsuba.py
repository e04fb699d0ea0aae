"""Pictures beside those of Mitsuba 3's path tracer: the same light arrives, and no part of the picture differs."""

from pathlib import Path

import numpy as np
import pytest

from bvbedit.brdf.analytic import GGX, ExactFresnel, Lambert, Schlick
from bvbedit.io.rgl import load_rgl
from bvbedit.render import render
from bvbedit.render.lights import LatLongEnvironment, Sun, directions_of_texels
from bvbedit.render.scene import Camera, Plane, Scene, Sphere
from tests.io.rgl_files import bsdf_bytes, ggx_fields
from tests.render.meters import BLACK, unit
from tests.render.mitsuba_scene import diffuse, mitsuba_scene

mi = pytest.importorskip("mitsuba", reason="needs the extra 'mitsuba': pip install 'bvbedit[mitsuba]'")

SIDE, BLOCK, SPP, SEEDS = 48, 8, 32, 8
COLOUR = (0.9, 0.5, 0.2)
ALPHA, ETA, K = 0.3, (0.22, 1.0, 1.15), (3.6, 2.6, 2.5)


class SeparableGGX(GGX):
    """GGX whose masking and shadowing are independent, G = G1(wi) G1(wo), as Mitsuba's rough conductor has them."""

    def reflectance(self, pair):
        # 1 / G1 = 1 + Lambda = (1 + root / cosine) / 2; correlated by height, 1 / G = 1 + Lambda(wi) + Lambda(wo).
        a2 = self.alpha**2
        masked, shadowed = (
            0.5 * (1 + np.sqrt(a2 + (1 - a2) * cosine**2) / cosine) for cosine in (pair.cos_i, pair.cos_o)
        )
        return super().reflectance(pair) * ((masked + shadowed - 1) / (masked * shadowed))[:, None]


OURS = {"Lambert": Lambert(COLOUR), "GGX": SeparableGGX(ALPHA, ExactFresnel(ETA, K))}
THEIRS = {
    "Lambert": diffuse(COLOUR),
    "GGX": {
        "type": "roughconductor",
        "distribution": "ggx",
        "alpha": ALPHA,
        "eta": {"type": "rgb", "value": list(ETA)},
        "k": {"type": "rgb", "value": list(K)},
    },
}


@pytest.fixture(autouse=True, scope="module")
def _variant():
    before = mi.variant()
    mi.set_variant("scalar_rgb")
    yield
    if before is not None:
        mi.set_variant(before)


def sky():
    """A coloured sky with a soft bright spot, so uneven that it is sampled as a light, and nowhere symmetric."""
    d = directions_of_texels(24, 48)
    spot = np.exp(30 * (d @ unit(0.9, -0.5, 0.6) - 1))
    tint = 0.2 + 0.1 * d @ np.array([[1.0, 0.0, -1.0], [0.0, 0.5, 0.5], [0.5, 0.5, 1.0]])
    return LatLongEnvironment(tint + spot[..., None] * [12.0, 9.0, 5.0])


def scene():
    """A ball off the middle, its shadow, and light from both to one another."""
    camera = Camera((0.5, -6.0, 2.5), (0.0, 0.0, 0.9), 30.0)
    objects = [Sphere((0.3, 0.2, 1.1), 1.0, 1), Plane(0.0, (0.3, 0.6, 0.5))]
    return Scene(camera, objects, sky(), [Sun((-0.6, -0.6, 1.0), (1.0, 0.8, 0.6))], depth=3)


def blocks(picture):
    """Return the means (blocks, blocks, 3) of square parts of a picture."""
    n = SIDE // BLOCK
    return np.asarray(picture, dtype=float).reshape(n, BLOCK, n, BLOCK, 3).mean(axis=(1, 3))


def test_what_is_compared_is_the_same_material(rng):
    # What follows is about light: here both evaluate to the same.
    surface, context = mi.SurfaceInteraction3f(), mi.BSDFContext()
    wi, wo = (np.array([unit(x, y, abs(z) + 0.02) for x, y, z in rng.normal(size=(200, 3))]) for _ in range(2))
    for name, theirs in THEIRS.items():
        bsdf = mi.load_dict(theirs)
        expected = []
        for i, o in zip(wi, wo, strict=True):
            surface.wi = mi.Vector3f(*o)
            expected.append(np.array(bsdf.eval(context, surface, mi.Vector3f(*i))) / i[2])
        np.testing.assert_allclose(OURS[name].evaluate(wi, wo), expected, rtol=2e-4, atol=1e-6)


@pytest.mark.parametrize("name", OURS)
def test_pictures_are_the_same(name):
    theirs = mitsuba_scene(mi, scene(), [THEIRS[name]], SIDE, SIDE, SPP)
    found = [
        np.array([blocks(mi.render(theirs, spp=SPP, seed=seed)) for seed in range(SEEDS)]),
        np.array([blocks(render(OURS[name], scene(), width=SIDE, height=SIDE, spp=SPP, seed=s)) for s in range(SEEDS)]),
    ]
    expected, ours = (f.mean(axis=0) for f in found)
    total = expected.mean(axis=(0, 1))
    np.testing.assert_allclose(ours.mean(axis=(0, 1)), total, rtol=0.004)
    # Differences of blocks in standard errors, which eight pictures of each give.
    error = np.sqrt(sum(f.var(axis=0, ddof=1) for f in found) / SEEDS)
    assert np.sqrt(np.mean(error**2)) < 0.01 * total.mean()
    deviation = (ours - expected) / error
    assert np.abs(deviation).max() < 5
    assert np.sqrt(np.mean(deviation**2)) < 1.25
    # Nor do neighbours differ to the same side.
    assert np.abs(deviation.mean(axis=(0, 2))).max() < 1.25
    assert np.abs(deviation.mean(axis=(1, 2))).max() < 1.25


def test_a_measured_material_looks_the_same(tmp_path: Path):
    path = tmp_path / "metal.bsdf"
    path.write_bytes(bsdf_bytes(ggx_fields(GGX(0.4, Schlick((0.9, 0.6, 0.3))), 0.4, elevations=16)))
    ball = Sphere((0.0, 0.0, 1.0), 1.0)
    lit = Scene(Camera((0.0, -6.0, 2.5), (0.0, 0.0, 1.0), 22.0), [ball], BLACK, [Sun((-0.6, -1.0, 0.8), (3, 3, 3))])
    theirs = mitsuba_scene(mi, lit, [{"type": "measured", "filename": str(path)}], SIDE, SIDE, SPP)
    expected = np.mean([np.array(mi.render(theirs, spp=64, seed=seed)) for seed in range(2)], axis=0)
    ours = render(load_rgl(path), lit, width=SIDE, height=SIDE, spp=128)
    # Ours is held beyond 85 degrees, and the mean of f(wi, wo) and f(wo, wi): this file is symmetric up to a percent.
    judged = seen_and_lit(lit, np.radians(80))
    assert judged.mean() > 0.2
    np.testing.assert_allclose(ours[judged].mean(axis=0), expected[judged].mean(axis=0), rtol=0.01)
    np.testing.assert_allclose(ours[judged], expected[judged], rtol=0.1, atol=0.02 * expected.max())


def seen_and_lit(lit, most):
    """Return the pixels (h, w) whose middles see the ball at less than ``most`` from its normal, and so the sun."""
    right, up, forward = lit.camera.frame()
    reach = np.tan(np.radians(lit.camera.vertical_fov_degrees) / 2)
    at = reach * (2 * (np.arange(SIDE) + 0.5) / SIDE - 1)
    rays = at[None, :, None] * right - at[:, None, None] * up + forward
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    (ball,), (sun,) = lit.objects, lit.lights
    gap = np.subtract(lit.camera.position, ball.centre)
    along = rays @ gap
    hit = along**2 - gap @ gap + ball.radius**2
    normal = (gap + rays * (-along - np.sqrt(np.maximum(hit, 0)))[..., None]) / ball.radius
    lowest = np.cos(most)
    return (hit > 0) & (-(rays * normal).sum(axis=-1) > lowest) & (normal @ np.array(sun.direction) > lowest)
