"""How far one picture is from another: MAE, PAE and PSNR on 8-bit pictures, HDR-FLIP on linear ones."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bvbedit.errors import BvbError
from bvbedit.render.tonemap import linear_picture, tone_map

# Below this luminance of the reference's brightest pixel, FLIP finds no exposure at which to look and ends the process
# (its own bound is float32's epsilon, 1.2e-7).
DARKEST_REFERENCE = 1e-6


@dataclass(frozen=True)
class PictureComparison:
    """``mae`` and ``pae`` in [0, 1], ``psnr`` in dB (infinite where the 8-bit pictures agree), ``flip`` in [0, 1].

    ``flip`` is None where it was not asked for.
    """

    mae: float
    pae: float
    psnr: float
    flip: float | None = None


def compare_pictures(
    test: ArrayLike, reference: ArrayLike, exposure: float = 0.0, *, flip: bool = False
) -> PictureComparison:
    """Compare two linear pictures (h, w, 3) of one size.

    Mean and peak absolute error (ImageMagick's MAE and PAE over its quantum range) and PSNR are taken of the
    tone-mapped 8-bit pictures, over pixels and channels; with ``flip`` also HDR-FLIP of the linear ones. Raises
    BvbError for other shapes, nan or infinity, and as ``hdr_flip`` does.
    """
    a, b = _pair(test, reference)
    difference = (tone_map(a, exposure).astype(np.float64) - tone_map(b, exposure)) / 255
    squares = float(np.mean(difference**2))
    return PictureComparison(
        mae=float(np.mean(np.abs(difference))),
        pae=float(np.max(np.abs(difference))),
        psnr=-10 * math.log10(squares) if squares > 0 else math.inf,
        flip=hdr_flip(a, b) if flip else None,
    )


def hdr_flip(test: ArrayLike, reference: ArrayLike) -> float:
    """Return the mean HDR-FLIP of two linear pictures (h, w, 3) at 67 pixels per degree, negative values taken as 0.

    The reference sets the range of exposures. Source: Andersson et al., "Visualizing errors in rendered high dynamic
    range images", Eurographics 2021; computed by flip-evaluator.
    Raises BvbError where that is not installed, for other shapes, nan or infinity, and for a black reference of a test
    that is not black.
    """
    a, b = (np.ascontiguousarray(np.maximum(p, 0), dtype=np.float32) for p in _pair(test, reference))
    if not (np.isfinite(a).all() and np.isfinite(b).all()):
        raise BvbError("A picture's values are too large for float32. Scale both down.")
    if (b @ np.array([0.2126, 0.7152, 0.0722])).max() < DARKEST_REFERENCE:
        if np.array_equal(a, b):
            return 0.0
        raise BvbError("The reference is black: HDR-FLIP has no exposure at which to look. Compare without it.")
    try:
        import flip_evaluator
    except ImportError:
        raise BvbError("HDR-FLIP needs flip-evaluator. Install it: pip install flip-evaluator") from None
    return float(flip_evaluator.evaluate(b, a, "HDR", applyMagma=False)[1])


def _pair(test: ArrayLike, reference: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    a, b = linear_picture(test, "test"), linear_picture(reference, "reference")
    if a.shape != b.shape:
        raise BvbError(f"The pictures have shapes {a.shape} and {b.shape}. Only pictures of one size can be compared.")
    return a, b
