"""Directions: what is accepted, what is refused, and that lengths do not matter."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bvbedit import BvbError
from bvbedit.brdf.angle_kernels import upper_atan2
from bvbedit.brdf.geometry import elevation, spherical, unit_directions
from bvbedit.jit import kernel
from tests.brdf.samples import Glossy, random_pairs

components = st.floats(-1, 1).filter(lambda v: v == 0 or abs(v) > 1e-3)


@given(st.tuples(components, components, components).filter(any), st.sampled_from([1e-300, 1e-160, 1.0, 1e160, 1e300]))
def test_any_length_gives_the_same_unit_vector(w, scale):
    expected = [v / math.hypot(*w) for v in w]
    ours = unit_directions(np.array(w) * scale, "wi")
    np.testing.assert_allclose(ours, expected, rtol=0, atol=5e-16)
    assert math.hypot(*ours) == pytest.approx(1.0, abs=4e-16)


def test_the_shortest_and_the_longest_vectors_have_a_direction():
    ours = unit_directions([[0, 0, 5e-324], [1.7e308, 1.7e308, 0]], "w")
    np.testing.assert_allclose(ours, [[0, 0, 1], [0.5**0.5, 0.5**0.5, 0]], rtol=1e-15)


@pytest.mark.parametrize("bad", [[0, 0, 0], [0, -0.0, 0], [math.nan, 0, 1], [0, math.inf, 1], [-math.inf, 0, 1]])
def test_what_has_no_direction_is_refused_by_name_and_index(bad):
    with pytest.raises(BvbError, match=r"^wo\[\]"):
        unit_directions(bad, "wo")
    with pytest.raises(BvbError, match=r"^wi\[1, 2\]"):
        unit_directions([[[0, 0, 1]] * 3, [[0, 0, 1], [0, 0, 1], bad]], "wi")
    with pytest.raises(BvbError, match="finite and non-zero"):
        Glossy().evaluate([0, 0, 1], bad)


@pytest.mark.parametrize("shape", [(), (2,), (4,), (3, 2), (0,)])
def test_what_is_no_vector_of_three_is_refused(shape):
    with pytest.raises(BvbError, match="3 components"):
        unit_directions(np.ones(shape), "wi")


@given(st.floats(0, math.pi), st.floats(-7, 7))
def test_spherical_follows_its_definition(theta, phi):
    expected = [math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)]
    np.testing.assert_allclose(spherical(theta, phi), expected, rtol=0, atol=2e-16)


def test_spherical_broadcasts():
    assert spherical(np.zeros((4, 1)), np.zeros(5)).shape == (4, 5, 3)


@pytest.mark.parametrize("theta", [0.0, 1e-300, 1e-12, 1e-3, 1.0, math.pi / 2 - 1e-9, math.pi / 2])
def test_elevation_keeps_all_digits_of_small_angles(theta):
    assert elevation(spherical(theta, 1.234)) == pytest.approx(theta, rel=1e-15, abs=0)


def test_directions_broadcast_against_one_another(rng):
    wi, wo = (w.reshape(4, 5, 3) for w in random_pairs(rng, 20))
    brdf = Glossy()
    whole = brdf.evaluate(wi[:, :, None], wo[0])
    assert whole.shape == (4, 5, 5, 3)
    np.testing.assert_array_equal(whole[2, 3, 4], brdf.evaluate(wi[2, 3], wo[0, 4]))
    assert brdf.evaluate([0, 0, 1], [0, 0, 1]).shape == (3,)
    assert brdf.evaluate(np.empty((0, 3)), [0, 0, 1]).shape == (0, 3)
    with pytest.raises(BvbError, match=r"\(4, 5, 3\).*\(3, 3\).*broadcast"):
        brdf.evaluate(wi, np.ones((3, 3)))


def test_lengths_do_not_matter_to_reflectance(rng):
    wi, wo = random_pairs(rng, 100)
    f = Glossy().evaluate(wi, wo)
    for scale in (1e-300, 3.0, 1e300):
        np.testing.assert_allclose(Glossy().evaluate(wi * scale, wo), f, rtol=1e-12)


def test_below_the_horizon_nothing_is_reflected_and_nothing_is_known(rng):
    wi, wo = random_pairs(rng, 100)
    flip = np.array([1.0, 1.0, -1.0])
    for i, o in ((wi * flip, wo), (wi, wo * flip), (wi * flip, wo * flip)):
        f, trusted = Glossy().evaluate_trusted(i, o)
        assert (f == 0).all()
        assert not trusted.any()
    mixed = np.where(np.arange(100)[:, None] % 2, wi, wi * flip)
    f, trusted = Glossy().evaluate_trusted(mixed, wo)
    assert (f[::2] == 0).all()
    np.testing.assert_array_equal(f[1::2], Glossy().evaluate(wi[1::2], wo[1::2]))


def test_grazing_values_exist_but_are_not_trusted():
    brdf = Glossy()
    theta = np.radians([0.0, 88.9, 89.1, 90.0])
    for swap in (False, True):
        pair = (spherical(theta, 0.0), spherical(0.3, 1.0))
        f, trusted = brdf.evaluate_trusted(*(pair[::-1] if swap else pair))
        assert trusted.tolist() == [True, True, False, False]
        assert (f[:3] > 0).all()


def test_more_pairs_than_one_block_holds_are_evaluated_alike(rng, monkeypatch):
    monkeypatch.setattr("bvbedit.brdf.base.BLOCK", 64)
    wi, wo = random_pairs(rng, 200)
    wi[70:90, 2] *= -1
    blocked = Glossy().evaluate_trusted(wi, wo)
    monkeypatch.undo()
    for a, b in zip(blocked, Glossy().evaluate_trusted(wi, wo), strict=True):
        np.testing.assert_array_equal(a, b)


parts = st.floats(-1e150, 1e150).filter(lambda v: v == 0 or abs(v) > 1e-150)


@given(parts.map(abs), parts)
def test_the_quick_arc_tangent_is_that_of_the_library(y, x):
    expected = math.atan2(y, x + 0.0) if y or x else 0.0
    assert called(y, x) == pytest.approx(expected, rel=4e-16, abs=0)


@kernel
def called(y, x):
    return upper_atan2(y, x)
