"""From the look-ups of a wave to what its slots see: the one place where materials are evaluated."""

from collections.abc import Callable, Iterator

import numpy as np

from bvbedit.render import kernels
from bvbedit.render.trace import Floats, Level, Wave

# What a material, by its number, reflects (k, 3) along the look-ups of one level.
Reflectance = Callable[[Level, int, slice], Floats]


def shade(wave: Wave, reflectance: Reflectance) -> Floats:
    """Return the radiance (m, 3) that each slot of a wave sees."""
    if not wave.levels:
        return wave.background
    *_, (_, _, _, leaving) = levels_lit(wave, reflectance)
    seen = wave.background.copy()
    seen[wave.levels[0].parents] += leaving
    return seen


def levels_lit(wave: Wave, reflectance: Reflectance) -> Iterator[tuple[Level, Floats, Floats, Floats]]:
    """Yield the levels of a wave, the deepest first, each with what arrives (k, 3), f (k, 3), what leaves (n, 3)."""
    leaving: Floats | None = None
    for level in reversed(wave.levels):
        light = level.light
        if leaving is not None:
            light = light.copy()
            light[level.followed] += leaving * level.share[:, None]
        f = np.empty_like(light)
        for number, part in level.groups:
            f[part] = reflectance(level, number, part)
        leaving = np.zeros((len(level.parents), 3))
        kernels.collect(level.at, f, light, leaving)
        yield level, light, f, leaving
