"""Where rays meet spheres, planes and rectangles, and the frame of directions there. Compiled; nothing is checked."""

import math
from typing import Any

from numpy.typing import NDArray

from bvbedit.jit import inlined_kernel

Array = NDArray[Any]

NEVER = math.inf
# Shorter ways, in radii or lengths, lead from a surface to itself: rounding errors are some 1e-15 of a coordinate.
SELF = 1e-9


@inlined_kernel
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


@inlined_kernel
def rectangle_distance(
    ox: float, oy: float, oz: float, dx: float, dy: float, dz: float, rectangles: Array, k: int
) -> float:
    """Return how far along d a ray from o meets rectangle k: centre, half sides, normal in rows (K, 12)."""
    nx, ny, nz = rectangles[k, 9], rectangles[k, 10], rectangles[k, 11]
    facing = dx * nx + dy * ny + dz * nz
    if facing == 0:
        return NEVER
    qx, qy, qz = rectangles[k, 0] - ox, rectangles[k, 1] - oy, rectangles[k, 2] - oz
    t = (qx * nx + qy * ny + qz * nz) / facing
    if not t > SELF:
        return NEVER
    qx, qy, qz = t * dx - qx, t * dy - qy, t * dz - qz
    ax, ay, az = rectangles[k, 3], rectangles[k, 4], rectangles[k, 5]
    bx, by, bz = rectangles[k, 6], rectangles[k, 7], rectangles[k, 8]
    across = (qx * ax + qy * ay + qz * az) / (ax * ax + ay * ay + az * az)
    along = (qx * bx + qy * by + qz * bz) / (bx * bx + by * by + bz * bz)
    return t if abs(across) <= 1 and abs(along) <= 1 else NEVER


@inlined_kernel
def rectangle_area(rectangles: Array, k: int) -> float:
    """Return the area of rectangle k."""
    ax, ay, az = rectangles[k, 3], rectangles[k, 4], rectangles[k, 5]
    bx, by, bz = rectangles[k, 6], rectangles[k, 7], rectangles[k, 8]
    return 4.0 * math.sqrt((ax * ax + ay * ay + az * az) * (bx * bx + by * by + bz * bz))


@inlined_kernel
def first_met(
    ox: float,
    oy: float,
    oz: float,
    dx: float,
    dy: float,
    dz: float,
    limit: float,
    spheres: Array,
    planes: Array,
    rectangles: Array,
) -> tuple[float, int]:
    """Return how far a ray goes, and the number of what it meets before ``limit``: infinity and -1 for nothing."""
    best, found = limit, -1
    for k in range(len(spheres)):
        cx, cy, cz, radius = spheres[k, 0], spheres[k, 1], spheres[k, 2], spheres[k, 3]
        t = sphere_distance(ox, oy, oz, dx, dy, dz, cx, cy, cz, radius)
        if t < best:
            best, found = t, k
    before = len(spheres)
    for k in range(len(planes)):
        if dz != 0:
            t = (planes[k] - oz) / dz
            if SELF < t < best:
                best, found = t, before + k
    before += len(planes)
    for k in range(len(rectangles)):
        t = rectangle_distance(ox, oy, oz, dx, dy, dz, rectangles, k)
        if t < best:
            best, found = t, before + k
    return (best, found) if found >= 0 else (NEVER, -1)


@inlined_kernel
def tangent(nx: float, ny: float) -> tuple[float, float]:
    """Return x and y of the horizontal unit tangent at a normal n along its parallel; (1, 0) at the poles."""
    length = math.sqrt(nx * nx + ny * ny)
    if length < 1e-12:
        return 1.0, 0.0
    return -ny / length, nx / length


@inlined_kernel
def to_local(nx: float, ny: float, nz: float, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Return a direction of the world in the frame of the normal n: tangent, n x tangent, n."""
    tx, ty = tangent(nx, ny)
    return x * tx + y * ty, -x * nz * ty + y * nz * tx + z * (nx * ty - ny * tx), x * nx + y * ny + z * nz


@inlined_kernel
def to_world(nx: float, ny: float, nz: float, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Return a direction of the frame of the normal n in the world."""
    tx, ty = tangent(nx, ny)
    return x * tx - y * nz * ty + z * nx, x * ty + y * nz * tx + z * ny, y * (nx * ty - ny * tx) + z * nz
