"""Lobes: f(wi, wo) over all wo at one theta_i, drawn in spherical coordinates (Lee & Park 2008, Fig. 2).

The radius is the length of the colour vector, compressed by a scale; the colour is the colour. Pure functions that
return arrays, and PyVista meshes of them; no window is opened here. Light comes from the -x side:
wi = (-sin theta_i, 0, cos theta_i).
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.encodings import Encoding, Linear, Root
from bvbedit.brdf.geometry import Floats, spherical

if TYPE_CHECKING:
    from pyvista import PolyData

# The name of the point array of a mesh that holds its colour (sRGB bytes).
COLOUR = "colour"
# Above this ratio of the longest radius to the median a linear lobe is a needle on a dot.
LINEAR_RANGE = 20.0
# Half of the great circles leave the mirror direction at equal angles, half reach the horizon in equal steps: seen from
# just above it, nearly all of the horizon lies within a few degrees of sideways.
CIRCLES = 400
# While a slider moves, half as many circles and steps will do: a quarter of the time.
COARSER = 2
# Fractions of the way from the mirror direction to the horizon: 1 degree steps or finer nearly everywhere, and 64
# more in geometric progression towards the mirror direction, the first at 0.002 to 0.02 degrees. Chrome's lobe is half
# a degree wide.
FRACTIONS = np.union1d(np.linspace(0, 1, 121), np.geomspace(1e-4, 0.12, 64))


@dataclass(frozen=True)
class Lobe:
    """A lobe, uncompressed, on a mesh that is polar about the mirror direction, see ``mirror_mesh``."""

    wo: Floats
    """(n, 3) unit vectors."""
    triangles: NDArray[np.int64]
    """(m, 3), facing outwards."""
    length: Floats
    """(n,) of f, in 1/sr."""
    colour: NDArray[np.uint8]
    """(n, 3) sRGB bytes, the largest channel at full brightness."""

    @property
    def peak(self) -> float:
        """The largest length, in 1/sr."""
        return float(self.length.max())

    @property
    def circles(self) -> int:
        """How many great circles the mesh has: the first triangles are the fan about its vertex 0."""
        return int((self.triangles[:, 0] == 0).sum())


def mirror_mesh(theta_i: float, coarser: int = 1) -> tuple[Floats, NDArray[np.int64]]:
    """Return unit vectors (n, 3) that cover the upper hemisphere, and the triangles (m, 3) between them.

    The mesh is polar about the mirror direction of ``theta_i`` (radians, below pi/2), vertex 0, and densest there; its
    rim is the horizon. ``coarser``: every so-manieth circle and step.
    """
    circles = CIRCLES // coarser
    fractions = np.append(FRACTIONS[:-1:coarser], FRACTIONS[-1])
    mirror, across = spherical(theta_i, 0.0), np.array([0.0, 1.0, 0.0])
    # Towards the retro-reflective side; mirror, across and up are right-handed, so that triangles face outwards.
    up = np.cross(mirror, across)
    half = np.arange(0, circles, 2) * (2 * np.pi / circles)
    rim = spherical(np.pi / 2, half + np.pi / circles)
    beta = np.sort(np.concatenate([half, np.arctan2(rim @ up, rim @ across) % (2 * np.pi)]))
    tangent = np.cos(beta)[:, None] * across + np.sin(beta)[:, None] * up
    # Along each great circle from the mirror direction, z = cos a mirror_z + sin a tangent_z falls to zero once.
    horizon = np.arctan2(mirror[2], -tangent[:, 2])
    angle = fractions[1:, None] * horizon
    rings = np.cos(angle)[..., None] * mirror + np.sin(angle)[..., None] * tangent
    rings[-1, :, 2] = 0.0
    directions = np.concatenate([mirror[None], rings.reshape(-1, 3)])

    here = np.arange(circles)
    there = (here + 1) % circles
    fan = np.stack([np.zeros_like(here), 1 + here, 1 + there], axis=-1)
    inner = 1 + circles * np.arange(len(rings) - 1)[:, None]
    a, b, c, d = inner + here, inner + there, inner + circles + here, inner + circles + there
    bands = np.stack([np.stack([a, c, d], axis=-1), np.stack([a, d, b], axis=-1)], axis=2)
    return directions, np.concatenate([fan, bands.reshape(-1, 3)]).astype(np.int64)


def lobe(brdf: Brdf, theta_i: float, coarser: int = 1) -> Lobe:
    """Return the lobe of ``brdf`` at ``theta_i`` (radians, below pi/2); ``coarser`` as in ``mirror_mesh``."""
    wo, triangles = mirror_mesh(theta_i, coarser)
    f = brdf.evaluate(spherical(theta_i, np.pi), wo)
    return Lobe(wo, triangles, np.linalg.norm(f, axis=-1), true_colour(f))


def points(shown: Lobe, scale: Encoding, peak: float) -> Floats:
    """Return the vertices (n, 3) of a lobe with radius scale(length)/scale(peak), cut beyond ``peak`` (1/sr)."""
    radius = scale.encode(np.minimum(shown.length, peak)) / scale.encode(np.array(peak))
    return np.asarray(shown.wo * radius[:, None])


def surface(shown: Lobe, vertices: Floats) -> "PolyData":
    """Return the mesh of a lobe, coloured, with normals; its ``vertices`` are ``points``."""
    import pyvista as pv

    mesh: PolyData = pv.PolyData.from_regular_faces(vertices, cast(Any, shown.triangles))
    mesh.point_data[COLOUR] = shown.colour
    smooth: PolyData = mesh.compute_normals(cell_normals=False, split_vertices=False, consistent_normals=False)
    return smooth


def wire(shown: Lobe, vertices: Floats) -> "PolyData":
    """Return every 16th great circle and ring of the mesh of a lobe as lines, coloured; see ``surface``."""
    import pyvista as pv

    circles = shown.circles
    rings = (len(shown.wo) - 1) // circles
    index = 1 + np.arange(rings * circles).reshape(rings, circles)
    round_lines = [np.append(ring, ring[0]) for ring in index[7::8]]
    out_lines = [np.append(0, index[:, k]) for k in range(0, circles, max(1, circles // 24))]
    lines = np.concatenate([np.append(len(line), line) for line in (*round_lines, *out_lines)])
    net = pv.PolyData(vertices, lines=lines)
    net.point_data[COLOUR] = shown.colour
    return net


def fitting_scale(shown: Lobe) -> Encoding:
    """Return the scale that shows a lobe whole: linear, or the cube root where the dynamic range is large."""
    return Linear() if shown.peak <= LINEAR_RANGE * np.median(shown.length) else Root()


def true_colour(f: Floats) -> NDArray[np.uint8]:
    """Return sRGB bytes (n, 3) of linear RGB ``f`` (n, 3) >= 0, the largest channel at full brightness; black stays."""
    from bvbedit.render.tonemap import tone_map

    largest = f.max(axis=-1, keepdims=True)
    return np.asarray(tone_map((f / np.where(largest > 0, largest, 1.0))[None])[0])


def rings(scale: Encoding, peak: float) -> list[tuple[float, float]]:
    """Return (length in 1/sr, radius) of two round lengths up to ``peak``, for a ground grid."""
    highest = 10.0 ** np.floor(np.log10(peak))
    highest *= max(m for m in (1, 2, 5) if m * highest <= peak * (1 + 1e-12))
    # Under a cube root a tenth of the length has 46 % of the radius.
    lengths = highest * np.array([1.0, 0.5 if isinstance(scale, Linear) else 0.1])
    radii = scale.encode(lengths) / scale.encode(np.array(peak))
    return list(zip(lengths.tolist(), radii.tolist(), strict=True))


def hides(vertices: Floats, point: Floats, eye: Floats) -> bool:
    """Return whether a mesh stands between ``point`` (3,) and a viewer far away in the direction ``eye`` (3,).

    Judged by its ``vertices`` (n, 3) alone, which in a lobe of radius 1 stand closer than the 0.03 that count as a hit.
    """
    away = vertices - point
    towards = eye / np.linalg.norm(eye)
    depth = away @ towards
    return bool(((depth > 0) & (np.linalg.norm(away - depth[:, None] * towards, axis=-1) < 0.03)).any())
