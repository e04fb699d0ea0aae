"""The wavefront: from pixels to the pairs of directions at which the material is asked. Compiled; nothing is checked.

Paths that end without the material (the sky, the ground) are summed here. A path that meets the sphere stops there and
leaves what the material must be multiplied by, so that any Brdf can be evaluated in bulk.
"""

import math
from typing import Any

import numpy as np
from numba import prange
from numpy.typing import NDArray

from bvbedit.jit import kernel, parallel_kernel
from bvbedit.render.geometry import NEVER, cosine_direction, sphere_distance, tangent
from bvbedit.render.sequence import mix, point

Array = NDArray[Any]
RGB = tuple[float, float, float]
Ball = tuple[float, float, float, float]

# Which pair of random numbers serves what.
PIXEL, SKY, BOUNCE = 0, 1, 2


@kernel
def look_up(texels: Array, x: float, y: float, z: float) -> RGB:
    """Return the radiance that arrives from a unit direction: the lat-long picture, bilinear, wrapped in azimuth."""
    height, width = texels.shape[0], texels.shape[1]
    row = math.atan2(math.hypot(x, y), z) / math.pi * height - 0.5
    column = (0.5 + math.atan2(x, y) / (2.0 * math.pi)) * width - 0.5
    r, c = math.floor(row), math.floor(column)
    a, b = row - r, column - c
    r0, r1 = max(r, 0), min(r + 1, height - 1)
    c0, c1 = c % width, (c + 1) % width
    w00, w01, w10, w11 = (1 - a) * (1 - b), (1 - a) * b, a * (1 - b), a * b
    p, q, s, t = texels[r0, c0], texels[r0, c1], texels[r1, c0], texels[r1, c1]
    return (
        w00 * p[0] + w01 * q[0] + w10 * s[0] + w11 * t[0],
        w00 * p[1] + w01 * q[1] + w10 * s[1] + w11 * t[1],
        w00 * p[2] + w01 * q[2] + w10 * s[2] + w11 * t[2],
    )


@kernel
def ground_radiance(
    x: float, y: float, u: float, v: float, sphere: Ball, ground: Array, sun: Array, texels: Array
) -> RGB:
    """Return one sample of the light that the ground sends back from (x, y): sky and sun, or the sphere's shadow."""
    cx, cy, cz, radius = sphere
    height = ground[0]
    dx, dy, dz = cosine_direction(u, v)
    red = green = blue = 0.0
    if sphere_distance(x, y, height, dx, dy, dz, cx, cy, cz, radius) == NEVER:
        red, green, blue = look_up(texels, dx, dy, dz)
    if len(sun) and sun[2] > 0 and sphere_distance(x, y, height, sun[0], sun[1], sun[2], cx, cy, cz, radius) == NEVER:
        cosine = sun[2] / math.pi
        red, green, blue = red + sun[3] * cosine, green + sun[4] * cosine, blue + sun[5] * cosine
    return red * ground[1], green * ground[2], blue * ground[3]


@parallel_kernel
def trace(
    first: int,
    first_sample: int,
    shape: tuple[int, int],
    seed: np.uint64,
    camera: Array,
    sphere: Ball,
    ground: Array,
    sun: Array,
    texels: Array,
    direct: Array,
    wi: Array,
    wo: Array,
    light: Array,
    lit: Array,
) -> None:
    """Trace every sample of a run of pixels.

    ``first`` is the first pixel's number in the picture of ``shape`` (h, w). ``camera`` (4, 3): position, then right,
    up and forward, where right and up reach the middle of the right and the upper edge. ``sphere``: centre, radius.
    ``ground``: height, albedo, or empty. ``sun``: direction, irradiance, or empty. ``texels`` (h, w, 3). Writes, per
    pixel: ``direct`` (n, 3), the sum over samples that need no material; and per sample and light (n, s, k): ``lit``,
    whether light arrives; there ``wi``, ``wo`` in the sphere's frame, and ``light``, by which f_r is multiplied:
    radiance times cosine over density (elsewhere zero). Light 0 is the surroundings, light 1 the sun.
    """
    height, width = shape
    cx, cy, cz, radius = sphere
    for pixel in prange(direct.shape[0]):
        state = mix(seed, np.uint64(first + pixel))
        row, column = divmod(first + pixel, width)
        red = green = blue = 0.0
        for s in range(lit.shape[1]):
            for k in range(lit.shape[2]):
                lit[pixel, s, k] = False
                light[pixel, s, k, 0] = light[pixel, s, k, 1] = light[pixel, s, k, 2] = 0.0

            # A ray through a random place in the pixel.
            u, v = point(state, first_sample + s, PIXEL)
            a, b = 2.0 * (column + u) / width - 1.0, 1.0 - 2.0 * (row + v) / height
            dx = camera[3, 0] + a * camera[1, 0] + b * camera[2, 0]
            dy = camera[3, 1] + a * camera[1, 1] + b * camera[2, 1]
            dz = camera[3, 2] + a * camera[1, 2] + b * camera[2, 2]
            length = math.sqrt(dx * dx + dy * dy + dz * dz)
            dx, dy, dz = dx / length, dy / length, dz / length

            # What it meets first.
            t = sphere_distance(camera[0, 0], camera[0, 1], camera[0, 2], dx, dy, dz, cx, cy, cz, radius)
            u, v = point(state, first_sample + s, SKY)
            if t == NEVER:
                if len(ground) and dz < 0:
                    t = (ground[0] - camera[0, 2]) / dz
                    x, y = camera[0, 0] + t * dx, camera[0, 1] + t * dy
                    r, g, b = ground_radiance(x, y, u, v, sphere, ground, sun, texels)
                else:
                    r, g, b = look_up(texels, dx, dy, dz)
                red, green, blue = red + r, green + g, blue + b
                continue

            # The frame on the sphere: tangent (tx, ty, 0), bitangent n x t, normal n.
            x, y, z = camera[0, 0] + t * dx, camera[0, 1] + t * dy, camera[0, 2] + t * dz
            nx, ny, nz = (x - cx) / radius, (y - cy) / radius, (z - cz) / radius
            tx, ty = tangent(nx, ny)
            bx, by, bz = -nz * ty, nz * tx, nx * ty - ny * tx
            ox, oy, oz = -(dx * tx + dy * ty), -(dx * bx + dy * by + dz * bz), -(dx * nx + dy * ny + dz * nz)

            # Light from the surroundings: the sky, or the ground below the horizon.
            lx, ly, lz = cosine_direction(u, v)
            ex, ey, ez = lx * tx + ly * bx + lz * nx, lx * ty + ly * by + lz * ny, ly * bz + lz * nz
            if len(ground) and ez < 0:
                t = (ground[0] - z) / ez
                u, v = point(state, first_sample + s, BOUNCE)
                r, g, b = ground_radiance(x + t * ex, y + t * ey, u, v, sphere, ground, sun, texels)
            else:
                r, g, b = look_up(texels, ex, ey, ez)
            if r > 0 or g > 0 or b > 0:
                lit[pixel, s, 0] = True
                wi[pixel, s, 0, 0], wi[pixel, s, 0, 1], wi[pixel, s, 0, 2] = lx, ly, lz
                wo[pixel, s, 0, 0], wo[pixel, s, 0, 1], wo[pixel, s, 0, 2] = ox, oy, oz
                light[pixel, s, 0, 0], light[pixel, s, 0, 1], light[pixel, s, 0, 2] = (
                    r * math.pi,
                    g * math.pi,
                    b * math.pi,
                )

            # Light from the sun. A sphere does not shade the side that faces the sun; the ground shades all from below.
            if len(sun) and not (len(ground) and sun[2] < 0):
                cosine = sun[0] * nx + sun[1] * ny + sun[2] * nz
                if cosine > 0:
                    lit[pixel, s, 1] = True
                    wi[pixel, s, 1, 0] = sun[0] * tx + sun[1] * ty
                    wi[pixel, s, 1, 1] = sun[0] * bx + sun[1] * by + sun[2] * bz
                    wi[pixel, s, 1, 2] = cosine
                    wo[pixel, s, 1, 0], wo[pixel, s, 1, 1], wo[pixel, s, 1, 2] = ox, oy, oz
                    light[pixel, s, 1, 0] = sun[3] * cosine
                    light[pixel, s, 1, 1] = sun[4] * cosine
                    light[pixel, s, 1, 2] = sun[5] * cosine
        direct[pixel, 0], direct[pixel, 1], direct[pixel, 2] = red, green, blue
