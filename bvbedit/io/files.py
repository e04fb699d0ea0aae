"""Reading and writing files so that nothing is half-written and every failure is told in one line."""

import os
import stat
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from bvbedit.errors import BvbError


@contextmanager
def reading(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """Open ``path`` for reading bytes. Raises BvbError for what is missing, no regular file, or cannot be read."""
    path = Path(path)
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
        raise BvbError(f"{path} cannot be read: {error.strerror}. Check its permissions.") from None


@contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """Yield a stream for the new content of ``path``, which takes the old one's place only when all is written.

    The content goes to a temporary file beside the target first: a crash, a full disk or Ctrl-C leaves the old file.
    Raises BvbError for a missing or read-only folder, a target that is a folder, or a full disk.
    """
    path = Path(path)
    if path.is_dir():
        raise BvbError(f"{path} is a folder. Name a file to write.")
    temporary = None
    try:
        try:
            handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name[:64]}.", suffix=".tmp")
            with os.fdopen(handle, "w+b") as stream:
                yield stream
                stream.flush()
                os.fsync(stream.fileno())
            Path(temporary).chmod(_permissions(path))
            Path(temporary).replace(path)
            temporary = None
        except FileNotFoundError:
            raise BvbError(f"{path} cannot be written: {path.parent} does not exist. Make the folder first.") from None
        except OSError as error:
            raise BvbError(f"{path} cannot be written: {error.strerror}. Choose another place or make room.") from None
    finally:
        if temporary is not None:
            with suppress(OSError):
                Path(temporary).unlink()


def check_target(path: str | os.PathLike[str], suffixes: Sequence[str]) -> None:
    """Raise BvbError where ``path`` has none of the ``suffixes`` or cannot become a file: before long work."""
    path = Path(path)
    if path.suffix.lower() not in suffixes:
        raise BvbError(f"{path} has the suffix {path.suffix!r}. Name a file that ends in {' or '.join(suffixes)}.")
    if path.is_dir():
        raise BvbError(f"{path} is a folder. Name a file to write.")
    if not path.parent.is_dir():
        raise BvbError(f"{path} cannot be written: {path.parent} is no folder. Make it first.")


def make_folder(path: str | os.PathLike[str]) -> None:
    """Make the folder ``path`` and those above it where they are missing. Raises BvbError where that fails."""
    try:
        Path(path).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BvbError(f"{path} cannot be made a folder: {error.strerror}. Choose another place.") from None


def _permissions(path: Path) -> int:
    """Return the mode of the file that is replaced, or what a plain new file would get."""
    with suppress(OSError):
        return path.stat().st_mode & 0o777
    mask = os.umask(0)
    os.umask(mask)
    return 0o666 & ~mask
