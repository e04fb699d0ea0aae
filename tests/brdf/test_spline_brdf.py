"""SplineBrdf: chart, encoding and spline in a row; degenerate faces; what is refused."""

import json

import numpy as np
import pytest

from bvbedit import BvbError
from bvbedit.brdf.charts import HALF_DIFF, IN_OUT, RUSINKIEWICZ, Chart
from bvbedit.brdf.encodings import Encoding, Linear, Log, Root
from bvbedit.brdf.spline_brdf import SplineBrdf, face_spread, keep_faces
from bvbedit.brdf.storage import Storage
from bvbedit.spline.knots import clamped
from bvbedit.spline.tensor import TensorSpline
from tests.brdf.samples import random_pairs

SIZE = (7, 6, 5)


def _spline(rng: np.random.Generator, degrees: tuple[int, ...] = (3, 3, 3), channels: int = 3) -> TensorSpline:
    knots = [clamped(np.linspace(0, 1, n - p + 1)[1:-1], p) for n, p in zip(SIZE, degrees, strict=True)]
    return TensorSpline(degrees, knots, rng.normal(0.2, 0.6, (*SIZE, channels)))


@pytest.mark.parametrize("encoding", [Linear(), Root(), Root(2.0), Log(), Log(0.1)], ids=repr)
@pytest.mark.parametrize("chart", [IN_OUT, HALF_DIFF], ids=lambda c: c.name)
@pytest.mark.parametrize("degrees", [(3, 3, 3), (2, 0, 4)])
def test_a_model_is_the_decoded_spline_at_the_charts_parameters(
    degrees: tuple[int, ...], chart: Chart, encoding: Encoding, rng
):
    model = SplineBrdf(_spline(rng, degrees), chart, encoding)
    wi, wo = random_pairs(rng, 500)
    f, trusted = model.evaluate_trusted(wi, wo)
    expected = encoding.decode(model.spline.evaluate(chart.to_parameters(wi, wo)))
    np.testing.assert_allclose(f, expected, rtol=1e-12, atol=1e-15)
    assert (f >= 0).all()
    assert (f == 0).any()  # negative values of the spline
    assert trusted.all()


def test_half_diff_models_are_reciprocal_for_every_pair(rng):
    model = SplineBrdf(_spline(rng), HALF_DIFF, Root())
    assert model.reciprocal
    wi, wo = random_pairs(rng, 100_000)
    np.testing.assert_allclose(model.evaluate(wi, wo), model.evaluate(wo, wi), rtol=1e-13, atol=1e-15)
    in_out = SplineBrdf(_spline(rng), IN_OUT, Root())
    assert not in_out.reciprocal
    assert not np.allclose(in_out.evaluate(wi, wo), in_out.evaluate(wo, wi))


def test_what_is_no_brdf_is_refused(rng):
    good = _spline(rng)
    for bad in (
        _spline(rng, channels=1),
        TensorSpline((3, 3), good.knots[:2], good.control[:, :, 0]),
        TensorSpline((3, 3, 3), (good.knots[0] * 2, *good.knots[1:]), good.control),
        TensorSpline((3, 3, 3), (good.knots[0] - 0.5, *good.knots[1:]), good.control),
    ):
        with pytest.raises(BvbError, match="is no BRDF"):
            SplineBrdf(bad, IN_OUT, Linear())


def test_a_model_is_stored_in_one_way_however_it_is_edited(rng):
    model = SplineBrdf(_spline(rng), HALF_DIFF, Root(), {"metrics": {}})
    assert model.storage == Storage("float32")
    coarse = model.stored_as(Storage("quantised", 0.01))
    assert (model.storage, coarse.storage) == (Storage(), Storage("quantised", 0.01))
    assert coarse.spline is model.spline
    assert (coarse.chart, coarse.encoding, dict(coarse.report)) == (model.chart, model.encoding, dict(model.report))
    assert coarse.told(source="a").storage == coarse.storage
    assert coarse.with_spline(coarse.spline.elevate(0)).storage == coarse.storage
    with pytest.raises(BvbError, match="'float16' is no way to store a net"):
        model.stored_as("float16")  # type: ignore[arg-type]


def test_an_edited_model_has_no_report_and_the_first_keeps_its_own(rng):
    given = {"metrics": {"grid": 0.1}}
    model = SplineBrdf(_spline(rng), HALF_DIFF, Log(0.5), given)
    given["metrics"] = {}
    assert json.dumps(dict(model.report)) == '{"metrics": {"grid": 0.1}}'
    with pytest.raises(TypeError):
        model.report["seconds"] = 3  # type: ignore[index]
    edited = model.with_spline(model.spline.with_control(model.spline.control * 2))
    assert (edited.chart, edited.encoding) == (HALF_DIFF, Log(0.5))
    assert dict(edited.report) == {}
    assert "metrics" in model.report
    assert repr(model) == "<SplineBrdf half-diff, log, size (7, 6, 5)>"


@pytest.mark.parametrize("chart", [IN_OUT, HALF_DIFF, RUSINKIEWICZ], ids=lambda c: c.name)
@pytest.mark.parametrize("size", [(4, 4, 4), (2, 3, 1), (1, 1, 4), (1, 2, 3)])
def test_keeping_faces_is_the_orthogonal_projection_on_nets_that_are_constant_there(chart, size, rng):
    count = int(np.prod(size))
    p = np.stack([keep_faces(e.reshape(*size, 1), chart).ravel() for e in np.eye(count)])
    np.testing.assert_allclose(p, p.T, rtol=0, atol=1e-15)
    np.testing.assert_allclose(p @ p, p, rtol=0, atol=1e-15)
    net = keep_faces(rng.normal(size=(*size, 3)), chart)
    for face in chart.degenerate_faces:
        layers = np.moveaxis(net, (face.axis, face.along), (0, 1))[: face.layers]
        np.testing.assert_allclose(layers, np.broadcast_to(layers[:1, :1], layers.shape), rtol=0, atol=1e-15)
    # Nothing is given up that need not be: the rank is the number of values that may differ.
    free = np.ones(size, dtype=bool)
    groups = 0
    if chart is IN_OUT:
        free[0] = free[:, 0] = False
        groups = size[0] + size[1] - 1
    else:
        free[:2] = free[:, 0] = False
        groups = max(size[0] - 2, 0) + size[1]
    assert np.linalg.matrix_rank(p) == free.sum() + groups


def test_keeping_faces_leaves_its_argument_alone_and_the_spread_tells_how_far(rng):
    net = keep_faces(rng.normal(size=(5, 5, 5, 3)), HALF_DIFF)
    assert face_spread(net, HALF_DIFF) < 1e-15
    bent = net.copy()
    bent[0, 3, 2, 1] += 1.0
    kept = bent.copy()
    assert face_spread(bent, HALF_DIFF) == pytest.approx(1.0)
    moved = keep_faces(bent, HALF_DIFF)[:2, 3, :, 1] - net[:2, 3, :, 1]
    np.testing.assert_allclose(moved, 0.1, rtol=0, atol=1e-15)  # one of ten equal values: the mean moves by a tenth
    np.testing.assert_array_equal(bent, kept)


@pytest.mark.parametrize("chart", [IN_OUT, HALF_DIFF], ids=lambda c: c.name)
def test_a_kept_face_makes_the_model_single_valued_there(chart, rng):
    spline = _spline(rng)
    model = SplineBrdf(spline.with_control(keep_faces(spline.control, chart)), chart, Linear())
    for face in chart.degenerate_faces:
        p = np.repeat(rng.uniform(size=(20, 1, 3)), 9, axis=1)
        p[..., face.axis] = 0.0
        p[..., face.along] = np.linspace(0, 1, 9)
        y = model.spline.evaluate(p)
        np.testing.assert_allclose(y, y[:, :1].repeat(9, axis=1), rtol=0, atol=1e-14)
        if face.layers == 2:
            slope = model.spline.evaluate(p, derivatives=tuple(int(a == face.axis) for a in range(3)))
            np.testing.assert_allclose(slope, 0, rtol=0, atol=1e-13)
