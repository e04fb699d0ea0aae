"""Tables as .npz: exact round trips without pickle, and what is refused."""

import io
from pathlib import Path

import numpy as np
import pytest

import bvbedit
from bvbedit import BvbError
from bvbedit.brdf.charts import CHARTS
from bvbedit.brdf.measured import MeasuredBrdf
from bvbedit.io import table as table_format
from tests.io import files


def arrays(chart: str = "in-out") -> dict[str, np.ndarray]:
    rng = np.random.default_rng(2)
    axes = {f"axis_{a}": np.linspace(0, 0.9, n) for a, n in enumerate((4, 5, 6))}
    return {
        "values": rng.uniform(0, 9, (4, 5, 6, 3)),
        "valid": rng.random((4, 5, 6)) < 0.8,
        "chart": np.array(chart),
    } | axes


def packed(path: Path, **changes: np.ndarray | None) -> Path:
    content = io.BytesIO()
    np.savez_compressed(content, **{k: v for k, v in (arrays() | changes).items() if v is not None})
    return files.written(path, content.getvalue())


@pytest.mark.parametrize("chart", CHARTS)
def test_what_is_written_is_read_exactly(chart, tmp_path):
    a = arrays(chart)
    table = MeasuredBrdf(a["values"], a["valid"], (a["axis_0"], a["axis_1"], a["axis_2"]), CHARTS[chart])
    path = tmp_path / "t.npz"
    bvbedit.save(table, path)
    again = bvbedit.load(path)
    assert isinstance(again, MeasuredBrdf)
    assert again.chart is table.chart
    np.testing.assert_array_equal(again.values, table.values)
    np.testing.assert_array_equal(again.valid, table.valid)
    for ours, theirs in zip(again.axes, table.axes, strict=True):
        np.testing.assert_array_equal(ours, theirs)
    with np.load(path, allow_pickle=False) as opened:
        assert str(opened["chart"]) == chart


def test_tables_that_numpy_wrote_are_read(tmp_path):
    a = arrays()
    fortran = packed(tmp_path / "f.npz", values=np.asfortranarray(a["values"]))
    np.testing.assert_array_equal(bvbedit.load(fortran).filled, bvbedit.load(packed(tmp_path / "c.npz")).filled)
    single = bvbedit.load(packed(tmp_path / "s.npz", values=a["values"].astype(np.float32)))
    np.testing.assert_allclose(single.filled[a["valid"]], a["values"][a["valid"]], rtol=1e-7)


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"values": None}, "no values.npy"),
        ({"values": np.ones((4, 5, 6))}, "4 dimensions"),
        ({"values": np.ones((4, 5, 7, 3))}, "belong together"),
        ({"values": np.ones((4, 5, 6, 3), complex)}, "complex128"),
        ({"values": np.full((4, 5, 6, 3), np.nan)}, "nan"),
        ({"valid": np.zeros((4, 5, 6), bool)}, "Not one cell"),
        ({"valid": np.ones((4, 5, 6), np.int8)}, "int8"),
        ({"axis_1": np.linspace(0.9, 0, 5)}, "theta_o"),
        ({"axis_1": np.linspace(0, 2, 5)}, "theta_o"),
        ({"chart": np.array("polar")}, "polar"),
        ({"chart": np.array("x" * 500)}, "chart.npy"),
        ({"chart": np.array(None)}, "object"),
    ],
)
def test_what_is_no_sound_table_is_refused(changes, word, tmp_path):
    path = packed(tmp_path / "t.npz", **changes)
    with pytest.raises(BvbError, match=word) as refusal:
        bvbedit.load(path)
    assert str(path) in str(refusal.value)


@pytest.mark.parametrize("limit", ["MOST_VALUES", "MOST_NODES"])
def test_more_numbers_than_would_be_read_are_not_written(limit, tmp_path, monkeypatch):
    path = packed(tmp_path / "t.npz", values=arrays()["values"].astype(np.float32))
    table = bvbedit.load(path)
    monkeypatch.setattr(table_format, limit, 5)
    with pytest.raises(BvbError, match="entries, more than the"):
        bvbedit.load(path)
    with pytest.raises(BvbError, match="too much for a file"):
        bvbedit.save(table, tmp_path / "u.npz")
    assert list(tmp_path.iterdir()) == [path]
