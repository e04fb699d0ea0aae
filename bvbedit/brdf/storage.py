"""How control points are stored: as a float type, or as whole multiples of a step, coded so that they deflate well."""

import math
import sys
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bvbedit.brdf.geometry import Floats
from bvbedit.errors import BvbError
from bvbedit.spline.arguments import is_real_within, shown

Codes = NDArray[np.int64]
"""Whole numbers (channels, n_1, ..., n_d): what multiples of the step control points are, or differences of these."""

PRECISIONS = ("float16", "float32", "float64", "quantised")
# Of the largest |control point|, where a net is quantised without a step being given.
DEFAULT_STEP = 2.0**-12
LARGEST_CODE = 2**31 - 1
# So many of it are just within float64.
LARGEST_STEP = math.nextafter(sys.float_info.max / LARGEST_CODE, 0.0)
# Bytes of a code: 31 bits, one more for the difference of colours, for those along each of 4 axes and for the sign.
MOST_PLANES = 5
# The sum of |differences| bounds each control point, and twice as much, for undoing the colours, fits into 64 bits. A
# sound net of 2**24 values stays below 2**(24 + 31 + 1 + 4).
LARGEST_SUM = 2.0**61


@dataclass(frozen=True)
class Storage:
    """How a net is stored: ``precision`` is one of ``PRECISIONS``, ``step`` the encoded value of one unit.

    A quantised net needs a step above zero, the others have none. Raises BvbError for anything else.
    """

    precision: str = "float32"
    step: float | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.precision, str) or self.precision not in PRECISIONS:
            raise BvbError(f"Unknown precision {shown(self.precision)}. Choose one of {', '.join(PRECISIONS)}.")
        if self.precision != "quantised":
            if self.step is not None:
                raise BvbError(f"{self.precision} has no step, and {shown(self.step)} was given. Leave it out.")
            return
        # Of a small float type the limits would be zero and infinity.
        step = self.step.item() if isinstance(self.step, np.generic) else self.step
        if not is_real_within(step, sys.float_info.min, LARGEST_STEP):
            raise BvbError(
                f"A step of {shown(self.step)} quantises nothing. "
                f"Give a number in {sys.float_info.min:g} ... {LARGEST_STEP:g}."
            )
        object.__setattr__(self, "step", float(step))

    def rounded(self, control: Floats) -> Floats:
        """Return ``control`` (n_1, ..., n_d, channels) as a reader gets it back, in float64.

        Raises BvbError where a float type cannot hold a control point, or one is more than 2**31 - 1 steps.
        """
        if self.step is None:
            return self._cast(control).astype(np.float64)
        return _control(_codes(control, self.step), self.step)

    def packed(self, control: Floats) -> tuple[NDArray[Any], tuple[int, ...]]:
        """Return what a file holds of ``control`` (n_1, ..., n_d, channels), and the axes that were differenced.

        A float net is itself, in that type. A quantised one: whole multiples of the step, of three channels R, G, B
        turned into R - G, G, B - G, differenced along some of the axes (the first of a line is kept), signs folded into
        the lowest bit (0, -1, 1, -2 ... are 0, 1, 2, 3 ...), in planes of bytes, lowest first: uint8 (planes, channels,
        n_1, ..., n_d). Raises BvbError as ``rounded`` does.
        """
        if self.step is None:
            return self._cast(control), ()
        codes = _codes(control, self.step)
        if len(codes) == 3:
            codes = np.stack([codes[0] - codes[1], codes[1], codes[2] - codes[1]])
        axes, codes = min(_differences(codes), key=lambda candidate: _bits(candidate[1]))
        folded = (codes << 1) ^ (codes >> 63)
        planes = max(1, (int(folded.max()).bit_length() + 7) // 8)
        return np.stack([(folded >> 8 * k).astype(np.uint8) for k in range(planes)]), axes

    def payload_bytes(self, control: Floats, degrees: Sequence[int]) -> int:
        """Return the bytes of ``control`` (n_1, ..., n_d, channels) as stored, and 8 for each interior knot.

        A float net counts as it is, a quantised one deflated: its code is made for that. Raises BvbError as
        ``rounded`` does where the net is quantised.
        """
        interior: int = sum(n - p - 1 for n, p in zip(control.shape[:-1], degrees, strict=True))
        if self.step is None:
            return control.size * np.dtype(self.precision).itemsize + 8 * interior
        return len(zlib.compress(self.packed(control)[0].tobytes(), 9)) + 8 * interior

    def _cast(self, control: Floats) -> NDArray[Any]:
        largest = float(np.abs(control).max())
        if largest > float(np.finfo(self.precision).max):
            raise BvbError(
                f"A control point of {largest:g} does not fit into {self.precision}. Save in a higher precision."
            )
        return control.astype(self.precision)


FLOAT32 = Storage()


def storage_named(precision: str, control: Floats) -> Storage:
    """Return the storage called ``precision``; quantised, with a step of 2**-12 of the largest |control point|.

    Raises BvbError for an unknown name.
    """
    if precision != "quantised":
        return Storage(precision)
    # A net of zeros, which has no scale, counts as one of ones.
    step = (float(np.abs(control).max()) or 1.0) * DEFAULT_STEP
    return Storage(precision, min(max(step, sys.float_info.min), LARGEST_STEP))


def unpacked(array: NDArray[Any], storage: Storage, axes: Sequence[int]) -> Floats:
    """Return the control points (n_1, ..., n_d, channels) that ``storage.packed`` made ``array`` and ``axes`` of.

    Exact: equal to ``storage.rounded``. Raises BvbError for planes that no net was packed into, and for axes that are
    none of theirs, doubled or not in order. Takes three times the memory of the net.
    """
    if storage.step is None:
        return array.astype(np.float64)
    if array.dtype != np.uint8 or array.ndim < 3 or not 1 <= len(array) <= MOST_PLANES or array.size == 0:
        raise BvbError(f"{array.dtype} of shape {array.shape} are no planes of a net. Get the file again.")
    if list(axes) != [a for a in range(array.ndim - 2) if a in axes]:
        raise BvbError(f"Differences along axes {shown(list(axes))} are none of a net. Get the file again.")
    codes: Codes = np.zeros(array.shape[1:], dtype=np.int64)
    for k, plane in enumerate(array):
        codes |= plane.astype(np.int64) << 8 * k
    # In place where it can be: a file of a few kilobytes may hold the largest net.
    signs = codes & 1
    codes >>= 1
    codes ^= np.negative(signs, out=signs)
    if np.abs(codes, out=signs).sum(dtype=np.float64) > LARGEST_SUM:
        raise BvbError("The differences of control points sum up beyond any net. Get the file again.")
    for axis in axes:
        np.cumsum(codes, axis=axis + 1, out=codes)
    if len(codes) == 3:
        codes[0] += codes[1]
        codes[2] += codes[1]
    if np.abs(codes, out=signs).max() > LARGEST_CODE:
        raise BvbError(f"Control points beyond {LARGEST_CODE:,} steps are none of a net. Get the file again.")
    return _control(codes, storage.step)


def _codes(control: Floats, step: float) -> Codes:
    """Return the nearest whole multiples of ``step`` (channels, n_1, ..., n_d)."""
    with np.errstate(over="ignore"):
        codes = np.rint(control / step)
    if np.abs(codes).max() > LARGEST_CODE:
        raise BvbError(
            f"A control point of {np.abs(control).max():g} is more than {LARGEST_CODE:,} steps of {step:g}. "
            "Save with a larger step, or in float64."
        )
    return np.moveaxis(codes.astype(np.int64), -1, 0)


def _control(codes: Codes, step: float) -> Floats:
    return np.multiply(np.moveaxis(codes, 0, -1), step, order="C")


def _differences(codes: Codes, first: int = 0, axes: tuple[int, ...] = ()) -> Iterator[tuple[tuple[int, ...], Codes]]:
    """Yield each subset of the net's axes, and ``codes`` differenced along them."""
    yield axes, codes
    for axis in range(first, codes.ndim - 1):
        yield from _differences(np.diff(codes, axis=axis + 1, prepend=0), axis + 1, (*axes, axis))


def _bits(codes: Codes) -> float:
    """Return about how many bits ``codes`` deflate to: the entropy of their lengths in bits, and these bits.

    On 9 nets of 6 measurements, at 8 steps each, the subset that this finds best deflated to 0.7 % more than the best
    of all (at most 7.5 %), as the entropy of the bytes did in twice the time; the sum of the lengths alone: 1.2 (18) %.
    """
    counts = np.bincount(np.frexp(codes.astype(np.float32))[1].ravel())
    lengths = np.flatnonzero(counts)
    share = counts[lengths] / codes.size
    return float(codes.size * (share @ (lengths - np.log2(share))))
