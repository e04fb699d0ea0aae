"""Light that is looked for: one direction towards each lamp, and to the sky, for every surface point of a wave."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bvbedit.render import kernels
from bvbedit.render.rays import Floats, Places, hidden
from bvbedit.render.stage import Stage


@dataclass(frozen=True)
class Points:
    """Points (n,) on surfaces: which slot they serve, where they are, and their frames."""

    slots: Places
    position: Floats
    """(n, 3), above the surface."""
    normal: Floats
    """(n, 3), of the frame."""
    faces: Floats
    """(n, 3), of the surface itself."""
    wo: Floats
    """(n, 3), in the frame."""
    material: NDArray[np.int16]
    gathers: NDArray[np.bool_]
    """Whether light from other surfaces is followed to them."""


@dataclass(frozen=True)
class Found:
    """Light of one lamp at some of the points."""

    at: Places
    """(k,), the points."""
    wi: Floats
    """(k, 3), in the frame."""
    light: Floats
    """(k, 3): radiance times the cosine, or for lamps without size irradiance."""
    pdf: Floats | None
    """(k,): the density of the direction; None for lamps without size."""


def look_for_light(stage: Stage, cut: kernels.Cut, first_pair: int, points: Points) -> Iterator[Found]:
    """Yield what each lamp sends to ``points``; random numbers are the pairs from ``first_pair`` on."""
    n, pair = len(points.slots), first_pair
    frame = points.normal, points.faces

    def buffers() -> tuple[Floats, Floats, Floats, Floats]:
        return np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3)), np.empty(n)

    for sun in stage.suns:
        out = buffers()
        kernels.to_sun(sun, *frame, *out)
        yield _unhidden(stage, points, *out, None)
        pair += 1
    for lamp in stage.points:
        out = buffers()
        kernels.to_point(lamp, points.position, *frame, *out)
        yield _unhidden(stage, points, *out, None)
        pair += 1
    for rectangle, glow in zip(stage.rectangles, stage.glows, strict=True):
        out, pdf = buffers(), np.empty(n)
        kernels.to_rectangle(cut, points.slots, pair, rectangle, glow, points.position, *frame, *out, pdf)
        yield _unhidden(stage, points, *out, pdf)
        pair += 1
    if stage.sky is not None and stage.sky_sampled:
        numbers = np.empty((n, 2))
        kernels.numbers(cut, points.slots, pair, numbers)
        directions, radiance, pdf = stage.sky.draw(numbers)
        wi, distance = np.empty((n, 3)), np.empty(n)
        kernels.to_sky(*frame, directions, wi, radiance, distance)
        yield _unhidden(stage, points, directions, wi, radiance, distance, pdf)


def _unhidden(
    stage: Stage,
    points: Points,
    directions: Floats,
    wi: Floats,
    light: Floats,
    distance: Floats,
    pdf: Floats | None,
) -> Found:
    """Return the light that reaches the points: above the horizon, and not in shadow."""
    at = kernels.shining(light)
    if pdf is not None:
        at = at[pdf[at] > 0]
    at = at[~hidden(stage, points.position.take(at, axis=0), directions.take(at, axis=0), distance[at])]
    return Found(at, wi.take(at, axis=0), light.take(at, axis=0), None if pdf is None else pdf[at])
