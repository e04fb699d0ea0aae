"""Lobes: a mesh of the hemisphere, radii and colours that are those of the reflectance."""

import numpy as np
import pytest

from bvbedit.brdf.analytic import GGX, Lambert, Schlick
from bvbedit.brdf.encodings import Linear, Root
from bvbedit.brdf.geometry import spherical
from bvbedit_gui import lobes

ANGLES = [0.0, 0.3, np.pi / 4, 1.2, np.radians(89)]


@pytest.mark.parametrize("theta_i", ANGLES)
def test_the_mesh_covers_the_hemisphere_once(theta_i):
    w, triangles = lobes.mirror_mesh(theta_i)
    np.testing.assert_allclose(np.linalg.norm(w, axis=1), 1, atol=1e-12)
    assert (w[:, 2] >= 0).all()
    np.testing.assert_allclose(w[0], spherical(theta_i, 0.0), atol=1e-15)
    a, b, c = (w[triangles[:, k]] for k in range(3))
    solid = np.einsum("ni,ni->n", a, np.cross(b, c))
    # Twice the signed volume of the cone over a triangle: outwards everywhere, and near to that of the sphere.
    assert (solid >= -1e-12).all()
    normal = np.cross(b - a, c - a)
    assert 0.5 * np.linalg.norm(normal, axis=1).sum() == pytest.approx(2 * np.pi, rel=5e-3)


@pytest.mark.parametrize("theta_i", ANGLES)
def test_the_radius_is_the_length_of_the_colour_vector(theta_i):
    brdf = GGX(0.3, Schlick((0.9, 0.6, 0.3)))
    lobe = lobes.lobe(brdf, theta_i)
    points = np.asarray(lobes.surface(lobe, lobes.points(lobe, Linear(), lobe.peak)).points, dtype=float) * lobe.peak
    radius = np.linalg.norm(points, axis=1)
    some = radius > 1e-3
    wo = points[some] / radius[some][:, None]
    wo[:, 2] = np.maximum(wo[:, 2], 0)
    f = brdf.evaluate(spherical(theta_i, np.pi), lobe.wo[some])
    np.testing.assert_allclose(radius[some], np.linalg.norm(f, axis=1), rtol=1e-5)
    np.testing.assert_allclose(wo, lobe.wo[some], atol=1e-5)


@pytest.mark.parametrize("theta_i", ANGLES[:-1])
def test_a_sharp_lobe_points_to_the_mirror_direction(theta_i):
    lobe = lobes.lobe(GGX(0.02, Schlick((0.9, 0.9, 0.9))), theta_i)
    brightest = lobe.wo[np.argmax(lobe.length)]
    assert np.degrees(np.arccos(np.clip(brightest @ spherical(theta_i, 0.0), -1, 1))) < 2.0


def test_a_lambert_lobe_is_a_hemisphere_of_its_colour():
    lobe = lobes.lobe(Lambert((0.8, 0.4, 0.0)), 0.5)
    length = np.linalg.norm([0.8, 0.4, 0.0]) / np.pi
    np.testing.assert_allclose(lobe.length, length, rtol=1e-12)
    # 0.5 in linear light is 188 of 255 by the sRGB curve (IEC 61966-2-1).
    assert (lobe.colour == [255, 188, 0]).all()
    assert (lobes.true_colour(np.zeros((2, 3))) == 0).all()


def test_scales_keep_the_peak_at_one_and_cut_what_exceeds_it():
    lobe = lobes.lobe(GGX(0.2, Schlick((0.9, 0.9, 0.9))), 0.5)
    peak = lobe.peak
    for scale in (Linear(), Root()):
        radius = np.linalg.norm(lobes.surface(lobe, lobes.points(lobe, scale, peak)).points, axis=1)
        assert radius.max() == pytest.approx(1, rel=1e-6)
        expected = scale.encode(lobe.length / peak)
        np.testing.assert_allclose(radius, expected, atol=1e-6)
        assert np.linalg.norm(lobes.points(lobe, scale, peak / 2), axis=1).max() == pytest.approx(1, rel=1e-6)
    assert isinstance(lobes.fitting_scale(lobes.lobe(GGX(0.05, Schlick((0.9, 0.9, 0.9))), 0.5)), Root)
    assert isinstance(lobes.fitting_scale(lobes.lobe(Lambert((0.5, 0.5, 0.5)), 0.1)), Linear)


@pytest.mark.parametrize("peak", [0.37, 1.0, 4.9, 12_345.0])
@pytest.mark.parametrize("scale", [Linear(), Root()], ids=repr)
def test_rings_are_round_lengths_within_the_peak(scale, peak):
    for length, radius in lobes.rings(scale, peak):
        assert 0 < radius <= 1
        assert length <= peak * (1 + 1e-9)
        assert radius == pytest.approx(float(scale.encode(np.array(length / peak))))
        mantissa = length / 10.0 ** np.floor(np.log10(length) + 1e-9)
        assert min(abs(mantissa - m) for m in (1, 2, 2.5, 5)) < 1e-9
