"""Figures and page of a report: what they show is what the table says, and the same table gives the same bytes."""

import io
import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from itertools import pairwise

import numpy as np
import pytest

from bvbedit.errors import BvbError
from bvbedit.study.correlations import correlation_matrix, reference_rows, series_of
from bvbedit.study.figures import figures
from bvbedit.study.nets import side, sweeps
from bvbedit.study.page import number_text
from bvbedit.study.plots import Missing, Plot
from bvbedit.study.report import write_report
from bvbedit.study.style import drawn, looks, plain, pretty
from bvbedit.study.table import Table, read_table, to_csv
from tests.study.tables import made_table


def small_table(**more):
    return made_table(3, sides=(4, 20), sizes=(1024, 4096, 65536), **more)


def study(folder, table, plan='name = "<b>"\n'):
    folder.mkdir(exist_ok=True)
    (folder / "results.csv").write_text(to_csv(table.rows, table.scenes))
    (folder / "plan.toml").write_text(plan)
    (folder / "versions.json").write_text(json.dumps({"bvbedit": "0.1.0", "packages": {"numpy": "2.4"}}))
    return folder


@pytest.fixture(scope="module")
def reported(tmp_path_factory):
    rows = list(small_table().rows)
    rows[0] = replace(rows[0], status="failed", reason="Too <small> & dark.")
    folder = study(tmp_path_factory.mktemp("study") / "my study", Table(tuple(rows), ("sphere",)))
    return folder, write_report(folder)


class Reader(HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.ids, self.targets, self.tags, self.words = [], [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        for name, value in attributes:
            if name == "id":
                self.ids.append(value)
            if name in ("href", "xlink:href", "src"):
                self.targets.append(value)
            if name in ("clip-path", "style") and "url(" in value:
                self.targets += re.findall(r"url\(([^)]*)\)", value)

    def handle_data(self, data):
        self.words.append(data)


def test_the_page_holds_all_it_shows(reported):
    folder, written = reported
    page = Reader(written.page.read_text())
    assert len(page.ids) == len(set(page.ids))
    assert {t[:1] for t in page.targets} == {"#"}
    assert {t[1:] for t in page.targets} <= set(page.ids)
    assert page.tags.count("svg") == page.tags.count("figure") == len(written.figures) // 2
    assert not {"script", "link", "img", "image"} & set(page.tags)
    assert sorted(p.name for p in (folder / "figures").iterdir()) == sorted(p.name for p in written.figures)
    assert written.missing == ()


def test_the_page_tells_plan_versions_and_failures_as_text(reported):
    _, written = reported
    text = written.page.read_text()
    words = "".join(Reader(text).words)
    for said in ('name = "<b>"', "packages: numpy", "Too <small> & dark.", "Failed cells (1)", "Study “my study”"):
        assert said in words
    for figure in (
        "Fig. 5",
        "Fig. 6",
        "Fig. 7",
        "Fig. 8",
        "Fig. 9",
        "Fig. 10",
        "Frontier per class",
        "Frontier per mat",
    ):
        assert figure in words
    assert "ICDCS Workshops 2011" in words
    assert words.count("Correlation of E_max with PAE") == text.count("<figure")


def test_the_same_study_gives_the_same_bytes_whatever_the_settings_of_matplotlib(reported):
    from matplotlib import rc_context

    folder, written = reported
    plots = plots_of(read_table(folder / "results.csv"))
    assert len(plots) == len(written.figures) // 2
    for name in ("fig6-errors", "fig8-correlations-sphere", "frontier-error-over-bytes"):
        plot = plots[name]
        with rc_context({"font.size": 30, "axes.facecolor": "red", "svg.fonttype": "none"}):
            again = drawn(plot.name, plot.title, plot.draw)
        assert (folder / "figures" / f"{name}.svg").read_text() == again.svg
        assert (folder / "figures" / f"{name}.png").read_bytes() == again.png
    assert not re.search(rb"20\d\d-\d\d-\d\d", written.page.read_bytes())


def test_pyplot_is_never_loaded():
    import subprocess
    import sys

    code = (
        "import sys\n"
        "from bvbedit.study.figures import figures\n"
        "from bvbedit.study.style import drawn\n"
        "from tests.study.tables import made_table\n"
        "plot = figures(made_table(1, sizes=(1024,)))[3]\n"
        "drawn(plot.name, plot.title, plot.draw)\n"
        "assert 'matplotlib.pyplot' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_pictures_are_large_enough_for_print(reported):
    from PIL import Image

    _, written = reported
    for path in written.figures:
        if path.suffix == ".png":
            with Image.open(io.BytesIO(path.read_bytes())) as picture:
                assert picture.width >= 700
                # Something is drawn, and the corner is white.
                assert picture.convert("L").getextrema()[0] < 80
                assert picture.convert("RGB").getpixel((0, 0)) == (255, 255, 255)


def plots_of(table):
    return {p.name: p for p in figures(table) if isinstance(p, Plot)}


def test_the_numbers_behind_a_figure_are_those_of_the_table():
    table = small_table(failing=0)
    plots = plots_of(table)
    row = next(r for r in table.rows if r.configuration == "paper 20" and r.material == "teflon")
    numbers = plots["fig5-errors-45"].numbers
    assert numbers.header[-2:] == ("n = 4", "n = 20")
    values = {line[:3]: line[3:] for line in numbers.rows}
    assert values["paper", "teflon", "E_max at 45° (1/sr)"][1] == row.e_max_45
    assert values["paper", "teflon", "E_avg at 45° (1/sr)"][1] == row.e_avg_45
    order = [line[3] for line in plots["fig9-sorted-sphere"].numbers.rows]
    assert order == sorted(order)
    edge = [
        line
        for line in plots["materials-error-over-bytes"].numbers.rows
        if line[0] == "satin" and line[4] != "analytic"
    ]
    assert all(a[2] < b[2] and a[3] > b[3] for a, b in pairwise(edge))
    assert all(len(line) == len(p.numbers.header) for p in plots.values() for line in p.numbers.rows)


def test_correlations_are_of_the_configuration_that_the_paper_took():
    table = small_table(failing=0)
    rows = reference_rows(table, "sphere")
    assert {row.configuration for row in rows} == {"paper 20"}
    matrix = correlation_matrix(rows, list(series_of("sphere").values()))
    values = [[r.e_max, r.e_avg, r.r_max, r.r_avg, r.picture("sphere").pae, r.picture("sphere").mae] for r in rows]
    np.testing.assert_allclose(matrix, np.corrcoef(np.transpose(values)), atol=1e-9)
    # Where a material lacks it, one that all have is taken.
    less = Table(tuple(r for r in table.rows if r.configuration != "paper 20" or r.material != "satin"), ("sphere",))
    assert {row.configuration for row in reference_rows(less, "sphere")} == {"paper 4"}


def test_series_over_n_are_told_by_their_nets():
    table = small_table(failing=0)
    assert list(sweeps(table)) == ["paper", "paper dominant"]
    assert {side(row) for row in sweeps(table)["paper"]} == {4, 20}
    assert side(next(r for r in table.rows if r.chart == "half-diff")) is None


def test_how_often_errors_grow_is_told_of_the_n_that_all_series_have():
    rows = [
        replace(row, e_max_45=value, e_avg_45=1 / value)
        for row in made_table(1, sides=(4, 6, 8), sizes=(), failing=0).rows
        if row.series in ("paper", "paper dominant")
        for value in [{"paper 4": 1.0, "paper 6": 5.0, "paper 8": 3.0}.get(row.configuration, 2.0)]
    ]
    assert len(rows) == 6
    without_six = [r for r in rows if r.series == "paper" or side(r) != 6]
    words = plots_of(Table(tuple(without_six), ("sphere",)))["fig5-errors-45"].words
    assert "E_max at 45° in 1 of 1 steps of “paper” (the median by 200 %, the largest by 200 %)" in words
    assert "0 of 1 steps of “paper dominant”; E_avg at 45° in 0 of 1 steps" in words
    words = plots_of(Table(tuple(rows), ("sphere",)))["fig5-errors-45"].words
    assert "E_max at 45° in 1 of 2 steps of “paper” (the median by 400 %, the largest by 400 %)" in words
    assert "E_avg at 45° in 1 of 2 steps of “paper” (the median by 67 %, the largest by 67 %)" in words
    apart = [r for r in rows if (r.series == "paper") == (side(r) < 8)]
    apart += [replace(r, size="10x10x40") for r in apart if r.series != "paper"]
    assert "share no two n" in plots_of(Table(tuple(apart), ("sphere",)))["fig5-errors-45"].words


def test_what_cannot_be_drawn_is_told(tmp_path):
    table = made_table(2, sides=(20,), sizes=(1024,), scenes=())
    missing = [p for p in figures(table) if isinstance(p, Missing)]
    assert any("Fig. 5" in m.title and "at two n" in m.why for m in missing)
    assert any("no scene" in m.why for m in missing)
    nothing = replace(made_table(1).rows[0], status="failed", reason="x")
    assert not plots_of(Table((nothing,), ("sphere",)))
    written = write_report(study(tmp_path, Table((nothing,), ("sphere",))))
    assert written.figures == ()
    assert "Not drawn:" in written.page.read_text()


def test_many_materials_are_shown_by_class_and_on_several_pages():
    plots = plots_of(made_table(24, sides=(4, 8), sizes=(1024,)))
    assert {f"materials-error-over-bytes-{n}" for n in (1, 2)} <= set(plots)
    assert "median bold" in plots["fig6-errors"].words
    figure = plots["fig6-errors"].draw()
    assert [at.get_title()[:7] for at in figure.axes[:3]] == ["diffuse", "glossy ", "mirror-"]
    # Every line lies within its panel, and panels of a row share their ends.
    for at in figure.axes:
        low, high = at.get_ylim()
        assert all(low <= min(line.get_ydata()) and max(line.get_ydata()) <= high for line in at.lines)
    assert figure.axes[0].get_ylim() == figure.axes[2].get_ylim()


def test_any_names_and_a_single_cell_are_drawn(tmp_path):
    table = made_table(1, sides=(4, 6), sizes=(1024,), scenes=("../a $x^$ <b>", "../a _x_ <b>"), failing=0)
    rows = tuple(replace(row, material='ß "$\\frac" <i>', series=f"_{row.series}$") for row in table.rows[:2])
    written = write_report(study(tmp_path, Table(rows, table.scenes)))
    assert {path.parent for path in written.figures} == {tmp_path / "figures"}
    names = [path.stem for path in written.figures]
    assert len(set(names)) == len(names) // 2
    assert "fig7-image-errors-..-a-x-b-2" in names
    assert '<td class="text">ß &quot;$\\frac&quot; &lt;i&gt;</td>' in written.page.read_text()


def test_a_damaged_study_is_told(tmp_path):
    folder = study(tmp_path, small_table())
    (folder / "versions.json").write_text("[1]")
    with pytest.raises(BvbError, match=r"versions\.json is no JSON object"):
        write_report(folder)
    (folder / "versions.json").unlink()
    (folder / "plan.toml").write_bytes(b"\xff")
    with pytest.raises(BvbError, match=r"plan\.toml is not UTF-8"):
        write_report(folder)
    (folder / "results.csv").write_text(to_csv([], ["sphere"]))
    with pytest.raises(BvbError, match="has no cells"):
        write_report(folder)


def test_labels():
    assert [plain(v) for v in (0.001, 0.5, 1, 2000.0, 1e4, 5e-4)] == [
        "0.001",
        "0.5",
        "1",
        "2,000",
        "$10^{4}$",
        r"$5\!\cdot\!10^{-4}$",
    ]
    assert pretty("E_max at 5$") == r"$E_\mathrm{max}$ at 5\$"
    assert pretty("my_max E_maximum") == "my_max E_maximum"
    assert [number_text(v) for v in (None, "a", 1234, 0.00012344, 12345.6, -0.5)] == [
        "–",
        "a",
        "1,234",
        "0.0001234",
        "12,346",
        "−0.5",
    ]
    names = [f"s{i}" for i in range(56)]
    assert len(set(looks(names).values())) == 56
