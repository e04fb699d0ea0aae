"""Reading and writing files so that nothing is half-written and every failure is told in one line."""

import os
import stat
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from bvbedit.errors import BvbError
from bvbedit.spline.arguments import shown


def as_path(path: str | os.PathLike[str]) -> Path:
    """Return ``path`` as a Path. Raises BvbError for what can name no file."""
    try:
        named = Path(path)
        if b"\0" not in os.fsencode(named):
            return named
    except (TypeError, UnicodeEncodeError):
        pass
    raise BvbError(f"{shown(path)} cannot name a file. Give a text or a Path.")


@contextmanager
def reading(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """Open ``path`` for reading bytes. Raises BvbError for what is missing, no regular file, or cannot be read."""
    path = as_path(path)
    try:
        mode = path.stat().st_mode
        if stat.S_ISDIR(mode):
            raise BvbError(f"{path} is a folder. Name a file.")
        # A pipe may never speak, and no reader here can do without seeking.
        if not stat.S_ISREG(mode):
            raise BvbError(f"{path} is a device or a pipe. Write its content to a file first.")
        with path.open("rb") as stream:
            yield stream
    except FileNotFoundError:
        raise BvbError(f"{path} does not exist. Check the name.") from None
    except OSError as error:
        raise BvbError(f"{path} cannot be read: {_reason(error)}. Check its permissions.") from None


@contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """Yield a stream for the new content of ``path``, which takes the old one's place only when all is written.

    The content goes to a temporary file beside the target first, whose path is the stream's ``name``: a crash, a full
    disk or Ctrl-C leaves the old file.
    Raises BvbError for a missing or read-only folder, a target that is no regular file, or a full disk.
    """
    path = _replaceable(path)
    temporary = None
    try:
        try:
            # A character may take 4 bytes of the 255 that a name has.
            handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name[:48]}.", suffix=".tmp")
            os.close(handle)
            with Path(temporary).open("w+b") as stream:
                yield stream
                stream.flush()
                os.fsync(stream.fileno())
            Path(temporary).chmod(_permissions(path))
            Path(temporary).replace(path)
            temporary = None
        except FileNotFoundError:
            raise BvbError(f"{path} cannot be written: {path.parent} does not exist. Make the folder first.") from None
        except OSError as error:
            raise BvbError(f"{path} cannot be written: {_reason(error)}. Choose another place or make room.") from None
    finally:
        if temporary is not None:
            with suppress(OSError):
                Path(temporary).unlink()


def check_target(path: str | os.PathLike[str], suffixes: Sequence[str]) -> None:
    """Raise BvbError where ``path`` has none of the ``suffixes`` or cannot become a file: before long work."""
    path = as_path(path)
    if path.suffix.lower() not in suffixes:
        raise BvbError(f"{path} has the suffix {path.suffix!r}. Name a file that ends in {' or '.join(suffixes)}.")
    _replaceable(path)
    if not path.parent.is_dir():
        raise BvbError(f"{path} cannot be written: {path.parent} is no folder. Make it first.")


def make_folder(path: str | os.PathLike[str]) -> None:
    """Make the folder ``path`` and those above it where they are missing. Raises BvbError where that fails."""
    try:
        as_path(path).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BvbError(f"{path} cannot be made a folder: {_reason(error)}. Choose another place.") from None


def _replaceable(path: str | os.PathLike[str]) -> Path:
    """Return ``path`` as a Path. Raises BvbError where a folder, a device or a pipe has that name."""
    path = as_path(path)
    try:
        mode = path.stat().st_mode
    except (FileNotFoundError, NotADirectoryError):
        return path
    except OSError as error:
        raise BvbError(f"{path} cannot be written: {_reason(error)}. Choose another place.") from None
    if not stat.S_ISREG(mode):
        kind = "folder" if stat.S_ISDIR(mode) else "device or a pipe"
        raise BvbError(f"{path} is a {kind}. Name a file to write.")
    return path


def _reason(error: OSError) -> str:
    return error.strerror or " ".join(str(error).split())


def _permissions(path: Path) -> int:
    """Return the mode of the file that is replaced, or what a plain new file would get."""
    with suppress(OSError):
        return path.stat().st_mode & 0o777
    mask = os.umask(0)
    os.umask(mask)
    return 0o666 & ~mask
