"""edit, run and history: in words, one JSON object or one line of error, and nothing half-written."""

import json

import numpy as np
import pytest

import bvbedit
from bvbedit.brdf.charts import HALF_DIFF
from bvbedit.brdf.measured import MeasuredBrdf
from bvbedit.brdf.storage import Storage
from bvbedit.edit.appearance import Gain, Tint
from bvbedit.edit.document import Document, digest
from bvbedit.edit.operations import OPERATIONS
from bvbedit.io.bvb import load_recipe
from tests.edit.samples import LOOK, smooth

KEYS = {"file", "size_before", "size_after", "bytes_before", "bytes_after", "max_change"}


@pytest.fixture
def home(tmp_path):
    bvbedit.save(smooth(), tmp_path / "gold.bvb")
    bvbedit.save(Tint(rgb=(0.8, 1, 1.2)).apply(smooth()), tmp_path / "silver.bvb")
    axes = (np.linspace(0, 1, 3),) * 3
    table = MeasuredBrdf(np.ones((3, 3, 3, 3)), np.ones((3, 3, 3), dtype=bool), axes, HALF_DIFF)
    bvbedit.save(table, tmp_path / "table.npz")
    (tmp_path / "look.toml").write_text(LOOK)
    return tmp_path


def names(folder):
    return sorted(p.name for p in folder.iterdir())


def told(result):
    """The one JSON object of a command that succeeded."""
    status, out, err = result
    assert (status, err) == (0, "")
    assert out.endswith("}\n")
    assert out.count("\n") == 1
    return json.loads(out)


def refused(result):
    """The one line of a command that did not."""
    status, out, err = result
    assert (status, out, err.count("\n")) == (1, "", 1), (status, out, err)
    assert err.startswith("error: ")
    assert "Traceback" not in err
    return err


# ------------------------------------------------------------------------------------------------- edit


def test_edits_in_words_are_made_in_their_order_and_told(run, home):
    target = home / "edited.bvb"
    lines = ["gain factor=2 theta_h=0..20", "tint rgb=1,0.8,0.6", "refine axis=0"]
    result = run("edit", home / "gold.bvb", target, *[x for line in lines for x in ("--op", line)], "--json")
    answer = told(result)
    assert answer.keys() >= KEYS
    before, after = bvbedit.load(home / "gold.bvb"), bvbedit.load(target)
    assert answer["file"] == str(target)
    assert (answer["size_before"], answer["size_after"]) == (list(before.spline.size), list(after.spline.size))
    assert answer["bytes_before"] == (home / "gold.bvb").stat().st_size
    assert answer["bytes_after"] == target.stat().st_size
    x = np.random.default_rng(1).random((2000, 3))
    change = np.abs(after.spline.evaluate(x) - before.spline.evaluate(x)).max()
    assert 0.8 * answer["max_change"] < change <= answer["max_change"]
    assert answer["plausibility"].keys() == {"before", "after"}
    assert [set(line.split()) for line in Document.open(target).lines[:3]] == [set(line.split()) for line in lines]


def test_without_json_a_short_table_is_printed(run, home):
    status, out, err = run("edit", home / "gold.bvb", home / "b.bvb", "--op", "gain factor=2")
    assert (status, err) == (0, "")
    assert "max change" in out


def test_a_file_may_be_edited_in_place_and_in_another_precision(run, home):
    path = home / "edited.bvb"
    assert "would be lost" in refused(run("edit", home / "gold.bvb", home / "gold.bvb", "--op", "gain factor=2"))
    both = "edit", home / "gold.bvb", home / "silver.bvb", "--op", f"blend partner={home / 'silver.bvb'} t=0.5"
    assert "would be lost" in refused(run(*both))
    run("edit", home / "gold.bvb", path, "--op", "gain factor=2")
    for precision in ("float16", "quantised", "float64"):
        told(run("edit", path, path, "--op", "gain factor=1.5", "--precision", precision, "--json"))
        assert bvbedit.load(path).storage.precision == precision
    assert [step["op"] for step in load_recipe(path)["steps"]] == ["gain", "store"] * 3 + ["gain"]


def test_a_model_is_fitted_anew_in_words_and_its_history_tells_how(run, home):
    line = "fit chart=half-diff encoding=root size=6,5,4 knots=averaged"
    answer = told(run("edit", home / "gold.bvb", home / "small.bvb", "--op", "gain factor=2", "--op", line, "--json"))
    assert answer["size_after"] == [6, 5, 4]
    assert 0 < answer["steps"][1]["refit_error"] < 0.01
    assert "log_cosine_rms to the model before" in answer["steps"][1]["notes"][-1]
    _, out, _ = run("history", home / "small.bvb", "--recipe")
    assert 'op = "fit"\nchart = "half-diff"\nencoding = "root"\nsize = [6, 5, 4]\nknots = "averaged"\n' in out


def test_the_storage_of_a_file_is_kept(run, home):
    bvbedit.save(smooth().stored_as(Storage("quantised", 0.003)), home / "rough.bvb")
    run("edit", home / "rough.bvb", home / "b.bvb", "--op", "gain factor=1.1")
    assert bvbedit.load(home / "b.bvb").storage == Storage("quantised", 0.003)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("gold.bvb", "o.bvb", "--op", "gain factor=nan"), ("factor is nan",)),
        (("gold.bvb", "o.bvb", "--op", "fit size=8,8,8 tolerance=1"), ("exclude each other",)),
        (("gold.bvb", "o.bvb", "--op", "gian factor=2"), ("gian", "gain")),
        (("gold.bvb", "o.bvb", "--op", "gain factr=2"), ("factr is not known", "Did you mean factor?")),
        (
            ("gold.bvb", "o.bvb", "--op", "gain factor=2 theta_h=20..10"),
            ("theta_h is [20.0, 10.0]", "smaller one first"),
        ),
        (("gold.bvb", "o.bvb", "--op", "gain factor=2 theta_h=50.1..50.2 falloff=0"), ("gain: No control point",)),
        (("gold.bvb", "o.bvb", "--op", ""), ("''",)),
        (("gold.bvb", "o.bvb", "--op", "blend partner=none.bvb t=0.5"), ("none.bvb does not exist",)),
        (("gold.bvb", "o.bvb", "--op", "gain factor=2", "--op", "reduce axis=0 by=4"), ("edit 2 (reduce): ", "4")),
        (("gold.bvb", "o.bvb", "--op", "gain factor=2", "--precision", "float8"), ("float8", "float16")),
        (("gold.bvb", "o.npz", "--op", "gain factor=2"), ("o.npz", ".bvb")),
        (("gold.bvb", "none/o.bvb", "--op", "gain factor=2"), ("none",)),
        (("none.bvb", "o.bvb", "--op", "gain factor=2"), ("none.bvb does not exist",)),
        (("table.npz", "o.bvb", "--op", "gain factor=2"), ("is a measurement", "bvbedit fit")),
        (("look.toml", "o.bvb", "--op", "gain factor=2"), ("look.toml",)),
    ],
)
@pytest.mark.parametrize("as_json", [(), ("--json",)], ids=["table", "json"])
def test_what_cannot_be_edited_ends_in_one_line_and_writes_nothing(arguments, words, as_json, run, home, monkeypatch):
    monkeypatch.chdir(home)
    before = names(home)
    err = refused(run("edit", *arguments, *as_json))
    assert all(word in err for word in words), err
    assert names(home) == before


def test_a_failed_edit_in_place_leaves_the_file(run, home):
    before = (home / "gold.bvb").read_bytes()
    refused(run("edit", home / "gold.bvb", home / "gold.bvb", "--op", "gain factor=2", "--op", "reduce axis=0 by=4"))
    assert (home / "gold.bvb").read_bytes() == before


def test_without_an_edit_there_is_nothing_to_do(run, home):
    assert "Nothing to do" in refused(run("edit", home / "gold.bvb", home / "b.bvb"))


def test_all_operations_are_listed_with_their_parameters(run):
    status, out, err = run("edit", "--operations")
    assert (status, err) == (0, "")
    for op, kind in OPERATIONS.items():
        assert f"{op}: {kind.about}" in out
    assert "hue          turn of the hue, from red to yellow to green, -180 ... 180 degrees (0.0)" in out
    assert "factor       how many times as bright, 0 ... 1e+06 (needed)" in out


def test_the_first_steps_of_a_history_are_the_way_back(run, home):
    target = home / "edited.bvb"
    run("edit", home / "gold.bvb", target, "--op", "gain factor=2", "--op", "tint hue=20", "--precision", "float64")
    run("edit", home / "gold.bvb", home / "half.bvb", "--op", "gain factor=2", "--precision", "float64")
    (home / "again.toml").write_text(run("history", target, "--recipe", "--until", "1")[1])
    told(run("run", home / "again.toml", "--json"))
    assert digest(bvbedit.load(home / "edited-again.bvb")) == digest(bvbedit.load(home / "half.bvb"))
    assert "has 2 steps" in refused(run("history", target, "--until", "3"))


# ------------------------------------------------------------------------------------------------- run


def test_a_recipe_is_run_and_what_became_of_it_told(run, home):
    answer = told(run("run", home / "look.toml", "--json"))
    assert answer.keys() == {"recipe", "materials"}
    (material,) = answer["materials"]
    assert material["status"] == "made"
    assert material["source"] == str(home / "gold.bvb")
    assert material["outputs"] == [str(home / "gold-warm.bvb")]
    assert material["error"] is None
    assert material["seconds"] >= 0
    again = told(run("run", home / "look.toml", "--json"))
    assert again["materials"][0]["status"] == "up to date"
    assert told(run("run", home / "look.toml", "--again", "--json"))["materials"][0]["status"] == "made"
    status, out, err = run("run", home / "look.toml")
    assert (status, err) == (0, "")
    assert "up to date" in out


def test_parameters_are_set_and_other_materials_named_from_outside(run, home):
    out = home / "new" / "folder"
    result = run(
        "run",
        home / "look.toml",
        "--set",
        "warm.rgb=1,1,1",
        "--set",
        "2.factor=3",
        "--on",
        home / "gold.bvb",
        home / "silver.bvb",
        "--out",
        out,
        "--json",
    )
    assert [m["status"] for m in told(result)["materials"]] == ["made"] * 2
    assert names(out) == ["gold-warm.bvb", "silver-warm.bvb"]
    gold = Gain(factor=3).apply(Tint(rgb=(1, 1, 1)).apply(bvbedit.load(home / "gold.bvb")))
    np.testing.assert_array_equal(
        bvbedit.load(out / "gold-warm.bvb").spline.control, gold.storage.rounded(gold.spline.control)
    )


def test_one_that_fails_does_not_stop_the_others_and_is_told_in_the_end(run, home):
    (home / "broken.bvb").write_bytes(b"PK no archive")
    sources = [home / name for name in ("gold.bvb", "broken.bvb", "silver.bvb")]
    status, out, err = run("run", home / "look.toml", "--on", *sources, "--out", home / "out", "--json")
    assert (status, err.count("\n"), out.count("\n")) == (1, 1, 1)
    assert err.startswith("error: 1 of 3 could not be made: ")
    assert "broken.bvb" in err
    assert [m["status"] for m in json.loads(out)["materials"]] == ["made", "failed", "made"]
    assert names(home / "out") == ["gold-warm.bvb", "silver-warm.bvb"]
    status, out, err = run("run", home / "look.toml", "--on", *sources, "--out", home / "out")
    assert (status, err.count("\n")) == (1, 1)
    assert [line.split()[0] for line in out.splitlines()] == [s.name for s in sources]
    assert "up to date" in out.splitlines()[0]


@pytest.mark.parametrize(
    ("change", "arguments", "words"),
    [
        (("factor = 2", "factor = nan"), (), ("look.toml, line 10", "factor is nan")),
        (("factor = 2", "factr = 2"), (), ("look.toml, line 10", "Did you mean factor?")),
        (('op = "gain"\nfactor = 2', 'op = "reduce"\naxis = 0\nby = 4'), (), ("look.toml, line 8: step 2 (reduce): ",)),
        (
            ('op = "gain"\nfactor = 2', 'op = "blend"\nt = 1\npartner = "no.bvb"'),
            (),
            ("line 8: step 2 (blend): ", "no.bvb"),
        ),
        (("gold.bvb", "lead.bvb"), (), ("lead.bvb does not exist",)),
        (("{name}-warm", "gold"), (), ("gold.bvb is a source or a partner itself",)),
        (("", ""), ("--set", "cold.rgb=1,1,1"), ("'cold'", "warm")),
        (("", ""), ("--set", "2.factor=-1"), ("look.toml, line 8", "factor is -1")),
        (("", ""), ("--set", "2.factor"), ("sets nothing",)),
        (("", ""), ("--jobs", "0"), ("--jobs is 0", "1 ... 256")),
        (("", ""), ("--on", "none.bvb"), ("none.bvb does not exist",)),
        (("", ""), ("--out", "gold.bvb"), ("gold.bvb",)),
    ],
)
@pytest.mark.parametrize("as_json", [(), ("--json",)], ids=["table", "json"])
def test_what_cannot_be_run_ends_in_one_line_and_writes_nothing(
    change, arguments, words, as_json, run, home, monkeypatch
):
    monkeypatch.chdir(home)
    (home / "look.toml").write_text(LOOK.replace(*change, 1))
    before = names(home)
    err = refused(run("run", "look.toml", *arguments, *as_json))
    assert all(word in err for word in words), err
    assert names(home) == before


# ------------------------------------------------------------------------------------------------- history


def test_the_history_of_a_file_is_told_and_run_again(run, home):
    target = home / "edited.bvb"
    run("edit", home / "gold.bvb", target, "--op", "gain factor=2", "--precision", "float16")
    run("edit", target, target, "--op", "tint hue=20 theta_d=0..40 label=turn", "--precision", "quantised")
    answer = told(run("history", target, "--json"))
    assert answer.keys() == {"file", "source", "steps"}
    assert answer["source"] == {"file": "gold.bvb", "digest": digest(bvbedit.load(home / "gold.bvb"))}
    assert [step["op"] for step in answer["steps"]] == ["gain", "store", "tint"]
    status, out, err = run("history", target)
    assert (status, err) == (0, "")
    assert [line.split()[:2] for line in out.splitlines()[1:]] == [["1", "gain"], ["2", "store"], ["3", "tint"]]
    status, out, err = run("history", target, "--recipe")
    assert (status, err) == (0, "")
    (home / "again.toml").write_text(out)
    told(run("run", home / "again.toml", "--json"))
    assert digest(bvbedit.load(home / "edited-again.bvb")) == digest(bvbedit.load(target))
    again = load_recipe(home / "edited-again.bvb")
    assert again.pop("made")
    assert again == load_recipe(target)


def test_the_history_of_a_file_of_another_name_is_told_too(run, home):
    run("edit", home / "gold.bvb", home / "b.bvb", "--op", "gain factor=2")
    (home / "b.bvb").rename(home / "b.BVB")
    (home / "copy").write_bytes((home / "b.BVB").read_bytes())
    for name in ("b.BVB", "copy"):
        assert [s["op"] for s in told(run("history", home / name, "--json"))["steps"]] == ["gain"]


def test_a_model_without_edits_has_an_empty_history(run, home):
    assert told(run("history", home / "gold.bvb", "--json"))["steps"] == []
    assert "no edits" in run("history", home / "gold.bvb")[1]
    assert "has no history" in refused(run("history", home / "gold.bvb", "--recipe"))


def test_what_has_no_history_is_refused(run, home):
    assert "is a measurement" in refused(run("history", home / "table.npz"))
    assert "does not exist" in refused(run("history", home / "none.bvb", "--json"))
    assert "--json" in refused(run("history", home / "gold.bvb", "--recipe", "--json"))
