"""Knot vectors: full, clamped, validated; where their knots are placed; Greville abscissae."""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bvbedit.errors import BvbError
from bvbedit.spline.arguments import is_whole, real_array, shown

Floats = NDArray[np.float64]
MAX_DEGREE = 16
# Beyond these, differences of knots and products of their quotients leave the range of float64.
LARGEST_KNOT = 1e100
SMALLEST_GAP = 1e-100


def checked_degree(degree: object) -> int:
    """Return ``degree`` as int. Raises BvbError outside 0 ... 16."""
    if not is_whole(degree) or not 0 <= degree <= MAX_DEGREE:
        raise BvbError(f"Degree {shown(degree)} is not supported. Choose a whole number in 0 ... {MAX_DEGREE}.")
    return int(degree)


def increasing(u: Floats) -> bool:
    """Return whether the row ``u`` (m,) is finite and each number larger than the one before."""
    return bool(np.isfinite(u).all() and (np.diff(u) > 0).all())


def checked_knots(knots: ArrayLike, degree: int) -> Floats:
    """Return ``knots`` as a read-only copy, if they are a full clamped knot vector of ``degree``.

    Clamped: both ends have multiplicity degree + 1 and no interior knot has more, so that size = len(knots) -
    degree - 1 control points belong to it. Raises BvbError that names the first offending index and value.
    """
    p = checked_degree(degree)
    t = np.array(real_array(knots, "Knots"))
    if t.ndim != 1 or len(t) < 2 * (p + 1):
        raise BvbError(f"Knots have shape {t.shape}. Degree {p} needs at least {2 * (p + 1)} knots in one row.")
    wild = ~(np.abs(t) <= LARGEST_KNOT)
    if wild.any():
        i = int(np.flatnonzero(wild)[0])
        raise BvbError(f"Knot {i} is {t[i]}. Knots must be finite, within {LARGEST_KNOT:g}.")
    gaps = np.diff(t)
    if (gaps < 0).any():
        i = int(np.flatnonzero(gaps < 0)[0]) + 1
        raise BvbError(f"Knot {i} is {t[i]}, below the one before, {t[i - 1]}. Knots must not decrease.")
    if ((gaps > 0) & (gaps < SMALLEST_GAP)).any():
        i = int(np.flatnonzero((gaps > 0) & (gaps < SMALLEST_GAP))[0])
        raise BvbError(
            f"Knots {i} and {i + 1} are {gaps[i]:g} apart. Make them equal, or {SMALLEST_GAP:g} or more apart."
        )
    if t[0] != t[p] or t[-1] != t[-p - 1]:
        raise BvbError(f"The knot vector is not clamped. Repeat the first and the last knot {p + 1} times.")
    over = np.flatnonzero(t[p + 1 :] == t[: -p - 1])
    if len(over):
        raise BvbError(f"Knot {over[0]} = {t[over[0]]} stands more than {p + 1} times. Degree {p} allows no more.")
    t.setflags(write=False)
    return t


def clamped(interior: ArrayLike, degree: int, start: float = 0.0, end: float = 1.0) -> Floats:
    """Return the full clamped knot vector with the given ``interior`` knots on [start, end]."""
    p = checked_degree(degree)
    left, inside, right = (real_array(part, "Knots") for part in ([start] * (p + 1), interior, [end] * (p + 1)))
    if inside.ndim != 1:
        raise BvbError(f"Interior knots have shape {inside.shape}. Give them in one row.")
    return checked_knots(np.concatenate([left, inside, right]), p)


def greville(knots: Floats, degree: int) -> Floats:
    """Return the Greville abscissae (n,), means of p consecutive knots; for degree 0 the middles of the spans."""
    if degree == 0:
        return np.asarray(0.5 * (knots[:-1] + knots[1:]))
    # Means of differences from the left end of each window, so that equal knots give exactly that knot.
    windows = np.lib.stride_tricks.sliding_window_view(knots[1:-1], degree)
    return np.asarray(windows[:, 0] + (windows - windows[:, :1]).mean(axis=1))


def piegl_tiller(parameters: Floats, size: int, degree: int) -> Floats:
    """Return the interior knots of Piegl & Tiller, The NURBS Book, equations 9.68 and 9.69: the paper's choice."""
    j = np.arange(1, size - degree)
    jd = j * (len(parameters) / (size - degree))
    i = jd.astype(int)
    alpha = jd - i
    return np.asarray((1 - alpha) * parameters[i - 1] + alpha * parameters[i])


def averaged(parameters: Floats, size: int, degree: int) -> Floats:
    """Return as interior knots the means of p consecutive parameters among those of n equi-spaced data indices."""
    index = np.arange(size) * ((len(parameters) - 1) / max(size - 1, 1))
    u = np.interp(index, np.arange(len(parameters)), parameters)
    if degree == 0:
        return np.asarray(0.5 * (u[:-1] + u[1:]))
    return np.asarray(np.lib.stride_tricks.sliding_window_view(u, degree).mean(axis=1)[1 : size - degree])


def uniform(parameters: Floats, size: int, degree: int) -> Floats:
    """Return equally spaced interior knots."""
    return np.linspace(parameters[0], parameters[-1], size - degree + 1)[1:-1]


PLACEMENTS: dict[str, Callable[[Floats, int, int], Floats]] = {
    "piegl-tiller": piegl_tiller,
    "averaged": averaged,
    "uniform": uniform,
}


def place_knots(placement: str, parameters: ArrayLike, size: int, degree: int) -> Floats:
    """Return a full clamped knot vector for ``size`` control points over data at increasing ``parameters`` (m,).

    Raises BvbError for an unknown placement, parameters that do not increase, and sizes that the degree or the data
    cannot carry.
    """
    p = checked_degree(degree)
    u = real_array(parameters, "Data parameters")
    if u.ndim != 1 or len(u) < 2 or not increasing(u):
        raise BvbError(
            f"Data parameters of shape {u.shape} are no increasing row. Give at least two finite numbers in order."
        )
    if not is_whole(size) or not p + 1 <= size <= len(u):
        raise BvbError(
            f"{shown(size)} control points cannot be placed over {len(u)} data at degree {p}. "
            f"Choose a whole number in {p + 1} ... {len(u)}."
        )
    if not isinstance(placement, str) or placement not in PLACEMENTS:
        raise BvbError(f"Unknown knot placement {shown(placement)}. Choose one of {', '.join(PLACEMENTS)}.")
    return clamped(PLACEMENTS[placement](u, size, p), p, u[0], u[-1])
