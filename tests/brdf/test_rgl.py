"""Evaluation of RGL measurements: its warp against quadrature, and a generated measurement against its truth."""

import functools

import numpy as np
import pytest

from bvbedit import BvbError
from bvbedit.brdf.analytic import GGX, Schlick
from bvbedit.brdf.geometry import spherical
from bvbedit.brdf.rgl import RglBrdf
from bvbedit.brdf.rgl_kernels import to_sample
from tests.brdf.samples import random_pairs, turned
from tests.io.rgl_files import ggx_fields

METAL = GGX(0.4, Schlick((0.9, 0.6, 0.3)))


@functools.cache
def small() -> dict[str, np.ndarray]:
    return ggx_fields(METAL, 0.4, elevations=5, density=16, samples=8)


def fields(**changes: object) -> dict[str, object]:
    """Return the arguments of a small sound measurement with some of them changed."""
    f = small()
    sound = {"vndf": f["vndf"][0], "rgb": f["rgb"][0], "jacobian": True}
    return {k: f[k] for k in ("theta_i", "sigma", "ndf")} | sound | changes


@pytest.fixture(scope="module")
def measured() -> RglBrdf:
    f = ggx_fields(METAL, 0.4, elevations=24, density=96, samples=48)
    return RglBrdf(**fields(theta_i=f["theta_i"], vndf=f["vndf"][0], rgb=f["rgb"][0], ndf=f["ndf"], sigma=f["sigma"]))


def test_the_warp_is_the_distribution_function_of_the_bilinear_density(rng):
    brdf = RglBrdf(**fields(vndf=rng.uniform(0, 1, (5, 4, 6)) ** 3))
    a, b, r = 1, 2, 0.3
    density = (1 - r) * brdf.vndf[a] + r * brdf.vndf[b]
    steps = 2001
    t = np.linspace(0, 1, steps)
    nodes_y, nodes_x = np.linspace(0, 1, 4), np.linspace(0, 1, 6)

    def at(y: float) -> np.ndarray:
        row = np.array([np.interp(y, nodes_y, column) for column in density.T])
        return np.interp(t, nodes_x, row)

    whole_rows = np.array([np.trapezoid(at(y), t) for y in t[::10]])
    for y, x in rng.uniform(0, 1, (20, 2)):
        s_y, s_x = to_sample(y, x, a, b, r, brdf.vndf, brdf._conditional, brdf._marginal)
        row = at(y)
        fine = np.linspace(0, x, steps)
        assert s_x == pytest.approx(np.trapezoid(np.interp(fine, t, row), fine) / np.trapezoid(row, t), abs=1e-6)
        fine = np.linspace(0, y, steps)
        total = np.trapezoid(whole_rows, t[::10])
        assert s_y == pytest.approx(np.trapezoid(np.interp(fine, t[::10], whole_rows), fine) / total, abs=1e-4)
    assert to_sample(0.0, 0.0, a, b, r, brdf.vndf, brdf._conditional, brdf._marginal) == (0.0, 0.0)
    assert to_sample(1.0, 1.0, a, b, r, brdf.vndf, brdf._conditional, brdf._marginal) == pytest.approx((1.0, 1.0))


def test_a_measurement_of_a_metal_evaluates_to_the_metal(measured, rng):
    wi, wo = random_pairs(rng, 20_000, np.radians(60))
    truth = METAL.evaluate(wi, wo)
    error = np.abs(measured.evaluate(wi, wo) - truth) / truth
    assert np.median(error) < 0.01
    assert np.quantile(error, 0.99) < 0.1


def test_it_is_reciprocal_isotropic_and_not_negative(rng):
    dark = fields()
    brdf = RglBrdf(**dark | {"rgb": dark["rgb"] - 0.2 * dark["rgb"].max()})
    wi, wo = random_pairs(rng, 5_000)
    f = brdf.evaluate(wi, wo)
    assert (f >= 0).all()
    assert 0.05 < (f == 0).mean() < 1
    np.testing.assert_allclose(brdf.evaluate(wo, wi), f, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(brdf.evaluate(turned(wi, 2.5), turned(wo, 2.5)), f, rtol=1e-6, atol=1e-9)


def test_beyond_85_degrees_the_value_is_held_and_not_trusted(measured):
    wi, held = spherical(np.radians([86, 89, 90]), 0.4), spherical(np.radians(85), 0.4)
    wo = spherical(0.9, [0.0, 2.0, 3.5])
    f, trusted = measured.evaluate_trusted(wi, wo)
    np.testing.assert_allclose(f, measured.evaluate(held, wo), rtol=1e-12)
    assert not trusted.any()
    assert measured.evaluate_trusted(spherical(np.radians(84.9), 0.4), wo)[1].all()
    assert np.isfinite(measured.evaluate([1, 0, 0], [-1, 0, 0])).all()


def test_without_jacobian_the_table_alone_is_the_value():
    ones = np.ones((5, 3, 2, 2))
    brdf = RglBrdf(**fields(rgb=ones, jacobian=False))
    wi, wo = spherical(0.3, 0.2), spherical(1.0, 3.0)
    assert brdf.evaluate(wi, wo) == pytest.approx(0.5 / np.cos(0.3) + 0.5 / np.cos(1.0))


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"theta_i": np.zeros(5)}, "theta_i"),
        ({"theta_i": np.linspace(0, 2, 5)}, "theta_i"),
        ({"theta_i": np.linspace(0, 1.5, 4)}, "vndf"),
        ({"theta_i": np.float64(0.0)}, "sigma"),
        ({"sigma": np.zeros((2, 128))}, "sigma"),
        ({"sigma": np.ones(128)}, "sigma"),
        ({"ndf": np.full((2, 128), -1.0)}, "ndf"),
        ({"ndf": np.full((2, 128), np.nan)}, "ndf"),
        ({"vndf": np.zeros((5, 4, 4))}, "vndf"),
        ({"vndf": np.ones((5, 4, 1))}, "vndf"),
        ({"rgb": np.ones((5, 1, 4, 4))}, "rgb"),
        ({"rgb": np.full((5, 3, 4, 4), np.inf)}, "rgb"),
    ],
)
def test_fields_that_cannot_be_a_measurement_are_refused(changes, word):
    with pytest.raises(BvbError, match=word):
        RglBrdf(**fields(**changes))
