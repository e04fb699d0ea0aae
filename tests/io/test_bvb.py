"""The .bvb format: what is written is read, and nothing is believed."""

import io
import json
import zipfile

import numpy as np
import pytest

import bvbedit
from bvbedit import BvbError
from bvbedit.brdf.charts import CHARTS, FITTING_CHARTS
from bvbedit.brdf.encodings import Linear, Log, Root
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.brdf.storage import PRECISIONS, Storage, storage_named
from bvbedit.io import bvb
from bvbedit.io.bvb import dumps, loads
from tests.io import files


def members(content: bytes) -> dict[str, bytes]:
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def archive(parts: dict[str, bytes], method: int = zipfile.ZIP_DEFLATED) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", method) as out:
        for name, part in parts.items():
            out.writestr(name, part)
    return stream.getvalue()


def npy(array: np.ndarray, **options: bool) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array, **options)
    return stream.getvalue()


def changed(**changes: object) -> bytes:
    """Return a sound model's file with keys of meta.json changed, or removed by ``...``."""
    parts = members(files.bvb())
    meta = json.loads(parts["meta.json"]) | changes
    parts["meta.json"] = json.dumps({k: v for k, v in meta.items() if v is not ...}).encode()
    return archive(parts)


def replaced(name: str, content: bytes | None) -> bytes:
    parts = members(files.bvb()) | ({name: content} if content is not None else {})
    return archive({k: v for k, v in parts.items() if content is not None or k != name})


def stored(**changes: object) -> bytes:
    """Return a sound quantised file with keys of its storage in meta.json changed, or removed by ``...``."""
    parts = members(files.quantised())
    meta = json.loads(parts["meta.json"])
    meta["storage"] = {k: v for k, v in (meta["storage"] | changes).items() if v is not ...}
    parts["meta.json"] = json.dumps(meta).encode()
    return archive(parts)


def with_planes(planes: np.ndarray) -> bytes:
    return archive(members(files.quantised()) | {"control.npy": npy(planes)})


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("encoding", [Linear(), Root(4.0), Log(1e-4)], ids=repr)
@pytest.mark.parametrize("chart", FITTING_CHARTS)
def test_what_is_written_is_read(chart, encoding, precision, tmp_path):
    model = SplineBrdf(files.model().spline, CHARTS[chart], encoding, files.model().report)
    path = tmp_path / "m.bvb"
    bvbedit.save(model, path, precision=precision)
    again = bvbedit.load(path)
    assert isinstance(again, SplineBrdf)
    assert (again.chart, again.encoding, again.spline.degrees) == (model.chart, model.encoding, (3, 3, 2))
    assert dict(again.report) == dict(model.report)
    assert again.storage == storage_named(precision, model.spline.control)
    for ours, theirs in zip(again.spline.knots, model.spline.knots, strict=True):
        np.testing.assert_array_equal(ours, theirs)
    np.testing.assert_array_equal(again.spline.control, again.storage.rounded(model.spline.control))
    assert dumps(again) == dumps(again, precision) == path.read_bytes()
    assert dumps(model.stored_as(again.storage)) == path.read_bytes()


def test_a_quantised_file_keeps_its_step_whatever_is_asked_for_next():
    model = files.model().stored_as(Storage("quantised", 0.0375))
    content = dumps(model)
    again = loads(content)
    assert again.storage == model.storage
    np.testing.assert_allclose(again.spline.control, model.spline.control, rtol=0, atol=0.0375 / 2 + 1e-12)
    np.testing.assert_allclose(again.spline.control / 0.0375, np.rint(again.spline.control / 0.0375), rtol=0, atol=1e-9)
    assert dumps(again, "quantised") == content
    # float64 holds what was rounded exactly, so that there and back is the same file.
    assert dumps(loads(dumps(again, "float64")).stored_as(model.storage)) == content
    assert len(content) < len(dumps(model, "float16"))


def test_numpy_opens_planes_and_they_are_no_longer_than_needed(tmp_path):
    path = files.written(tmp_path / "m.bvb", files.quantised())
    with np.load(path, allow_pickle=False) as arrays:
        assert arrays["control"].dtype == np.uint8
        assert arrays["control"].shape == (2, 3, 7, 5, 3)
    described = json.loads(members(path.read_bytes())["meta.json"])["storage"]
    assert list(described) == ["precision", "step", "differences"]
    assert described["step"] == np.abs(files.model().spline.control).max() / 4096
    assert json.loads(members(files.bvb())["meta.json"])["storage"] == {"precision": "float32"}


def test_numpy_opens_it_without_pickle(tmp_path):
    path = files.written(tmp_path / "m.bvb", files.bvb())
    with np.load(path, allow_pickle=False) as arrays:
        assert arrays["control"].dtype == np.float32
        assert arrays["knots_0"].dtype == np.float64
        assert arrays["control"].shape == (7, 5, 3, 3)


def test_members_that_are_not_packed_are_read():
    assert dumps(loads(archive(members(files.bvb()), zipfile.ZIP_STORED))) == files.bvb()


def test_what_a_precision_cannot_hold_is_not_written(tmp_path):
    model = files.model()
    bright = model.with_spline(model.spline.with_control(model.spline.control * 1e6))
    path = files.written(tmp_path / "m.bvb", b"old")
    with pytest.raises(BvbError, match="does not fit into float16"):
        bvbedit.save(bright, path, precision="float16")
    with pytest.raises(BvbError, match="float99"):
        bvbedit.save(model, path, precision="float99")
    with pytest.raises(BvbError, match="more than 2,147,483,647 steps of 1e-30"):
        bvbedit.save(model.stored_as(Storage("quantised", 1e-30)), path)
    assert path.read_bytes() == b"old"


def shaped(shape: str) -> bytes:
    """Return an .npy member of a few zeros that claims ``shape``."""
    text = f"{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}\n".encode()
    return b"\x93NUMPY\2\0" + len(text).to_bytes(4, "little") + text + bytes(64)


BOMB = archive({"meta.json": b" " * (1 << 26)})
DEEP = (b"[" * 200_000) + (b"]" * 200_000)
KNOTS = members(files.bvb())["knots_0.npy"]
CONTROL = members(files.bvb())["control.npy"]
HUGE = CONTROL.replace(b"(7, 5, 3, 3)", b"(7000000, 5000000, 3, 3)"[:12].ljust(12))


@pytest.mark.parametrize(
    ("content", "word"),
    [
        (changed(version=2), "version 2; this bvbedit reads up to 1"),
        (changed(version="1"), "version"),
        (changed(version=True), "version"),
        (changed(version=...), "version"),
        (changed(format="other"), "format"),
        (changed(chart="polar"), "polar"),
        (changed(chart="rusinkiewicz"), "rusinkiewicz"),
        (changed(chart=["half-diff"]), "chart"),
        (changed(encoding={"name": "root", "k": 0}), "k is 0"),
        (changed(encoding={"name": "root", "q": 3}), "q"),
        (changed(encoding="root"), "encoding"),
        (changed(degrees=[3, 3]), "2 degrees"),
        (changed(degrees=[3, 3, 99]), "99"),
        (changed(degrees=[3, 3, "2"]), "degrees"),
        (changed(degrees=[2, 3, 2]), "stands more than 3 times"),
        (changed(report=[]), "report"),
        (changed(report={"a": float("nan")}), "NaN is no finite number"),
        (changed(report={"a": -float("inf")}), "-Infinity is no finite number"),
        (replaced("meta.json", b'{"report": 1e999}'), "1e999 is no finite number"),
        (changed(format="x" * 9999), "format"),
        (changed(version=10**4000), "version 1000"),
        (changed(version=[1] * 9999), "version"),
        (changed(degrees=[[3] * 9999]), "degrees"),
        (replaced("control.npy", shaped("(" + "7, " * 999 + ")")), "has shape"),
        (replaced("control.npy", shaped("(" + "9, " * 3 + "9" * 3000 + ")")), "claims shape"),
        (archive(members(files.bvb()), zipfile.ZIP_BZIP2), "meta.json is packed by method 12"),
        (archive(members(files.bvb()), zipfile.ZIP_LZMA), "meta.json is packed by method 14"),
        (archive(members(files.bvb()) | {f"{n:040}": b"" for n in range(12_500)}), "list of members is too long"),
        (changed(storage=...), "storage is None, not an object"),
        (changed(storage="float32"), "storage is 'float32', not an object"),
        (changed(storage={}), "Unknown precision ''"),
        (changed(storage={"precision": "float8"}), "Unknown precision 'float8'"),
        (changed(storage={"precision": ["float32"] * 9999}), "Unknown precision"),
        (changed(storage={"precision": "float16"}), "holds float32, not float16"),
        (changed(storage={"precision": "quantised", "step": 1.0, "differences": []}), "float32, not uint8"),
        (changed(storage={"precision": "float32", "step": 0.1}), "float32 has no step"),
        (changed(storage={"precision": "float32", "step": None}), "missing or unknown"),
        (changed(storage={"precision": "float32", "differences": []}), "missing or unknown"),
        (changed(storage={"precision": "float32", "x": "y" * 9999}), "missing or unknown"),
        (stored(step=...), "A step of None"),
        (stored(step=0), "A step of 0 "),
        (stored(step=-0.1), "A step of -0.1"),
        (stored(step=True), "A step of True"),
        (stored(step="0.1"), "A step of '0.1'"),
        (stored(step=1e305), r"A step of 1e\+305"),
        (stored(step=10**4000), "A step of 1000"),
        (stored(step=float("nan")), "NaN is no finite number"),
        (stored(precision="uint8"), "Unknown precision 'uint8'"),
        (stored(precision="float32"), "float32 has no step"),
        (stored(planes=2), "missing or unknown"),
        (stored(differences=...), "missing or unknown"),
        (stored(differences=2), "differences are 2, not a list"),
        (stored(differences=[0.0]), "not a list of whole numbers"),
        (stored(differences=[True]), "not a list of whole numbers"),
        (stored(differences=[3]), r"along axes \[3\]"),
        (stored(differences=[-1]), r"along axes \[-1\]"),
        (stored(differences=[1, 0]), r"along axes \[1, 0\]"),
        (stored(differences=[1, 1]), r"along axes \[1, 1\]"),
        (stored(differences=[0] * 9999), "along axes"),
        (stored(degrees=3), "missing or unknown"),
        (with_planes(np.zeros((2, 3, 7, 5, 3), np.int8)), "int8, not uint8"),
        (with_planes(np.zeros((3, 7, 5, 3), np.uint8)), "5 dimensions"),
        (with_planes(np.zeros((0, 3, 7, 5, 3), np.uint8)), "has shape"),
        (with_planes(np.zeros((6, 3, 7, 5, 3), np.uint8)), "no planes of a net"),
        (with_planes(np.zeros((2, 1, 7, 5, 3), np.uint8)), r"ask for size \(7, 5, 3\)"),
        (with_planes(np.zeros((2, 3, 3, 5, 7), np.uint8)), r"ask for size \(7, 5, 3\)"),
        (with_planes(np.zeros((1, 3, 7, 5, 6), np.uint8)), r"ask for size \(7, 5, 3\)"),
        (with_planes(np.full((5, 3, 7, 5, 3), 255, np.uint8)), "beyond 2,147,483,647 steps"),
        (replaced("meta.json", b"{"), "not JSON"),
        (replaced("meta.json", b"[1]"), "not a JSON object"),
        (replaced("meta.json", b"\xff\xfe"), "not JSON"),
        (replaced("meta.json", DEEP), "not JSON"),
        (replaced("control.npy", None), "no control.npy"),
        (replaced("control.npy", npy(np.full((7, 5, 3, 3), np.nan, np.float32))), "nan"),
        (replaced("control.npy", npy(np.zeros((7, 5, 3, 4), np.float32))), "3 channels"),
        (replaced("control.npy", npy(np.zeros((7, 5, 3), np.float32))), "4 dimensions"),
        (replaced("control.npy", npy(np.zeros((6, 5, 3, 3), np.float32))), "shape"),
        (replaced("control.npy", npy(np.zeros((7, 5, 3, 3), np.int64))), "int64"),
        (replaced("control.npy", npy(np.full((7, 5, 3, 3), None), allow_pickle=True)), "object"),
        (replaced("control.npy", HUGE), "control.npy"),
        (replaced("control.npy", CONTROL[:-4]), "claims shape"),
        (replaced("control.npy", b""), "header"),
        (replaced("knots_0.npy", npy(np.array([0, 0, 0, 0, 0.5, 0.4, 0.6, 1, 1, 1, 1.0]))), "decrease"),
        (replaced("knots_0.npy", npy(np.array([0, 0, 0, 0, 0.4, 0.5, 0.6, 2, 2, 2, 2.0]))), r"\[0, 1\]"),
        (replaced("knots_0.npy", npy(np.full(11, np.nan))), "finite"),
        (BOMB, "more than"),
        (archive({"other": b""}), r"meta.json|axis_0"),
        (files.bvb()[:-30], "not a whole zip"),
    ],
)
def test_what_is_no_sound_model_is_refused(content, word, tmp_path):
    path = files.written(tmp_path / "bad.bvb", content)
    with pytest.raises(BvbError, match=word) as refusal:
        loads(content, str(path))
    assert str(path) in str(refusal.value)
    assert "\n" not in str(refusal.value)
    assert len(str(refusal.value)) < len(str(path)) + 350


@pytest.mark.parametrize(
    ("limit", "most", "word"),
    [("MOST_CONTROL", 7, "control"), ("MOST_CONTROL", 314, "control"), ("MOST_KNOTS", 7, "knots")],
)
def test_numbers_are_counted_however_small_they_are_stored(limit, most, word, monkeypatch):
    """In memory each takes 8 bytes, in a file of float16 two, in one plane a single one."""
    content = [dumps(files.model(), p) for p in PRECISIONS]
    # Few planes may hold as many bytes as the most planes of a net within the limit.
    content.append(dumps(files.model().stored_as(Storage("quantised", 1.0))))
    monkeypatch.setattr(bvb, limit, most)
    for part in content:
        with pytest.raises(BvbError, match=rf"{word}\S* has [0-9]+ entries, more than the [0-9]+ allowed"):
            loads(part)
    with pytest.raises(BvbError, match="too much for a file"):
        dumps(files.model())


def test_a_report_longer_than_would_be_read_is_not_written(monkeypatch):
    monkeypatch.setattr(bvb, "LARGEST_META", 100)
    with pytest.raises(BvbError, match="bytes of report are too much"):
        dumps(files.model())


@pytest.mark.parametrize("entry", [float("nan"), float("inf"), 1j, {1, 2}, np.float32(1)])
def test_a_report_that_is_no_json_is_not_written(entry, tmp_path):
    m = files.model()
    spoiled = SplineBrdf(m.spline, m.chart, m.encoding, {"a": entry})
    with pytest.raises(BvbError, match="report or recipe is no JSON") as refusal:
        bvbedit.save(spoiled, tmp_path / "m.bvb")
    assert "\n" not in str(refusal.value)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("make", [files.bvb, files.quantised])
def test_every_flipped_bit_of_an_array_is_noticed(make):
    content = make()
    with zipfile.ZipFile(io.BytesIO(content)) as whole:
        info = whole.getinfo("control.npy")
    start = info.header_offset + 30 + len("control.npy")
    for at in range(start, start + info.compress_size, 7):
        damaged = content[:at] + bytes([content[at] ^ 4]) + content[at + 1 :]
        with pytest.raises(BvbError):
            loads(damaged)


def test_a_member_that_stands_twice_is_refused():
    stream = io.BytesIO(files.bvb())
    with zipfile.ZipFile(stream, "a") as out, pytest.warns(UserWarning, match="Duplicate"):
        out.writestr("control.npy", CONTROL)
    with pytest.raises(BvbError, match="twice"):
        loads(stream.getvalue())


def test_a_member_that_inflates_to_more_than_it_claims_is_refused():
    content = bytearray(archive({"meta.json": b" " * 100_000_000}))
    # The claim of the uncompressed size, in the local header and in the directory.
    for signature, offset in ((b"PK\3\4", 22), (b"PK\1\2", 24)):
        at = content.index(signature) + offset
        content[at : at + 4] = (1000).to_bytes(4, "little")
    with pytest.raises(BvbError, match=r"meta\.json"):
        loads(bytes(content))
