"""How directions of light are drawn from an environment: more where more light arrives from.

The classical way (Pharr, Jakob & Humphreys, "Physically Based Rendering", on infinite area lights): a marginal
distribution of rows and conditional ones within each row, inverted. Its cells are the patches of the bilinear look-up,
between the centres of four texels: where a look-up is positive one of the four is, and so the density is too.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bvbedit.render.lights import Texels

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class EnvironmentDensity:
    """A density of directions over solid angle (1/sr) for a lat-long picture ``texels`` (h, w, 3) that is not black.

    In each of h + 1 rows of w patches (see environment_kernels) it is constant and proportional to the mean of the
    look-up, so that the mean over channels of the radiance never exceeds four times what the density stands for.
    ``rows`` (h + 2,) and ``columns`` (h + 1, w + 1) are distribution functions from 0 to 1; a row that is black has
    zeros. ``scale`` (1/sr per unit of radiance) times the mean radiance of a patch is its density.

    ``unevenness``, 1 for an even light, tells whether sampling pays. It is 4 pi times the integral of the squared
    density: draws that are even over the sphere have the relative variance unevenness - 1. A glaring spot of hardly any
    power adds nothing to it.
    """

    texels: Texels
    rows: Floats
    columns: Floats
    scale: float
    unevenness: float

    @classmethod
    def of(cls, texels: Texels) -> "EnvironmentDensity | None":
        """Return the density for the ``texels`` (h, w, 3) of an environment, finite and not negative; None if black."""
        height, width, _ = texels.shape
        means = _patch_means(texels)
        power = means * solid_angles(height, width)[:, None]
        columns = np.zeros((height + 1, width + 1))
        np.cumsum(power, axis=1, out=columns[:, 1:])
        of_rows = columns[:, -1:].copy()
        rows = np.concatenate([[0.0], np.cumsum(of_rows)])
        total = rows[-1]
        if total == 0:
            return None
        # Divided by themselves, the last entries are exactly 1: no number below 1 is beyond them.
        rows /= total
        np.divide(columns, of_rows, out=columns, where=of_rows > 0)
        density = means / total
        texels = texels.view()
        for table in (texels, rows, columns):
            table.flags.writeable = False
        return cls(
            texels,
            rows,
            columns,
            scale=1.0 / float(total),
            unevenness=4 * np.pi * float(np.sum(density * (power / total))),
        )


def solid_angles(height: int, width: int) -> Floats:
    """Return the solid angle (height + 1,) in steradians of one patch in each row, from zenith to nadir."""
    edges = np.concatenate([[0.0], np.arange(height) + 0.5, [height]]) * np.pi / height
    # cos a - cos b as a product, which does not cancel in the small caps of fine pictures.
    middles, halves = (edges[:-1] + edges[1:]) / 2, np.diff(edges) / 2
    return np.asarray(2 * np.sin(middles) * np.sin(halves) * (2 * np.pi / width))


def _patch_means(texels: Texels) -> Floats:
    """Return the mean (h + 1, w) of the four corners of each patch and over channels; float64 holds any sum."""
    grey = np.einsum("rck->rc", texels, dtype=np.float64) / 3
    pairs = grey + np.roll(grey, -1, axis=1)
    pairs = np.concatenate([pairs[:1], pairs, pairs[-1:]])
    return np.asarray((pairs[:-1] + pairs[1:]) / 4)
