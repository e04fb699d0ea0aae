"""The groups of arrays that the kernels of rendering are handed, one after the other."""

from typing import Any, NamedTuple

from numpy.typing import NDArray

Array = NDArray[Any]


class Shapes(NamedTuple):
    """What rays meet besides meshes, numbered in this order: spheres, planes, rectangles."""

    spheres: Array
    """(S, 4): centre, radius."""
    planes: Array
    """(P,): heights."""
    rectangles: Array
    """(R, 12): centre, half the width and half the height as vectors, and normal."""


class Draws(NamedTuple):
    """Where each slot of a wave has its random numbers: they depend on seed, pixel and sample alone."""

    states: Array
    """(m,) uint64, hashed."""
    samples: Array
    """(m,)."""


class Rays(NamedTuple):
    """Rays (n, 3), (n, 3), how far they go (n,), and the number (n,) of what they meet, -1 for nothing."""

    origins: Array
    directions: Array
    distance: Array
    which: Array


class Normals(NamedTuple):
    """The geometric and the shading normal (n, 3) where rays meet meshes; of no length where there are no meshes."""

    faces: Array
    shading: Array


class Vertices(NamedTuple):
    """Points (n,) on surfaces, sorted by material."""

    parents: Array
    """The ray that led here."""
    slots: Array
    position: Array
    """(n, 3), above the surface."""
    normal: Array
    """(n, 3), of the frame."""
    faces: Array
    """(n, 3), of the surface itself; both are turned to the viewer."""
    wo: Array
    """(n, 3), in the frame."""
    gathers: Array
    """Whether light from other surfaces is followed to them."""


class Glow(NamedTuple):
    """What shines when a ray ends there."""

    texels: Array
    """(h, w, 3): the environment; (0, 0, 3) for a black one."""
    radiance: Array
    """(R, 3), of the rectangles."""
    rectangles: Array
    """(R, 12), as those of Shapes."""


class Lamps(NamedTuple):
    """What is sampled as a light, in this order: suns and points, which have no size, then rectangles and the sky."""

    suns: Array
    """(., 6): direction, irradiance."""
    points: Array
    """(., 6): position, intensity."""
    rectangles: Array
    """(R, 12), as those of Shapes."""
    radiance: Array
    """(R, 3)."""
    texels: Array
    """(h, w, 3), and the distribution functions of its density: see ``environment_kernels``."""
    rows: Array
    columns: Array


class Lit(NamedTuple):
    """What L lamps send to each of n vertices."""

    directions: Array
    """(n, L, 3), in the world."""
    distance: Array
    """(n, L): where the shadow ray ends."""
    wi: Array
    """(n, L, 3), in the frame."""
    light: Array
    """(n, L, 3): radiance times the cosine, or for lamps without size irradiance; 0 in the dark."""
    pdf: Array
    """(n, L): the density of the direction; 1 for lamps without size."""
