"""Makes the files beside the scenes: the stone and the panorama. Run it by ``python samples/scenes/make.py``."""

from itertools import product
from pathlib import Path

import numpy as np

from bvbedit.io.exr import write_exr
from bvbedit.render.lights import directions_of_texels

HERE = Path(__file__).parent


def gem() -> str:
    """Return an .obj of the hull of a truncated octahedron, whose faces are six squares and eight hexagons."""
    corners = [
        tuple(signs[k] * v for k, v in enumerate(values))
        for values in ((0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0))
        for signs in product(*[(1,) if v == 0 else (1, -1) for v in values])
    ]
    points = np.array(sorted(corners), dtype=float)
    normals = [*np.eye(3), *-np.eye(3), *product((1, -1), repeat=3)]
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in points / np.sqrt(5)]
    for normal in np.array(normals, dtype=float):
        heights = points @ normal
        face = np.flatnonzero(heights > heights.max() - 1e-9)
        # Around the normal, counted from the face's first corner.
        centre = points[face].mean(axis=0)
        across = points[face[0]] - centre
        along = np.cross(normal, across) / np.linalg.norm(normal)
        around = np.argsort(np.arctan2((points[face] - centre) @ along, (points[face] - centre) @ across))
        lines.append("f " + " ".join(str(i + 1) for i in face[around]))
    return "\n".join(["# A truncated octahedron.", *lines, ""])


def panorama() -> np.ndarray:
    """Return a dark room (32, 64, 3) with four lamps of different colours and sizes."""
    directions = directions_of_texels(32, 64)
    up = directions[..., 2:]
    room = np.where(up > 0, 0.05 + 0.05 * up, 0.03) * np.array([1.0, 0.95, 0.9])
    for towards, width, radiance in (
        ((-0.8, -0.7, 0.6), 0.16, (24.0, 20.0, 14.0)),
        ((0.9, -0.3, 0.2), 0.12, (8.0, 14.0, 26.0)),
        ((0.2, 0.6, 0.9), 0.20, (10.0, 10.0, 10.0)),
        ((0.7, 0.8, 0.1), 0.10, (30.0, 8.0, 4.0)),
    ):
        axis = np.array(towards) / np.linalg.norm(towards)
        angle = np.arccos(np.clip(directions @ axis, -1, 1))
        room += np.clip(1.5 - angle / width, 0, 1)[..., None] * np.array(radiance)
    return np.round(room, 3).astype(np.float32)


if __name__ == "__main__":
    (HERE / "gem.obj").write_text(gem())
    write_exr(HERE / "panorama.exr", panorama())
