"""The analytic models against scalar formulas, closed-form values, identities and extremes."""

import cmath
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bvbedit.brdf.analytic import (
    GGX,
    Analytic,
    BlinnPhong,
    Coated,
    CookTorrance,
    CosineLobe,
    ExactFresnel,
    Lafortune,
    Lambert,
    Schlick,
    Sum,
    Ward,
)
from bvbedit.brdf.geometry import spherical
from tests.spline.refusals import refusal

N = np.array([0.0, 0.0, 1.0])
WHITE = Schlick(1.0)
VARNISH = ExactFresnel(1.5)
METAL = ExactFresnel((0.2, 1.0, 3.0), (3.6, 2.5, 0.0))

MODELS: dict[str, Analytic] = {
    "lambert": Lambert((0.2, 0.5, 1.0)),
    "lafortune": Lafortune([CosineLobe(-1, (0.9, 1, 1.1), (20, 5, 30)), CosineLobe(0.8, 0.5, 3)], diffuse=0.1),
    "blinn-phong": BlinnPhong((0.9, 0.5, 0.1), 30.0, diffuse=0.1),
    "narrowest-blinn-phong": BlinnPhong(1.0, 2e8),
    "ward": Ward((0.9, 0.5, 0.1), 0.2, diffuse=0.1),
    "ward-1992": Ward((0.9, 0.5, 0.1), 0.2, diffuse=0.1, normalisation="1992"),
    "cook-torrance": CookTorrance(0.3, METAL, specular=0.8, diffuse=(0.1, 0.2, 0.3)),
    "ggx": GGX(0.3, METAL),
    "ggx-rough": GGX(2.0, Schlick((0.1, 0.5, 1.0))),
    "mirror-ggx": GGX(1e-3, METAL),
    "narrowest-ggx": GGX(1e-4, WHITE),
    "narrowest-cook-torrance": CookTorrance(1e-4, METAL),
    "narrowest-ward": Ward(1.0, 1e-4),
    "sum": Sum([GGX(0.5, VARNISH), Lambert(0.5)], [(0.1, 0.2, 0.3), 0.7]),
    "coated": Coated(Sum([Lambert(0.3), Ward(0.5, 0.2)]), GGX(0.05, VARNISH), cover=0.8, bend=1.5),
}
each_model = pytest.mark.parametrize("model", MODELS.values(), ids=MODELS.keys())


def pairs(n: int, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Directions all over the hemisphere; every second wo lies near the mirror direction of its wi."""
    rng = np.random.default_rng(seed)
    wi = spherical(np.arccos(rng.random(n)), 2 * np.pi * rng.random(n))
    wo = spherical(np.arccos(rng.random(n)), 2 * np.pi * rng.random(n))
    wo[::2] = wi[::2] * (-1, -1, 1) + rng.normal(scale=0.05, size=(len(wo[::2]), 3))
    wo[:, 2] = np.abs(wo[:, 2])
    return wi, wo / np.linalg.norm(wo, axis=1, keepdims=True)


# --- albedo by quadrature over h: d wi = 4 (wo.h) d h, theta_h in equal steps of its logarithm


def albedo(model: Analytic, theta_o: float, narrowest: float = 1e-5, rings: int = 400, spokes: int = 96) -> np.ndarray:
    edges = np.exp(np.linspace(math.log(narrowest), math.log(math.pi / 2), rings + 1))
    theta_h, width = np.sqrt(edges[1:] * edges[:-1]), np.diff(edges)
    phi_h = 2 * np.pi * (np.arange(spokes) + 0.5) / spokes
    wo = spherical(theta_o, 0.0)
    h = spherical(theta_h[:, None], phi_h)
    cos_d = h @ wo
    wi = 2 * cos_d[..., None] * h - wo
    seen = (cos_d > 0) & (wi[..., 2] > 0)
    solid_angle = 4 * cos_d * (np.sin(theta_h) * width)[:, None] * (2 * np.pi / spokes)
    return np.einsum("rsc,rs->c", model.evaluate(wi, wo), np.where(seen, wi[..., 2] * solid_angle, 0))


# --- the naive oracle: one pair, one channel, plain math


def oracle_fresnel(cos_d: float, eta: float, k: float) -> float:
    n = complex(eta, k)
    cos_t = cmath.sqrt(1 - (1 - cos_d**2) / n**2)
    rs = (cos_d - n * cos_t) / (cos_d + n * cos_t)
    rp = (n * cos_d - cos_t) / (n * cos_d + cos_t)
    return (abs(rs) ** 2 + abs(rp) ** 2) / 2


def oracle_schlick(cos_d: float, f0: float) -> float:
    return f0 + (1 - f0) * (1 - cos_d) ** 5


def oracle_angles(wi, wo):
    h = [a + b for a, b in zip(wi, wo, strict=True)]
    length = math.sqrt(sum(a * a for a in h))
    h = [a / length for a in h]
    return wi[2], wo[2], h[2], sum(a * b for a, b in zip(wo, h, strict=True))


def oracle_ggx(wi, wo, alpha, F):
    ci, co, ch, cd = oracle_angles(wi, wo)
    tan_h = math.sqrt(1 - ch * ch) / ch
    D = alpha**2 / (math.pi * ch**4 * (alpha**2 + tan_h**2) ** 2)
    smith = [(-1 + math.sqrt(1 + alpha**2 * (1 / c**2 - 1))) / 2 for c in (ci, co)]
    return F(cd) * D / (1 + sum(smith)) / (4 * ci * co)


def oracle_cook_torrance(wi, wo, m, F):
    ci, co, ch, cd = oracle_angles(wi, wo)
    D = math.exp(-(1 / ch**2 - 1) / m**2) / (math.pi * m**2 * ch**4)
    return F(cd) * D * min(1, 2 * ch * co / cd, 2 * ch * ci / cd) / (4 * ci * co)


def oracle_ward(wi, wo, alpha, normalisation):
    ci, co, ch, _ = oracle_angles(wi, wo)
    gauss = math.exp(-(1 / ch**2 - 1) / alpha**2) / (math.pi * alpha**2)
    if normalisation == "1992":
        return gauss / (4 * math.sqrt(ci * co))
    return gauss * 2 * (1 + sum(a * b for a, b in zip(wi, wo, strict=True))) / (ci + co) ** 4


def oracle_lobe(wi, wo, c_xy, c_z, n):
    return max(0.0, c_xy * (wi[0] * wo[0] + wi[1] * wo[1]) + c_z * wi[2] * wo[2]) ** n


def oracle_blinn(wi, wo, n):
    c = (n + 2) * (n + 4) / (8 * math.pi * (2 ** (-n / 2) + n))
    return c * oracle_angles(wi, wo)[2] ** n


ORACLES = {
    "blinn-phong": lambda wi, wo, c: 0.1 / math.pi + (0.9, 0.5, 0.1)[c] * oracle_blinn(wi, wo, 30.0),
    "lafortune": lambda wi, wo, c: (
        0.1 / math.pi + oracle_lobe(wi, wo, -1, (0.9, 1, 1.1)[c], (20, 5, 30)[c]) + oracle_lobe(wi, wo, 0.8, 0.5, 3)
    ),
    "ward": lambda wi, wo, c: 0.1 / math.pi + (0.9, 0.5, 0.1)[c] * oracle_ward(wi, wo, 0.2, "bounded"),
    "ward-1992": lambda wi, wo, c: 0.1 / math.pi + (0.9, 0.5, 0.1)[c] * oracle_ward(wi, wo, 0.2, "1992"),
    "cook-torrance": lambda wi, wo, c: (
        (0.1, 0.2, 0.3)[c] / math.pi
        + 0.8 * oracle_cook_torrance(wi, wo, 0.3, lambda u: oracle_fresnel(u, (0.2, 1.0, 3.0)[c], (3.6, 2.5, 0.0)[c]))
    ),
    "ggx": lambda wi, wo, c: oracle_ggx(
        wi, wo, 0.3, lambda u: oracle_fresnel(u, (0.2, 1.0, 3.0)[c], (3.6, 2.5, 0.0)[c])
    ),
    "ggx-rough": lambda wi, wo, c: oracle_ggx(wi, wo, 2.0, lambda u: oracle_schlick(u, (0.1, 0.5, 1.0)[c])),
    "coated": lambda wi, wo, _: oracle_coated(wi, wo),
}


def oracle_coated(wi, wo):
    inside = [(w[0] / 1.5, w[1] / 1.5, math.sqrt(1 - (w[0] ** 2 + w[1] ** 2) / 1.5**2)) for w in (wi, wo)]
    base = 0.3 / math.pi + 0.5 * oracle_ward(*inside, 0.2, "bounded")
    passed = math.prod(1 - 0.8 * oracle_fresnel(w[2], 1.5, 0) for w in (wi, wo))
    return 0.8 * oracle_ggx(wi, wo, 0.05, lambda u: oracle_fresnel(u, 1.5, 0)) + passed * base / 1.5**2


@pytest.mark.parametrize("name", ORACLES)
def test_agrees_with_the_scalar_formula(name):
    wi, wo = pairs(300)
    expected = [[ORACLES[name](i, o, c) for c in range(3)] for i, o in zip(wi.tolist(), wo.tolist(), strict=True)]
    # Below 1e-12 the oracle's own 1 - cos^2 has lost the tail of the Gaussian.
    np.testing.assert_allclose(MODELS[name].evaluate(wi, wo), expected, rtol=1e-9, atol=1e-12)


# --- what every model must do


@each_model
def test_reciprocal_to_the_last_bit_and_not_negative(model):
    wi, wo = pairs(2000)
    f = model.evaluate(wi, wo)
    assert model.reciprocal
    np.testing.assert_array_equal(f, model.evaluate(wo, wi))
    assert np.isfinite(f).all()
    assert f.min() >= 0


ANGLE = st.one_of(st.floats(0, math.pi / 2), st.sampled_from([0.0, 1e-300, 1e-8, math.pi / 2 - 1e-8, math.pi / 2]))
AZIMUTH = st.one_of(st.floats(-math.pi, math.pi), st.sampled_from([0.0, math.pi, math.pi - 1e-9]))


@given(theta_i=ANGLE, theta_o=ANGLE, phi=AZIMUTH, turn=AZIMUTH)
@settings(deadline=None, derandomize=True, max_examples=60)
def test_reciprocal_isotropic_mirror_symmetric_anywhere(theta_i, theta_o, phi, turn):
    wi, wo = spherical(theta_i, turn), spherical(theta_o, turn + phi)
    straight_i, straight_o = spherical(theta_i, 0.0), spherical(theta_o, phi)
    for name, model in MODELS.items():
        f = model.evaluate(straight_i, straight_o)
        assert np.isfinite(f).all(), name
        assert (f >= 0).all(), name
        np.testing.assert_array_equal(f, model.evaluate(straight_o, straight_i), err_msg=name)
        np.testing.assert_array_equal(f, model.evaluate(straight_i * (1, -1, 1), straight_o * (1, -1, 1)), err_msg=name)
        # Turned, the sum of two opposite directions is rounding, which only lobes wider than that may ignore.
        if "narrow" not in name and "mirror" not in name:
            np.testing.assert_allclose(model.evaluate(wi, wo), f, rtol=1e-4, atol=1e-9, err_msg=name)


def extreme_directions() -> np.ndarray:
    heights = [0.0, 1e-300, 1e-17, 1e-9, 1e-4, 0.3, 1.0]
    return np.array([(s * x, s * y, z) for z in heights for x, y in [(1, 0), (0, 1), (0.6, -0.8)] for s in (1, -1)])


@each_model
def test_finite_at_every_extreme(model):
    w = extreme_directions()
    with np.errstate(over="raise", invalid="raise", divide="raise"):
        f = model.evaluate(w[:, None], w[None, :])
    assert np.isfinite(f).all()
    assert f.min() >= 0
    for opposite in ((1.0, 0.0, 0.0), (0.6, 0.8, 0.0)):
        assert np.isfinite(model.evaluate(opposite, np.negative(opposite))).all()


@each_model
def test_shapes_broadcast(model):
    wi, wo = pairs(12)
    f = model.evaluate(wi.reshape(3, 4, 3), wo[0])
    assert f.shape == (3, 4, 3)
    np.testing.assert_allclose(f.reshape(-1, 3), model.evaluate(wi, wo[0]), rtol=1e-13)
    assert model.evaluate(N, N).shape == (3,)
    assert model.evaluate(np.empty((0, 3)), N).shape == (0, 3)


# --- known values


def test_lambert_is_its_albedo_over_pi():
    wi, wo = pairs(10)
    np.testing.assert_array_equal(Lambert((0.2, 0.5, 1.0)).evaluate(wi, wo), np.tile([0.2, 0.5, 1], (10, 1)) / np.pi)


@pytest.mark.parametrize("alpha", [1e-4, 1e-3, 0.1, 0.7, 2.0])
def test_normal_incidence_is_f0_over_four_pi_alpha_squared(alpha):
    f0 = np.array([0.1, 0.5, 1.0])
    for model in (GGX(alpha, Schlick(f0)), CookTorrance(alpha, Schlick(f0)), Ward(f0, alpha)):
        np.testing.assert_allclose(model.evaluate(N, N), f0 / (4 * np.pi * alpha**2), rtol=1e-14)


@pytest.mark.parametrize("alpha", [1e-4, 1e-2, 0.3, 0.7])
def test_narrow_lobes_keep_their_digits(alpha):
    # Half-vector one alpha off the normal, seen from wi = n: GGX's D has fallen to a quarter (and cos^-4 theta_h).
    theta_h = math.atan(alpha)
    c, co = math.cos(theta_h), math.cos(2 * theta_h)
    D = 1 / (math.pi * alpha**2 * c**4 * 4)
    G = 2 / (1 + math.sqrt(1 + alpha**2 * math.tan(2 * theta_h) ** 2))
    f = GGX(alpha, WHITE).evaluate(N, spherical(2 * theta_h, 0.4))
    np.testing.assert_allclose(f, D * G / (4 * co), rtol=1e-10)


@pytest.mark.parametrize(("alpha", "kind"), [(a, k) for a in (0.02, 0.3, 1.0, 2.0) for k in ("ggx", "beckmann")])
def test_distribution_of_normals_is_normalised(alpha, kind):
    # D is read off f at wi = wo = h, where G is known in closed form; then the integral of D cos over h must be 1.
    t, weight = np.polynomial.legendre.leggauss(400)
    theta = np.pi / 4 * (t + 1)
    # theta = atan(alpha x): even nodes for every alpha.
    theta_h = np.arctan(alpha * np.tan(theta))
    c = np.cos(theta_h)
    jacobian = alpha / np.cos(theta) ** 2 * c**2 * np.pi / 4
    h = spherical(theta_h, 0.0)
    if kind == "ggx":
        G, model = 1 / np.sqrt(1 + alpha**2 * np.tan(theta_h) ** 2), GGX(alpha, WHITE)
    else:
        G, model = np.minimum(1, 2 * c**2), CookTorrance(alpha, WHITE)
    D = model.evaluate(h, h)[:, 0] * 4 * c**2 / G
    assert np.sum(weight * jacobian * 2 * np.pi * np.sin(theta_h) * c * D) == pytest.approx(1, abs=2e-5)


@pytest.mark.parametrize("theta", [0.0, 0.5, 1.0, 1.4])
@pytest.mark.parametrize("n", [1, 8, 500])
def test_lafortune_lobe_is_phongs_around_the_mirror_direction(theta, n):
    model = Lafortune([CosineLobe(-1, 1, n)])
    wi, mirror = spherical(theta, 0.3), spherical(theta, 0.3 + np.pi)
    np.testing.assert_allclose(model.evaluate(wi, mirror), 1, rtol=1e-12)
    wo = spherical(0.7, 2.0)
    np.testing.assert_allclose(model.evaluate(wi, wo), max(0, mirror @ wo) ** n, rtol=1e-11, atol=1e-300)


def test_lafortune_lobe_grows_towards_grazing_and_back_to_the_light():
    wi = spherical(np.linspace(0, 1.5, 9), 0.0)
    forward = Lafortune([CosineLobe(-1, 0.9, 40)]).evaluate(wi, wi * (-1, -1, 1))[:, 0]
    assert (np.diff(forward) > 0).all()
    back = Lafortune([CosineLobe(1, 0.5, 10)])
    assert (back.evaluate(wi[5], wi[5]) > 5 * back.evaluate(wi[5], wi[5] * (-1, -1, 1))).all()


# --- energy


@pytest.mark.parametrize("theta", np.radians([0, 30, 60, 80, 88]))
@pytest.mark.parametrize("alpha", [1e-3, 0.05, 0.3, 1.0])
def test_no_model_gives_back_more_than_it_gets(alpha, theta):
    phong = BlinnPhong(1.0, 2 / alpha**2)
    for model in (GGX(alpha, WHITE), CookTorrance(alpha, WHITE), Ward(1.0, alpha), Ward(1.0, alpha, 0, "1992"), phong):
        # 5e-3: the horizon cuts through cells of the quadrature.
        assert albedo(model, theta).max() <= 1 + 5e-3, model


@pytest.mark.parametrize("theta", np.radians([0, 30, 60, 75]))
def test_smooth_lossless_surfaces_give_back_everything(theta):
    for model in (GGX(0.003, WHITE), CookTorrance(0.01, WHITE), Ward(1.0, 0.01)):
        np.testing.assert_allclose(albedo(model, theta), 1, atol=4e-3)


@pytest.mark.parametrize("n", [0.01, 1.0, 20.0, 1e4, 2e8])
def test_blinn_phongs_albedo_is_its_specular_at_normal_incidence(n):
    np.testing.assert_allclose(albedo(BlinnPhong(0.8, n), 0.0, narrowest=0.01 / math.sqrt(n + 1)), 0.8, rtol=3e-3)


@pytest.mark.parametrize("theta", np.radians([0, 40, 70]))
def test_a_smooth_lobe_of_1992s_ward_loses_the_cosine(theta):
    np.testing.assert_allclose(albedo(Ward(0.8, 0.01, normalisation="1992"), theta), 0.8 * np.cos(theta), rtol=5e-3)


@pytest.mark.parametrize("theta", np.radians([0, 45, 70, 85]))
def test_coats_lose_light_and_bending_alone_does_not(theta):
    white = Lambert(1.0)
    assert albedo(Coated(white, GGX(0.02, VARNISH)), theta).max() <= 1
    # So narrow that even at 85 degrees, where bending widens it 13 times, none of it falls below the horizon.
    mirror = CookTorrance(3e-4, WHITE)
    bent = Coated(mirror, GGX(0.1, VARNISH), cover=0, bend=1.5)
    np.testing.assert_allclose(albedo(bent, theta), 1, atol=4e-3)
    # A diffuse base loses what it sends beyond the escape cone: sin^2 of the critical angle is left.
    left = albedo(Coated(white, GGX(0.1, VARNISH), cover=0, bend=1.5), theta)
    np.testing.assert_allclose(left, 1 / 1.5**2, rtol=3e-3)


# --- Fresnel terms


@given(cos_d=st.floats(1e-6, 1), eta=st.floats(0.05, 20), k=st.one_of(st.just(0.0), st.floats(1e-3, 20)))
@settings(deadline=None, derandomize=True)
def test_exact_fresnel_is_the_complex_formula(cos_d, eta, k):
    F = ExactFresnel(eta, k)(np.array([cos_d]))[0]
    np.testing.assert_allclose(F, oracle_fresnel(cos_d, eta, k), rtol=1e-9, atol=1e-9)


def test_fresnel_limits():
    ends = np.array([1.0, 0.0])
    normal = ((1.4 - 1) ** 2 + 7.6**2) / ((1.4 + 1) ** 2 + 7.6**2)
    np.testing.assert_allclose(ExactFresnel(1.4, 7.6)(ends), [[normal] * 3, [1] * 3], rtol=1e-7)
    np.testing.assert_allclose(VARNISH(ends), [[0.04] * 3, [1] * 3], rtol=1e-7)
    np.testing.assert_array_equal(ExactFresnel(1.0)(np.array([1.0, 0.5, 1e-3])), 0)
    np.testing.assert_allclose(Schlick((0, 0.3, 1))(ends), [[0, 0.3, 1], [1, 1, 1]])
    # Brewster's angle: only one polarisation is left, with reflectance ((n^2 - 1)/(n^2 + 1))^2.
    brewster = math.cos(math.atan(1.5))
    np.testing.assert_allclose(VARNISH(np.array([brewster])), 0.5 * ((1.5**2 - 1) / (1.5**2 + 1)) ** 2, rtol=1e-12)
    # From inside glass, beyond the critical angle, everything is reflected.
    np.testing.assert_allclose(ExactFresnel(1 / 1.5)(np.array([0.5])), 1, rtol=1e-12)


# --- composition


def test_sum_adds_weighted_parts():
    wi, wo = pairs(50)
    a, b = MODELS["ggx"], MODELS["ward"]
    both = Sum([a, b], [(0.5, 0, 2), 0.25]).evaluate(wi, wo)
    np.testing.assert_allclose(both, a.evaluate(wi, wo) * (0.5, 0, 2) + 0.25 * b.evaluate(wi, wo), rtol=1e-13)
    np.testing.assert_allclose(Sum([a, b]).evaluate(wi, wo), a.evaluate(wi, wo) + b.evaluate(wi, wo), rtol=1e-13)


def test_no_cover_is_the_base_and_a_coat_over_black_is_the_coat():
    wi, wo = pairs(50)
    base, coat = MODELS["ward"], GGX(0.05, VARNISH)
    np.testing.assert_allclose(Coated(base, coat, cover=0).evaluate(wi, wo), base.evaluate(wi, wo), rtol=1e-13)
    np.testing.assert_allclose(Coated(Lambert(0), coat).evaluate(wi, wo), coat.evaluate(wi, wo), rtol=1e-13)


def test_models_are_values():
    assert GGX(0.3, Schlick(0.5)) == GGX(0.3, Schlick((0.5, 0.5, 0.5)))
    assert len({Lambert(0.5), Lambert([0.5] * 3), Lambert(np.full(3, 0.5)), Lambert(0.4)}) == 2
    assert Sum([Lambert(0.5)]) == Sum((Lambert(0.5),), [1])
    with pytest.raises(AttributeError):
        Lambert(0.5).albedo = 0.1  # type: ignore[misc]


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: Lambert(1.5), "Lambert: albedo is 1.5"),
        (lambda: Lambert((0.1, 0.2)), "albedo"),
        (lambda: Lambert("red"), "albedo"),
        (lambda: Lambert("101"), "albedo"),
        (lambda: Lambert(True), "albedo"),
        (lambda: Lambert(10**400), "albedo"),
        (lambda: Lambert(np.ones((40, 40))), "albedo"),
        (lambda: Lambert(None), "albedo"),
        (lambda: Lambert((0.1, math.nan, 0.2)), "nan"),
        (lambda: GGX(0.0, WHITE), "alpha is 0.0. Give a number from 0.0001 to 2"),
        (lambda: GGX(math.nan, WHITE), "alpha"),
        (lambda: GGX("0.1", WHITE), "alpha"),
        (lambda: GGX(10**400, WHITE), "alpha"),
        (lambda: GGX(0.1, 0.5), "fresnel"),
        (lambda: CookTorrance(3.0, WHITE), "m is 3.0"),
        (lambda: CookTorrance(0.3, WHITE, diffuse=-0.1), "diffuse is -0.1"),
        (lambda: CookTorrance(0.3, None), "fresnel"),
        (lambda: Ward(0.5, math.inf), "alpha is inf"),
        (lambda: Ward(0.5, 0.1, 0, "duer"), "bounded, 1992"),
        (lambda: Ward(0.5, 0.1, 0, ["1992"]), "bounded, 1992"),
        (lambda: BlinnPhong(0.5, 0), "n is 0"),
        (lambda: BlinnPhong(1.5, 10), "specular is 1.5"),
        (lambda: BlinnPhong(0.5, 10, -1), "diffuse is -1"),
        (lambda: Schlick(-0.1), "f0"),
        (lambda: ExactFresnel(0.0), "eta"),
        (lambda: ExactFresnel(1.5, -1), "k is -1"),
        (lambda: Lafortune([]), "lobes"),
        (lambda: Lafortune(CosineLobe(-1, 1, 2)), "lobes"),
        (lambda: Lafortune([CosineLobe(-1, 1, 2)], diffuse=2), "diffuse"),
        (lambda: CosineLobe(-1, 1, 0), "n is 0"),
        (lambda: CosineLobe(-1, 1.1, 1e6), "1.1 to the power 1e"),
        (lambda: Sum([]), "Sum"),
        (lambda: Sum(Lambert(0.5)), "Sum"),
        (lambda: Sum([Lambert(0.5)], [1, 2]), "2 weights for 1 parts"),
        (lambda: Sum([Lambert(0.5)], 1.0), "weights"),
        (lambda: Sum([Lambert(0.5)], [-1]), "weights[0] is -1"),
        (lambda: Coated(0.5, GGX(0.1, WHITE)), "Coated"),
        (lambda: Coated(Lambert(0.5), Lambert(0.5)), "coat"),
        (lambda: Coated(Lambert(0.5), GGX(0.1, WHITE), cover=1.1), "cover is 1.1"),
        (lambda: Coated(Lambert(0.5), GGX(0.1, WHITE), bend=0.5), "bend is 0.5"),
    ],
)
def test_wrong_parameters_are_named(build, words):
    assert words in refusal(build)
