"""Materials of all kinds: measurements, black, constant, and the paper's chart; what cannot be done says why."""

import numpy as np
import pytest

from bvbedit.brdf.charts import HALF_DIFF, IN_OUT
from bvbedit.brdf.encodings import Linear, Root
from bvbedit.brdf.spline_brdf import SplineBrdf
from tests.edit.samples import smooth
from tests.gui.files import mesh, model_file, points, table_file
from tests.gui.opengl import needs_opengl
from tests.gui.viewing import do, let, no_errors, with_viewer

pytestmark = needs_opengl


def flat(value, chart=HALF_DIFF, encoding=None):
    model = smooth(chart, encoding or Root())
    control = np.full(model.spline.control.shape, float(value))
    return SplineBrdf(model.spline.with_control(control), chart, model.encoding)


MODELS = {
    "black": flat(0.0),
    "below zero": flat(-0.5),
    "constant": flat(0.6),
    "paper": smooth(IN_OUT, Linear()),
    "paper, black": flat(0.0, IN_OUT, Linear()),
    "huge": flat(1e4, HALF_DIFF, Linear()),
}


@pytest.mark.parametrize("name", MODELS)
def test_every_control_works_for_every_model(name, tmp_path):
    model_file(tmp_path, "m.bvb", MODELS[name])

    async def use(viewer):
        with no_errors(viewer):
            changes = (
                {"what": "red", "iso": -1.0, "iso_count": 6},
                {"show_net": True, "show_knots": True, "slice_0_on": True, "slice_2_on": True},
                {"theta_i": 60, "lobe_scale": "log"},
                {"lobe_scale": "auto", "lobe_beside": "beside", "against": "before"},
                {"what": "difference", "layout": "difference"},
                {"figure": "albedo"},
                {"figure": "numbers"},
                {"figure": "line", "line_axis": 2, "line_scale": "linear"},
                {"theme": "dark", "exposure": -3},
            )
            for change in changes:
                await let(viewer, **change)
            for area in (viewer.volume.area, viewer.lobes.area, viewer.preview.area):
                pixels, width, height = area.img_cols_rows
                assert pixels.shape == (height, width, 3)
            await let(viewer, op="gain", knob_gain_factor=2.0)
            await do(viewer, viewer.editing.apply)
            assert [edit.line() for edit in viewer.session.document.edits] == ["gain factor=2"]

    with_viewer(tmp_path, use, "m.bvb")


def test_axes_and_regions_are_those_of_the_chart(tmp_path):
    model_file(tmp_path, "paper.bvb", MODELS["paper"])
    model_file(tmp_path, "gold.bvb")

    async def use(viewer):
        names = {opened.name: key for key, opened in viewer.session}
        for name, symbols, angles in (
            ("paper.bvb", ["θ_i", "θ_o", "φ"], ("theta_i", "theta_o", "phi")),
            ("gold.bvb", ["θ_h", "θ_d", "φ_d"], ("theta_h", "theta_d", "phi_d")),
        ):
            await let(viewer, current=names[name])
            assert viewer.state.axis_names == symbols
            with viewer.state:
                viewer.picking.pick(20)
            await let(viewer)
            on = {
                a
                for a in ("theta_i", "theta_o", "phi", "theta_h", "theta_d", "phi_d")
                if viewer.state[f"region_{a}_on"]
            }
            assert on == set(angles)

    with_viewer(tmp_path, use, "paper.bvb", "gold.bvb")


def test_a_measurement_is_seen_and_what_needs_a_model_says_so(tmp_path):
    table_file(tmp_path)

    async def use(viewer):
        assert not viewer.state.is_model
        assert not viewer.state.can_undo
        assert viewer.state.history == []
        assert mesh(viewer.volume, "surfaces") is not None
        before = points(viewer.lobes, "model")
        await let(viewer, theta_i=70)
        assert (points(viewer.lobes, "model") != before).any()
        # Net and knots it has none of; knobs of edits try nothing.
        await let(viewer, show_net=True, show_knots=True, knob_gain_factor=2.0)
        assert mesh(viewer.volume, "net 0") is None
        assert mesh(viewer.volume, "knots 0") is None
        assert viewer.editing.pending is None
        for method, place in (
            (viewer.editing.apply, "edit"),
            (viewer.editing.name_state, "edit"),
            (viewer.saving.save_as, "save"),
        ):
            await let(viewer, named="x", save_name="x.bvb")
            await do(viewer, method)
            assert "is a measurement. Fit it first." in viewer.state[f"error_{place}"]
        await let(viewer, fit_of="model")
        await do(viewer, viewer.fitting.fit)
        assert "is a measurement. Fit it first." in viewer.state.error_fit
        for method in (viewer.editing.undo, viewer.editing.redo, viewer.editing.cancel):
            await do(viewer, method)
        assert list(tmp_path.iterdir()) == [tmp_path / "table.npz"]

    with_viewer(tmp_path, use, "table.npz")


def test_without_a_material_nothing_fails(tmp_path):
    async def use(viewer):
        for method in (
            viewer.editing.undo,
            viewer.editing.redo,
            viewer.editing.cancel,
            viewer.saving.save,
            viewer.opening.close,
            viewer.editing.reset_region,
        ):
            await do(viewer, method)
        for method, place in (
            (viewer.editing.apply, "edit"),
            (viewer.saving.save_as, "save"),
            (viewer.editing.name_state, "edit"),
        ):
            await let(viewer, named="x", save_name="x.bvb")
            await do(viewer, method)
            assert "Nothing is open" in viewer.state[f"error_{place}"]
        await let(viewer, what="red", theta_i=3, exposure=2, knob_gain_factor=3.0, theme="dark", scene="furnace")
        assert list(tmp_path.iterdir()) == []

    with_viewer(tmp_path, use)
