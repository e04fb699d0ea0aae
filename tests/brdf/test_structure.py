"""Structural edits of a model: the same material over another net, and degenerate faces that stay constant."""

import numpy as np
import pytest

from bvbedit.brdf.analytic import Lambert
from bvbedit.brdf.charts import HALF_DIFF, IN_OUT, grid_points
from bvbedit.brdf.encodings import Root
from bvbedit.brdf.fit import fit_net
from bvbedit.brdf.spline_brdf import SplineBrdf, face_spread, keep_faces
from bvbedit.brdf.structure import elevate, largest_change, reduce, refine, remove, with_faces
from bvbedit.spline.knots import clamped
from bvbedit.spline.tensor import TensorSpline
from tests.brdf.samples import Glossy
from tests.spline.refusals import refusal

CHARTS = pytest.mark.parametrize("chart", [HALF_DIFF, IN_OUT], ids=lambda c: c.name)
EDITS = {
    "refine at": lambda m, axis: refine(m, axis, at=[0.013, 0.4, 0.4, 0.91]),
    "refine by": lambda m, axis: refine(m, axis, factor=3),
    "elevate": lambda m, axis: elevate(m, axis, 2),
    "remove": lambda m, axis: remove(m, axis, 0.3)[0],
    "reduce": lambda m, axis: reduce(m, axis)[0],
}


def _model(chart, rng: np.random.Generator, size=(8, 7, 9)) -> SplineBrdf:
    """A model with random control points, its faces constant: rougher than any fit."""
    knots = [clamped(np.sort(rng.uniform(0, 1, n - 4)), 3) for n in size]
    return SplineBrdf(TensorSpline((3, 3, 3), knots, keep_faces(rng.uniform(0, 2, (*size, 3)), chart)), chart, Root())


@CHARTS
@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("edit", EDITS.values(), ids=EDITS)
def test_degenerate_faces_stay_constant(edit, axis, chart, rng):
    edited = edit(_model(chart, rng), axis)
    assert face_spread(edited.spline.control, chart) == 0
    # What is constant along w in the net is so in the values, exactly the reason for it.
    w = np.linspace(0, 1, 7)
    for face in chart.degenerate_faces:
        x = np.full((7, 3), 0.37)
        x[:, face.axis], x[:, face.along] = 0, w
        assert np.ptp(edited.spline.evaluate(x), axis=0).max() < 1e-14


@CHARTS
@pytest.mark.parametrize("axis", range(3))
def test_refining_and_elevating_leave_the_material_as_it_is(axis, chart, rng):
    model = _model(chart, rng)
    x = rng.uniform(0, 1, (200, 3))
    for edit in ("refine at", "refine by", "elevate"):
        edited = EDITS[edit](model, axis)
        assert edited.spline.size[axis] > model.spline.size[axis]
        np.testing.assert_allclose(edited.spline.evaluate(x), model.spline.evaluate(x), rtol=0, atol=1e-14)
        assert largest_change(model, edited) < 1e-14


@CHARTS
@pytest.mark.parametrize("axis", range(3))
def test_removal_and_reduction_stay_within_the_bound_that_they_tell(axis, chart, rng):
    model = _model(chart, rng)
    x = rng.uniform(0, 1, (5000, 3))
    before = model.spline.evaluate(x)
    for edited, bound in (remove(model, axis, 2.5), reduce(model, axis), reduce(model, axis, 2)):
        assert edited.spline.control.size < model.spline.control.size
        assert np.abs(edited.spline.evaluate(x) - before).max() <= bound
        assert largest_change(model, edited) <= bound * (1 + 1e-12)
    assert remove(model, axis, 2.5)[1] <= 2.5 + 1e-12


@CHARTS
@pytest.mark.parametrize("axis", range(3))
def test_what_was_added_goes_without_loss(axis, chart, rng):
    model = _model(chart, rng)
    back, bound = remove(refine(model, axis, at=[0.21, 0.77]), axis, 1e-9)
    np.testing.assert_allclose(back.spline.control, model.spline.control, rtol=0, atol=1e-13)
    assert bound < 1e-13
    back, bound = reduce(elevate(model, axis, 3), axis, 3, tolerance=1e-9)
    np.testing.assert_allclose(back.spline.control, model.spline.control, rtol=0, atol=1e-13)
    assert bound < 1e-13


def test_faces_that_vary_on_purpose_are_left_alone(rng):
    # The paper's own configuration is fitted without the constraint.
    knots = [clamped([0.5], 3)] * 3
    model = SplineBrdf(TensorSpline((3, 3, 3), knots, rng.uniform(0, 1, (5, 5, 5, 3))), IN_OUT, Root())
    refined = refine(model, 2, factor=2)
    assert face_spread(refined.spline.control, IN_OUT) > 0.1
    assert largest_change(model, refined) < 1e-15


def test_an_edited_model_has_no_report_of_the_unedited_one():
    grey = fit_net(Lambert(0.5), HALF_DIFF, Root(), size=(5, 4, 4))
    assert grey.report
    for edit in EDITS.values():
        assert not edit(grey, 0).report


def test_a_fitted_highlight_is_simplified_within_the_tolerance():
    model = fit_net(Glossy(), HALF_DIFF, Root(), size=(24, 8, 5))
    edited, bound = remove(model, 0, 0.02)
    assert edited.spline.size[0] < 24
    u = grid_points((np.linspace(0, 1, 60), np.linspace(0, 1, 20), np.linspace(0, 1, 8)))
    assert np.abs(edited.spline.evaluate(u) - model.spline.evaluate(u)).max() <= bound <= 0.02


def test_the_largest_change_between_charts_is_looked_up_on_the_grid():
    a = fit_net(Lambert(0.5), HALF_DIFF, Root(), size=(4, 4, 4))
    b = fit_net(Lambert(0.25), IN_OUT, Root(), size=(4, 4, 4))
    expected = np.cbrt(0.5 / np.pi) - np.cbrt(0.25 / np.pi)
    assert largest_change(a, b) == pytest.approx(expected, rel=1e-6)


def test_wrong_edits_are_refused_in_one_line(rng):
    model = _model(HALF_DIFF, rng)
    for call in (
        lambda: refine(model, 3, factor=2),
        lambda: refine(model, 0, at=[0.5, 0.2]),
        lambda: refine(model, 0, at=[1.0]),
        lambda: refine(model, 0, factor=0),
        lambda: remove(model, "u", 0.1),
        lambda: remove(model, 0, -1.0),
        lambda: elevate(model, 0, 14),
        lambda: reduce(model, 0, 4),
        lambda: reduce(model, 1, 1, tolerance=1e-12),
        lambda: with_faces(model.spline.restrict([(0, 0.5)] * 3), model),
    ):
        refusal(call)
