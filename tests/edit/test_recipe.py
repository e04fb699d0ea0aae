"""Recipes: read from TOML, changed from outside, and every mistake told with its file, line and step."""

from pathlib import Path

import numpy as np
import pytest

import bvbedit
from bvbedit.edit.appearance import Gain, Tint
from bvbedit.edit.combining import Blend
from bvbedit.edit.document import Document, digest
from bvbedit.edit.fitting import FitOptions
from bvbedit.edit.recipe import Output, Source, read_recipe, to_toml
from bvbedit.edit.structural import InsertKnots
from bvbedit.errors import BvbError
from tests.edit.samples import smooth
from tests.spline.refusals import refusal

HERE = Source(Path("a.bvb"))
GOOD = """\
source = "gold.bvb"

[fit]
max_bytes = 16384

[[steps]]
op = "tint"
label = "warm"
rgb = [1.0, 0.8, 0.6]
theta_h = [0, 20]

[[steps]]
op = "gain"
factor = 2

[[steps]]
op = "blend"
partner = "parts/silver.bvb"
t = 0.25

[[outputs]]
file = "{name}-warm.bvb"
precision = "float16"

[[outputs]]
file = "warm.npz"
"""


@pytest.fixture
def write(tmp_path):
    def call(text):
        path = tmp_path / "look.toml"
        path.write_text(text)
        return path

    return call


def test_a_recipe_is_read_with_its_paths_as_seen_from_its_folder(write, tmp_path):
    recipe = read_recipe(write(GOOD))
    assert recipe.source == Source(tmp_path / "gold.bvb")
    assert recipe.fit == FitOptions(max_bytes=16384)
    assert recipe.fit.to_dict() == {"max_bytes": 16384}
    assert recipe.steps == (
        Tint(label="warm", rgb=(1.0, 0.8, 0.6), theta_h=(0, 20)),
        Gain(factor=2),
        Blend(partner=tmp_path / "parts" / "silver.bvb", t=0.25),
    )
    assert recipe.outputs == (Output("{name}-warm.bvb", "float16"), Output("warm.npz"))
    assert recipe.outputs[0].path(tmp_path / "out", "gold") == tmp_path / "out" / "gold-warm.bvb"


def test_steps_are_changed_from_outside_by_label_and_by_number(write):
    settings = ["warm.rgb=1,0.7,0.5", "warm.theta_h=5..30", "2.factor=3", "3.t=0.1,0.2,0.3", "2.part=body"]
    recipe = read_recipe(write(GOOD), settings)
    assert recipe.steps[0] == Tint(label="warm", rgb=(1.0, 0.7, 0.5), theta_h=(5, 30))
    assert recipe.steps[1] == Gain(factor=3, part="body")
    assert recipe.steps[2].t == (0.1, 0.2, 0.3)


def test_a_label_goes_before_a_number_and_a_label_may_have_dots(write):
    recipe = read_recipe(
        write('[[steps]]\nop = "gain"\nfactor = 1\n[[steps]]\nop = "gain"\nlabel = "1"\nfactor = 1\n'),
        ["1.factor=5"],
    )
    assert [step.factor for step in recipe.steps] == [1, 5]
    dotted = write('[[steps]]\nop = "gain"\nlabel = "a.b"\nfactor = 1\n')
    assert read_recipe(dotted, ["a.b.factor=5"]).steps[0].factor == 5


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("warm", ("'warm'", "warm.factor=2")),
        ("factor=2", ("'factor=2'", "warm.factor=2")),
        (".factor=2", ("'.factor=2'", "3.factor=2")),
        ("warm.=2", ("'warm.=2'", "3.factor=2")),
        ("cold.factor=2", ("'cold'", "Labels: warm", "1 to 3")),
        ("0.factor=2", ("'0'", "1 to 3")),
        ("4.factor=2", ("'4'", "1 to 3")),
        ("2.factor=much", ("look.toml, line 14", "step 2: factor is 'much'")),
        ("2.factor=-1", ("look.toml, line 12", "factor is -1")),
        ("2.factor=nan", ("look.toml", "step 2: factor is nan")),
        ("2.op=gian", ("look.toml", "gian")),
    ],
)
def test_settings_that_meet_nothing_are_refused(setting, words, write):
    message = refusal(lambda: read_recipe(write(GOOD), [setting]))
    assert all(word in message for word in words), message


@pytest.mark.parametrize("steps", ["steps = 3", 'steps = "gain"', "steps = [1]", ""])
def test_settings_of_what_has_no_steps_are_refused(steps, write):
    assert "no step is called '1'" in refusal(lambda: read_recipe(write(f"{steps}\n"), ["1.factor=2"]))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("t = 0.25", "t = nan", ("line 19", "step 3: t is nan")),
        ("t = 0.25", "t = 1001", ("line 16", "t is 1001", "-1000 ... 1000")),
        ("t = 0.25", 't = "half"', ("line 19", "step 3: t is 'half'")),
        ("t = 0.25", "", ("line 16", "step 3: t is missing")),
        ("t = 0.25", "t = 0.25\nspce = 1", ("line 20", "step 3: spce is not known. Did you mean space?")),
        ('op = "blend"', 'op = "blnd"', ("line 17", "step 3: op is 'blnd'", "'blend'")),
        ('op = "blend"', "", ("line 16", "op is missing")),
        ("theta_h = [0, 20]", "theta_h = [20, 0]", ("line 6", "theta_h is [20.0, 0.0]", "smaller one first")),
        ("theta_h = [0, 20]", "theta_h = []", ("line 10", "theta_h is []", "2 numbers")),
        ("theta_h = [0, 20]", "theta_h = [0, 91]", ("line 6", "theta_h is 91", "0 ... 90 degrees")),
        ("max_bytes = 16384", 'max_bytes = "16 KB"', ("line 4", "fit.max_bytes is '16 KB'")),
        ('file = "warm.npz"', 'file = "warm.png"', ("line 25", "warm.png", ".bvb, .binary, .npz")),
        ('file = "warm.npz"', 'file = "warm.npz"\npdf = true', ("line 25", "for .bvb files")),
        ("[[steps]]", "[[step]]", ("step is not known",)),
        ('op = "gain"', 'op = "gain', ("line 13", "Correct the line")),
    ],
)
def test_mistakes_are_told_with_file_line_and_key(old, new, words, write):
    with pytest.raises(BvbError) as error:
        read_recipe(write(GOOD.replace(old, new, 1)))
    message = str(error.value)
    assert "look.toml" in message
    assert "\n" not in message
    assert all(word in message for word in words), message


def test_what_cannot_be_made_tells_file_line_and_number_of_the_step(write):
    path = write('# A look.\n[[steps]]\nop = "gain"\nfactor = 2\n\n[[steps]]\nop = "reduce"\naxis = 0\nby = 4\n')
    message = refusal(lambda: read_recipe(path).apply(smooth(), HERE))
    assert f"{path}, line 6: step 2 (reduce): " in message
    assert "4" in message


def test_a_missing_partner_is_found_before_the_first_step(write, tmp_path):
    recipe = read_recipe(write(GOOD))
    message = refusal(recipe.check_partners)
    assert "look.toml, line 16: step 3 (blend): " in message
    assert f"{tmp_path / 'parts' / 'silver.bvb'} does not exist" in message


def test_a_source_that_has_changed_is_refused_unless_the_digest_is_left_out(write):
    text = f'[source]\nfile = "a.bvb"\ndigest = "{digest(smooth())}"\n[[steps]]\nop = "gain"\nfactor = 2\n'
    recipe = read_recipe(write(text))
    assert recipe.apply(smooth(), HERE).position == 1
    changed = Gain(factor=2).apply(smooth())
    assert "has changed since. Remove digest" in refusal(lambda: recipe.apply(changed, HERE))
    assert read_recipe(write('source = "a.bvb"\nsteps = []\n')).apply(changed, HERE).model is changed


def test_progress_is_told_step_by_step(write):
    seen = []
    read_recipe(write(GOOD.split('[[steps]]\nop = "blend"')[0])).apply(smooth(), HERE, progress=seen.append)
    assert seen == [0.5, 1.0]


def test_a_history_written_as_toml_is_the_recipe_of_its_model(write, tmp_path):
    bvbedit.save(smooth(), tmp_path / "a.bvb", precision="float64")
    document = Document.open(tmp_path / "a.bvb")
    for edit in (
        Gain(factor=0.1 + 0.2, label='it\'s "warm"\\', theta_h=(0, 20.5)),
        InsertKnots(axis=1, at=(1 / 3,)),
        Tint(hue=-12.0, part="body"),
        Blend(partner=tmp_path / "a.bvb", t=(0.1, 0.2, 1.3)),
    ):
        document = document.do(edit)
    recipe = read_recipe(write(to_toml(document.named("end").recipe(), ["b.bvb"])))
    assert recipe.steps == document.edits
    assert recipe.source == Source(tmp_path / "a.bvb", digest(document.at(0)))
    assert recipe.outputs == (Output("b.bvb"),)
    assert np.array_equal(recipe.apply(smooth(), HERE).model.spline.control, document.model.spline.control)
