"""Where rays meet meshes: a thin layer over Embree, on all threads.

Embree computes in float32; what it finds is completed here in float64.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from bvbedit.errors import BvbError
from bvbedit.jit import frozen, kernel
from bvbedit.render.meshes import Mesh
from bvbedit.threads import each_block

Floats = NDArray[np.float64]
Array = NDArray[Any]

# How far rays must start from a surface not to meet it again, in parts of the largest coordinate of meshes and origins,
# counted from the centre of the meshes: 32 roundings to float32. Measured: 4 are enough.
CLEARANCE = 2.0**-19
# Numbers of a ray, which divide the work into blocks of 4096 rays, a millisecond each.
ROWS = 8
# So many rays are sooner traced than threads are started.
FEW = 4096
# A distance in float64 replaces Embree's if it differs by at most this part (or the clearance), as it does where the
# ray is not grazing.
GRAZING = 1e-4


class Tracer:
    """Finds where rays meet ``meshes``, both sides of their triangles. Raises BvbError where there are none.

    Rays meet what is at any distance above zero, so a ray that starts on a surface may meet it there. Start it further
    away, along the geometric normal, by CLEARANCE times the largest coordinate of meshes and origins, counted from the
    centre of the meshes. Closed meshes are tight along their edges, but a few of the rays aimed exactly at a vertex may
    pass through. Rays with nan meet nothing.
    """

    def __init__(self, meshes: Sequence[Mesh]) -> None:
        if not meshes:
            raise BvbError("There are no meshes to trace. Give at least one.")
        self.count = len(meshes)
        """How many meshes there are."""
        before = np.cumsum([0, *(len(m.vertices) for m in meshes)])
        vertices = np.concatenate([m.vertices for m in meshes])
        triangles = np.concatenate([m.triangles + n for m, n in zip(meshes, before[:-1], strict=True)])
        # A normal of zero stands for none: the geometric one is taken.
        normals = [np.zeros_like(m.vertices) if m.normals is None else m.normals for m in meshes]
        owner = np.repeat(np.arange(len(meshes)), [len(m.triangles) for m in meshes])
        faces = np.concatenate([m.face_normals() for m in meshes])
        self._tables: tuple[Array, Array, Array, Array, Array] = (
            frozen(vertices),
            frozen(triangles),
            frozen(np.concatenate(normals)),
            frozen(faces),
            frozen(owner),
        )
        # About their centre, meshes far from the origin lose no digits.
        self._centre = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
        self._slack = CLEARANCE * float(np.abs(vertices - self._centre).max())
        # Without it, a hundred times as many rays pass through vertices, and others through edges.
        self._scene = EmbreeScene(robust=True)
        TriangleMesh(self._scene, _float32(vertices - self._centre), triangles.astype(np.int32))
        # The first run builds the tree, which must not happen in two threads at once.
        nothing = np.empty((0, 3), dtype=np.float32)
        self._scene.run(nothing, nothing)

    def nearest(self, origins: Floats, directions: Floats) -> tuple[Floats, NDArray[np.intp], Floats, Floats]:
        """Return where rays from ``origins`` (n, 3) along ``directions`` (n, 3) first meet a mesh.

        That is the distance (n,) in lengths of the direction, the number (n,) of the mesh, its geometric unit normal
        (n, 3), to the outside as the triangle's corners tell, and its unit normal for shading (n, 3), interpolated from
        those of the vertices, on the same side. Where nothing is met: inf, -1, and zeros.
        """
        origins, directions = _rays(origins, directions)
        n = len(origins)
        distance, mesh = np.empty(n), np.empty(n, dtype=np.intp)
        geometric, shading = np.empty((n, 3)), np.empty((n, 3))

        def work(rows: slice) -> None:
            found = self._scene.run(
                _float32(origins[rows] - self._centre), _float32(directions[rows]), dists=np.inf, output=1
            )
            hit, u, v, t = (found[name] for name in ("primID", "u", "v", "tfar"))
            out = (distance[rows], mesh[rows], geometric[rows], shading[rows])
            _complete(origins[rows], directions[rows], hit, u, v, t, self._slack, *self._tables, *out)

        _spread(n, work)
        return distance, mesh, geometric, shading

    def blocked(self, origins: Floats, directions: Floats, distance: Floats) -> NDArray[np.bool_]:
        """Return which rays (n,) meet a mesh before ``distance`` (n,), in lengths of the direction; inf is allowed.

        What lies at the distance itself, to some 1e-6 of it, may or may not block.
        """
        origins, directions = _rays(origins, directions)
        distance = np.asarray(distance, dtype=np.float64)
        if distance.shape != (len(origins),):
            raise BvbError(f"Distances have shape {distance.shape} for {len(origins)} rays. Give one for each.")
        out = np.empty(len(origins), dtype=bool)

        def work(rows: slice) -> None:
            found = self._scene.run(
                _float32(origins[rows] - self._centre),
                _float32(directions[rows]),
                dists=_float32(distance[rows]),
                query="OCCLUDED",
            )
            # Where the distance is negative, embreex reports a hit whatever there is.
            np.logical_and(found >= 0, distance[rows] > 0, out=out[rows])

        _spread(len(origins), work)
        return out


@kernel
def _complete(
    origins: Array,
    directions: Array,
    hit: Array,
    u: Array,
    v: Array,
    t: Array,
    slack: float,
    vertices: Array,
    triangles: Array,
    normals: Array,
    faces: Array,
    owner: Array,
    distance: Array,
    mesh: Array,
    geometric: Array,
    shading: Array,
) -> None:
    """Write distance, mesh and normals where Embree has hit a triangle, at ``u`` and ``v`` in it; -1 is none."""
    for m in range(len(hit)):
        k = hit[m]
        if k < 0:
            distance[m], mesh[m] = math.inf, -1
            for c in range(3):
                geometric[m, c] = shading[m, c] = 0.0
            continue
        i0, i1, i2 = triangles[k, 0], triangles[k, 1], triangles[k, 2]
        gap = cosine = along = squares = 0.0
        for c in range(3):
            n = faces[k, c]
            gap += (vertices[i0, c] - origins[m, c]) * n
            cosine += directions[m, c] * n
            s = (1.0 - u[m] - v[m]) * normals[i0, c] + u[m] * normals[i1, c] + v[m] * normals[i2, c]
            geometric[m, c], shading[m, c] = n, s
            along += n * s
            squares += s * s
        # Along grazing rays the exact plane may be met outside the triangle; Embree's distance is as good there.
        exact = gap / cosine if cosine != 0.0 else math.inf
        distance[m] = exact if exact > 0.0 and abs(exact - t[m]) <= GRAZING * t[m] + slack else t[m]
        mesh[m] = owner[k]
        length = math.copysign(math.sqrt(squares), along)
        for c in range(3):
            shading[m, c] = shading[m, c] / length if squares > 1e-12 else geometric[m, c]


def _spread(count: int, work: Callable[[slice], None]) -> None:
    """Do ``work`` for slices of so many rays, on all threads if there are many: Embree lets others run meanwhile."""
    if count <= FEW:
        work(slice(0, count))
    else:
        each_block(count, ROWS, work)


def _rays(origins: Floats, directions: Floats) -> tuple[Floats, Floats]:
    origins, directions = (frozen(np.ascontiguousarray(a, dtype=np.float64)) for a in (origins, directions))
    if origins.shape != directions.shape or origins.shape[1:] != (3,):
        raise BvbError(f"Rays have origins {origins.shape} and directions {directions.shape}. Give (n, 3) of both.")
    return origins, directions


def _float32(array: Floats) -> NDArray[np.float32]:
    with np.errstate(over="ignore"):  # beyond float32 is as good as infinite
        return array.astype(np.float32)
