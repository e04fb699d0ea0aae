"""OpenEXR pictures, float32 linear RGB, behind a wrapper that believes neither the file nor the library.

Without an error, the library writes strided arrays wrong, cuts small pictures short on a full disk, reads truncated
files as empty ones, and takes any size a header asks for. Of damaged files it makes remarks on both standard streams.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from io import StringIO
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bvbedit.errors import BvbError
from bvbedit.io.files import reading, replacing
from bvbedit.spline.arguments import real_array

Picture = NDArray[np.float32]

MAGIC = b"\x76\x2f\x31\x01"
# Values of all channels: a 16k x 8k environment with alpha.
LARGEST_PICTURE = 1 << 29
# The standard streams belong to the whole process: two threads that put them aside and back would lose them.
SILENCE = Lock()


def write_exr(path: str | os.PathLike[str], picture: ArrayLike) -> None:
    """Write ``picture`` (h, w, 3), linear RGB, to ``path`` as float32 with ZIP compression.

    Raises BvbError for another shape, values that are not finite in float32, and where the file cannot be written.
    """
    import OpenEXR

    with np.errstate(over="ignore"):
        pixels = real_array(picture, f"{path}: the picture", np.float32)
    if pixels.ndim != 3 or pixels.shape[2] != 3 or pixels.size == 0:
        raise BvbError(f"{path}: a picture of shape {pixels.shape} cannot be written. Give (height, width, 3).")
    if not np.isfinite(pixels).all():
        raise BvbError(f"{path}: the picture holds values that are not finite in float32. Look at what made it.")
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with replacing(path) as stream:
        try:
            OpenEXR.File(header, {"RGB": np.ascontiguousarray(pixels)}).write(stream.name)
            written = np.array_equal(read_exr(stream.name), pixels)
        except MemoryError:
            raise
        except Exception:  # the library's own types are not documented
            written = False
        if not written:
            raise BvbError(f"{path} cannot be written: it does not read back as it was. Make room, or choose a place.")


def read_exr(path: str | os.PathLike[str]) -> Picture:
    """Return the picture (h, w, 3), linear RGB float32, in the file ``path``.

    Of several parts the first is taken. Raises BvbError for what is no OpenEXR file, truncated, without R, G and B, not
    finite, or claims more than 2^29 values in all.
    """
    import OpenEXR

    with reading(path) as stream:
        if stream.read(len(MAGIC)) != MAGIC:
            raise BvbError(f"{path} is no OpenEXR file. Name an .exr picture.")
    try:
        with _silence(), OpenEXR.File(str(path), header_only=True) as file:
            claims = [(*_size(part.header["dataWindow"]), len(part.header["channels"])) for part in file.parts]
        total = sum(w * h * channels for w, h, channels in claims)
        width, height = claims[0][:2] if claims else (0, 0)
        if min((min(w, h) for w, h, _ in claims), default=0) < 1 or total > LARGEST_PICTURE:
            raise BvbError(f"{path} claims {width} x {height} pixels, {total:,} values. Scale it down.")
        with _silence(), OpenEXR.File(str(path)) as file:
            parts = len(file.parts)
            channels = file.channels() if parts else {}
            found = channels.get("RGB", channels.get("RGBA"))
            pixels = None if found is None else np.array(found.pixels[..., :3], dtype=np.float32)
    except (BvbError, MemoryError):
        raise
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


def _size(window: Any) -> tuple[int, int]:
    """Return width and height of a dataWindow: its first and its last pixel, int32."""
    (left, top), (right, bottom) = (map(int, corner) for corner in window)
    return right - left + 1, bottom - top + 1


@contextmanager
def _silence() -> Iterator[None]:
    """Keep what the library prints of a damaged file, thousands of lines, off standard output and error."""
    with SILENCE, redirect_stdout(StringIO()):
        try:
            error = os.dup(2)
        except OSError:  # the process has no standard error: nothing can be printed there
            yield
            return
        try:
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, 2)
            os.close(nowhere)
            yield
        finally:
            os.dup2(error, 2)
            os.close(error)
