"""Clicks on the volume pick control points, confine edits to their region, and put knots on axes."""

import numpy as np
import pytest

from bvbedit.edit.document import digest
from bvbedit.edit.operations import edit_of_line
from bvbedit_gui import volume
from bvbedit_gui.drawing import axis_edges, on_screen
from tests.edit.samples import smooth
from tests.gui.files import model_file, points, table_file
from tests.gui.opengl import needs_opengl
from tests.gui.viewing import do, let, no_errors, with_viewer

pytestmark = needs_opengl


@pytest.fixture
def folder(tmp_path):
    model_file(tmp_path)
    table_file(tmp_path)
    return tmp_path


async def click(viewer, place, *, shift=False, drag=0.0):
    """Press at a point of the scene and release, perhaps elsewhere."""
    viewer.volume.area.img_cols_rows  # noqa: B018  (what is clicked has been seen)
    x, y = on_screen(viewer.volume.plotter, np.asarray(place, float)[None])[0]
    for kind, shift_by in (("LeftButtonPress", 0.0), ("LeftButtonRelease", drag)):
        event = {"type": kind, "x": x + shift_by, "y": y, "w": 640, "h": 480, "shiftKey": int(shift), "controlKey": 0}
        viewer.volume.area.process_interaction_event({**event, "altKey": 0})
    await let(viewer)


def test_a_click_picks_the_control_point_there(folder):
    async def use(viewer):
        net = volume.net_points(viewer.session.here.model)
        await let(viewer, mode="pick", show_net=True)
        n = int(np.ravel_multi_index((4, 2, 3), (8, 6, 5)))
        with no_errors(viewer):
            await click(viewer, net[n])
        assert viewer.state.picked.startswith("Control point (4, 2, 3):")
        np.testing.assert_allclose(points(viewer.volume, "marked"), net[n][None], atol=1e-6)
        np.testing.assert_allclose(viewer.state.probe, net[n], atol=1e-4)
        angles = viewer.session.here.model.chart.angles(net[n][None])[0]
        for name, angle in zip(("theta_h", "theta_d", "phi_d"), angles, strict=True):
            assert viewer.state[f"region_{name}_on"]
            np.testing.assert_allclose(viewer.state[f"region_{name}"], [angle, angle], atol=0.06)
        # Those that the edit would reach are marked, the picked one among them.
        chosen = points(viewer.volume, "selected")
        assert np.linalg.norm(chosen - net[n], axis=1).min() < 1e-6

    with_viewer(folder, use, "gold.bvb")


def test_shift_adds_to_what_is_picked_and_the_region_spans_both(folder):
    async def use(viewer):
        model = viewer.session.here.model
        net = volume.net_points(model)
        await let(viewer, mode="pick")
        a, b = (int(np.ravel_multi_index(i, (8, 6, 5))) for i in ((2, 1, 1), (6, 4, 3)))
        await click(viewer, net[a])
        await click(viewer, net[b], shift=True)
        assert "(2 picked)" in viewer.state.picked
        ends = np.sort(model.chart.angles(net[[a, b]]), axis=0).T
        for name, interval in zip(("theta_h", "theta_d", "phi_d"), ends, strict=True):
            np.testing.assert_allclose(viewer.state[f"region_{name}"], interval, atol=0.06)
        await click(viewer, net[a])
        assert "picked)" not in viewer.state.picked
        await do(viewer, viewer.editing.reset_region)
        assert viewer.state.picked == ""
        assert not viewer.state.region_theta_h_on
        assert len(points(viewer.volume, "marked")) == 0

    with_viewer(folder, use, "gold.bvb")


def test_a_drag_and_a_click_beside_pick_nothing(folder):
    async def use(viewer):
        net = volume.net_points(viewer.session.here.model)
        await let(viewer, mode="pick")
        await click(viewer, net[100], drag=30.0)
        assert viewer.state.picked == ""
        await click(viewer, [5.0, 5.0, 5.0])
        assert viewer.state.picked == ""
        await let(viewer, mode="turn")
        await click(viewer, net[100])
        assert viewer.state.picked == ""

    with_viewer(folder, use, "gold.bvb")


def test_picking_fills_in_the_point_that_is_to_be_moved(folder):
    async def use(viewer):
        model = viewer.session.here.model
        await let(viewer, op="move_points")
        n = int(np.ravel_multi_index((2, 2, 2), (8, 6, 5)))
        with viewer.state:
            viewer.picking.pick(n)
        await let(viewer)
        at, rgb = viewer.state.knob_move_points_at, viewer.state.knob_move_points_rgb
        edit = edit_of_line(f"move_points at={','.join(map(str, at))} rgb={','.join(map(str, rgb))}")
        place = volume.net_points(model)[n][None]
        np.testing.assert_allclose(rgb, model.encoding.decode(model.spline.evaluate(place))[0], rtol=1e-3)
        # The material already is what is filled in: putting it there changes next to nothing.
        moved = edit.apply(model)
        assert np.abs(moved.spline.control - model.spline.control).max() < 2e-3

    with_viewer(folder, use, "gold.bvb")


def test_an_edit_is_confined_to_the_region(folder):
    async def use(viewer):
        source = viewer.session.here.model
        with no_errors(viewer):
            await let(viewer, region_theta_h_on=True, region_theta_h=[0, 5], region_falloff=2)
            await let(viewer, knob_gain_factor=2.0)
            edit = edit_of_line("gain factor=2 theta_h=0..5 falloff=2")
            assert digest(viewer.shown) == digest(edit.apply(source))
            narrow = len(points(viewer.volume, "selected"))
            await let(viewer, region_falloff=20)
            assert len(points(viewer.volume, "selected")) > narrow > 0
            await let(viewer, region_phi_d_on=True, region_phi_d=[0, 10], region_falloff=0)
            edit = edit_of_line("gain factor=2 theta_h=0..5 phi_d=0..10 falloff=0")
            assert digest(viewer.shown) == digest(edit.apply(source))
            await do(viewer, viewer.editing.apply)
        assert viewer.session.document.edits == (edit,)
        await do(viewer, viewer.editing.reset_region)
        assert len(points(viewer.volume, "selected")) == 0

    with_viewer(folder, use, "gold.bvb")


@pytest.mark.parametrize("given", [[30, 10], [-5, 10], [0, 400], [0], None, "0..20", [None, 5], [float("nan"), 5]])
def test_a_region_that_is_none_is_told(given, folder):
    async def use(viewer):
        source = digest(viewer.session.here.model)
        await let(viewer, knob_gain_factor=2.0)
        await let(viewer, region_theta_h_on=True, region_theta_h=given)
        assert viewer.state.error_edit
        assert "unexpectedly" not in viewer.state.error_edit
        assert digest(viewer.shown) == source

    with_viewer(folder, use, "gold.bvb")


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_click_on_an_axis_inserts_a_knot_there(axis, folder):
    async def use(viewer):
        before = viewer.session.here.model
        ends = axis_edges()[axis]
        await let(viewer, mode="knot")
        await click(viewer, 0.4 * ends[0] + 0.6 * ends[1])
        await viewer.picking._inserting
        (edit,) = viewer.session.document.edits
        assert edit.op == "insert_knots"
        assert edit.axis == axis
        assert edit.at[0] == pytest.approx(0.6, abs=1e-3)
        # The chart's half angles go with the square of their parameter; of theta_d the limit depends on theta_h.
        told = {0: "A knot at θ_h = 32.4°", 1: "A knot at 60 % of the largest θ_d", 2: "A knot at φ_d = 54°"}
        assert viewer.state.toast == told[axis]
        assert viewer.shown.spline.size[axis] == before.spline.size[axis] + 1
        # Where no axis is, nothing is inserted.
        await click(viewer, [0.5, 0.5, 0.5])
        await click(viewer, [9.0, 0.5, 0.5])
        assert len(viewer.session.document.edits) == 1

    with_viewer(folder, use, "gold.bvb")


def test_a_measurement_has_nothing_to_pick(folder):
    async def use(viewer):
        for mode in ("pick", "knot"):
            await let(viewer, mode=mode)
            await click(viewer, axis_edges()[0].mean(axis=0))
        assert viewer.state.picked == ""
        assert viewer.state.history == []

    with_viewer(folder, use, "table.npz")


@pytest.mark.parametrize("event", [{}, {"type": "LeftButtonPress"}, {"type": "LeftButtonRelease", "x": "a", "y": None}])
def test_events_that_are_none_do_nothing(event, folder):
    async def use(viewer):
        await let(viewer, mode="pick")
        for _ in range(2):
            viewer.volume.area.process_interaction_event(dict(event))
        assert viewer.state.picked == ""

    with_viewer(folder, use, "gold.bvb")


def test_what_is_picked_is_forgotten_when_the_net_is_another(folder):
    async def use(viewer):
        with viewer.state:
            viewer.picking.pick(len(volume.net_points(smooth())) - 1)
        await let(viewer)
        assert viewer.state.picked
        await let(viewer, op="reduce", knob_reduce_axis=0)
        await let(viewer, knob_reduce_by=2)
        await do(viewer, viewer.editing.apply)
        assert viewer.state.picked == ""
        assert len(points(viewer.volume, "marked")) == 0

    with_viewer(folder, use, "gold.bvb")
