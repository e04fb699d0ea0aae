"""What a fitted model may do that a material does not: be negative, break reciprocity, ring around highlights."""

from itertools import product
from typing import Any

import numpy as np

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.geometry import Floats
from bvbedit.brdf.losses import LogCosine
from bvbedit.brdf.problem import MIRROR
from bvbedit.brdf.sample_sets import LARGEST_REFLECTANCE, Pairs, draw
from bvbedit.brdf.spline_brdf import SplineBrdf

# Pairs of each set that are looked at, and which.
PAIRS, SEED = 1_500, 2
# Half the side of the box in chart parameters in whose range of measured values a model should stay: a node's distance.
NEIGHBOURHOOD = 1 / 90
LOSS = LogCosine()


def soundness(model: SplineBrdf, reference: Brdf | None = None) -> dict[str, Any]:
    """Return how sound ``model`` is over pairs of the sample sets, as numbers by name.

    ``negative``: the share of encoded values below zero, which are evaluated as zero; ``lowest`` encoded value.
    ``reciprocity``: the root mean square of the difference of log(1 + c f) when light and viewer are exchanged, zero
    where the chart makes it so. With a ``reference``, ``overshoot_grid`` and ``overshoot_nodes``: the same for how far
    the model is outside the range of the reference within a node's distance, which is what rings do.
    """
    pairs = draw(model if reference is None else reference, PAIRS, SEED)
    cosines = pairs.wi[:, 2:], pairs.wo[:, 2:]
    parameters = model.chart.to_parameters(pairs.wi, pairs.wo)
    encoded = model.spline.evaluate(parameters)
    told: dict[str, Any] = {"negative": float(np.mean(encoded < 0)), "lowest": float(encoded.min())}
    values = LOSS.transform(model.encoding.decode(encoded), *cosines)
    told["reciprocity"] = 0.0
    if not model.chart.reciprocal:
        exchanged = LOSS.transform(model.evaluate_unit(pairs.wo, pairs.wi)[0], *cosines)
        told["reciprocity"] = LOSS.norm(exchanged - values)
    if reference is not None:
        lowest, highest = _range(reference, model, pairs, parameters, cosines)
        outside = np.maximum(np.maximum(values - highest, lowest - values), 0.0)
        for name, part in zip(("overshoot_grid", "overshoot_nodes"), pairs.parts(), strict=True):
            told[name] = LOSS.norm(outside[part])
    return told


def _range(
    reference: Brdf, model: SplineBrdf, pairs: Pairs, parameters: Floats, cosines: tuple[Floats, Floats]
) -> tuple[Floats, Floats]:
    """Return the smallest and the largest value (N, 3) of the reference around the pairs, they themselves included."""

    def looked_up(wi: Floats, wo: Floats) -> Floats:
        return np.minimum(reference.evaluate_unit(wi, wo)[0], LARGEST_REFLECTANCE)

    lowest = highest = LOSS.transform(looked_up(pairs.wi, pairs.wo), *cosines)
    around = []
    for step in product((-NEIGHBOURHOOD, 0.0, NEIGHBOURHOOD), repeat=3):
        wi, wo = model.chart.to_directions(np.clip(parameters + step, 0.0, 1.0))
        around.extend([(wi, wo), (wi * MIRROR, wo * MIRROR)])
    wi, wo = (np.concatenate(w) for w in zip(*around, strict=True))
    t = LOSS.transform(looked_up(wi, wo).reshape(-1, *lowest.shape), *cosines)
    lowest, highest = np.minimum(lowest, t.min(axis=0)), np.maximum(highest, t.max(axis=0))
    return lowest, highest
