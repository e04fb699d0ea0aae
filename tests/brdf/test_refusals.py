"""Whatever a caller hands to the BRDF room is taken, or refused in one line that says what and what to do."""

import numpy as np
import pytest

from bvbedit.brdf.analytic import Coated, CosineLobe, Lafortune, Lambert, Sum
from bvbedit.brdf.charts import HALF_DIFF, IN_OUT, RUSINKIEWICZ, chart_named
from bvbedit.brdf.encodings import Log, Root, encoding_from_dict, encoding_named
from bvbedit.brdf.fit import fit_net
from bvbedit.brdf.geometry import unit_directions
from bvbedit.brdf.materials import material_named
from bvbedit.brdf.measured import MeasuredBrdf
from bvbedit.brdf.metrics import compare
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.spline.tensor import TensorSpline
from tests.spline.refusals import refusal
from tests.spline.test_arguments import each_no_numbers

GREY = Lambert(0.5)
N = [0, 0, 1]


def _table(**changes: object) -> MeasuredBrdf:
    sound = {"values": np.ones((9, 8, 7, 3)), "valid": np.ones((9, 8, 7), bool), "chart": IN_OUT}
    return MeasuredBrdf(**(sound | {"axes": tuple(np.linspace(0, 1, n) for n in (9, 8, 7))} | changes))


def _fit(**changes: object) -> SplineBrdf:
    return fit_net(_table(), **({"chart": IN_OUT, "encoding": Root(), "size": (5, 5, 5)} | changes))


@each_no_numbers
@pytest.mark.parametrize(
    "door",
    [
        lambda wrong: unit_directions(wrong, "wi"),
        lambda wrong: GREY.evaluate(wrong, N),
        lambda wrong: GREY.evaluate(N, wrong),
        lambda wrong: _table(values=wrong),
        lambda wrong: _table(valid=wrong),
        lambda wrong: _table(axes=wrong),
        lambda wrong: _table(axes=(wrong, [0, 1], [0, 1])),
        lambda wrong: _fit(size=wrong),
        lambda wrong: _fit(size=(5, wrong, 5)),
        lambda wrong: _fit(degrees=wrong),
        lambda wrong: _fit(degrees=(3, wrong, 3)),
        lambda wrong: _fit(knots=wrong),
        lambda wrong: compare(GREY, GREY, stride=wrong),
        lambda wrong: Lambert(wrong),
        lambda wrong: Root(wrong),
        lambda wrong: Log(wrong),
        chart_named,
        encoding_named,
        encoding_from_dict,
        material_named,
        lambda wrong: Sum(wrong),
        lambda wrong: Lafortune(wrong),
        lambda wrong: Coated(GREY, wrong),
    ],
)
def test_every_door_refuses_what_it_cannot_use(door, wrong):
    refusal(lambda: door(wrong))


@pytest.mark.parametrize(
    "door",
    [
        lambda: GREY.evaluate(np.ones((2, 3)), np.ones((3, 3))),
        lambda: GREY.evaluate([0, 0, 0], N),
        lambda: GREY.evaluate([0, 1], N),
        lambda: _table(axes=([0, 1], [0, 1], [0, 1])),
        lambda: _table(axes=3),
        lambda: _table(values=np.full((9, 8, 7, 3), np.nan)),
        lambda: _table(valid=np.zeros((9, 8, 7), bool)),
        lambda: _fit(size=5),
        lambda: _fit(size=(5, 5)),
        lambda: _fit(size=(5.5, 5, 5)),
        lambda: _fit(size=(5, 5, 50)),
        lambda: _fit(degrees=3),
        lambda: _fit(chart=RUSINKIEWICZ),
        lambda: SplineBrdf(_fit().spline, RUSINKIEWICZ, Root()),
        lambda: SplineBrdf(TensorSpline((0,), ([0, 1],), [[1.0]]), HALF_DIFF, Root()),
        lambda: encoding_from_dict({"name": "root", "gain": 1}),
        lambda: Root(np.ones((40, 40))),
        lambda: Sum([GREY], [1, 2]),
        lambda: CosineLobe(-1, 1.1, 1e6),
        lambda: chart_named(np.ones((40, 40))),
    ],
)
def test_every_refusal_says_what_and_what_to_do(door):
    refusal(door)


@pytest.mark.parametrize("stride", [0, -9, 2, 7, 4.5, 90])
def test_strides_that_miss_45_degrees_are_refused(stride):
    assert "1, 3, 5, 9, 15, 45" in refusal(lambda: compare(GREY, GREY, stride=stride))
