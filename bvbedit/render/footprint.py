"""Where a scene looks at a material, and what it counts there: the interest of a fit that serves this scene."""

from os import PathLike

import numpy as np

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.geometry import Floats
from bvbedit.brdf.interest import Interest
from bvbedit.brdf.losses import PictureError
from bvbedit.brdf.sample_sets import LARGEST_REFLECTANCE
from bvbedit.errors import BvbError
from bvbedit.render.prepared import PreparedScene
from bvbedit.render.scene import Scene

# The picture whose look-ups are counted.
SIDE, SPP, SEED = 128, 16, 0
# The mean reflectance of a material is taken to be no smaller (1/sr).
BLACK = 1e-6


def footprint(brdf: Brdf, scene: str | PathLike[str] | Scene) -> Interest:
    """Return where ``scene`` looks at ``brdf``, and what errors count there on an 8-bit screen at exposure 0.

    An error of f changes a pixel by the light that arrives there, and the screen by the slope of its curve. Errors at
    all look-ups of a pixel are taken to have one sign, as those of a smooth model nearly have: the loss over what they
    count is an upper bound, to first order, of the root mean square error of the pixels that show the model.
    Raises BvbError where the scene shows no model, or no light falls on it.
    """
    prepared = PreparedScene(brdf, scene, width=SIDE, height=SIDE, spp=SPP, seed=SEED)
    asked = prepared.look_ups(brdf)
    seen = asked.light * _screen_slope(prepared.shade(brdf).reshape(-1, 3).astype(np.float64))[asked.pixel]
    if not seen.any():
        raise BvbError("The scene shows nothing of the model that a screen could tell. Light it, or choose another.")
    f = np.minimum(brdf.evaluate_unit(asked.wi, asked.wo)[0], LARGEST_REFLECTANCE)
    mean = max(float(np.sum(seen * f) / np.sum(seen)), BLACK)
    pixels, place = np.unique(asked.pixel, return_inverse=True)
    whole = np.zeros((len(pixels), 3))
    np.add.at(whole, place, seen * (f + mean))
    counts = seen * whole[place]
    # So that the mean over pixels and channels is what a mean weighted by the counts, over channels, becomes.
    scale = float(np.sqrt(counts.sum() / whole.size))
    return Interest(asked.wi, asked.wo, counts, PictureError(mean=mean, scale=scale))


def _screen_slope(radiance: Floats) -> Floats:
    """Return by how much a screen's value in 0 ... 1 grows with ``radiance``: the derivative of sRGB's curve.

    What is clipped hides an error, unless that is as large as the excess: it counts by its share of the radiance.
    """
    shown = np.clip(radiance, 0.0031308, 1.0)
    slope = np.where(radiance <= 0.0031308, 12.92, 1.055 / 2.4 * shown ** (1 / 2.4 - 1))
    return np.asarray(slope / np.maximum(radiance, 1.0))
