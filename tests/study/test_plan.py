"""Plans: what people write becomes configurations, and mistakes are told with their line."""

import pytest

from bvbedit import BvbError
from bvbedit.study.plan import Series, default_plan, read_plan


def plan_of(tmp_path, text):
    path = tmp_path / "plan.toml"
    path.write_text(text)
    return read_plan(path)


def test_options_with_several_values_are_gone_through(tmp_path):
    plan = plan_of(
        tmp_path,
        """
        [[series]]
        name = "s"
        chart = ["in-out", "half-diff"]
        encoding = "root"
        size = [[4, 5, 6], [7, 8, 9]]
        degrees = [2, 2, 2]
        """,
    )
    names = [c.name for c in plan.configurations]
    assert len(names) == len(set(names)) == 4
    assert {c.series for c in plan.configurations} == {"s"}
    assert [(c.fit.chart, c.fit.size) for c in plan.configurations] == [
        ("in-out", (4, 5, 6)),
        ("in-out", (7, 8, 9)),
        ("half-diff", (4, 5, 6)),
        ("half-diff", (7, 8, 9)),
    ]
    assert all(c.fit.degrees == (2, 2, 2) for c in plan.configurations)


def test_a_triple_is_one_size_and_not_three():
    assert [c.fit.size for c in Series("s", size=(4, 5, 6)).configurations()] == [(4, 5, 6)]


def test_the_default_plan_has_forty_configurations_the_paper_s_among_them():
    plan = default_plan()
    assert len(plan.configurations) == 40
    paper = next(c for c in plan.configurations if c.name == "paper 20x20x80")
    assert paper.fit.to_dict() == {
        "chart": "in-out",
        "encoding": "linear",
        "size": [20, 20, 80],
        "knots": "piegl-tiller",
        "precision": "float32",
    }
    assert sum(c.analytic is not None for c in plan.configurations) == 10


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("stride = 4", "stride is 4"),
        ("", "no configurations"),
        ("[[series]]\nname = 's'\nknots = 'none'", "series s"),
        ("[[series]]\nname = 's'\nmax_bytes = 4096\ntolerance = 0.1", "exclude each other"),
        ("[[series]]\nname = 's'\nchrat = 'in-out'", "line 3"),
        ("[[series]]\nname = 's'\n[[series]]\nname = 's'", "Two configurations"),
        ("[analytic]\nmodels = ['phong']", "no analytic model"),
        ("[pictures]\nside = 1\n[[series]]\nname='s'", "side"),
        ("[[series]]\nname = ''", "no name"),
    ],
)
def test_mistakes_are_told_in_one_line(tmp_path, text, word):
    with pytest.raises(BvbError, match=word) as caught:
        plan_of(tmp_path, text)
    assert "plan.toml" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_scenes_are_seen_from_the_plan_s_folder(tmp_path):
    plan = plan_of(tmp_path, "[pictures]\nscenes = ['sphere', 'own.toml']\n[[series]]\nname = 's'")
    assert plan.pictures.scenes == ("sphere", str(tmp_path / "own.toml"))
