"""What rays find on a stage: surfaces, lamps, the sky."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bvbedit.render import geometry, kernels
from bvbedit.render.stage import Stage

Floats = NDArray[np.float64]
Places = NDArray[np.intp]


@dataclass(frozen=True)
class Ends:
    """Where rays end: the distance (n,), inf for nowhere; what is there (n,); the normals (n, 3) of meshes."""

    distance: Floats
    which: Places
    faces: Floats
    normal: Floats

    def taken(self, rows: Places) -> "Ends":
        """Return some of them."""
        faces, normal = self.faces.take(rows, axis=0), self.normal.take(rows, axis=0)
        return Ends(self.distance[rows], self.which[rows], faces, normal)


def follow(stage: Stage, origins: Floats, directions: Floats) -> Ends:
    """Return where rays from ``origins`` (n, 3) along unit ``directions`` (n, 3) end."""
    n = len(origins)
    distance, which = np.empty(n), np.empty(n, dtype=np.intp)
    geometry.nearest(origins, directions, stage.spheres, stage.planes, stage.rectangles, distance, which)
    if stage.meshes is None or n == 0:
        return Ends(distance, which, np.empty((n, 3)), np.empty((n, 3)))
    t, mesh, faces, normal = stage.meshes.nearest(origins, directions)
    closer = t < distance
    before = len(stage.material_of) - stage.meshes.count
    return Ends(np.where(closer, t, distance), np.where(closer, before + mesh, which), faces, normal)


def on_surface(stage: Stage, ends: Ends) -> NDArray[np.bool_]:
    """Return which rays (n,) end on a surface that has a material."""
    # The number of what is not met is the last one, and is not looked at.
    return np.asarray((ends.which >= 0) & (stage.material_of[ends.which] >= 0))


def arriving(stage: Stage, directions: Floats, ends: Ends) -> tuple[Floats, Floats]:
    """Return the radiance (n, 3) of what shines at the end of rays, and with what density it is sampled (n,), or 0."""
    radiance, pdf = np.zeros((len(directions), 3)), np.zeros(len(directions))
    if stage.sky is not None:
        rows = np.flatnonzero(ends.which < 0)
        if stage.sky_sampled:
            radiance[rows], pdf[rows] = stage.sky.arriving(directions.take(rows, axis=0))
        else:
            radiance[rows] = stage.sky.radiance(directions.take(rows, axis=0))
    if len(stage.rectangles):
        first = len(stage.spheres) + len(stage.planes)
        rows = np.flatnonzero((ends.which >= first) & (ends.which < first + len(stage.rectangles)))
        glow, density = np.empty((len(rows), 3)), np.empty(len(rows))
        lamps = ends.which[rows] - first
        kernels.glowing(directions[rows], ends.distance[rows], lamps, stage.rectangles, stage.glows, glow, density)
        radiance[rows], pdf[rows] = glow, density
    return radiance, pdf


def hidden(stage: Stage, origins: Floats, directions: Floats, limit: Floats) -> NDArray[np.bool_]:
    """Return which rays (n,) meet anything before ``limit`` (n,)."""
    out = np.empty(len(origins), dtype=bool)
    geometry.blocked(origins, directions, limit, stage.spheres, stage.planes, stage.rectangles, out)
    if stage.meshes is not None:
        rows = np.flatnonzero(~out)
        out[rows] = stage.meshes.blocked(origins[rows], directions[rows], limit[rows] * (1 - geometry.BEFORE_LAMP))
    return out
