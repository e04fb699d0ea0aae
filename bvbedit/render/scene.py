"""What is looked at: objects, what they are made of, and the light on them, as plain values that a file can hold.

The world is right-handed with z up. Lengths have no unit; radiance, irradiance and intensity are linear RGB, angles are
in degrees. Nothing here knows how a picture is computed. Field by field this is what a scene file says.
"""

from dataclasses import dataclass
from numbers import Real
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from bvbedit.errors import BvbError
from bvbedit.render.lights import ConstantEnvironment, Environment, Light
from bvbedit.render.values import Vector, check_positive, set_fields, vector

# The number of a model that is rendered, from 1; a sample material's name, or a file; or the colour of a diffuse one.
Material = int | str | Vector

# Surfaces that light may meet on its way.
DEEPEST = 16
MOST_MODELS = 1000


@dataclass(frozen=True)
class Camera:
    """A pinhole at ``position`` that looks at the point ``look_at``, with square pixels.

    Raises BvbError for coinciding points, an ``up`` along the view, or a field of view outside 0 to 180 degrees.
    """

    position: Vector
    look_at: Vector
    vertical_fov_degrees: float
    up: Vector = (0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        set_fields(
            self, position=vector(self.position, "camera position"), look_at=vector(self.look_at, "camera look_at")
        )
        set_fields(self, up=vector(self.up, "camera up"))
        if not (isinstance(self.vertical_fov_degrees, Real) and 0 < self.vertical_fov_degrees < 180):
            raise BvbError(f"vertical_fov_degrees is {self.vertical_fov_degrees!r}. Give an angle between 0 and 180.")
        forward = np.subtract(self.look_at, self.position)
        if np.linalg.norm(np.cross(forward, self.up)) <= 1e-9 * np.linalg.norm(forward) * np.linalg.norm(self.up):
            raise BvbError("The camera looks nowhere or along its own up. Move look_at or change up.")

    def frame(self) -> NDArray[np.float64]:
        """Return the unit vectors to the right, up and forward (3, 3), one per row."""
        forward = np.subtract(self.look_at, self.position)
        right = np.cross(forward, self.up)
        rows = np.stack([right, np.cross(right, forward), forward])
        return np.asarray(rows / np.linalg.norm(rows, axis=1, keepdims=True))


@dataclass(frozen=True)
class Sphere:
    """A ball."""

    centre: Vector = (0.0, 0.0, 1.0)
    radius: float = 1.0
    material: Material = 1
    kind: Literal["sphere"] = "sphere"

    def __post_init__(self) -> None:
        set_fields(self, centre=vector(self.centre, "sphere centre"), material=_material(self.material))
        check_positive(self.radius, "sphere radius")


@dataclass(frozen=True)
class Plane:
    """An endless horizontal plane at z = ``height``.

    ``direct_light_only``: lamps and sky light it, and objects throw shadows on it, but what these reflect is not
    followed to it. A mirror's caustics are nearly all noise.
    """

    height: float = 0.0
    material: Material = (0.5, 0.5, 0.5)
    direct_light_only: bool = False
    kind: Literal["plane"] = "plane"

    def __post_init__(self) -> None:
        set_fields(self, material=_material(self.material))
        if not (isinstance(self.height, Real) and np.isfinite(self.height)):
            raise BvbError(f"plane height is {self.height!r}. Give a finite number.")


@dataclass(frozen=True)
class MeshFile:
    """The triangles of a ``file`` (whatever PyVista reads: .obj, .ply, .stl, ...), scaled, then moved."""

    file: str
    scale: float = 1.0
    translation: Vector = (0.0, 0.0, 0.0)
    material: Material = 1
    kind: Literal["mesh"] = "mesh"

    def __post_init__(self) -> None:
        set_fields(self, translation=vector(self.translation, "mesh translation"), material=_material(self.material))
        check_positive(self.scale, "mesh scale")


@dataclass(frozen=True)
class Blob:
    """A smooth body of height 2 that stands on z = 0, with hills, hollows and grazing parts; scaled, then moved."""

    scale: float = 1.0
    translation: Vector = (0.0, 0.0, 0.0)
    material: Material = 1
    kind: Literal["blob"] = "blob"

    def __post_init__(self) -> None:
        set_fields(self, translation=vector(self.translation, "blob translation"), material=_material(self.material))
        check_positive(self.scale, "blob scale")


Object = Sphere | Plane | MeshFile | Blob


# Files tell objects, environments and lights apart by their kind.
KIND = Field(discriminator="kind")
BLACK = ConstantEnvironment((0.0, 0.0, 0.0))


@dataclass(frozen=True)
class Scene:
    """A camera, objects, and their light.

    ``depth``: how many surfaces light may meet on its way, 1 for direct light alone. Raises BvbError where there is no
    object, for a camera below the plane or inside a sphere, and a depth outside 1 to 16.
    """

    camera: Camera
    objects: tuple[Annotated[Object, KIND], ...]
    environment: Annotated[Environment, KIND] = BLACK
    lights: tuple[Annotated[Light, KIND], ...] = ()
    depth: int = 1

    def __post_init__(self) -> None:
        set_fields(self, objects=tuple(self.objects), lights=tuple(self.lights))
        if not self.objects:
            raise BvbError("The scene has no objects. Give one at least.")
        if not isinstance(self.depth, int | np.integer) or not 1 <= self.depth <= DEEPEST:
            raise BvbError(f"depth is {self.depth!r}. Give a whole number from 1 (direct light) to {DEEPEST}.")
        for thing in self.objects:
            if isinstance(thing, Sphere):
                distance = np.linalg.norm(np.subtract(self.camera.position, thing.centre))
                if distance <= thing.radius:
                    raise BvbError("The camera is inside a sphere. Move it out.")
            if isinstance(thing, Plane) and self.camera.position[2] <= thing.height:
                raise BvbError("The camera is not above the plane. Raise it.")

    def models(self) -> int:
        """Return how many models it asks for: the largest number that is the material of an object."""
        return max((m.material for m in self.objects if isinstance(m.material, int)), default=0)


def _material(value: Any) -> Material:
    if isinstance(value, str):
        if value:
            return value
    elif isinstance(value, int | np.integer) and not isinstance(value, bool):
        if 1 <= value <= MOST_MODELS:
            return int(value)
    elif np.size(value) == 3:
        return vector(value, "material", lowest=0.0, highest=1.0)
    raise BvbError(
        f"material is {value!r}. Give the number of a model (1, 2, ...), the name of a sample material or a file, or "
        "the three parts of a diffuse colour in 0 ... 1."
    )
