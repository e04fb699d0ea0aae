"""Angles, compiled: what math.atan2 gives in the upper half plane, at less than half its time."""

import math

from bvbedit.jit import inlined_kernel


@inlined_kernel
def upper_atan2(y: float, x: float) -> float:
    """Return atan2(y, x), for y >= 0, within a rounding or two; 0 at the origin."""
    across = abs(x)
    larger = max(y, across)
    if larger == 0.0:
        return 0.0
    angle = math.atan(min(y, across) / larger)
    if y > across:
        angle = 0.5 * math.pi - angle
    return math.pi - angle if x < 0.0 else angle
