"""The wavefront's steps: rays from pixels, surfaces where they end, what is looked up there. Compiled, unchecked.

Each runs on one thread: waves are what threads share. Materials are known by their numbers alone. Kernels are handed
arrays one by one, and take no views of rows: for tuples of arrays and for views numba counts references inside the
loops, which was measured to cost ten times the work.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bvbedit.jit import inlined_kernel, kernel
from bvbedit.render.environment_kernels import look_up, pdf_of
from bvbedit.render.geometry import NEVER, first_met, rectangle_area, to_local, to_world
from bvbedit.render.sequence import mix, point

Array = NDArray[Any]
# First pixel, first sample, samples of each pixel, seed.
Cut = tuple[int, int, int, np.uint64]

# The pair of random numbers that places a ray in its pixel; the others follow.
PIXEL = 0
# How light that a material's density finds is counted: all of it, by the balance heuristic, or only of what no light
# sampling finds.
ALL, BALANCED, ONLY_UNSAMPLED = 0, 1, 2


@kernel
def camera_rays(
    cut: Cut,
    shape: tuple[int, int],
    camera: Array,
    spheres: Array,
    planes: Array,
    rectangles: Array,
    states: Array,
    samples: Array,
    origins: Array,
    directions: Array,
    distance: Array,
    which: Array,
) -> None:
    """Write Draws and Rays through random places in the pixels of a wave of a picture of ``shape`` (h, w).

    A wave is a run of pixels with the same samples of each: slot m is sample ``first_sample + m % samples`` of pixel
    ``first + m // samples``. ``camera`` (4, 3): position, then right, up and forward, where up reaches the upper edge
    and right is as long.
    """
    first, first_sample, each, seed = cut
    height, width = shape
    for p in range(len(which) // each):
        row, column = divmod(first + p, width)
        state = mix(seed, np.uint64(first + p))
        for k in range(each):
            m = p * each + k
            states[m], samples[m] = state, first_sample + k
            u, v = point(state, first_sample + k, PIXEL)
            a, b = (2.0 * (column + u) - width) / height, 1.0 - 2.0 * (row + v) / height
            x = camera[3, 0] + a * camera[1, 0] + b * camera[2, 0]
            y = camera[3, 1] + a * camera[1, 1] + b * camera[2, 1]
            z = camera[3, 2] + a * camera[1, 2] + b * camera[2, 2]
            length = math.sqrt(x * x + y * y + z * z)
            x, y, z = x / length, y / length, z / length
            for c in range(3):
                origins[m, c] = camera[0, c]
            directions[m, 0], directions[m, 1], directions[m, 2] = x, y, z
            distance[m], which[m] = first_met(
                camera[0, 0], camera[0, 1], camera[0, 2], x, y, z, NEVER, spheres, planes, rectangles
            )


@kernel
def numbers(states: Array, samples: Array, slots: Array, pair: int) -> Array:
    """Return a pair of random numbers (n, 2) for each of ``slots`` (n,)."""
    out = np.empty((len(slots), 2))
    for n in range(len(slots)):
        out[n, 0], out[n, 1] = point(states[slots[n]], samples[slots[n]], pair)
    return out


@kernel
def meet(
    origins: Array,
    directions: Array,
    distance: Array,
    which: Array,
    slots: Array,
    wanted: Array,
    mesh_faces: Array,
    mesh_normals: Array,
    spheres: Array,
    planes: Array,
    material_of: Array,
    gathers: Array,
    materials: int,
    lift: float,
) -> tuple[Array, Array, Array, Array, Array, Array, Array, Array]:
    """Return Vertices where those Rays end that are ``wanted`` (n,), and where each material starts among them.

    ``slots`` (n,) of the rays; ``material_of`` and ``gathers`` are told for each thing that can be met. Points lie
    ``lift`` above the surface. Where a shading normal turns away from the viewer the geometric one takes its place.
    """
    starts = np.zeros(materials + 1, dtype=np.intp)
    for m in range(len(wanted)):
        if wanted[m]:
            starts[material_of[which[m]] + 1] += 1
    for k in range(materials):
        starts[k + 1] += starts[k]
    count, places = starts[materials], starts[:-1].copy()
    parents, of_slots, gather = np.empty(count, np.intp), np.empty(count, np.intp), np.empty(count, np.bool_)
    position, normal, faces, wo = np.empty((count, 3)), np.empty((count, 3)), np.empty((count, 3)), np.empty((count, 3))
    for m in range(len(wanted)):
        if not wanted[m]:
            continue
        thing = which[m]
        n = places[material_of[thing]]
        places[material_of[thing]] = n + 1
        parents[n], of_slots[n], gather[n] = m, slots[m], gathers[thing]
        dx, dy, dz, t = directions[m, 0], directions[m, 1], directions[m, 2], distance[m]
        px, py, pz = origins[m, 0] + t * dx, origins[m, 1] + t * dy, origins[m, 2] + t * dz
        fx, fy, fz = 0.0, 0.0, 1.0
        nx, ny, nz = fx, fy, fz
        if thing < len(spheres):
            cx, cy, cz, radius = spheres[thing, 0], spheres[thing, 1], spheres[thing, 2], spheres[thing, 3]
            fx, fy, fz = px - cx, py - cy, pz - cz
            length = math.sqrt(fx * fx + fy * fy + fz * fz)
            fx, fy, fz = fx / length, fy / length, fz / length
            nx, ny, nz = fx, fy, fz
            # On the sphere again: seen from afar, a small one would be missed by the rounding of the way.
            px, py, pz = cx + radius * fx, cy + radius * fy, cz + radius * fz
        elif thing >= len(spheres) + len(planes):
            fx, fy, fz = mesh_faces[m, 0], mesh_faces[m, 1], mesh_faces[m, 2]
            nx, ny, nz = mesh_normals[m, 0], mesh_normals[m, 1], mesh_normals[m, 2]
        if dx * fx + dy * fy + dz * fz > 0:
            fx, fy, fz = -fx, -fy, -fz
            nx, ny, nz = -nx, -ny, -nz
        if not dx * nx + dy * ny + dz * nz < 0:
            nx, ny, nz = fx, fy, fz
        faces[n, 0], faces[n, 1], faces[n, 2] = fx, fy, fz
        normal[n, 0], normal[n, 1], normal[n, 2] = nx, ny, nz
        position[n, 0], position[n, 1], position[n, 2] = px + lift * fx, py + lift * fy, pz + lift * fz
        x, y, z = to_local(nx, ny, nz, -dx, -dy, -dz)
        # Rounding must not put the viewer of a grazed surface below its horizon.
        wo[n, 0], wo[n, 1], wo[n, 2] = x, y, max(0.0, z)
    return parents, of_slots, position, normal, faces, wo, gather, starts


@inlined_kernel
def seen(normal: Array, faces: Array, n: int, x: float, y: float, z: float) -> bool:
    """Return whether a direction lies above both the horizon of shading normal n (., 3) and that of the surface."""
    above = normal[n, 0] * x + normal[n, 1] * y + normal[n, 2] * z > 0
    return bool(above and faces[n, 0] * x + faces[n, 1] * y + faces[n, 2] * z > 0)


@kernel
def onwards(
    position: Array,
    normal: Array,
    faces: Array,
    wi: Array,
    pdf: Array,
    spheres: Array,
    planes: Array,
    rectangles: Array,
) -> tuple[Array, Array, Array]:
    """Return Rays, but for their origins, along drawn directions ``wi`` (n, 3).

    ``pdf`` (n,) becomes 0 where they lead into the surface.
    """
    p = position
    directions, distance, which = np.empty((len(pdf), 3)), np.empty(len(pdf)), np.empty(len(pdf), np.intp)
    for n in range(len(pdf)):
        x, y, z = to_world(normal[n, 0], normal[n, 1], normal[n, 2], wi[n, 0], wi[n, 1], wi[n, 2])
        directions[n, 0], directions[n, 1], directions[n, 2] = x, y, z
        if pdf[n] > 0 and wi[n, 2] > 0 and seen(normal, faces, n, x, y, z):
            distance[n], which[n] = first_met(p[n, 0], p[n, 1], p[n, 2], x, y, z, NEVER, spheres, planes, rectangles)
        else:
            pdf[n], distance[n], which[n] = 0.0, NEVER, -1
    return directions, distance, which


@inlined_kernel
def arriving(
    which: int,
    distance: float,
    x: float,
    y: float,
    z: float,
    texels: Array,
    radiance: Array,
    rectangles: Array,
    sky_scale: float,
    first_lamp: int,
) -> tuple[float, float, float, float]:
    """Return the radiance of what shines at the end of a ray, and with what density it is sampled as a light, or 0."""
    if which < 0:
        if len(texels) == 0:
            return 0.0, 0.0, 0.0, 0.0
        red, green, blue = look_up(texels, x, y, z)
        return red, green, blue, pdf_of(texels, sky_scale, x, y, z) if sky_scale > 0 else 0.0
    k = which - first_lamp
    if 0 <= k < len(radiance):
        facing = -(x * rectangles[k, 9] + y * rectangles[k, 10] + z * rectangles[k, 11])
        # The back of a lamp is black.
        if facing > 0:
            pdf = distance * distance / (rectangle_area(rectangles, k) * facing)
            return radiance[k, 0], radiance[k, 1], radiance[k, 2], pdf
    return 0.0, 0.0, 0.0, 0.0


@kernel
def background(
    directions: Array,
    distance: Array,
    which: Array,
    texels: Array,
    radiance: Array,
    rectangles: Array,
    sky_scale: float,
    first_lamp: int,
) -> Array:
    """Return the radiance (m, 3) that rays find without any material."""
    d = directions
    out = np.empty((len(which), 3))
    for m in range(len(which)):
        out[m, 0], out[m, 1], out[m, 2], _ = arriving(
            which[m], distance[m], d[m, 0], d[m, 1], d[m, 2], texels, radiance, rectangles, sky_scale, first_lamp
        )
    return out


@kernel
def look_ups(
    wo: Array,
    wi: Array,
    pdf: Array,
    goes_on: Array,
    lit_wi: Array,
    lit_light: Array,
    directions: Array,
    distance: Array,
    which: Array,
    texels: Array,
    radiance: Array,
    rectangles: Array,
    sky_scale: float,
    first_lamp: int,
    counted: int,
) -> tuple[Array, Array, Array, Array, Array]:
    """Return what is looked up at vertices that are seen from ``wo`` (n, 3): which one (k,), wi, wo, light (k, 3).

    That is, vertex by vertex, the drawn direction ``wi`` (n, 3), where light arrives along its ray, counted as said, or
    where the path ``goes_on`` (n,); and directions to lamps (n, L, 3) with their light (n, L, 3) where that is not
    black. Last, which look-up the drawn direction of each vertex is (n,), or -1.
    """
    d, lamps = directions, lit_wi.shape[1]
    most = len(pdf) * (1 + lamps)
    at, number = np.empty(most, np.intp), np.empty(len(pdf), np.intp)
    out_wi, out_wo, light = np.empty((most, 3)), np.empty((most, 3)), np.empty((most, 3))
    k = 0
    for n in range(len(pdf)):
        number[n] = -1
        if pdf[n] > 0:
            red, green, blue, light_pdf = arriving(
                which[n], distance[n], d[n, 0], d[n, 1], d[n, 2], texels, radiance, rectangles, sky_scale, first_lamp
            )
            share = wi[n, 2] / pdf[n]
            if counted == BALANCED:
                share *= pdf[n] / (pdf[n] + light_pdf)
            elif counted == ONLY_UNSAMPLED and light_pdf > 0:
                share = 0.0
            red, green, blue = share * red, share * green, share * blue
            if goes_on[n] or red > 0 or green > 0 or blue > 0:
                number[n], at[k] = k, n
                light[k, 0], light[k, 1], light[k, 2] = red, green, blue
                for c in range(3):
                    out_wi[k, c], out_wo[k, c] = wi[n, c], wo[n, c]
                k += 1
        for j in range(lamps):
            if lit_light[n, j, 0] > 0 or lit_light[n, j, 1] > 0 or lit_light[n, j, 2] > 0:
                at[k] = n
                for c in range(3):
                    light[k, c], out_wi[k, c], out_wo[k, c] = lit_light[n, j, c], lit_wi[n, j, c], wo[n, c]
                k += 1
    return at[:k].copy(), out_wi[:k].copy(), out_wo[:k].copy(), light[:k].copy(), number


@kernel
def collect(at: Array, f: Array, light: Array, out: Array) -> None:
    """Add f (k, 3) times light (k, 3) to the rows ``at`` (k,) of ``out``, in order."""
    for k in range(len(at)):
        for c in range(3):
            out[at[k], c] += f[k, c] * light[k, c]
