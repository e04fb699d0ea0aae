"""Documents: each state stays what it was, memory is bounded, and what was recorded makes the same model again."""

import functools
import zipfile
from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

import bvbedit
from bvbedit.brdf.charts import IN_OUT
from bvbedit.brdf.plausibility import check
from bvbedit.edit import document as module
from bvbedit.edit.appearance import Gain, Tint
from bvbedit.edit.combining import Blend
from bvbedit.edit.document import Document, digest
from bvbedit.edit.recipe import read_recipe, to_toml
from bvbedit.edit.structural import InsertKnots, Refine
from bvbedit.io.bvb import load_recipe
from tests.edit.samples import quick_edits, smooth
from tests.spline.refusals import refusal

# Shrinking histories that are saved and opened takes minutes.
FAST = (Phase.explicit, Phase.generate)


def done(document, *edits):
    return functools.reduce(Document.do, edits, document)


def same(a, b):
    """Whether two models have the same nets, to the last bit, and the same storage."""
    knots = all(np.array_equal(s, t) for s, t in zip(a.spline.knots, b.spline.knots, strict=True))
    return knots and np.array_equal(a.spline.control, b.spline.control) and a.storage == b.storage


@given(st.lists(quick_edits(), min_size=1, max_size=5), st.data())
@settings(max_examples=30)
def test_undo_and_redo_lead_to_the_very_same_objects(edits, data):
    document = Document.of(smooth())
    seen = [document.model]
    for edit in edits:
        document = document.do(edit)
        seen.append(document.model)
    for _ in range(6):
        position = data.draw(st.integers(0, len(edits)))
        by = position - document.position
        document = document.redo(by) if by >= 0 else document.undo(-by)
        assert document.model is seen[position]
        assert [document.at(k) for k in range(len(seen))] == seen
        assert document.lines == tuple(edit.line() for edit in edits[:position])


def test_what_an_old_document_showed_stays():
    first = Document.of(smooth())
    second = first.do(Gain(factor=2))
    assert first.model is smooth()
    assert (first.position, second.position) == (0, 1)
    with pytest.raises(FrozenInstanceError):
        second.position = 0
    with pytest.raises(TypeError):
        second.names["here"] = 1
    with pytest.raises(TypeError):
        second.source["file"] = "else"


def test_a_new_edit_cuts_what_could_be_redone_and_its_names():
    document = done(Document.of(smooth()), Gain(factor=2), Gain(factor=3)).named("bright").undo().named("amid")
    again = document.do(Tint(rgb=(1, 1, 0.5)))
    assert again.lines == ("gain factor=2", "tint rgb=1,1,0.5")
    assert same(again.model, Tint(rgb=(1, 1, 0.5)).apply(document.at(1)))
    assert len(again.states) == 3
    assert dict(again.names) == {"amid": 1}
    assert "There is no state 3" in refusal(again.redo)
    # The old one still can.
    assert document.redo().lines == ("gain factor=2", "gain factor=3")


def test_named_states_are_gone_to_and_compared_with():
    document = done(Document.of(smooth()).named("start"), Gain(factor=2)).named("bright").do(Gain(factor=0.1))
    assert document.go_to("start").model is smooth()
    assert document.at("bright") is document.go_to(1).model
    assert document.changes("bright").before is document.at(1)
    assert document.recipe()["names"] == {"start": 0, "bright": 1}
    assert "names" not in done(Document.of(smooth()), Gain(factor=2)).recipe()
    assert document.go_to(0).named("bright").at("bright") is smooth()


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda d: d.undo(2), "There is no state -1"),
        (lambda d: d.redo(), "There is no state 2: the history has 1 edits"),
        (lambda d: d.go_to(-1), "There is no state -1"),
        (lambda d: d.at(7), "There is no state 7"),
        (lambda d: d.go_to("end"), "No state is called 'end'. Named states: bright."),
        (lambda d: d.changes("end"), "No state is called 'end'"),
        (lambda d: d.named(" "), "called nothing"),
        (lambda d: d.do(InsertKnots(axis=0, at=(0.7, 0.2))), "knot 1 to insert is 0.2"),
    ],
)
def test_what_a_history_does_not_have_is_refused(call, words):
    document = done(Document.of(smooth()), Gain(factor=2)).named("bright")
    assert words in refusal(lambda: call(document))
    assert document.position == 1


def test_changes_tell_how_far_values_moved_and_what_physics_says():
    dim = Gain(factor=0.5).apply(smooth())
    changes = done(Document.of(dim), Gain(factor=30)).changes()
    assert changes.max_change == pytest.approx(np.abs(dim.spline.control).max() * (30 ** (1 / 3) - 1))
    before, after = changes.plausibility()
    assert before == check(dim)
    assert not before.creates_energy
    assert after.creates_energy


# ------------------------------------------------------------------------------------------------- memory


def test_old_states_are_dropped_to_bound_the_memory_and_made_again(monkeypatch):
    each = smooth().spline.control.nbytes
    monkeypatch.setattr(module, "LARGEST_HISTORY", 6 * each)
    document, seen = Document.of(smooth()), [smooth()]
    for n in range(30):
        edit = Tint(hue=10.0 + n) if n % 3 else Gain(factor=1.1)
        document = document.do(edit)
        seen.append(document.model)
    kept = [k for k, state in enumerate(document.states) if state is not None]
    assert kept[0] == 0
    assert kept[-1] == 30
    assert {0, 8, 16, 24, 30} <= set(kept)
    assert sum(document.states[k].spline.control.nbytes for k in kept) <= 6 * each
    for k in range(31):
        assert same(document.go_to(k).model, seen[k])
    assert document.at(8) is seen[8]
    # Undone to a state that was dropped, edits go on from it.
    again = document.undo(17).do(Gain(factor=2))
    assert same(again.undo().model, seen[13])
    assert again.position == 14


# ------------------------------------------------------------------------------------------------- files


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    """A folder with a model and a partner."""
    folder = tmp_path_factory.mktemp("documents")
    bvbedit.save(smooth(), folder / "start.bvb")
    bvbedit.save(Tint(rgb=(0.2, 1, 3)).apply(smooth()), folder / "partner.bvb")
    return folder


def replayed(path):
    """What the recipe of a file makes, run on its source."""
    recipe = path.with_suffix(".toml")
    recipe.write_text(to_toml(load_recipe(path)))
    read = read_recipe(recipe)
    return read.apply(read.source.read(), read.source)


def members(path):
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


@given(st.data())
@settings(max_examples=15, phases=FAST)
def test_a_history_saved_opened_and_edited_on_is_replayed_bit_by_bit(home, data):
    document = Document.open(home / "start.bvb")
    for _ in range(data.draw(st.integers(1, 3))):
        document = done(document, *data.draw(st.lists(quick_edits(home / "partner.bvb"), min_size=1, max_size=3)))
        precision = data.draw(st.sampled_from([None, "float16", "float32", "float64", "quantised"]))
        document.save(home / "edited.bvb", precision=precision)
        opened = Document.open(home / "edited.bvb")
        assert opened.past[: len(document.past) + len(document.edits)] == (*document.past, *document.edits)
        again = replayed(home / "edited.bvb")
        assert same(again.model, document.model)
        again.save(home / "again.bvb", precision=precision)
        assert members(home / "again.bvb") == members(home / "edited.bvb")
        assert (home / "again.bvb").read_bytes() == (home / "edited.bvb").read_bytes()
        document = opened


def test_only_edits_in_force_are_saved(home):
    done(Document.open(home / "start.bvb"), Gain(factor=2), Gain(factor=3)).undo().save(home / "one.bvb")
    told = load_recipe(home / "one.bvb")
    assert told["steps"] == [{"op": "gain", "factor": 2.0}]
    assert told["source"]["file"] == "start.bvb"
    assert told["source"]["digest"] == digest(bvbedit.load(home / "start.bvb"))


def test_a_file_and_what_it_names_may_move_together(home, tmp_path):
    for name in ("start.bvb", "partner.bvb"):
        (tmp_path / name).write_bytes((home / name).read_bytes())
    (tmp_path / "a").mkdir()
    edit = Blend(partner=tmp_path / "partner.bvb", t=0.3)
    done(Document.open(tmp_path / "start.bvb"), edit).save(tmp_path / "a" / "mixed.bvb")
    told = load_recipe(tmp_path / "a" / "mixed.bvb")
    assert told["source"]["file"] == "../start.bvb"
    assert told["steps"][0]["partner"] == "../partner.bvb"
    moved = tmp_path.with_name(tmp_path.name + "-moved")
    tmp_path.rename(moved)
    assert same(
        replayed(moved / "a" / "mixed.bvb").model,
        done(Document.open(moved / "start.bvb"), *[replace(edit, partner=moved / "partner.bvb")]).model,
    )


def test_an_opened_document_cannot_undo_what_was_done_before(home):
    done(Document.open(home / "start.bvb"), Gain(factor=2)).save(home / "two.bvb", precision="float16")
    opened = Document.open(home / "two.bvb")
    assert opened.lines == ("gain factor=2", "store precision=float16")
    assert (opened.position, opened.edits) == (0, ())
    refusal(opened.undo)
    assert opened.do(Refine(axis=0)).undo().model is opened.model


def test_what_is_no_document_is_refused(home, tmp_path):
    assert "does not exist" in refusal(lambda: Document.open(tmp_path / "none.bvb"))
    (tmp_path / "broken.bvb").write_bytes((home / "start.bvb").read_bytes()[:-100])
    refusal(lambda: Document.open(tmp_path / "broken.bvb"))


@pytest.mark.parametrize(
    "recipe",
    [
        {},
        {"source": {"file": "start.bvb"}},
        {"source": "start.bvb", "steps": []},
        {"source": {"file": "start.bvb"}, "steps": [{"op": "gian"}]},
        {"source": {"file": "start.bvb"}, "steps": ["gain"]},
        {"source": {"file": 3}, "steps": []},
        {"source": {"file": "start.bvb"}, "steps": 3},
        {"source": {"file": "start.bvb"}, "steps": {"op": "gain", "factor": 2}},
    ],
    ids=str,
)
def test_a_recipe_that_cannot_be_read_is_refused(recipe, tmp_path):
    from bvbedit.io.bvb import save_bvb

    save_bvb(smooth(), tmp_path / "odd.bvb", recipe=recipe)
    assert "odd.bvb has a recipe that cannot be read" in refusal(lambda: Document.open(tmp_path / "odd.bvb"))


def test_digests_tell_models_apart():
    seen = {digest(smooth()), digest(Gain(factor=1 + 1e-15).apply(smooth())), digest(smooth(IN_OUT))}
    assert len(seen) == 3
    assert digest(smooth().told(notes=["rough"])) == digest(smooth())
