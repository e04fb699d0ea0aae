"""Correlations and means, of lists without missing values."""

from collections.abc import Sequence

import numpy as np

from bvbedit.brdf.geometry import Floats

# Fewer pairs correlate by accident.
FEWEST = 3


def median(values: Sequence[float]) -> float:
    """Return the median of ``values``, one at least."""
    return float(np.median(np.asarray(values, dtype=np.float64)))


def pearson(x: Sequence[float] | Floats, y: Sequence[float] | Floats) -> float | None:
    """Return the linear correlation of ``x`` and ``y`` (n,); None for fewer than three pairs or where one is constant.

    Values are scaled by their largest first: squares of what is near the ends of float64's range would leave it.
    """
    a, b = (_centred(np.asarray(v, dtype=np.float64)) for v in (x, y))
    if len(a) < FEWEST or not a.any() or not b.any():
        return None
    return float(np.clip(a @ b / np.sqrt((a @ a) * (b @ b)), -1.0, 1.0))


def spearman(x: Sequence[float] | Floats, y: Sequence[float] | Floats) -> float | None:
    """Return the correlation of the ranks of ``x`` and ``y`` (n,), those of ties being their mean; None as pearson."""
    return pearson(ranks(x), ranks(y))


def ranks(values: Sequence[float] | Floats) -> Floats:
    """Return the ranks (n,) of ``values`` (n,), from 1; equal ones share the mean of theirs."""
    v = np.asarray(values, dtype=np.float64)
    _, inverse, counts = np.unique(v, return_inverse=True, return_counts=True)
    last = np.cumsum(counts)
    return np.asarray((last - (counts - 1) / 2)[inverse], dtype=np.float64)


def _centred(v: Floats) -> Floats:
    if len(v) == 0:
        return v
    scale = float(np.abs(v).max())
    if scale == 0 or float(np.ptp(v / scale)) < 1e-12:
        return np.zeros_like(v)
    centred = v / scale - np.mean(v / scale)
    return np.asarray(centred / np.abs(centred).max())
