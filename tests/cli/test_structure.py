"""refine, remove, elevate, reduce and blend: one file in, one file out, and what changed."""

import json

import numpy as np
import pytest

import bvbedit
from bvbedit.brdf.spline_brdf import face_spread
from bvbedit.brdf.storage import Storage

KEYS = ["file", "size_before", "size_after", "bytes_before", "bytes_after", "max_change"]
EDITS = {
    "refine at": ("refine", "--axis", "0", "--at", "0.123,0.5"),
    "refine by": ("refine", "--axis", "2", "--factor", "2"),
    "remove": ("remove", "--axis", "0", "--tolerance", "0.05"),
    "elevate": ("elevate", "--axis", "1", "--by", "2"),
    "reduce": ("reduce", "--axis", "1", "--by", "1"),
}


@pytest.fixture
def grey(folder):
    return folder / "grey.bvb"


@pytest.mark.parametrize(("command", "arguments"), [(e[0], e[1:]) for e in EDITS.values()], ids=EDITS)
def test_an_edit_writes_a_model_and_tells_what_changed(command, arguments, run, folder, tmp_path, rng):
    source, target = folder / "satin.bvb", tmp_path / "edited.bvb"
    status, out, err = run(command, source, target, *arguments, "--json")
    assert (status, err, out.count("\n")) == (0, "", 1)
    told = json.loads(out)
    assert all(key in told for key in KEYS)
    before, after = bvbedit.load(source), bvbedit.load(target)
    assert told["size_before"] == list(before.spline.size)
    assert told["size_after"] == list(after.spline.size)
    assert told["bytes_before"] == source.stat().st_size
    assert told["bytes_after"] == target.stat().st_size
    x = rng.uniform(0, 1, (3000, 3))
    assert np.abs(after.spline.evaluate(x) - before.spline.evaluate(x)).max() <= told["max_change"]
    # Refining and elevating change nothing but by what rounding to the file's float32 does.
    limit = {"remove": 0.051, "reduce": 3.0}.get(command, 2e-6)
    assert told["max_change"] < limit
    assert face_spread(after.spline.control, after.chart) == 0


@pytest.mark.parametrize("storage", [Storage("float16"), Storage("float64"), Storage("quantised", 0.003)], ids=repr)
def test_the_storage_of_the_file_is_kept_and_its_rounding_told(storage, run, folder, grey, tmp_path, rng):
    source, target = tmp_path / "in.bvb", tmp_path / "out.bvb"
    bvbedit.save(bvbedit.load(folder / "satin.bvb").stored_as(storage), source)
    before = bvbedit.load(source)
    assert before.storage == storage
    told = json.loads(run("refine", source, target, "--axis", "0", "--factor", "2", "--json")[1])
    after = bvbedit.load(target)
    assert after.storage == storage
    exact = before.spline.refine(0, 2).control
    largest = np.abs(after.spline.control - exact).max()
    assert told["max_change"] == pytest.approx(largest, abs=1e-14)
    x = rng.uniform(0, 1, (3000, 3))
    change = np.abs(after.spline.evaluate(x) - before.spline.evaluate(x)).max()
    assert change <= told["max_change"] + 1e-14
    if storage.step is not None:
        assert 0.001 < told["max_change"] <= 0.0015 + 1e-12
    # A mixture that is refitted is stored as the others are: once is enough.
    for space in ("net", "linear") if storage.step is not None else ("net",):
        assert run("blend", source, grey, target, "--t", "0.5", "--space", space)[0] == 0
        assert bvbedit.load(target).storage == storage


def test_an_edit_beyond_the_storage_of_the_file_is_refused(run, folder, tmp_path):
    source, target = tmp_path / "in.bvb", tmp_path / "out.bvb"
    model = bvbedit.load(folder / "satin.bvb")
    one = model.with_spline(model.spline.with_control(model.spline.control / np.abs(model.spline.control).max()))
    bvbedit.save(one.stored_as(Storage("quantised", 1.0 / (2**31 - 1))), source)
    status, out, err = run("blend", source, folder / "satin.bvb", target, "--t", "-99")
    assert (status, out, err.count("\n")) == (1, "", 1)
    assert "steps of 4.65661e-10" in err
    assert not target.exists()


def test_a_file_may_be_edited_in_place(run, folder, tmp_path):
    path = tmp_path / "model.bvb"
    assert run("refine", folder / "satin.bvb", path, "--axis", "0", "--factor", "2")[0] == 0
    told = json.loads(run("remove", path, path, "--axis", "0", "--tolerance", "1e-5", "--json")[1])
    assert told["size_after"] == list(bvbedit.load(folder / "satin.bvb").spline.size)


@pytest.mark.parametrize("space", ["net", "linear", "log"])
def test_blending_lies_between_the_two_materials(space, run, folder, grey, tmp_path, rng):
    target = tmp_path / "mixed.bvb"
    status, out, _ = run("blend", folder / "satin.bvb", grey, target, "--t", "0.5", "--space", space, "--json")
    assert status == 0
    told = json.loads(out)
    assert all(key in told for key in KEYS)
    a, b, mixed = (bvbedit.load(p) for p in (folder / "satin.bvb", grey, target))
    wo = rng.normal(size=(500, 3))
    wi = rng.normal(size=(500, 3))
    wo[:, 2], wi[:, 2] = 0.4 + np.abs(wo[:, 2]), 0.4 + np.abs(wi[:, 2])
    low = np.minimum(a.evaluate(wi, wo), b.evaluate(wi, wo))
    high = np.maximum(a.evaluate(wi, wo), b.evaluate(wi, wo))
    middle = mixed.evaluate(wi, wo)
    assert (middle > low * 0.97).all()
    assert (middle < high * 1.03).all()


def test_a_share_for_each_channel(run, folder, grey, tmp_path):
    target = tmp_path / "mixed.bvb"
    assert run("blend", folder / "satin.bvb", grey, target, "--t", "0,0.5,1")[0] == 0
    a, b, mixed = (bvbedit.load(p).evaluate([0.3, 0, 1], [-0.2, 0.1, 1]) for p in (folder / "satin.bvb", grey, target))
    np.testing.assert_allclose(mixed[[0, 2]], [a[0], b[2]], rtol=1e-5)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("refine", "M", "OUT", "--axis", "0"), "--at or --factor"),
        (("refine", "M", "OUT", "--axis", "0", "--at", "0.5", "--factor", "2"), "--at or --factor"),
        (("refine", "M", "OUT", "--axis", "0", "--at", "0.5,0.2"), "knot 1 to insert is 0.2"),
        (("refine", "M", "OUT", "--axis", "0", "--at", "1.5"), "1.5"),
        (("refine", "M", "OUT", "--axis", "3", "--factor", "2"), "axis is 3"),
        (("remove", "M", "OUT", "--axis", "0", "--tolerance", "-1"), "-1"),
        (("remove", "M", "OUT", "--axis", "0", "--tolerance", "nan"), "nan"),
        (("elevate", "M", "OUT", "--axis", "0", "--by", "14"), "14"),
        (("reduce", "M", "OUT", "--axis", "0", "--by", "4"), "4"),
        (("reduce", "M", "OUT", "--axis", "0", "--tolerance", "1e-9"), "1e-09"),
        (("refine", "TABLE", "OUT", "--axis", "0", "--factor", "2"), "is a measurement"),
        (("blend", "M", "TABLE", "OUT", "--t", "0.5"), "is a measurement"),
        (("blend", "M", "M", "OUT", "--t", "0.5,0.2"), "t is"),
        (("blend", "M", "M", "OUT", "--t", "inf"), "inf"),
        (("blend", "M", "M", "OUT", "--t", "0.5", "--space", "gamma"), "gamma"),
    ],
)
def test_what_cannot_be_done_ends_in_one_line_and_writes_nothing(arguments, words, run, folder, tmp_path):
    target = tmp_path / "out.bvb"
    names = {"M": folder / "satin.bvb", "TABLE": folder / "satin.binary", "OUT": target}
    status, out, err = run(*(names.get(a, a) for a in arguments))
    assert (status, out, err.count("\n")) == (1, "", 1)
    assert err.startswith("error: ")
    assert words in err
    assert not target.exists()


def test_what_is_no_number_is_wrong_usage(run, folder, tmp_path):
    status, out, _ = run("blend", folder / "satin.bvb", folder / "satin.bvb", tmp_path / "o.bvb", "--t", "half")
    assert (status, out) == (2, "")
    assert run("refine", folder / "satin.bvb", tmp_path / "o.bvb", "--factor", "2")[0] == 2
