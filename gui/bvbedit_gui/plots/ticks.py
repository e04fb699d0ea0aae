"""Where ticks stand on an axis, and how numbers are written there."""

from collections.abc import Sequence

import numpy as np

from bvbedit.brdf.geometry import Floats

SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
# Steps of angles: parts of a right angle where they are whole degrees.
ANGLE_STEPS = (1.0, 2.0, 5.0, 10.0, 15.0, 30.0, 45.0, 90.0)
# Angles of an uneven axis, those first that should be there if only few fit.
ROUND_ANGLES = (0.0, 90.0, 10.0, 30.0, 60.0, 1.0, 45.0, 20.0, 5.0, 3.0, 75.0, 2.0, 15.0, 40.0, 70.0, 80.0, 50.0, 0.5)
# An angle that is even in the parameter is so up to rounding (degrees).
EVEN = 1e-6


def linear_ticks(low: float, high: float, most: int) -> Floats:
    """Return round numbers in [low, high], an even step apart, ``most`` of them or a few less."""
    return _multiples(nice_step((high - low) / max(most, 1)), low, high)


def nice_step(least: float) -> float:
    """Return 1, 2 or 5 times a power of ten, the smallest that is no less than ``least`` > 0."""
    power = 10.0 ** np.floor(np.log10(max(least, 1e-300)))
    return float(next(m * power for m in (1, 2, 5, 10) if m * power >= least * (1 - 1e-9)))


def log_ticks(low: float, high: float, most: int) -> Floats:
    """Return powers of ten in [low, high], ``most`` or fewer; where there is but one or none, round numbers."""
    first, last = int(np.ceil(np.log10(low) - 1e-9)), int(np.floor(np.log10(high) + 1e-9))
    decades = np.arange(first, last + 1)
    if len(decades) >= 2:
        return np.asarray(10.0 ** decades[:: max(1, -(-len(decades) // max(most, 1)))])
    for mantissas in ((1, 2, 5), (1, 1.5, 2, 3, 5, 7), np.arange(10, 100) / 10):
        every = np.outer(10.0 ** np.arange(first - 2, last + 3), mantissas).ravel()
        every = every[(every >= low) & (every <= high)]
        if len(every) >= 2:
            break
    return np.asarray(every[:: max(1, -(-len(every) // max(most, 1)))])


def angle_ticks(parameter: Floats, degrees: Floats, pixels: float, apart: float = 44.0) -> tuple[Floats, list[str]]:
    """Return parameters (k,) of round angles and their labels, on an axis of ``pixels`` from parameter 0 to 1.

    ``degrees`` (n,) increase with ``parameter`` (n,). Where they do so evenly the ticks are even, too; elsewhere as
    many round angles are taken as stand ``apart`` pixels from one another.
    """
    low, high = float(degrees[0]), float(degrees[-1])
    even = low + (high - low) * (parameter - parameter[0]) / (parameter[-1] - parameter[0])
    if np.abs(degrees - even).max() < EVEN:
        least = (high - low) * apart / pixels
        step = next((s for s in ANGLE_STEPS if s >= least), 90.0) if least > 0.5 else nice_step(least)
        angles = _multiples(step, low, high)
    else:
        chosen: list[tuple[float, float]] = []
        for angle in ROUND_ANGLES:
            place = float(np.interp(angle, degrees, parameter))
            if low <= angle <= high and all(abs(place - p) * pixels >= apart for p, _ in chosen):
                chosen.append((place, angle))
        angles = np.array(sorted(angle for _, angle in chosen))
    return np.interp(angles, degrees, parameter), [f"{text}°" for text in numbers(angles)]


def numbers(values: Floats | Sequence[float]) -> list[str]:
    """Return ``values``, an even step apart, with as many decimals as tell them apart."""
    v = np.asarray(values, dtype=np.float64)
    largest = float(np.abs(v).max(initial=0.0))
    if len(v) == 0 or largest == 0:
        return ["0"] * len(v)
    step = float(np.diff(np.unique(v)).min()) if len(np.unique(v)) > 1 else largest
    if largest >= 1e6 or largest < 1e-3:
        return ["0" if abs(x) < 1e-9 * largest else scientific(x) for x in v.tolist()]
    decimals = max(0, next((d for d in range(12) if abs(round(step, d) - step) <= 1e-6 * step), 12))
    return [signed(f"{x:,.{decimals}f}") for x in v.tolist()]


def number(value: float) -> str:
    """Return ``value`` with three digits."""
    if value != 0 and not 1e-4 <= abs(value) < 1e6:
        return scientific(value)
    return signed(f"{float(f'{value:.3g}'):,.0f}" if abs(value) >= 1000 else f"{value:.3g}")


def scientific(value: float) -> str:
    """Return ``value``, not zero, as 2·10⁻⁵."""
    mantissa, exponent = f"{value:.2e}".split("e")
    digits = mantissa.rstrip("0").rstrip(".")
    power = f"10{str(int(exponent)).translate(SUPERSCRIPTS)}"
    return {"1": power, "-1": f"−{power}"}.get(digits) or signed(f"{digits}·{power}")


def decades(values: Floats) -> list[str]:
    """Return positive ``values``: plain from 0.001 to 1,000, as powers of ten beyond."""
    return [
        scientific(x) if not 0.9e-3 <= x < 1e4 else f"{x:,.0f}" if x >= 1000 else f"{x:.3g}" for x in values.tolist()
    ]


def signed(text: str) -> str:
    """Return ``text`` with a minus sign that is as wide as a plus."""
    return text.replace("-", "−")


def _multiples(step: float, low: float, high: float) -> Floats:
    first, last = np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9)
    # Division by a whole number is exact where multiplication with 0.1 is not.
    inverse = round(1 / step) if step < 1 else 0
    # Adding zero makes a negative zero positive.
    multiples = np.arange(first, last + 1) + 0.0
    return np.asarray(multiples / inverse if inverse else multiples * step)
