"""What tests of the renderer measure with: light meters, plain materials, and meshes that need no file."""

import numpy as np

from bvbedit.brdf.analytic import Lambert
from bvbedit.brdf.base import Brdf
from bvbedit.render import render, stage
from bvbedit.render.meshes import Mesh
from bvbedit.render.scene import Camera, ConstantEnvironment, Scene

BLACK = ConstantEnvironment((0, 0, 0))
WHITE = Lambert(1.0)
# So narrow a view, in degrees, that every ray of a picture is the same to 1e-6: a light meter.
NARROW = 1e-5


class Scaled(Brdf):
    """A material of no symmetry, multiplied by a factor."""

    def __init__(self, factor):
        self.factor = factor

    def _evaluate(self, wi, wo):
        f = self.factor * (wi[:, :1] + wo[:, 2:] ** 4 + 1.5) * [0.3, 0.2, 0.1]
        return f, np.ones(len(wi), dtype=bool)


def unit(*v):
    return np.array(v) / np.linalg.norm(v)


def meter(position, look_at):
    """A camera that measures one ray."""
    along = np.subtract(look_at, position)
    up = (0, 0, 1) if np.hypot(along[0], along[1]) > 0 else (0, 1, 0)
    return Camera(position, look_at, NARROW, up)


def measured(model, position, look_at, objects, environment=BLACK, lights=(), *, depth=1, side=1, spp=1, seed=0):
    """The radiance (3,) along one ray, the mean of side x side pixels."""
    scene = Scene(meter(position, look_at), objects, environment, lights, depth)
    return render(model, scene, width=side, height=side, spp=spp, seed=seed).mean(axis=(0, 1), dtype=float)


def in_memory(monkeypatch, **meshes):
    """Let MeshFile(name) mean one of ``meshes``: no file is read, and no process started for it."""
    monkeypatch.setattr(stage, "read_mesh", lambda name: meshes[name])


def square(side=1.0, height=0.0):
    """A horizontal square around the z axis, its outside above."""
    s = side / 2
    return Mesh([[-s, -s, height], [s, -s, height], [s, s, height], [-s, s, height]], [[0, 1, 2], [0, 2, 3]])
