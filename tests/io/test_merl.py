"""MERL files: the layout against a naive reader, round trips to an ulp, and what is refused."""

import struct

import numpy as np
import pytest

import bvbedit
from bvbedit import BvbError
from bvbedit.brdf.charts import RUSINKIEWICZ, RUSINKIEWICZ_360
from bvbedit.brdf.measured import MeasuredBrdf
from bvbedit.io.merl import load_merl, save_merl
from tests.io import files

SCALE = (1 / 1500, 1.15 / 1500, 1.66 / 1500)


@pytest.mark.parametrize(("bins", "chart"), [(180, RUSINKIEWICZ), (360, RUSINKIEWICZ_360)])
def test_cells_stand_where_the_format_says_and_come_back_to_an_ulp(bins, chart, tmp_path):
    dims = (90, 90, bins)
    content = files.merl(dims, seed=bins)
    table = bvbedit.load(files.written(tmp_path / "a.binary", content))
    assert isinstance(table, MeasuredBrdf)
    assert table.chart is chart
    rng = np.random.default_rng(0)
    for h, d, p in zip(rng.integers(90, size=50), rng.integers(90, size=50), rng.integers(bins, size=50), strict=True):
        cell = int(p + bins * (d + 90 * h))
        raw = [struct.unpack_from("<d", content, 12 + 8 * (cell + c * 90 * 90 * bins))[0] for c in range(3)]
        assert table.valid[h, d, p] == (min(raw) >= 0)
        if min(raw) >= 0:
            np.testing.assert_allclose(
                table.values[h, d, p], [r * s for r, s in zip(raw, SCALE, strict=True)], rtol=1e-15
            )

    bvbedit.save(table, tmp_path / "b.binary")
    again = load_merl(tmp_path / "b.binary")
    np.testing.assert_array_equal(again.valid, table.valid)
    ulps = np.abs(again.values - table.values) / np.spacing(table.values)
    assert ulps.max() <= 1


def test_extreme_values_come_back_to_an_ulp(tmp_path):
    rng = np.random.default_rng(5)
    values = np.exp(rng.uniform(np.log(1e-300), np.log(1e300), (90, 90, 180, 3)))
    values[0, 0, :5] = 0.0
    table = MeasuredBrdf(values, np.ones((90, 90, 180), bool), RUSINKIEWICZ.grid, RUSINKIEWICZ)
    save_merl(table, tmp_path / "a.binary")
    ulps = np.abs(load_merl(tmp_path / "a.binary").values - values) / np.spacing(values)
    assert ulps.max() <= 1


def test_any_negative_value_marks_an_invalid_cell(tmp_path):
    content = bytearray(files.merl())
    plane = 90 * 90 * 180
    struct.pack_into("<d", content, 12, -1e-12)
    struct.pack_into("<d", content, 12 + 8 * (plane + 1), -1.0)
    struct.pack_into("<d", content, 12 + 8 * (2 * plane + 2), -7.5)
    struct.pack_into("<ddd", content, 12 + 8 * 3, -0.0, 0.0, 0.0)
    for c in (1, 2):
        struct.pack_into("<d", content, 12 + 8 * (c * plane + 3), 0.0)
    table = load_merl(files.written(tmp_path / "a.binary", bytes(content)))
    assert table.valid[0, 0, :4].tolist() == [False, False, False, True]


def test_what_is_no_merl_file_is_refused(tmp_path):
    sound = files.merl()
    nan, inf = (sound[:20] + struct.pack("<d", v) + sound[28:] for v in (np.nan, np.inf))
    bad = {
        "-90 x 90 x 180": struct.pack("<3i", -90, 90, 180) + sound[12:],
        "0 x 90 x 180": struct.pack("<3i", 0, 90, 180) + sound[12:],
        "90 x -2147483648 x 180": struct.pack("<3i", 90, -(2**31), 180) + sound[12:],
        "90 x 90 x 2147483647": struct.pack("<3i", 90, 90, 2**31 - 1) + sound[12:],
        "bytes in place of": sound[:-8],
        r"34,992,013 bytes in place of 34,992,012": sound + b"\0",
        "11 bytes in place of": sound[:11],
        "is nan": nan,
        "is inf": inf,
        "Not one cell": sound[:12] + np.full(3 * 90 * 90 * 180, -1.0).tobytes(),
    }
    for word, content in bad.items():
        path = files.written(tmp_path / "bad.binary", content)
        with pytest.raises(BvbError, match=word) as refusal:
            bvbedit.load(path)
        assert str(path) in str(refusal.value)


def test_a_table_on_other_nodes_is_not_written(tmp_path):
    axes = tuple(np.linspace(0, 0.9, 5) for _ in range(3))
    table = MeasuredBrdf(np.ones((5, 5, 5, 3)), np.ones((5, 5, 5), bool), axes, RUSINKIEWICZ)
    with pytest.raises(BvbError, match="not on MERL's nodes"):
        bvbedit.save(table, tmp_path / "a.binary")
    assert list(tmp_path.iterdir()) == []
