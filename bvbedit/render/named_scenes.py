"""Scenes that a command needs by name, and the same sphere in a panorama of one's own.

Lit so that white paper stays below 1 and metals show something to mirror, at exposure 0.
"""

from collections.abc import Callable
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bvbedit.errors import BvbError
from bvbedit.render.scene import (
    Camera,
    ConstantEnvironment,
    Environment,
    GradientEnvironment,
    LatLongEnvironment,
    Plane,
    Scene,
    Sphere,
    Sun,
    Vector,
    directions_of_texels,
)

# From a little above, so that the ground fills the lower half and the shadow is seen whole.
CAMERA = Camera(position=(0.0, -6.2, 2.1), look_at=(0.06, 0.0, 0.92), vertical_fov=float(np.radians(26.5)))
STUDIO_SIZE = (128, 256)


def scene_named(name: str) -> Scene:
    """Return the scene called ``name``: sphere, studio or furnace. Raises BvbError that lists the names."""
    try:
        make = SCENES[name]
    except (KeyError, TypeError):
        raise BvbError(
            f"Unknown scene {name!r}. Choose one of {', '.join(SCENES)}, or name a lat-long .exr picture."
        ) from None
    return make()


def scene_with_environment(path: str | PathLike[str]) -> Scene:
    """Return the sphere, on no ground, in the panorama (RGB radiance, see LatLongEnvironment) of an .exr file.

    Raises BvbError for files that cannot be read, and for negative or non-finite radiance.
    """
    from bvbedit.io.exr import read_exr

    return Scene(CAMERA, Sphere(), LatLongEnvironment(read_exr(path)))


def _sphere() -> Scene:
    """A clear sky that pales towards the horizon, a warm sun from the left, and a ground as bright as the horizon."""
    horizon = (0.37, 0.375, 0.37)
    sky = GradientEnvironment(zenith=(0.09, 0.18, 0.40), horizon=horizon, nadir=(0.1, 0.1, 0.1))
    sun = Sun(direction=(-0.58, -0.62, 1.0), irradiance=(2.0, 1.8, 1.5))
    return Scene(CAMERA, Sphere(), sky, _ground_under(sky, sun, horizon), sun)


def _studio() -> Scene:
    """Soft boxes before a dark wall: a large key on the left, a strip on the right, one above and one behind."""
    directions = directions_of_texels(*STUDIO_SIZE)
    wall = (0.20, 0.205, 0.215)
    picture = np.tile(np.array(wall), (*STUDIO_SIZE, 1))
    for towards, half_width, half_height, radiance in (
        ((-0.85, -0.60, 0.75), 0.60, 0.60, (2.2, 2.1, 1.9)),
        ((0.95, -0.15, 0.45), 0.20, 0.65, (1.9, 2.1, 2.4)),
        ((0.10, 0.25, 1.00), 0.45, 0.30, (1.5, 1.5, 1.5)),
        ((0.55, 0.95, 0.35), 0.30, 0.22, (1.4, 1.3, 1.2)),
    ):
        picture += _soft_box(directions, towards, half_width, half_height)[..., None] * np.array(radiance)
    studio = LatLongEnvironment(picture.astype(np.float32))
    return Scene(CAMERA, Sphere(), studio, _ground_under(studio, None, wall))


def _furnace() -> Scene:
    """The white furnace: radiance 1 from everywhere, so a pixel of the sphere shows the albedo seen from there."""
    return Scene(CAMERA, Sphere(), ConstantEnvironment())


SCENES: dict[str, Callable[[], Scene]] = {"sphere": _sphere, "studio": _studio, "furnace": _furnace}


def _soft_box(directions: NDArray[Any], towards: Vector, half_width: float, half_height: float) -> NDArray[Any]:
    """Return how much of each direction (..., 3) a rectangle covers that is seen in direction ``towards``, in [0, 1].

    The half sizes are tangents of angles; the edges are soft over a tenth, so that few texels are enough.
    """
    axis = np.asarray(towards) / np.linalg.norm(towards)
    right = np.cross(axis, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    depth = directions @ axis
    front = np.maximum(depth, 1e-6)
    across, along = directions @ right / front, directions @ np.cross(right, axis) / front
    edge = 0.1
    cover_x = np.clip((half_width - np.abs(across)) / edge + 0.5, 0.0, 1.0)
    cover_y = np.clip((half_height - np.abs(along)) / edge + 0.5, 0.0, 1.0)
    return np.asarray(np.where(depth > 0, cover_x * cover_y, 0.0))


def _ground_under(environment: Environment, sun: Sun | None, radiance: Vector) -> Plane:
    """Return the ground at z = 0 with the albedo that gives it ``radiance`` where nothing shades it.

    With the radiance of the horizon there is no visible edge between ground and background.
    """
    texels = environment.texels().astype(np.float64)
    height, width, _ = texels.shape
    up = directions_of_texels(height, width)[..., 2]
    # The solid angle of a row: the difference of the cosines of its edges, shared among its texels.
    edges = np.cos(np.arange(height + 1) * np.pi / height)
    weight = np.maximum(up, 0.0) * ((edges[:-1] - edges[1:]) * 2 * np.pi / width)[:, None]
    irradiance = np.einsum("rc,rck->k", weight, texels)
    if sun is not None:
        irradiance += max(sun.direction[2], 0.0) * np.array(sun.irradiance)
    albedo = np.pi * np.array(radiance) / irradiance
    return Plane(0.0, (float(albedo[0]), float(albedo[1]), float(albedo[2])))
