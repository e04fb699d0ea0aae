"""Fits of analytic models: they find what made a material, the same each time, and fail in words."""

import gc
import math
import pickle

import nlopt
import numpy as np
import pytest

from bvbedit.brdf import analytic_fit
from bvbedit.brdf.analytic import (
    GGX,
    Analytic,
    BlinnPhong,
    CookTorrance,
    CosineLobe,
    Lafortune,
    Lambert,
    Schlick,
    Sum,
    Ward,
)
from bvbedit.brdf.analytic_fit import MODELS, fit_analytic
from bvbedit.brdf.analytic_objective import Objective
from bvbedit.brdf.base import Brdf
from bvbedit.brdf.charts import RUSINKIEWICZ
from bvbedit.brdf.geometry import spherical
from bvbedit.brdf.losses import LOSSES
from bvbedit.brdf.measured import MeasuredBrdf
from bvbedit.brdf.metrics import estimate
from tests.brdf.samples import Glossy
from tests.spline.refusals import refusal


@pytest.fixture(autouse=True)
def few_pairs(monkeypatch):
    """Materials without noise are told by few pairs of directions, which takes a tenth of the time."""
    monkeypatch.setattr(analytic_fit, "FEW", 800)
    monkeypatch.setattr(analytic_fit, "MANY", 3000)


each_model = pytest.mark.parametrize("name", MODELS)

BODY = (0.4, 0.2, 0.05)
COLOURS = ((0.3, 0.25, 0.2), (0.06, 0.1, 0.12))


def lobe(kind: str, width: float, specular, diffuse=0.0) -> Analytic:
    """One lobe about as wide as slopes of ``width``, over a diffuse part."""
    match kind:
        case "blinn-phong":
            return BlinnPhong(specular, 2 / width**2, diffuse)
        case "ward":
            return Ward(specular, width, diffuse)
        case "cook-torrance":
            return CookTorrance(width, Schlick(0.3), specular, diffuse)
        case "ggx":
            return Sum([Lambert(diffuse), GGX(width, Schlick(0.3))], [1.0, specular])
    n = max(0.5 / width**2, 2)
    c_z = tuple((s * (n + 2) / (2 * math.pi)) ** (1 / n) for s in specular)
    return Lafortune([CosineLobe(tuple(-(1.7 ** (1 / n)) * c for c in c_z), c_z, n)], diffuse)


def expected(kind: str, width: float, suffix: str = "") -> dict[str, float]:
    n = max(0.5 / width**2, 2)
    shapes = {
        "blinn-phong": {"n": 2 / width**2},
        "ward": {"alpha": width},
        "cook-torrance": {"m": width, "f0": 0.3},
        "ggx": {"alpha": width, "f0": 0.3},
        "lafortune": {"n": n, "ratio": -(1.7 ** (1 / n))},
    }
    return {f"{name}{suffix}": value for name, value in shapes[kind].items()}


def rgb(name: str, colour) -> dict[str, float]:
    return {f"{name}_{c}": v for c, v in zip("rgb", colour, strict=True)}


@pytest.mark.parametrize("width", [0.01, 0.1, 0.45])
@pytest.mark.parametrize("kind", [name for name in MODELS if not name.endswith("2")])
def test_parameters_of_one_lobe_are_found(kind, width):
    found = fit_analytic(lobe(kind, width, COLOURS[0], BODY), kind, starts=3)
    truth = rgb("diffuse", BODY) | rgb("specular", COLOURS[0]) | expected(kind, width)
    assert dict(found.parameters) == pytest.approx(truth, rel=1e-5)
    assert found.error < 1e-7
    assert found.agreed >= 1


@pytest.mark.parametrize("widths", [(0.02, 0.2), (0.08, 0.4)])
@pytest.mark.parametrize("kind", [name for name in MODELS if not name.endswith("2")])
def test_parameters_of_two_lobes_are_found_the_narrow_one_first(kind, widths):
    # The broad lobe comes first in the sum.
    truth = Sum([lobe(kind, widths[1], COLOURS[1]), lobe(kind, widths[0], COLOURS[0], BODY)])
    found = fit_analytic(truth, f"{kind} 2", starts=6)
    told = rgb("diffuse", BODY)
    for n, (width, colour) in enumerate(zip(widths, COLOURS, strict=True), start=1):
        told |= rgb(f"specular_{n}", colour) | expected(kind, width, f"_{n}")
    assert dict(found.parameters) == pytest.approx(told, rel=1e-4)
    assert found.error < 1e-7


def test_a_lobe_back_to_the_light_is_found():
    truth = Lafortune([CosineLobe(-1.0, 1.0, 30.0), CosineLobe(0.6, 0.6, 5.0)], BODY)
    found = fit_analytic(truth, "lafortune 2")
    assert sorted([found.parameters["ratio_1"], found.parameters["ratio_2"]]) == pytest.approx([-1, 1], abs=1e-3)
    assert found.error < 1e-4


@each_model
def test_the_model_is_what_its_numbers_say(name):
    # Neither the parameters nor the error are made elsewhere than the model.
    found = fit_analytic(Glossy(0.2), name, starts=2)
    assert found.name == name
    assert found.parameter_count == len(found.parameters) == MODELS[name].parameter_count
    told = estimate(found.model, Glossy(0.2))
    assert found.errors == pytest.approx((told.grid.log_cosine_rms, told.nodes.log_cosine_rms), rel=0.1)
    assert found.error == pytest.approx(math.sqrt(math.prod(found.errors)))
    wo = spherical(0.6, 0.3)
    wi, density, weight = found.model.sample(wo, np.random.default_rng(1).random((4000, 2)))
    kept = density > 0
    np.testing.assert_allclose(density[kept], found.model.pdf(wi[kept], wo), rtol=1e-6)
    np.testing.assert_allclose(
        weight[kept] * density[kept, None], found.model.evaluate(wi[kept], wo) * wi[kept, 2:], rtol=1e-9
    )


def test_two_lobes_are_no_worse_than_one():
    for name in ("ward", "ggx"):
        one, two = (fit_analytic(Glossy(0.2), n, starts=4).error for n in (name, f"{name} 2"))
        assert two <= 1.001 * one


@pytest.mark.parametrize("name", ["ward", "lafortune 2"])
def test_the_same_seed_gives_the_same_model(name):
    a, b = (fit_analytic(Glossy(0.2), name, seed=5, starts=3) for _ in range(2))
    assert a == b == pickle.loads(pickle.dumps(a))
    other = fit_analytic(Glossy(0.2), name, seed=6, starts=3)
    assert other != a
    assert other.error == pytest.approx(a.error, rel=0.05)


@each_model
def test_black_and_grey_need_no_lobe(name):
    black = fit_analytic(Lambert(0.0), name, starts=2)
    assert black.error < 1e-6
    wi, wo = spherical(0.4, 0.0), spherical(0.5, 2.0)
    assert black.model.evaluate(wi, wo) == pytest.approx(0, abs=1e-5)
    grey = fit_analytic(Lambert((0.5, 0.3, 0.1)), name, starts=2)
    assert grey.error < 2e-4
    assert grey.model.evaluate(wi, wo) == pytest.approx(np.array([0.5, 0.3, 0.1]) / np.pi, rel=3e-3)


@each_model
def test_no_light_is_made(name):
    # The material itself gives back at most 0.95; parts bounded one by one might add up to more.
    bright = Sum([Lambert(0.6), GGX(0.15, Schlick(0.3))], [1.0, (0.35, 0.3, 0.3)])
    model = fit_analytic(bright, name, starts=3).model
    u = np.random.default_rng(2).random((20_000, 2))
    for theta in np.radians([0, 40, 75]):
        assert model.sample(spherical(theta, 0.0), u)[2].mean(axis=0).max() < 1.02


@pytest.mark.parametrize("metric", LOSSES)
def test_each_metric_is_followed(metric):
    found = fit_analytic(Ward(0.2, 0.15, 0.3), "ward", metric=metric, starts=3)
    assert dict(found.parameters) == pytest.approx(
        rgb("diffuse", [0.3] * 3) | rgb("specular", [0.2] * 3) | {"alpha": 0.15}, rel=0.01
    )


def test_pairs_without_data_have_no_weight():
    # What stands beyond theta_d = 60 degrees was not measured, and would be a wall of light.
    axes = tuple(u[::2] for u in RUSINKIEWICZ.grid)
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    wi, wo = RUSINKIEWICZ.to_directions(points)
    truth = Ward(0.2, 0.3, 0.3)
    values = np.where((np.minimum(wi[:, 2], wo[:, 2]) > 1e-6)[:, None], truth.evaluate(wi, wo), 1e4)
    valid = (np.minimum(wi[:, 2], wo[:, 2]) > 1e-6) & (points[:, 1] < 2 / 3)
    shape = tuple(len(u) for u in axes)
    table = MeasuredBrdf(values.reshape(*shape, 3), valid.reshape(shape), axes, RUSINKIEWICZ)
    found = fit_analytic(table, "ward", starts=3)
    assert found.parameters["alpha"] == pytest.approx(0.3, rel=0.02)
    assert found.parameters["diffuse_g"] == pytest.approx(0.3, rel=0.02)


def test_progress_reaches_one():
    told: list[float] = []
    fit_analytic(Lambert(0.5), "ward", starts=3, progress=told.append)
    assert told == sorted(told)
    assert told[-1] == 1.0


# --- what goes wrong


class _Broken(Brdf):
    """A BRDF of nan, or one with no data behind any of it."""

    def __init__(self, value: float, trusted: bool) -> None:
        self.value, self.trusted = value, trusted

    def _evaluate(self, wi, _wo):
        return np.full((len(wi), 3), self.value), np.full(len(wi), self.trusted)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"name": "phong"}, "blinn-phong, ward, lafortune"),
        ({"name": None}, "Unknown model None"),
        ({"name": "ggx 3"}, "ggx 2"),
        ({"brdf": 0.5}, "not a Brdf"),
        ({"seed": -1}, "seed is -1"),
        ({"seed": 0.5}, "seed"),
        ({"starts": 0}, "starts is 0"),
        ({"starts": True}, "starts"),
        ({"metric": "psnr"}, "Unknown metric 'psnr'"),
        ({"brdf": _Broken(0.5, False)}, "No data"),
        ({"brdf": _Broken(math.nan, True)}, "cannot follow"),
    ],
)
def test_mistakes_are_told_in_one_line(options, words):
    given = {"brdf": Lambert(0.5), "name": "ward", "starts": 2} | options
    brdf, name = given.pop("brdf"), given.pop("name")
    assert words in refusal(lambda: fit_analytic(brdf, name, **given))


def test_a_search_that_nlopt_ends_by_an_exception_keeps_its_best(monkeypatch):
    class Failing(nlopt.opt):
        def optimize(self, x):
            super().optimize(x)
            raise nlopt.RoundoffLimited("nlopt roundoff-limited")

    monkeypatch.setattr(nlopt, "opt", Failing)
    assert fit_analytic(Ward(0.2, 0.15, 0.3), "ward", starts=2).error < 1e-4


def test_values_that_are_no_numbers_are_refused_and_the_rest_searched(monkeypatch):
    whole = analytic_fit.Objective.__call__
    calls = 0

    def sometimes(self, x, slopes):
        nonlocal calls
        calls += 1
        return math.nan if calls % 7 == 3 else whole(self, x, slopes)

    monkeypatch.setattr(analytic_fit.Objective, "__call__", sometimes)
    assert fit_analytic(Ward(0.2, 0.15, 0.3), "ward", starts=4).error < 0.01


def test_an_interruption_is_passed_on(monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(analytic_fit.Objective, "__call__", interrupted)
    with pytest.raises(KeyboardInterrupt):
        fit_analytic(Lambert(0.5), "ward", starts=1)


def test_nothing_of_a_fit_is_kept_afterwards():
    # NLopt's optimizers are not seen by the garbage collector: one that its objective held would stay for ever.
    def kept():
        gc.collect()
        return sum(isinstance(o, Objective) for o in gc.get_objects())

    before = kept()
    fit_analytic(Glossy(), "ggx")
    assert kept() == before
