"""Known values of the sRGB curve, and what is refused."""

import numpy as np
import pytest

from bvbedit.errors import BvbError
from bvbedit.render.tonemap import tone_map


def grey(*values):
    return np.repeat(np.array(values, dtype=np.float64)[None, :, None], 3, axis=2)


@pytest.mark.parametrize(
    ("linear", "expected"),
    [
        (0.0, 0),
        (-1.0, 0),
        (1.0, 255),
        (7.5, 255),
        (0.5, 188),  # 1.055 * 0.5^(1/2.4) - 0.055 = 0.7354, times 255 = 187.5
        (0.18, 118),  # middle grey: 0.4614 * 255 = 117.6
        (0.21404, 127),  # ((0.5 + 0.055) / 1.055)^2.4 = 0.2140411 is the linear value of 0.5, and 255 * 0.5 = 127.5
        (0.21405, 128),
        (0.0031308, 10),  # the knee: 12.92 * 0.0031308 * 255 = 10.31
        (0.001, 3),  # below it: 12.92 * 0.001 * 255 = 3.29
    ],
)
def test_known_values(linear, expected):
    out = tone_map(grey(linear))
    assert out.dtype == np.uint8
    assert (out == expected).all()


def test_every_code_comes_back():
    code = np.arange(256) / 255
    linear = np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)
    assert np.array_equal(tone_map(grey(*linear))[0, :, 0], np.arange(256))
    assert np.array_equal(tone_map(grey(*linear).astype(np.float32))[0, :, 0], np.arange(256))


def test_exposure_is_in_stops():
    assert np.array_equal(tone_map(grey(0.1, 0.2), 1.5), tone_map(grey(0.1, 0.2) * 2**1.5))
    assert np.array_equal(tone_map(grey(0.4), -2), tone_map(grey(0.1)))
    assert tone_map(np.full((1, 1, 3), 3e38, dtype=np.float32), 64).max() == 255


@pytest.mark.parametrize(
    ("picture", "exposure", "words"),
    [
        (grey(np.nan), 0, "nan"),
        (grey(np.inf), 0, "infinite"),
        (grey(1.0), np.nan, "exposure"),
        (grey(1.0), 65, "exposure"),
        (grey(1.0), "bright", "exposure"),
        (np.ones((4, 4)), 0, "shape"),
        (np.ones((4, 4, 4)), 0, "shape"),
        (np.ones((0, 4, 3)), 0, "shape"),
        (np.ones((4, 4, 3), dtype=np.uint8), 0, "uint8"),
    ],
)
def test_what_is_refused(picture, exposure, words):
    with pytest.raises(BvbError, match=words):
        tone_map(picture, exposure)
