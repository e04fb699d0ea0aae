"""Whatever a caller hands to the BRDF room is taken, or refused in one line that says what and what to do."""

import numpy as np
import pytest

import bvbedit
from bvbedit.brdf.analytic import Coated, CosineLobe, Lafortune, Lambert, Sum
from bvbedit.brdf.charts import HALF_DIFF, IN_OUT, RUSINKIEWICZ, chart_named
from bvbedit.brdf.encodings import Linear, Log, Root, encoding_from_dict, encoding_named
from bvbedit.brdf.fit import fit_net, fit_over
from bvbedit.brdf.geometry import unit_directions
from bvbedit.brdf.goniophotometer import measure
from bvbedit.brdf.losses import loss_named
from bvbedit.brdf.materials import material_named
from bvbedit.brdf.measured import MeasuredBrdf
from bvbedit.brdf.metrics import compare
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.brdf.storage import Storage
from bvbedit.spline.tensor import TensorSpline
from tests.spline.refusals import refusal
from tests.spline.test_arguments import each_no_numbers

GREY = Lambert(0.5)
N = [0, 0, 1]
KNOTS = [0, 0, 0, 0, 1, 1, 1, 1]
SPLINE = TensorSpline((3, 3, 3), [KNOTS] * 3, np.ones((4, 4, 4, 3)))


def _table(**changes: object) -> MeasuredBrdf:
    sound = {"values": np.ones((9, 8, 7, 3)), "valid": np.ones((9, 8, 7), bool), "chart": IN_OUT}
    return MeasuredBrdf(**(sound | {"axes": tuple(np.linspace(0, 1, n) for n in (9, 8, 7))} | changes))


def _fit(**changes: object) -> SplineBrdf:
    return fit_net(**({"brdf": _table(), "chart": IN_OUT, "encoding": Root(), "size": (5, 5, 5)} | changes))


def _fit_over(**changes: object) -> SplineBrdf:
    sound = {"brdf": _table(), "chart": IN_OUT, "encoding": Root(), "knots": [KNOTS] * 3, "degrees": (3, 3, 3)}
    return fit_over(**(sound | changes))


def _api(**changes: object) -> SplineBrdf:
    return bvbedit.fit(**({"brdf": _table()} | changes))


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
        lambda wrong: _fit(knots=wrong, encoding=Linear()),
        lambda wrong: _fit(brdf=wrong),
        lambda wrong: _fit(chart=wrong),
        lambda wrong: _fit(encoding=wrong),
        lambda wrong: _fit(metric=wrong),
        lambda wrong: _fit(metric=wrong, encoding=Linear(), knots="piegl-tiller"),
        lambda wrong: _fit(weights=lambda _points: wrong),
        lambda wrong: _fit_over(knots=wrong),
        lambda wrong: _fit_over(knots=[wrong, KNOTS, KNOTS]),
        lambda wrong: _fit_over(degrees=wrong),
        lambda wrong: _fit_over(brdf=wrong),
        lambda wrong: _fit_over(metric=wrong),
        lambda wrong: _api(brdf=wrong),
        lambda wrong: _api(chart=wrong),
        lambda wrong: _api(encoding=wrong),
        lambda wrong: _api(size=(5, 5, wrong)),
        lambda wrong: _api(degrees=(3, 3, wrong)),
        lambda wrong: _api(knots=wrong),
        lambda wrong: _api(max_bytes=(wrong,)),
        lambda wrong: _api(max_payload=(wrong,)),
        lambda wrong: _api(tolerance=(wrong,)),
        lambda wrong: _api(metric=wrong),
        lambda wrong: _api(weights=(wrong,)),
        lambda wrong: _api(precision=wrong),
        lambda wrong: _api(thorough=wrong),
        lambda wrong: _api(smoothing=(wrong,)),
        lambda wrong: _api(source=(wrong,)),
        lambda wrong: SplineBrdf(SPLINE, wrong, Root()),
        lambda wrong: SplineBrdf(SPLINE, IN_OUT, wrong),
        lambda wrong: SplineBrdf(SPLINE, IN_OUT, Root(), storage=wrong),
        loss_named,
        Storage,
        lambda wrong: Storage("quantised", wrong),
        lambda wrong: compare(wrong, GREY),
        lambda wrong: compare(GREY, wrong),
        lambda wrong: measure(wrong),
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
        lambda: _fit(size=(5, 5, 0)),
        lambda: _fit(size=(5, 5, 10**400)),
        lambda: _fit(size=(1 << 21, 1 << 21, 1 << 21)),
        lambda: _fit(size=(5, 5, 50), encoding=Linear(), knots="piegl-tiller"),
        lambda: _fit(size=(3, 5, 5)),
        lambda: _fit(degrees=(3, 3)),
        lambda: _fit(chart=RUSINKIEWICZ),
        lambda: _fit(metric="psnr"),
        lambda: _fit(weights=1.0),
        lambda: _fit(weights=lambda points: points),
        lambda: _fit(weights=lambda points: np.full(len(points), np.nan)),
        lambda: _fit(weights=lambda points: np.full(len(points), -1.0)),
        lambda: _fit(weights=lambda points: np.zeros(len(points))),
        lambda: _fit_over(knots=[KNOTS] * 2),
        lambda: _fit_over(degrees=(3, 3)),
        lambda: _fit_over(knots=[[0, 0.5, 1]] * 3),
        lambda: _fit_over(degrees=(0, 0, 0), knots=[np.linspace(0, 1, 11)] * 3),
        lambda: _api(size=(5, 5, 5), max_bytes=9999),
        lambda: _api(max_bytes=2, tolerance=0.1),
        lambda: _api(max_bytes=10**400),
        lambda: _api(max_bytes=0),
        lambda: _api(max_payload=True),
        lambda: _api(max_payload=2.5),
        lambda: _api(tolerance=0),
        lambda: _api(tolerance=np.nan),
        lambda: _api(tolerance=-1),
        lambda: _api(weights=lambda points: points),
        lambda: _api(smoothing=-1),
        lambda: _api(smoothing=np.inf),
        lambda: _api(smoothing="much"),
        lambda: _api(precision="int8"),
        lambda: _api(thorough=1),
        lambda: _api(source=7),
        lambda: _api(chart="rusinkiewicz"),
        lambda: _api(chart=np.ones(3)),
        lambda: _api(encoding=np.ones(3)),
        lambda: _api(precision=np.ones(3)),
        lambda: loss_named("psnr"),
        lambda: Storage("int8"),
        lambda: Storage("float16", 0.1),
        lambda: Storage("quantised"),
        lambda: Storage("quantised", 0.0),
        lambda: Storage("quantised", np.nan),
        lambda: SplineBrdf(SPLINE, RUSINKIEWICZ, Root()),
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
