"""Every edit's knobs: what is shown is what the edit makes, Apply records exactly that, Cancel leaves no trace."""

import asyncio

import numpy as np
import pytest

from bvbedit.edit.document import digest
from bvbedit.edit.operations import edit_of_line
from bvbedit_gui.editing import OFFERED
from bvbedit_gui.knobs import knobs_of
from tests.edit.samples import smooth
from tests.gui.files import dimmed, model_file
from tests.gui.opengl import needs_opengl
from tests.gui.viewing import do, let, no_errors, with_viewer

pytestmark = needs_opengl

# Knobs that are moved, and the edit that they mean.
EDITS = {
    "gain": ({"factor": 2.0}, "gain factor=2"),
    "gain part": ({"factor": 2.0, "part": "highlight"}, "gain factor=2 part=highlight"),
    "tint": ({"rgb": [1.0, 0.8, 0.6]}, "tint rgb=1,0.8,0.6"),
    "tint hue": ({"hue": 30, "saturation": 0.5}, "tint hue=30 saturation=0.5"),
    "broaden": ({"factor": 1.5}, "broaden factor=1.5"),
    "sharpen": ({"factor": 1.5, "keep_energy": False}, "sharpen factor=1.5 keep_energy=false"),
    "raise_grazing": ({"amount": 1.5, "power": 3}, "raise_grazing amount=1.5 power=3"),
    "denoise": ({"strength": 5.0}, "denoise strength=5"),
    "blend": ({"partner": "dim.bvb", "t": 0.5, "space": "linear"}, "blend partner={folder}/dim.bvb t=0.5 space=linear"),
    "move_points": ({"at": [20, 30, 150], "rgb": [0.3, 0.2, 0.1]}, "move_points at=20,30,150 rgb=0.3,0.2,0.1"),
    "make_plausible": ({"negative": True}, "make_plausible negative=true"),
    "insert_knots": ({"axis": 1, "at": 0.4}, "insert_knots axis=1 at=0.4"),
    "refine": ({"axis": 2, "factor": 3}, "refine axis=2 factor=3"),
    "remove_knots": ({"axis": 0, "tolerance": 0.05}, "remove_knots axis=0 tolerance=0.05"),
    "elevate": ({"axis": 1, "by": 2}, "elevate axis=1 by=2"),
    "reduce": ({"axis": 2, "by": 2}, "reduce axis=2 by=2"),
    "store": ({"precision": "float16"}, "store precision=float16"),
}


@pytest.fixture
def folder(tmp_path):
    model_file(tmp_path)
    model_file(tmp_path, "dim.bvb", dimmed(smooth()))
    return tmp_path


def edit_in(folder, name):
    return edit_of_line(EDITS[name][1].format(folder=folder))


def moved(name):
    op = name.split()[0]
    return {f"knob_{op}_{knob}": value for knob, value in EDITS[name][0].items()}


def test_every_edit_is_among_them():
    assert {name.split()[0] for name in EDITS} == set(OFFERED)


@pytest.mark.parametrize("name", EDITS)
def test_apply_records_what_was_shown(name, folder):
    edit = edit_in(folder, name)

    async def use(viewer):
        source = viewer.session.here.model
        expected = digest(edit.apply(source))
        await let(viewer, op=edit.op)
        picture = viewer.preview.seen.picture
        with no_errors(viewer):
            await let(viewer, **moved(name))
            assert viewer.state.edit_pending
            assert digest(viewer.shown) == expected
            assert digest(viewer.session.here.model) == digest(source)
            # Those edits change the look; the others do not, or by less than a hundredth.
            loud = edit.op in ("gain", "tint", "broaden", "sharpen", "raise_grazing", "blend", "move_points")
            change = np.abs(viewer.preview.seen.picture - picture).max() / picture.max()
            assert change > 0.01 or not loud
            await do(viewer, viewer.editing.apply)
        assert not viewer.state.edit_pending
        assert viewer.editing.pending is None
        assert viewer.session.document.edits == (edit,)
        assert digest(viewer.shown) == expected
        assert viewer.state.history[-1]["line"] == edit.line()
        assert viewer.state.history[-1]["here"]
        assert viewer.state.can_undo

    with_viewer(folder, use, "gold.bvb")


@pytest.mark.parametrize("name", EDITS)
def test_cancel_restores_the_model_and_the_knobs(name, folder):
    edit = edit_in(folder, name)

    async def use(viewer):
        source = digest(viewer.session.here.model)
        await let(viewer, op=edit.op)
        await let(viewer, **moved(name))
        assert viewer.state.edit_pending
        await do(viewer, viewer.editing.cancel)
        assert not viewer.state.edit_pending
        assert viewer.state.edit_note == ""
        assert digest(viewer.shown) == source
        assert viewer.session.document.edits == ()
        for knob in knobs_of(edit.op):
            if knob.kind not in ("file", "axis"):
                assert viewer.state[knob.state] == knob.start
        # Nothing is being tried: what is there can be saved.
        await do(viewer, viewer.saving.save)
        assert viewer.state.error_save == ""

    with_viewer(folder, use, "gold.bvb")


def test_after_an_edit_is_applied_no_other_is_tried_by_itself(folder):
    async def use(viewer):
        for name in ("refine", "blend", "insert_knots", "remove_knots"):
            edit = edit_in(folder, name)
            await let(viewer, op=edit.op)
            await let(viewer, **moved(name))
            await do(viewer, viewer.editing.apply)
            await asyncio.sleep(0)
            await viewer.settled()
            assert not viewer.state.edit_pending, name
        assert len(viewer.session.document.edits) == 4

    with_viewer(folder, use, "gold.bvb")


WRONG = {
    "gain": {"knob_gain_factor": -1},
    "gain text": {"knob_gain_factor": "much"},
    "gain nothing": {"knob_gain_factor": None},
    "gain huge": {"knob_gain_factor": 1e300},
    "tint": {"knob_tint_rgb": [1.0, None, 0.5]},
    "tint short": {"knob_tint_rgb": [1.0, 0.5]},
    "broaden": {"knob_broaden_factor": 0},
    "broaden part": {"knob_broaden_factor": 2.0, "knob_broaden_part": "body"},
    "raise_grazing": {"knob_raise_grazing_amount": float("nan")},
    "denoise": {"knob_denoise_strength": []},
    "blend": {"knob_blend_t": 0.5},
    "blend absent": {"knob_blend_t": 0.5, "knob_blend_partner": "absent.bvb"},
    "blend outside": {"knob_blend_t": 0.5, "knob_blend_partner": "../outside.bvb"},
    "move_points": {"knob_move_points_at": [95, 0, 0]},
    "insert_knots": {"knob_insert_knots_at": 1.5},
    "refine": {"knob_refine_factor": 2.5},
    "elevate": {"knob_elevate_by": 40},
    "reduce": {"knob_reduce_by": 9},
    "reduce tolerance": {"knob_reduce_by": 2, "knob_reduce_tolerance": 0},
    "store": {"knob_store_precision": "float8"},
}


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_value_is_told_and_changes_nothing(name, folder):
    async def use(viewer):
        op = name.split()[0]
        source = digest(viewer.session.here.model)
        await let(viewer, op=op)
        await let(viewer, **WRONG[name])
        assert viewer.state.error_edit
        assert "unexpectedly" not in viewer.state.error_edit
        assert not viewer.state.edit_pending
        assert digest(viewer.shown) == source
        await do(viewer, viewer.editing.apply)
        assert viewer.state.error_edit
        assert viewer.session.document.edits == ()
        assert viewer.state.edit_note == ""
        # The words go when what was wrong goes.
        await do(viewer, viewer.editing.cancel)
        assert viewer.state.error_edit == ""

    with_viewer(folder, use, "gold.bvb")


def test_a_value_that_fails_takes_away_what_was_tried_before(folder):
    async def use(viewer):
        source = digest(viewer.session.here.model)
        await let(viewer, op="reduce")
        await let(viewer, knob_reduce_by=2)
        assert viewer.state.edit_pending
        await let(viewer, knob_reduce_tolerance=1e-9)
        assert viewer.state.error_edit
        assert not viewer.state.edit_pending
        assert digest(viewer.shown) == source
        await let(viewer, knob_reduce_tolerance=10.0)
        assert viewer.state.error_edit == ""
        assert viewer.state.edit_pending

    with_viewer(folder, use, "gold.bvb")


def test_without_live_nothing_is_shown_before_apply(folder):
    async def use(viewer):
        source = digest(viewer.session.here.model)
        await let(viewer, live=False)
        await let(viewer, knob_gain_factor=3.0)
        assert not viewer.state.edit_pending
        assert digest(viewer.shown) == source
        await let(viewer, live=True)
        assert viewer.state.edit_pending
        await let(viewer, live=False)
        assert digest(viewer.shown) == source
        await do(viewer, viewer.editing.apply)
        assert [edit.line() for edit in viewer.session.document.edits] == ["gain factor=3"]

    with_viewer(folder, use, "gold.bvb")


def test_another_edit_leaves_what_was_tried(folder):
    async def use(viewer):
        source = digest(viewer.session.here.model)
        await let(viewer, knob_gain_factor=3.0)
        await let(viewer, op="tint")
        assert not viewer.state.edit_pending
        assert digest(viewer.shown) == source
        await let(viewer, op="gain")
        # Its knob still stands where it was put, and shows what it says.
        assert viewer.state.edit_pending

    with_viewer(folder, use, "gold.bvb")
