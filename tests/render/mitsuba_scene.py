"""Scenes as Mitsuba 3 takes them, so that its path tracer can be asked the same question as ours.

Mitsuba's ``path`` integrator counts the ray that leaves the last surface: our depth d is its ``max_depth`` d + 1. It
has no ``direct_light_only``, so that scenes are compared without.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import ModuleType
from typing import Any

import numpy as np

from bvbedit.render.environment import EnvironmentDensity
from bvbedit.render.scene import Plane, Scene, Sphere
from tests.render.environments import arriving

# Half the side of the square that stands for an endless plane.
ENDLESS = 1e4


def followed_everywhere(scene: Scene) -> Scene:
    """Return ``scene`` with light followed to its planes as well, as Mitsuba does."""
    return replace(
        scene, objects=tuple(replace(x, direct_light_only=False) if isinstance(x, Plane) else x for x in scene.objects)
    )


def mitsuba_scene(
    mi: ModuleType,
    scene: Scene,
    models: Sequence[Mapping[str, Any]],
    width: int,
    height: int,
    spp: int,
    sampler: str = "independent",
) -> Any:
    """Return Mitsuba's scene for spheres, planes, suns and any environment; ``models`` are its BSDFs, by number."""
    T = mi.ScalarTransform4f
    camera = scene.camera
    described: dict[str, Any] = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": scene.depth + 1, "rr_depth": 1000},
        "sensor": {
            "type": "perspective",
            "fov": camera.vertical_fov_degrees,
            "fov_axis": "y",
            "near_clip": 1e-3,
            "far_clip": 1e7,
            "to_world": T().look_at(origin=camera.position, target=camera.look_at, up=camera.up),
            "film": {
                "type": "hdrfilm",
                "width": width,
                "height": height,
                "pixel_format": "rgb",
                "component_format": "float32",
                "rfilter": {"type": "box"},
            },
            "sampler": {"type": sampler, "sample_count": spp},
        },
    }
    for n, thing in enumerate(scene.objects):
        if isinstance(thing, Sphere):
            shape = {"type": "sphere", "center": thing.centre, "radius": thing.radius}
        else:
            assert isinstance(thing, Plane)
            placed = T().translate([0.0, 0.0, thing.height]) @ T().scale([ENDLESS, ENDLESS, 1.0])
            shape = {"type": "rectangle", "to_world": placed}
        material = thing.material
        bsdf = models[material - 1] if isinstance(material, int) else diffuse(material)
        described[f"object_{n}"] = {**shape, "bsdf": bsdf}
    texels = scene.environment.texels()
    if texels.any():
        # Its pole is +y and its seam lies elsewhere, which turning it and asking for its directions settles.
        bitmap = mi.Bitmap(as_mitsuba_looks_up(texels))
        described["sky"] = {"type": "envmap", "bitmap": bitmap, "to_world": T().rotate([1.0, 0.0, 0.0], 90.0)}
    for n, sun in enumerate(scene.lights):
        described[f"sun_{n}"] = {
            "type": "directional",
            "direction": [-x for x in sun.direction],
            "irradiance": {"type": "rgb", "value": list(sun.irradiance)},
        }
    return mi.load_dict(described)


def diffuse(colour: Sequence[float]) -> dict[str, Any]:
    """Return the BSDF of a diffuse colour."""
    return {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(colour)}}


def as_mitsuba_looks_up(texels: np.ndarray) -> np.ndarray:
    """Return a lat-long picture of ours as Mitsuba's bilinear look-up needs it to give the same.

    Its rows lie on both poles and evenly between them, its columns where ours are; the number of ours must be even.
    """
    assert texels.shape[1] == 1 or texels.shape[1] % 2 == 0
    height, width = 2 * len(texels) + 1, max(8, texels.shape[1])
    theta, phi = np.pi * np.arange(height)[:, None] / (height - 1), 2 * np.pi * (np.arange(width) + 0.5) / width
    # Mitsuba's directions (sin phi sin theta, cos theta, -cos phi sin theta), turned by 90 degrees about x.
    x, y = np.sin(theta) * np.sin(phi), np.sin(theta) * np.cos(phi)
    directions = np.stack(np.broadcast_arrays(x, y, np.cos(theta)), axis=-1).reshape(-1, 3)
    density = EnvironmentDensity.of(texels)
    assert density is not None
    return arriving(density, directions)[0].reshape(height, width, 3).astype(np.float32)
