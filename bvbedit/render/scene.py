"""What is looked at: a sphere of the material, the ground it stands on, and the light around it, as plain values.

The world is right-handed with z up. Lengths have no unit; radiance and irradiance are linear RGB. Nothing here knows
how a picture is computed.
"""

from dataclasses import dataclass
from numbers import Real

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bvbedit.errors import BvbError

Vector = tuple[float, float, float]
Texels = NDArray[np.float32]

# Rows of the picture that stands for a gradient: bilinear look-up reproduces a linear ramp exactly away from its ends,
# so this only bounds the rounded corners at the zenith, horizon and nadir to a third of a degree.
GRADIENT_ROWS = 512
# Slack, in lengths, by which rounded numbers may let a sphere sink into the ground it is meant to touch.
TOUCH = 1e-9


@dataclass(frozen=True)
class Camera:
    """A pinhole at ``position`` that looks at the point ``look_at``; ``vertical_fov`` in radians, square pixels.

    Raises BvbError for coinciding points, an ``up`` along the view, or a field of view outside (0, pi).
    """

    position: Vector
    look_at: Vector
    vertical_fov: float
    up: Vector = (0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        _set(self, position=_vector(self.position, "camera position"), look_at=_vector(self.look_at, "camera look_at"))
        _set(self, up=_vector(self.up, "camera up"))
        if not (isinstance(self.vertical_fov, Real) and 0 < self.vertical_fov < np.pi):
            raise BvbError(f"vertical_fov is {self.vertical_fov!r}. Give radians between 0 and pi.")
        forward = np.subtract(self.look_at, self.position)
        if np.linalg.norm(np.cross(forward, self.up)) <= 1e-9 * np.linalg.norm(forward) * np.linalg.norm(self.up):
            raise BvbError("The camera looks nowhere or along its own up. Move look_at or change up.")

    def frame(self) -> NDArray[np.float64]:
        """Return the unit vectors to the right, up and forward (3, 3), one per row."""
        forward = np.subtract(self.look_at, self.position)
        right = np.cross(forward, self.up)
        rows = np.stack([right, np.cross(right, forward), forward])
        return np.asarray(rows / np.linalg.norm(rows, axis=1, keepdims=True))


@dataclass(frozen=True)
class Sphere:
    """The sphere that wears the material. Its tangents run along the parallels of latitude about z."""

    centre: Vector = (0.0, 0.0, 1.0)
    radius: float = 1.0

    def __post_init__(self) -> None:
        _set(self, centre=_vector(self.centre, "sphere centre"))
        if not (isinstance(self.radius, Real) and 0 < self.radius < np.inf):
            raise BvbError(f"sphere radius is {self.radius!r}. Give a positive finite number.")


@dataclass(frozen=True)
class Plane:
    """An endless horizontal ground at z = ``height``, Lambertian with ``albedo`` in [0, 1] per channel."""

    height: float = 0.0
    albedo: Vector = (0.5, 0.5, 0.5)

    def __post_init__(self) -> None:
        _set(self, albedo=_vector(self.albedo, "ground albedo", lowest=0.0, highest=1.0))
        if not (isinstance(self.height, Real) and np.isfinite(self.height)):
            raise BvbError(f"ground height is {self.height!r}. Give a finite number.")


@dataclass(frozen=True)
class ConstantEnvironment:
    """The same ``radiance`` from every direction."""

    radiance: Vector = (1.0, 1.0, 1.0)

    def __post_init__(self) -> None:
        _set(self, radiance=_vector(self.radiance, "environment radiance", lowest=0.0))

    def texels(self) -> Texels:
        """Return the environment as a lat-long picture (1, 1, 3)."""
        return np.asarray(self.radiance, dtype=np.float32).reshape(1, 1, 3)


@dataclass(frozen=True)
class GradientEnvironment:
    """Radiance that runs linearly in elevation from ``nadir`` to ``horizon`` to ``zenith``."""

    zenith: Vector
    horizon: Vector
    nadir: Vector

    def __post_init__(self) -> None:
        for name in ("zenith", "horizon", "nadir"):
            _set(self, **{name: _vector(getattr(self, name), f"environment {name}", lowest=0.0)})

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

    picture: Texels

    def __post_init__(self) -> None:
        with np.errstate(over="ignore"):  # becomes infinite, which is refused below
            picture = np.array(self.picture, dtype=np.float32, order="C")
        if picture.ndim != 3 or picture.shape[-1] != 3 or picture.size == 0:
            raise BvbError(f"The environment's picture has shape {picture.shape}. Give (height, width, 3).")
        if not (np.isfinite(picture).all() and picture.min() >= 0):
            raise BvbError("The environment's picture has negative, nan or infinite values. Clean it first.")
        picture.flags.writeable = False
        _set(self, picture=picture)

    def texels(self) -> Texels:
        """Return the environment as a lat-long picture (h, w, 3)."""
        return self.picture


Environment = ConstantEnvironment | GradientEnvironment | LatLongEnvironment


@dataclass(frozen=True)
class Sun:
    """Parallel light from ``direction`` (towards the sun, normalised here) with ``irradiance`` across it, in RGB.

    It is a delta light: shadows are sharp, and it is not seen in the sky.
    """

    direction: Vector
    irradiance: Vector

    def __post_init__(self) -> None:
        direction = np.array(_vector(self.direction, "sun direction"))
        if not direction.any():
            raise BvbError("The sun's direction is zero. Give a vector that points towards the sun.")
        direction /= np.abs(direction).max()
        _set(self, direction=_vector(direction / np.linalg.norm(direction), "sun direction"))
        _set(self, irradiance=_vector(self.irradiance, "sun irradiance", lowest=0.0))


@dataclass(frozen=True)
class Scene:
    """A camera, a sphere, perhaps a ground, and its light.

    Raises BvbError where the camera is inside the sphere or under the ground, or the sphere sinks into the ground.
    """

    camera: Camera
    sphere: Sphere
    environment: Environment
    ground: Plane | None = None
    sun: Sun | None = None

    def __post_init__(self) -> None:
        distance = np.linalg.norm(np.subtract(self.camera.position, self.sphere.centre))
        if distance <= self.sphere.radius:
            raise BvbError("The camera is inside the sphere. Move it out.")
        if self.ground is None:
            return
        if self.camera.position[2] <= self.ground.height:
            raise BvbError("The camera is not above the ground. Raise it.")
        if self.sphere.centre[2] - self.sphere.radius < self.ground.height - TOUCH * self.sphere.radius:
            raise BvbError("The sphere sinks into the ground. Raise it or lower the ground.")


def directions_of_texels(height: int, width: int) -> NDArray[np.float64]:
    """Return the unit directions (height, width, 3) at the texel centres of a lat-long picture."""
    theta = ((np.arange(height) + 0.5) * np.pi / height)[:, None]
    azimuth = ((np.arange(width) + 0.5) / width - 0.5) * 2 * np.pi
    up = np.broadcast_to(np.cos(theta), (height, width))
    return np.stack([np.sin(theta) * np.sin(azimuth), np.sin(theta) * np.cos(azimuth), up], axis=-1)


def _set(value: object, **fields: object) -> None:
    """Set fields of a frozen dataclass while it is being made."""
    for name, content in fields.items():
        object.__setattr__(value, name, content)


def _vector(value: ArrayLike, name: str, lowest: float = -np.inf, highest: float = np.inf) -> Vector:
    try:
        v = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        v = np.empty(0)
    if v.shape != (3,) or not np.isfinite(v).all():
        raise BvbError(f"{name} is {value!r}. Give three finite numbers.")
    if v.min() < lowest or v.max() > highest:
        raise BvbError(f"{name} is {value!r}. Its components must lie in [{lowest:g}, {highest:g}].")
    return (float(v[0]), float(v[1]), float(v[2]))
