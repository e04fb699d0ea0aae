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
from bvbedit.io import bvb
from bvbedit.io.bvb import PRECISIONS, dumps, loads, stored_precision
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
    assert stored_precision(path) == precision
    for ours, theirs in zip(again.spline.knots, model.spline.knots, strict=True):
        np.testing.assert_array_equal(ours, theirs)
    np.testing.assert_array_equal(again.spline.control, model.spline.control.astype(precision))
    assert dumps(again, precision) == path.read_bytes()


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


@pytest.mark.parametrize(("limit", "word"), [("MOST_CONTROL", "control"), ("MOST_KNOTS", "knots")])
def test_numbers_are_counted_however_small_they_are_stored(limit, word, monkeypatch):
    """In memory each takes 8 bytes, in a file of float16 two."""
    content = {p: dumps(files.model(), p) for p in PRECISIONS}
    monkeypatch.setattr(bvb, limit, 7)
    for part in content.values():
        with pytest.raises(BvbError, match=rf"{word}\S* has [0-9]+ entries, more than the 7 allowed"):
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
    with pytest.raises(BvbError, match="report is no JSON") as refusal:
        bvbedit.save(spoiled, tmp_path / "m.bvb")
    assert "\n" not in str(refusal.value)
    assert list(tmp_path.iterdir()) == []


def test_every_flipped_bit_of_an_array_is_noticed():
    content = files.bvb()
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
