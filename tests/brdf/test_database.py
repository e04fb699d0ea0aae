"""The generated database: the same each time, known by name, spread as stated, and physically plausible."""

import subprocess
import sys
from collections import Counter

import numpy as np
import pytest

from bvbedit.brdf.database import FINISHES, NOISE, database, generated
from bvbedit.brdf.geometry import spherical
from bvbedit.brdf.materials import is_material, material_named
from tests.spline.refusals import refusal

DATABASE = database(100)


def test_each_material_depends_on_its_number_and_seed_alone():
    assert list(database(7).items()) == list(DATABASE.items())[:7]
    assert database(100) == DATABASE
    other = database(100, seed=3)
    assert not {m.description for m in other.values()} & {m.description for m in DATABASE.values()}
    assert len({m.description for m in DATABASE.values()}) == 100
    assert len({m.noise_seed for m in (*DATABASE.values(), *other.values())}) == 200


@pytest.mark.parametrize("seed", [0, 3])
def test_names_lead_back_to_the_material(seed):
    for k, (name, material) in enumerate(database(100, seed).items()):
        assert material.name == name == f"db{seed or ''}-{k:03d}-{material.finish}"
        assert material_named(name) == material == material_named(name.rsplit("-", 1)[0])
        assert "\n" not in material.description


def test_finishes_kinds_widths_and_noise_are_spread_as_stated():
    finishes = Counter(m.finish for m in DATABASE.values())
    for finish, (share, (low, high), _) in FINISHES.items():
        assert abs(finishes[finish] - 100 * share) <= 2
        alphas = [m.alpha for m in DATABASE.values() if m.finish == finish]
        assert low <= min(alphas) < 1.3 * low
        assert 0.77 * high < max(alphas) <= high
    kinds = Counter(m.kind for m in DATABASE.values())
    assert min(kinds.values()) >= 15
    noise = [m.noise for m in DATABASE.values()]
    assert NOISE[0] <= min(noise) < 1.3 * NOISE[0]
    assert 0.77 * NOISE[1] < max(noise) <= NOISE[1]
    assert np.exp(np.mean(np.log(noise))) == pytest.approx(np.sqrt(np.prod(NOISE)), rel=0.15)


def _albedo(brdf, theta: float, counts: tuple[int, int] = (160, 48)) -> np.ndarray:
    """Integrate over half vectors: theta_h even in its logarithm, wi = the mirror image of wo in h."""
    edges = np.exp(np.linspace(np.log(2e-4), np.log(np.pi / 2), counts[0] + 1))
    theta_h, width = np.sqrt(edges[1:] * edges[:-1]), np.diff(edges)
    wo, h = spherical(theta, 0.0), spherical(theta_h[:, None], 2 * np.pi * (np.arange(counts[1]) + 0.5) / counts[1])
    along = h @ wo
    wi = 2 * along[..., None] * h - wo
    solid = 4 * along * (np.sin(theta_h) * width)[:, None] * (2 * np.pi / counts[1])
    seen = (along > 0) & (wi[..., 2] > 0)
    f = np.zeros((*seen.shape, 3))
    f[seen] = brdf.evaluate_unit(wi[seen], np.broadcast_to(wo, wi.shape)[seen])[0]
    return np.einsum("rsc,rs->c", f, np.where(seen, wi[..., 2] * solid, 0.0))


@pytest.mark.parametrize("theta", np.radians([0, 50, 80]))
def test_none_of_the_hundred_gives_back_more_than_it_gets(theta):
    albedos = np.array([_albedo(m.brdf, theta) for m in DATABASE.values()])
    # The quadrature is good to some thousandths.
    assert albedos.max() <= 1 + 5e-3
    assert albedos.min() > 0
    assert np.ptp(np.log(albedos.mean(axis=1))) > 1.0


def test_all_are_finite_reciprocal_and_not_negative(rng):
    wi, wo = (spherical(np.arccos(rng.random(300)), 2 * np.pi * rng.random(300)) for _ in range(2))
    for material in DATABASE.values():
        f = material.brdf.evaluate(wi, wo)
        assert np.isfinite(f).all()
        assert f.min() >= 0
        np.testing.assert_array_equal(f, material.brdf.evaluate(wo, wi))


def test_mirrors_are_brighter_than_matte_in_the_mirror_direction():
    peaks = {finish: [] for finish in FINISHES}
    for material in DATABASE.values():
        peaks[material.finish].append(material.brdf.evaluate([0, 0, 1], [0, 0, 1]).mean())
    matte, glossy, mirror = (np.median(peaks[finish]) for finish in ("matte", "glossy", "mirror"))
    assert 10 * matte < 3 * glossy < mirror


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("db-000-mirror", "That number is db-000-"),
        ("db-1000", "Choose one of matte-paper"),
        ("db-00", "or db-000 ... db-999"),
        ("db1234567890-000", "Unknown material"),
        ("db-000\n", "Unknown material"),
    ],
)
def test_unknown_names_are_told(name, words):
    assert words in refusal(lambda: material_named(name))
    assert not is_material(name)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: database(0), "count is 0"),
        (lambda: database(1001), "count is 1001"),
        (lambda: database(2.5), "count is 2.5"),
        (lambda: database(5, seed=-1), "seed is -1"),
        (lambda: database(5, seed=None), "seed is None"),
        (lambda: generated(None), "Unknown material None"),
    ],
)
def test_mistakes_are_told_in_one_line(make, words):
    assert words in refusal(make)


def test_whoever_wants_none_does_not_load_it():
    code = "import sys, bvbedit.brdf.materials as m; m.material_named('copper'); m.is_material('copper'); "
    code += "sys.exit('bvbedit.brdf.database' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
