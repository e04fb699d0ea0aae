"""Writing is all or nothing; loading goes by content; every failure is one line that names the file."""

import errno
import os
import resource
import shutil
import stat
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

import bvbedit
from bvbedit import BvbError
from bvbedit.io.files import check_target, make_folder, reading, replacing
from tests.io import files


def test_new_content_takes_the_place_of_the_old_and_keeps_its_permissions(tmp_path):
    path = files.written(tmp_path / "f", b"old")
    path.chmod(0o640)
    with replacing(path) as stream:
        stream.write(b"new")
        assert path.read_bytes() == b"old"
    assert path.read_bytes() == b"new"
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("failure", [KeyboardInterrupt, RuntimeError, MemoryError])
def test_whatever_stops_the_writing_leaves_the_old_file(failure, tmp_path):
    path = files.written(tmp_path / "f", b"old")

    def stopped() -> None:
        with replacing(path) as stream:
            stream.write(b"half of the new")
            raise failure

    with pytest.raises(failure):
        stopped()
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_full_disk_is_told_and_leaves_the_old_file(tmp_path, monkeypatch):
    path = files.written(tmp_path / "m.bvb", b"old")

    def full(_handle: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(BvbError, match=r"m\.bvb cannot be written: No space left on device"):
        bvbedit.save(files.model(), path)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


LIMITED = """
import signal, sys, numpy as np, bvbedit
from bvbedit.brdf.charts import RUSINKIEWICZ as C
from bvbedit.brdf.measured import MeasuredBrdf
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
table = MeasuredBrdf(np.ones((90, 90, 180, 3)), np.ones((90, 90, 180), bool), C.grid, C)
try:
    bvbedit.save(table, sys.argv[1])
except bvbedit.BvbError as error:
    print(error)
"""


def run_limited(code: str, largest: int, *arguments: str) -> str:
    """Run ``code`` where the kernel stops every file at ``largest`` bytes, as a quota does; return what it prints."""

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (largest, largest))

    # Bytecode and compiled kernels are not to run into the limit.
    environment = os.environ | {"PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-c", code, *arguments]
    return subprocess.run(command, preexec_fn=limit, env=environment, capture_output=True, text=True, check=True).stdout


def test_a_write_that_fails_halfway_leaves_the_old_file(tmp_path):
    path = files.written(tmp_path / "t.binary", b"old")
    assert run_limited(LIMITED, 1 << 20, str(path)).startswith(f"{path} cannot be written: File too large")
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


PICTURES = """
import signal, sys, numpy as np
from bvbedit import BvbError
from bvbedit.io.exr import write_exr
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
for size in sys.argv[2:]:
    height, width = map(int, size.split("x"))
    try:
        write_exr(sys.argv[1], np.random.default_rng(0).random((height, width, 3)))
        print("written")
    except BvbError as error:
        print(error)
"""


@pytest.mark.parametrize("largest", [0, 100, 300])
def test_pictures_of_any_size_that_do_not_fit_on_the_disk_leave_the_old_file(largest, tmp_path):
    """OpenEXR itself says nothing where the rest of a small picture does not fit."""
    path = files.written(tmp_path / "p.exr", b"old")
    sizes = ["1x1", "4x4", "8x1", "17x31", "100x100"]
    told = run_limited(PICTURES, largest, str(path), *sizes).splitlines()
    assert len(told) == len(sizes)
    assert all(line.startswith(f"{path} cannot be written: ") for line in told)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_pictures_that_just_fit_are_written(tmp_path):
    path = tmp_path / "p.exr"
    assert run_limited(PICTURES, 1 << 20, str(path), "1x1", "17x31") == "written\nwritten\n"


@pytest.mark.parametrize("name", ["missing/m.bvb", "file/m.bvb", "folder"])
def test_places_that_cannot_be_written_are_told(name, tmp_path):
    (tmp_path / "folder").mkdir()
    files.written(tmp_path / "file", b"a file, no folder")
    with pytest.raises(BvbError, match=r"cannot be|folder|suffix"):
        bvbedit.save(files.model(), tmp_path / name)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "folder"]


def test_a_read_only_folder_is_told_and_the_old_file_stays():
    folder = Path(tempfile.mkdtemp())
    path = files.written(folder / "m.bvb", b"old")
    folder.chmod(0o555)
    user = os.geteuid()
    if user == 0:
        os.seteuid(65534)  # nobody: the superuser may write anywhere
    try:
        with pytest.raises(BvbError, match="Permission denied"):
            bvbedit.save(files.model(), path)
    finally:
        os.seteuid(user)
        folder.chmod(0o700)
    assert path.read_bytes() == b"old"
    shutil.rmtree(folder)


def test_what_cannot_be_saved_is_told(tmp_path):
    for name in ("m.binary", "m.npz", "m", "m.txt"):
        with pytest.raises(BvbError, match="suffix"):
            bvbedit.save(files.model(), tmp_path / name)
    with pytest.raises(BvbError, match="no file format"):
        bvbedit.save(bvbedit.load(files.written(tmp_path / "a.bsdf", files.bsdf())), tmp_path / "b.bsdf")


def test_content_decides_and_not_the_name(tmp_path):
    kinds = {}
    for n, make in enumerate((files.bvb, files.bsdf, files.merl)):
        path = files.written(tmp_path / f"{n}.dat", make())
        kinds[n] = type(bvbedit.load(path)).__name__
    assert kinds == {0: "SplineBrdf", 1: "RglBrdf", 2: "MeasuredBrdf"}


def test_what_is_no_file_of_ours_is_refused(tmp_path):
    contents = {"empty": b"", "text": b"once upon a time\n" * 9, "zeros": bytes(1000), "zip": b"PK\3\4 but no zip"}
    for name, content in contents.items():
        path = files.written(tmp_path / name, content)
        with pytest.raises(BvbError, match=name) as refusal:
            bvbedit.load(path)
        assert str(path) in str(refusal.value)
        assert "\n" not in str(refusal.value)
    for path in (tmp_path, tmp_path / "nothing", Path("/dev/null"), tmp_path / "empty" / "below"):
        with pytest.raises(BvbError, match=path.name):
            bvbedit.load(path)


def test_a_pipe_is_refused_and_does_not_hang(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(BvbError, match="pipe"), reading(tmp_path / "pipe"):
        pass


@pytest.mark.parametrize("path", ["a\0b.bvb", b"a.bvb", 7, None, "\ud800.bvb"])
def test_what_can_name_no_file_is_refused_in_one_line(path):
    for use in (
        lambda: bvbedit.load(path),
        lambda: bvbedit.save(files.model(), path),
        lambda: check_target(path, (".bvb",)),
        lambda: make_folder(path),
    ):
        with pytest.raises(BvbError, match="cannot name a file") as refusal:
            use()
        assert "\n" not in str(refusal.value)


def test_pipes_and_devices_are_no_targets_and_stay(tmp_path):
    """Moved into place, a new file would stand where the pipe was, or a device of the whole machine.

    Devices are only looked at: written by the superuser with a defect here, /dev/null would be gone.
    """
    pipe = tmp_path / "pipe.bvb"
    os.mkfifo(pipe)
    with pytest.raises(BvbError, match="is a device or a pipe"), replacing(pipe):
        pass
    assert list(tmp_path.iterdir()) == [pipe]
    assert pipe.is_fifo()
    for target in (pipe, Path("/dev/null")):
        with pytest.raises(BvbError, match="is a device or a pipe"):
            check_target(target, (target.suffix,))


def test_names_of_long_characters_are_written(tmp_path):
    """244 of the 255 bytes that a name has: that of the temporary file must not be longer."""
    path = tmp_path / ("\N{ARTIST PALETTE}" * 60 + ".bvb")
    bvbedit.save(files.model(), path)
    assert list(tmp_path.iterdir()) == [path]


def test_names_that_are_too_long_are_told(tmp_path):
    for use in (lambda p: bvbedit.save(files.model(), p), lambda p: check_target(p, (".bvb",)), bvbedit.load):
        with pytest.raises(BvbError, match="File name too long"):
            use(tmp_path / ("a" * 300 + ".bvb"))


def test_errors_of_the_system_without_a_number_are_told(tmp_path):
    """Libraries raise OSError with a text alone, which has no strerror."""

    def spoiled() -> None:
        with replacing(tmp_path / "f"):
            raise OSError("the library\nfailed")

    with pytest.raises(BvbError, match="cannot be written: the library failed"):
        spoiled()
    assert list(tmp_path.iterdir()) == []


def test_targets_are_checked_before_long_work(tmp_path):
    check_target(tmp_path / "a.PNG", (".png", ".exr"))
    for bad in (tmp_path / "a.jpg", tmp_path, tmp_path / "no" / "a.png"):
        with pytest.raises(BvbError):
            check_target(bad, (".png", ".exr", ""))
    make_folder(tmp_path / "x" / "y")
    assert (tmp_path / "x" / "y").is_dir()
    files.written(tmp_path / "f", b"")
    with pytest.raises(BvbError, match="cannot be made a folder"):
        make_folder(tmp_path / "f" / "g")
