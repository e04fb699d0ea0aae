"""Surfaces made of triangles: from files, or one that is computed. Nothing here knows how rays meet them."""

import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bvbedit.errors import BvbError
from bvbedit.io.files import reading
from bvbedit.render.values import Vector, check_positive, set_fields, vector

Floats = NDArray[np.float64]
Triangles = NDArray[np.int32]

# Embree takes some 150 bytes for each triangle.
MOST = 1 << 24
# Rays are traced in float32: products of four lengths must neither overflow nor vanish.
LARGEST, SMALLEST = 1e9, 1e-9
# A triangle counts as a line where its height is so small a part of its longest edge: rounded numbers decide the rest.
FLAT = 1e-12
# PyVista takes these for pickled objects, which may run anything as they are read.
PICKLES = {".pkl", ".pickle"}
# The edges of an icosahedron are halved so many times: 20 * 4^5 triangles.
HALVINGS = 5
# Waves over the unit sphere that make the blob: wave vector, phase and amplitude of each, in parts of its radius.
WAVES = np.array(
    [
        [1.9, 0.7, -1.1, 0.4, 0.18],
        [-1.3, 2.6, 1.7, 2.1, 0.14],
        [3.1, -1.2, 3.4, 4.0, 0.12],
        [-4.3, -3.7, 2.2, 1.3, 0.07],
        [2.4, 5.6, 4.1, 5.2, 0.05],
        [6.8, -2.9, -5.3, 0.9, 0.02],
    ]
)
BLOB_HEIGHT = 2.0


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles by their corners, counter-clockwise seen from outside; copied, read-only.

    Triangles without area, and vertices that no triangle uses, are left out. Normals are made unit; those that are
    zero, nan or infinite are replaced by the mean of the faces around, by their area. Raises BvbError for wrong shapes,
    indices out of range, vertices that are not finite, no triangle with an area, more than 2^24 triangles or vertices,
    coordinates beyond 1e9, and a size below 1e-9.
    """

    vertices: Floats
    """(n, 3)."""
    triangles: Triangles
    """(m, 3): indices of vertices."""
    normals: Floats | None = None
    """(n, 3): of vertices, unit; None where faces are flat."""

    def __post_init__(self) -> None:
        vertices, triangles = _vertices(self.vertices), _triangles(self.triangles)
        if triangles.min() < 0 or triangles.max() >= len(vertices):
            wrong = triangles.min() if triangles.min() < 0 else triangles.max()
            raise BvbError(f"A mesh of {len(vertices)} vertices has a triangle with vertex {wrong}. Count from 0.")
        normals = None if self.normals is None else _array(self.normals, "normals")
        if normals is not None and normals.shape != vertices.shape:
            raise BvbError(f"Normals of shape {normals.shape} do not fit vertices {vertices.shape}. Give as many.")

        triangles = triangles[_with_area(vertices, triangles)]
        if len(triangles) == 0:
            raise BvbError("All triangles of the mesh have zero area. Give one with an area.")
        used = np.zeros(len(vertices), dtype=bool)
        used[triangles] = True
        if not used.all():
            triangles = (np.cumsum(used) - 1)[triangles]
            vertices, normals = vertices[used], None if normals is None else normals[used]
        size = np.ptp(vertices, axis=0).max()
        if size < SMALLEST:
            raise BvbError(f"The mesh is {size:.3g} large. Scale it up to at least {SMALLEST:g}.")

        if normals is not None:
            normals = _repaired(normals, vertices, triangles)
            normals.flags.writeable = False
        small = triangles.astype(np.int32)
        vertices.flags.writeable = small.flags.writeable = False
        set_fields(self, vertices=vertices, triangles=small, normals=normals)

    def moved(self, scale: float = 1.0, translation: Vector = (0.0, 0.0, 0.0)) -> "Mesh":
        """Return the mesh scaled about the origin, then moved. Raises BvbError for a scale that is not positive."""
        check_positive(scale, "mesh scale")
        with np.errstate(over="ignore"):  # becomes infinite, which is refused
            return Mesh(self.vertices * scale + vector(translation, "mesh translation"), self.triangles, self.normals)

    def bounds(self) -> Floats:
        """Return the lowest and the highest coordinates (2, 3)."""
        return np.stack([self.vertices.min(axis=0), self.vertices.max(axis=0)])

    def face_normals(self) -> Floats:
        """Return the unit normal (m, 3) of each triangle, to the side from which its corners run counter-clockwise."""
        return _unit(_areas(self.vertices, self.triangles))


def blob() -> Mesh:
    """Return a smooth closed body of 20,480 triangles with hills, hollows and grazing parts.

    It stands on z = 0, centred in x and y, with height 2. Its normals are those of the exact surface.
    """
    directions, triangles = _ball()
    phases = directions @ WAVES[:, :3].T + WAVES[:, 3]
    radius = 1 + np.sin(phases) @ WAVES[:, 4]
    slope = (np.cos(phases) * WAVES[:, 4]) @ WAVES[:, :3]
    # The surface |x| = radius(x / |x|): what the gradient of the radius has across the direction tilts the normal.
    across = slope - (slope * directions).sum(axis=1, keepdims=True) * directions
    normals = _unit(directions - across / radius[:, None])
    points = directions * radius[:, None]
    lowest, highest = points.min(axis=0), points.max(axis=0)
    scale = BLOB_HEIGHT / (highest[2] - lowest[2])
    middle = (lowest + highest) / 2
    return Mesh((points - [middle[0], middle[1], lowest[2]]) * scale, triangles, normals)


def read_mesh(path: str | os.PathLike[str]) -> Mesh:
    """Return the surface in a file that PyVista reads, by its ending: .obj, .ply, .stl, .vtk, .vtp, .glb, ...

    Faces are cut into triangles; of a solid the outside is taken. Normals are those of the file, else smooth with
    creases at edges of more than 45 degrees. Raises BvbError for what is missing, cannot be read, or has no surface.
    """
    with reading(path) as stream:
        if not stream.read(1):
            raise BvbError(f"{path} is empty. Name a file with a mesh.")
    if Path(path).suffix.lower() in PICKLES:
        raise BvbError(f"{path} is a pickle, which may run anything. Save the mesh as .ply or .vtp.")
    # In a process of its own: VTK crashes on some broken files, and tells of others on the standard streams.
    reader = Path(__file__).with_name("surface_file.py")
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "surface.npz"
        try:
            child = subprocess.run(
                [sys.executable, "-P", str(reader), os.fspath(path), str(out)],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                check=False,
            )
        except OSError as error:
            raise BvbError(f"{path}: no process could be started to read it ({error}). Free some memory.") from None
        if child.returncode != 0:
            raise BvbError(f"{path} cannot be read as a mesh. Save it anew as .ply, .obj, .stl or .vtp.")
        with np.load(out) as found:
            vertices, triangles, normals = found["vertices"], found["triangles"], found["normals"]
    if len(triangles) == 0:
        raise BvbError(f"{path} has no surface. Name a file with faces.")
    try:
        return Mesh(vertices, triangles, normals)
    except BvbError as error:
        raise BvbError(f"{path}: {error}") from None


def _array(value: ArrayLike, name: str) -> Floats:
    """Return a copy as float64 (n, 3)."""
    try:
        out = np.array(value, dtype=np.float64, order="C")
    except (TypeError, ValueError):
        raise BvbError(f"The mesh's {name} are not numbers. Give (n, 3) of them.") from None
    if out.ndim != 2 or out.shape[1] != 3 or len(out) == 0:
        raise BvbError(f"The mesh's {name} have shape {out.shape}. Give (n, 3).")
    if len(out) > MOST:
        raise BvbError(f"The mesh has {len(out):,} {name}. Simplify it to at most {MOST:,}.")
    return out


def _vertices(value: ArrayLike) -> Floats:
    vertices = _array(value, "vertices")
    if not np.isfinite(vertices).all():
        raise BvbError("The mesh has vertices that are nan or infinite. Clean it first.")
    if np.abs(vertices).max() > LARGEST:
        raise BvbError(f"The mesh has a coordinate of {np.abs(vertices).max():.3g}. Scale it down to {LARGEST:g}.")
    return vertices


def _triangles(value: ArrayLike) -> NDArray[np.int64]:
    try:
        triangles = np.asarray(value)
    except ValueError:
        triangles = np.empty(0)
    if triangles.ndim != 2 or triangles.shape[1] != 3 or len(triangles) == 0:
        raise BvbError(f"The mesh's triangles have shape {triangles.shape}. Give (m, 3), at least one.")
    if triangles.dtype.kind not in "iu":
        raise BvbError(f"The mesh's triangles are {triangles.dtype}. Give whole numbers.")
    if len(triangles) > MOST:
        raise BvbError(f"The mesh has {len(triangles):,} triangles. Simplify it to at most {MOST:,}.")
    return triangles.astype(np.int64)


def _areas(vertices: Floats, triangles: NDArray[np.integer[Any]]) -> Floats:
    """Return the normal (m, 3) of each triangle, twice as long as its area."""
    a, b, c = (vertices[triangles[:, corner]] for corner in range(3))
    return np.cross(b - a, c - a)


def _with_area(vertices: Floats, triangles: NDArray[np.integer[Any]]) -> NDArray[np.bool_]:
    """Return which triangles (m,) are more than a point or a line."""
    corners = vertices[triangles]
    longest = ((corners - np.roll(corners, 1, axis=1)) ** 2).sum(axis=2).max(axis=1)
    area = np.linalg.norm(_areas(vertices, triangles), axis=1)
    return np.asarray(area > FLAT * longest)


def _repaired(normals: Floats, vertices: Floats, triangles: NDArray[np.integer[Any]]) -> Floats:
    """Return unit normals (n, 3): the given ones, else those of the faces around, else that of one of these."""
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        largest = np.abs(normals).max(axis=1, keepdims=True)
        out = _unit(normals / largest)  # the squares of huge and tiny ones would not be numbers
    bad = ~np.isfinite(out).all(axis=1)
    if not bad.any():
        return out
    areas, corners = _areas(vertices, triangles), triangles.ravel()
    sums = [np.bincount(corners, np.repeat(areas[:, axis], 3), len(vertices)) for axis in range(3)]
    around = np.stack(sums, axis=1).astype(np.float64)
    total = np.bincount(corners, np.repeat(np.linalg.norm(areas, axis=1), 3), len(vertices))
    # The two sides of a sheet cancel.
    alone = np.linalg.norm(around, axis=1) <= FLAT * total
    one = np.empty(len(vertices), dtype=np.intp)
    one[corners] = np.repeat(np.arange(len(triangles)), 3)
    around[alone] = areas[one[alone]]
    out[bad] = _unit(around[bad])
    return out


def _unit(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


def _ball() -> tuple[Floats, Triangles]:
    """Return the points (n, 3) on the unit sphere and the triangles (m, 3) of a finely divided icosahedron."""
    golden = (1 + np.sqrt(5)) / 2
    rectangle: Floats = np.array([[0, s, t * golden] for s in (-1, 1) for t in (-1, 1)])
    points = _unit(np.concatenate([np.roll(rectangle, k, axis=1) for k in range(3)]))
    # Three corners that are as close to each other as the closest two are a face.
    near = np.linalg.norm(points[:, None] - points, axis=2) < 1.1
    found = [
        (i, j, k) for i in range(12) for j in range(i) for k in range(j) if near[i, j] and near[j, k] and near[k, i]
    ]
    triangles = np.array(found)
    inward = np.linalg.det(points[triangles]) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    for _ in range(HALVINGS):
        sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        keys, place = np.unique(sides[:, 0] * len(points) + sides[:, 1], return_inverse=True)
        middles = points[keys // len(points)] + points[keys % len(points)]
        ab, bc, ca = (place.reshape(-1, 3) + len(points)).T
        a, b, c = triangles.T
        points = np.concatenate([points, _unit(middles)])
        triangles = np.concatenate([np.stack(t, axis=1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    return points, triangles.astype(np.int32)
