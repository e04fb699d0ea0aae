"""The commands that read a study: its report, and what to use by it."""

import json

import pytest

from bvbedit.cli import study_report
from bvbedit.study.table import to_csv
from tests.study.tables import made_table


@pytest.fixture
def study(tmp_path):
    table = made_table(2, sides=(8, 20), sizes=(1024, 16384), failing=0)
    (tmp_path / "results.csv").write_text(to_csv(table.rows))
    return tmp_path


def test_recommend_names_a_configuration_and_how_to_make_it(run, study):
    status, out, err = run("recommend", "teflon", "--study", study, "--max-bytes", 20000, "--json")
    assert (status, err, out.count("\n")) == (0, "", 1)
    told = json.loads(out)
    assert told["choice"]["file_bytes"] <= 20000
    assert told["choice"]["command"].startswith("bvbedit fit teflon.binary teflon.bvb --chart ")
    assert told["cheaper"]["error"] > told["choice"]["error"]
    assert told["better"] is None or told["better"]["error"] < told["choice"]["error"]


def test_recommend_takes_the_file_itself_and_a_scene(run, study):
    wanted = ("recommend", "data/teflon.binary", "--study", study, "--scene", "sphere", "--max-error", 0.5)
    status, out, _ = run(*wanted)
    assert status == 0
    assert "bvbedit fit data/teflon.binary teflon.bvb" in out
    assert json.loads(run(*wanted, "--json")[1])["choice"]["render_seconds"] > 0


def test_recommend_tells_what_is_wrong_in_one_line(run, study, tmp_path):
    for arguments, words in (
        (("glass", "--study", study, "--max-error", 1), "'glass' is not in the study"),
        (("teflon", "--study", study, "--max-error", 1, "--max-time", 5), "exclude each other"),
        (("teflon", "--study", study, "--max-error", 1e-9), "Allow more"),
        (("teflon", "--study", tmp_path / "none", "--max-error", 1), "Run bvbedit study first"),
    ):
        status, out, err = run("recommend", *arguments)
        assert (status, out, err.count("\n")) == (1, "", 1)
        assert words in err


def test_report_writes_a_page_and_figures(study, capsys):
    table = made_table(2, sides=(20,), sizes=(1024, 16384), scenes=(), failing=0)
    (study / "results.csv").write_text(to_csv(table.rows))
    study_report.report(study, out=study / "page.html", as_json=True)
    told = json.loads(capsys.readouterr().out)
    assert told["file"] == str(study / "page.html")
    assert all((study / "figures" / name).stat().st_size > 0 for name in told["figures"])
    assert (told["materials"], told["failed"]) == (2, 0)
    assert any("Fig. 8" in note for note in told["notes"])
