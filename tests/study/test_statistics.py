"""Correlations, ranks, and the classes of materials."""

import numpy as np
import pytest

from bvbedit.study.classes import CLASSES, class_of, classes, groups, highlight
from bvbedit.study.plots import agreement
from bvbedit.study.statistics import median, pearson, ranks, spearman
from bvbedit.study.table import Row, Table
from tests.study.tables import made_table


def test_pearson_is_the_correlation(rng):
    x, noise = rng.normal(size=(2, 50))
    assert pearson(x, 0.3 * x + noise) == pytest.approx(np.corrcoef(x, 0.3 * x + noise)[0, 1])
    assert pearson(x, -2 * x + 1) == pytest.approx(-1)
    assert pearson(1e200 * x, 1e-200 * x) == pytest.approx(1)


def test_what_has_no_correlation_has_none():
    assert pearson([1, 2], [1, 2]) is None
    assert pearson([1, 2, 3], [0.1, 0.1, 0.1]) is None
    assert pearson([0, 0, 0], [1, 2, 3]) is None
    assert spearman([], []) is None


def test_ranks_of_ties_are_their_mean(rng):
    np.testing.assert_array_equal(ranks([5, 1, 5, 3]), [3.5, 1, 3.5, 2])
    x = rng.normal(size=30)
    assert spearman(x, np.exp(x)) == pytest.approx(1)
    assert pearson(x, np.exp(5 * x)) < 0.9


def cell(material, width):
    return Row(material=material, highlight=width, configuration="c", series="s", kind="spline", status="done")


def test_a_class_follows_from_the_width_of_the_highlight():
    # As measured: white paper, satin, chrome.
    table = Table((cell("chrome", 0.07), cell("paper", 90.0), cell("satin", 2.3), cell("?", None)))
    assert classes(table) == {"diffuse": ("paper",), "glossy": ("satin",), "mirror-like": ("chrome",)}
    assert groups(table)["class unknown"] == ("?",)
    assert class_of(10.0) == "diffuse"
    assert highlight([cell("?", None)]) is None
    assert tuple(classes(made_table())) == CLASSES
    assert median([3, 1, 2]) == 2


def test_the_agreement_of_errors_is_told_for_each_scene():
    table = made_table(scenes=("sphere", "studio"))
    said = agreement(table.done, table.scenes)
    assert said.count("r = 0.") == 2
    assert "in sphere" in said
    assert "in studio" in said
    assert "undefined (1 cells" in agreement(table.done[:1], ["sphere"])
    assert agreement(table.done, []) == ""
