"""What is recommended is what a search through all rows finds."""

import shlex

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bvbedit.errors import BvbError
from bvbedit.study.recommend import command_of, recommend
from bvbedit.study.table import Picture, Row, Table
from tests.study.tables import made_table

# Few values, so that ties are common.
SOME = st.one_of(st.none(), st.sampled_from([0.125, 0.25, 0.5]))
CELLS = st.tuples(
    SOME,
    SOME,
    st.one_of(st.none(), st.sampled_from([100, 200, 300])),
    SOME,
    SOME,
    SOME,
    st.sampled_from(["spline"] * 3 + ["analytic"]),
    st.booleans(),
)


def table_of(cells):
    rows = []
    for n, (grid, nodes, size, speed, pae, seconds, kind, failed) in enumerate(cells):
        rows.append(
            Row(
                material="m" if n % 5 else "other",
                configuration=f"c{n}",
                series="s",
                kind=kind,
                status="failed" if failed and n % 3 == 0 else "done",
                reason="why",
                grid_log_cosine_rms=grid,
                nodes_log_cosine_rms=nodes,
                file_bytes=size,
                evaluations_per_second=speed,
                pictures=(Picture("sphere", pae=pae, seconds=seconds),),
            )
        )
    return Table(
        (*rows, Row(material="m", configuration="x", series="s", kind="spline", status="failed", reason="r")),
        ("sphere",),
    )


def search(table, scene, bound, limit):
    """The answer by going through all rows: (cost, error, configuration), and all that are known."""
    known = []
    for row in table.rows:
        seen = row.picture("sphere")
        if row.material != "m" or row.status != "done" or row.kind != "spline":
            continue
        errors = [row.grid_log_cosine_rms, row.nodes_log_cosine_rms] if scene is None else [seen.pae]
        speed = row.evaluations_per_second
        time = seen.seconds if scene else (None if speed is None else 1e9 / speed)
        cost = time if bound == "max_time" else row.file_bytes
        if None not in (*errors, cost):
            known.append((cost, max(errors), row.configuration))
    good = [p for p in known if (p[1] if bound == "max_error" else p[0]) <= limit]
    best = None
    for cost, error, name in good:
        key = (cost, error) if bound == "max_error" else (error, cost)
        if best is None or key < best[0]:
            best = key, (cost, error, name)
    return (None if best is None else best[1]), known


@given(
    st.lists(CELLS, max_size=14),
    st.sampled_from([None, "sphere"]),
    st.sampled_from(
        [
            ("max_error", 0.25),
            ("max_error", 0.0),
            ("max_bytes", 200),
            ("max_bytes", 50),
            ("max_time", 0.25),
            ("max_time", 4e9),
        ]
    ),
)
def test_the_answer_is_that_of_a_search_through_all_rows(cells, scene, asked):
    table, (bound, limit) = table_of(cells), asked
    best, known = search(table, scene, *asked)
    if best is None:
        with pytest.raises(BvbError) as caught:
            recommend(table, "m", scene=scene, **{bound: limit})
        assert ("No cell of m" in str(caught.value)) == (not known)
        assert "\n" not in str(caught.value)
        return
    advice = recommend(table, "m", scene=scene, **{bound: limit})
    assert (advice.choice.configuration, advice.choice.error) == (best[2], best[1])
    # Beside it stand the best of what is cheaper, and the cheapest of what is better.
    cheaper = min((p for p in known if p[0] < best[0]), key=lambda p: (p[1], p[0]), default=None)
    better = min((p for p in known if p[1] < best[1]), key=lambda p: (p[0], p[1]), default=None)
    for choice, wanted in ((advice.cheaper, cheaper), (advice.better, better)):
        assert (choice and (choice.configuration, choice.error)) == (wanted and (wanted[2], wanted[1]))


def test_what_cannot_be_answered_is_told_with_the_way_out():
    table = made_table(failing=0)
    for words, material, options in (
        ("'chrom' is not in the study. Did you mean chrome?", "chrom", {"max_error": 1.0}),
        ("run bvbedit study with it", "zzz", {"max_error": 1.0}),
        (
            "--max-error and --max-bytes exclude each other. Give one of them",
            "chrome",
            {"max_error": 1.0, "max_bytes": 9},
        ),
        ("--max-error, --max-bytes and --max-time are missing", "chrome", {}),
        ("has no scene 'moon'. It has sphere", "chrome", {"max_error": 1.0, "scene": "moon"}),
        ("the least is an error of 0.", "chrome", {"max_error": 1e-9}),
        ("a file within 10 bytes: the least is ", "chrome", {"max_bytes": 10}),
        ("an evaluation within 1 ns: the least is ", "chrome", {"max_time": 1.0}),
        ("a render time, sphere within 0.1 s", "chrome", {"max_time": 0.1, "scene": "sphere"}),
        ("--max-error is nan. Give a number above zero", "chrome", {"max_error": float("nan")}),
        ("--max-bytes is 0.", "chrome", {"max_bytes": 0}),
    ):
        with pytest.raises(BvbError) as caught:
            recommend(table, material, **options)
        assert words in str(caught.value)


def test_an_analytic_model_is_named_where_it_would_do():
    table = made_table(failing=0)
    assert recommend(table, "chrome", max_error=0.9).analytic.startswith(("ggx", "ward", "phong"))
    assert recommend(table, "chrome", max_bytes=2000).analytic is None


def parsed(line):
    """What the command line would call fit with."""
    from bvbedit.cli import app

    words = shlex.split(line, comments=True)
    assert words[0] == "bvbedit"
    command, bound, *_ = app.parse_args(words[1:], print_error=False, exit_on_error=False)
    assert command.__name__ == "fit"
    return bound.args, bound.kwargs


def test_the_command_is_one_that_fit_understands():
    rows = {row.configuration: row for row in made_table(failing=0).rows}
    args, options = parsed(command_of(rows["paper 20"], "it's chrome.binary", "chrome.bvb"))
    assert [str(a) for a in args] == ["it's chrome.binary", "chrome.bvb"]
    assert options == {
        "chart": "in-out",
        "encoding": "linear",
        "size": (20, 20, 80),
        "degree": 3,
        "knots": "piegl-tiller",
        "precision": "float32",
    }
    _, options = parsed(command_of(rows["half-diff root 16384 bytes"], "a", "b.bvb"))
    assert options["max_bytes"] == 16384
    assert "size" not in options
    odd = Row.of({**rows["paper 20"].to_dict(), "degrees": "3x3x2"}, ["sphere"])
    line = command_of(odd, "a", "b.bvb")
    assert line.endswith("# with degrees 3, 3, 2, by bvbedit.fit")
    assert "degree" not in parsed(line)[1]
