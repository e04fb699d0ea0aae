"""The table of a study: what is written reads back the same, and what is wrong is told with its line and column."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bvbedit.errors import BvbError
from bvbedit.study.table import TIMES, Picture, Row, Table, columns, read_study, read_table, times, to_csv
from tests.study.tables import made_table

SPECIFIED = [
    "material",
    "configuration",
    "series",
    "kind",
    "chart",
    "encoding",
    "knots",
    "precision",
    "degrees",
    "size",
    "status",
    "reason",
    "numbers",
    "file_bytes",
    "payload_bytes",
    "condition",
    "grid_log_cosine_rms",
    "grid_fores",
    "grid_relative_l1",
    "nodes_log_cosine_rms",
    "nodes_fores",
    "nodes_relative_l1",
    "e_max",
    "e_avg",
    "e_max_45",
    "e_avg_45",
    "r_max",
    "r_avg",
    "highlight",
    "albedo_error",
    "sphere_mae",
    "sphere_pae",
    "sphere_psnr",
    "fit_seconds",
    "evaluations_per_second",
    "sphere_seconds",
]
CELL = {"material": "chrome", "configuration": "paper 20", "series": "paper", "kind": "spline", "status": "done"}


@pytest.fixture
def written(tmp_path):
    def write(text):
        path = tmp_path / "results.csv"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return write


def lines(**values):
    """The text of a table with one row."""
    return to_csv([Row.of(CELL | values)])


def test_columns_are_those_of_the_study_and_times_are_last():
    names = [column.name for column in columns(["sphere"])]
    assert names == SPECIFIED
    assert TIMES == ("fit_seconds", "evaluations_per_second")
    assert times(["sphere"]) == tuple(names[-3:])
    assert all(column.meaning for column in columns(["sphere"]))


def test_a_table_reads_back_as_it_was_and_is_written_as_the_same_bytes(written):
    table = made_table(4, scenes=("sphere", "two_words"), failing=0.2)
    assert table.failed
    text = to_csv(table.rows, table.scenes)
    read = read_table(written(text))
    assert read == table
    assert to_csv(read.rows, read.scenes) == text == to_csv(table.rows)
    assert text.count("\n") == len(table.rows) + 1


@given(
    st.fixed_dictionaries(
        {},
        optional={
            "e_max": st.floats(0, allow_infinity=False),
            "condition": st.floats(0),
            "numbers": st.integers(0, 1 << 53),
            "sphere_pae": st.floats(0, 1),
            "reason": st.text(st.characters(exclude_characters="\r\n\0", codec="utf-8"), min_size=1),
        },
    )
)
def test_all_that_a_column_allows_survives(tmp_path_factory, values):
    row = Row.of(CELL | values, ["sphere"])
    path = tmp_path_factory.getbasetemp() / "any.csv"
    path.write_text(to_csv([row], ["sphere"]), encoding="utf-8", newline="")
    assert read_table(path).rows == (row,)


def test_numpy_numbers_are_written_as_numbers(written):
    row = Row(**CELL, e_max=np.float64(0.1), numbers=np.int64(3), pictures=(Picture("s", pae=np.float32(0.5)),))
    assert "0.1,," in to_csv([row])
    assert "float64" not in to_csv([row])
    assert read_table(written(to_csv([row]))).rows[0].picture("s").pae == 0.5


def test_columns_may_stand_in_any_order_and_spreadsheets_may_have_been_at_it(written):
    rows = made_table(1).rows[:3]
    head, *body = to_csv(rows).splitlines()
    turned = [",".join(reversed(line.split(","))) for line in (head, *body)]
    assert read_table(written("\ufeff" + "\r\n".join(turned) + "\r\n")).rows == rows


def test_a_table_without_cells_is_a_table(written):
    assert read_table(written(to_csv([], ["sphere"]))) == Table((), ("sphere",))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("done", "ready"), "line 2, column 'status': 'ready' is none of done, failed."),
        (("0.25", "0,25"), "line 2, column"),
        (("0.25", "nan"), "line 2, column 'e_max': 'nan' is no number."),
        (("0.25", "1_0"), "line 2, column 'e_max': '1_0' is no number."),
        (("0.25", "-1"), "line 2, column 'e_max': -1 is outside of 0 ... inf."),
        (("0.25", "1e999"), "line 2, column 'e_max': inf is not finite."),
        (("384000", "3.5"), "line 2, column 'file_bytes': '3.5' is no whole number"),
        (("384000", "9" * 16), "line 2, column 'file_bytes': '9999999999999999' is no whole number"),
        (("20x20x80", "20x20"), "line 2, column 'size': '20x20' is not like 20x20x80."),
        (("chrome", ""), "line 2, column 'material': is empty."),
        (("e_max,", "e_maxi,"), "line 1: column 'e_maxi' is unknown."),
        (("e_max,", "e_avg,"), "line 1: column 'e_avg' is there twice."),
        (("chrome", '"chr\x00'), "line 2: "),
        (("chrome", '"chrome'), "line 2: unexpected end"),
        (("spline,", "spline,,"), "line 2, column 'evaluations_per_second': 33 values for 32 columns."),
    ],
)
def test_a_mistake_is_told_with_its_line_and_column(written, change, words):
    text = lines(e_max=0.25, file_bytes=384000, size="20x20x80")
    assert change[0] in text
    path = written(text.replace(*change, 1))
    with pytest.raises(BvbError) as caught:
        read_table(path)
    assert str(caught.value).startswith(f"{path}, {words}")
    assert "\n" not in str(caught.value)
    assert str(caught.value).endswith(".")


def test_lines_after_one_in_two_lines_are_still_counted_right(written):
    text = lines(reason="x") + lines(e_max=-0.0).splitlines()[1].replace("paper 20", '"paper\n30"') + "\n"
    with pytest.raises(BvbError, match=r"line 4, column 'configuration': has more than one line"):
        read_table(written(text.replace("paper 20", "paper 10").replace("\n", "\n", 1)))


def test_other_mistakes(written, tmp_path):
    text = lines()
    for broken, words in (
        ("", "is empty"),
        (text.replace("albedo_error,", "").replace(",,", ",", 1), "line 1: column 'albedo_error' is missing"),
        (text + text.splitlines()[1] + "\n", "line 3, column 'configuration': 'paper 20' of 'chrome' stands in line 2"),
        (text.encode("utf-8") + b"chr\xffme\n", "line 3: not UTF-8"),
        (text.replace("done", "failed"), "line 2, column 'reason': is empty. Say why"),
        (text.replace("albedo_error", "albedo_error,sphere_mae"), "column 'sphere_pae' is missing"),
    ):
        with pytest.raises(BvbError, match=words):
            read_table(written(broken))
    with pytest.raises(BvbError, match="holds no study"):
        read_study(tmp_path / "nowhere")


def test_what_a_column_does_not_allow_is_not_written():
    for name, value in (("e_max", np.nan), ("e_max", "1"), ("numbers", 1.5), ("reason", "two\nlines"), ("kind", "?")):
        with pytest.raises(BvbError, match=f"Column '{name}'"):
            Row.of(CELL | {name: value})
        with pytest.raises(BvbError, match=f"Column '{name}'"):
            to_csv([dataclasses.replace(Row(**CELL), **{name: value})])
    with pytest.raises(BvbError, match="no column 'emax'"):
        Row.of(CELL | {"emax": 1.0})
