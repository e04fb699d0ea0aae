"""The wavefront: from pixels to the pairs of directions at which the material is asked. Compiled; nothing is checked.

Paths that end without the material (the sky, the ground) are summed here. A path that meets the sphere stops there, so
that any Brdf can be asked in bulk where it goes on, and is taken up again from the directions that were drawn.
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


@kernel
def below_horizon(sun: Array, ground: Array) -> bool:
    """Return whether the ground shades all from the sun."""
    return len(ground) > 0 and sun[2] < 0


@parallel_kernel
def see(
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
    seen: Array,
    normal: Array,
    wo: Array,
    numbers: Array,
    sunlit: Array,
    to_sun: Array,
) -> None:
    """Send every camera ray of a run of pixels.

    ``first`` is the first pixel's number in the picture of ``shape`` (h, w). ``camera`` (4, 3): position, then right,
    up and forward, where right and up reach the middle of the right and the upper edge. ``sphere``: centre, radius.
    ``ground``: height, albedo, or empty. ``sun``: direction, irradiance, or empty. ``texels`` (h, w, 3). Writes, per
    pixel: ``direct`` (n, 3), the sum over samples that need no material; and per sample (n, s): ``seen``, whether it
    meets the sphere; there its ``normal``, ``wo`` in the sphere's frame, ``numbers`` (n, s, 2) to draw a direction by,
    ``sunlit``, and where that is true the direction ``to_sun`` in that frame.
    """
    height, width = shape
    cx, cy, cz, radius = sphere
    for pixel in prange(direct.shape[0]):
        state = mix(seed, np.uint64(first + pixel))
        row, column = divmod(first + pixel, width)
        red = green = blue = 0.0
        for s in range(seen.shape[1]):
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
            seen[pixel, s], sunlit[pixel, s] = t != NEVER, False
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
            nx = (camera[0, 0] + t * dx - cx) / radius
            ny = (camera[0, 1] + t * dy - cy) / radius
            nz = (camera[0, 2] + t * dz - cz) / radius
            tx, ty = tangent(nx, ny)
            bx, by, bz = -nz * ty, nz * tx, nx * ty - ny * tx
            normal[pixel, s, 0], normal[pixel, s, 1], normal[pixel, s, 2] = nx, ny, nz
            wo[pixel, s, 0], wo[pixel, s, 1] = -(dx * tx + dy * ty), -(dx * bx + dy * by + dz * bz)
            # Rounding must not put the viewer of a grazed sphere below its horizon.
            wo[pixel, s, 2] = max(0.0, -(dx * nx + dy * ny + dz * nz))
            numbers[pixel, s, 0], numbers[pixel, s, 1] = u, v

            # A sphere does not shade the side that faces the sun.
            if len(sun) and not below_horizon(sun, ground):
                cosine = sun[0] * nx + sun[1] * ny + sun[2] * nz
                if cosine > 0:
                    sunlit[pixel, s] = True
                    to_sun[pixel, s, 0] = sun[0] * tx + sun[1] * ty
                    to_sun[pixel, s, 1] = sun[0] * bx + sun[1] * by + sun[2] * bz
                    to_sun[pixel, s, 2] = cosine
        direct[pixel, 0], direct[pixel, 1], direct[pixel, 2] = red, green, blue


@parallel_kernel
def arrive(
    first: int,
    first_sample: int,
    samples: int,
    seed: np.uint64,
    sphere: Ball,
    ground: Array,
    sun: Array,
    texels: Array,
    asked: Array,
    normal: Array,
    wi: Array,
    radiance: Array,
) -> None:
    """Write the ``radiance`` (m, 3) that arrives at the sphere from the drawn directions ``wi`` (m, 3), in its frame.

    ``asked`` (m,) are the numbers of the samples, ``samples`` for each pixel, whose normals are ``normal`` (m, 3): the
    sky, or below the horizon the ground, of whose light one sample is taken.
    """
    cx, cy, cz, radius = sphere
    for m in prange(len(asked)):
        nx, ny, nz = normal[m, 0], normal[m, 1], normal[m, 2]
        tx, ty = tangent(nx, ny)
        bx, by, bz = -nz * ty, nz * tx, nx * ty - ny * tx
        lx, ly, lz = wi[m, 0], wi[m, 1], wi[m, 2]
        ex, ey, ez = lx * tx + ly * bx + lz * nx, lx * ty + ly * by + lz * ny, ly * bz + lz * nz
        if len(ground) and ez < 0:
            t = (ground[0] - (cz + radius * nz)) / ez
            state = mix(seed, np.uint64(first + asked[m] // samples))
            u, v = point(state, first_sample + asked[m] % samples, BOUNCE)
            x, y = cx + radius * nx + t * ex, cy + radius * ny + t * ey
            r, g, b = ground_radiance(x, y, u, v, sphere, ground, sun, texels)
        else:
            r, g, b = look_up(texels, ex, ey, ez)
        radiance[m, 0], radiance[m, 1], radiance[m, 2] = r, g, b
