"""What was kept is found again after a crash, whenever it happened, and files are whole."""

import numpy as np
import pytest

import bvbedit
from bvbedit.edit.appearance import Gain, Tint
from bvbedit.edit.autosave import autosave, autosave_path, discard_autosave, recovered
from bvbedit.edit.combining import Blend
from bvbedit.edit.document import Document, digest
from bvbedit.io.bvb import save_bvb
from tests.edit import killed
from tests.edit.samples import smooth
from tests.spline.refusals import refusal

EDITS = (Gain(factor=1.1), Tint(hue=33.0), Gain(factor=0.3, theta_h=(0, 20)))


@pytest.fixture
def path(tmp_path):
    bvbedit.save(smooth(), tmp_path / "model.bvb", precision="float16")
    return tmp_path / "model.bvb"


def edited(path, *edits):
    document = Document.open(path)
    for edit in edits:
        document = document.do(edit)
    return document


def test_without_a_crash_nothing_is_recovered(path):
    assert recovered(path) is None
    autosave(edited(path, *EDITS), path)
    discard_autosave(path)
    discard_autosave(path)
    assert recovered(path) is None
    assert [p.name for p in path.parent.iterdir()] == ["model.bvb"]


@pytest.mark.parametrize("undone", [0, 1, 3])
def test_a_document_is_recovered_with_all_its_states_and_names(undone, path):
    before = path.read_bytes()
    document = edited(path, *EDITS).named("end").go_to(0).named("start").redo(3 - undone)
    autosave(document, path)
    again = recovered(path)
    assert again == document or again.edits == document.edits
    assert (again.position, again.past, again.source) == (document.position, document.past, document.source)
    assert dict(again.names) == dict(document.names)
    for k in range(4):
        assert np.array_equal(again.at(k).spline.control, document.at(k).spline.control)
    assert path.read_bytes() == before


def test_a_file_with_a_history_is_recovered_too(path):
    bvbedit.save(Tint(rgb=(0.2, 1, 3)).apply(smooth()), path.with_name("partner.bvb"))
    edited(path, Blend(partner=path.with_name("partner.bvb"), t=0.2)).save(path.with_name("second.bvb"))
    second = path.with_name("second.bvb")
    document = edited(second, *EDITS).named("end")
    autosave(document, second)
    again = recovered(second)
    assert again.past == document.past
    assert again.lines == document.lines
    assert dict(again.names) == {"end": 3}
    assert digest(again.undo(2).model) == digest(document.undo(2).model)


@pytest.mark.parametrize("what", ["gone", "changed", "damaged"])
def test_a_model_stands_for_itself_where_its_file_does_not_lead_to_it(what, path):
    document = edited(path, *EDITS)
    autosave(document, path)
    if what == "gone":
        path.unlink()
    elif what == "changed":
        bvbedit.save(Gain(factor=2).apply(smooth()), path)
    else:
        path.write_bytes(path.read_bytes()[:200])
    again = recovered(path)
    assert digest(again.model) == digest(document.model)
    assert again.lines == document.lines
    assert (again.position, again.edits) == (0, ())
    again.do(Gain(factor=2)).save(path)
    assert len(Document.open(path).past) == 5


@pytest.mark.parametrize("recipe", [None, {}, {"source": {}, "steps": [{"op": "gian"}]}, {"steps": []}, {"source": 3}])
def test_what_is_no_kept_document_is_refused(recipe, path):
    save_bvb(smooth(), autosave_path(path), recipe=recipe)
    assert ".model.bvb.autosave" in refusal(lambda: recovered(path))


def test_a_kept_document_that_is_damaged_is_refused(path):
    autosave(edited(path, *EDITS), path)
    autosave_path(path).write_bytes(autosave_path(path).read_bytes()[:-50])
    refusal(lambda: recovered(path))


# ------------------------------------------------------------------------------------------------- kill -9


@pytest.fixture
def folder(tmp_path):
    bvbedit.save(smooth(size=(10, 8, 6)), tmp_path / "start.bvb")
    return tmp_path


def left(folder):
    """Names of files that are no temporary ones."""
    return {p.name for p in folder.iterdir() if not (p.name.startswith(".") and p.name.endswith(".tmp"))}


def test_a_save_that_is_killed_leaves_the_old_file_or_the_new_one(folder):
    start, whole = Document.open(folder / "start.bvb"), set()
    for times in range(1, 5):
        killed.brighter(start, times).save(folder / "model.bvb")
        whole.add((folder / "model.bvb").read_bytes())
    assert len(whole) == 4
    seen = set()
    for _ in killed.kills(killed.save_for_ever, folder, 0.05):
        content = (folder / "model.bvb").read_bytes()
        assert content in whole
        seen.add(content)
        assert left(folder) == {"start.bvb", "model.bvb"}
    assert len(seen) > 1


def test_what_was_kept_is_recovered_after_a_kill_and_the_file_is_as_it_was(folder):
    before = (folder / "start.bvb").read_bytes()
    (folder / "model.bvb").write_bytes(before)
    start, seen = Document.open(folder / "model.bvb"), set()
    for _ in killed.kills(killed.autosave_for_ever, folder, 0.05, seed=1):
        assert (folder / "model.bvb").read_bytes() == before
        document = recovered(folder / "model.bvb")
        assert digest(document.model) == digest(killed.brighter(start, document.position).model)
        assert digest(document.undo(document.position).model) == digest(start.model)
        seen.add(document.position)
        assert left(folder) == {"start.bvb", "model.bvb", ".model.bvb.autosave"}
    assert len(seen) > 1
    assert seen <= {1, 2, 3, 4}


def test_a_session_that_is_killed_loses_at_most_the_edit_that_was_being_kept(folder):
    start = Document.open(folder / "start.bvb")
    saved = killed.brighter(start, 2)
    saved.save(folder / "model.bvb")
    whole, ends = (folder / "model.bvb").read_bytes(), {digest(killed.brighter(start, n).model) for n in (1, 2)}
    for _ in killed.kills(killed.edit_for_ever, folder, 0.05, seed=2):
        assert (folder / "model.bvb").read_bytes() == whole
        document = recovered(folder / "model.bvb")
        assert document is None or digest(document.model) in ends
        assert left(folder) <= {"start.bvb", "model.bvb", ".model.bvb.autosave"}
