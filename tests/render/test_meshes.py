"""Meshes: what they refuse and repair, the blob, and surfaces from files."""

import pickle

import numpy as np
import pytest

from bvbedit.errors import BvbError
from bvbedit.render import meshes
from bvbedit.render.meshes import Mesh, blob, read_mesh

CORNERS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
QUADS = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]


def volume(mesh):
    return np.linalg.det(mesh.vertices[mesh.triangles]).sum() / 6


def ball(rings=24):
    """Points of a ball and its quads, triangles at the poles as quads with a doubled corner."""
    theta, phi = np.meshgrid(np.linspace(0, np.pi, rings + 1), np.arange(2 * rings) * np.pi / rings, indexing="ij")
    points = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
    i, j = np.meshgrid(np.arange(rings), np.arange(2 * rings), indexing="ij")
    beside = (j + 1) % (2 * rings)
    corners = [(i, j), (i + 1, j), (i + 1, beside), (i, beside)]
    return points.reshape(-1, 3), np.stack([2 * rings * a + b for a, b in corners], axis=-1).reshape(-1, 4)


def write_obj(path, points, faces, normals=None):
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in points.tolist()]
    if normals is not None:
        lines += [f"vn {x!r} {y!r} {z!r}" for x, y, z in normals.tolist()]
    mark = (lambda k: f"{k + 1}") if normals is None else (lambda k: f"{k + 1}//{k + 1}")
    lines += ["f " + " ".join(mark(k) for k in face) for face in np.asarray(faces).tolist()]
    path.write_text("\n".join(lines) + "\n")
    return path


def write_stl(path, triangles):
    """``triangles`` (m, 3, 3): binary."""
    record = np.zeros(len(triangles), dtype=np.dtype([("n", "<3f4"), ("v", "<(3,3)f4"), ("a", "<u2")]))
    record["v"] = triangles
    path.write_bytes(b" " * 80 + np.uint32(len(triangles)).tobytes() + record.tobytes())
    return path


def write_vtk(path, points, triangles):
    """Binary, of the old kind, whose reader fills up what is missing with zeros."""
    head = f"# vtk DataFile Version 3.0\nball\nBINARY\nDATASET POLYDATA\nPOINTS {len(points)} float\n"
    faces = np.insert(triangles, 0, 3, axis=1).astype(">i4")
    middle = f"\nPOLYGONS {len(faces)} {faces.size}\n"
    path.write_bytes(head.encode() + points.astype(">f4").tobytes() + middle.encode() + faces.tobytes())
    return path


def write_ply(path, points, triangles):
    """Binary."""
    header = f"""ply
format binary_little_endian 1.0
element vertex {len(points)}
property float x
property float y
property float z
element face {len(triangles)}
property list uchar int vertex_indices
end_header
"""
    faces = np.zeros(len(triangles), dtype=np.dtype([("n", "u1"), ("v", "<3i4")]))
    faces["n"], faces["v"] = 3, triangles
    path.write_bytes(header.encode() + points.astype("<f4").tobytes() + faces.tobytes())
    return path


# The mesh as a value.


def test_a_mesh_is_copied_and_read_only():
    mine, corners = CORNERS.copy(), TETRAHEDRON.copy()
    mesh = Mesh(mine, corners, np.ones((4, 3)))
    mine[:], corners[:] = 7, 0
    assert mesh.vertices.max() == 1
    assert volume(mesh) == pytest.approx(1 / 6)
    for array in (mesh.vertices, mesh.triangles, mesh.normals):
        with pytest.raises(ValueError, match="read-only"):
            array[0, 0] = 2


def test_face_normals_point_to_where_corners_run_counter_clockwise():
    normals = Mesh(CORNERS, TETRAHEDRON).face_normals()
    np.testing.assert_allclose(normals, [[0, 0, -1], [0, -1, 0], [-1, 0, 0], np.full(3, 3**-0.5)], atol=1e-15)


def test_a_moved_mesh():
    mesh = Mesh(CORNERS, TETRAHEDRON, CORNERS + 1)
    moved = mesh.moved(3.0, (1, 2, 5))
    np.testing.assert_allclose(moved.vertices, CORNERS * 3 + [1, 2, 5])
    np.testing.assert_allclose(moved.normals, mesh.normals, atol=1e-15)
    np.testing.assert_allclose(moved.bounds(), [[1, 2, 5], [4, 5, 8]])
    assert volume(moved) == pytest.approx(27 / 6)


def test_triangles_without_area_and_unused_vertices_are_dropped():
    vertices = np.concatenate([[[9.0, 9, 9]], CORNERS, [[0.5, 0.0, 0.0], [1e5, 3.0, 7.0]]])
    degenerate = [[1, 1, 2], [3, 3, 3], [1, 2, 5], [1, 5, 1]]
    normals = np.arange(21.0).reshape(7, 3) + 1
    mesh = Mesh(vertices, np.concatenate([degenerate, TETRAHEDRON + 1]), normals)
    np.testing.assert_array_equal(mesh.vertices, CORNERS)
    np.testing.assert_array_equal(mesh.triangles, TETRAHEDRON)
    np.testing.assert_allclose(np.cross(mesh.normals, normals[1:5]), 0, atol=1e-13)


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_needles_keep_their_area_at_any_scale(scale):
    needle = np.array([[0, 0, 0], [1, 0, 0], [0.5, 1e-9, 0]]) * scale
    np.testing.assert_allclose(Mesh(needle, [[0, 1, 2]]).face_normals(), [[0, 0, 1]])
    with pytest.raises(BvbError, match="zero area"):
        Mesh(needle * [1, 1e-6, 1], [[0, 1, 2]])


@pytest.mark.parametrize("broken", [(0, 0, 0), (np.nan, 0, 1), (np.inf, 0, 0), (0, -np.inf, np.nan)])
def test_broken_normals_become_those_of_the_faces_around(broken):
    normals = np.array([broken, (3, 4, 0), (1e-300, 0, 0), (0, 0, -1e300)])
    mesh = Mesh(CORNERS, TETRAHEDRON, normals)
    # Three faces of area one half meet at the origin.
    np.testing.assert_allclose(mesh.normals, [np.full(3, -(3**-0.5)), (0.6, 0.8, 0), (1, 0, 0), (0, 0, -1)], atol=1e-15)


def test_larger_faces_weigh_more():
    vertices = [[0, 0, 0], [3, 0, 0], [0, 1, 0], [0, 0, 1]]
    mesh = Mesh(vertices, [[0, 1, 2], [0, 2, 3]], np.zeros((4, 3)))
    np.testing.assert_allclose(mesh.normals[0], np.array([1, 0, 3]) / np.sqrt(10))


def test_the_two_sides_of_a_sheet_do_not_cancel():
    mesh = Mesh(CORNERS[:3], [[0, 1, 2], [0, 2, 1]], np.zeros((3, 3)))
    np.testing.assert_allclose(np.abs(mesh.normals), [[0, 0, 1]] * 3)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Mesh(CORNERS[:, :2], TETRAHEDRON), r"vertices have shape \(4, 2\)"),
        (lambda: Mesh(np.empty((0, 3)), TETRAHEDRON), "vertices have shape"),
        (lambda: Mesh("ball", TETRAHEDRON), "not numbers"),
        (lambda: Mesh([[1, 2, 3], [4, 5]], TETRAHEDRON), "not numbers"),
        (lambda: Mesh(CORNERS * np.nan, TETRAHEDRON), "nan"),
        (lambda: Mesh(CORNERS * 1e10, TETRAHEDRON), r"1e\+10"),
        (lambda: Mesh(CORNERS * 1e-10, TETRAHEDRON), "1e-10 large"),
        (lambda: Mesh(CORNERS, np.empty((0, 3), dtype=int)), "at least one"),
        (lambda: Mesh(CORNERS, [0, 1, 2]), "at least one"),
        (lambda: Mesh(CORNERS, [[0, 1, 2, 3]]), "at least one"),
        (lambda: Mesh(CORNERS, [[0, 1, 2], [0, 1]]), "at least one"),
        (lambda: Mesh(CORNERS, TETRAHEDRON * 1.0), "whole numbers"),
        (lambda: Mesh(CORNERS, TETRAHEDRON + 1), "vertex 4"),
        (lambda: Mesh(CORNERS, TETRAHEDRON - 1), "vertex -1"),
        (lambda: Mesh(CORNERS, TETRAHEDRON + 2**40), "vertex 1099511627779"),
        (lambda: Mesh(CORNERS, [[0, 1, 1], [2, 2, 2]]), "zero area"),
        (lambda: Mesh(CORNERS, TETRAHEDRON, np.ones((3, 3))), "do not fit"),
        (lambda: Mesh(CORNERS, TETRAHEDRON, np.ones(3)), "normals have shape"),
        (lambda: Mesh(CORNERS, TETRAHEDRON).moved(0.0), "scale"),
        (lambda: Mesh(CORNERS, TETRAHEDRON).moved(-1.0), "scale"),
        (lambda: Mesh(CORNERS, TETRAHEDRON).moved(1e300), "coordinate"),
        (lambda: Mesh(CORNERS, TETRAHEDRON).moved(1.0, (0, np.nan, 0)), "translation"),
        (lambda: Mesh(CORNERS, TETRAHEDRON).moved(1.0, (0, 1e12, 0)), "coordinate"),
    ],
)
def test_what_is_refused(make, words):
    with pytest.raises(BvbError, match=words) as caught:
        make()
    assert "\n" not in str(caught.value)


# The blob.


def test_the_blob_is_closed_and_like_a_ball():
    mesh = blob()
    edges = mesh.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    # Every edge twice, once in each direction: closed, and all faces to the same side.
    there, back = (set(map(tuple, e.tolist())) for e in (edges, edges[:, ::-1]))
    assert there == back
    assert len(there) == len(edges)
    assert len(mesh.vertices) - len(edges) // 2 + len(mesh.triangles) == 2
    assert volume(mesh) > 0
    assert 15_000 < len(mesh.triangles) < 25_000


def test_where_the_blob_stands():
    lowest, highest = blob().bounds()
    np.testing.assert_allclose(lowest[:2], -highest[:2], atol=1e-12)
    assert lowest[2] == pytest.approx(0, abs=1e-12)
    assert highest[2] == pytest.approx(2)
    assert highest[:2].min() > 0.6
    assert highest[:2].max() < 1.4


def test_the_blob_has_no_slivers():
    mesh = blob()
    sides = np.linalg.norm(np.diff(mesh.vertices[mesh.triangles][:, [0, 1, 2, 0]], axis=1), axis=2)
    assert (sides.max(axis=1) / sides.min(axis=1)).max() < 3
    assert sides.max() < 0.1


def test_the_blobs_normals_are_those_of_its_surface():
    mesh = blob()
    corners = mesh.triangles.ravel()
    # The faces around a vertex differ from the normal there by the curvature times their size: on average by little.
    areas = np.repeat(np.cross(*np.diff(mesh.vertices[mesh.triangles], axis=1).transpose(1, 0, 2)), 3, axis=0)
    around = np.stack([np.bincount(corners, areas[:, axis]) for axis in range(3)], axis=1)
    around /= np.linalg.norm(around, axis=1, keepdims=True)
    assert np.linalg.norm(around - mesh.normals, axis=1).max() < 0.03


def test_the_blobs_normals_are_those_of_the_limit(monkeypatch):
    def slopes():
        """How far edges are from perpendicular to the mean of the normals at their ends."""
        mesh = blob()
        a, b = mesh.triangles[:, 0], mesh.triangles[:, 1]
        edge = mesh.vertices[b] - mesh.vertices[a]
        normal = mesh.normals[a] + mesh.normals[b]
        return np.abs((edge * normal).sum(axis=1)) / np.linalg.norm(edge, axis=1) / 2

    coarse = slopes()
    monkeypatch.setattr(meshes, "HALVINGS", meshes.HALVINGS + 1)
    fine = slopes()
    # Finite differences of second order: half as long edges, a quarter of the error.
    assert coarse.mean() / fine.mean() == pytest.approx(4, rel=0.02)
    assert coarse.max() / fine.max() == pytest.approx(4, rel=0.2)


def test_the_blob_has_hills_and_hollows():
    mesh = blob()
    a, b = mesh.triangles[:, 0], mesh.triangles[:, 1]
    bend = ((mesh.vertices[b] - mesh.vertices[a]) * (mesh.normals[b] - mesh.normals[a])).sum(axis=1)
    assert (bend > 0).mean() > 0.4
    assert (bend < 0).mean() > 0.2


def test_the_blob_is_always_the_same():
    np.testing.assert_array_equal(blob().vertices, blob().vertices)


# Files. Each is read in a process of its own, so there are few.


def test_a_cube_of_quads_is_flat(tmp_path):
    mesh = read_mesh(write_obj(tmp_path / "Cube.OBJ", CUBE * 2, QUADS))
    assert volume(mesh) == pytest.approx(8)
    assert len(mesh.triangles) == 12
    shading = mesh.normals[mesh.triangles]
    np.testing.assert_allclose(shading, np.broadcast_to(mesh.face_normals()[:, None], shading.shape), atol=1e-6)


def test_a_ball_of_separate_triangles_is_smooth(tmp_path):
    points, quads = ball()
    soup = points[np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])]
    mesh = read_mesh(str(write_stl(tmp_path / "ball.stl", soup)))
    assert abs(volume(mesh)) == pytest.approx(4 / 3 * np.pi, rel=0.02)
    cosine = (mesh.normals * mesh.vertices).sum(axis=1)
    assert np.abs(cosine).min() > 0.995
    assert np.abs(cosine.sum()) == pytest.approx(np.abs(cosine).sum())


def test_a_files_own_normals_are_taken(tmp_path):
    normals = np.array([[0, 0, 2.0], [0, 3, 4], [1, 0, 0], [0, 0, 0]])
    mesh = read_mesh(write_obj(tmp_path / "tetrahedron.obj", CORNERS, TETRAHEDRON, normals))
    place = [np.flatnonzero((mesh.vertices == corner).all(axis=1))[0] for corner in CORNERS]
    np.testing.assert_allclose(mesh.normals[place[:3]], [(0, 0, 1), (0, 0.6, 0.8), (1, 0, 0)], atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1)


def test_a_binary_ply(tmp_path):
    mesh = read_mesh(write_ply(tmp_path / "tetrahedron.ply", CORNERS, TETRAHEDRON))
    assert volume(mesh) == pytest.approx(1 / 6)


def truncated(path):
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    return path


def _written(path, content):
    path.write_bytes(content)
    return path


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda folder: folder / "none.ply", "does not exist"),
        (lambda folder: folder, "is a folder"),
        (lambda folder: _written(folder / "empty.obj", b""), "is empty"),
        (lambda folder: _written(folder / "any.pkl", pickle.dumps(CORNERS)), "pickle"),
        (lambda folder: truncated(write_ply(folder / "half.ply", *ball_triangles())), "cannot be read"),
        (lambda folder: write_ply(folder / "index.ply", CORNERS, TETRAHEDRON + 9), "cannot be read"),
        (lambda folder: truncated(write_vtk(folder / "half.vtk", *ball_triangles())), "cannot be read"),
        (lambda folder: _written(folder / "text.stl", b"Dear reader,\n" * 9), "text.stl"),
        (lambda folder: _written(folder / "noise.vtp", np.random.default_rng(1).bytes(999)), "cannot be read"),
        (lambda folder: _written(folder / "points.obj", b"v 0 0 0\nv 1 0 0\n"), "no surface"),
        (lambda folder: _written(folder / "nan.obj", b"v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), "nan.obj: .*nan"),
    ],
)
def test_broken_files_are_named_in_silence(make, words, tmp_path, capfd):
    path = make(tmp_path)
    with pytest.raises(BvbError, match=words) as caught:
        read_mesh(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


def ball_triangles():
    points, quads = ball()
    return points, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
