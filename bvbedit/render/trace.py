"""The wavefront: a wave of paths is sent through the scene, and what it will ask of the materials is written down.

Nothing here evaluates a material. Directions are drawn by the materials' densities, lights are sampled, and both are
weighted by the balance heuristic (Veach & Guibas 1995), so that what a wave leaves behind is a list of look-ups: pairs
of directions and the light that arrives along them. The same look-ups serve any material.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bvbedit.brdf.density import Density
from bvbedit.render import kernels, lamp_kernels
from bvbedit.render.arrays import Draws, Lit, Normals, Rays, Vertices
from bvbedit.render.stage import Stage

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Places = NDArray[np.intp]
# The vertices of each material: its number, and which they are.
Groups = tuple[tuple[int, slice], ...]

# How direct light is found: by the material's density, by sampling lights, or by both, each where it is better. A lamp
# without size is always sampled.
Strategy = Literal["both", "density", "lights"]
COUNTED = {"both": kernels.BALANCED, "density": kernels.ALL, "lights": kernels.ONLY_UNSAMPLED}


@dataclass(frozen=True)
class Level:
    """What is asked of the materials where paths meet their n-th surface; paths and look-ups are sorted by material."""

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
    groups: Groups
    """For each material its number and its look-ups."""


@dataclass(frozen=True)
class Wave:
    """The paths of one wave."""

    background: Floats
    """(m, 3): what the slots see without any material."""
    levels: tuple[Level, ...]


def trace(stage: Stage, cut: kernels.Cut, slots: int, shape: tuple[int, int], strategy: Strategy = "both") -> Wave:
    """Return the wave of so many ``slots`` of a picture of ``shape`` (h, w)."""
    draws = Draws(np.empty(slots, np.uint64), np.empty(slots, np.intp))
    rays = Rays(np.empty((slots, 3)), np.empty((slots, 3)), np.empty(slots), np.empty(slots, np.intp))
    kernels.camera_rays(cut, shape, stage.camera_array, *stage.shapes, *draws, *rays)
    everywhere = np.ones(slots, dtype=bool)
    normals = _meshes_met(stage, rays, everywhere)
    background = kernels.background(*rays[1:], *stage.glow, stage.sky_scale, stage.first_lamp)
    vertices, groups = _met(stage, rays, np.arange(slots), _on_surface(stage, rays), normals)
    levels = []
    for depth in range(stage.depth):
        if len(vertices.slots):
            level, vertices, groups = _level(stage, draws, depth, strategy, vertices, groups)
            levels.append(level)
    return Wave(background, tuple(levels))


def _level(
    stage: Stage, draws: Draws, depth: int, strategy: Strategy, vertices: Vertices, groups: Groups
) -> tuple[Level, Vertices, Groups]:
    """Return what is asked at ``vertices``, and the vertices where paths go on from there."""
    first_pair = 1 + depth * (1 + stage.lights)
    numbers = kernels.numbers(*draws, vertices.slots, first_pair)
    drawn = [stage.densities[m].sample(vertices.wo[part], numbers[part]) for m, part in groups]
    wi, pdf = (np.concatenate(parts) if len(parts) > 1 else parts[0] for parts in zip(*drawn, strict=True))
    frame = vertices.position, vertices.normal, vertices.faces
    rays = Rays(vertices.position, *kernels.onwards(*frame, wi, pdf, *stage.shapes))
    normals = _meshes_met(stage, rays, pdf > 0)
    goes_on = _on_surface(stage, rays) & vertices.gathers & (pdf > 0) & (depth + 1 < stage.depth)

    lit = _lit(stage, draws, first_pair + 1, strategy, vertices, groups)
    shines = stage.sky_scale, stage.first_lamp, COUNTED[strategy]
    at, asked_wi, asked_wo, light, number = kernels.look_ups(
        vertices.wo, wi, pdf, goes_on, lit.wi, lit.light, *rays[1:], *stage.glow, *shines
    )
    deeper, deeper_groups = _met(stage, rays, vertices.slots, goes_on, normals)
    share = wi[deeper.parents, 2] / pdf[deeper.parents]
    edges = np.searchsorted(at, [part.start for _, part in groups]).tolist()
    look_ups_of = [slice(a, b) for a, b in zip(edges, [*edges[1:], len(at)], strict=True)]
    numbered = tuple((m, part) for (m, _), part in zip(groups, look_ups_of, strict=True))
    asked = asked_wi, asked_wo, light
    return Level(vertices.parents, at, *asked, number[deeper.parents], share, numbered), deeper, deeper_groups


def _lit(stage: Stage, draws: Draws, first_pair: int, strategy: Strategy, vertices: Vertices, groups: Groups) -> Lit:
    """Return what the lamps send to the vertices, over the density with which their directions are found."""
    at = vertices.slots, vertices.position, vertices.normal, vertices.faces
    sized = strategy != "density"
    lit = Lit(
        *lamp_kernels.light_of_lamps(*at, *draws, *stage.lamps, *stage.shapes, first_pair, stage.sky_scale, sized)
    )
    if stage.meshes is not None:
        n, j = np.nonzero(lit.light.any(axis=2))
        hidden = stage.meshes.blocked(vertices.position[n], lit.directions[n, j], lit.distance[n, j])
        lit.light[n[hidden], j[hidden]] = 0.0
    sizeless = len(stage.suns) + len(stage.points)
    if stage.lights > sizeless:
        if strategy == "both":
            for m, part in groups:
                density: Density = stage.densities[m]
                n, j = np.nonzero(lit.light[part, sizeless:].any(axis=2))
                n, j = n + part.start, j + sizeless
                lit.pdf[n, j] += density.pdf(lit.wi[n, j], vertices.wo[n])
        lit.light[:, sizeless:] /= np.maximum(lit.pdf[:, sizeless:, None], np.finfo(float).tiny)
    return lit


def _on_surface(stage: Stage, rays: Rays) -> Bools:
    """Return which rays (n,) end on a surface that has a material."""
    # The number of what is not met is the last one, and is not looked at.
    return np.asarray((rays.which >= 0) & (stage.material_of[rays.which] >= 0))


def _meshes_met(stage: Stage, rays: Rays, sent: Bools) -> Normals:
    """Let those of the ``rays`` that are ``sent`` (n,) end at meshes, and return the normals where they do."""
    if stage.meshes is None:
        return Normals(np.empty((0, 3)), np.empty((0, 3)))
    rows = np.flatnonzero(sent)
    t, mesh, faces, shading = stage.meshes.nearest(rays.origins[rows], rays.directions[rows])
    closer = t < rays.distance[rows]
    met, out = rows[closer], Normals(np.empty((len(sent), 3)), np.empty((len(sent), 3)))
    rays.distance[met], rays.which[met] = t[closer], len(stage.material_of) - stage.meshes.count + mesh[closer]
    out.faces[met], out.shading[met] = faces[closer], shading[closer]
    return out


def _met(stage: Stage, rays: Rays, slots: Places, wanted: Bools, normals: Normals) -> tuple[Vertices, Groups]:
    """Return the vertices where those rays end that are ``wanted`` (n,), and those of each material."""
    materials = len(stage.materials)
    ends = *rays, slots, wanted, *normals, stage.spheres, stage.planes
    *found, starts = kernels.meet(*ends, stage.material_of, stage.gathers, materials, stage.lift)
    parts = [slice(int(a), int(b)) for a, b in pairwise(starts)]
    return Vertices(*found), tuple((m, part) for m, part in enumerate(parts) if part.start < part.stop)
