"""The generated database as files: whole ones, gone on with after a stop, the same for any number of processes."""

import errno
import shutil
from collections import namedtuple
from pathlib import Path

import numpy as np
import pytest

import bvbedit
from bvbedit.brdf.charts import RUSINKIEWICZ
from bvbedit.brdf.database import Generated, database
from bvbedit.brdf.goniophotometer import GRIDS, Grid
from bvbedit.io import database as files
from bvbedit.io.database import is_whole_file, most_bytes, write_database
from tests.spline.refusals import refusal

TWO = list(database(2).values())


@pytest.fixture
def quick(monkeypatch):
    """Measurements in no time, with something in the file that tells them apart."""

    def make(task):
        name, file, grid = task
        file.write_bytes(np.array([90, 90, 180], "<i4").tobytes() + name.encode().ljust(most_bytes(grid) - 12))
        return name

    monkeypatch.setattr(files, "_make", make)


@pytest.fixture(scope="module")
def one(tmp_path_factory):
    """The folder with the first material's file, and what was told of it."""
    folder, told = tmp_path_factory.mktemp("one"), []
    return *write_database(TWO[:1], folder, progress=told.append), told


def test_a_file_holds_the_measurement_with_its_noise(one):
    written, told = one
    assert written.status == "made"
    assert told == [1.0]
    assert written.bytes == most_bytes("merl") == written.file.stat().st_size
    table = bvbedit.load(written.file)
    nodes = np.argwhere(table.valid[:40, :40])[::97]
    wi, wo = table.chart.to_directions(np.stack([u[k] for u, k in zip(table.axes, nodes.T, strict=True)], axis=-1))
    ratio = table.values[tuple(nodes.T)] / TWO[0].brdf.evaluate(wi, wo)
    # The floor of the noise adds a little.
    assert ratio.std() == pytest.approx(TWO[0].noise, rel=0.1)


def test_processes_write_what_one_does(one, tmp_path):
    written = write_database(TWO, tmp_path, jobs=2)
    assert [w.status for w in written] == ["made"] * 2
    assert written[0].file.read_bytes() == one[0].file.read_bytes()
    assert len(list(tmp_path.iterdir())) == 2


@pytest.mark.usefixtures("quick")
def test_what_is_there_and_whole_stays(tmp_path):
    many = list(database(5).values())
    assert [w.status for w in write_database(many[:3], tmp_path)] == ["made"] * 3
    cut, foreign = (tmp_path / f"{m.name}.binary" for m in many[1:3])
    cut.write_bytes(cut.read_bytes()[:-1])
    foreign.write_bytes(b"\0" * most_bytes("merl"))
    old = (tmp_path / f"{many[0].name}.binary").stat().st_mtime_ns
    assert [w.status for w in write_database(many, tmp_path)] == ["kept", "made", "made", "made", "made"]
    assert (tmp_path / f"{many[0].name}.binary").stat().st_mtime_ns == old
    assert [w.status for w in write_database(many, tmp_path)] == ["kept"] * 5


def test_tables_are_whole_if_their_checksums_are(monkeypatch, tmp_path):
    small = Grid(RUSINKIEWICZ, tuple(u[::15] for u in RUSINKIEWICZ.grid))
    monkeypatch.setattr("bvbedit.brdf.goniophotometer.GRIDS", {**GRIDS, "paper": small})
    (written,) = write_database(TWO[:1], tmp_path, grid="paper")
    assert written.file.suffix == ".npz"
    whole = written.file.read_bytes()
    assert len(whole) < most_bytes("paper")
    assert write_database(TWO[:1], tmp_path, grid="paper")[0].status == "kept"
    for at in (60, len(whole) // 2, len(whole) - 10):
        written.file.write_bytes(whole[:at] + bytes([whole[at] ^ 0xFF]) + whole[at + 1 :])
        assert not is_whole_file(written.file, "paper") or bvbedit.load(written.file)
        written.file.write_bytes(whole[:at])
        assert not is_whole_file(written.file, "paper")


@pytest.mark.usefixtures("quick")
def test_a_full_disk_is_told_before_the_start(monkeypatch, tmp_path):
    usage = namedtuple("usage", "total used free")
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage(10**10, 0, 3 * 10**9))
    words = refusal(lambda: write_database(list(database(100).values()), tmp_path / "db"))
    assert "100 files take up to 3.5 GB, and 3.0 GB are free" in words
    assert not list((tmp_path / "db").iterdir())
    # What is there needs no room.
    some = list(database(3).values())
    write_database(some, tmp_path / "db")
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage(10**10, 0, 0))
    assert {w.status for w in write_database(some, tmp_path / "db")} == {"kept"}


def test_a_disk_that_fills_up_meanwhile_leaves_whole_files_only(one, monkeypatch, tmp_path):
    real, table = files.save, bvbedit.load(one[0].file)
    monkeypatch.setattr(Generated, "measured", lambda *_: table)

    def full(model, file):
        if TWO[1].name in str(file):
            raise bvbedit.BvbError(f"{file} cannot be written: {errno.errorcode[errno.ENOSPC]}. Make room.")
        real(model, file)

    monkeypatch.setattr(files, "save", full)
    assert TWO[1].name in refusal(lambda: write_database(TWO, tmp_path))
    assert [p.name for p in tmp_path.iterdir()] == [f"{TWO[0].name}.binary"]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"jobs": 0}, "--jobs is 0"),
        ({"jobs": 1.5}, "--jobs is 1.5"),
        ({"grid": "half-diff"}, "merl, paper"),
        ({"folder": "/proc/none"}, "cannot be made a folder"),
    ],
)
def test_mistakes_are_told_in_one_line(options, words, tmp_path):
    given = {"folder": Path(tmp_path)} | options
    assert words in refusal(lambda: write_database(TWO, given.pop("folder"), **given))
