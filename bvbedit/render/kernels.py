"""The wavefront's steps: rays from pixels, surfaces where they end, light that comes from there. Compiled, unchecked.

A wave is a run of pixels with the same samples of each: slot m is sample ``first_sample + m % samples`` of pixel
``first + m // samples``. Its random numbers depend on seed, pixel and sample alone. Materials are not known here.
"""

import math
from typing import Any

import numpy as np
from numba import prange
from numpy.typing import NDArray

from bvbedit.jit import kernel, parallel_kernel
from bvbedit.render.geometry import to_local, to_world
from bvbedit.render.sequence import mix, point

Array = NDArray[Any]
# First pixel, first sample, samples of each pixel, seed.
Cut = tuple[int, int, int, np.uint64]

# The pair of random numbers that places a ray in its pixel; the others follow.
PIXEL = 0


@kernel
def number(cut: Cut, slot: int, pair: int) -> tuple[float, float]:
    """Return a pair of random numbers of a slot."""
    first, first_sample, samples, seed = cut
    return point(mix(seed, np.uint64(first + slot // samples)), first_sample + slot % samples, pair)


@parallel_kernel
def numbers(cut: Cut, slots: Array, pair: int, out: Array) -> None:
    """Write a pair of random numbers (n, 2) for each of ``slots`` (n,)."""
    for m in prange(len(slots)):
        out[m, 0], out[m, 1] = number(cut, slots[m], pair)


@parallel_kernel
def camera_rays(cut: Cut, shape: tuple[int, int], camera: Array, origins: Array, directions: Array) -> None:
    """Write rays (m, 3), (m, 3) through random places in the pixels of a wave of a picture of ``shape`` (h, w).

    ``camera`` (4, 3): position, then right, up and forward, where up reaches the upper edge and right is as long.
    """
    height, width = shape
    for m in prange(len(origins)):
        row, column = divmod(cut[0] + m // cut[2], width)
        u, v = number(cut, m, PIXEL)
        a, b = (2.0 * (column + u) - width) / height, 1.0 - 2.0 * (row + v) / height
        dx = camera[3, 0] + a * camera[1, 0] + b * camera[2, 0]
        dy = camera[3, 1] + a * camera[1, 1] + b * camera[2, 1]
        dz = camera[3, 2] + a * camera[1, 2] + b * camera[2, 2]
        length = math.sqrt(dx * dx + dy * dy + dz * dz)
        origins[m, 0], origins[m, 1], origins[m, 2] = camera[0, 0], camera[0, 1], camera[0, 2]
        directions[m, 0], directions[m, 1], directions[m, 2] = dx / length, dy / length, dz / length


@parallel_kernel
def surfaces(
    origins: Array,
    directions: Array,
    distance: Array,
    which: Array,
    spheres: Array,
    planes: Array,
    lift: float,
    faces: Array,
    normal: Array,
    position: Array,
    wo: Array,
) -> None:
    """Write what rays (n, 3), (n, 3) find at ``distance`` (n,) on object ``which`` (n,), all of them on one.

    ``faces`` (n, 3) and ``normal`` (n, 3), geometric and for shading, are read where the object is a mesh and written
    where it is a sphere or a plane: both turned to the viewer. ``position`` (n, 3) lies ``lift`` above the surface, and
    ``wo`` (n, 3) is the way back in the frame of the normal. Where a shading normal turns away from the viewer the
    geometric one takes its place.
    """
    for m in prange(len(origins)):
        o, d, t = origins[m], directions[m], distance[m]
        for c in range(3):
            position[m, c] = o[c] + t * d[c]
        if which[m] < len(spheres):
            s = spheres[which[m]]
            for c in range(3):
                faces[m, c] = (position[m, c] - s[c]) / s[3]
                normal[m, c] = faces[m, c]
        elif which[m] < len(spheres) + len(planes):
            for c in range(3):
                faces[m, c] = normal[m, c] = 1.0 if c == 2 else 0.0
        turned = -(d[0] * faces[m, 0] + d[1] * faces[m, 1] + d[2] * faces[m, 2])
        leaning = -(d[0] * normal[m, 0] + d[1] * normal[m, 1] + d[2] * normal[m, 2])
        sign = -1.0 if turned < 0 else 1.0
        shaded = sign * leaning > 0
        for c in range(3):
            faces[m, c] *= sign
            normal[m, c] = sign * normal[m, c] if shaded else faces[m, c]
            position[m, c] += lift * faces[m, c]
        x, y, z = to_local(normal[m], -d[0], -d[1], -d[2])
        # Rounding must not put the viewer of a grazed surface below its horizon.
        wo[m, 0], wo[m, 1], wo[m, 2] = x, y, max(0.0, z)


@kernel
def seen(n: Array, face: Array, x: float, y: float, z: float) -> bool:
    """Return whether a direction lies above both the horizon of the shading normal and that of the surface."""
    return bool(n[0] * x + n[1] * y + n[2] * z > 0 and face[0] * x + face[1] * y + face[2] * z > 0)


@parallel_kernel
def onwards(normal: Array, faces: Array, wi: Array, pdf: Array, directions: Array) -> None:
    """Write drawn directions ``wi`` (n, 3) in the world; ``pdf`` (n,) becomes 0 where they lead into the surface."""
    for m in prange(len(wi)):
        x, y, z = to_world(normal[m], wi[m, 0], wi[m, 1], wi[m, 2])
        directions[m, 0], directions[m, 1], directions[m, 2] = x, y, z
        if not (wi[m, 2] > 0 and seen(normal[m], faces[m], x, y, z)):
            pdf[m] = 0.0


@parallel_kernel
def to_sky(normal: Array, faces: Array, directions: Array, wi: Array, radiance: Array, distance: Array) -> None:
    """Write the same as ``to_sun`` for ``directions`` that were drawn from the sky, whose ``radiance`` is given."""
    for m in prange(len(normal)):
        x, y, z = directions[m, 0], directions[m, 1], directions[m, 2]
        r = radiance[m]
        arrive(normal[m], faces[m], x, y, z, r[0], r[1], r[2], m, directions, wi, radiance)
        distance[m] = math.inf


@parallel_kernel
def to_sun(
    sun: Array, normal: Array, faces: Array, directions: Array, wi: Array, radiance: Array, distance: Array
) -> None:
    """Write the way (n, 3) to the ``sun``: direction, irradiance (6,); what it would light (n, 3), cosine included."""
    for m in prange(len(normal)):
        arrive(normal[m], faces[m], sun[0], sun[1], sun[2], sun[3], sun[4], sun[5], m, directions, wi, radiance)
        distance[m] = math.inf


@parallel_kernel
def to_point(
    lamp: Array,
    position: Array,
    normal: Array,
    faces: Array,
    directions: Array,
    wi: Array,
    radiance: Array,
    distance: Array,
) -> None:
    """Write the same for a point ``lamp``: position, intensity (6,)."""
    for m in prange(len(normal)):
        x, y, z = lamp[0] - position[m, 0], lamp[1] - position[m, 1], lamp[2] - position[m, 2]
        d2 = max(x * x + y * y + z * z, 1e-300)
        d = math.sqrt(d2)
        arrive(
            normal[m],
            faces[m],
            x / d,
            y / d,
            z / d,
            lamp[3] / d2,
            lamp[4] / d2,
            lamp[5] / d2,
            m,
            directions,
            wi,
            radiance,
        )
        distance[m] = d


@parallel_kernel
def to_rectangle(
    cut: Cut,
    slots: Array,
    pair: int,
    rectangle: Array,
    glow: Array,
    position: Array,
    normal: Array,
    faces: Array,
    directions: Array,
    wi: Array,
    radiance: Array,
    distance: Array,
    pdf: Array,
) -> None:
    """Write the same for a random place on a ``rectangle`` (12,) of radiance ``glow`` (3,), and its density ``pdf``."""
    r = rectangle
    area = 4.0 * math.sqrt((r[3] * r[3] + r[4] * r[4] + r[5] * r[5]) * (r[6] * r[6] + r[7] * r[7] + r[8] * r[8]))
    for m in prange(len(normal)):
        u, v = number(cut, slots[m], pair)
        u, v = 2.0 * u - 1.0, 2.0 * v - 1.0
        x = r[0] + u * r[3] + v * r[6] - position[m, 0]
        y = r[1] + u * r[4] + v * r[7] - position[m, 1]
        z = r[2] + u * r[5] + v * r[8] - position[m, 2]
        d2 = max(x * x + y * y + z * z, 1e-300)
        d = math.sqrt(d2)
        x, y, z = x / d, y / d, z / d
        facing = -(x * r[9] + y * r[10] + z * r[11])
        lit = 1.0 if facing > 0 else 0.0
        arrive(normal[m], faces[m], x, y, z, lit * glow[0], lit * glow[1], lit * glow[2], m, directions, wi, radiance)
        distance[m] = d
        pdf[m] = d2 / (area * facing) if facing > 0 else math.inf


@kernel
def arrive(
    n: Array,
    face: Array,
    x: float,
    y: float,
    z: float,
    red: float,
    green: float,
    blue: float,
    m: int,
    directions: Array,
    wi: Array,
    radiance: Array,
) -> None:
    """Write a direction in the world and in the frame of ``n``, and its light times the cosine, 0 below a horizon."""
    directions[m, 0], directions[m, 1], directions[m, 2] = x, y, z
    a, b, c = to_local(n, x, y, z)
    wi[m, 0], wi[m, 1], wi[m, 2] = a, b, c
    cosine = c if seen(n, face, x, y, z) else 0.0
    radiance[m, 0], radiance[m, 1], radiance[m, 2] = red * cosine, green * cosine, blue * cosine


@parallel_kernel
def glowing(
    directions: Array, distance: Array, lamp: Array, rectangles: Array, glows: Array, radiance: Array, pdf: Array
) -> None:
    """Write the radiance (n, 3) of the lamps (n,) that rays meet, and with what density (n,) they would be drawn.

    ``rectangles`` (K, 12), ``glows`` (K, 3); the back of a lamp is black.
    """
    for m in prange(len(directions)):
        r, glow = rectangles[lamp[m]], glows[lamp[m]]
        facing = -(directions[m, 0] * r[9] + directions[m, 1] * r[10] + directions[m, 2] * r[11])
        if facing > 0:
            area = 4.0 * math.sqrt(
                (r[3] * r[3] + r[4] * r[4] + r[5] * r[5]) * (r[6] * r[6] + r[7] * r[7] + r[8] * r[8])
            )
            radiance[m, 0], radiance[m, 1], radiance[m, 2] = glow[0], glow[1], glow[2]
            pdf[m] = distance[m] * distance[m] / (area * facing)
        else:
            radiance[m, 0], radiance[m, 1], radiance[m, 2] = 0.0, 0.0, 0.0
            pdf[m] = 0.0


@kernel
def shining(radiance: Array) -> Array:
    """Return the rows of ``radiance`` (n, 3) that are not black."""
    rows, count = np.empty(len(radiance), dtype=np.intp), 0
    for m in range(len(radiance)):
        if radiance[m, 0] > 0 or radiance[m, 1] > 0 or radiance[m, 2] > 0:
            rows[count] = m
            count += 1
    return rows[:count].copy()


@kernel
def collect(at: Array, f: Array, light: Array, out: Array) -> None:
    """Add f (k, 3) times light (k, 3) to the rows ``at`` (k,) of ``out``, in order."""
    for k in range(len(at)):
        for c in range(3):
            out[at[k], c] += f[k, c] * light[k, c]
