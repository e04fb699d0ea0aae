"""Fitting from the panel: each way to say how large, progress, Stop, and what is told when it cannot be done."""

import asyncio

import pytest

from bvbedit import save
from bvbedit.edit.document import digest
from bvbedit.edit.fitting import Fit, FitOptions
from bvbedit.io import load
from tests.edit.samples import smooth
from tests.gui.files import model_file, table_file
from tests.gui.opengl import needs_opengl
from tests.gui.viewing import do, let, no_errors, with_viewer

pytestmark = needs_opengl

# Which chart and encoding serve best is not what is tested here.
QUICK = {"fit_chart": "half-diff", "fit_encoding": "root", "fit_knots": "averaged"}


@pytest.fixture
def folder(tmp_path):
    model_file(tmp_path)
    table_file(tmp_path)
    return tmp_path


async def begun_fit(viewer):
    """Return a fit that has begun, to be waited for."""
    fitting = asyncio.ensure_future(do(viewer, viewer.fitting.fit))
    while not viewer.state.fitting:
        await asyncio.sleep(0.005)
    return fitting


@pytest.mark.parametrize(
    ("state", "options"),
    [
        ({"fit_by": "bytes", "fit_kib": 2}, {"max_bytes": 2048}),
        ({"fit_by": "tolerance", "fit_tolerance": 0.25}, {"tolerance": 0.25}),
        ({"fit_by": "size", "fit_size": [7, 6, 5]}, {"size": (7, 6, 5)}),
        ({"fit_by": "knee", "fit_knots": "free"}, {"knots": "free"}),
        ({"fit_by": "knee", "fit_chart": "in-out", "fit_encoding": "log"}, {"chart": "in-out", "encoding": "log"}),
    ],
)
def test_the_panel_says_the_options(state, options, folder):
    async def use(viewer):
        await let(viewer, **state)
        assert FitOptions(**viewer.fitting.options()) == FitOptions(**options)

    with_viewer(folder, use, "gold.bvb")


def test_a_measurement_is_fitted_and_the_model_compared_with_it(folder):
    async def use(viewer):
        shares = []
        viewer.state.change("fit_share")(lambda fit_share, **_: shares.append(fit_share))
        await let(viewer, **QUICK, fit_by="size", fit_size=[6, 5, 4])
        with no_errors(viewer):
            await do(viewer, viewer.fitting.fit)
        assert not viewer.state.fitting
        options = FitOptions(size=(6, 5, 4), chart="half-diff", encoding="root", knots="averaged")
        expected = options.fitted(load(folder / "table.npz"))
        assert digest(viewer.shown) == digest(expected)
        assert max(shares) > 0
        assert shares == sorted(shares)
        assert viewer.state.fit_result.startswith("half-diff, root, 6 x 5 x 4; log_cosine_rms")
        assert viewer.state.against == "source"
        assert viewer.other is viewer.session.here.reference
        assert viewer.state.is_model
        assert viewer.state.can_fit_source
        # A new fit of the measurement is a document beside it, one of the model an edit.
        await let(viewer, fit_size=[5, 5, 4], fit_of="source")
        await do(viewer, viewer.fitting.fit)
        assert len(viewer.state.documents) == 2
        await let(viewer, fit_size=[4, 4, 4], fit_of="model")
        before = viewer.session.document.model
        await do(viewer, viewer.fitting.fit)
        edit = Fit(size=(4, 4, 4), chart="half-diff", encoding="root", knots="averaged")
        assert viewer.session.document.edits == (edit,)
        assert digest(viewer.shown) == digest(edit.apply(before))

    with_viewer(folder, use, "table.npz")


def test_a_model_is_fitted_within_bytes_or_to_a_tolerance(folder):
    async def use(viewer):
        with no_errors(viewer):
            await let(viewer, **QUICK, fit_by="tolerance", fit_tolerance=0.05)
            await do(viewer, viewer.fitting.fit)
            report = viewer.shown.report["metrics"]
            assert max(report[k]["log_cosine_rms"] for k in ("grid", "nodes")) <= 0.05
            await let(viewer, fit_by="bytes", fit_kib=4)
            await do(viewer, viewer.fitting.fit)
        assert [edit.line().split()[1] for edit in viewer.session.document.edits] == ["chart=half-diff"] * 2
        save(viewer.shown, folder / "small.bvb", precision=viewer.shown.storage.precision)
        assert (folder / "small.bvb").stat().st_size <= 4096

    with_viewer(folder, use, "gold.bvb")


def test_stop_leaves_the_document_and_a_later_fit_works(folder):
    async def use(viewer):
        before = viewer.session.document
        await let(viewer, **QUICK, fit_by="tolerance", fit_tolerance=1e-6)
        fitting = await begun_fit(viewer)
        # Others are refused meanwhile, quietly: the button cannot be pressed.
        await viewer.fitting.fit()
        viewer.fitting.stop()
        await fitting
        assert viewer.state.error_fit == "Stopped. Nothing was changed."
        assert not viewer.state.fitting
        assert viewer.session.document is before
        assert viewer.state.fit_result == ""
        await let(viewer, fit_by="size", fit_size=[5, 5, 4])
        with no_errors(viewer):
            await do(viewer, viewer.fitting.fit)
        assert viewer.shown.spline.size == (5, 5, 4)

    with_viewer(folder, use, "gold.bvb")


def test_a_document_that_is_closed_or_edited_meanwhile_is_told(folder):
    async def use(viewer):
        await let(viewer, **QUICK, fit_by="size", fit_size=[5, 5, 4])
        fitting = await begun_fit(viewer)
        await let(viewer, op="gain", knob_gain_factor=2.0)
        await do(viewer, viewer.editing.apply)
        await fitting
        assert "changed meanwhile" in viewer.state.error_fit
        assert [edit.op for edit in viewer.session.document.edits] == ["gain"]
        fitting = asyncio.ensure_future(do(viewer, viewer.fitting.fit))
        await asyncio.sleep(0.05)
        await do(viewer, viewer.opening.close, discard=True)
        await fitting
        assert viewer.state.error_fit
        assert "unexpectedly" not in viewer.state.error_fit
        assert viewer.state.documents == []
        assert not viewer.state.fitting

    with_viewer(folder, use, "gold.bvb")


@pytest.mark.parametrize(
    "state",
    [
        {"fit_by": "size", "fit_size": [1, 1, 1]},
        {"fit_by": "size", "fit_size": [8, None, 8]},
        {"fit_by": "size", "fit_size": "many"},
        {"fit_by": "size", "fit_size": [8, 8]},
        {"fit_by": "bytes", "fit_kib": 0},
        {"fit_by": "bytes", "fit_kib": float("nan")},
        {"fit_by": "bytes", "fit_kib": 1e300},
        {"fit_by": "tolerance", "fit_tolerance": -1},
        {"fit_by": "tolerance", "fit_tolerance": "fine"},
        {"fit_by": "size", "fit_size": [8, 8, 8], "fit_chart": "polar"},
        {"fit_by": "size", "fit_size": [8, 8, 8], "fit_knots": ["dominant"]},
        {"fit_by": "often"},
        {"fit_of": "source", "fit_by": "size", "fit_size": [8, 8, 8]},
    ],
    ids=lambda state: "-".join(str(value) for value in state.values()),
)
def test_a_wrong_option_is_told_and_changes_nothing(state, folder):
    async def use(viewer):
        before = viewer.session.document
        await let(viewer, **state)
        await do(viewer, viewer.fitting.fit)
        assert viewer.state.error_fit
        assert "unexpectedly" not in viewer.state.error_fit
        assert not viewer.state.fitting
        assert viewer.session.document is before
        assert digest(viewer.shown) == digest(smooth())

    with_viewer(folder, use, "gold.bvb")


def test_without_a_material_there_is_nothing_to_fit(folder):
    async def use(viewer):
        await do(viewer, viewer.fitting.fit)
        assert "Nothing is open" in viewer.state.error_fit
        assert not viewer.state.fitting

    with_viewer(folder, use)


@pytest.mark.parametrize("what", ["model", "measurement"])
def test_who_works_on_something_else_goes_on_with_that(what, folder):
    model_file(folder, "other.bvb")

    async def use(viewer):
        if what == "measurement":
            await do(viewer, viewer.opening.open_sample, "matte-paper")
        key = viewer.session.current
        await let(viewer, **QUICK, fit_by="size", fit_size=[5, 5, 4])
        fitting = await begun_fit(viewer)
        await do(viewer, viewer.opening.open_file, "other.bvb")
        here = viewer.session.current
        await let(viewer, op="gain", knob_gain_factor=2.0)
        tried = viewer.editing.pending
        await fitting
        assert (viewer.state.error_fit, viewer.state.fit_result) == ("", "")
        assert "is fitted: half-diff" in viewer.state.toast
        # What is tried there is still tried, and the other one is fitted, unsaved, and told to be.
        assert (viewer.session.current, viewer.state.current, viewer.editing.pending) == (here, here, tried)
        assert viewer.session[key].document.model.spline.size == (5, 5, 4)
        assert next(o for o in viewer.state.documents if o["key"] == key)["unsaved"]
        await let(viewer, current=key)
        assert viewer.shown.spline.size == (5, 5, 4)

    with_viewer(folder, use, "gold.bvb")


def test_a_document_that_is_edited_and_left_meanwhile_is_not_fitted(folder):
    model_file(folder, "other.bvb")

    async def use(viewer):
        key = viewer.session.current
        await let(viewer, **QUICK, fit_by="size", fit_size=[5, 5, 4])
        fitting = await begun_fit(viewer)
        await let(viewer, op="gain", knob_gain_factor=2.0)
        await do(viewer, viewer.editing.apply)
        await do(viewer, viewer.opening.open_file, "other.bvb")
        await fitting
        assert viewer.state.error_fit == "It was closed or has changed meanwhile."
        assert [edit.op for edit in viewer.session[key].document.edits] == ["gain"]

    with_viewer(folder, use, "gold.bvb")
