"""Opening, saving, saving under another name, replacing, exporting, closing with its question."""

import numpy as np
import pytest

import bvbedit
from bvbedit.edit.document import Document, digest
from tests.edit.samples import smooth
from tests.gui.files import dimmed, model_file, table_file
from tests.gui.opengl import needs_opengl
from tests.gui.viewing import do, let, no_errors, with_viewer

pytestmark = needs_opengl


@pytest.fixture
def folder(tmp_path):
    model_file(tmp_path)
    model_file(tmp_path, "dim.bvb", dimmed(smooth()))
    table_file(tmp_path)
    return tmp_path


async def brighter(viewer, factor=2.0):
    await let(viewer, op="gain", knob_gain_factor=factor)
    await do(viewer, viewer.editing.apply)


def test_files_and_samples_are_listed_and_opened(folder):
    async def use(viewer):
        assert viewer.state.material_files == ["dim.bvb", "gold.bvb", "table.npz"]
        assert viewer.state.model_files == ["dim.bvb", "gold.bvb"]
        assert "chrome" in [sample["name"] for sample in viewer.state.samples]
        with no_errors(viewer):
            await do(viewer, viewer.opening.open_file, "gold.bvb")
            assert viewer.state.is_model
            assert digest(viewer.shown) == digest(smooth())
            await do(viewer, viewer.opening.open_file, "table.npz")
            assert not viewer.state.is_model
            assert viewer.state.can_fit_source
            assert viewer.state.tab == "fit"
            await do(viewer, viewer.opening.open_sample, "chrome")
            assert [d["name"] for d in viewer.state.documents] == ["gold.bvb", "table.npz", "chrome"]
            # What is open already is gone to.
            await do(viewer, viewer.opening.open_file, "gold.bvb")
            assert len(viewer.state.documents) == 3
            assert viewer.state.current == 1
        assert viewer.state.opening == ""

    with_viewer(folder, use)


@pytest.mark.parametrize("name", ["absent.bvb", "", "gold.txt", "..", None, 3, ["gold.bvb"], "a\x00.bvb", "bad.bvb"])
def test_what_cannot_be_opened_is_told(name, folder):
    (folder / "bad.bvb").write_bytes((folder / "gold.bvb").read_bytes()[:400])

    async def use(viewer):
        for method in (viewer.opening.open_file, viewer.opening.recover, viewer.opening.open_sample):
            viewer.state.error_open = ""
            await do(viewer, method, name)
            assert viewer.state.error_open
            assert "unexpectedly" not in viewer.state.error_open
        assert viewer.state.documents == []
        assert viewer.state.opening == ""

    with_viewer(folder, use)


def test_save_keeps_the_first_file_and_proposes_another(folder):
    async def use(viewer):
        await brighter(viewer)
        assert viewer.state.unsaved
        await do(viewer, viewer.saving.save)
        # The history begins with gold.bvb: saved over, it could not be replayed.
        assert viewer.state.dialog == "save"
        assert viewer.state.save_name == "gold-edited.bvb"
        await let(viewer, save_precision="float64")
        with no_errors(viewer):
            await do(viewer, viewer.saving.save_as)
        assert viewer.state.dialog == ""
        assert not viewer.state.unsaved
        assert viewer.state.toast.startswith("Saved gold-edited.bvb")
        assert digest(bvbedit.load(folder / "gold-edited.bvb")) == digest(viewer.shown)
        await brighter(viewer)
        assert viewer.state.unsaved

    with_viewer(folder, use, "gold.bvb")


def test_another_file_is_replaced_only_when_that_was_confirmed(folder):
    async def use(viewer):
        before = (folder / "dim.bvb").read_bytes()
        await brighter(viewer)
        await let(viewer, save_name="dim")
        await do(viewer, viewer.saving.save_as)
        assert viewer.state.save_confirm == "dim.bvb exists. Replace it?"
        assert (folder / "dim.bvb").read_bytes() == before
        await do(viewer, viewer.saving.save_as, over=True)
        assert viewer.state.save_confirm == ""
        assert Document.open(folder / "dim.bvb").lines[0] == "gain factor=2"
        assert viewer.state.documents[0]["name"] == "dim.bvb"

    with_viewer(folder, use, "gold.bvb")


@pytest.mark.parametrize(
    "name", ["../x.bvb", "/tmp/x.bvb", "x.txt", "", None, ["x"], "no/x.bvb", "a\x00.bvb", "é" * 300, ".", "gold.bvb/x"]
)
def test_what_cannot_be_saved_is_told_and_nothing_is_written(name, folder):
    async def use(viewer):
        await brighter(viewer)
        before = {path for path in folder.parent.rglob("*") if "autosave" not in path.name}
        await let(viewer, save_name=name)
        await do(viewer, viewer.saving.save_as, over=True)
        told = viewer.state.error_save
        now = {path for path in folder.parent.rglob("*") if "autosave" not in path.name}
        assert now == before or (name in (None, ["x"], ".") and len(now - before) == 1)
        assert told or now != before
        assert "unexpectedly" not in told

    with_viewer(folder, use, "gold.bvb")


def test_what_is_open_or_needed_or_only_tried_is_not_saved_over(folder):
    async def use(viewer):
        await let(viewer, current=1)
        await brighter(viewer)
        for name, word in (("dim.bvb", "is open"), ("gold.bvb", "needs"), ("table.npz", "is open")):
            before = (folder / name).read_bytes()
            await let(viewer, save_name=name)
            await do(viewer, viewer.saving.save_as, over=True)
            assert word in viewer.state.error_save
            assert (folder / name).read_bytes() == before
        await let(viewer, knob_gain_factor=3.0, save_name="new.bvb")
        await do(viewer, viewer.saving.save_as)
        assert "being tried" in viewer.state.error_save
        assert not (folder / "new.bvb").exists()

    with_viewer(folder, use, "gold.bvb", "dim.bvb", "table.npz")


@pytest.mark.parametrize("precision", ["as it is", "quantised", "float16", "float32", "float64"])
def test_precision_and_density_are_those_that_were_chosen(precision, folder):
    async def use(viewer):
        await let(viewer, save_precision=precision, save_pdf=precision == "float32", save_name="p.bvb")
        with no_errors(viewer):
            await do(viewer, viewer.saving.save_as)
        saved = bvbedit.load(folder / "p.bvb")
        assert saved.storage.precision == (precision if precision != "as it is" else "float64")
        with np.load(folder / "p.bvb") as file:
            assert any("pdf" in name for name in file.files) == (precision == "float32")

    with_viewer(folder, use, "gold.bvb")


def test_a_table_is_exported(folder):
    async def use(viewer):
        await let(viewer, save_name="out.npz")
        with no_errors(viewer):
            await do(viewer, viewer.saving.save_as)
        assert viewer.state.toast.startswith("Exported out.npz")
        assert not viewer.state.saving

    with_viewer(folder, use, "gold.bvb")
    assert bvbedit.load(folder / "out.npz") is not None


def test_closing_asks_about_what_is_unsaved(folder):
    async def use(viewer):
        await do(viewer, viewer.opening.close)
        assert viewer.state.documents == []  # nothing was done to it
        await do(viewer, viewer.opening.open_file, "gold.bvb")
        await brighter(viewer)
        key = viewer.state.current
        await do(viewer, viewer.opening.close)
        assert viewer.state.dialog == "close"
        assert viewer.state.closing == key
        assert len(viewer.state.documents) == 1
        # Kept open, it is as it was.
        await let(viewer, dialog="", closing=None)
        assert viewer.state.can_undo
        await do(viewer, viewer.opening.close, key, discard=True)
        assert viewer.state.documents == []
        assert viewer.state.dialog == ""
        assert not viewer.state.unsaved
        for nonsense in (key, None, [key], "1", 99):
            await do(viewer, viewer.opening.close, nonsense, discard=True)
        assert viewer.state.error_open == ""

    with_viewer(folder, use, "gold.bvb")


def test_closing_by_saving_closes_after_the_save(folder):
    async def use(viewer):
        await brighter(viewer)
        await do(viewer, viewer.opening.close)
        await do(viewer, viewer.saving.save)
        assert viewer.state.dialog == "save"
        await let(viewer, save_name="kept.bvb")
        await do(viewer, viewer.saving.save_as)
        assert viewer.state.documents == []
        assert (folder / "kept.bvb").exists()

    with_viewer(folder, use, "gold.bvb")


def test_a_save_that_was_not_to_close_does_not_close(folder):
    async def use(viewer):
        await brighter(viewer)
        await do(viewer, viewer.opening.close)
        await do(viewer, viewer.saving.save)
        await let(viewer, dialog="")  # Cancel
        await do(viewer, viewer.show_dialog, "save")
        await let(viewer, save_name="later.bvb")
        await do(viewer, viewer.saving.save_as)
        assert (folder / "later.bvb").exists()
        assert [d["name"] for d in viewer.state.documents] == ["later.bvb"]

    with_viewer(folder, use, "gold.bvb")
