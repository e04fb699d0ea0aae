"""A scene made ready: its values as arrays for the kernels, its materials as BRDFs with their densities."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bvbedit.brdf.analytic import Lambert
from bvbedit.brdf.base import Brdf
from bvbedit.brdf.density import Density
from bvbedit.brdf.materials import is_material, material_named
from bvbedit.errors import BvbError
from bvbedit.io import load
from bvbedit.jit import frozen
from bvbedit.render.arrays import Glow, Lamps, Shapes
from bvbedit.render.embree import CLEARANCE, Tracer
from bvbedit.render.environment import EnvironmentDensity
from bvbedit.render.lights import PointLight, RectangleLight, Sun
from bvbedit.render.meshes import Mesh, blob, read_mesh
from bvbedit.render.scene import Blob, Camera, Material, MeshFile, Object, Plane, Scene, Sphere

Floats = NDArray[np.float64]

# An environment is sampled as a light where it is so uneven: materials find what is evenly bright by themselves.
WORTH_SAMPLING = 2.0
# What stands for a black environment.
BLACK = frozen(np.zeros((0, 0, 3), dtype=np.float32))
NOTHING = frozen(np.zeros(0)), frozen(np.zeros((0, 0)))


@dataclass(frozen=True)
class Stage:
    """What the wavefront needs. Things that can be met are numbered: spheres, planes, rectangles, then meshes."""

    camera: Camera
    spheres: Floats
    """(S, 4): centre, radius."""
    planes: Floats
    """(P,): heights."""
    rectangles: Floats
    """(R, 12): centre, half the width and half the height as vectors, and normal of each lamp."""
    glows: Floats
    """(R, 3): their radiance."""
    meshes: Tracer | None
    lift: float
    suns: Floats
    """(., 6): direction, irradiance."""
    points: Floats
    """(., 6): position, intensity."""
    sky: EnvironmentDensity | None
    """The environment, None where it is black."""
    sky_sampled: bool
    """Whether it is sampled as a light."""
    material_of: NDArray[np.int16]
    """The material of each thing that can be met, -1 for lamps."""
    gathers: NDArray[np.bool_]
    """Whether light from other surfaces is followed to each thing."""
    materials: tuple[Brdf, ...]
    densities: tuple[Density, ...]
    models: tuple[int | None, ...]
    """Which of the models that are rendered each material is, None for those that the scene itself names."""
    depth: int

    @property
    def lights(self) -> int:
        """How many lights are sampled."""
        return len(self.suns) + len(self.points) + len(self.rectangles) + self.sky_sampled

    @cached_property
    def shapes(self) -> Shapes:
        """What rays meet besides meshes."""
        return Shapes(self.spheres, self.planes, self.rectangles)

    @cached_property
    def glow(self) -> Glow:
        """What shines where rays end."""
        return Glow(BLACK if self.sky is None else self.sky.texels, self.glows, self.rectangles)

    @cached_property
    def lamps(self) -> Lamps:
        """What is sampled as a light."""
        sky = (BLACK, *NOTHING) if self.sky is None else (self.sky.texels, self.sky.rows, self.sky.columns)
        return Lamps(self.suns, self.points, self.rectangles, self.glows, *sky)

    @property
    def sky_scale(self) -> float:
        """What turns the sky's radiance into the density by which it is sampled; 0 if it is not."""
        return self.sky.scale if self.sky is not None and self.sky_sampled else 0.0

    @property
    def first_lamp(self) -> int:
        """The number of the first rectangle."""
        return len(self.spheres) + len(self.planes)

    def with_models(self, models: Sequence[Brdf]) -> "Stage":
        """Return the stage with other models; light is still drawn by the densities of the former ones."""
        materials = tuple(old if n is None else models[n] for old, n in zip(self.materials, self.models, strict=True))
        return replace(self, materials=materials)

    @cached_property
    def camera_array(self) -> Floats:
        """Position, then right, up and forward (4, 3): up reaches the upper edge, right is as long."""
        reach = np.tan(np.radians(self.camera.vertical_fov_degrees) / 2)
        return np.vstack([self.camera.position, self.camera.frame() * np.array([[reach], [reach], [1.0]])])


def make_stage(scene: Scene, models: Sequence[Brdf], densities: Sequence[Density] | None = None) -> Stage:
    """Return ``scene`` made ready to render ``models``, whose light is drawn by ``densities``, by default their own.

    Raises BvbError where the scene asks for more models than there are, for other than one density for each, and for
    files that cannot be read.
    """
    if scene.models() > len(models):
        raise BvbError(f"The scene asks for {scene.models()} models, {len(models)} given. Give as many.")
    if densities is not None and len(densities) != len(models):
        raise BvbError(f"{len(densities)} densities given for {len(models)} models. Give one for each.")
    spheres = [x for x in scene.objects if isinstance(x, Sphere)]
    planes = [x for x in scene.objects if isinstance(x, Plane)]
    meshed = [x for x in scene.objects if isinstance(x, MeshFile | Blob)]
    lamps = [x for x in scene.lights if isinstance(x, RectangleLight)]
    suns = [x for x in scene.lights if isinstance(x, Sun)]
    points = [x for x in scene.lights if isinstance(x, PointLight)]

    things: list[Object | None] = [*spheres, *planes, *([None] * len(lamps)), *meshed]
    named = list(dict.fromkeys(x.material for x in things if x is not None))
    own = densities if densities is not None else [None] * len(models)
    brdfs = [models[m - 1] if isinstance(m, int) else _material(m) for m in named]
    drawn = [own[m - 1] if isinstance(m, int) else None for m in named]

    triangles = [_mesh(x) for x in meshed]
    texels = frozen(np.ascontiguousarray(scene.environment.texels()))
    sky = EnvironmentDensity.of(texels)
    return Stage(
        camera=scene.camera,
        spheres=np.array([[*x.centre, x.radius] for x in spheres]).reshape(-1, 4),
        planes=np.array([x.height for x in planes], dtype=np.float64),
        rectangles=np.array([_rectangle(x) for x in lamps]).reshape(-1, 12),
        glows=np.array([x.radiance for x in lamps]).reshape(-1, 3),
        meshes=Tracer(triangles) if triangles else None,
        lift=CLEARANCE * _largest(triangles, scene.camera),
        suns=np.array([[*x.direction, *x.irradiance] for x in suns]).reshape(-1, 6),
        points=np.array([[*x.position, *x.intensity] for x in points]).reshape(-1, 6),
        sky=sky,
        sky_sampled=sky is not None and sky.unevenness > WORTH_SAMPLING,
        # Numbers of 16 bits are sorted in linear time.
        material_of=np.array([-1 if x is None else named.index(x.material) for x in things], dtype=np.int16),
        gathers=np.array([not (isinstance(x, Plane) and x.direct_light_only) for x in things]),
        materials=tuple(brdfs),
        densities=tuple(b.density if d is None else d for b, d in zip(brdfs, drawn, strict=True)),
        models=tuple(m - 1 if isinstance(m, int) else None for m in named),
        depth=int(scene.depth),
    )


def _material(name: Material) -> Brdf:
    """Return the BRDF of a diffuse colour, of a sample material, or of a file."""
    if isinstance(name, str):
        return material_named(name).brdf if is_material(name) else load(name)
    assert not isinstance(name, int)
    return Lambert(name)


def _mesh(thing: MeshFile | Blob) -> Mesh:
    mesh = blob() if isinstance(thing, Blob) else read_mesh(thing.file)
    return mesh.moved(thing.scale, thing.translation)


def _rectangle(lamp: RectangleLight) -> Floats:
    """Return centre, half its width and its height as vectors, and its normal (12,)."""
    width, height, normal = lamp.frame()
    return np.concatenate([lamp.centre, lamp.width / 2 * width, lamp.height / 2 * height, normal])


def _largest(meshes: Sequence[Mesh], camera: Camera) -> float:
    """Return the largest coordinate, counted from the centre of the meshes; 0 where there are none."""
    if not meshes:
        return 0.0
    corners = np.concatenate([m.bounds() for m in meshes])
    lowest, highest = corners.min(axis=0), corners.max(axis=0)
    return float(max(np.abs(camera.position - (lowest + highest) / 2).max(), (highest - lowest).max() / 2))
