"""PNG pictures of 8 bits, by Pillow."""

import os

import numpy as np
from numpy.typing import NDArray

from bvbedit.errors import BvbError
from bvbedit.io.files import reading, replacing
from bvbedit.spline.arguments import shown

# Pixels; larger headers are refused before memory is taken for them.
LARGEST_PICTURE = 1 << 27


def write_png(path: str | os.PathLike[str], picture: NDArray[np.uint8]) -> None:
    """Write ``picture`` (h, w, 3), uint8 sRGB, to ``path``.

    Raises BvbError for another shape or type, and where the file cannot be written.
    """
    from PIL import Image

    if not isinstance(picture, np.ndarray) or picture.dtype != np.uint8:
        told = f"an array of {picture.dtype}" if isinstance(picture, np.ndarray) else shown(picture)
        raise BvbError(f"{path}: {told} is no PNG. Give an array of uint8 (height, width, 3).")
    if picture.ndim != 3 or picture.shape[2] != 3 or picture.size == 0:
        raise BvbError(f"{path}: a picture of shape {picture.shape} cannot be written. Give (height, width, 3).")
    with replacing(path) as stream:
        Image.fromarray(np.ascontiguousarray(picture)).save(stream, "PNG")


def read_png(path: str | os.PathLike[str]) -> NDArray[np.uint8]:
    """Return the picture (h, w, 3), uint8 sRGB, in the file ``path``; transparency is dropped.

    Raises BvbError for what is no PNG, damaged, grey of 16 bits, or above 2^27 pixels.
    """
    from PIL import Image

    with reading(path) as stream:
        try:
            with Image.open(stream, formats=("PNG",)) as picture:
                width, height = picture.size
                if width * height > LARGEST_PICTURE:
                    raise BvbError(f"{path} claims {width} x {height} pixels. Scale it down.")
                # Pillow would cut off what is above 255.
                if picture.mode.startswith("I"):
                    raise BvbError(f"{path} is grey of 16 bits. Save it with 8.")
                return np.array(picture.convert("RGB"))
        except BvbError:
            raise
        except Exception as error:  # Pillow raises a dozen types for damaged files
            raise BvbError(f"{path} is no whole PNG: {' '.join(str(error).split())}. Write it again.") from None
