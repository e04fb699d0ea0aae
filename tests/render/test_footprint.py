"""Where scenes look: look-ups against differences of pictures, densities against geometry, weights and what they do."""

import numpy as np
import pytest

import bvbedit
from bvbedit.brdf.analytic import Lambert
from bvbedit.brdf.base import Brdf
from bvbedit.brdf.charts import HALF_DIFF, IN_OUT
from bvbedit.brdf.materials import MATERIALS
from bvbedit.errors import BvbError
from bvbedit.image_tolerance import fit_to_image
from bvbedit.render.footprint import SEED, SIDE, SPP, footprint
from bvbedit.render.image_metrics import compare_pictures
from bvbedit.render.lights import ConstantEnvironment, Sun
from bvbedit.render.prepared import PreparedScene
from bvbedit.render.scene import Camera, Plane, Scene, Sphere

CAMERA = Camera((0, -6, 2), (0, 0, 1), 26.0)
FLASH = Scene(CAMERA, (Sphere(),), lights=(Sun((0, -6, 1), (1.0, 2.0, 0.5)),))
DIM = Scene(CAMERA, (Sphere(),), ConstantEnvironment((0.5, 0.4, 0.3)), (Sun((-1, -1, 1), (0.5, 0.5, 0.7)),))
# A low sun behind the ball: its rim shows the model at grazing angles.
RIM = Scene(CAMERA, (Sphere(),), ConstantEnvironment((0.05, 0.05, 0.06)), (Sun((0.35, 1.0, 0.28), (2.6, 2.2, 1.7)),))
GOLD = MATERIALS["gold-metallic-paint"].brdf


class Lobe(Brdf):
    """Smooth, not reciprocal and not grey, and varied by ``more`` at some pairs of directions."""

    def __init__(self, more=0.0):
        self.more = more

    def _evaluate(self, wi, wo):
        bump = 1 + self.more * np.exp(-8 * ((wi[:, 0] - 0.3) ** 2 + (wo[:, 2] - 0.6) ** 2))
        f = (0.2 + 0.3 * wi[:, 2] * wo[:, 2] ** 2) * bump
        return f[:, None] * np.array([1.0, 0.5, 0.25]), np.ones(len(wi), dtype=bool)


class Grown(Lobe):
    """Off by a share of each value and of ``mean``."""

    def __init__(self, share, mean):
        super().__init__()
        self.share, self.mean = share, mean

    def _evaluate(self, wi, wo):
        f, trusted = super()._evaluate(wi, wo)
        return f + self.share * (f + self.mean), trusted


@pytest.mark.parametrize("depth", [1, 3])
def test_a_picture_changes_by_its_look_ups_times_the_change_of_the_material(depth):
    scene = Scene(
        CAMERA,
        (Sphere(), Sphere((1.5, -0.8, 0.6), 0.6), Plane(0.0, (0.5, 0.6, 0.7))),
        ConstantEnvironment((0.4, 0.5, 0.6)),
        (Sun((-1, -1, 1), (2, 2, 1)),),
        depth,
    )
    before, after = Lobe(), Lobe(1e-5)
    prepared = PreparedScene(before, scene, width=24, height=20, spp=4, density=Lambert(0.5).density)
    asked = prepared.look_ups(before)
    change = after.evaluate(asked.wi, asked.wo) - before.evaluate(asked.wi, asked.wo)
    expected = np.zeros((24 * 20, 3))
    np.add.at(expected, asked.pixel, asked.light * change)
    # The pictures are float32: too coarse for so small a step, so the same step is taken a thousand times as large.
    found = (prepared.shade(Lobe(1e-2)).astype(float) - prepared.shade(before)).reshape(-1, 3) / 1e3
    assert expected.max() > 1e-7
    np.testing.assert_allclose(found, expected, rtol=0.03 if depth > 1 else 1e-3, atol=2e-10)


def test_a_sun_beside_the_camera_is_seen_near_theta_d_zero():
    density = footprint(Lambert(0.5), Scene(Camera((0, -60, 1), (0, 0, 1), 2.5), (Sphere(),), lights=FLASH.lights))
    theta_d = np.arccos(np.clip(np.einsum("nc,nc->n", density.wi, density.wo), -1, 1)) / 2
    apart = np.arctan2(1, 6) / 2
    assert np.average(np.abs(theta_d - apart) < np.radians(1.5), weights=density.counts.sum(axis=1)) > 0.99


def test_shares_are_one_in_all_and_the_same_wherever_they_are_asked():
    found = footprint(GOLD, "sphere")
    for chart in (HALF_DIFF, IN_OUT):
        cells = found.shares(chart)
        assert cells.sum() == pytest.approx(1.0)
        assert cells.min() >= 0
        coarse = cells.reshape(12, 2, 12, 2, 6, 2).sum(axis=(1, 3, 5))
        np.testing.assert_allclose(found.shares(chart, (12, 12, 6)), coarse, atol=1e-12)


def _pictures(scene, brdf, *others):
    """Return the values of the screen (n, 3), unclipped, of the pixels that show the model: of ``brdf``, of others."""
    prepared = PreparedScene(brdf, scene, width=SIDE, height=SIDE, spp=SPP, seed=SEED)
    lit = np.unique(prepared.look_ups(brdf).pixel)
    for model in (brdf, *others):
        x = prepared.shade(model).reshape(-1, 3)[lit].astype(float)
        yield np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.maximum(x, 0.0031308) ** (1 / 2.4) - 0.055)


def _bound(interest, brdf, other):
    """Return the root mean square of the loss over what counts."""
    f, g = (b.evaluate(interest.wi, interest.wo) for b in (brdf, other))
    off = interest.loss.transform(g, None, None) - interest.loss.transform(f, None, None)
    return np.sqrt(np.sum(interest.counts * off**2) / np.sum(interest.counts))


@pytest.mark.parametrize("scene", [FLASH, DIM], ids=["flash", "dim"])
def test_the_loss_is_a_bound_of_the_error_of_the_picture(scene):
    interest = footprint(Lobe(), scene)
    before, after = _pictures(scene, Lobe(), Lobe(0.01))
    error = np.sqrt(np.mean((after - before) ** 2))
    bound = _bound(interest, Lobe(), Lobe(0.01))
    assert error < bound < 3 * error


def test_the_loss_is_the_error_of_the_picture_where_errors_are_as_it_expects_them():
    interest = footprint(Lobe(), DIM)
    grown = Grown(0.003, interest.loss.mean)
    before, after = _pictures(DIM, Lobe(), grown)
    assert _bound(interest, Lobe(), grown) == pytest.approx(np.sqrt(np.mean((after - before) ** 2)), rel=0.01)


def test_what_the_screen_clips_counts_by_its_share():
    def counted(radiance):
        scene = Scene(CAMERA, FLASH.objects, ConstantEnvironment((radiance,) * 3))
        return footprint(Lambert(1.0), scene).loss.scale

    # An error of the material by 1 % is as much of white, however far beyond white the picture is.
    assert counted(16.0) == pytest.approx(counted(4.0), rel=1e-2)
    assert counted(4.0) == pytest.approx(counted(1.01), rel=0.1)


def test_a_scene_that_shows_no_model_has_no_footprint():
    dark = Scene(CAMERA, FLASH.objects, ConstantEnvironment((0, 0, 0)))
    for scene in (dark, Scene(CAMERA, (Plane(0.0),), ConstantEnvironment())):
        with pytest.raises(BvbError, match="nothing of the model"):
            footprint(Lambert(1.0), scene)


def test_a_black_material_has_a_footprint():
    found = footprint(Lambert(0.0), DIM)
    assert found.loss.mean > 0
    assert np.isfinite(found.counts).all()


def test_a_density_is_large_where_the_scene_looks():
    found = footprint(GOLD, FLASH)
    for chart in (HALF_DIFF, IN_OUT):
        points = chart.to_parameters(found.wi, found.wo)
        everywhere = np.random.default_rng(0).uniform(size=(20_000, 3))
        seen = np.average(found.density(chart, points), weights=found.counts.sum(axis=1))
        values = found.density(chart, everywhere)
        assert values.min() >= 0
        assert seen > 10 * np.median(values)


def test_a_fit_for_a_scene_is_nearer_in_that_scene():
    measured = MATERIALS["copper"].brdf
    options = {"size": (9, 6, 4), "chart": "half-diff"}
    prepared = PreparedScene(measured, FLASH, width=64, height=64, spp=8, seed=3)
    reference = prepared.shade(measured)
    errors = [
        compare_pictures(prepared.shade(bvbedit.fit(measured, scene=scene, **options)), reference).mae
        for scene in (None, FLASH)
    ]
    assert errors[1] < 0.7 * errors[0]


@pytest.mark.parametrize(("name", "scene"), [("gold-metallic-paint", FLASH), ("blue-plastic", RIM)])
def test_a_fit_for_a_scene_is_no_worse_there_than_one_to_the_metric_in_as_many_bytes(name, scene):
    measured = MATERIALS[name].brdf
    prepared = PreparedScene(measured, scene, width=96, height=96, spp=8, seed=3)
    reference = prepared.shade(measured)
    plain, fitted = (
        compare_pictures(prepared.shade(bvbedit.fit(measured, max_bytes=4000, chart="half-diff", scene=s)), reference)
        for s in (None, scene)
    )
    assert fitted.psnr >= plain.psnr
    assert fitted.pae <= plain.pae


def test_a_tolerance_of_a_fit_for_a_scene_is_one_of_the_picture():
    model = bvbedit.fit(GOLD, tolerance=0.003, scene=DIM)
    assert model.report["metric"] == "picture_rms"
    before, after = _pictures(DIM, GOLD, model)
    assert np.sqrt(np.mean((after - before) ** 2)) <= 0.003


def test_the_smallest_file_for_a_picture_is_within_the_tolerance_and_smaller_ones_are_not():
    model = fit_to_image(GOLD, FLASH, 0.03)
    told = model.report["image"]
    assert told["pae"] <= 0.03
    assert told["mae"] <= told["pae"]
    good = [t["max_bytes"] for t in told["tried"] if t["pae"] <= 0.03]
    assert all(t["max_bytes"] < min(good) for t in told["tried"] if t["pae"] > 0.03)


@pytest.mark.parametrize("tolerance", [-0.1, 1.5, np.nan, "much"])
def test_a_tolerance_that_is_none_is_refused(tolerance):
    with pytest.raises(BvbError, match="tolerance"):
        fit_to_image(GOLD, FLASH, tolerance)


def test_weights_and_scene_exclude_each_other():
    with pytest.raises(BvbError, match="exclude"):
        bvbedit.fit(GOLD, scene="sphere", weights=lambda points: points[:, 0])
