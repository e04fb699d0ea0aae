"""Each control of the volume's panel changes what the scene shows."""

import numpy as np
import pytest

from bvbedit_gui import volume
from tests.edit.samples import smooth
from tests.gui.files import dimmed, mesh, model_file, points
from tests.gui.opengl import needs_opengl
from tests.gui.viewing import do, let, no_errors, with_viewer

pytestmark = needs_opengl


def levels(viewer):
    shown = mesh(viewer.volume, "surfaces")
    return np.zeros(0) if shown is None else np.unique(np.round(shown.point_data[volume.LEVEL], 3))


@pytest.fixture
def folder(tmp_path):
    model_file(tmp_path)
    model_file(tmp_path, "dim.bvb", dimmed(smooth()))
    return tmp_path


def test_surfaces_stand_at_the_iso_value_and_below_it(folder):
    async def use(viewer):
        with no_errors(viewer):
            await let(viewer, iso_count=1, iso=-0.4)
            np.testing.assert_allclose(levels(viewer), [-0.4], atol=1e-3)
            assert viewer.state.iso_text == "0.398"
            before = points(viewer.volume, "surfaces")
            await let(viewer, iso=-0.3)
            np.testing.assert_allclose(levels(viewer), [-0.3], atol=1e-3)
            assert before.shape != points(viewer.volume, "surfaces").shape
            await let(viewer, iso_count=3, iso_gap=0.1)
            np.testing.assert_allclose(levels(viewer), [-0.5, -0.4, -0.3], atol=1e-3)
            await let(viewer, iso_gap=0.2)
            np.testing.assert_allclose(levels(viewer), [-0.7, -0.5, -0.3], atol=1e-3)
            assert viewer.state.iso_text.count(",") == 2

    with_viewer(folder, use, "gold.bvb")


def test_opacity_is_that_of_the_surfaces(folder):
    async def use(viewer):
        for given, expected in ((0.3, 0.3), (1, 1.0), (7, 1.0), (-1, 0.02)):
            await let(viewer, opacity=given)
            assert viewer.volume.plotter.actors["surfaces"].prop.opacity == pytest.approx(expected)

    with_viewer(folder, use, "gold.bvb")


def test_surfaces_are_of_the_channel_that_is_chosen(folder):
    async def use(viewer):
        await let(viewer, iso_count=1, iso=-0.8)
        seen, titles = [], []
        for what in ("luminance", "red", "green", "blue"):
            await let(viewer, what=what)
            seen.append(viewer.volume.field.values)
            titles.append(viewer.state.bar_title)
            f = viewer.session.here.model
            axes = volume.box_nodes(f)
            expected = volume.scalar(volume.sampled(f, f.chart, axes), what)
            np.testing.assert_allclose(seen[-1], expected)
        assert len(set(titles)) == 4

    with_viewer(folder, use, "gold.bvb")


def test_a_difference_needs_something_to_differ_from(folder):
    async def use(viewer):
        assert "difference" not in [item["value"] for item in viewer.state.what_items]
        await let(viewer, what="difference")
        assert not viewer.volume.field.signed
        other = next(key for key, opened in viewer.session if opened.name == "dim.bvb")
        await let(viewer, current=1)
        await let(viewer, against=f"document {other}")
        assert "difference" in [item["value"] for item in viewer.state.what_items]
        await let(viewer, what="difference")
        assert viewer.volume.field.signed
        # Half of the encoded values is an eighth of the reflectance: this model is the brighter one everywhere.
        assert (viewer.volume.field.values >= 0).all()
        assert viewer.volume.field.values.max() > 0.1
        await let(viewer, against="nothing")
        assert viewer.state.what == "luminance"
        assert not viewer.volume.field.signed

    with_viewer(folder, use, "gold.bvb", "dim.bvb")


def test_net_and_knots_are_shown_when_they_are_asked_for(folder):
    async def use(viewer):
        model = viewer.session.here.model
        for name, count in (("net", 4), ("knots", 3)):
            actors = [f"{name} {n}" for n in range(count)]
            assert not any(len(points(viewer.volume, a)) for a in actors)
            await let(viewer, **{f"show_{name}": True})
            shown = np.concatenate([points(viewer.volume, a) for a in actors])
            assert len(shown) == (8 * 6 * 5 if name == "net" else 5 * (4 + 2 + 1))
            if name == "net":
                expected = volume.net_points(model)
                assert {tuple(p) for p in np.round(shown, 5)} == {tuple(p) for p in np.round(expected, 5)}
            await let(viewer, **{f"show_{name}": False})
            assert not any(len(points(viewer.volume, a)) for a in actors)

    with_viewer(folder, use, "gold.bvb")


def test_slices_stand_where_they_are_put(folder):
    async def use(viewer):
        for axis in range(3):
            await let(viewer, **{f"slice_{axis}": 0.25})
            assert mesh(viewer.volume, f"slice {axis}") is None
            await let(viewer, **{f"slice_{axis}_on": True})
            before = points(viewer.volume, f"slice {axis}")
            np.testing.assert_allclose(before[:, axis], 0.25)
            await let(viewer, **{f"slice_{axis}": 0.75})
            after = mesh(viewer.volume, f"slice {axis}")
            np.testing.assert_allclose(np.asarray(after.points)[:, axis], 0.75)
            f = viewer.session.here.model
            rgb = f.encoding.decode(f.spline.evaluate(np.clip(np.asarray(after.points, float), 0, 1)))
            np.testing.assert_allclose(after.point_data[volume.LEVEL], np.log10(volume.luminance(rgb)), atol=1e-5)
            await let(viewer, **{f"slice_{axis}_on": False})
            assert mesh(viewer.volume, f"slice {axis}") is None

    with_viewer(folder, use, "gold.bvb")


def test_views_turn_the_camera(folder):
    async def use(viewer):
        places = []
        for view in ("oblique", "0", "1", "2"):
            await do(viewer, viewer.volume.look_from, view)
            places.append(tuple(np.round(viewer.volume.plotter.camera.position, 6)))
        assert len(set(places)) == 4

    with_viewer(folder, use, "gold.bvb")


def test_the_picture_is_another_one_after_each_of_them(folder):
    async def use(viewer):
        area = viewer.volume.area
        area.process_resize_event(400, 300)
        before = area.img_cols_rows[0].copy()
        assert before.shape == (300, 400, 3)
        changes = ({"iso": -0.6}, {"opacity": 0.9}, {"show_net": True}, {"show_knots": True}, {"slice_1_on": True})
        for change in (*changes, {"theme": "dark"}):
            await let(viewer, **change)
            after = area.img_cols_rows[0].copy()
            assert (after != before).any(), change
            before = after

    with_viewer(folder, use, "gold.bvb")


def test_an_iso_value_beyond_the_field_is_taken_up_again_when_the_field_spans_it_again(folder):
    async def use(viewer):
        chosen = viewer.state.iso_high - 0.1
        await let(viewer, iso=chosen, op="gain")
        for gain in (0.1, 0.01):
            await let(viewer, knob_gain_factor=gain)
            assert viewer.state.iso == viewer.state.iso_high < chosen
        await let(viewer, knob_gain_factor=1.0)
        assert viewer.state.iso == chosen
        # What is chosen meanwhile is the choice.
        await let(viewer, knob_gain_factor=0.5)
        other = viewer.state.iso_high - 0.1
        await let(viewer, iso=other)
        await let(viewer, knob_gain_factor=1.0)
        assert viewer.state.iso == other

    with_viewer(folder, use, "gold.bvb")
