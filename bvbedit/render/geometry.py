"""Where rays meet spheres, planes and rectangles, and the frame of directions there. Compiled; nothing is checked."""

import math
from typing import Any

from numba import prange
from numpy.typing import NDArray

from bvbedit.jit import kernel, parallel_kernel

Array = NDArray[Any]

NEVER = math.inf
# Shorter ways, in radii or lengths, lead from a surface to itself: rounding errors are some 1e-15 of a coordinate.
SELF = 1e-9
# A shadow ray stops this share of its way before the lamp.
BEFORE_LAMP = 1e-6


@kernel
def sphere_distance(
    ox: float, oy: float, oz: float, dx: float, dy: float, dz: float, cx: float, cy: float, cz: float, radius: float
) -> float:
    """Return how far along the unit direction d a ray from o, outside or inside, meets the sphere, else infinity."""
    ox, oy, oz = ox - cx, oy - cy, oz - cz
    along = ox * dx + oy * dy + oz * dz
    # The squared distance of the ray from the centre, by the perpendicular: b^2 - c would lose half the digits.
    px, py, pz = ox - along * dx, oy - along * dy, oz - along * dz
    inside = radius * radius - (px * px + py * py + pz * pz)
    if inside <= 0:
        return NEVER
    half = math.sqrt(inside)
    nearest = SELF * radius
    if -along - half > nearest:
        return -along - half
    # The far side, for who stands inside; who stands on the sphere and looks out is left with a chord of length 0.
    if -along + half > nearest and -along - half < -nearest:
        return -along + half
    return NEVER


@kernel
def rectangle_distance(
    ox: float, oy: float, oz: float, dx: float, dy: float, dz: float, rectangles: Array, k: int
) -> float:
    """Return how far along d a ray from o meets rectangle k: centre, half sides, normal in rows (K, 12)."""
    r = rectangles[k]
    facing = dx * r[9] + dy * r[10] + dz * r[11]
    if facing == 0:
        return NEVER
    qx, qy, qz = r[0] - ox, r[1] - oy, r[2] - oz
    t = (qx * r[9] + qy * r[10] + qz * r[11]) / facing
    if not t > SELF:
        return NEVER
    qx, qy, qz = t * dx - qx, t * dy - qy, t * dz - qz
    across = (qx * r[3] + qy * r[4] + qz * r[5]) / (r[3] * r[3] + r[4] * r[4] + r[5] * r[5])
    along = (qx * r[6] + qy * r[7] + qz * r[8]) / (r[6] * r[6] + r[7] * r[7] + r[8] * r[8])
    return t if abs(across) <= 1 and abs(along) <= 1 else NEVER


@kernel
def first_met(o: Array, d: Array, spheres: Array, planes: Array, rectangles: Array) -> tuple[float, int]:
    """Return how far a ray goes, and the number of what it meets: first spheres, then planes, then rectangles."""
    best, found = NEVER, -1
    for k in range(len(spheres)):
        s = spheres[k]
        t = sphere_distance(o[0], o[1], o[2], d[0], d[1], d[2], s[0], s[1], s[2], s[3])
        if t < best:
            best, found = t, k
    for k in range(len(planes)):
        if d[2] != 0:
            t = (planes[k] - o[2]) / d[2]
            if SELF < t < best:
                best, found = t, len(spheres) + k
    for k in range(len(rectangles)):
        t = rectangle_distance(o[0], o[1], o[2], d[0], d[1], d[2], rectangles, k)
        if t < best:
            best, found = t, len(spheres) + len(planes) + k
    return best, found


@parallel_kernel
def nearest(
    origins: Array, directions: Array, spheres: Array, planes: Array, rectangles: Array, distance: Array, which: Array
) -> None:
    """Write ``distance`` (n,) to what each ray (n, 3), (n, 3) meets first, infinity for none, and its number or -1."""
    for m in prange(len(origins)):
        distance[m], which[m] = first_met(origins[m], directions[m], spheres, planes, rectangles)


@parallel_kernel
def blocked(
    origins: Array, directions: Array, limit: Array, spheres: Array, planes: Array, rectangles: Array, out: Array
) -> None:
    """Write whether each ray meets something before ``limit`` (n,)."""
    for m in prange(len(origins)):
        t, _ = first_met(origins[m], directions[m], spheres, planes, rectangles)
        out[m] = t < limit[m] * (1.0 - BEFORE_LAMP)


@kernel
def tangent(nx: float, ny: float) -> tuple[float, float]:
    """Return x and y of the horizontal unit tangent at a normal n along its parallel; (1, 0) at the poles."""
    length = math.hypot(nx, ny)
    if length < 1e-12:
        return 1.0, 0.0
    return -ny / length, nx / length


@kernel
def to_local(n: Array, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Return a direction of the world in the frame of the normal ``n`` (3,): tangent, n x tangent, n."""
    tx, ty = tangent(n[0], n[1])
    return x * tx + y * ty, -x * n[2] * ty + y * n[2] * tx + z * (n[0] * ty - n[1] * tx), x * n[0] + y * n[1] + z * n[2]


@kernel
def to_world(n: Array, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Return a direction of the frame of the normal ``n`` in the world."""
    tx, ty = tangent(n[0], n[1])
    return x * tx - y * n[2] * ty + z * n[0], x * ty + y * n[2] * tx + z * n[1], y * (n[0] * ty - n[1] * tx) + z * n[2]
