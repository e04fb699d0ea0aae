"""Splines at scattered points: what the compiled loops need to be handed."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import factorial

import numpy as np
from numpy.typing import NDArray

from bvbedit.spline.basis import basis_derivatives, find_spans
from bvbedit.spline.knots import Floats

MAX_PARAMETERS = 4


@dataclass(frozen=True)
class Tables:
    """What finds a point's span and its basis functions quickly, for each axis."""

    bins: tuple[NDArray[np.int64], ...]
    """``span_bins`` of each axis."""
    polynomials: tuple[Floats, ...]
    """The basis functions of each span, (spans, p+1, p+1), in powers of (u - t_s)/(t_{s+1} - t_s)."""


def tables(knots: Sequence[Floats], degrees: Sequence[int]) -> Tables:
    """Return the tables of a spline over full clamped ``knots``."""
    axes = list(zip(knots, degrees, strict=True))
    return Tables(
        tuple(span_bins(t, p) for t, p in axes),
        tuple(_polynomials(t, p) for t, p in axes),
    )


def span_bins(knots: Floats, degree: int) -> NDArray[np.int64]:
    """Return the spans at the left ends of about four equal bins for each control point."""
    count = 4 * (len(knots) - degree - 1)
    return find_spans(knots, degree, np.linspace(knots[0], knots[-1], count + 1)[:-1])


def evaluate_cubic_rgb(knots: Sequence[Floats], made: Tables, control: Floats, x: Floats, out: Floats) -> None:
    """Evaluate a tricubic volume with three channels at ``x`` (n, 3), inside the domain, into ``out`` (n, 3)."""
    from bvbedit.spline import kernels

    t0, t1, t2 = knots
    b0, b1, b2 = made.bins
    p0, p1, p2 = made.polynomials
    kernels.evaluate_cubic_rgb(x, t0, t1, t2, b0, b1, b2, p0, p1, p2, control, out)


def evaluate_any(knots: Sequence[Floats], degrees: Sequence[int], control: Floats, x: Floats, out: Floats) -> None:
    """Evaluate a spline of 1 to 4 parameters at ``x`` (n, d), inside the domain, into ``out`` (n, channels)."""
    from bvbedit.spline import kernels

    # Axes that are missing become constants of degree 0, so that one kernel serves all.
    missing = MAX_PARAMETERS - len(degrees)
    filled = np.array((*degrees, *(0,) * missing), dtype=np.int64)
    vectors = (*knots, *(np.array([0.0, 1.0]),) * missing)
    starts = np.cumsum([0, *(len(t) for t in vectors)])
    points = np.concatenate([x, np.zeros((len(x), missing))], axis=1)
    spans = np.stack([find_spans(t, p, points[:, a]) for a, (t, p) in enumerate(zip(vectors, filled, strict=True))])
    net = control.reshape(*control.shape[:-1], *(1,) * missing, control.shape[-1])
    kernels.evaluate_any(points, filled, np.concatenate(vectors), starts, np.ascontiguousarray(spans.T), net, out)


def _polynomials(t: Floats, p: int) -> Floats:
    """Taylor's series at the left end of each span; spans without length hold zeros, and are never looked up."""
    out = np.zeros((len(t) - 1, p + 1, p + 1))
    spans = np.flatnonzero(np.diff(t) > 0)
    width = t[spans + 1] - t[spans]
    for k in range(p + 1):
        out[spans, :, k] = basis_derivatives(t, p, t[spans], k)[1] * (width**k / factorial(k))[:, None]
    return out
