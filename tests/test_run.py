"""Running recipes: for one material or many, checked before, nothing made twice, nothing half-made."""

import os
import zipfile
from pathlib import Path

import numpy as np
import pytest

import bvbedit
from bvbedit.brdf.analytic import Lambert
from bvbedit.brdf.charts import HALF_DIFF, grid_points
from bvbedit.brdf.measured import MeasuredBrdf
from bvbedit.edit.appearance import Gain, Tint
from bvbedit.edit.document import Document, digest
from bvbedit.edit.recipe import to_toml
from bvbedit.io.bvb import load_recipe
from bvbedit.run import jobs_of, run
from tests.edit import killed
from tests.edit.samples import LOOK, smooth
from tests.spline.refusals import refusal


def write(folder, text=LOOK, name="look.toml"):
    (folder / name).write_text(text)
    return folder / name


@pytest.fixture
def home(tmp_path):
    bvbedit.save(smooth(), tmp_path / "gold.bvb")
    bvbedit.save(Tint(rgb=(0.8, 1, 1.2)).apply(smooth()), tmp_path / "silver.bvb")
    (tmp_path / "out").mkdir()
    return tmp_path


def names(folder):
    return sorted(p.name for p in folder.iterdir())


def made(path):
    return [outcome.status for outcome in run(jobs_of(path))]


def test_a_recipe_makes_its_outputs_of_its_source(home):
    path = write(home, LOOK + 'precision = "float16"\n\n[[outputs]]\nfile = "warm.npz"\n')
    (outcome,) = run(jobs_of(path))
    assert (outcome.status, outcome.error) == ("made", None)
    assert outcome.source == str(home / "gold.bvb")
    assert outcome.outputs == (home / "gold-warm.bvb", home / "warm.npz")
    wanted = Gain(factor=2).apply(Tint(rgb=(1.0, 0.8, 0.6)).apply(bvbedit.load(home / "gold.bvb")))
    model = bvbedit.load(home / "gold-warm.bvb")
    assert model.storage.precision == "float16"
    assert np.array_equal(model.spline.control, model.storage.rounded(wanted.spline.control))
    assert bvbedit.load(home / "warm.npz").chart is HALF_DIFF
    assert Document.open(home / "gold-warm.bvb").lines[:2] == ("tint label=warm rgb=1,0.8,0.6", "gain factor=2")


def test_running_again_makes_equal_bytes(home):
    path = write(home)
    run(jobs_of(path))
    before = (home / "gold-warm.bvb").read_bytes()
    assert run(jobs_of(path), again=True)[0].status == "made"
    assert (home / "gold-warm.bvb").read_bytes() == before


def test_the_recipe_of_a_file_that_was_edited_in_sessions_makes_it_again(home):
    for precision in ("float16", None, "quantised", None):
        source = "edited.bvb" if (home / "edited.bvb").exists() else "gold.bvb"
        Document.open(home / source).do(Tint(hue=12.0)).do(Gain(factor=1.1)).save(
            home / "edited.bvb", precision=precision
        )
    told = load_recipe(home / "edited.bvb")
    (outcome,) = run(jobs_of(write(home, to_toml(told, ["again.bvb"]))))
    assert outcome.error is None
    again = load_recipe(home / "again.bvb")
    assert again.pop("made")
    assert again == told
    nets = [bvbedit.load(home / name) for name in ("edited.bvb", "again.bvb")]
    assert digest(nets[0]) == digest(nets[1])
    assert nets[0].storage == nets[1].storage
    # But for the mark by which it is known to be up to date the files are the same.
    arrays = []
    for name in ("edited.bvb", "again.bvb"):
        with zipfile.ZipFile(home / name) as archive:
            arrays.append({n: archive.read(n) for n in archive.namelist() if n != "meta.json"})
    assert arrays[0] == arrays[1]


def test_a_measurement_is_fitted_first_and_its_history_can_be_run(home):
    axes = tuple(np.linspace(0, 1, n) for n in (13, 9, 5))
    wi, wo = HALF_DIFF.to_directions(grid_points(axes))
    valid = np.minimum(wi[:, 2], wo[:, 2]) > 1e-6
    values = np.zeros((len(wi), 3))
    values[valid] = Lambert((0.5, 0.3, 0.2)).evaluate(wi[valid], wo[valid])
    bvbedit.save(
        MeasuredBrdf(values.reshape(13, 9, 5, 3), valid.reshape(13, 9, 5), axes, HALF_DIFF), home / "paint.npz"
    )
    fit = '[fit]\nchart = "half-diff"\nencoding = "root"\nsize = [6, 5, 4]\nknots = "averaged"\n'
    text = fit + LOOK.replace("gold.bvb", "paint.npz")
    path = write(home, text.replace('source = "paint.npz"\n', "").replace("[fit]", 'source = "paint.npz"\n[fit]'))
    (outcome,) = run(jobs_of(path))
    assert outcome.error is None
    model = bvbedit.load(home / "paint-warm.bvb")
    assert model.spline.size == (6, 5, 4)
    np.testing.assert_allclose(
        model.evaluate([0.3, 0, 1], [-0.2, 0.1, 1]) * np.pi, np.array([0.5, 0.3, 0.2]) * (2, 1.6, 1.2), rtol=0.01
    )
    again = write(
        home, to_toml({k: v for k, v in load_recipe(home / "paint-warm.bvb").items() if k != "made"}, ["b.bvb"])
    )
    (outcome,) = run(jobs_of(again))
    assert outcome.error is None
    assert digest(bvbedit.load(home / "b.bvb")) == digest(model)


# ------------------------------------------------------------------------------------------------- mistakes


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("factor = 2", "factor = -2", ("look.toml, line 8", "factor is -2")),
        ("factor = 2", "factr = 2", ("look.toml, line 10", "step 2: factr is not known. Did you mean factor?")),
        ('op = "gain"', 'op = "gian"', ("look.toml, line 9", "gian")),
        (
            'op = "gain"\nfactor = 2',
            'op = "blend"\npartner = "none.bvb"\nt = 1',
            ("line 8: step 2 (blend): ", "none.bvb does not exist"),
        ),
        ('op = "gain"\nfactor = 2', 'op = "broaden"\nfactor = 2\npart = "body"', ("line 8", "no highlight")),
        ('op = "gain"\nfactor = 2', 'op = "store"\nprecision = "float32"\nstep = 1', ("line 8", "float32 has no step")),
        ('source = "gold.bvb"', "", ("names no source",)),
        ('[[outputs]]\nfile = "{name}-warm.bvb"', "", ("names no outputs",)),
        ("{name}-warm.bvb", "{name}.bvb", ("gold.bvb is a source or a partner itself",)),
        ("{name}-warm.bvb", "none/warm.bvb", ("none is no folder",)),
        ("{name}-warm.bvb", "warm.png", ("warm.png",)),
        ("{name}-warm.bvb", "a.bvb'\n[[outputs]]\nfile = 'a.bvb".replace("'", '"'), ("a.bvb would be made twice",)),
    ],
)
def test_a_mistake_is_refused_before_the_first_step_is_made(old, new, words, home):
    path = write(home, LOOK.replace(old, new, 1))
    before = names(home)
    with pytest.raises(bvbedit.BvbError) as error:
        jobs_of(path)
    message = str(error.value)
    assert "\n" not in message
    assert all(word in message for word in words), message
    assert names(home) == before


def test_a_missing_source_fails_and_writes_nothing(home):
    (outcome,) = run(jobs_of(write(home, LOOK.replace("gold", "lead"))))
    assert outcome.status == "failed"
    assert f"{home / 'lead.bvb'} does not exist" in outcome.error
    assert not (home / "lead-warm.bvb").exists()


def test_a_step_that_cannot_be_made_is_told_with_its_place_and_writes_nothing(home):
    (outcome,) = run(jobs_of(write(home, LOOK.replace('"gain"\nfactor = 2', '"reduce"\naxis = 0\nby = 4'))))
    assert f"{home / 'look.toml'}, line 8: step 2 (reduce): " in outcome.error
    assert names(home) == ["gold.bvb", "look.toml", "out", "silver.bvb"]


def test_a_source_with_another_digest_is_refused_but_not_where_it_is_replaced(home):
    head = f'[source]\nfile = "gold.bvb"\ndigest = "{digest(bvbedit.load(home / "silver.bvb"))}"\n'
    path = write(home, LOOK.replace('source = "gold.bvb"\n', head))
    (outcome,) = run(jobs_of(path))
    assert "gold.bvb is not the model that the recipe began with" in outcome.error
    (outcome,) = run(jobs_of(path, (), [home / "gold.bvb"], home / "out"))
    assert outcome.status == "made"


# ------------------------------------------------------------------------------------------------- many materials


def test_each_material_gets_outputs_of_its_name(home):
    sources = [home / "gold.bvb", home / "silver.bvb"]
    path = write(home, LOOK + '\n[[outputs]]\nfile = "rough.bvb"\nprecision = "float16"\n')
    outcomes = run(jobs_of(path, (), sources, home / "out"))
    assert [o.status for o in outcomes] == ["made"] * 2
    assert [o.source for o in outcomes] == [str(s) for s in sources]
    assert names(home / "out") == ["gold-rough.bvb", "gold-warm.bvb", "silver-rough.bvb", "silver-warm.bvb"]
    # Without a {name} a single output is called after the material alone, without any it is the model.
    for outputs, found in (('[[outputs]]\nfile = "x.bvb"\n', "gold.bvb"), ("", "gold.bvb")):
        target = home / f"{found}-{bool(outputs)}"
        text = LOOK[: LOOK.index("[[outputs]]")] + outputs
        run(jobs_of(write(home, text), (), sources[:1], target))
        assert names(target) == [found]
    # A folder in an output's name is kept.
    (home / "out" / "sub").mkdir()
    run(jobs_of(write(home, LOOK.replace("{name}-warm", "sub/x")), (), sources[:1], home / "out"))
    assert names(home / "out" / "sub") == ["gold.bvb"]


def test_sources_that_would_make_one_file_are_refused(home):
    (home / "a").mkdir()
    (home / "a" / "gold.bvb").write_bytes((home / "gold.bvb").read_bytes())
    sources = [home / "gold.bvb", home / "a" / "gold.bvb"]
    message = refusal(lambda: jobs_of(write(home), (), sources, home / "out"))
    assert all(str(source) in message for source in sources)
    assert "would be made of" in message
    assert names(home / "out") == []


def test_an_output_never_replaces_what_the_recipe_reads(home):
    plain = write(home, LOOK[: LOOK.index("[[outputs]]")])
    assert "is a source or a partner itself" in refusal(lambda: jobs_of(plain, (), [home / "gold.bvb"]))
    # That of one material is the source of another.
    path = write(home, LOOK.replace("{name}-warm", "{name}2"))
    (home / "gold2.bvb").write_bytes((home / "silver.bvb").read_bytes())
    assert "gold2.bvb is a source" in refusal(lambda: jobs_of(path, (), [home / "gold.bvb", home / "gold2.bvb"]))
    partner = LOOK.replace('op = "gain"\nfactor = 2', 'op = "blend"\npartner = "silver.bvb"\nt = 1')
    path = write(home, partner.replace("{name}-warm", "silver"))
    assert "silver.bvb is a source or a partner" in refusal(lambda: jobs_of(path))


def test_one_corrupt_material_does_not_stop_the_others(home):
    (home / "broken.bvb").write_bytes((home / "gold.bvb").read_bytes()[:300])
    sources = [home / "broken.bvb", home / "gold.bvb", home / "none.bvb", home / "silver.bvb"]
    seen = []
    outcomes = run(jobs_of(write(home), (), sources, home / "out"), progress=seen.append)
    assert [o.status for o in outcomes] == ["failed", "made", "failed", "made"]
    assert seen == outcomes
    assert "broken.bvb" in outcomes[0].error
    assert "none.bvb does not exist" in outcomes[2].error
    assert names(home / "out") == ["gold-warm.bvb", "silver-warm.bvb"]


def test_two_processes_make_the_same_files_as_one(home):
    (home / "broken.bvb").write_bytes(b"nothing")
    sources = [home / "gold.bvb", home / "broken.bvb", home / "silver.bvb"]
    path = write(home)
    for workers in (1, 2):
        outcomes = run(jobs_of(path, (), sources, home / str(workers)), workers)
        assert [o.status for o in outcomes] == ["made", "failed", "made"]
    assert names(home / "1") == names(home / "2") == ["gold-warm.bvb", "silver-warm.bvb"]
    for name in names(home / "1"):
        assert (home / "1" / name).read_bytes() == (home / "2" / name).read_bytes()


# ------------------------------------------------------------------------------------------------- up to date


def test_what_is_up_to_date_is_left_alone_until_something_changes(home):
    text = LOOK.replace('op = "gain"\nfactor = 2', 'op = "blend"\npartner = "silver.bvb"\nt = 0.5')
    path, target = write(home, text), home / "gold-warm.bvb"
    assert made(path) == ["made"]
    stamp = target.stat().st_mtime_ns, target.stat().st_ino
    assert made(path) == ["up to date"]
    write(home, "# What it looks like.\n" + text)
    assert made(path) == ["up to date"]
    assert (target.stat().st_mtime_ns, target.stat().st_ino) == stamp

    def settings():
        assert [o.status for o in run(jobs_of(path, ["warm.rgb=1,1,0.5"]))] == ["made"]

    changes = {
        "a setting": settings,
        "the recipe": lambda: write(home, text.replace("t = 0.5", "t = 0.6")),
        "the source": lambda: bvbedit.save(Gain(factor=1.1).apply(smooth()), home / "gold.bvb"),
        "the partner": lambda: bvbedit.save(Gain(factor=1.2).apply(smooth()), home / "silver.bvb"),
        "a lost output": target.unlink,
        "a damaged output": lambda: target.write_bytes(target.read_bytes()[:99]),
        "an edited output": lambda: Document.open(target).do(Gain(factor=2)).save(target),
        "another file in its place": lambda: bvbedit.save(smooth(), target),
    }
    for what, change in changes.items():
        change()
        assert made(path) == ["made"], what
        assert made(path) == ["up to date"], what
    assert run(jobs_of(path), again=True)[0].status == "made"


def test_a_table_is_up_to_date_beside_a_model_that_is(home):
    path = write(home, LOOK + '\n[[outputs]]\nfile = "warm.npz"\n')
    assert made(path) == ["made"]
    assert made(path) == ["up to date"]
    earlier = (home / "gold-warm.bvb").stat().st_mtime_ns - 10**9
    os.utime(home / "warm.npz", ns=(earlier, earlier))
    assert made(path) == ["made"]
    (home / "warm.npz").unlink()
    assert made(path) == ["made"]


def test_tables_alone_are_always_made_for_they_cannot_tell_what_of(home):
    path = write(home, LOOK.replace("{name}-warm.bvb", "warm.npz"))
    assert made(path) == ["made"]
    assert made(path) == ["made"]


# ------------------------------------------------------------------------------------------------- kill -9


def test_a_run_that_is_killed_leaves_whole_files_and_the_next_one_completes(home):
    path = write(home, LOOK + '\n[[outputs]]\nfile = "second.bvb"\nprecision = "float64"\n')
    run(jobs_of(path))
    whole = {name: (home / name).read_bytes() for name in ("gold-warm.bvb", "second.bvb")}
    old = (home / "silver.bvb").read_bytes()
    for n in killed.kills(killed.run_for_ever, home, 0.08, seed=3):
        assert {p.name for p in home.iterdir() if not p.name.endswith(".tmp")} == {
            "gold.bvb",
            "silver.bvb",
            "look.toml",
            "out",
            *whole,
        }
        for name, content in whole.items():
            assert (home / name).read_bytes() in (content, old)
            # The next time there is an older file to be replaced.
            if n % 2:
                (home / name).write_bytes(old)
    assert made(path) in (["made"], ["up to date"])
    assert {name: (home / name).read_bytes() for name in whole} == whole
    assert Path(home / "gold.bvb").exists()
