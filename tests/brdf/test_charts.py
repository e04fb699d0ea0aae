"""Charts: there and back, against explicit rotations, and with a Jacobian that is the measure it claims to be."""

import copy
import itertools
import math
import pickle

import numpy as np
import pytest

from bvbedit import BvbError
from bvbedit.brdf.charts import (
    CHARTS,
    FITTING_CHARTS,
    HALF_DIFF,
    IN_OUT,
    RUSINKIEWICZ,
    RUSINKIEWICZ_360,
    Chart,
    chart_named,
    grid_points,
)
from bvbedit.brdf.geometry import spherical, unit_directions
from tests.brdf.samples import random_pairs, turned

ALL = list(CHARTS.values())
FITTING = [CHARTS[name] for name in FITTING_CHARTS]
N = np.array([[0.0, 0.0, 1.0]])
HALF_PI = np.pi / 2

each = pytest.mark.parametrize("chart", ALL, ids=lambda c: c.name)
each_fitting = pytest.mark.parametrize("chart", FITTING, ids=lambda c: c.name)


def _invariants(chart: Chart, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """What a chart must keep of a pair: cos theta_i, cos theta_o and wi.wo, up to the exchange it cannot tell."""
    zi, zo = wi[:, 2], wo[:, 2]
    if chart.reciprocal:
        zi, zo = np.minimum(zi, zo), np.maximum(zi, zo)
    return np.stack([zi, zo, np.einsum("nk,nk->n", wi, wo)], axis=-1)


def _kept(chart: Chart, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """Return the largest change of an invariant of each pair on its way to parameters and back, (n,)."""
    p = chart.to_parameters(wi, wo)
    assert ((p >= 0) & (p <= 1)).all()
    back = chart.to_directions(p)
    for w in back:
        np.testing.assert_allclose(np.linalg.norm(w, axis=1), 1.0, rtol=0, atol=1e-15)
    return np.abs(_invariants(chart, *back) - _invariants(chart, wi, wo)).max(axis=1)


@each
def test_pairs_come_back(chart, rng):
    assert _kept(chart, *random_pairs(rng, 100_000)).max() < 1e-12


def _limits(rng: np.random.Generator) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Pairs at which an angle is undefined, an arc cosine would fail, or a direction touches the horizon."""
    w, _ = random_pairs(rng, 200, np.radians(89.9))
    theta, phi = rng.uniform(0, HALF_PI - 1e-3, 200), rng.uniform(0, 2 * np.pi, 200)
    mirror = np.array([-1.0, -1.0, 1.0])
    level = spherical(HALF_PI, phi)
    level[:, 2] = 0.0
    n = np.repeat(N, 200, axis=0)
    tiny = spherical(10.0 ** rng.uniform(-16, -6, 200), phi)
    return {
        "theta_h = 0": (w, w * mirror),
        "theta_d = 0": (w, w.copy()),
        "both": (n, n.copy()),
        "wi = n": (n, w),
        "wo = n": (w, n),
        "wi = -wo": (level, -level),
        "wi on the horizon": (level, spherical(theta, 3 * phi)),
        "wo on the horizon": (spherical(theta, 3 * phi), level),
        "both at one point of the horizon": (level, level.copy()),
        "nearly n": (tiny, w),
        "nearly n, both": (tiny, turned(tiny, 1.0)),
        "nearly theta_h = 0": (w, unit_directions(w * mirror + 1e-9 * rng.normal(size=w.shape), "w")),
        "nearly theta_d = 0": (w, unit_directions(w + 1e-9 * rng.normal(size=w.shape), "w")),
        "in one plane": (spherical(theta, 0.0), spherical(theta[::-1], np.pi)),
        "in one plane, one side": (spherical(theta, 0.7), spherical(theta[::-1], 0.7)),
        "at right angles": (spherical(theta, 0.0), spherical(theta, HALF_PI)),
    }


@each
def test_pairs_at_every_limit_come_back(chart, rng):
    for name, (wi, wo) in _limits(rng).items():
        assert _kept(chart, wi, wo).max() < 1e-12, name


@each
@pytest.mark.parametrize("exponent", [-16, -14, -13, -12, -11, -10, -8, -6, -4])
def test_pairs_that_both_graze_come_back_as_well_as_float64_can_tell(chart, exponent, rng):
    """Near u = 1 the cosine of theta_h has an absolute precision of 1e-16, and theta_d_max that over the cosine."""
    z = 10.0 ** (exponent + rng.uniform(-0.5, 0.5, (2, 20_000)))
    z[0, :2000] = z[1, :2000]
    z[0, 2000:4000] = 0.0
    phi = rng.uniform(0, 2 * np.pi, (2, 20_000))
    wi, wo = (unit_directions(np.stack([np.cos(p), np.sin(p), c], axis=-1), "w") for p, c in zip(phi, z, strict=True))
    cos_h = z.sum(axis=0) / np.linalg.norm(wi + wo, axis=1)
    # At 1e-12 the horizon angle becomes pi/2: rounding may put a pair and its image on different sides of the step.
    told = np.abs(cos_h - 1e-12) > 1e-14
    assert (_kept(chart, wi, wo) < 1e-11 + 1e-14 / z.max(axis=0))[told].all()


@each_fitting
def test_parameters_come_back_away_from_the_faces(chart, rng):
    p = rng.uniform(0.01, 0.99, (100_000, 3))
    np.testing.assert_allclose(chart.to_parameters(*chart.to_directions(p)), p, rtol=0, atol=1e-10)


@pytest.mark.parametrize("chart", [RUSINKIEWICZ, RUSINKIEWICZ_360], ids=lambda c: c.name)
def test_parameters_of_pairs_above_the_horizon_come_back_from_a_table_chart(chart, rng):
    p = rng.uniform(0.01, 0.99, (100_000, 3))
    wi, wo = chart.to_directions(p)
    above = (wi[:, 2] > 0) & (wo[:, 2] > 0)
    assert 0.3 < above.mean() < 0.9
    np.testing.assert_allclose(chart.to_parameters(wi[above], wo[above]), p[above], rtol=0, atol=1e-10)


def _naive_half_difference(wi: list[float], wo: list[float]) -> tuple[float, float, float]:
    """Rusinkiewicz's definition: d = Ry(-theta_h) Rz(-phi_h) wi, by one rotation after the other."""
    s = [a + b for a, b in zip(wi, wo, strict=True)]
    length = math.sqrt(sum(v * v for v in s))
    h = [v / length for v in s]
    theta_h, phi_h = math.atan2(math.hypot(h[0], h[1]), h[2]), math.atan2(h[1], h[0])
    c, s_ = math.cos(-phi_h), math.sin(-phi_h)
    x, y, z = c * wi[0] - s_ * wi[1], s_ * wi[0] + c * wi[1], wi[2]
    c, s_ = math.cos(-theta_h), math.sin(-theta_h)
    x, z = c * x + s_ * z, -s_ * x + c * z
    return theta_h, math.atan2(math.hypot(x, y), z), math.atan2(y, x)


def test_half_diff_follows_explicit_rotations(rng):
    wi, wo = random_pairs(rng, 3000)
    ours = HALF_DIFF.to_parameters(wi, wo)
    unfolded = RUSINKIEWICZ_360.to_parameters(wi, wo)
    folded = RUSINKIEWICZ.to_parameters(wi, wo)
    for k in range(len(wi)):
        theta_h, theta_d, phi_d = _naive_half_difference(wi[k].tolist(), wo[k].tolist())
        u = math.sqrt(theta_h / HALF_PI)
        furthest = math.atan2(math.cos(theta_h), math.sin(theta_h) * abs(math.cos(phi_d)))
        w = math.acos(abs(math.cos(phi_d))) / HALF_PI if abs(math.cos(phi_d)) < 0.9 else None
        if w is None:
            w = math.asin(abs(math.sin(phi_d))) / HALF_PI
        np.testing.assert_allclose(ours[k], [u, theta_d / furthest, w], rtol=0, atol=1e-11)
        for row, period in ((unfolded[k], 2 * np.pi), (folded[k], np.pi)):
            np.testing.assert_allclose(row[:2], [u, theta_d / HALF_PI], rtol=0, atol=1e-12)
            apart = abs(row[2] - (phi_d % period) / period)
            assert min(apart, 1 - apart) < 1e-11


def test_in_out_follows_its_angles(rng):
    wi, wo = random_pairs(rng, 3000)
    ours = IN_OUT.to_parameters(wi, wo)
    for k in range(len(wi)):
        apart = abs(math.atan2(wi[k, 1], wi[k, 0]) - math.atan2(wo[k, 1], wo[k, 0]))
        apart = min(apart, 2 * math.pi - apart)
        expected = [math.acos(wi[k, 2]) / HALF_PI, math.acos(wo[k, 2]) / HALF_PI, apart / math.pi]
        np.testing.assert_allclose(ours[k], expected, rtol=0, atol=1e-7 if max(wi[k, 2], wo[k, 2]) > 0.999 else 1e-12)


def test_the_meaning_of_phi_d():
    """phi_d = 0 turns wi away from the normal by theta_d; phi_d = pi/2 leaves both equally high."""
    u, v = (a.ravel() for a in np.meshgrid([0.2, 0.5, 0.8], [0.1, 0.5, 0.9]))
    for chart in (HALF_DIFF, RUSINKIEWICZ, RUSINKIEWICZ_360):
        p = np.stack([u, v, 0 * u], axis=-1)
        theta_h, theta_d, phi_d = np.radians(chart.angles(p).T)
        assert (phi_d == 0).all()
        wi, wo = chart.to_directions(p)
        np.testing.assert_allclose(wi[:, 2], np.cos(theta_h + theta_d), rtol=0, atol=1e-15)
        np.testing.assert_allclose(wo[:, 2], np.cos(theta_h - theta_d), rtol=0, atol=1e-15)
        quarter = {"half-diff": 1.0, "rusinkiewicz": 0.5, "rusinkiewicz-360": 0.25}[chart.name]
        wi, wo = chart.to_directions(np.stack([u, v, np.full_like(u, quarter)], axis=-1))
        np.testing.assert_allclose(wi[:, 2], wo[:, 2], rtol=0, atol=1e-15)


def test_the_ends_of_phi_are_the_side_of_the_light_and_the_mirror_side():
    wi, wo = IN_OUT.to_directions(np.array([[0.5, 0.5, 0.0], [0.5, 0.5, 1.0]]))
    np.testing.assert_allclose(wi[0], wo[0], rtol=0, atol=1e-15)
    np.testing.assert_allclose(wi[1], wo[1] * [-1, 1, 1], rtol=0, atol=1e-15)


@each_fitting
def test_the_whole_cube_lies_above_the_horizon(chart, rng):
    p = np.concatenate([rng.uniform(size=(50_000, 3)), grid_points(tuple(np.linspace(0, 1, 21) for _ in range(3)))])
    wi, wo = chart.to_directions(p)
    assert wi[:, 2].min() >= 0
    assert wo[:, 2].min() >= 0
    for w in (wi, wo):
        np.testing.assert_allclose(np.linalg.norm(w, axis=1), 1.0, rtol=0, atol=1e-15)


def test_the_face_v_1_of_half_diff_is_the_horizon(rng):
    p = rng.uniform(size=(10_000, 3))
    p[:, 1] = 1.0
    wi, wo = HALF_DIFF.to_directions(p)
    np.testing.assert_allclose(np.minimum(wi[:, 2], wo[:, 2]), 0.0, rtol=0, atol=1e-15)
    # Next to wi = -wo (u = 0, w = 1) and to u = 1 the half vector has no digits left.
    inside = (p[:, 0] > 0.01) & (p[:, 0] < 0.99) & (p[:, 2] < 0.99)
    np.testing.assert_allclose(HALF_DIFF.to_parameters(wi, wo)[inside, 1], 1.0, rtol=0, atol=1e-12)


@pytest.mark.parametrize("between", [0.0, 0.5, 2.0, 3.0])
def test_two_directions_in_the_surface_have_the_angle_between_them_as_parameter(between):
    """Where h lies in the surface too, theta_d_max is pi/2 and not the quotient of two roundings."""
    wi, wo = (np.array([[np.cos(a), np.sin(a), 0.0]]) for a in (0.0, between))
    np.testing.assert_allclose(HALF_DIFF.to_parameters(wi, wo)[0, :2], [1.0, between / np.pi], rtol=0, atol=1e-15)


@each
def test_angles_are_the_angles_of_the_directions(chart, rng):
    p = rng.uniform(0.05, 0.95, (2000, 3))
    degrees = chart.angles(p)
    for k, (i, o) in enumerate(zip(*chart.to_directions(p), strict=True)):
        if chart is IN_OUT:
            phi = abs(math.atan2(o[1], o[0]) - math.atan2(i[1], i[0]))
            expected = [math.acos(i[2]), math.acos(o[2]), phi]
        else:
            expected = list(_naive_half_difference(i.tolist(), o.tolist()))
            expected[2] %= 2 * math.pi
        np.testing.assert_allclose(degrees[k], np.degrees(expected), rtol=0, atol=1e-8)


def test_exchanged_and_mirrored_pairs_have_the_same_half_diff_parameters_to_the_bit(rng):
    wi, wo = random_pairs(rng, 20_000)
    p = HALF_DIFF.to_parameters(wi, wo)
    np.testing.assert_array_equal(HALF_DIFF.to_parameters(wo, wi), p)
    mirror = np.array([1.0, -1.0, 1.0])
    np.testing.assert_array_equal(HALF_DIFF.to_parameters(wi * mirror, wo * mirror), p)


@each
def test_a_common_rotation_and_the_mirror_image_change_no_parameter(chart, rng):
    wi, wo = random_pairs(rng, 20_000)
    off = (np.minimum(*(np.hypot(w[:, 0], w[:, 1]) for w in (wi, wo))) > 0.05) & (np.abs(wi - wo).max(axis=1) > 0.01)
    off &= np.hypot(*(wi + wo)[:, :2].T) > 0.01
    wi, wo = wi[off], wo[off]
    p = chart.to_parameters(wi, wo)
    angle = rng.uniform(0, 2 * np.pi, len(wi))
    mirror = np.array([1.0, -1.0, 1.0])
    for i, o, folds in (
        (turned(wi, angle), turned(wo, angle), True),
        (wi * mirror, wo * mirror, chart in FITTING),
        (wo, wi, chart.reciprocal),
    ):
        apart = np.abs(chart.to_parameters(i, o) - p)
        if chart.periodic[2]:
            apart[:, 2] = np.minimum(apart[:, 2], 1 - apart[:, 2])
        assert (apart.max() < 1e-11) == folds


@each
@pytest.mark.parametrize("angle", [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
def test_normal_incidence_and_retro_reflection_know_no_azimuth(chart, angle):
    """Where the azimuth means nothing it is 0, or a table would show a seam that turns with the surface."""
    w = spherical([0.6], angle)
    assert chart.to_parameters(w, w)[0, 2] == 0.0
    if chart is IN_OUT:
        assert chart.to_parameters(N, w)[0, 2] == chart.to_parameters(w, N)[0, 2] == 0.0


def _cube_integral(chart: Chart, nodes: int, *, above_only: bool = False) -> float:
    x, w = np.polynomial.legendre.leggauss(nodes)
    x, w = 0.5 * (x + 1), 0.5 * w
    p = grid_points((x, x, x))
    weights = np.prod(grid_points((w, w, w)), axis=1)
    jacobian = chart.jacobian(p)
    if above_only:
        wi, wo = chart.to_directions(p)
        jacobian = jacobian * ((wi[:, 2] > 0) & (wo[:, 2] > 0))
    return float(weights @ jacobian)


@each_fitting
def test_the_jacobian_integrates_to_all_pairs_of_hemispheres(chart):
    assert _cube_integral(chart, 64) == pytest.approx((2 * np.pi) ** 2, rel=1e-5 if chart is HALF_DIFF else 1e-12)


@pytest.mark.parametrize("chart", [RUSINKIEWICZ, RUSINKIEWICZ_360], ids=lambda c: c.name)
def test_the_jacobian_of_a_table_chart_integrates_to_them_above_the_horizon(chart):
    """A step inside the cube: quadrature converges like 1/nodes only. Over the whole cube h covers a hemisphere."""
    assert _cube_integral(chart, 100, above_only=True) == pytest.approx((2 * np.pi) ** 2, rel=2e-3)
    whole = 4 * (2 * np.pi) ** 2 * 0.5  # 4 x (solid angle of h) x (integral of cos theta_d d omega_d = pi)
    assert _cube_integral(chart, 32) == pytest.approx(whole, rel=1e-12)


@each
def test_the_jacobian_is_the_area_that_a_small_cube_covers(chart, rng):
    """The map from (u, v, w, common azimuth) to the product of two spheres, differentiated numerically."""
    p = rng.uniform(0.1, 0.9, (500, 3))
    h = 1e-5
    tangents = []
    for axis in range(3):
        step = np.zeros(3)
        step[axis] = h
        ahead, behind = (np.concatenate(chart.to_directions(p + s), axis=1) for s in (step, -step))
        tangents.append((ahead - behind) / (2 * h))
    wi, wo = chart.to_directions(p)
    tangents.append(np.concatenate([np.cross(N, wi), np.cross(N, wo)], axis=1))
    t = np.stack(tangents, axis=1)
    area = np.sqrt(np.linalg.det(t @ t.transpose(0, 2, 1)))
    copies = {"in-out": 2, "half-diff": 4, "rusinkiewicz": 2, "rusinkiewicz-360": 1}[chart.name]
    np.testing.assert_allclose(chart.jacobian(p), area * copies * 2 * np.pi, rtol=1e-7)


@each
def test_as_many_random_pairs_fall_into_a_box_as_its_jacobian_says(chart, rng):
    p = chart.to_parameters(*random_pairs(rng, 400_000))
    counts = np.histogramdd(p, bins=4, range=[(0, 1)] * 3)[0]
    x, w = np.polynomial.legendre.leggauss(16)
    inner, weights = 0.5 * (x + 1), 0.5 * w
    axis = np.concatenate([(i + inner) / 4 for i in range(4)])
    q = grid_points((axis, axis, axis))
    density = chart.jacobian(q)
    if chart not in FITTING:
        wi, wo = chart.to_directions(q)
        density = density * ((wi[:, 2] > 0) & (wo[:, 2] > 0))
    boxes = density.reshape(4, 16, 4, 16, 4, 16)
    expected = np.einsum("aibjck,i,j,k->abc", boxes, weights, weights, weights) / 64 / (2 * np.pi) ** 2 * 400_000
    # Five standard deviations of a Poisson count, and a little for the quadrature across the horizon.
    assert (np.abs(counts - expected) < 5 * np.sqrt(expected) + 0.01 * expected + 3).all()


@each
def test_degenerate_faces_are_one_pair_each(chart, rng):
    """All parameters ``along`` give the same pair but for a common rotation (and the exchange of a folded chart)."""
    for face in chart.degenerate_faces:
        p = np.repeat(rng.uniform(0.05, 0.6, (50, 1, 3)), 7, axis=1)
        p[..., face.axis] = 0.0
        p[..., face.along] = np.linspace(0, 1, 7)
        kept = _invariants(chart, *chart.to_directions(p.reshape(-1, 3))).reshape(50, 7, 3)
        assert np.ptp(kept, axis=1).max() < 1e-15


@each
def test_grids_are_increasing_nodes_of_the_cube(chart):
    for axis in chart.grid:
        assert axis[0] == 0
        assert axis[-1] <= 1
        assert (np.diff(axis) > 0).all()
    assert sorted(chart.hold_order) == [0, 1, 2]


def test_the_grid_of_in_out_is_the_papers():
    assert [len(a) for a in IN_OUT.grid] == [91, 91, 361]
    corners = IN_OUT.angles(np.array([[a[1] for a in IN_OUT.grid], [1, 1, 1]]))
    np.testing.assert_allclose(corners, [[1.0, 1.0, 0.5], [90, 90, 180]], rtol=0, atol=1e-13)


@each
def test_charts_are_found_by_name(chart):
    assert chart_named(chart.name) is chart
    assert chart.name in repr(chart)


@each
def test_a_chart_is_itself_in_another_process_and_in_a_copy(chart):
    assert pickle.loads(pickle.dumps(chart)) is chart
    assert copy.deepcopy(chart) is chart


@pytest.mark.parametrize("name", ["half", "", None, ["in-out"]])
def test_unknown_charts_list_the_known_ones(name):
    with pytest.raises(BvbError, match="in-out, half-diff, rusinkiewicz"):
        chart_named(name)


def test_grid_points_run_fastest_along_the_last_axis():
    axes = ([0.0, 0.5], [0.1], [0.2, 0.3, 0.4])
    np.testing.assert_array_equal(grid_points(axes), list(itertools.product(*axes)))
