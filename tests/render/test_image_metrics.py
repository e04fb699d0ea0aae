"""MAE, PAE and PSNR by hand; HDR-FLIP where it would end the process or accept nonsense."""

import math
import sys

import numpy as np
import pytest

from bvbedit.errors import BvbError
from bvbedit.render.image_metrics import compare_pictures, hdr_flip

BLACK = np.zeros((12, 12, 3), dtype=np.float32)
NOISE = np.random.default_rng(4).uniform(size=(12, 12, 3)).astype(np.float32)


def test_by_hand():
    # One of 2 x 2 x 3 values goes from 0 to 255, one from 0 to the code of 0.5, which is 188.
    a, b = np.zeros((2, 2, 3)), np.zeros((2, 2, 3))
    a[0, 0, 0], a[1, 1, 2] = 1.0, 0.5
    result = compare_pictures(a, b)
    assert result.mae == pytest.approx((255 + 188) / 255 / 12)
    assert result.pae == 1.0
    assert result.psnr == pytest.approx(-10 * math.log10((1 + (188 / 255) ** 2) / 12))
    assert result.flip is None
    assert compare_pictures(b, a) == result


def test_exposure_comes_before_the_curve():
    a, b = np.full((2, 2, 3), 0.25), np.zeros((2, 2, 3))
    assert compare_pictures(a, b, 1.0).mae == pytest.approx(188 / 255)
    assert compare_pictures(a * 100, a * 50).mae == 0  # both are white


def test_equal_pictures():
    result = compare_pictures(NOISE, NOISE.astype(np.float64), flip=True)
    assert (result.mae, result.pae, result.psnr, result.flip) == (0, 0, math.inf, 0)


def test_flip_grows_with_the_difference():
    near, far = hdr_flip(NOISE * 1.02, NOISE), hdr_flip(NOISE * 0.5, NOISE)
    assert 0 < near < far < 1
    assert compare_pictures(NOISE * 0.5, NOISE, flip=True).flip == far
    # Views and float64 are no different.
    assert hdr_flip((NOISE * 0.5)[::-1, ::2].astype(np.float64), NOISE[::-1, ::2]) > 0


def test_flip_of_black_pictures_does_not_end_the_process():
    assert hdr_flip(BLACK, BLACK) == 0
    assert hdr_flip(BLACK - 1, BLACK) == 0  # negative values are black
    assert 0 < hdr_flip(BLACK, NOISE) <= 1
    for reference in (BLACK, BLACK + 1e-30, BLACK + 1e-7):
        with pytest.raises(BvbError, match="reference is black"):
            hdr_flip(NOISE, reference)
    assert hdr_flip(BLACK + 2e-6, BLACK + 2e-6) == 0  # just bright enough for flip-evaluator itself


def test_a_missing_flip_evaluator_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "flip_evaluator", None)
    with pytest.raises(BvbError, match="pip install flip-evaluator"):
        hdr_flip(NOISE, NOISE)


@pytest.mark.parametrize("function", [compare_pictures, hdr_flip])
@pytest.mark.parametrize(
    ("a", "words"),
    [
        (NOISE * np.nan, "test has values"),
        (np.full_like(NOISE, np.inf), "test has values"),
        (NOISE[:5], "one size"),
        (NOISE[..., 0], "shape"),
        ((NOISE * 255).astype(np.uint8), "uint8"),
    ],
)
def test_what_is_refused(function, a, words):
    with pytest.raises(BvbError, match=words):
        function(a, NOISE)


def test_flip_refuses_what_float32_cannot_hold():
    with np.errstate(over="ignore"), pytest.raises(BvbError, match="float32"):
        hdr_flip(NOISE.astype(np.float64), np.full((12, 12, 3), 1e300))
