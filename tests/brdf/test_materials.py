"""The sample materials: lawful, and like the measured materials that three of them are named after."""

from pathlib import Path

import numpy as np
import pytest

from bvbedit.brdf.geometry import spherical
from bvbedit.brdf.materials import MATERIALS, material_named
from bvbedit.errors import BvbError
from tests.brdf.test_analytic import albedo, pairs

DATA = Path(__file__).parents[3] / "shared" / "data"
each_material = pytest.mark.parametrize("name", MATERIALS)


def test_there_is_a_choice_and_the_papers_three_are_in_it():
    assert len(MATERIALS) >= 8
    assert {"gold-metallic-paint", "teflon", "chrome"} <= set(MATERIALS)
    for name, material in MATERIALS.items():
        assert material is material_named(name)
        assert material.name == name
        assert material.description
        assert "\n" not in material.description


@pytest.mark.parametrize("wrong", ["Chrome", "", None, ["chrome"]])
def test_unknown_names_get_the_list(wrong):
    with pytest.raises(BvbError, match=r"matte-paper.*chrome"):
        material_named(wrong)


@each_material
def test_lawful(name):
    brdf = MATERIALS[name].brdf
    wi, wo = pairs(1000)
    f = brdf.evaluate(wi, wo)
    np.testing.assert_array_equal(f, brdf.evaluate(wo, wi))
    assert np.isfinite(f).all()
    assert f.min() > 0
    for degrees in (0, 30, 45, 60, 75, 85):
        assert albedo(brdf, np.radians(degrees)).max() <= 1


def test_chrome_is_a_mirror_with_decades_of_range():
    chrome = MATERIALS["chrome"].brdf
    theta = np.radians([0, 45, 80])
    peak = chrome.evaluate(spherical(theta, 0), spherical(theta, np.pi))
    assert 5e2 < peak.min() < peak.max() < 5e4
    back = spherical(np.radians(60), 0)
    assert (peak[0] / chrome.evaluate(back, back) > 1e6).all()


@pytest.mark.skipif(not DATA.is_dir(), reason="measured slices are not part of the project")
@pytest.mark.parametrize(("name", "off"), [("teflon", 0.05), ("gold-metallic-paint", 0.12), ("chrome", 0.35)])
def test_stand_ins_resemble_their_originals(name, off):
    slice_ = np.load(DATA / f"{name}-slice.npy")
    theta_h, theta_d = np.meshgrid((np.arange(90) / 90) ** 2 * np.pi / 2, np.radians(np.arange(90)), indexing="ij")
    # phi_d = 90 degrees: both directions have the elevation of cos theta_h cos theta_d.
    up, side = np.cos(theta_d), np.sin(theta_d)
    wi = np.stack([np.sin(theta_h) * up, side, np.cos(theta_h) * up], axis=-1)
    ours = MATERIALS[name].brdf.evaluate(wi, wi * (1, -1, 1))
    inside = (wi[..., 2] > np.cos(np.radians(80))) & (slice_ > 0).all(axis=-1)
    decades = np.abs(np.log10(ours[inside] / slice_[inside]))
    assert np.median(decades) < off
