"""Directions are drawn with the density that is told, for every kind of BRDF: chi-square tests, integrals, albedos."""

import functools
from statistics import NormalDist

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bvbedit.brdf.analytic import GGX, BlinnPhong, CookTorrance, CosineLobe, Lafortune, Lambert, Schlick, Ward
from bvbedit.brdf.base import Brdf
from bvbedit.brdf.blend import blend
from bvbedit.brdf.charts import HALF_DIFF, IN_OUT
from bvbedit.brdf.encodings import Log, Root
from bvbedit.brdf.fit import fit_net
from bvbedit.brdf.geometry import spherical
from bvbedit.brdf.materials import MATERIALS, material_named
from bvbedit.brdf.sampling import COSINE_SHARE, HalfVectorDensity, half_vector_density
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.spline.knots import clamped
from bvbedit.spline.tensor import TensorSpline
from tests.brdf.measurements import measured
from tests.brdf.samples import Glossy, random_pairs
from tests.spline.refusals import refusal

SAMPLES = 1 << 17
ELEVATIONS = (0.0, 30.0, 60.0, 80.0, 88.0)
# Bins of sqrt(theta_h) and of the azimuth of h, and places in each by which its probability is computed.
BINS, PLACES = (40, 12), (16, 15)
LAST = 1 - 2**-53
# Directions wi (n, 3), their densities (n,) and weights (n, 3).
Drawn = tuple[np.ndarray, np.ndarray, np.ndarray]
# All tests together fail with this probability where everything is right (Sidak).
ALPHA = 0.01


@functools.cache
def _model(what: str) -> Brdf:
    match what:
        case "black":
            return SplineBrdf(TensorSpline((1, 1, 1), [clamped([], 1)] * 3, np.zeros((2, 2, 2, 3))), IN_OUT, Root())
        case "glossy":
            return Glossy(0.1)
        case "measurement":
            return measured("satin-paint")
        case "half-diff":
            return fit_net(Glossy(0.1), HALF_DIFF, Root(), size=(20, 14, 5))
        case "in-out":
            return fit_net(Glossy(0.4), IN_OUT, Log(), size=(10, 10, 8))
        case "blended":
            other = fit_net(Glossy(0.3), HALF_DIFF, Root(), size=(14, 10, 5))
            return blend(_model("half-diff"), other, 0.4)
        case "sculpted":
            spline = _model("half-diff").spline
            control = np.array(spline.control)
            control[8:12, 2:6] *= [3.0, 0.2, 1.0]
            return SplineBrdf(spline.with_control(control), HALF_DIFF, Root())
        case "lafortune":
            return Lafortune([CosineLobe(-1.0, (0.95, 0.9, 0.9), (200.0, 20.0, 20.0))], diffuse=0.2)
        case "cook-torrance":
            return CookTorrance(0.15, Schlick(0.6), diffuse=0.1)
        case "blinn-phong":
            return BlinnPhong(0.3, 200.0, 0.3)
        case "ward":
            return Ward(0.3, 0.08, 0.3)
        case "ward-1992":
            return Ward(0.3, 0.2, 0.0, "1992")
        case "mirror":
            return GGX(1e-3, Schlick(0.9))
    return material_named(what).brdf


NETS = ("half-diff", "in-out", "blended", "sculpted", "glossy", "measurement", "black")
LOBES = ("blinn-phong", "lafortune", "cook-torrance", "ward", "ward-1992", "mirror")
ALL = (*MATERIALS, *NETS, *LOBES)
# Models with a highlight, that are drawn by a density of their own.
HIGHLIGHTS = ("half-diff", "in-out", "sculpted", "glossy", "measurement")
each_model = pytest.mark.parametrize("what", ALL)


def _view(degrees: float) -> np.ndarray:
    return spherical(np.radians(degrees), 0.7)


@functools.cache
def _places(degrees: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return wi (n, 3) at the places of all bins, whether it is above the horizon, and its solid angle (n,)."""
    counts = [b * p for b, p in zip(BINS, PLACES, strict=True)]
    t, phi = ((np.arange(n) + 0.5) / n for n in counts)
    theta_h = np.pi / 2 * t**2
    h = spherical(theta_h[:, None], 2 * np.pi * phi).reshape(-1, 3)
    solid = np.repeat(np.sin(theta_h) * np.pi * t / counts[0] * 2 * np.pi / counts[1], counts[1])
    along = h @ _view(degrees)
    wi = 2 * along[:, None] * h - _view(degrees)
    above = (along > 0) & (wi[:, 2] > 0)
    return wi, above, np.where(above, 4 * along * solid, 0.0)


def _bins(wi: np.ndarray, degrees: float) -> np.ndarray:
    h = wi + _view(degrees)
    theta = np.arctan2(np.hypot(h[:, 0], h[:, 1]), h[:, 2])
    phi = np.arctan2(h[:, 1], h[:, 0]) % (2 * np.pi)
    i = np.minimum((np.sqrt(theta / (np.pi / 2)) * BINS[0]).astype(int), BINS[0] - 1)
    return i * BINS[1] + np.minimum((phi / (2 * np.pi) * BINS[1]).astype(int), BINS[1] - 1)


def _of_bins(values: np.ndarray) -> np.ndarray:
    return values.reshape(BINS[0], PLACES[0], BINS[1], PLACES[1]).transpose(0, 2, 1, 3).reshape(-1, np.prod(PLACES))


# The draws, and the density at all places, are what takes time: one test for each view asserts all that they tell.
@pytest.mark.parametrize("degrees", ELEVATIONS)
@each_model
def test_directions_are_drawn_as_their_density_and_weights_tell(what, degrees):
    model, wo = _model(what), _view(degrees)
    drawn = model.sample(wo, np.random.default_rng(int(degrees)).random((SAMPLES, 2)))
    places, above, solid = _places(degrees)
    told = np.zeros(len(places))
    told[above] = model.pdf(places[above], wo)
    told *= solid
    _assert_as_often_as_told(drawn, told, degrees)
    _assert_sums_up_to_one(drawn, told)
    _assert_mean_weight_is_albedo(drawn, model, degrees)
    if what in HIGHLIGHTS and degrees in ELEVATIONS[:4]:
        # Weights vary far less than by the cosine: by no more than a quarter of the albedo.
        weight = drawn[2].mean(axis=1)
        assert weight.std() < 0.3 * weight.mean()


def _assert_as_often_as_told(drawn: Drawn, told: np.ndarray, degrees: float) -> None:
    wi, density, _ = drawn
    expected = SAMPLES * _of_bins(told).sum(axis=1)
    kept = density > 0
    found = np.bincount(_bins(wi[kept], degrees), minlength=len(expected)).astype(float)
    # Bins that the horizon cuts, whose probability is known less well, are one bin with all that are hardly met.
    good = _of_bins(_places(degrees)[1]).all(axis=1) & (expected > 20)
    expected = np.append(expected[good], SAMPLES - expected[good].sum())
    found = np.append(found[good], SAMPLES - found[good].sum())
    expected, found = (x[expected > 20] for x in (expected, found))
    chi2, freedom = float(np.sum((found - expected) ** 2 / expected)), max(len(expected) - 1, 1)
    # Wilson & Hilferty (1931): the cube root of chi-square is nearly normal.
    z = ((chi2 / freedom) ** (1 / 3) - (1 - 2 / (9 * freedom))) / np.sqrt(2 / (9 * freedom))
    assert z < NormalDist().inv_cdf((1 - ALPHA) ** (1 / (len(ALL) * len(ELEVATIONS))))


def _assert_sums_up_to_one(drawn: Drawn, told: np.ndarray) -> None:
    """The density, and what is rejected."""
    rejected = float(np.mean(drawn[1] == 0))
    assert told.sum() + rejected == pytest.approx(1.0, abs=3 * np.sqrt(rejected * (1 - rejected) / SAMPLES) + 1e-3)


def _assert_mean_weight_is_albedo(drawn: Drawn, model: Brdf, degrees: float) -> None:
    wi, density, weight = drawn
    wo = _view(degrees)
    places, above, solid = _places(degrees)
    albedo = np.einsum("nc,n->c", model.evaluate(places[above], wo), places[above, 2] * solid[above])
    error = weight.std(axis=0) / np.sqrt(SAMPLES)
    np.testing.assert_array_less(np.abs(weight.mean(axis=0) - albedo), 5 * error + 2e-3 * albedo + 1e-12)
    kept = density > 0
    # What holds at each direction is looked at in a part of them, drawn like all.
    some = np.flatnonzero(kept)[: SAMPLES >> 3]
    np.testing.assert_allclose(model.pdf(wi[some], wo), density[some], rtol=1e-9)
    expected = model.evaluate(wi[some], wo) * (wi[some, 2] / density[some])[:, None]
    # Normalised once more, wi differs in its last digit.
    np.testing.assert_allclose(weight[some], expected, rtol=1e-8)
    np.testing.assert_array_equal(wi[~kept], np.broadcast_to([0.0, 0.0, 1.0], wi[~kept].shape))
    assert not weight[~kept].any()


@pytest.mark.parametrize("what", ["half-diff", "in-out", "measurement", "black"])
def test_the_density_is_a_spline_that_is_never_negative(what):
    density = _model(what).density
    assert isinstance(density, HalfVectorDensity)
    assert density.spline.degrees == (1, 1, 1)
    assert density.spline.control.min() >= 0
    # Over s and phi in [0, pi] it integrates to one, whatever theta_o.
    for theta_o in (0.0, 0.31, 0.77, 1.0):
        s, phi = np.meshgrid(*(np.unique(t) for t in density.spline.knots[1:]), indexing="ij")
        points = np.stack([np.full(s.size, theta_o), s.ravel(), phi.ravel()], axis=-1)
        values = density.spline.evaluate(points).reshape(s.shape)
        inner = np.trapezoid(values, np.pi * phi[0], axis=1)
        assert np.trapezoid(inner, s[:, 0]) == pytest.approx(1.0, rel=1e-9)


def test_an_edited_model_is_sampled_by_its_own_density():
    model = _model("half-diff")
    edited = model.with_spline(model.spline.with_control(model.spline.control * 0.5 + 0.2))
    assert edited.density is not model.density
    assert not np.allclose(edited.density.spline.control, model.density.spline.control)
    assert model.density is model.density


@pytest.mark.parametrize("what", ["half-diff", "mirror", "black", "chrome"])
@pytest.mark.parametrize("degrees", [0.0, 1e-7, 89.9999, 90.0])
@pytest.mark.parametrize(
    "u", [(0.0, 0.0), (1 - 2**-53, 1 - 2**-53), (COSINE_SHARE, 0.5), (0.5, 0.0), (0.5, 1 - 2**-53)]
)
def test_samples_at_the_ends_are_finite(what, degrees, u):
    wi, density, weight = _model(what).sample(spherical(np.radians(degrees), 2.0), u)
    assert np.isfinite([*wi, density, *weight]).all()
    assert np.linalg.norm(wi) == pytest.approx(1.0)
    assert density >= 0
    assert wi[2] >= 0


def test_shapes_are_broadcast():
    model = _model("half-diff")
    wi, density, weight = model.sample(_view(30.0), np.full((4, 5, 2), 0.4))
    assert wi.shape == weight.shape == (4, 5, 3)
    assert density.shape == (4, 5)
    wo = np.stack([_view(d) for d in (0.0, 20.0, 40.0)])
    assert model.sample(wo, (0.3, 0.6))[0].shape == (3, 3)
    assert model.pdf(wi[0], _view(30.0)).shape == (5,)
    single = model.sample(_view(30.0), (0.4, 0.4))
    np.testing.assert_array_equal(single[0], wi[0, 0])


def test_below_the_horizon_nothing_is_drawn():
    model, low = _model("half-diff"), np.array([0.6, 0.0, -0.8])
    wi, density, weight = model.sample(low, (0.3, 0.3))
    np.testing.assert_array_equal(wi, [0.0, 0.0, 1.0])
    assert density == 0
    assert not weight.any()
    assert model.pdf([0.0, 0.0, 1.0], low) == 0
    assert model.pdf(low, [0.0, 0.0, 1.0]) == 0


@given(st.integers(0, 2**32))
def test_the_density_turns_with_the_view(seed):
    rng = np.random.default_rng(seed)
    wi, wo = random_pairs(rng, 20, np.radians(89))
    angle = rng.uniform(0, 2 * np.pi)
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    for what in ("half-diff", "chrome", "lafortune"):
        model = _model(what)
        np.testing.assert_allclose(model.pdf(wi @ turn.T, wo @ turn.T), model.pdf(wi, wo), rtol=1e-6, atol=1e-12)


def test_a_black_material_is_sampled_all_the_same():
    density = half_vector_density(Lambert(0.0))
    wi, pdf = density.sample(np.tile(_view(40.0), (1000, 1)), np.random.default_rng(0).random((1000, 2)))
    assert np.isfinite(wi).all()
    assert (pdf > 0).mean() > 0.3


@pytest.mark.parametrize(
    ("wo", "u"),
    [
        ((0, 0, 1), (0.5, 1.0)),
        ((0, 0, 1), (-0.1, 0.5)),
        ((0, 0, 1), (0.5, np.nan)),
        ((0, 0, 1), 0.5),
        ((0, 0, 1), (0.5, 0.5, 0.5)),
        ((0, 0, 1), "ab"),
        ((0, 0, 0), (0.5, 0.5)),
        ((0, np.nan, 1), (0.5, 0.5)),
        (np.ones((3, 3)), np.full((4, 2), 0.5)),
    ],
)
def test_what_cannot_be_drawn_is_refused(wo, u):
    refusal(lambda: _model("half-diff").sample(wo, u))
