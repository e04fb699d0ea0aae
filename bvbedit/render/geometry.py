"""Where a ray meets the sphere and the ground, and the frame of directions there. Compiled; nothing is checked."""

import math

from bvbedit.jit import kernel

NEVER = math.inf


@kernel
def sphere_distance(
    ox: float, oy: float, oz: float, dx: float, dy: float, dz: float, cx: float, cy: float, cz: float, radius: float
) -> float:
    """Return how far along the unit direction d a ray from o, outside the sphere, enters it, else infinity."""
    ox, oy, oz = ox - cx, oy - cy, oz - cz
    along = ox * dx + oy * dy + oz * dz
    if along >= 0:
        return NEVER
    # The squared distance of the ray from the centre, by the perpendicular: b^2 - c would lose half the digits.
    px, py, pz = ox - along * dx, oy - along * dy, oz - along * dz
    inside = radius * radius - (px * px + py * py + pz * pz)
    if inside <= 0:
        return NEVER
    return -along - math.sqrt(inside)


@kernel
def tangent(nx: float, ny: float) -> tuple[float, float]:
    """Return x and y of the horizontal unit tangent at a normal n along its parallel; (1, 0) at the poles."""
    length = math.hypot(nx, ny)
    if length < 1e-12:
        return 1.0, 0.0
    return -ny / length, nx / length


@kernel
def cosine_direction(u: float, v: float) -> tuple[float, float, float]:
    """Return a direction about z with density cos(theta) / pi over solid angle; z is never zero."""
    r, phi = math.sqrt(u), 2.0 * math.pi * v
    return r * math.cos(phi), r * math.sin(phi), math.sqrt(1.0 - u)
