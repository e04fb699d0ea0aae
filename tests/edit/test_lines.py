"""Edits are told in lines and read again; wrong ones are refused with a way out."""

import numpy as np
import pytest
from hypothesis import given, settings

from bvbedit.edit.appearance import Gain, Tint
from bvbedit.edit.combining import MovePoints
from bvbedit.edit.operations import KINDS, OPERATIONS, edit_of, edit_of_line
from bvbedit.edit.region import Region
from bvbedit.edit.structural import InsertKnots, Refine
from bvbedit.errors import BvbError
from tests.edit.samples import edits
from tests.spline.refusals import refusal


@given(edits())
@settings(max_examples=250)
def test_an_edit_is_read_again_from_its_line_and_from_its_dictionary(edit):
    assert edit_of(edit.to_dict()) == edit
    line = edit.line()
    assert "\n" not in line
    assert edit_of_line(line) == edit


def test_every_operation_has_a_name_and_tells_what_it_does():
    assert len(OPERATIONS) == len(KINDS)
    for name, kind in OPERATIONS.items():
        assert kind.about
        assert name == kind.__dataclass_fields__["op"].default


def told(call):
    """The one line with which a call is refused; a question may be the way out."""
    with pytest.raises(BvbError) as error:
        call()
    message = str(error.value)
    if message.endswith("?"):
        assert " not known. Did you mean " in message
        assert "\n" not in message
        return message
    return refusal(call)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("gain factor=nan", ("factor is nan",)),
        ("gain factor=inf", ("factor is inf",)),
        ("gain factor=-1", ("factor is -1", "0 ... 1e+06")),
        ("gain factor=true", ("factor is true",)),
        ("gain factor=two", ("factor is 'two'", "a number")),
        ("gain", ("factor is missing",)),
        ("gain factr=2", ("factr is not known", "factor")),
        ("gain factor=2 thetah=0..20", ("thetah is not known", "theta_h")),
        ("gain factor=2 factor=3", ("factor is given twice",)),
        ("gain factor", ("'factor'", "factor=1.5")),
        ("gain factor=", ("'factor='", "factor=1.5")),
        ("gain =2", ("'=2'", "factor=1.5")),
        ("gian factor=2", ("gian", "gain")),
        ("", ("''", "tint rgb=1,0.8,0.6")),
        ("'gain", ("gain", "tint rgb=1,0.8,0.6")),
        ("gain factor=2 theta_h=20..10", ("theta_h is [20.0, 10.0]", "smaller one first")),
        ("gain factor=2 theta_h=0..100", ("theta_h is 100", "0 ... 90 degrees")),
        ("gain factor=2 theta_h=nan..3", ("nan",)),
        ("gain factor=2 theta_h=5", ("theta_h is 5", "a list of 2 numbers")),
        ("gain factor=2 theta_h=1,2,3", ("theta_h is [1, 2, 3]", "a list of 2 numbers")),
        ("gain factor=2 phi=-10..10", ("phi is -10", "0 ... 180 degrees")),
        ("gain factor=2 part=gloss", ("part is 'gloss'", "highlight")),
        ("tint", ("tint needs rgb",)),
        ("tint rgb=1,1,1 hue=20", ("tint needs rgb",)),
        ("tint rgb=1,2", ("rgb is [1, 2]", "3 numbers")),
        ("tint hue=181", ("hue is 181", "-180 ... 180 degrees")),
        ("broaden factor=0", ("factor is 0", "0.05 ... 20")),
        ("broaden factor=2 part=body", ("no highlight",)),
        ("sharpen factor=2 part=body", ("no highlight",)),
        ("blend t=0.5", ("partner is missing",)),
        ("blend partner=a.bvb", ("t is missing",)),
        ("blend partner=a.bvb t=0.5 space=gamma", ("space is 'gamma'", "'net'")),
        ("move_points at=10,20,30", ("rgb is missing",)),
        ("move_points at=10,20,30;1,2,3 rgb=1,1,1", ("2 places and 1 values",)),
        ("move_points at=100,20,30 rgb=1,1,1", ("up to 90 degrees",)),
        ("move_points at=10,20 rgb=1,1,1", ("at is", "three numbers")),
        ("insert_knots axis=3 at=0.5", ("axis is 3", "0 ... 2")),
        ("insert_knots axis=1.5 at=0.5", ("axis is 1.5", "a whole number")),
        ("insert_knots axis=0 at=1.5", ("at is 1.5", "0 ... 1")),
        ("refine axis=0 factor=1", ("factor is 1", "2 ... 64")),
        ("remove_knots axis=0", ("tolerance is missing",)),
        ("fit size=12,8,6 max_bytes=16384", ("exclude each other",)),
        ("fit size=12,8", ("size is [12, 8]", "3 whole numbers")),
        ("fit size=3,8,8", ("size is [3, 8, 8]", "at least 4, 4, 4")),
        ("fit knots=random", ("knots is 'random'", "'averaged'")),
        ("fit max_bytes=16e3", ("max_bytes is 16000.0", "a whole number")),
        ("fit max_bytes=0", ("max_bytes is 0", "1 ... 1,073,741,824 bytes")),
        ("store precision=float8", ("precision is 'float8'", "'float16'")),
        ("store precision=float32 step=0.1", ("float32 has no step",)),
        ("store precision=quantised step=0", ("step of 0",)),
    ],
)
def test_a_wrong_line_is_refused_with_its_value_and_the_way_out(line, words):
    message = told(lambda: edit_of_line(line))
    assert all(word in message for word in words), message


def test_a_wrong_line_that_is_long_is_cut():
    assert "..." in told(lambda: edit_of_line("gain factor=2 label=" + "x" * 5000 + " factr=1"))


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: Gain(factor=np.nan),
        lambda: Gain(factor="2"),
        lambda: Gain(factor=True),
        lambda: Tint(rgb=(1, 2, np.inf)),
        lambda: InsertKnots(axis=0, at=()),
        lambda: Refine(axis=1.0),
        lambda: MovePoints(at=(1, 2), rgb=(1, 1, 1)),
        lambda: edit_of({}),
        lambda: edit_of({"op": 3}),
        lambda: edit_of({"op": "gain", "factor": {"value": 2}}),
        lambda: Region(theta_h=(30, 20)),
    ],
)
def test_wrong_edits_are_refused_in_python_too(wrong):
    refusal(wrong)
