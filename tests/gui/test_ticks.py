"""Ticks: round numbers within an axis, far enough apart, and written as they are."""

import numpy as np
import pytest

from bvbedit_gui.plots import ticks

SUPERSCRIPTS = "⁰¹²³⁴⁵⁶⁷⁸⁹"


@pytest.mark.parametrize(("low", "high"), [(0, 1), (0, 0.37), (0, 12_345), (-3e-7, 3e-7), (0, 1e9)])
def test_linear_ticks_are_round_and_inside(low, high):
    found = ticks.linear_ticks(low, high, 6)
    assert 2 <= len(found) <= 7
    assert found.min() >= low
    assert found.max() <= high
    step = np.diff(found)
    np.testing.assert_allclose(step, step[0], rtol=1e-9)
    for text, value in zip(ticks.numbers(found), found, strict=True):
        assert read(text) == pytest.approx(value, rel=1e-9, abs=1e-15)


def read(text):
    """Return the number that is written."""
    plain = text.replace("−", "-").replace(",", "")
    if any(c in plain for c in SUPERSCRIPTS):
        mantissa, _, power = plain.rpartition("·")
        sign = -1 if power.startswith("-") else 1
        exponent = int("".join("-" if c == "⁻" else str(SUPERSCRIPTS.index(c)) for c in power.lstrip("-")[2:]))
        return sign * float(mantissa or 1) * 10.0**exponent
    return float(plain)


@pytest.mark.parametrize(("low", "high"), [(1e-6, 1e3), (0.053, 0.48), (0.9, 1.1), (0.1, 10), (1e-3, 2e-3)])
def test_log_ticks_are_inside(low, high):
    found = ticks.log_ticks(low, high, 5)
    assert 2 <= len(found) <= 5
    assert found.min() >= low * (1 - 1e-9)
    assert found.max() <= high * (1 + 1e-9)
    assert (np.diff(found) > 0).all()


@pytest.mark.parametrize("pixels", [300, 420, 1040])
@pytest.mark.parametrize("limit", [0.3, 7.0, 73.2, 90.0, 180.0])
@pytest.mark.parametrize("power", [1, 2])
def test_angle_ticks_stand_apart_at_their_angles(pixels, limit, power):
    x = np.linspace(0, 1, 361)
    places, labels = ticks.angle_ticks(x, limit * x**power, pixels)
    assert len(places) == len(labels) >= (2 if power == 1 else 1)
    assert len(set(labels)) == len(labels)
    assert (np.diff(places) * pixels >= 43).all()
    for place, label in zip(places, labels, strict=True):
        assert limit * place**power == pytest.approx(float(label.removesuffix("°")), abs=0.02)


def test_numbers_are_written_for_people():
    assert ticks.numbers([0.0, 0.5, 1.0]) == ["0.0", "0.5", "1.0"]
    assert ticks.numbers([-200.0, 0.0, 200.0]) == ["−200", "0", "200"]
    assert ticks.numbers([-2e-4, 0.0, 2e-4]) == ["−2·10⁻⁴", "0", "2·10⁻⁴"]
    assert ticks.numbers([]) == []
    assert ticks.scientific(-1e-12) == "−10⁻¹²"
    assert ticks.number(12_345.6) == "12,300"
    assert ticks.number(1.0832) == "1.08"
    assert ticks.number(0) == "0"
    assert ticks.decades(np.array([1e-4, 0.001, 1, 1000, 1e5])) == ["10⁻⁴", "0.001", "1", "1,000", "10⁵"]
