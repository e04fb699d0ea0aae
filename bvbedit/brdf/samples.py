"""Pairs drawn from the sample sets, as the metric sees them in a chart: what fits are judged and polished by.

An interest brings its own pairs in their place, all of them, as one set.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.charts import Chart
from bvbedit.brdf.encodings import Encoding
from bvbedit.brdf.geometry import Floats
from bvbedit.brdf.interest import Interest
from bvbedit.brdf.losses import Loss
from bvbedit.brdf.problem import Weights, checked_weights
from bvbedit.brdf.sample_sets import LARGEST_REFLECTANCE, Pairs, draw
from bvbedit.spline.tensor import TensorSpline

Indices = NDArray[np.int64]

# Pairs drawn from each set: at least so many, and so many for each control point.
FEWEST = 100_000
FOR_EACH_POINT = 6
MOST = 600_000
# Of these every so many-th is kept aside to judge a step by: samples that noise fills are easily followed too closely.
JUDGE = 5
# Cells of each axis in whose order samples are fitted: a pass over them meets control points that are in the cache.
CELLS = 32


@dataclass(frozen=True)
class Samples:
    """Pairs drawn from the sample sets, as the metric sees them in a chart."""

    parameters: Floats
    """(N, 3)."""
    reflectance: Floats
    """(N, 3)."""
    cosines: tuple[Floats, Floats]
    """(N, 1) of the elevations."""
    parts: tuple[slice, slice]
    """The places of each set."""
    weights: Floats
    """(N, 1 or 3): what a squared error counts, 1 at most."""

    def errors(self, f: Floats, loss: Loss) -> Floats:
        """Return the metric over each of the sets (2,), but for its scale, of a model's reflectance ``f`` (N, 3)."""
        e = loss.transform(f, *self.cosines) - loss.transform(self.reflectance, *self.cosines)
        # A set without a sample, as tables with large holes have it, says nothing: the other one speaks for it.
        found = [self.norm(e, part, loss) for part in self.parts if self.weights[part].any()]
        return np.array([found[0], found[-1]]) if found else np.zeros(2)

    def norm(self, error: Floats, part: slice, loss: Loss) -> float:
        """Return ``loss.norm`` of the errors of T (N, 3) in a part, each counted by its weight."""
        weights = self.weights[part]
        mean = float(weights.mean()) if weights.any() else 1.0
        return loss.norm(error[part] * weights ** (1 / loss.power)) / float(np.sqrt(mean))

    def metrics(self, errors: Floats, loss: Loss) -> tuple[float, float]:
        """Return the metric itself over each of the sets, for the ``errors`` (2,) of a model."""
        target = loss.transform(self.reflectance, *self.cosines)
        grid, nodes = (loss.metric(float(e), target[part]) for e, part in zip(errors, self.parts, strict=True))
        return grid, nodes

    def errors_of(self, spline: TensorSpline, encoding: Encoding, loss: Loss) -> Floats:
        """Return ``errors`` of the model that ``spline`` is in these samples' chart."""
        return self.errors(encoding.decode(spline.evaluate(self.parameters)), loss)


def draw_samples(
    brdf: Brdf, chart: Chart, count: int, seed: int = 0, weights: Weights | Interest | None = None
) -> Samples:
    """Return about ``count`` pairs of each set, with the reflectance of ``brdf``; ``seed`` chooses which.

    Pairs without data behind them are left out. Of an interest, all its pairs are returned in place of the sets.
    Raises BvbError for weights that are none.
    """
    return in_chart(drawn(brdf, count, seed, weights), chart, weights)


@dataclass(frozen=True)
class Reflectance:
    """Pairs of the sample sets with data behind them, and the reflectance there."""

    pairs: Pairs
    f: Floats
    """(N, 3)."""


def drawn(brdf: Brdf, count: int, seed: int = 0, weights: Weights | Interest | None = None) -> Reflectance:
    """Return about ``count`` pairs of each set with data behind them, or all those of an interest as one set."""
    if not isinstance(weights, Interest):
        return looked_up(brdf, draw(brdf, count, seed))
    # What is held where no data are is seen too.
    f = np.minimum(brdf.evaluate_unit(weights.wi, weights.wo)[0], LARGEST_REFLECTANCE)
    return Reflectance(Pairs(weights.wi, weights.wo, (len(f), 0)), f)


def looked_up(brdf: Brdf, pairs: Pairs) -> Reflectance:
    """Return those of the ``pairs`` behind which ``brdf`` has data, and its reflectance."""
    f, trusted = brdf.evaluate_unit(pairs.wi, pairs.wo)
    counts = np.array([np.count_nonzero(trusted[part]) for part in pairs.parts()])
    kept = Pairs(pairs.wi[trusted], pairs.wo[trusted], (int(counts[0]), int(counts[1])))
    return Reflectance(kept, np.minimum(f[trusted], LARGEST_REFLECTANCE))


def in_chart(reflectance: Reflectance, chart: Chart, weights: Weights | Interest | None = None) -> Samples:
    """Return pairs and reflectance as samples in ``chart``, those of an interest by what they count.

    Raises BvbError for weights that are none.
    """
    pairs = reflectance.pairs
    parameters = chart.to_parameters(pairs.wi, pairs.wo)
    if isinstance(weights, Interest):
        given = weights.counts / weights.counts.max()
    elif weights is None:
        given = np.ones((len(parameters), 1))
    else:
        given = checked_weights(weights, chart, parameters)[:, None]
    cosines = pairs.wi[:, 2:], pairs.wo[:, 2:]
    return Samples(parameters, reflectance.f, cosines, pairs.parts(), given)


def split(samples: Samples) -> tuple[Samples, Samples]:
    """Return the samples to fit, neighbours in the chart next to one another, and those to judge by."""
    judging = np.arange(len(samples.parameters)) % JUDGE == 0
    cells = np.minimum((CELLS * samples.parameters).astype(np.int64), CELLS - 1) @ [CELLS * CELLS, CELLS, 1]
    fitted, judged = [], []
    for part in samples.parts:
        places = np.arange(part.start, part.stop)
        chosen = places[~judging[part]]
        # Of equals the first comes first, whatever the sort.
        fitted.append(chosen[np.argsort(cells[chosen] * len(cells) + chosen)])
        judged.append(places[judging[part]])
    return _taken(samples, fitted), _taken(samples, judged)


def _taken(samples: Samples, places: list[Indices]) -> Samples:
    """Return the samples at the ``places`` of each set."""
    at, count = np.concatenate(places), len(places[0])
    return Samples(
        samples.parameters[at],
        samples.reflectance[at],
        (samples.cosines[0][at], samples.cosines[1][at]),
        (slice(0, count), slice(count, len(at))),
        samples.weights[at],
    )


def samples_for(points: int) -> int:
    """Return how many pairs of each set a net of so many control points needs."""
    return min(max(FEWEST, FOR_EACH_POINT * points), MOST)
