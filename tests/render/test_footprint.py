"""Where scenes look: look-ups against differences of pictures, densities against geometry, weights and what they do."""

import numpy as np
import pytest

import bvbedit
from bvbedit.brdf.analytic import Lambert
from bvbedit.brdf.base import Brdf
from bvbedit.brdf.charts import HALF_DIFF, IN_OUT
from bvbedit.brdf.losses import LOSSES
from bvbedit.brdf.materials import MATERIALS
from bvbedit.errors import BvbError
from bvbedit.image_tolerance import fit_to_image
from bvbedit.render.footprint import footprint, scene_weights
from bvbedit.render.image_metrics import compare_pictures
from bvbedit.render.lights import ConstantEnvironment, Sun
from bvbedit.render.prepared import PreparedScene
from bvbedit.render.scene import Camera, Plane, Scene, Sphere

CAMERA = Camera((0, -6, 2), (0, 0, 1), 26.0)
FLASH = Scene(CAMERA, (Sphere(),), lights=(Sun((0, -6, 1), (1.0, 2.0, 0.5)),))
GOLD = MATERIALS["gold-metallic-paint"].brdf


class Lobe(Brdf):
    """Smooth, not reciprocal and not grey, and varied by ``more`` at some pairs of directions."""

    def __init__(self, more=0.0):
        self.more = more

    def _evaluate(self, wi, wo):
        bump = 1 + self.more * np.exp(-8 * ((wi[:, 0] - 0.3) ** 2 + (wo[:, 2] - 0.6) ** 2))
        f = (0.2 + 0.3 * wi[:, 2] * wo[:, 2] ** 2) * bump
        return f[:, None] * np.array([1.0, 0.5, 0.25]), np.ones(len(wi), dtype=bool)


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
    assert np.average(np.abs(theta_d - apart) < np.radians(1.5), weights=density.counts) > 0.99


def test_a_density_is_one_in_all_and_the_same_wherever_it_is_asked():
    found = footprint(GOLD, "sphere")
    for chart in (HALF_DIFF, IN_OUT):
        cells = found.density(chart)
        assert cells.sum() == pytest.approx(1.0)
        assert cells.min() >= 0
        coarse = cells.reshape(12, 2, 12, 2, 6, 2).sum(axis=(1, 3, 5))
        np.testing.assert_allclose(found.density(chart, (12, 12, 6)), coarse, atol=1e-12)


def test_what_the_screen_clips_does_not_count():
    glaring = Scene(CAMERA, FLASH.objects, ConstantEnvironment((9, 9, 9)))
    with pytest.raises(BvbError, match="nothing of the model"):
        footprint(Lambert(1.0), glaring)
    with pytest.raises(BvbError, match="nothing of the model"):
        footprint(Lambert(1.0), Scene(CAMERA, (Plane(0.0),), ConstantEnvironment()))


def test_weights_are_large_where_the_scene_looks():
    found = footprint(GOLD, FLASH)
    weights = scene_weights(GOLD, FLASH, LOSSES["log_cosine_rms"])
    for chart in (HALF_DIFF, IN_OUT):
        points = chart.to_parameters(found.wi, found.wo)
        everywhere = np.random.default_rng(0).uniform(size=(20_000, 3))
        seen = np.average(weights(chart, points), weights=found.counts)
        values = weights(chart, everywhere)
        assert values.min() > 0
        assert seen > 10 * np.median(values)


def test_a_fit_for_a_scene_is_nearer_in_that_scene():
    measured = MATERIALS["copper"].brdf
    options = {"size": (9, 6, 4), "chart": "half-diff", "encoding": "root"}
    prepared = PreparedScene(measured, FLASH, width=64, height=64, spp=8, seed=3)
    reference = prepared.shade(measured)
    errors = [
        compare_pictures(prepared.shade(bvbedit.fit(measured, scene=scene, **options)), reference).mae
        for scene in (None, FLASH)
    ]
    assert errors[1] < 0.7 * errors[0]


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
