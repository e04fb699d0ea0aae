"""OpenEXR pictures, float32 linear RGB, behind a wrapper that believes neither the file nor the library.

The library writes strided arrays wrong, reads truncated files as empty ones, and takes any size a header asks for.
"""

import os
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bvbedit.errors import BvbError
from bvbedit.io.files import reading, replacing

Picture = NDArray[np.float32]

MAGIC = b"\x76\x2f\x31\x01"
# Pixels: a 16k x 8k environment.
LARGEST_PICTURE = 1 << 27


def write_exr(path: str | os.PathLike[str], picture: ArrayLike) -> None:
    """Write ``picture`` (h, w, 3), linear RGB, to ``path`` as float32 with ZIP compression.

    Raises BvbError for another shape, values that are not finite in float32, and where the file cannot be written.
    """
    import OpenEXR

    # The library writes an array that is not contiguous wrong, and says nothing.
    pixels = np.ascontiguousarray(picture, dtype=np.float32)
    if pixels.ndim != 3 or pixels.shape[2] != 3 or pixels.size == 0:
        raise BvbError(f"{path}: a picture of shape {pixels.shape} cannot be written. Give (height, width, 3).")
    if not np.isfinite(pixels).all():
        raise BvbError(f"{path}: the picture holds values that are not finite in float32. Look at what made it.")
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with tempfile.TemporaryDirectory() as folder:
        draft = Path(folder) / "picture.exr"
        OpenEXR.File(header, {"RGB": pixels}).write(str(draft))
        content = draft.read_bytes()
    with replacing(path) as stream:
        stream.write(content)


def read_exr(path: str | os.PathLike[str]) -> Picture:
    """Return the picture (h, w, 3), linear RGB float32, in the file ``path``.

    Raises BvbError for what is no OpenEXR file, truncated, without R, G and B, not finite, or above 2^27 pixels.
    """
    import OpenEXR

    with reading(path) as stream:
        head = stream.read(1 << 16)
    if not head.startswith(MAGIC):
        raise BvbError(f"{path} is no OpenEXR file. Name an .exr picture.")
    width, height = _claimed_size(head, path)
    if width < 1 or height < 1 or width * height > LARGEST_PICTURE:
        raise BvbError(f"{path} claims {width} x {height} pixels. Scale it to at most {LARGEST_PICTURE:,} in all.")
    try:
        with OpenEXR.File(str(path)) as file:
            parts = len(file.parts)
            channels = file.channels() if parts else {}
            found = channels.get("RGB", channels.get("RGBA"))
            pixels = None if found is None else np.array(found.pixels[..., :3], dtype=np.float32)
    except Exception as error:  # the library's own types are not documented
        raise BvbError(f"{path} cannot be read: {' '.join(str(error).split())}. Write it again.") from None
    if parts == 0:
        raise BvbError(f"{path} is damaged or cut short. Get the file again, whole.")
    if pixels is None:
        raise BvbError(f"{path} holds the channels {', '.join(channels)}. Save it with R, G and B.")
    if pixels.shape != (height, width, 3):
        raise BvbError(f"{path} claims {width} x {height} pixels and holds {pixels.shape}. Write it again.")
    if not np.isfinite(pixels).all():
        raise BvbError(f"{path} holds values that are not finite. Repair it in a picture editor.")
    return pixels


def _claimed_size(head: bytes, path: str | os.PathLike[str]) -> tuple[int, int]:
    """Return width and height by the header's dataWindow, looked up before the library takes memory for it."""
    key = b"dataWindow\0box2i\0" + (16).to_bytes(4, "little")
    at = head.find(key)
    if at < 0 or len(head) < at + len(key) + 16:
        raise BvbError(f"{path} has no dataWindow in its header. Write it again.")
    left, top, right, bottom = (int(n) for n in np.frombuffer(head, "<i4", 4, at + len(key)))
    return right - left + 1, bottom - top + 1
