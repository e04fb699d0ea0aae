"""Rays and meshes, against every ray with every triangle in float64."""

import numpy as np
import pytest

from bvbedit.errors import BvbError
from bvbedit.render.embree import CLEARANCE, Tracer
from bvbedit.render.meshes import Mesh, blob

SQUARE = Mesh([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], [[0, 1, 2], [0, 2, 3]])


def unit(v):
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def oracle(mesh, origins, directions):
    """Möller and Trumbore: distances (rays, triangles), inf for none, and how clear the case is (rays, triangles)."""
    a, b, c = mesh.vertices[mesh.triangles].transpose(1, 0, 2)
    across = np.cross(directions[:, None], c - a)
    determinant = (across * (b - a)).sum(axis=2)
    from_a = origins[:, None] - a
    along = np.cross(from_a, b - a)
    with np.errstate(divide="ignore", invalid="ignore"):
        u = (from_a * across).sum(axis=2) / determinant
        v = (directions[:, None] * along).sum(axis=2) / determinant
        t = ((c - a) * along).sum(axis=2) / determinant
    inside = np.minimum(np.minimum(u, v), 1 - u - v)
    size = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    clear = (np.abs(inside) > 1e-4) & (np.abs(t) > 1e-4) & (np.abs(determinant) > 1e-3 * size)
    hit = (inside >= 0) & (t > 0) & (determinant != 0)
    return np.where(hit, t, np.inf), clear, u, v


def random_mesh(rng, count, normals=True):
    centres = rng.uniform(-1, 1, (count, 1, 3))
    vertices = (centres + rng.normal(size=(count, 3, 3)) * 0.3).reshape(-1, 3)
    return Mesh(vertices, np.arange(3 * count).reshape(-1, 3), rng.normal(size=vertices.shape) if normals else None)


def sphere(rings):
    """A ball of radius 1 whose vertices, and normals, are exact."""
    theta, phi = np.meshgrid(np.linspace(0, np.pi, rings + 1), np.arange(2 * rings) * np.pi / rings, indexing="ij")
    points = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
    points[-1] = points[-1, 0]
    points[0] = points[0, 0]
    i, j = np.meshgrid(np.arange(rings), np.arange(2 * rings), indexing="ij")
    beside = (j + 1) % (2 * rings)
    a, b, c, d = (2 * rings * r + s for r, s in ((i, j), (i + 1, j), (i + 1, beside), (i, beside)))
    triangles = np.concatenate([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)]).reshape(-1, 3)
    return Mesh(points.reshape(-1, 3), triangles, points.reshape(-1, 3))


def rays(rng, count, spread=2.0):
    return rng.normal(size=(count, 3)) * spread, unit(rng.normal(size=(count, 3)))


def test_the_nearest_of_random_triangles(rng):
    meshes = [random_mesh(rng, 30), random_mesh(rng, 50, normals=False), random_mesh(rng, 1)]
    origins, directions = rays(rng, 5000, 1.0)
    t, which, geometric, shading = Tracer(meshes).nearest(origins, directions)
    assert (t.dtype, which.dtype, geometric.dtype, shading.dtype) == (np.float64, np.intp, np.float64, np.float64)

    each = [oracle(m, origins, directions) for m in meshes]
    all_t, clear, u, v = (np.concatenate([found[k] for found in each], axis=1) for k in range(4))
    owner = np.repeat([0, 1, 2], [30, 50, 1])
    best = all_t.argmin(axis=1)
    row = np.arange(len(t))
    expected = all_t[row, best]
    sure = clear.all(axis=1)
    assert sure.mean() > 0.8
    hit = sure & np.isfinite(expected)
    assert 0.2 < hit[sure].mean() < 0.8
    np.testing.assert_array_equal(np.isfinite(t[sure]), np.isfinite(expected[sure]))
    # Far better than float32 wherever the ray is not grazing.
    np.testing.assert_allclose(t[hit], expected[hit], rtol=1e-10)
    np.testing.assert_array_equal(which[hit], owner[best[hit]])
    faces = np.concatenate([m.face_normals() for m in meshes])
    np.testing.assert_array_equal(geometric[hit], faces[best[hit]])

    smooth = hit & (owner[best] != 1)
    corners = np.concatenate(
        [m.normals[m.triangles] if m.normals is not None else np.zeros((50, 3, 3)) for m in meshes]
    )
    b = best[smooth]
    w = np.stack([1 - u[smooth, b] - v[smooth, b], u[smooth, b], v[smooth, b]], axis=1)
    mean = (corners[b] * w[..., None]).sum(axis=1)
    long = np.linalg.norm(mean, axis=1) > 0.1
    side = np.sign((mean * faces[b]).sum(axis=1))[:, None]
    np.testing.assert_allclose(shading[smooth][long], (unit(mean) * side)[long], atol=1e-3)
    flat = hit & (which == 1)
    np.testing.assert_array_equal(shading[flat], geometric[flat])
    np.testing.assert_allclose(np.linalg.norm(shading[hit], axis=1), 1)
    assert (shading * geometric).sum(axis=1).min() >= 0


def test_what_meets_nothing():
    t, which, geometric, shading = Tracer([SQUARE]).nearest(np.array([[0.0, 0, 1]]), np.array([[0.0, 0, 1]]))
    assert (t[0], which[0]) == (np.inf, -1)
    assert not geometric.any()
    assert not shading.any()


@pytest.mark.parametrize("part", [0.5, 0.999, 1.001, 2.0, np.inf])
def test_shadow_rays_end_at_their_distance(rng, part):
    mesh = random_mesh(rng, 60)
    origins, directions = rays(rng, 5000, 1.0)
    all_t, clear, _, _ = oracle(mesh, origins, directions)
    expected, sure = all_t.min(axis=1), clear.all(axis=1)
    distance = np.where(np.isfinite(expected), expected, 3.0) * part
    found = Tracer([mesh]).blocked(origins, directions, distance)
    assert found.dtype == bool
    np.testing.assert_array_equal(found[sure], (expected < distance)[sure])


def test_distances_that_reach_nothing():
    origins, directions = np.array([[0.1, 0.2, 1.0]] * 5), np.array([[0.0, 0, -1]] * 5)
    distance = np.array([0.0, -1.0, np.nan, -np.inf, 1e300])
    np.testing.assert_array_equal(Tracer([SQUARE]).blocked(origins, directions, distance), [0, 0, 0, 0, 1])


def test_the_callers_arrays_are_left_alone(rng):
    origins, directions = rays(rng, 100)
    distance = np.full(100, 3.0)
    given = (origins, directions, distance)
    before = [a.copy() for a in given]
    tracer = Tracer([blob()])
    tracer.blocked(*given)
    tracer.nearest(origins, directions)
    for a, b in zip(given, before, strict=True):
        np.testing.assert_array_equal(a, b)


def test_a_fine_ball_is_a_sphere(rng):
    origins = unit(rng.normal(size=(4000, 3))) * rng.uniform(1.5, 30, (4000, 1))
    directions = unit(unit(rng.normal(size=(4000, 3))) * 0.9 - origins)
    t, which, geometric, shading = Tracer([sphere(100)]).nearest(origins, directions)
    along = -(origins * directions).sum(axis=1)
    exact = along - np.sqrt(1 - (origins**2).sum(axis=1) + along**2)
    assert (which == 0).all()
    cosine = np.sqrt(1 - (origins**2).sum(axis=1) + along**2)
    # A chord of half an angle of pi / 200 lies a part of 2.5e-4 inside, seen along the ray as more where it is grazing.
    assert (np.abs(t - exact) * cosine).max() < 4e-4
    points = origins + t[:, None] * directions
    np.testing.assert_allclose(shading, unit(points), atol=1e-3)
    assert (geometric * unit(points)).sum(axis=1).min() > 0.9995


def test_no_ray_leaves_a_closed_mesh(rng):
    mesh = blob()
    tracer = Tracer([mesh])
    inside = (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2

    def leaving(targets):
        directions = unit(targets - inside)
        origins = np.broadcast_to(inside, directions.shape)
        t, _, geometric, _ = tracer.nearest(origins, directions)
        assert ((geometric * directions).sum(axis=1)[np.isfinite(t)] > 0).all()
        np.testing.assert_array_equal(tracer.blocked(origins, directions, np.full(len(t), np.inf)), np.isfinite(t))
        return np.isinf(t).mean()

    a, b, c = mesh.vertices[mesh.triangles].transpose(1, 0, 2)
    assert leaving((a + b) / 2) == 0
    assert leaving(a + (c - a) * rng.random((len(a), 1))) == 0
    assert leaving(inside + rng.normal(size=(100_000, 3))) == 0
    assert leaving(mesh.vertices) < 0.02


@pytest.mark.parametrize(
    ("scale", "translation", "away"), [(1, (0, 0, 0), 0), (1e-3, (5, 0, 0), 0), (1e3, (0, 0, 0), 0), (1, (0, 0, 0), 50)]
)
def test_rays_from_just_above_a_convex_surface_leave_it(rng, scale, translation, away):
    mesh = sphere(40).moved(scale, translation)
    far = SQUARE.moved(1e-3, (away, 0, 0))
    tracer = Tracer([mesh, far] if away else [mesh])
    count = 20_000
    k = rng.integers(len(mesh.triangles), size=count)
    points = (mesh.vertices[mesh.triangles[k]] * rng.dirichlet([1, 1, 1], count)[..., None]).sum(axis=1)
    normal = mesh.face_normals()[k]
    directions = unit(rng.normal(size=(count, 3)))
    up = (directions * normal).sum(axis=1, keepdims=True)
    # From right up to almost within the surface.
    directions = unit(directions - up * normal + np.abs(up) * normal * 10.0 ** rng.uniform(-7, 0, (count, 1)))
    lift = CLEARANCE * max(scale, away)
    t, which, _, _ = tracer.nearest(points + lift * normal, directions)
    assert (which != 0).all()
    assert not tracer.blocked(points + lift * normal, directions, np.full(count, scale)).any()
    # Back down they meet it at once, where they left it.
    t, which, _, _ = tracer.nearest(points + lift * normal, -normal)
    assert (which == 0).all()
    np.testing.assert_allclose(t, lift, rtol=1e-3)


def test_places_far_from_the_origin_lose_no_digits(rng):
    origins, directions = rays(rng, 2000)
    near = Tracer([blob()]).nearest(origins, directions)
    shift = np.array([2.0**20, -(2.0**21), 2.0**19])
    far = Tracer([blob().moved(1.0, tuple(shift))]).nearest(origins + shift, directions)
    same = near[1] == far[1]
    assert same.mean() > 0.999
    hit = same & (near[1] == 0)
    # A few rays are so grazing that the rounded vertices tell.
    assert np.quantile(np.abs(near[0][hit] - far[0][hit]), 0.99) < 1e-7


def test_rays_within_the_plane_of_a_triangle_do_not_meet_it():
    origins = np.array([[-3.0, 0.2, 0.0], [0.0, 0.0, 0.0], [-3.0, 0.2, 0.1]])
    directions = np.array([[1.0, 0, 0], [0, 1.0, 0], [1.0, 0, 0]])
    tracer = Tracer([SQUARE])
    assert np.isinf(tracer.nearest(origins, directions)[0]).all()
    assert not tracer.blocked(origins, directions, np.full(3, np.inf)).any()


def test_both_sides_are_met_and_the_normal_stays():
    origins, directions = np.array([[0.1, 0.2, 2.0], [0.1, 0.2, -2.0]]), np.array([[0, 0, -0.5], [0, 0, 0.5]])
    t, which, geometric, shading = Tracer([SQUARE]).nearest(origins, directions)
    np.testing.assert_allclose(t, 4)
    np.testing.assert_array_equal(which, 0)
    np.testing.assert_array_equal(geometric, [[0, 0, 1]] * 2)
    np.testing.assert_array_equal(shading, [[0, 0, 1]] * 2)


def test_where_the_interpolated_normal_vanishes_the_geometric_one_is_taken():
    mesh = Mesh(SQUARE.vertices[:3], [[0, 1, 2]], [[1, 0, 0], [0, 1, 0], [-1, 0, 0]])
    middle = np.array([[0.0, 0.0, 1.0]])  # of the edge between two opposite normals
    _, which, _, shading = Tracer([mesh]).nearest(middle, np.array([[0.0, 0, -1]]))
    np.testing.assert_array_equal(which, 0)
    np.testing.assert_allclose(shading, [[0, 0, 1]])


def test_rays_with_nan_meet_nothing():
    origins, directions = np.array([[np.nan, 0, 1], [0.1, 0.2, 1], [0.1, 0.2, 1]]), np.array([[0.0, 0, -1]] * 3)
    directions[1, 2], directions[2] = np.nan, 0
    tracer = Tracer([SQUARE])
    np.testing.assert_array_equal(tracer.nearest(origins, directions)[1], -1)
    assert not tracer.blocked(origins, directions, np.full(3, np.inf)).any()


@pytest.mark.parametrize("count", [0, 1])
def test_few_rays(count):
    tracer = Tracer([SQUARE])
    origins, directions = np.full((count, 3), 0.5), np.full((count, 3), -0.5)
    t, which, geometric, shading = tracer.nearest(origins, directions)
    assert (t.shape, which.shape, geometric.shape, shading.shape) == ((count,), (count,), (count, 3), (count, 3))
    assert tracer.blocked(origins, directions, np.full(count, np.inf)).tolist() == [True] * count


def test_many_rays_are_the_same_as_few(rng):
    origins, directions = rays(rng, 20_000)
    tracer = Tracer([blob()])
    together = tracer.nearest(origins, directions)
    blocked = tracer.blocked(origins, directions, np.full(20_000, 2.0))
    for start in range(0, 20_000, 3000):
        rows = slice(start, start + 3000)
        for a, b in zip(together, tracer.nearest(origins[rows], directions[rows]), strict=True):
            np.testing.assert_array_equal(a[rows], b)
        part = tracer.blocked(np.asfortranarray(origins[rows]), directions[rows], np.full(len(origins[rows]), 2.0))
        np.testing.assert_array_equal(blocked[rows], part)
    np.testing.assert_array_equal(blocked, together[0] < 2)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Tracer([]), "no meshes"),
        (lambda: Tracer([SQUARE]).nearest(np.zeros((3, 3)), np.zeros((1, 3))), "directions"),
        (lambda: Tracer([SQUARE]).nearest(np.zeros((3, 2)), np.zeros((3, 2))), "origins"),
        (lambda: Tracer([SQUARE]).blocked(np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(2)), "Distances"),
    ],
)
def test_what_is_refused(make, words):
    with pytest.raises(BvbError, match=words):
        make()
