"""Path tracing in passes: wave after wave of paths is traced and shaded, pass after pass adds samples to all pixels.

A pass is some samples of every pixel, so that there is a picture after each, and what passes differ by tells the noise.
The random numbers depend on seed, pixel and sample alone: one seed gives one picture bit for bit on any number of
threads, and pictures of two materials differ only where the materials do.
"""

import operator
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from os import PathLike
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bvbedit.brdf.base import Brdf, check_brdf
from bvbedit.brdf.density import Density
from bvbedit.errors import BvbError
from bvbedit.threads import in_turn

if TYPE_CHECKING:
    from bvbedit.render.scene import Scene
    from bvbedit.render.stage import Stage

Picture = NDArray[np.float32]

MAX_SIDE = 8192
MAX_SPP = 65536
# Paths in flight on each thread, some 500 bytes each: arrays that nearly fit into the caches.
WAVE = 1 << 13
# Samples of a pixel in one pass: first few, so that there soon is a picture.
PASSES = (1, 1, 2, 4, 8)
LARGEST_PASS = 16


@dataclass(frozen=True)
class Estimate:
    """A picture after some passes."""

    picture: Picture
    """(height, width, 3): linear RGB radiance."""
    noise: NDArray[np.float32]
    """(height, width): about the standard error of the mean over channels, by what passes differ; nan after one."""
    samples: int
    """Of each pixel."""

    @property
    def relative_noise(self) -> float:
        """The root mean square of the noise over the mean of the picture; infinite after one pass."""
        mean = float(np.mean(self.picture, dtype=np.float64))
        if not np.isfinite(self.noise).all():
            return np.inf
        return float(np.sqrt(np.mean(np.square(self.noise, dtype=np.float64)))) / mean if mean > 0 else 0.0


def render(
    model: Brdf | Sequence[Brdf],
    scene: "str | PathLike[str] | Scene" = "sphere",
    *,
    width: int = 256,
    height: int = 256,
    spp: int = 64,
    seed: int = 0,
    density: Density | Sequence[Density] | None = None,
    noise: float | None = None,
    time_limit: float | None = None,
    progress: Callable[[float], object] | None = None,
) -> Picture:
    """Return a picture (height, width, 3) of ``scene`` with ``model`` in it: linear RGB radiance, float32.

    ``model``: one, or several for a scene that asks for them by number. ``scene``: sphere, studio, furnace, the path of
    a ``.toml`` scene or of a lat-long ``.exr`` panorama, or a Scene. ``spp``: samples per pixel, best a power of two.
    ``seed``: 0 to 2^63 - 1. ``noise``: stop when the standard error, root mean square over pixels, is this share of
    the picture's mean; ``time_limit``: seconds after which no pass is begun. ``progress`` is called with the finished
    fraction. ``density`` (one for each model) draws the directions of light, by default that of the model: with a
    common one pictures of two materials differ only where the materials do.

    Raises BvbError for anything that is not a Brdf, or a Density, unknown scenes, fewer models than the scene asks for,
    sizes outside 1 to 8192, spp outside 1 to 65536, and materials whose values are not finite.
    """
    *_, last = render_passes(
        model,
        scene,
        width=width,
        height=height,
        spp=spp,
        seed=seed,
        density=density,
        noise=noise,
        time_limit=time_limit,
        progress=progress,
    )
    return last.picture


def render_passes(
    model: Brdf | Sequence[Brdf],
    scene: "str | PathLike[str] | Scene" = "sphere",
    *,
    width: int = 256,
    height: int = 256,
    spp: int = 64,
    seed: int = 0,
    density: Density | Sequence[Density] | None = None,
    noise: float | None = None,
    time_limit: float | None = None,
    progress: Callable[[float], object] | None = None,
) -> Iterator[Estimate]:
    """Return an iterator over the picture after every pass, with its noise; arguments as ``render`` has them."""
    width, height = checked_integer(width, "width", 1, MAX_SIDE), checked_integer(height, "height", 1, MAX_SIDE)
    spp, seed = checked_integer(spp, "spp", 1, MAX_SPP), checked_integer(seed, "seed", 0, 2**63 - 1)
    for name, value in (("noise", noise), ("time_limit", time_limit)):
        if value is not None and not (isinstance(value, float | int) and 0 < value < np.inf):
            raise BvbError(f"{name} is {value!r}. Give a number above zero.")
    models, densities = checked_models(model), checked_densities(density)
    # Here and not above, so that whoever renders nothing does not wait for numba and pydantic.
    from bvbedit.render.scene_file import scene_of
    from bvbedit.render.stage import make_stage

    stage = make_stage(scene_of(scene), models, densities)

    def estimates() -> Iterator[Estimate]:
        start = perf_counter()
        for estimate in _passes(stage, (height, width), spp, seed, progress):
            yield estimate
            if noise is not None and estimate.relative_noise <= noise:
                return
            if time_limit is not None and perf_counter() - start >= time_limit:
                return

    return estimates()


def waves_of(shape: tuple[int, int], samples: int) -> list[tuple[int, int]]:
    """Return the first pixel and the number of pixels of each wave of a pass."""
    pixels = shape[0] * shape[1]
    each = max(1, WAVE // samples)
    return [(first, min(each, pixels - first)) for first in range(0, pixels, each)]


def pass_sizes(spp: int) -> Iterator[tuple[int, int]]:
    """Yield the first sample and the number of samples of each pass."""
    done = 0
    for size in (*PASSES, *[LARGEST_PASS] * (spp // LARGEST_PASS + 1)):
        if done < spp:
            yield done, min(size, spp - done)
            done += size


def _passes(
    stage: "Stage", shape: tuple[int, int], spp: int, seed: int, progress: Callable[[float], object] | None
) -> Iterator[Estimate]:
    from bvbedit.render.shading import shade
    from bvbedit.render.trace import Level, trace

    def reflectance(level: Level, number: int, part: slice) -> NDArray[np.float64]:
        return stage.materials[number].evaluate_unit(level.wi[part], level.wo[part])[0]

    def render_wave(first_sample: int, samples: int, wave: tuple[int, int]) -> NDArray[np.float64]:
        first, count = wave
        cut = (first, first_sample, samples, np.uint64(seed))
        seen = shade(trace(stage, cut, count * samples, shape), reflectance)
        return np.asarray(seen.reshape(count, samples, 3).sum(axis=1))

    pixels = shape[0] * shape[1]
    total, squares = np.zeros((pixels, 3)), np.zeros(pixels)
    for n, (first_sample, samples) in enumerate(pass_sizes(spp)):
        waves = waves_of(shape, samples)
        work = partial(render_wave, first_sample, samples)
        for (first, count), seen in zip(waves, in_turn(work, waves), strict=True):
            total[first : first + count] += seen
            with np.errstate(over="ignore"):  # becomes infinite, which is refused below
                squares[first : first + count] += seen.mean(axis=1) ** 2 / samples
            if progress is not None:
                progress((first_sample * pixels + samples * (first + count)) / (spp * pixels))
        yield _estimate(total, squares, shape, first_sample + samples, n + 1)


def _estimate(
    total: NDArray[np.float64], squares: NDArray[np.float64], shape: tuple[int, int], samples: int, passes: int
) -> Estimate:
    picture = checked_picture(total / samples)
    # Passes of n_p samples and means m_p: the sum of n_p (m_p - m)^2 estimates (passes - 1) variances of a sample.
    with np.errstate(over="ignore", invalid="ignore"):
        spread = np.maximum(squares / samples - (total.mean(axis=1) / samples) ** 2, 0.0)
        noise = np.sqrt(spread / (passes - 1)) if passes > 1 else np.full(len(total), np.nan)
    return Estimate(picture.reshape(*shape, 3), noise.astype(np.float32).reshape(shape), samples)


def checked_picture(radiance: NDArray[np.float64]) -> Picture:
    """Return radiance as float32. Raises BvbError where it is not finite."""
    with np.errstate(over="ignore"):
        picture = radiance.astype(np.float32)
    if not np.isfinite(picture).all():
        raise BvbError("The material gives values that are not finite or too large for a float32 picture. Check it.")
    return picture


def checked_models(model: Brdf | Sequence[Brdf]) -> list[Brdf]:
    """Return the models as a list. Raises BvbError for what is no Brdf."""
    models = list(model) if isinstance(model, list | tuple) else [model]
    for one in models:
        check_brdf(one, "model")
    return models  # type: ignore[return-value]


def checked_densities(density: Density | Sequence[Density] | None) -> list[Density] | None:
    """Return the densities as a list. Raises BvbError for what is none."""
    if density is None:
        return None
    densities = list(density) if isinstance(density, list | tuple) else [density]
    for one in densities:
        if not isinstance(one, Density):
            raise BvbError(f"density is {type(one).__name__}. Give that of a Brdf, like model.density.")
    return densities  # type: ignore[return-value]


def checked_integer(value: int, name: str, lowest: int, highest: int) -> int:
    """Return a whole number. Raises BvbError, which calls it ``name``, for what is none or out of bounds."""
    try:
        number = operator.index(value)
    except TypeError:
        raise BvbError(f"{name} is {value!r}. Give a whole number.") from None
    if not lowest <= number <= highest:
        raise BvbError(f"{name} is {number}. It must lie between {lowest} and {highest}.")
    return number
