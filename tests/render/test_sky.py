"""The sky of Preetham et al.: what it must look like by day and at dusk, and what is refused."""

import numpy as np
import pytest

from bvbedit.errors import BvbError
from bvbedit.render.lights import LatLongEnvironment, directions_of_texels
from bvbedit.render.sky import LUMINANCE, PAPER, SKY_SIZE, XYZ_TO_RGB, preetham_sky, xyz_of_sky

SIZE = (64, 128)
ABOVE = directions_of_texels(*SIZE)[: SIZE[0] // 2]
TURBIDITIES = (2.0, 3.0, 6.0, 10.0)
ELEVATIONS = (0.0, 0.5, 5.0, 30.0, 60.0, 90.0)


def sun_at(elevation, azimuth=40.0):
    """Return the unit vector to the sun, azimuth from +y towards +x, in degrees."""
    e, a = np.radians(elevation), np.radians(azimuth)
    return (np.cos(e) * np.sin(a), np.cos(e) * np.cos(a), np.sin(e))


def luminance(turbidity, elevation, directions):
    return xyz_of_sky(np.asarray(directions, dtype=float), np.array(sun_at(elevation)), turbidity)[..., 1]


@pytest.mark.parametrize("turbidity", TURBIDITIES)
@pytest.mark.parametrize("elevation", ELEVATIONS)
def test_every_sky_is_light(turbidity, elevation):
    sky = preetham_sky(sun_at(elevation), turbidity, ground=(0.1, 0.2, 0.3), size=SIZE)
    assert sky.shape == (*SIZE, 3)
    assert sky.dtype == np.float32
    assert np.isfinite(sky).all()
    assert sky.min() >= 0
    assert not sky.flags.writeable
    np.testing.assert_array_equal(LatLongEnvironment(sky).texels(), sky)
    np.testing.assert_array_equal(sky[32:], np.broadcast_to(np.float32((0.1, 0.2, 0.3)), (32, 128, 3)))
    # White paper under it, by the solid angles of texels.
    weight = ABOVE[..., 2] * np.sqrt(1 - ABOVE[..., 2] ** 2)
    assert np.average(sky[:32] @ LUMINANCE, weights=weight) == pytest.approx(PAPER, rel=1e-6)


@pytest.mark.parametrize(
    ("turbidity", "elevation", "luminance", "x", "y"),
    [
        # Worked by hand from the published polynomials, theta_sun = 0: chi = (4/9 - T/120) pi.
        (3.0, 90.0, (4.0453 * 3 - 4.9710) * np.tan(np.pi * (4 / 9 - 1 / 40)) - 0.2155 * 3 + 2.4192, 0.27068, 0.28236),
        (2.0, 0.0, 2.4192 - 0.4310, None, None),
    ],
)
def test_the_zenith_is_as_published(turbidity, elevation, luminance, x, y):
    xyz = xyz_of_sky(np.array([0.0, 0.0, 1.0]), np.array(sun_at(elevation)), turbidity)
    assert xyz[1] == pytest.approx(luminance, rel=1e-9)
    if x is not None:
        assert xyz[:2] / xyz.sum() == pytest.approx((x, y), rel=1e-9)


@pytest.mark.parametrize("what", ["Y", "x", "y"])
def test_away_from_the_zenith_it_is_as_published(what):
    """At turbidity 2 by its coefficients as numbers: 60 degrees from the zenith, 35 from the sun, which is at 25."""
    a, b, c, d, e = {
        "Y": (-1.1056, -0.2833, 5.2797, -2.3359, 0.2363),
        "x": (-0.2978, -0.1322, 0.2117, -1.0271, 0.0386),
        "y": (-0.2942, -0.1808, 0.1944, -1.7419, 0.0311),
    }[what]
    sun, theta = np.radians([25.0, 60.0])

    def perez(theta, gamma):
        return (1 + a * np.exp(b / np.cos(theta))) * (1 + c * np.exp(d * gamma) + e * np.cos(gamma) ** 2)

    def value(theta):
        direction = np.array([np.sin(theta), 0.0, np.cos(theta)])
        xyz = xyz_of_sky(direction, np.array([np.sin(sun), 0.0, np.cos(sun)]), turbidity=2.0)
        return {"Y": xyz[1], "x": xyz[0] / xyz.sum(), "y": xyz[1] / xyz.sum()}[what]

    zenith = value(0.0)
    if what == "Y":
        assert zenith == pytest.approx(3.1196 * np.tan((4 / 9 - 1 / 60) * (np.pi - 2 * sun)) + 1.9882, rel=1e-12)
    assert value(theta) == pytest.approx(zenith * perez(theta, theta - sun) / perez(0.0, sun), rel=1e-12)


def test_the_chromaticity_of_the_zenith_at_dusk():
    """The cubic in theta_sun = pi / 2, at turbidity 2: coefficients gathered by powers of theta_sun."""
    xyz = xyz_of_sky(np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0]), turbidity=2.0)
    t = np.pi / 2
    x = 0.06551 * t**3 - 0.09942 * t**2 + 0.00484 * t + 0.26674
    y = 0.08018 * t**3 - 0.11256 * t**2 - 0.00368 * t + 0.27720
    assert xyz[:2] / xyz.sum() == pytest.approx((x, y), rel=1e-12)


@pytest.mark.parametrize("turbidity", TURBIDITIES)
def test_colours_out_of_gamut_keep_their_luminance(turbidity):
    sun = np.array(sun_at(0.0))
    assert (xyz_of_sky(ABOVE, sun, 2.0) @ XYZ_TO_RGB.T).min() < 0
    ratio = preetham_sky(sun, turbidity, size=SIZE)[:32] @ LUMINANCE / xyz_of_sky(ABOVE, sun, turbidity)[..., 1]
    np.testing.assert_allclose(ratio, ratio.mean(), rtol=3e-4)


@pytest.mark.parametrize("turbidity", [2.0, 3.0])
@pytest.mark.parametrize("elevation", [30.0, 60.0, 90.0])
def test_a_clear_sky_is_blue(turbidity, elevation):
    red, green, blue = preetham_sky(sun_at(elevation), turbidity, size=SIZE)[:32].mean(axis=(0, 1))
    assert blue > 1.4 * green
    assert green > 1.2 * red


@pytest.mark.parametrize("elevation", [30.0, 45.0, 60.0, 90.0])
def test_haze_pales_it(elevation):
    means = [preetham_sky(sun_at(elevation), t, size=SIZE)[:32].mean(axis=(0, 1)) for t in (2.0, 3.0, 4.0, 6.0, 8.0)]
    saturation = [1 - m.min() / m.max() for m in means]
    assert (np.diff(saturation) < 0).all()


def test_dusk_is_redder_than_noon():
    low, high = (preetham_sky(sun_at(e), 3.0, size=SIZE)[:32].mean(axis=(0, 1)) for e in (1.0, 60.0))
    assert low[0] / low[2] > 2 * high[0] / high[2]


@pytest.mark.parametrize("turbidity", TURBIDITIES)
@pytest.mark.parametrize("elevation", [15.0, 30.0, 60.0])
def test_it_is_brighter_around_the_sun(turbidity, elevation):
    along = luminance(turbidity, elevation, [sun_at(elevation, 40.0 + away) for away in (0, 10, 20, 40, 80)])
    assert (np.diff(along) < 0).all()
    assert along[0] > 2 * along[-1]


@pytest.mark.parametrize("elevation", [45.0, 60.0])
def test_a_clear_sky_is_brighter_towards_the_horizon(elevation):
    """At right angles to the sun and beyond, where its glow does not outshine this."""
    up = np.array([60.0, 40.0, 20.0, 10.0, 2.0])
    for azimuth in (130.0, 220.0):
        down = luminance(2.0, elevation, [sun_at(e, azimuth) for e in up])
        assert (np.diff(down[1:]) > 0).all()
        assert down[-1] > 1.3 * down[0]


@pytest.mark.parametrize("elevation", ELEVATIONS)
def test_it_is_symmetric_about_the_plane_of_the_sun(elevation):
    sky = preetham_sky(sun_at(elevation, 0.0), 3.0, size=SIZE)
    np.testing.assert_allclose(sky, sky[:, ::-1], rtol=1e-5)


def test_it_turns_with_the_sun():
    turned = preetham_sky(sun_at(20.0, 90.0), 3.0, size=SIZE)
    np.testing.assert_allclose(turned, np.roll(preetham_sky(sun_at(20.0, 0.0), 3.0, size=SIZE), 32, axis=1), rtol=1e-5)


def test_a_sun_at_the_zenith_lights_all_sides_alike():
    sky = preetham_sky((0, 0, 1), 3.0, size=SIZE)
    np.testing.assert_allclose(sky, np.broadcast_to(sky[:, :1], sky.shape), rtol=1e-6)


def test_the_brightest_place_is_the_suns():
    sky = preetham_sky(sun_at(35.0, -60.0), 2.5)
    assert sky.shape[:2] == SKY_SIZE
    brightest = np.unravel_index(np.argmax((sky @ LUMINANCE)[:100]), (100, SKY_SIZE[1]))
    assert directions_of_texels(*SKY_SIZE)[brightest] @ sun_at(35.0, -60.0) > np.cos(np.radians(5))


def test_gain_leaves_the_ground_alone():
    one, four = (preetham_sky((3, 0, 4), 3.0, gain=gain, ground=(0.2, 0.1, 0.0), size=SIZE) for gain in (1.0, 4.0))
    np.testing.assert_allclose(four[:32], 4 * one[:32], rtol=1e-6)
    np.testing.assert_array_equal(four[32:], one[32:])


def test_the_suns_direction_has_any_length():
    one = preetham_sky((0.6, 0, 0.8), size=SIZE)
    np.testing.assert_allclose(preetham_sky((3e200, 0, 4e200), size=SIZE), one, rtol=1e-6)


@pytest.mark.parametrize("size", [(1, 1), (3, 5), (2, 1)])
def test_small_pictures(size):
    sky = preetham_sky((0, 1, 1), size=size)
    assert sky.shape == (*size, 3)
    assert np.isfinite(sky).all()


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: preetham_sky((0, 1, -0.01)), "0.573 degrees below the horizon. Raise"),
        (lambda: preetham_sky((0, 0, 0)), "zero"),
        (lambda: preetham_sky((0, np.nan, 1)), "three finite"),
        (lambda: preetham_sky("noon"), "three finite"),
        (lambda: preetham_sky((0, 0, 1), 1.9), "turbidity is 1.9"),
        (lambda: preetham_sky((0, 0, 1), 10.1), "turbidity is 10.1"),
        (lambda: preetham_sky((0, 0, 1), np.nan), "turbidity"),
        (lambda: preetham_sky((0, 0, 1), "clear"), "turbidity"),
        (lambda: preetham_sky((0, 0, 1), gain=0.0), "gain is 0.0"),
        (lambda: preetham_sky((0, 0, 1), gain=1e300), "gain is 1e\\+300"),
        (lambda: preetham_sky((0, 0, 1), gain=1.7e308), "overflows"),
        (lambda: preetham_sky((0, 0, 1), ground=(0, -1, 0)), "ground"),
        (lambda: preetham_sky((0, 0, 1), ground=(0, 1e39, 0)), "overflows"),
    ],
)
def test_what_is_refused(make, words):
    with pytest.raises(BvbError, match=words) as refusal:
        make()
    assert "\n" not in str(refusal.value)
