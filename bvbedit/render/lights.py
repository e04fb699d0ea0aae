"""Light: what comes from everywhere, an environment, and lamps. Linear RGB; nothing here knows how it is sampled."""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from bvbedit.errors import BvbError
from bvbedit.render.values import Vector, check_positive, direction, set_fields, vector

Texels = NDArray[np.float32]

# Rows of the picture that stands for a gradient: bilinear look-up reproduces a linear ramp exactly away from its ends,
# so this only bounds the rounded corners at the zenith, horizon and nadir to a third of a degree.
GRADIENT_ROWS = 512
# A direction that is less level than this is vertical.
LEVEL = 1e-9


@dataclass(frozen=True)
class ConstantEnvironment:
    """The same ``radiance`` from every direction."""

    radiance: Vector = (1.0, 1.0, 1.0)
    kind: Literal["constant"] = "constant"

    def __post_init__(self) -> None:
        set_fields(self, radiance=vector(self.radiance, "environment radiance", lowest=0.0))

    def texels(self) -> Texels:
        """Return the environment as a lat-long picture (1, 1, 3)."""
        return np.asarray(self.radiance, dtype=np.float32).reshape(1, 1, 3)


@dataclass(frozen=True)
class GradientEnvironment:
    """Radiance that runs linearly in elevation from ``nadir`` to ``horizon`` to ``zenith``."""

    zenith: Vector
    horizon: Vector
    nadir: Vector
    kind: Literal["gradient"] = "gradient"

    def __post_init__(self) -> None:
        for name in ("zenith", "horizon", "nadir"):
            set_fields(self, **{name: vector(getattr(self, name), f"environment {name}", lowest=0.0)})

    def texels(self) -> Texels:
        """Return the environment as a lat-long picture (GRADIENT_ROWS, 1, 3)."""
        fraction = (np.arange(GRADIENT_ROWS) + 0.5) / GRADIENT_ROWS
        colours = np.array([self.zenith, self.horizon, self.nadir])
        ramp = [np.interp(fraction, [0.0, 0.5, 1.0], colours[:, channel]) for channel in range(3)]
        return np.stack(ramp, axis=-1)[:, None].astype(np.float32)


@dataclass(frozen=True, eq=False)
class LatLongEnvironment:
    """A panorama ``picture`` (h, w, 3) of radiance; the top row is the zenith (+z), the bottom row the nadir.

    The centre column looks along +y and columns to the right of it turn to +x, as someone sees it who stands inside:
    column / w = 1/2 + atan2(x, y) / (2 pi), row / h = theta / pi. Values between texel centres are bilinear.
    Copied as float32, read-only. Raises BvbError for a wrong shape and for negative, nan or infinite radiance.
    """

    picture: Any
    kind: Literal["picture"] = "picture"

    def __post_init__(self) -> None:
        with np.errstate(over="ignore"):  # becomes infinite, which is refused below
            picture = np.array(self.picture, dtype=np.float32, order="C")
        if picture.ndim != 3 or picture.shape[-1] != 3 or picture.size == 0:
            raise BvbError(f"The environment's picture has shape {picture.shape}. Give (height, width, 3).")
        if not (np.isfinite(picture).all() and picture.min() >= 0):
            raise BvbError("The environment's picture has negative, nan or infinite values. Clean it first.")
        picture.flags.writeable = False
        set_fields(self, picture=picture)

    def texels(self) -> Texels:
        """Return the environment as a lat-long picture (h, w, 3)."""
        return np.asarray(self.picture)


@dataclass(frozen=True)
class Panorama:
    """A LatLongEnvironment in a ``file`` (.exr), its radiance multiplied by ``gain``."""

    file: str
    gain: float = 1.0
    kind: Literal["panorama"] = "panorama"

    def __post_init__(self) -> None:
        check_positive(self.gain, "panorama gain")

    def texels(self) -> Texels:
        """Return the environment as a lat-long picture (h, w, 3). Raises BvbError for files that hold none."""
        from bvbedit.io.exr import read_exr

        with np.errstate(over="ignore"):
            return LatLongEnvironment(read_exr(self.file) * np.float32(self.gain)).texels()


@dataclass(frozen=True)
class Sky:
    """A clear sky (Preetham et al. 1999) around the sun in ``sun_direction``, which itself is a light of its own.

    ``turbidity``: 2 (very clear) to 10 (hazy). ``gain`` multiplies its radiance. Below the horizon it is ``ground``.
    """

    sun_direction: Vector
    turbidity: float = 3.0
    gain: float = 1.0
    ground: Vector = (0.1, 0.1, 0.1)
    kind: Literal["sky"] = "sky"

    def __post_init__(self) -> None:
        set_fields(self, sun_direction=direction(self.sun_direction, "sun_direction"))
        set_fields(self, ground=vector(self.ground, "sky ground", lowest=0.0))
        check_positive(self.gain, "sky gain")
        check_positive(self.turbidity, "sky turbidity")

    def texels(self) -> Texels:
        """Return the environment as a lat-long picture (h, w, 3). Raises BvbError for a sun below the horizon."""
        from bvbedit.render.sky import preetham_sky

        return preetham_sky(self.sun_direction, self.turbidity, gain=self.gain, ground=self.ground)


Environment = ConstantEnvironment | GradientEnvironment | Sky | Panorama | LatLongEnvironment


@dataclass(frozen=True)
class Sun:
    """Parallel light from ``direction`` (towards the sun, normalised here) with ``irradiance`` across it, in RGB.

    It is a delta light: shadows are sharp, and it is not seen in the sky.
    """

    direction: Vector
    irradiance: Vector
    kind: Literal["sun"] = "sun"

    def __post_init__(self) -> None:
        set_fields(self, direction=direction(self.direction, "sun direction"))
        set_fields(self, irradiance=vector(self.irradiance, "sun irradiance", lowest=0.0))


@dataclass(frozen=True)
class PointLight:
    """A lamp without size at ``position`` that sends ``intensity`` (RGB, per steradian) everywhere; it is not seen."""

    position: Vector
    intensity: Vector
    kind: Literal["point"] = "point"

    def __post_init__(self) -> None:
        set_fields(self, position=vector(self.position, "light position"))
        set_fields(self, intensity=vector(self.intensity, "light intensity", lowest=0.0))


@dataclass(frozen=True)
class RectangleLight:
    """A lamp like a window or a soft box: ``width`` x ``height`` about ``centre``, its face turned to ``look_at``.

    It is upright where it can be. Its face has ``radiance``; its back is black, and it hides what is behind it. Raises
    BvbError where it looks nowhere.
    """

    centre: Vector
    look_at: Vector
    width: float
    height: float
    radiance: Vector
    kind: Literal["rectangle"] = "rectangle"

    def __post_init__(self) -> None:
        for name in ("centre", "look_at"):
            set_fields(self, **{name: vector(getattr(self, name), f"light {name}")})
        set_fields(self, radiance=vector(self.radiance, "light radiance", lowest=0.0))
        check_positive(self.width, "light width")
        check_positive(self.height, "light height")
        if self.centre == self.look_at:
            raise BvbError(f"light centre and look_at are both {self.centre}. Move one.")

    def frame(self) -> NDArray[np.float64]:
        """Return the unit vectors along its width, along its height, and the way it faces (3, 3), one per row."""
        normal = np.array(direction(np.subtract(self.look_at, self.centre), "light look_at"))
        # A lamp that looks straight down has its width along x.
        level = np.hypot(normal[0], normal[1])
        along_width = np.array([-normal[1], normal[0], 0.0]) / level if level > LEVEL else np.array([1.0, 0.0, 0.0])
        along_width -= normal * (along_width @ normal)
        along_width /= np.linalg.norm(along_width)
        return np.stack([along_width, np.cross(normal, along_width), normal])


Light = Sun | PointLight | RectangleLight


def directions_of_texels(height: int, width: int) -> NDArray[np.float64]:
    """Return the unit directions (height, width, 3) at the texel centres of a lat-long picture."""
    theta = ((np.arange(height) + 0.5) * np.pi / height)[:, None]
    azimuth = ((np.arange(width) + 0.5) / width - 0.5) * 2 * np.pi
    up = np.broadcast_to(np.cos(theta), (height, width))
    return np.stack([np.sin(theta) * np.sin(azimuth), np.sin(theta) * np.cos(azimuth), up], axis=-1)
