"""What takes a while: it is begun and not waited for, done once, and what is seen meanwhile is told to be old."""

import asyncio
import threading

import pytest

from bvbedit_gui.plots.albedos import albedo_curve
from tests.edit.samples import smooth
from tests.gui.files import dimmed, model_file
from tests.gui.opengl import needs_opengl
from tests.gui.viewing import do, let, no_errors, with_viewer

pytestmark = needs_opengl
PANELS = ("volume", "lobes", "figures", "preview")


@pytest.fixture
def folder(tmp_path):
    model_file(tmp_path)
    model_file(tmp_path, "dim.bvb", dimmed(smooth()))
    return tmp_path


def test_what_is_begun_is_not_waited_for_and_its_changes_reach_the_page(folder):
    async def use(viewer):
        go_on, reached = asyncio.Event(), []

        async def long(word):
            viewer.state.toast = "begun"
            await go_on.wait()
            viewer.state.toast = word
            reached.append(word)

        start = viewer.started(long)
        await start("one")
        # It has gone as far as it could.
        assert (viewer.state.toast, reached) == ("begun", [])
        await start("two")
        go_on.set()
        while len(reached) < 2:
            await asyncio.sleep(0)
        assert reached == ["one", "two"]
        await asyncio.sleep(0)
        assert not viewer._begun

    with_viewer(folder, use, "gold.bvb")


def test_a_file_that_is_being_opened_is_not_opened_twice(folder, monkeypatch):
    from bvbedit_gui import opening

    go_on, read = threading.Event(), opening.opened_file

    def slowly(*args):
        go_on.wait()
        return read(*args)

    async def use(viewer):
        monkeypatch.setattr(opening, "opened_file", slowly)
        await viewer.started(viewer.opening.open_file)("dim.bvb")
        assert viewer.state.opening == "dim.bvb"
        await do(viewer, viewer.opening.open_file, "dim.bvb")
        assert viewer.state.error_open == "dim.bvb is being opened. Wait a moment."
        go_on.set()
        while viewer.state.opening:
            await asyncio.sleep(0.01)
        assert [o["name"] for o in viewer.state.documents] == ["gold.bvb", "dim.bvb"]

    with_viewer(folder, use, "gold.bvb")


def test_pictures_of_another_material_are_told_to_be_old_until_they_are_drawn(folder):
    async def use(viewer):
        assert not any(viewer.state[f"stale_{panel}"] for panel in PANELS)
        with viewer.state:
            await viewer.opening.open_file("dim.bvb")
            assert all(viewer.state[f"stale_{panel}"] for panel in PANELS)
        await viewer.settled()
        assert not any(viewer.state[f"stale_{panel}"] for panel in PANELS)
        # Why nothing can be drawn is told in its place.
        await let(viewer, scene="../outside.toml", current=1)
        await viewer.settled()
        assert viewer.state.error_preview
        assert not any(viewer.state[f"stale_{panel}"] for panel in PANELS)

    with_viewer(folder, use, "gold.bvb")


def test_how_much_light_is_reflected_is_told_before_and_after(folder):
    async def use(viewer):
        model = viewer.session.here.model
        now = albedo_curve(model).largest[0]
        with no_errors(viewer):
            await let(viewer, op="gain", knob_gain_factor=1.0)
            assert viewer.state.albedo_note.startswith(f"Reflects at most {100 * now:.3g}\u00a0% of the light: more")
            assert viewer.state.albedo_above == (now > 1)
            await let(viewer, knob_gain_factor=0.5)
            told = f"Reflects at most {50 * now:.3g}\u00a0% of the light (before the edit {100 * now:.3g}\u00a0%)."
            assert viewer.state.albedo_note == told
            assert not viewer.state.albedo_above

    with_viewer(folder, use, "gold.bvb")


def test_an_edit_that_is_tried_is_asked_about_before_closing(folder):
    async def use(viewer):
        await let(viewer, op="gain", knob_gain_factor=0.5)
        await do(viewer, viewer.opening.close)
        assert viewer.state.dialog == "close"
        assert [o["name"] for o in viewer.state.documents] == ["gold.bvb"]
        await do(viewer, viewer.opening.close, viewer.state.closing, discard=True)
        assert viewer.state.documents == []

    with_viewer(folder, use, "gold.bvb")
