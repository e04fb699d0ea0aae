"""Figures: rows that agree with the model, its file and its reference."""

import numpy as np
import pytest

from bvbedit import fit, save
from bvbedit.brdf.analytic import GGX, Lambert, Schlick
from bvbedit.brdf.charts import HALF_DIFF, IN_OUT, grid_points
from bvbedit.brdf.encodings import Linear, Log
from bvbedit.brdf.measured import MeasuredBrdf
from bvbedit.brdf.metrics import compare
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.spline.tensor import TensorSpline
from bvbedit_gui.plots import albedo_curve, figures
from bvbedit_gui.plots.facts import bytes_in_words, measured_bytes, negative_share, reciprocity_error

GOLD = GGX(0.3, Schlick((0.9, 0.6, 0.2)))


@pytest.fixture(scope="module")
def gold():
    return fit(GOLD, size=(8, 6, 4), chart="half-diff", encoding="root")


def values(model, reference, **options):
    return {row.label: row.value for row in figures(model, reference, **options)}


def test_figures_are_those_of_the_model(gold, tmp_path):
    found = values(gold, GOLD)
    assert found["chart"] == "half-diff"
    assert found["encoding"] == "root, 1/3"
    assert found["degrees"] == "3 x 3 x 3"
    assert found["size"] == "8 x 6 x 4"
    assert found["control points"] == "192"
    assert found["storage"].startswith("quantised, step ")
    assert found["reciprocity"] == "exact"
    save(gold, tmp_path / "m.bvb", precision=gold.storage.precision)
    assert found["file"] == bytes_in_words((tmp_path / "m.bvb").stat().st_size)
    # A closed form has no size.
    assert "compression" not in found
    exact = compare(gold, GOLD, stride=5)
    assert float(found["log-cosine RMS, grid"]) == pytest.approx(exact.grid.log_cosine_rms, rel=0.3)
    assert float(found["relative L1, grid"].split()[0]) == pytest.approx(100 * exact.grid.relative_l1, rel=0.3)
    largest, at, channel = albedo_curve(gold).largest
    assert found["largest albedo"] == f"{largest:.3g} ({channel}, θ_o = {at:g}°)"


def test_every_row_is_explained_in_one_sentence(gold):
    rows = figures(gold, GOLD)
    assert len({row.label for row in rows}) == len(rows)
    for row in rows:
        assert row.help.endswith(".")
        assert row.help.count(". ") == 0
        assert row.value


def test_without_a_reference_nothing_is_compared(gold):
    found = values(gold, None, albedo=albedo_curve(gold))
    assert not any("RMS" in label or "compression" in label for label in found)
    assert "largest albedo" in found


def test_compression_is_that_of_the_measurement(gold):
    axes = (np.linspace(0, 1, 9),) * 3
    wi, wo = HALF_DIFF.to_directions(grid_points(axes))
    table = MeasuredBrdf(GOLD.evaluate(wi, wo).reshape(9, 9, 9, 3), np.ones((9, 9, 9), bool), axes, HALF_DIFF)
    assert measured_bytes(table) == 9**3 * 3 * 8
    assert values(gold, table)["compression"].endswith(f": 1 of {bytes_in_words(9**3 * 3 * 8)}")


def test_black_white_and_negative_models():
    def net(albedo, encoding):
        control = np.full((4, 4, 4, 3), encoding.encode(np.array(albedo / np.pi)))
        return SplineBrdf(TensorSpline((3,) * 3, (np.repeat([0.0, 1.0], 4),) * 3, control), IN_OUT, encoding)

    black = values(net(0.0, Log()), Lambert((0.0, 0.0, 0.0)))
    assert black["largest albedo"].startswith("0 ")
    assert black["encoding"] == "log, from 0.001/sr"
    assert black["relative L1, grid"] == "0 %"
    white = net(0.9, Linear())
    assert negative_share(white) == 0
    assert reciprocity_error(white) == 0
    negative = white.with_spline(white.spline.with_control(-white.spline.control))
    assert negative_share(negative) == 1
    assert values(negative, None)["negative values"] == "100 % clamped"
    control = np.array(white.spline.control)
    control[0] *= 0.5
    assert reciprocity_error(white.with_spline(white.spline.with_control(control))) > 0.01


@pytest.mark.parametrize(("count", "words"), [(12, "12 B"), (2048, "2.0 KiB"), (34_992_012, "33.4 MiB")])
def test_bytes_in_words(count, words):
    assert bytes_in_words(count) == words
