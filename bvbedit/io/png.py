"""PNG pictures of 8 bits, by Pillow."""

import os

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bvbedit.errors import BvbError
from bvbedit.io.files import reading, replacing

# Pixels; larger headers are refused before memory is taken for them.
LARGEST_PICTURE = 1 << 27


def write_png(path: str | os.PathLike[str], picture: ArrayLike) -> None:
    """Write ``picture`` (h, w, 3), uint8 sRGB, to ``path``.

    Raises BvbError for another shape or type, and where the file cannot be written.
    """
    from PIL import Image

    pixels = np.asarray(picture)
    if pixels.ndim != 3 or pixels.shape[2] != 3 or pixels.size == 0 or pixels.dtype != np.uint8:
        raise BvbError(f"{path}: a picture {pixels.shape} of {pixels.dtype} is no PNG. Give uint8 (height, width, 3).")
    with replacing(path) as stream:
        Image.fromarray(np.ascontiguousarray(pixels)).save(stream, "PNG")


def read_png(path: str | os.PathLike[str]) -> NDArray[np.uint8]:
    """Return the picture (h, w, 3), uint8 sRGB, in the file ``path``; transparency is dropped.

    Raises BvbError for what is no PNG, damaged, or above 2^27 pixels.
    """
    from PIL import Image

    with reading(path) as stream:
        try:
            with Image.open(stream, formats=("PNG",)) as picture:
                width, height = picture.size
                if width * height > LARGEST_PICTURE:
                    raise BvbError(f"{path} claims {width} x {height} pixels. Scale it down.")
                return np.array(picture.convert("RGB"))
        except BvbError:
            raise
        except Exception as error:  # Pillow raises a dozen types for damaged files
            raise BvbError(f"{path} is no whole PNG: {' '.join(str(error).split())}. Write it again.") from None
