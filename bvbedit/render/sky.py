"""The clear sky by day: Preetham, Shirley & Smits 1999, "A practical analytic model for daylight".

Luminance and chromaticity follow Perez et al. (1993), F(theta, gamma) = (1 + A exp(B / cos theta)) (1 + C exp(D gamma)
+ E cos^2 gamma), theta from the zenith and gamma from the sun, relative to their values at the zenith. Turbidity says
how much haze there is: 2 is very clear, 3 clear, 10 a light haze. The sun itself is not in it.
"""

from numbers import Real

import numpy as np
from numpy.typing import NDArray

from bvbedit.errors import BvbError
from bvbedit.render.lights import Texels, directions_of_texels
from bvbedit.render.values import Vector, check_positive, direction, vector

Floats = NDArray[np.float64]
Rows = tuple[tuple[float, float, float, float], ...]
Pairs = tuple[tuple[float, float], ...]

TURBIDITIES = (2.0, 10.0)
# Height and width of the picture: its features are as wide as the glow around the sun, some ten degrees.
SKY_SIZE = (256, 512)
# Luminance of white paper that lies flat under the sky, at gain 1.
PAPER = 0.3
# The least cos theta: exp(B / cos theta) has long vanished there, and 1 / cos theta would overflow.
LOWEST = 1e-3

# Appendix A.2 of the paper. Perez's A ... E, each (times turbidity, constant), for Y and the chromaticities x and y.
PEREZ_LUMINANCE = ((0.1787, -1.4630), (-0.3554, 0.4275), (-0.0227, 5.3251), (0.1206, -2.5771), (-0.0670, 0.3703))
PEREZ_X = ((-0.0193, -0.2592), (-0.0665, 0.0008), (-0.0004, 0.2125), (-0.0641, -0.8989), (-0.0033, 0.0452))
PEREZ_Y = ((-0.0167, -0.2608), (-0.0950, 0.0092), (-0.0079, 0.2102), (-0.0441, -1.6537), (-0.0109, 0.0529))
# Chromaticities at the zenith: rows for turbidity^2, turbidity, 1; columns for theta_sun^3, ^2, theta_sun, 1.
ZENITH_X = (
    (0.00166, -0.00375, 0.00209, 0.0),
    (-0.02903, 0.06377, -0.03202, 0.00394),
    (0.11693, -0.21196, 0.06052, 0.25886),
)
ZENITH_Y = (
    (0.00275, -0.00610, 0.00317, 0.0),
    (-0.04214, 0.08970, -0.04153, 0.00516),
    (0.15346, -0.26756, 0.06670, 0.26688),
)
# From CIE XYZ to linear sRGB, white point D65 (IEC 61966-2-1), and the luminance of linear sRGB.
XYZ_TO_RGB = np.array([(3.2406, -1.5372, -0.4986), (-0.9689, 1.8758, 0.0415), (0.0557, -0.2040, 1.0570)])
LUMINANCE = np.array((0.2126, 0.7152, 0.0722))


def preetham_sky(
    sun_direction: Vector,
    turbidity: float = 3.0,
    gain: float = 1.0,
    ground: Vector = (0.1, 0.1, 0.1),
    size: tuple[int, int] = SKY_SIZE,
) -> Texels:
    """Return the sky as the texels (h, w, 3) of a LatLongEnvironment: radiance in linear sRGB, float32, read-only.

    ``sun_direction`` points to the sun, which is not below the horizon; its length does not matter. ``turbidity`` is
    from 2 to 10, where the model holds. At ``gain`` 1 the sky is as bright as makes white paper that lies flat under
    it, the sun hidden, appear with luminance PAPER: as in a photograph, any sky is well exposed, at dusk too, and there
    is room for a sun. Colours that no screen shows are paled at the same luminance. Below the horizon the radiance is
    ``ground``, whatever the gain. Raises BvbError for other suns, turbidities, gains and grounds.
    """
    sun = np.array(direction(sun_direction, "sun direction"))
    if sun[2] < 0:
        raise BvbError(f"The sun stands {np.degrees(np.arcsin(-sun[2])):.3g} degrees below the horizon. Raise it.")
    if not (isinstance(turbidity, Real) and TURBIDITIES[0] <= turbidity <= TURBIDITIES[1]):
        raise BvbError(f"turbidity is {turbidity!r}. Give a number from 2 (very clear) to 10 (hazy).")
    check_positive(gain, "sky gain")
    below = np.array(vector(ground, "sky ground", lowest=0.0))

    directions = directions_of_texels(*size)
    up = directions[..., 2:]
    rgb = np.where(up > 0, _in_gamut(xyz_of_sky(directions, sun, turbidity) @ XYZ_TO_RGB.T), 0.0)
    # A texel's solid angle goes with the sine of theta; paper sends back the mean over cos theta.
    weight = np.maximum(up, 0.0) * np.sqrt(1 - up**2)
    paper = np.average(rgb @ LUMINANCE, weights=np.broadcast_to(weight[..., 0], size))
    with np.errstate(over="ignore"):  # becomes infinite, which is refused
        texels = np.where(up > 0, rgb * (gain / paper * PAPER), below).astype(np.float32)
    if not np.isfinite(texels).all():
        raise BvbError(f"sky gain is {gain!r}, sky ground {ground!r}. Lower what overflows.")
    texels.flags.writeable = False
    return texels


def xyz_of_sky(directions: Floats, sun: Floats, turbidity: float) -> Floats:
    """Return CIE XYZ (..., 3) of the sky, Y in kcd/m^2, in unit ``directions`` (..., 3) above the horizon."""
    cos_theta = np.maximum(directions[..., 2], LOWEST)
    cos_gamma = directions @ sun
    theta_sun = float(np.arctan2(np.hypot(sun[0], sun[1]), sun[2]))
    chi = (4 / 9 - turbidity / 120) * (np.pi - 2 * theta_sun)
    zenith = (
        (4.0453 * turbidity - 4.9710) * np.tan(chi) - 0.2155 * turbidity + 2.4192,
        _zenith_chromaticity(ZENITH_X, turbidity, theta_sun),
        _zenith_chromaticity(ZENITH_Y, turbidity, theta_sun),
    )
    luminance, x, y = (
        value * _perez(coefficients, turbidity, cos_theta, cos_gamma) / _perez(coefficients, turbidity, 1.0, sun[2])
        for value, coefficients in zip(zenith, (PEREZ_LUMINANCE, PEREZ_X, PEREZ_Y), strict=True)
    )
    return np.stack([x / y * luminance, luminance, (1 - x - y) / y * luminance], axis=-1)


def _perez(coefficients: Pairs, turbidity: float, cos_theta: Floats | float, cos_gamma: Floats | float) -> Floats:
    a, b, c, d, e = (slope * turbidity + constant for slope, constant in coefficients)
    gamma = np.arccos(np.clip(cos_gamma, -1.0, 1.0))
    return np.asarray((1 + a * np.exp(b / cos_theta)) * (1 + c * np.exp(d * gamma) + e * np.square(cos_gamma)))


def _zenith_chromaticity(table: Rows, turbidity: float, theta_sun: float) -> float:
    return float(turbidity ** np.arange(2, -1, -1) @ np.array(table) @ theta_sun ** np.arange(3, -1, -1))


def _in_gamut(rgb: Floats) -> Floats:
    """Return linear sRGB (..., 3) of positive luminance with negative parts removed, by mixing with grey as light."""
    grey = rgb @ LUMINANCE[:, None]
    least = rgb.min(axis=-1, keepdims=True)
    share = np.where(least < 0, grey / (grey - least), 1.0)
    # Rounding may leave a part just below zero.
    return np.asarray(np.maximum(grey + share * (rgb - grey), 0.0))
