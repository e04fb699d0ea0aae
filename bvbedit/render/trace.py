"""The wavefront: a wave of paths is sent through the scene, and what it will ask of the materials is written down.

Nothing here evaluates a material. Directions are drawn by the materials' densities, lights are sampled, and both are
weighted by the balance heuristic (Veach & Guibas 1995), so that what a wave leaves behind is a list of look-ups: pairs
of directions and the light that arrives along them. The same look-ups serve any material.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bvbedit.brdf.density import Density
from bvbedit.render import kernels
from bvbedit.render.light_sampling import Found, Points, look_for_light
from bvbedit.render.rays import Ends, Floats, Places, arriving, follow, on_surface
from bvbedit.render.stage import Stage

# How direct light is found: by the material's density, by sampling lights, or by both, each where it is better. A lamp
# without size is always sampled.
Strategy = Literal["both", "density", "lights"]


@dataclass(frozen=True)
class Level:
    """What is asked of the materials where paths meet their n-th surface; look-ups are sorted by material."""

    parents: Places
    """(n,): the path of the level before, or at the first surface the slot, that led here."""
    at: Places
    """(k,): the path of each look-up."""
    wi: Floats
    """(k, 3), in the frame of the surface."""
    wo: Floats
    """(k, 3)."""
    light: Floats
    """(k, 3): what arrives of radiance, times the cosine, over the density; but for what deeper surfaces send."""
    followed: Places
    """(c,): the look-ups that lead to deeper surfaces, in the order of the paths there."""
    share: Floats
    """(c,): by what the radiance of these is multiplied."""
    groups: tuple[tuple[int, slice], ...]
    """For each material its number and its look-ups."""


@dataclass(frozen=True)
class Wave:
    """The paths of one wave."""

    background: Floats
    """(m, 3): what the slots see without any material."""
    levels: tuple[Level, ...]


@dataclass(frozen=True)
class _Rays:
    """Rays (n, 3), (n, 3) that end on surfaces, the slots (n,) that they serve, and what they started from (n,)."""

    parents: Places
    slots: Places
    origins: Floats
    directions: Floats
    ends: Ends


def trace(stage: Stage, cut: kernels.Cut, slots: int, shape: tuple[int, int], strategy: Strategy = "both") -> Wave:
    """Return the wave of so many ``slots`` of a picture of ``shape`` (h, w)."""
    origins, directions = np.empty((slots, 3)), np.empty((slots, 3))
    kernels.camera_rays(cut, shape, stage.camera_array, origins, directions)
    ends = follow(stage, origins, directions)
    background, _ = arriving(stage, directions, ends)
    met = np.flatnonzero(on_surface(stage, ends))
    rays = _Rays(met, met, origins.take(met, axis=0), directions.take(met, axis=0), ends.taken(met))
    levels = []
    for depth in range(stage.depth):
        if len(rays.slots):
            level, rays = _level(stage, cut, depth, strategy, rays)
            levels.append(level)
    return Wave(background, tuple(levels))


def _level(stage: Stage, cut: kernels.Cut, depth: int, strategy: Strategy, rays: _Rays) -> tuple[Level, _Rays]:
    """Return what is asked where ``rays`` end, and the rays that go on from there to other surfaces."""
    points = _points(stage, rays)
    first_pair = 1 + depth * (1 + stage.lights)

    # The directions that the materials' densities draw, and what shines there.
    numbers = np.empty((len(points.slots), 2))
    kernels.numbers(cut, points.slots, first_pair, numbers)
    wi, pdf = _drawn(stage, points, numbers)
    directions = np.empty_like(wi)
    kernels.onwards(points.normal, points.faces, wi, pdf, directions)
    at = np.flatnonzero(pdf > 0)
    origins, directions = points.position.take(at, axis=0), directions.take(at, axis=0)
    ends = follow(stage, origins, directions)
    radiance, light_pdf = arriving(stage, directions, ends)
    if strategy == "both":
        radiance *= (pdf[at] / (pdf[at] + light_pdf))[:, None]
    elif strategy == "lights":
        radiance[light_pdf > 0] = 0.0
    goes_on = on_surface(stage, ends) & points.gathers[at] & (depth + 1 < stage.depth)
    useful = goes_on.copy()
    useful[kernels.shining(radiance)] = True
    used = np.flatnonzero(useful)
    drawn = wi.take(at[used], axis=0)
    share = drawn[:, 2] / pdf[at[used]]
    followed = np.flatnonzero(goes_on[used])
    found = [(at[used], drawn, radiance.take(used, axis=0) * share[:, None])]

    # The directions of the lights.
    for lit in look_for_light(stage, cut, first_pair + 1, points):
        if lit.pdf is None:
            found.append((lit.at, lit.wi, lit.light))
        elif strategy != "density":
            density = lit.pdf + (_pdf(stage, points, lit) if strategy == "both" else 0.0)
            found.append((lit.at, lit.wi, lit.light / density[:, None]))

    level = _sorted(points, rays.parents, found, followed, share[followed])
    on = used[followed]
    onward = origins.take(on, axis=0), directions.take(on, axis=0), ends.taken(on)
    return level, _Rays(at[on], points.slots[at[on]], *onward)


def _points(stage: Stage, rays: _Rays) -> Points:
    position, wo, ends = np.empty_like(rays.origins), np.empty_like(rays.origins), rays.ends
    kernels.surfaces(
        rays.origins,
        rays.directions,
        ends.distance,
        ends.which,
        stage.spheres,
        stage.planes,
        stage.lift,
        ends.faces,
        ends.normal,
        position,
        wo,
    )
    return Points(
        rays.slots, position, ends.normal, ends.faces, wo, stage.material_of[ends.which], stage.gathers[ends.which]
    )


def _drawn(stage: Stage, points: Points, numbers: Floats) -> tuple[Floats, Floats]:
    """Return directions (n, 3) in the frame, drawn by the densities of the materials, and these (n,)."""
    present = _present(points.material)
    if len(present) == 1:
        only: Density = stage.densities[present[0]]
        return only.sample(points.wo, numbers)
    wi, pdf = np.empty_like(points.wo), np.empty(len(points.wo))
    for m in present:
        rows = np.flatnonzero(points.material == m)
        wi[rows], pdf[rows] = stage.densities[m].sample(points.wo.take(rows, axis=0), numbers.take(rows, axis=0))
    return wi, pdf


def _pdf(stage: Stage, points: Points, lit: Found) -> Floats:
    """Return with what density (k,) the materials would have drawn the directions of a light."""
    material, wo = points.material[lit.at], points.wo.take(lit.at, axis=0)
    out = np.empty(len(lit.at))
    for m in _present(material):
        rows = np.flatnonzero(material == m)
        out[rows] = stage.densities[m].pdf(lit.wi[rows], wo[rows])
    return out


def _sorted(
    points: Points, parents: Places, found: list[tuple[Places, Floats, Floats]], followed: Places, share: Floats
) -> Level:
    """Return a level of the look-ups ``found``, of which the first may be ``followed``, sorted by material."""
    at, wi, light = (np.concatenate(parts) for parts in zip(*found, strict=True))
    material = points.material[at]
    present = _present(material)
    if len(present) > 1:
        order = np.argsort(material, kind="stable")
        at, material = at[order], material[order]
        wi, light = wi.take(order, axis=0), light.take(order, axis=0)
        places = np.empty_like(order)
        places[order] = np.arange(len(order))
        followed = places[followed]
    edges = [*np.searchsorted(material, present), len(material)]
    groups = tuple((int(m), slice(int(a), int(b))) for m, a, b in zip(present, edges[:-1], edges[1:], strict=True))
    return Level(parents, at, wi, points.wo.take(at, axis=0), light, followed, share, groups)


def _present(material: NDArray[np.int16]) -> Places:
    """Return the numbers of the materials, in order."""
    return np.flatnonzero(np.bincount(material))
