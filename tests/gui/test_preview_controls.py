"""Each control of the preview changes the picture; the figures below it are those of the pictures."""

import re

import numpy as np
import pytest

from bvbedit.io.exr import write_exr
from bvbedit.render.image_metrics import compare_pictures
from bvbedit.render.prepared import PreparedScene
from tests.edit.samples import smooth
from tests.gui.files import dimmed, model_file
from tests.gui.opengl import needs_opengl
from tests.gui.viewing import do, let, no_errors, with_viewer

pytestmark = needs_opengl


@pytest.fixture
def folder(tmp_path):
    model_file(tmp_path)
    model_file(tmp_path, "dim.bvb", dimmed(smooth()))
    return tmp_path


def picture(viewer):
    return viewer.preview.area.img_cols_rows[0].copy()


def test_the_first_pass_is_that_of_the_prepared_scene(folder):
    async def use(viewer):
        model, seen = viewer.session.here.model, viewer.preview.seen
        side = seen.picture.shape[0]
        prepared = PreparedScene(model, "sphere", width=side, height=side, spp=1, density=model.density)
        np.testing.assert_array_equal(seen.picture, prepared.shade(model))
        # An edit is shown by the same rays.
        await let(viewer, knob_gain_factor=2.0)
        np.testing.assert_array_equal(viewer.preview.seen.picture, prepared.shade(viewer.shown))
        assert "1 sample a pixel" in viewer.state.preview_note

    with_viewer(folder, use, "gold.bvb")


def test_scene_exposure_and_theme_change_the_picture(folder):
    async def use(viewer):
        with no_errors(viewer):
            seen = [picture(viewer)]
            for change in ({"scene": "furnace"}, {"scene": "sphere", "exposure": 1.0}, {"exposure": -2}):
                await let(viewer, **change)
                seen.append(picture(viewer))
                assert not any((seen[-1] == before).all() for before in seen[:-1]), change
            assert seen[2].mean() > seen[0].mean() > seen[3].mean()
            viewer.preview.area.process_resize_event(500, 200)
            await let(viewer, theme="dark")
            assert (picture(viewer)[0, 0] == [0x1E, 0x21, 0x26]).all()

    with_viewer(folder, use, "gold.bvb")


def test_a_scene_that_cannot_be_read_is_told_and_the_picture_stays(folder):
    (folder / "bad.toml").write_text("nothing = 1\n")

    async def use(viewer):
        before = picture(viewer)
        for scene in ("bad.toml", "absent.toml", "../outside.toml", "", None, ["sphere"]):
            await let(viewer, scene=scene)
            assert viewer.state.error_preview, scene
            assert "unexpectedly" not in viewer.state.error_preview
            assert (picture(viewer) == before).all()
        await let(viewer, scene="furnace")
        assert viewer.state.error_preview == ""
        assert (picture(viewer) != before).any()

    with_viewer(folder, use, "gold.bvb")


def test_later_passes_do_not_take_the_words_about_a_scene_away(folder):
    async def use(viewer):
        wish = viewer.preview._wish
        await let(viewer, scene="../outside.toml")
        told = viewer.state.error_preview
        viewer.preview._show(wish, viewer.preview.seen)
        assert viewer.state.error_preview == told

    with_viewer(folder, use, "gold.bvb")


def test_layouts_show_what_it_is_compared_with_and_by_how_much_it_differs(folder):
    async def use(viewer):
        await let(viewer, current=1)
        await let(viewer, layout="alone", against="document 2")
        shapes = [viewer.preview.area._picture.shape]
        assert viewer.preview.seen.other is None
        assert "MAE" not in viewer.state.preview_note
        for layout in ("beside", "difference"):
            await let(viewer, layout=layout)
            seen = viewer.preview.seen
            shapes.append(viewer.preview.area._picture.shape)
            found = compare_pictures(seen.picture, seen.other, 0.0)
            note = viewer.state.preview_note
            assert f"MAE {255 * found.mae:.2f}, PAE {255 * found.pae:.0f} of 255" in note
            assert viewer.state.preview_names.startswith(f"From the left: {viewer.session.here.name}, ")
        sides = [shape[1] / shape[0] for shape in shapes]
        assert sides[0] == 1
        assert 2 < sides[1] < 2.2
        assert 3 < sides[2] < 3.3
        gain = float(re.search(r"difference x (\d+)", viewer.state.preview_names).group(1))
        height, width, _ = shapes[2]
        ours, theirs, shown = (viewer.preview.area._picture[:, k * (height + 4) :][:, :height] for k in range(3))
        assert width == 3 * height + 8
        expected = np.minimum(gain * np.abs(ours.astype(float) - theirs), 255)
        np.testing.assert_array_equal(shown, expected.astype(np.uint8))
        # The words follow the exposure.
        note = viewer.state.preview_note
        await let(viewer, exposure=2)
        assert viewer.state.preview_note != note

    model_file(folder, "near.bvb", dimmed(smooth(), 0.98))
    with_viewer(folder, use, "gold.bvb", "near.bvb")


def test_what_it_is_compared_with_is_what_is_chosen(folder):
    async def use(viewer):
        await let(viewer, current=1)
        values = [item["value"] for item in viewer.state.against_items]
        assert values == ["nothing", "before", "document 2"]
        assert viewer.other is None
        await let(viewer, against="before")
        assert viewer.other is viewer.session.document.at(0)
        await let(viewer, against="document 2")
        assert viewer.other is viewer.session[2].shown
        for nonsense in ("document 1", "document 7", "source", None, ["before"], 3):
            await let(viewer, against=nonsense)
            assert viewer.other is None or nonsense == "document 1"
        # With what it is compared with, the comparison goes.
        await let(viewer, against="document 2")
        viewer.session.current = 2
        viewer.opening.close(2)
        await viewer.settled()
        assert viewer.state.against == "nothing"
        assert viewer.other is None

    with_viewer(folder, use, "gold.bvb", "dim.bvb")


def test_a_scene_file_of_the_folder_is_rendered(folder):
    source = np.full((4, 8, 3), 0.5, np.float32)
    source[0] = 20.0
    write_exr(folder / "sky.exr", source)

    async def use(viewer):
        assert viewer.state.scene_files == ["sky.exr"]
        before = viewer.preview.seen.picture
        with no_errors(viewer):
            await let(viewer, scene="sky.exr")
        assert np.abs(viewer.preview.seen.picture - before).max() > 0.01

    with_viewer(folder, use, "gold.bvb")


def test_words_are_about_the_pictures_that_are_seen_though_all_is_closed(folder):
    async def use(viewer):
        await let(viewer, layout="beside", against="before")
        told = "From the left: gold.bvb, before the edits"
        assert viewer.state.preview_names == told
        await do(viewer, viewer.opening.close, discard=True)
        await let(viewer, exposure=1.0)
        assert viewer.state.preview_names == told

    with_viewer(folder, use, "gold.bvb")


def test_a_picture_is_made_anew_for_another_size_only_if_it_would_have_one(folder):
    async def use(viewer):
        area = viewer.preview.area
        await do(viewer, area.process_resize_event, 400, 200)
        seen = viewer.preview.seen
        await do(viewer, area.process_resize_event, 400, 204)
        assert viewer.preview.seen is seen
        assert area.img_cols_rows[0].shape == (204, 400, 3)
        await do(viewer, area.process_resize_event, 800, 404)
        assert viewer.preview.seen.picture.shape[0] > seen.picture.shape[0]

    with_viewer(folder, use, "gold.bvb")
