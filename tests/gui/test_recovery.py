"""What is unsaved outlives a crash, and is offered; what was saved or given up is not offered."""

from dataclasses import replace

import pytest

from bvbedit.brdf.analytic import Lambert
from bvbedit.edit.appearance import Gain
from bvbedit.edit.document import Document, digest
from bvbedit_gui import saving
from bvbedit_gui.places import Places
from bvbedit_gui.session import Session, kept_files, opened_file, opened_recovered, opened_sample
from tests.edit.samples import smooth
from tests.gui.files import model_file
from tests.gui.opengl import needs_opengl
from tests.gui.viewing import do, let, with_viewer

pytestmark = needs_opengl


@pytest.fixture
def folder(tmp_path):
    model_file(tmp_path)
    return tmp_path


async def brighter(viewer, factor):
    await let(viewer, op="gain")
    await let(viewer, knob_gain_factor=factor)
    await do(viewer, viewer.editing.apply)


def offered(folder):
    return [path.name for path in kept_files(Places.of(folder))]


def test_a_new_session_offers_what_was_not_saved(folder):
    found = []

    async def crash(viewer):
        await brighter(viewer, 2.0)
        await brighter(viewer, 3.0)
        await do(viewer, viewer.editing.undo)
        found.append(digest(viewer.session.here.model))

    async def again(viewer):
        assert viewer.state.kept_files == ["gold.bvb"]
        await do(viewer, viewer.opening.recover, "gold.bvb")
        assert viewer.state.error_open == ""
        document = viewer.session.document
        assert digest(document.model) == found[0]
        assert [edit.line() for edit in document.edits] == ["gain factor=2", "gain factor=3"]
        assert document.position == 1
        assert viewer.state.unsaved
        await do(viewer, viewer.editing.undo)
        assert viewer.session.document.position == 0
        # What is open is not offered once more.
        await do(viewer, viewer.show_dialog, "open")
        assert viewer.state.kept_files == []
        await do(viewer, viewer.opening.close, discard=True)
        assert offered(folder) == []

    with_viewer(folder, crash, "gold.bvb")
    assert offered(folder) == ["gold.bvb"]
    with_viewer(folder, again)


def test_what_is_unsaved_is_kept_soon_not_only_at_the_end(folder, monkeypatch):
    monkeypatch.setattr(saving, "KEEPING", 0.0)

    async def use(viewer):
        await brighter(viewer, 2.0)
        for _ in range(200):
            await viewer.settled()
            if offered(folder):
                break
        assert offered(folder) == ["gold.bvb"]

    with_viewer(folder, use, "gold.bvb")


def test_what_was_discarded_is_not_offered(folder):
    async def crash(viewer):
        await brighter(viewer, 2.0)

    async def again(viewer):
        await do(viewer, viewer.opening.discard_kept, "gold.bvb")
        assert viewer.state.kept_files == []

    with_viewer(folder, crash, "gold.bvb")
    with_viewer(folder, again)
    assert offered(folder) == []


def test_damage_is_told(folder):
    (folder / ".gold.bvb.autosave").write_bytes(b"no file of ours")

    async def use(viewer):
        assert viewer.state.kept_files == ["gold.bvb"]
        await do(viewer, viewer.opening.recover, "gold.bvb")
        assert viewer.state.error_open
        assert viewer.session.current is None
        await do(viewer, viewer.opening.recover, "other.bvb")
        assert "Nothing was kept" in viewer.state.error_open

    with_viewer(folder, use)


def session_of(folder, *materials):
    session = Session(Places.of(folder))
    for opened in materials:
        session.add(opened)
    return session


def edited(session, key, factor):
    session.current = key
    session.do(Gain(factor=factor))


def fitted(opened):
    """A sample as its fit would make it: a model that has no file yet."""
    return replace(opened, name=f"{opened.name}.bvb", document=Document.of(smooth(), sample=opened.name))


def test_models_without_a_file_are_kept_apart(folder):
    session = session_of(folder, *[fitted(opened_sample("chrome")) for _ in range(2)])
    edited(session, 1, 2.0)
    edited(session, 2, 3.0)
    session.keep()
    assert len(offered(folder)) == 2
    session.keep()
    assert len(offered(folder)) == 2


def test_a_model_without_a_file_is_not_kept_over_what_is_of_a_file(folder):
    model_file(folder, "chrome.bvb")
    session = session_of(folder, opened_file(folder / "chrome.bvb", "chrome.bvb"))
    edited(session, 1, 5.0)
    session.add(fitted(opened_sample("chrome")))
    edited(session, 2, 2.0)
    session.keep()
    assert len(offered(folder)) == 2
    again = Session(Places.of(folder))
    lines = []
    for path in kept_files(again.places):
        opened = opened_recovered(path, path.name)
        assert opened is not None
        lines.append(opened.known_document.lines[-1])
    assert sorted(lines) == ["gain factor=2", "gain factor=5"]


def test_closing_or_saving_a_model_without_a_file_forgets_what_was_kept(folder):
    session = session_of(folder, *[fitted(opened_sample("chrome")) for _ in range(2)])
    session.keep()
    assert len(offered(folder)) == 2
    session.close(2)
    session.current = 1
    document = session.check_save(folder / "elsewhere.bvb")
    document.save(folder / "elsewhere.bvb")
    session.saved(folder / "elsewhere.bvb", document, 1)
    assert offered(folder) == []
    assert not session.here.unsaved


def test_going_back_to_what_is_saved_forgets_what_was_kept(folder):
    session = session_of(folder, opened_file(folder / "gold.bvb", "gold.bvb"))
    edited(session, 1, 2.0)
    session.keep()
    assert offered(folder) == ["gold.bvb"]
    session.update(session.document.undo())
    session.keep()
    assert offered(folder) == []


def test_what_a_crash_left_is_not_removed_by_opening_the_file(folder):
    session = session_of(folder, opened_file(folder / "gold.bvb", "gold.bvb"))
    edited(session, 1, 2.0)
    session.keep()
    another = session_of(folder, opened_file(folder / "gold.bvb", "gold.bvb"))
    another.keep()
    assert offered(folder) == ["gold.bvb"]


def test_what_is_in_folders_below_is_offered(folder):
    (folder / "below").mkdir()
    model_file(folder, "below/deep.bvb")
    session = session_of(folder, opened_file(folder / "below" / "deep.bvb", "deep.bvb"))
    edited(session, 1, 2.0)
    session.keep()

    async def use(viewer):
        assert viewer.state.kept_files == ["below/deep.bvb"]
        await do(viewer, viewer.opening.recover, "below/deep.bvb")
        assert viewer.session.document.edits[-1].line() == "gain factor=2"

    with_viewer(folder, use)


def test_what_is_closed_while_it_is_being_kept_is_not_offered(folder, monkeypatch):
    from bvbedit_gui import session as session_module

    session = session_of(folder, opened_file(folder / "gold.bvb", "gold.bvb"))
    edited(session, 1, 2.0)
    keep = session_module.autosave

    def closing(document, path):
        session.close(1)
        keep(document, path)

    monkeypatch.setattr(session_module, "autosave", closing)
    session.keep()
    assert offered(folder) == []


def test_what_was_kept_of_a_file_that_is_open_does_not_open_it_twice(folder):
    session = session_of(folder, opened_file(folder / "gold.bvb", "gold.bvb"))
    edited(session, 1, 2.0)
    session.keep()

    async def use(viewer):
        assert viewer.state.kept_here == "gold.bvb"
        await brighter(viewer, 3.0)
        await do(viewer, viewer.opening.recover, "gold.bvb")
        assert "is open, and has changes" in viewer.state.error_open
        await do(viewer, viewer.editing.undo)
        await do(viewer, viewer.opening.recover, "gold.bvb")
        assert len(viewer.state.documents) == 1
        assert viewer.session.document.edits[-1].line() == "gain factor=2"
        assert viewer.state.kept_here == ""

    with_viewer(folder, use, "gold.bvb")


def test_what_it_was_compared_with_stays_with_what_is_recovered(folder):
    session = session_of(folder, opened_file(folder / "gold.bvb", "gold.bvb"))
    edited(session, 1, 2.0)
    session.keep()

    async def use(viewer):
        measured = Lambert((0.2, 0.3, 0.4))
        viewer.session.put(replace(viewer.session.here, reference=measured, reference_name="grey card"))
        await do(viewer, viewer.opening.recover, "gold.bvb")
        assert viewer.state.error_open == ""
        assert viewer.session.document.edits[-1].line() == "gain factor=2"
        assert viewer.session.here.reference is measured
        assert (viewer.state.against, viewer.other, viewer.other_name) == ("source", measured, "grey card")

    with_viewer(folder, use, "gold.bvb")
