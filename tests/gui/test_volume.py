"""The volume's surfaces lie where the model has their value; axes are labelled by angles."""

import numpy as np
import pytest

from bvbedit.brdf.analytic import Lambert
from bvbedit.brdf.charts import HALF_DIFF, IN_OUT
from bvbedit.brdf.encodings import Log
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.spline.knots import clamped, greville
from bvbedit.spline.tensor import TensorSpline
from bvbedit_gui import volume


def ramp() -> SplineBrdf:
    """Return a grey model whose encoded value rises linearly along u: its surfaces are planes."""
    knots = [clamped([0.3, 0.6], 3)] * 3
    rise = np.log1p(np.array([100.0]) / 1e-3) * greville(knots[0], 3)
    control = np.broadcast_to(rise[:, None, None, None], (6, 6, 6, 3))
    return SplineBrdf(TensorSpline((3, 3, 3), knots, control), IN_OUT, Log(1e-3))


def test_surfaces_lie_where_the_model_has_their_value():
    model = ramp()
    shown = volume.field(model, model.chart)
    for value in (0.1, 1.0, 10.0):
        surface = volume.iso_surfaces(shown, volume.grid(shown), [value])
        assert surface.n_points > 100
        u = np.asarray(surface.points)[:, 0]
        expected = np.log1p(value / 1e-3) / np.log1p(100 / 1e-3)
        np.testing.assert_allclose(u, expected, atol=2e-4)
        np.testing.assert_allclose(surface.point_data[volume.LEVEL], np.log10(value), atol=1e-6)
    assert volume.iso_surfaces(shown, volume.grid(shown), []).n_points == 0


def test_the_field_has_what_is_shown_of_the_model():
    model = ramp()
    axes = volume.box_nodes(model)
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)[::997]
    rgb = model.encoding.decode(model.spline.evaluate(points))
    for what, expected in (("luminance", volume.luminance(rgb)), ("red", rgb[:, 0]), ("blue", rgb[:, 2])):
        values = volume.field(model, model.chart, what).values.ravel()[::997]
        np.testing.assert_allclose(values, expected, rtol=1e-9)
    np.testing.assert_allclose(volume.luminance(np.ones((4, 3))), 1.0)


def test_a_material_without_a_net_is_shown_on_any_chart():
    albedo = np.array([0.8, 0.4, 0.2])
    for chart in (IN_OUT, HALF_DIFF):
        shown = volume.field(Lambert(tuple(albedo)), chart)
        # On the horizon itself, where rounding decides, there may be nothing.
        inside = shown.values[:-1, :-1]
        np.testing.assert_allclose(inside, volume.luminance(albedo) / np.pi, rtol=1e-9)


def test_a_difference_has_a_sign_and_surfaces_of_both():
    model, flat = ramp(), Lambert((0.5, 0.5, 0.5))
    shown = volume.field(model, model.chart, "difference", flat)
    assert shown.signed
    surface = volume.iso_surfaces(shown, volume.grid(shown), [0.1])
    u = np.asarray(surface.points)[:, 0]
    levels = np.asarray(surface.point_data[volume.LEVEL])
    for sign in (-1, 1):
        value = 0.5 / np.pi + sign * 0.1
        expected = np.log1p(value / 1e-3) / np.log1p(100 / 1e-3)
        np.testing.assert_allclose(u[np.sign(levels) == sign], expected, atol=2e-3)
    np.testing.assert_allclose(np.abs(levels), shown.level(0.1), rtol=1e-6)


def test_slices_and_knot_planes_lie_where_they_should():
    model = ramp()
    for axis in range(3):
        mesh = volume.slice_mesh(volume.slice_at(model, model.chart, axis, 0.25))
        points = np.asarray(mesh.points)
        np.testing.assert_allclose(points[:, axis], 0.25)
        rgb = model.encoding.decode(model.spline.evaluate(np.clip(points, 0, 1)))
        expected = np.log10(np.maximum(volume.luminance(rgb), volume.FLOOR))
        np.testing.assert_allclose(mesh.point_data[volume.LEVEL], expected, atol=1e-4)
        planes = volume.knot_planes(model, axis)
        np.testing.assert_allclose(np.unique(np.asarray(planes.points)[:, axis]), [0.3, 0.6], atol=1e-6)
        assert planes.n_lines == 2
    assert volume.knot_planes(SplineBrdf(bezier(), IN_OUT, Log(1e-3)), 0).n_points == 0


def bezier() -> TensorSpline:
    return TensorSpline((1, 1, 1), [clamped([], 1)] * 3, np.ones((2, 2, 2, 3)))


def test_control_points_stand_at_their_greville_abscissae():
    model = ramp()
    net = volume.control_net(model)
    assert net.n_points == 6 * 6 * 6
    np.testing.assert_allclose(np.unique(np.asarray(net.points)[:, 0]), model.spline.greville[0], atol=1e-6)
    # A linear ramp is its own control net.
    np.testing.assert_allclose(
        np.log1p(10 ** np.asarray(net.point_data[volume.LEVEL]) / 1e-3)[:-1].max(), np.log1p(100 / 1e-3), rtol=1e-6
    )


@pytest.mark.parametrize(("low", "high"), [(1e-3, 1e4), (0.2, 30.0), (1.0, 2.0), (1.0, 1.001), (1e-300, 1e300)])
def test_iso_values_are_few_and_inside(low, high):
    values = volume.iso_values(low, high)
    assert 3 <= len(values) <= volume.MOST_SURFACES
    assert values == sorted(set(values))
    assert low < values[0]
    assert values[-1] < high


def test_a_constant_model_has_no_surface():
    assert volume.iso_values(0.5, 0.5) == []
    assert volume.iso_values(0.0, 0.0) == []


def test_axes_are_labelled_in_degrees():
    u, v, w = volume.axes(HALF_DIFF)
    assert u.labels == ("0°", "10°", "40°", "90°")  # theta_h goes with the square of the parameter
    assert v.labels == ("0 %", "33 %", "67 %", "100 %")
    assert w.labels == ("0°", "30°", "60°", "90°")
    assert [a.labels[-1] for a in volume.axes(IN_OUT)] == ["90°", "90°", "180°"]
