"""Rows and sheets of pictures, and pictures of differences."""

import numpy as np
import pytest

from bvbedit.errors import BvbError
from bvbedit.render.sheet import LETTERS, MARGIN, amplified_difference, sheet

LINE = LETTERS + 2 * MARGIN


def flat(value, height=20, width=30):
    return np.full((height, width, 3), value, dtype=np.uint8)


def test_a_row_without_labels_is_pictures_and_gaps():
    row = sheet([("", flat(10)), ("", flat(20)), ("", flat(30))], gap=4)
    assert row.shape == (20, 98, 3)
    assert row[:, [0, 29, 34, 63, 68, 97]].tolist() == [[[v] * 3 for v in (10, 10, 20, 20, 30, 30)]] * 20
    assert (row[:, 30:34] == 255).all()


def test_labels_stand_below_their_pictures():
    out = sheet([("chrome", flat(10, 40, 80)), ("", flat(20, 40, 80))])
    assert out.shape == (40 + LINE, 168, 3)
    assert (out[:40, :80] == 10).all()
    assert out[40:, :80].min() < 128
    assert (out[40:, 80:] == 255).all()
    assert not np.array_equal(out, sheet([("copper", flat(10, 40, 80)), ("", flat(20, 40, 80))]))


def test_rows_columns_and_sizes():
    out = sheet([("a", flat(1, 10, 10)), ("b", flat(2, 20, 40)), ("c", flat(3, 30, 15))], columns=2, gap=5)
    assert out.shape == (20 + LINE + 5 + 30 + LINE, 15 + 5 + 40, 3)
    assert (out[:20, 20:] == 2).all()
    assert (out[20 + LINE + 5 :][:30, :15] == 3).all()


def test_a_long_label_stays_under_its_picture():
    out = sheet([("a label far too long\nfor this picture", flat(0, 10, 60)), ("", flat(0, 10, 60))], gap=8)
    assert (out[10:, 60:] == 255).all()
    sheet([("x", flat(0, 1, 1))])


def test_a_difference_is_amplified_and_clipped():
    a, b = flat(100), flat(100)
    b[0, 0] = (103, 97, 0)
    out = amplified_difference(a, b, 8)
    assert out.dtype == np.uint8
    assert out[0, 0].tolist() == [24, 24, 255]
    assert not out[1:].any()
    assert np.array_equal(out, amplified_difference(b, a, 8))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: sheet([]), "at least one"),
        (lambda: sheet([("a", np.zeros((4, 4, 3)))]), "float64"),
        (lambda: sheet([("a", flat(0)[..., 0])]), "shape"),
        (lambda: sheet([("a", flat(0))], columns=0), "columns"),
        (lambda: sheet([("a", flat(0))], gap=-1), "gap"),
        (lambda: amplified_difference(flat(0), flat(0, 5, 5)), "one size"),
        (lambda: amplified_difference(flat(0), flat(0), 0), "factor"),
        (lambda: amplified_difference(flat(0), flat(0), np.nan), "factor"),
        (lambda: amplified_difference(flat(0), np.zeros((20, 30, 3))), "float64"),
    ],
)
def test_what_is_refused(make, words):
    with pytest.raises(BvbError, match=words):
        make()
