"""Direct light on the sphere: wave after wave of paths, with the material asked in bulk between two kernels' work.

Light paths are: sky or sun to the sphere; sky or sun to the ground and from there to the sphere; each seen by the
camera, as is the ground itself. Light that has left the sphere is not followed, so the ground shows its shadow, not its
colour. Directions are drawn by the density of the material, so that a mirror is as free of noise as paper; only small
bright lights in a panorama are found by chance (the sun is a delta light, and has no noise).
"""

import operator
from collections.abc import Callable
from os import PathLike, fspath

import numpy as np
from numpy.typing import NDArray

from bvbedit.brdf.base import Brdf, check_brdf
from bvbedit.brdf.density import Density
from bvbedit.errors import BvbError
from bvbedit.render.named_scenes import scene_named, scene_with_environment
from bvbedit.render.scene import Scene

Picture = NDArray[np.float32]

MAX_SIDE = 8192
MAX_SPP = 65536
# Samples in flight, some 200 bytes each: the best of 2^14 to 2^18 for a Lambertian sphere.
WAVE = 1 << 15
# At most so many samples of one pixel in a wave, so that there are always a hundred pixels to share among threads.
SAMPLES_PER_WAVE = 256


def render(
    model: Brdf,
    scene: str | PathLike[str] | Scene = "sphere",
    *,
    width: int = 256,
    height: int = 256,
    spp: int = 64,
    seed: int = 0,
    density: Density | None = None,
    progress: Callable[[float], object] | None = None,
) -> Picture:
    """Return a picture (height, width, 3) of ``scene`` with its sphere made of ``model``: linear RGB radiance, float32.

    ``scene``: sphere, studio, furnace, the path of a lat-long ``.exr`` panorama, or a Scene. ``spp``: samples per
    pixel, best a power of two. ``seed``: 0 to 2^63 - 1. ``progress`` is called with the finished fraction. The random
    numbers depend on seed, pixel and sample alone, and one seed gives one picture bit for bit on any number of threads.
    ``density`` draws the directions of light, by default that of the model: with a common one, like that of what a
    model was fitted to, pictures of two materials differ only where the materials do.

    Raises BvbError for anything that is not a Brdf, or a Density, unknown scenes, sizes outside 1 to 8192, spp outside
    1 to 65536, and materials whose values are not finite.
    """
    check_brdf(model, "model")
    width, height = _integer(width, "width", 1, MAX_SIDE), _integer(height, "height", 1, MAX_SIDE)
    spp, seed = _integer(spp, "spp", 1, MAX_SPP), _integer(seed, "seed", 0, 2**63 - 1)
    stage = _scene(scene)
    if density is not None and not isinstance(density, Density):
        raise BvbError(f"density is {type(density).__name__}. Give that of a Brdf, like model.density.")

    from bvbedit.render.kernels import arrive, see

    camera = _camera_rays(stage, width / height)
    sphere = (*stage.sphere.centre, stage.sphere.radius)
    ground = np.array([] if stage.ground is None else [stage.ground.height, *stage.ground.albedo])
    sun = np.array([] if stage.sun is None else [*stage.sun.direction, *stage.sun.irradiance])
    texels = np.ascontiguousarray(stage.environment.texels()).view()
    texels.flags.writeable = False  # always: to numba a writable array is another type, and another compilation

    samples = min(spp, SAMPLES_PER_WAVE)
    wave = max(1, min(WAVE // samples, width * height))
    slots = wave * samples
    normal, wo, to_sun = (np.empty((slots, 3)) for _ in range(3))
    seen, sunlit = np.empty(slots, dtype=bool), np.empty(slots, dtype=bool)
    numbers, direct = np.empty((slots, 2)), np.empty((wave, 3))
    chosen = model.density if density is None else density
    key = np.uint64(seed)

    picture = np.empty((height * width, 3), dtype=np.float32)
    for first in range(0, len(picture), wave):
        n = min(wave, len(picture) - first)
        total = np.zeros((n, 3))
        for first_sample in range(0, spp, samples):
            s = min(samples, spp - first_sample)
            shaped = [a[: n * s].reshape(n, s, *a.shape[1:]) for a in (seen, normal, wo, numbers, sunlit, to_sun)]
            see(first, first_sample, (height, width), key, camera, sphere, ground, sun, texels, direct[:n], *shaped)
            total += direct[:n]
            asked = np.flatnonzero(seen[: n * s])
            if len(asked):
                light = np.zeros((n * s, 3))
                wi, weight = _drawn(model, chosen, wo[asked], numbers[asked])
                radiance = np.empty_like(wi)
                arrive(first, first_sample, s, key, sphere, ground, sun, texels, asked, normal[asked], wi, radiance)
                light[asked] = weight * radiance
                lit = np.flatnonzero(sunlit[: n * s])
                if len(lit):
                    light[lit] += model.evaluate_unit(to_sun[lit], wo[lit])[0] * to_sun[lit, 2:] * sun[3:]
                total += light.reshape(n, s, 3).sum(axis=1)
            if progress is not None:
                progress((first * spp + n * (first_sample + s)) / (len(picture) * spp))
        with np.errstate(over="ignore"):
            picture[first : first + n] = total / spp
    if not np.isfinite(picture).all():
        raise BvbError("The material gives values that are not finite or too large for a float32 picture. Check it.")
    return picture.reshape(height, width, 3)


def _drawn(
    model: Brdf, density: Density, wo: NDArray[np.float64], numbers: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return directions (m, 3), and by what (m, 3) light from there is multiplied: f cos theta_i over their density."""
    wi, pdf = density.sample(wo, numbers)
    weight = np.zeros_like(wi)
    kept = np.flatnonzero(pdf > 0)
    weight[kept] = model.evaluate_unit(wi[kept], wo[kept])[0] * (wi[kept, 2] / pdf[kept])[:, None]
    return wi, weight


def _integer(value: int, name: str, lowest: int, highest: int) -> int:
    try:
        number = operator.index(value)
    except TypeError:
        raise BvbError(f"{name} is {value!r}. Give a whole number.") from None
    if not lowest <= number <= highest:
        raise BvbError(f"{name} is {number}. It must lie between {lowest} and {highest}.")
    return number


def _scene(scene: str | PathLike[str] | Scene) -> Scene:
    if isinstance(scene, Scene):
        return scene
    if not isinstance(scene, str | PathLike):
        raise BvbError(f"scene is {type(scene).__name__}. Give a name, the path of an .exr panorama, or a Scene.")
    name = fspath(scene)
    return scene_with_environment(name) if name.lower().endswith(".exr") else scene_named(name)


def _camera_rays(scene: Scene, aspect: float) -> NDArray[np.float64]:
    """Return position, and right, up and forward scaled so that right and up reach the edges of the picture (4, 3)."""
    reach = np.tan(scene.camera.vertical_fov / 2)
    scale = np.array([reach * aspect, reach, 1.0])
    return np.vstack([scene.camera.position, scene.camera.frame() * scale[:, None]])
