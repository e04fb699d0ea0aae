"""Environments looked up and drawn many times over, by the same kernels as the renderer's."""

import numpy as np

from bvbedit.jit import kernel
from bvbedit.render.environment import EnvironmentDensity
from bvbedit.render.environment_kernels import draw, look_up, pdf_of


def drawn(density: EnvironmentDensity, numbers):
    """Return unit directions (n, 3) drawn by ``numbers`` (n, 2) in [0, 1), their radiance (n, 3) and pdf (n,)."""
    directions, pdf = _drawn(density.texels, density.rows, density.columns, density.scale, numbers)
    return directions, arriving(density, directions)[0], pdf


def arriving(density: EnvironmentDensity, directions):
    """Return the radiance (n, 3) that arrives from unit ``directions`` (n, 3), and their pdf (n,)."""
    return _arriving(density.texels, density.scale, directions)


@kernel
def _drawn(texels, rows, columns, scale, numbers):
    directions, pdf = np.empty((len(numbers), 3)), np.empty(len(numbers))
    for n in range(len(numbers)):
        x, y, z, pdf[n] = draw(texels, rows, columns, scale, numbers[n, 0], numbers[n, 1])
        directions[n, 0], directions[n, 1], directions[n, 2] = x, y, z
    return directions, pdf


@kernel
def _arriving(texels, scale, directions):
    radiance, pdf = np.empty((len(directions), 3)), np.empty(len(directions))
    for n in range(len(directions)):
        x, y, z = directions[n, 0], directions[n, 1], directions[n, 2]
        radiance[n, 0], radiance[n, 1], radiance[n, 2] = look_up(texels, x, y, z)
        pdf[n] = pdf_of(texels, scale, x, y, z)
    return radiance, pdf
