"""Zip archives of .npy arrays and JSON, written the same byte for byte and read with nothing taken on trust.

numpy.load opens them too. A header is a claim: names, sizes, types and checksums are checked before memory is taken.
"""

import io
import json
import math
import zipfile
from collections.abc import Mapping
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from bvbedit.errors import BvbError
from bvbedit.spline.arguments import shown

Array = NDArray[Any]

# A fixed date, so that equal content gives equal files.
DATE = (1980, 1, 1, 0, 0, 0)

# Bytes. An entry of 50 in an archive's list of members takes a kilobyte of memory; our lists have half a dozen.
LARGEST_LIST = 1 << 20
# The head of an .npy member: numpy's own bound on its text, and what stands before it.
LARGEST_HEAD = 4096 + 12
# The others inflate all that is there at once, whatever the claim: 4 KB of bzip2 took 5 GB.
METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)


def write_archive(stream: BinaryIO, arrays: Mapping[str, Array], texts: Mapping[str, str], level: int) -> None:
    """Write ``arrays`` as NAME.npy and ``texts`` under their names, deflated at ``level`` (1 fast ... 9 small)."""
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=level) as archive:
        for name, text in texts.items():
            archive.writestr(_member(name), text, zipfile.ZIP_DEFLATED, level)
        for name, array in arrays.items():
            member = io.BytesIO()
            np.lib.format.write_array(member, np.asarray(array, order="C"), allow_pickle=False)
            archive.writestr(_member(f"{name}.npy"), member.getbuffer(), zipfile.ZIP_DEFLATED, level)


def _member(name: str) -> zipfile.ZipInfo:
    info = zipfile.ZipInfo(name, DATE)
    info.external_attr = 0o644 << 16
    return info


class _Listed:
    """The stream as zipfile sees it, which reads the list of members at once: until then only so much is handed out."""

    def __init__(self, stream: BinaryIO) -> None:
        self._stream = stream
        self.opened = False

    def seek(self, offset: int, whence: int = 0) -> int:
        return self._stream.seek(offset, whence)

    def tell(self) -> int:
        return self._stream.tell()

    def seekable(self) -> bool:
        return True

    def read(self, size: int = -1) -> bytes:
        if self.opened:
            return self._stream.read(size)
        content = self._stream.read(min(size, LARGEST_LIST + 1) if size >= 0 else LARGEST_LIST + 1)
        if len(content) > LARGEST_LIST:
            raise ValueError("its list of members is too long")
        return content


class Archive:
    """A zip archive opened for distrustful reading; ``name`` stands for it in messages.

    Raises BvbError for what is no zip archive, or holds a member twice.
    """

    def __init__(self, stream: BinaryIO, name: str) -> None:
        self.name = name
        # Whatever a parser chokes on in foreign bytes means the same: zipfile raises a dozen different types.
        try:
            listed = _Listed(stream)
            self._zip = zipfile.ZipFile(listed)
            members = self._zip.infolist()
            listed.opened = True
        except Exception as error:
            raise self.corrupt(f"it is not a whole zip archive ({_reason(error)})") from None
        self._members = {m.filename: m for m in members}
        if len(self._members) != len(members):
            raise self.corrupt("it holds a member twice")

    def corrupt(self, why: str) -> BvbError:
        """Return the error that says why this archive cannot be read."""
        return BvbError(f"{self.name} cannot be read: {why}. Get the file again from where it came.")

    def __contains__(self, member: str) -> bool:
        return member in self._members

    def read(self, member: str, limit: int) -> bytes:
        """Return the bytes of ``member``. Raises BvbError where it is missing, above ``limit`` bytes or damaged."""
        info = self._members.get(member)
        if info is None:
            raise self.corrupt(f"it holds no {member}")
        if info.compress_type not in METHODS:
            raise self.corrupt(f"{member} is packed by method {info.compress_type}, neither stored nor deflated")
        if info.file_size > limit:
            raise self.corrupt(f"{member} claims {info.file_size:,} bytes, more than the {limit:,} allowed")
        try:
            with self._zip.open(info) as stream:
                content = stream.read(limit + 1)
        except Exception as error:
            raise self.corrupt(f"{member} is damaged ({_reason(error)})") from None
        if len(content) != info.file_size:
            raise self.corrupt(f"{member} holds {len(content):,} bytes and claims {info.file_size:,}")
        return content

    def array(self, name: str, types: tuple[str, ...], dimensions: int, most: int) -> Array:
        """Return the array NAME.npy, of one of the ``types`` and so many ``dimensions``, with at most ``most`` entries.

        Raises BvbError for anything else, object arrays (pickles) included.
        """
        member = f"{name}.npy"
        content = self.read(member, most * max(np.dtype(t).itemsize for t in types) + LARGEST_HEAD)
        stream = io.BytesIO(content)
        try:
            version = np.lib.format.read_magic(stream)
            read = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}[version]
            shape, fortran, dtype = read(stream, max_header_size=4096)
        except Exception as error:
            raise self.corrupt(f"{member} has no .npy header ({_reason(error)})") from None
        if dtype.hasobject or dtype.str not in [np.dtype(t).str for t in types]:
            raise self.corrupt(f"{member} holds {dtype}, not {' or '.join(types)}")
        if len(shape) != dimensions or min(shape, default=1) < 1:
            raise self.corrupt(f"{member} has shape {shown(shape)}, not {dimensions} dimensions above zero")
        # Python's whole numbers: a shape that overflows 64 bits must not come out small.
        count = 1
        for n in shape:
            count *= int(n)
        held = len(content) - stream.tell()
        if count * dtype.itemsize != held:
            raise self.corrupt(f"{member} claims shape {shown(shape)} and holds {held:,} bytes")
        if count > most:
            raise self.corrupt(f"{member} has {count:,} entries, more than the {most:,} allowed")
        return np.frombuffer(content, dtype, offset=stream.tell()).reshape(shape, order="F" if fortran else "C")

    def object(self, member: str, limit: int) -> dict[str, Any]:
        """Return the JSON object in ``member``. Raises BvbError for anything else."""
        try:
            value = json.loads(self.read(member, limit), parse_constant=_finite, parse_float=_finite)
        except BvbError:
            raise
        except Exception as error:
            raise self.corrupt(f"{member} is not JSON ({_reason(error)})") from None
        if not isinstance(value, dict):
            raise self.corrupt(f"{member} is not a JSON object")
        return value


def _finite(text: str) -> float:
    """Return the number, which JSON writes finite: what this refuses could not be written again."""
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"{text[:40]} is no finite number")
    return value


def _reason(error: Exception) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())[:160]
