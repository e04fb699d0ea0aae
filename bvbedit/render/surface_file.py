"""A program: read a file with PyVista and write its surface as arrays. It needs nothing else of this package.

It runs in a process of its own, whose end by a crash in VTK harms nobody. Any exception means: cannot be read.
"""

import sys

import numpy as np
import pyvista

# Edges that turn by more than so many degrees are creases: those of a cube, not those of a ball of 24 slices.
CREASE = 45.0


def write_surface(source: str, target: str) -> None:
    """Write vertices (n, 3), triangles (m, 3), and normals (n, 3), of the file ``source`` to the .npz ``target``.

    There are no triangles where the file has no surface. Raises whatever goes wrong.
    """
    with pyvista.VtkErrorCatcher(send_to_logging=False) as catcher:
        data = pyvista.read(source)
    # VTK tells of truncated files in events, some of them mere warnings, and goes on with what memory happens to hold.
    told = [event for event in catcher.events if "error" in str(event).replace(source, "").lower()]
    if told:
        raise ValueError(f"VTK says: {told[0]}")
    if isinstance(data, pyvista.MultiBlock):
        data = data.combine()
    if isinstance(data, pyvista.ImageData):
        data = pyvista.PolyData()  # pictures and voxels
    surface = data if isinstance(data, pyvista.PolyData) else data.extract_surface()
    surface = surface.triangulate()
    triangles = surface.faces.reshape(-1, 4)[:, 1:]
    normals = np.empty((0, 3))
    if len(triangles):
        if triangles.min() < 0 or triangles.max() >= surface.n_points:
            raise ValueError("A face has a vertex that does not exist.")
        found = surface.point_data.active_normals
        if found is None:
            # Some formats repeat the vertices of each face: without merging, every edge would be a crease.
            surface = surface.clean().compute_normals(
                cell_normals=False, split_vertices=True, feature_angle=CREASE, consistent_normals=True
            )
            triangles, found = surface.faces.reshape(-1, 4)[:, 1:], surface.point_data.active_normals
        normals = np.asarray(found)
        if normals.shape != (surface.n_points, 3):
            raise ValueError("There are not as many normals as vertices.")
    np.savez(target, vertices=np.asarray(surface.points), triangles=np.asarray(triangles), normals=normals)


if __name__ == "__main__":
    write_surface(sys.argv[1], sys.argv[2])
