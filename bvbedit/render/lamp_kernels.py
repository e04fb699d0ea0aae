"""Light that is looked for: one direction towards each lamp, and to the sky, from every vertex. Compiled, unchecked."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bvbedit.jit import kernel
from bvbedit.render.environment_kernels import draw, look_up
from bvbedit.render.geometry import NEVER, first_met, rectangle_area, to_local
from bvbedit.render.kernels import seen
from bvbedit.render.sequence import point

Array = NDArray[Any]

# A shadow ray stops this share of its way before the lamp.
BEFORE_LAMP = 1e-6


@kernel
def light_of_lamps(
    slots: Array,
    position: Array,
    normal: Array,
    faces: Array,
    states: Array,
    samples: Array,
    suns: Array,
    points: Array,
    lamps: Array,
    radiance: Array,
    texels: Array,
    rows: Array,
    columns: Array,
    spheres: Array,
    planes: Array,
    rectangles: Array,
    first_pair: int,
    sky_scale: float,
    sized: bool,
) -> tuple[Array, Array, Array, Array, Array]:
    """Return as Lit the light of all Lamps, or only of those without size unless ``sized``, that shapes do not hide.

    The sky is one of them if it has a ``sky_scale``, that of its density. Random numbers are the pairs from
    ``first_pair`` on.
    """
    first_rectangle, count = len(suns) + len(points), len(slots)
    the_sky = first_rectangle + len(lamps)
    L = the_sky + int(sky_scale > 0)
    directions, distance, wi = np.empty((count, L, 3)), np.empty((count, L)), np.empty((count, L, 3))
    light, pdfs = np.zeros((count, L, 3)), np.ones((count, L))
    looked_for = L if sized else first_rectangle
    for n in range(count):
        px, py, pz = position[n, 0], position[n, 1], position[n, 2]
        for j in range(looked_for):
            limit, pdf = NEVER, 1.0
            if j < len(suns):
                x, y, z, red, green, blue = suns[j, 0], suns[j, 1], suns[j, 2], suns[j, 3], suns[j, 4], suns[j, 5]
            elif j < first_rectangle:
                k = j - len(suns)
                x, y, z = points[k, 0] - px, points[k, 1] - py, points[k, 2] - pz
                d2 = max(x * x + y * y + z * z, 1e-300)
                limit = math.sqrt(d2)
                x, y, z = x / limit, y / limit, z / limit
                red, green, blue = points[k, 3] / d2, points[k, 4] / d2, points[k, 5] / d2
            else:
                u, v = point(states[slots[n]], samples[slots[n]], first_pair + j)
                if j < the_sky:
                    k = j - first_rectangle
                    u, v = 2.0 * u - 1.0, 2.0 * v - 1.0
                    x = lamps[k, 0] + u * lamps[k, 3] + v * lamps[k, 6] - px
                    y = lamps[k, 1] + u * lamps[k, 4] + v * lamps[k, 7] - py
                    z = lamps[k, 2] + u * lamps[k, 5] + v * lamps[k, 8] - pz
                    d2 = max(x * x + y * y + z * z, 1e-300)
                    limit = math.sqrt(d2)
                    x, y, z = x / limit, y / limit, z / limit
                    red, green, blue = radiance[k, 0], radiance[k, 1], radiance[k, 2]
                    facing = -(x * lamps[k, 9] + y * lamps[k, 10] + z * lamps[k, 11])
                    pdf = d2 / (rectangle_area(lamps, k) * facing) if facing > 0 else 0.0
                else:
                    x, y, z, pdf = draw(texels, rows, columns, sky_scale, u, v)
                    red, green, blue = look_up(texels, x, y, z)
            directions[n, j, 0], directions[n, j, 1], directions[n, j, 2] = x, y, z
            a, b, cosine = to_local(normal[n, 0], normal[n, 1], normal[n, 2], x, y, z)
            wi[n, j, 0], wi[n, j, 1], wi[n, j, 2] = a, b, cosine
            pdfs[n, j], distance[n, j] = pdf, limit * (1.0 - BEFORE_LAMP)
            if pdf > 0 and (red > 0 or green > 0 or blue > 0) and seen(normal, faces, n, x, y, z):
                _, which = first_met(px, py, pz, x, y, z, distance[n, j], spheres, planes, rectangles)
                if which < 0:
                    light[n, j, 0], light[n, j, 1], light[n, j, 2] = red * cosine, green * cosine, blue * cosine
    return directions, distance, wi, light, pdfs
