"""Scenes from files: the ones that have a name, people's own, and the sphere in a panorama."""

from dataclasses import replace
from os import PathLike, fspath
from pathlib import Path

from bvbedit.brdf.materials import is_material
from bvbedit.errors import BvbError
from bvbedit.render.lights import Panorama
from bvbedit.render.scene import MeshFile, Object, Scene, Sphere

FOLDER = Path(__file__).parent / "scenes"
NAMES = ("sphere", "studio", "furnace")


def scene_of(scene: str | PathLike[str] | Scene) -> Scene:
    """Return the scene that is given, or that a name, the path of a .toml file or of an .exr panorama stands for.

    Raises BvbError for unknown names, files that cannot be read, and for what a scene cannot be.
    """
    if isinstance(scene, Scene):
        return scene
    if not isinstance(scene, str | PathLike):
        raise BvbError(f"scene is {type(scene).__name__}. Give a name, the path of a .toml or .exr file, or a Scene.")
    name = fspath(scene)
    if name in NAMES:
        return read_scene(FOLDER / f"{name}.toml")
    if name.lower().endswith(".toml"):
        return read_scene(name)
    if name.lower().endswith(".exr"):
        return scene_with_environment(name)
    raise BvbError(
        f"Unknown scene {name!r}. Choose one of {', '.join(NAMES)}, or name a .toml scene or a lat-long .exr picture."
    )


def read_scene(path: str | PathLike[str]) -> Scene:
    """Return the scene of a ``.toml`` file; the files that it names lie beside it.

    Raises BvbError that names file, line and key of what is wrong.
    """
    from bvbedit.io.settings import read_settings

    scene = read_settings(path, Scene, what="scene")
    folder = Path(path).parent
    environment = scene.environment
    if isinstance(environment, Panorama):
        environment = replace(environment, file=str(folder / environment.file))
    return replace(scene, environment=environment, objects=tuple(_found(x, folder) for x in scene.objects))


def scene_with_environment(path: str | PathLike[str]) -> Scene:
    """Return the sphere, on no ground, in the panorama (RGB radiance, see LatLongEnvironment) of an .exr file."""
    return Scene(scene_of("sphere").camera, (Sphere(),), Panorama(fspath(path)))


def _found(thing: Object, folder: Path) -> Object:
    """Return an object whose files are looked for in ``folder``."""
    if isinstance(thing.material, str) and not is_material(thing.material):
        thing = replace(thing, material=str(folder / thing.material))
    return replace(thing, file=str(folder / thing.file)) if isinstance(thing, MeshFile) else thing
