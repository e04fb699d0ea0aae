"""Undo, redo, going to a state, naming one; recipes replay to the same net; two documents keep their own history."""

import pytest

from bvbedit.edit.document import digest
from bvbedit.edit.operations import edit_of_line
from bvbedit.edit.recipe import read_recipe
from tests.edit.samples import smooth
from tests.gui.files import dimmed, model_file
from tests.gui.opengl import needs_opengl
from tests.gui.viewing import do, let, with_viewer

pytestmark = needs_opengl

LINES = ("gain factor=2", "tint rgb=1,0.8,0.6", "refine axis=1 factor=3")


@pytest.fixture
def folder(tmp_path):
    model_file(tmp_path)
    model_file(tmp_path, "dim.bvb", dimmed(smooth()))
    return tmp_path


async def edited(viewer, *lines):
    """Do edits by the panel's knobs."""
    for line in lines:
        edit = edit_of_line(line)
        told = edit.to_dict()
        op = told.pop("op")
        await let(viewer, op=op, **{f"knob_{op}_{name}": value for name, value in told.items()})
        await do(viewer, viewer.editing.apply)


def told(viewer):
    return [(step["line"], step["here"]) for step in viewer.state.history if not step["past"]]


def test_undo_redo_and_going_to_a_state_show_it(folder):
    async def use(viewer):
        digests = [digest(viewer.shown)]
        for line in LINES:
            await edited(viewer, line)
            digests.append(digest(viewer.shown))
        lines = ["as opened", *LINES]
        for method, position in (
            ((viewer.editing.undo,), 2),
            ((viewer.editing.undo,), 1),
            ((viewer.editing.redo,), 2),
            ((viewer.editing.go_to, 0), 0),
            ((viewer.editing.undo,), 0),
            ((viewer.editing.go_to, 3), 3),
            ((viewer.editing.redo,), 3),
        ):
            await do(viewer, *method)
            assert digest(viewer.shown) == digests[position]
            assert viewer.session.document.position == position
            assert told(viewer) == [(line, n == position) for n, line in enumerate(lines)]
            assert viewer.state.can_undo == (position > 0)
            assert viewer.state.can_redo == (position < 3)
            assert viewer.state.error_edit == ""
        for nonsense in (4, -1, "first", None, 1.5, [], True):
            await do(viewer, viewer.editing.go_to, nonsense)
            assert "There is no state" in viewer.state.error_edit
            assert viewer.session.document.position == 3

    with_viewer(folder, use, "gold.bvb")


def test_undo_first_takes_back_what_is_only_tried(folder):
    async def use(viewer):
        await edited(viewer, LINES[0])
        done = digest(viewer.shown)
        await let(viewer, op="gain", knob_gain_factor=7.0)
        assert digest(viewer.shown) != done
        await do(viewer, viewer.editing.undo)
        assert digest(viewer.shown) == done
        assert viewer.session.document.position == 1
        assert viewer.state.knob_gain_factor == 1.0

    with_viewer(folder, use, "gold.bvb")


def test_what_is_tried_is_tried_on_the_state_that_is_gone_to(folder):
    async def use(viewer):
        await edited(viewer, LINES[0])
        source = viewer.session.document.at(0)
        await let(viewer, op="tint", knob_tint_rgb=[1.0, 0.5, 0.5])
        await do(viewer, viewer.editing.go_to, 0)
        assert viewer.state.edit_pending
        assert digest(viewer.shown) == digest(edit_of_line("tint rgb=1,0.5,0.5").apply(source))

    with_viewer(folder, use, "gold.bvb")


def test_an_edit_after_undo_ends_what_could_be_redone(folder):
    async def use(viewer):
        await edited(viewer, *LINES[:2])
        await do(viewer, viewer.editing.undo)
        await edited(viewer, LINES[2])
        assert [line for line, _ in told(viewer)] == ["as opened", LINES[0], LINES[2]]
        assert not viewer.state.can_redo

    with_viewer(folder, use, "gold.bvb")


def test_a_state_gets_a_name(folder):
    async def use(viewer):
        await edited(viewer, LINES[0])
        await let(viewer, named="bright")
        await do(viewer, viewer.editing.name_state)
        assert viewer.state.history[-1]["name"] == "bright"
        assert viewer.state.named == ""
        assert viewer.session.document.names == {"bright": 1}
        await do(viewer, viewer.editing.name_state)
        assert "called nothing" in viewer.state.error_edit

    with_viewer(folder, use, "gold.bvb")


def test_what_is_compared_with_before_the_edits_is_that(folder):
    async def use(viewer):
        source = digest(viewer.shown)
        await let(viewer, against="before", layout="beside")
        await edited(viewer, LINES[0])
        assert digest(viewer.other) == source
        assert "MAE" in viewer.state.preview_note

    with_viewer(folder, use, "gold.bvb")


def test_each_document_keeps_its_own_history(folder):
    async def use(viewer):
        names = {opened.name: key for key, opened in viewer.session}
        await let(viewer, current=names["gold.bvb"])
        await edited(viewer, *LINES[:2])
        gold = digest(viewer.shown)
        await let(viewer, current=names["dim.bvb"])
        assert told(viewer) == [("as opened", True)]
        assert not viewer.state.can_undo
        await edited(viewer, LINES[2])
        await let(viewer, current=names["gold.bvb"])
        assert [line for line, _ in told(viewer)] == ["as opened", *LINES[:2]]
        assert digest(viewer.shown) == gold
        await do(viewer, viewer.editing.undo)
        await let(viewer, current=names["dim.bvb"])
        assert told(viewer)[-1] == (LINES[2], True)
        for nonsense in (7, None, "1", [1], 1.0):
            await let(viewer, current=nonsense)
            assert viewer.state.current == names["dim.bvb"]

    with_viewer(folder, use, "gold.bvb", "dim.bvb")


def test_the_recipe_makes_the_same_net_again(folder):
    async def use(viewer):
        await edited(viewer, *LINES)
        await let(viewer, op="blend", knob_blend_partner="dim.bvb", knob_blend_t=0.25)
        await do(viewer, viewer.editing.apply)
        await do(viewer, viewer.show_dialog, "recipe")
        assert viewer.state.error_save == ""
        made = digest(viewer.shown)
        (folder / "look.toml").write_text(viewer.state.recipe)
        recipe = read_recipe(folder / "look.toml")
        assert len(recipe.steps) == 4
        document = recipe.apply(recipe.source.read(), recipe.source)
        assert digest(document.model) == made

        # And after it was saved and opened, with the steps of before and the rounding of the file.
        await let(viewer, save_name="looked.bvb", save_precision="float32")
        await do(viewer, viewer.saving.save_as)
        assert viewer.state.error_save == ""
        await do(viewer, viewer.opening.close)
        await do(viewer, viewer.opening.open_file, "looked.bvb")
        assert [s["past"] for s in viewer.state.history] == [True] * 5 + [False]
        await edited(viewer, LINES[0])
        await do(viewer, viewer.show_dialog, "recipe")
        (folder / "again.toml").write_text(viewer.state.recipe)
        recipe = read_recipe(folder / "again.toml")
        document = recipe.apply(recipe.source.read(), recipe.source)
        assert digest(document.model) == digest(viewer.shown)

    with_viewer(folder, use, "gold.bvb")


def test_there_is_no_recipe_of_a_measurement(folder):
    async def use(viewer):
        await do(viewer, viewer.opening.open_sample, "chrome")
        await do(viewer, viewer.show_dialog, "recipe")
        assert "is a measurement" in viewer.state.error_save

    with_viewer(folder, use)
