"""A scene traced once, so that after an edit only the material is evaluated again."""

from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.density import Density
from bvbedit.errors import BvbError
from bvbedit.render.integrator import (
    MAX_SIDE,
    MAX_SPP,
    Picture,
    checked_densities,
    checked_integer,
    checked_models,
    checked_picture,
    waves_of,
)
from bvbedit.render.scene import Scene
from bvbedit.render.scene_file import scene_of
from bvbedit.render.shading import Reflectance, levels_lit, shade
from bvbedit.render.stage import make_stage
from bvbedit.render.trace import Level, Wave, trace
from bvbedit.threads import in_turn

# Paths that are kept, each some 500 bytes.
MOST_PATHS = 1 << 24


@dataclass(frozen=True)
class LookUps:
    """What a picture asks of its models."""

    wi: NDArray[np.float64]
    """(n, 3), in the frame of the surface."""
    wo: NDArray[np.float64]
    """(n, 3)."""
    light: NDArray[np.float64]
    """(n, 3): by how much the radiance of the pixel grows with f, in first order."""
    pixel: NDArray[np.intp]
    """(n,): row by row."""


class PreparedScene:
    """Camera rays, hits, light and random numbers of a scene, for one picture size, without its models.

    ``shade`` shows other models in it, with the same random numbers: two pictures differ only where the models do.
    Directions are drawn by ``density`` (one for each model), by default those of ``model``. Arguments and errors are
    those of ``render``; width x height x spp is at most 16,777,216.

    >>> from bvbedit.brdf.analytic import Lambert
    >>> prepared = PreparedScene(Lambert(0.5), "furnace", width=8, height=8, spp=2)
    >>> float(prepared.shade(Lambert(0.25))[4, 4, 0])
    0.25
    """

    def __init__(
        self,
        model: Brdf | Sequence[Brdf],
        scene: str | PathLike[str] | Scene = "sphere",
        *,
        width: int = 256,
        height: int = 256,
        spp: int = 4,
        seed: int = 0,
        density: Density | Sequence[Density] | None = None,
    ) -> None:
        width, height = checked_integer(width, "width", 1, MAX_SIDE), checked_integer(height, "height", 1, MAX_SIDE)
        spp, seed = checked_integer(spp, "spp", 1, MAX_SPP), checked_integer(seed, "seed", 0, 2**63 - 1)
        if width * height * spp > MOST_PATHS:
            raise BvbError(
                f"{width} x {height} pixels of {spp} samples are more than {MOST_PATHS:,} paths. Keep fewer."
            )
        self._models = len(checked_models(model))
        self._stage = make_stage(scene_of(scene), checked_models(model), checked_densities(density))
        self.shape, self.spp = (height, width), spp

        def traced(wave: tuple[int, int]) -> Wave:
            first, pixels = wave
            return trace(self._stage, (first, 0, spp, np.uint64(seed)), pixels * spp, self.shape)

        self._waves = list(in_turn(traced, waves_of(self.shape, spp)))
        # What the scene itself is made of does not change.
        self._known = {
            (id(level), number): _asked(self._stage.materials[number], level, part)
            for wave in self._waves
            for level in wave.levels
            for number, part in level.groups
            if self._stage.models[number] is None
        }

    def look_ups(self, model: Brdf | Sequence[Brdf]) -> "LookUps":
        """Return what the picture asks of the models, light as it arrives with these."""
        reflectance = self._reflectance(checked_models(model))
        found: list[tuple[NDArray[Any], ...]] = []
        first = 0
        for wave in self._waves:
            # Of the paths of a level: what their radiance counts in the pixel, and which it is.
            share, pixel = np.empty((0, 3)), np.empty(0, dtype=np.intp)
            for depth, (level, light, f, _) in enumerate(reversed(list(levels_lit(wave, reflectance)))):
                if depth == 0:
                    pixel = level.parents // self.spp
                    share = np.full((len(pixel), 3), 1 / self.spp)
                for number, part in level.groups:
                    if self._stage.models[number] is not None:
                        at = level.at[part]
                        found.append((level.wi[part], level.wo[part], light[part] * share[at], first + pixel[at]))
                followed = level.followed
                share = share[level.at[followed]] * f[followed] * level.share[:, None]
                pixel = pixel[level.at[followed]]
            first += len(wave.background) // self.spp
        if not found:
            return LookUps(np.empty((0, 3)), np.empty((0, 3)), np.empty((0, 3)), np.empty(0, dtype=np.intp))
        return LookUps(*(np.concatenate(parts) for parts in zip(*found, strict=True)))

    def shade(self, model: Brdf | Sequence[Brdf]) -> Picture:
        """Return the picture (height, width, 3) with other models: linear RGB radiance, float32.

        Raises BvbError for other than as many models as before, and for materials whose values are not finite.
        """
        models = checked_models(model)
        if len(models) != self._models:
            raise BvbError(f"{len(models)} models given, {self._models} prepared for. Give as many.")
        reflectance = self._reflectance(models)

        def seen(wave: Wave) -> NDArray[np.float64]:
            return np.asarray(shade(wave, reflectance).reshape(-1, self.spp, 3).mean(axis=1))

        return checked_picture(np.concatenate(list(in_turn(seen, self._waves)))).reshape(*self.shape, 3)

    def _reflectance(self, models: Sequence[Brdf]) -> Reflectance:
        stage = self._stage.with_models(models)

        def reflectance(level: Level, number: int, part: slice) -> NDArray[np.float64]:
            known = self._known.get((id(level), number))
            return _asked(stage.materials[number], level, part) if known is None else known

        return reflectance


def _asked(material: Brdf, level: Level, part: slice) -> NDArray[np.float64]:
    return material.evaluate_unit(level.wi[part], level.wo[part])[0]
