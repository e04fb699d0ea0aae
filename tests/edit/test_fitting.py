"""Fitting as an edit: the net that ``fit`` makes of the present model, told, bounded, and made again bit for bit."""

import functools
import inspect
import typing

import numpy as np
import pytest

import bvbedit
from bvbedit.brdf.charts import FITTING_CHARTS, HALF_DIFF, IN_OUT, grid_points
from bvbedit.brdf.encodings import ENCODINGS
from bvbedit.brdf.losses import LOSSES
from bvbedit.brdf.materials import material_named
from bvbedit.brdf.measured import MeasuredBrdf
from bvbedit.brdf.metrics import estimate
from bvbedit.brdf.plan import ADAPTIVE
from bvbedit.brdf.storage import PRECISIONS
from bvbedit.edit.appearance import Gain, Tint
from bvbedit.edit.document import Document, digest
from bvbedit.edit.fitting import Fit, FitOptions
from bvbedit.edit.recipe import Source, read_recipe, to_toml
from bvbedit.edit.resampling import distance
from bvbedit.io.budget import payload_bytes
from bvbedit.io.bvb import dumps, load_recipe
from bvbedit.run import jobs_of, run
from bvbedit.spline.knots import PLACEMENTS
from tests.edit.samples import smooth, spread
from tests.spline.refusals import refusal

# What saves trying charts and encodings where they are not what is tested.
SHARP = {"chart": "half-diff", "encoding": "root"}
SMALL = Fit(size=(6, 5, 4), knots="averaged", **SHARP)


@functools.cache
def made(edit, model=None):
    """What an edit makes of a model."""
    return edit.apply(smooth() if model is None else model)


@functools.cache
def table():
    """A noisy measurement at few nodes."""
    axes = tuple(np.linspace(0, 1, n) for n in (21, 13, 7))
    wi, wo = HALF_DIFF.to_directions(grid_points(axes))
    valid = np.minimum(wi[:, 2], wo[:, 2]) > 1e-6
    values = np.zeros((len(wi), 3))
    values[valid] = material_named("blue-plastic").brdf.evaluate(wi[valid], wo[valid])
    values *= 1 + 0.02 * np.random.default_rng(3).standard_normal(values.shape)
    return MeasuredBrdf(values.reshape(21, 13, 7, 3), valid.reshape(21, 13, 7), axes, HALF_DIFF)


# ------------------------------------------------------------------------------------------------- the net


def test_it_changes_chart_encoding_degrees_and_storage_as_asked():
    edit = Fit(chart="in-out", encoding="log", size=(5, 5, 6), degrees=(2, 2, 3), metric="fores", precision="float16")
    model = made(edit)
    assert (model.chart, model.encoding.name) == (IN_OUT, "log")
    assert (model.spline.size, model.spline.degrees) == ((5, 5, 6), (2, 2, 3))
    assert model.storage.precision == "float16"


def test_it_is_the_fit_of_the_present_model():
    options = {name: value for name, value in SMALL.to_dict().items() if name != "op"}
    wanted, model = bvbedit.fit(smooth(), **options), made(SMALL)
    assert digest(model) == digest(wanted)
    assert model.storage == wanted.storage
    assert spread(model) == 0


def test_it_tells_how_far_it_is_from_the_model_before():
    model = made(SMALL)
    stored = model.with_spline(model.spline.with_control(model.storage.rounded(model.spline.control)))
    found = estimate(stored, smooth()).to_dict()
    assert model.report["metrics"] == found
    grid, nodes = (f"{found[part]['log_cosine_rms']:.3g}" for part in ("grid", "nodes"))
    assert model.report["notes"][-1] == (
        f"half-diff, root, 6 x 5 x 4: log_cosine_rms to the model before {grid} (grid), {nodes} (nodes)"
    )
    # Chart and encoding are those of the model before.
    assert model.report["refit_error"] == pytest.approx(distance(model, smooth().spline.evaluate), rel=1e-9)
    assert 0 < model.report["refit_error"] < 0.01
    # What is made again is the same to the last byte.
    assert "seconds" not in model.report
    assert dumps(SMALL.apply(smooth())) == dumps(model)


def test_a_large_net_becomes_one_of_the_bytes_that_are_allowed(tmp_path):
    edit = Fit(max_bytes=2200, **SHARP)
    large = Gain(factor=1.3).apply(smooth(size=(20, 12, 8)))
    model = made(edit, large)
    bvbedit.save(model, tmp_path / "small.bvb")
    size = (tmp_path / "small.bvb").stat().st_size
    assert 1500 < size <= 2200
    assert np.prod(model.spline.size) < np.prod(large.spline.size)
    # A history that is saved with it is extra.
    Document.of(large, file=str(tmp_path / "large.bvb")).done(edit, model).save(tmp_path / "told.bvb")
    assert (tmp_path / "told.bvb").stat().st_size > size
    assert "2200" in Document.open(tmp_path / "told.bvb").lines[0]


def test_control_points_and_knots_alone_fit_into_a_payload():
    assert 700 < payload_bytes(made(Fit(max_payload=900, **SHARP))) <= 900


def test_the_smallest_net_that_keeps_a_tolerance():
    model = made(Fit(tolerance=2e-4, knots="dominant", **SHARP))
    errors = model.report["metrics"]
    assert max(errors[part]["log_cosine_rms"] for part in ("grid", "nodes")) < 2.2e-4
    assert np.prod(model.spline.size) < np.prod(smooth().spline.size)


def test_the_papers_configuration_is_made_again_as_well():
    edit = Fit(chart="in-out", encoding="linear", size=(5, 5, 6), knots="piegl-tiller")
    model = made(edit)
    assert model.storage.precision == "float32"
    assert "seconds" not in model.report
    assert model.report["refit_error"] < 0.01


def test_a_black_model_stays_black():
    model = SMALL.apply(Gain(factor=0).apply(smooth()))
    assert not model.spline.control.any()
    assert model.report["refit_error"] == 0


def test_progress_is_told():
    seen = []
    model = SMALL.fitted(smooth(), seen.append)
    assert digest(model) == digest(made(SMALL))
    assert seen == sorted(seen)
    assert (0 < seen[0] < 1, seen[-1]) == (True, 1)


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        (Fit(max_bytes=500, **SHARP), "500 bytes hold no net"),
        (Fit(size=(200, 8, 8), **SHARP), "more than the data carry"),
    ],
)
def test_what_the_model_cannot_become_is_refused(edit, words):
    assert words in refusal(lambda: edit.apply(smooth()))


# ------------------------------------------------------------------------------------------------- the options


def test_options_are_those_of_fit_with_the_same_defaults():
    public = {name: p.default for name, p in inspect.signature(bvbedit.fit).parameters.items()}
    assert FitOptions().options().items() <= public.items()
    assert public.keys() - FitOptions().options().keys() == {
        "brdf", "weights", "scene", "smoothing", "source", "progress",
    }  # fmt: skip
    assert Fit().to_dict() == {"op": "fit"}
    assert FitOptions().to_dict() == {}


def test_choices_are_all_that_there_are():
    known = {
        "chart": ("auto", *FITTING_CHARTS),
        "encoding": ("auto", *ENCODINGS),
        "knots": (*ADAPTIVE, *PLACEMENTS),
        "metric": tuple(LOSSES),
        "precision": ("auto", *PRECISIONS),
    }
    hints = typing.get_type_hints(FitOptions)
    for name, allowed in known.items():
        assert set(typing.get_args(hints[name])) == set(allowed)


@pytest.mark.parametrize("kind", [Fit, FitOptions])
@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"size": (8, 8, 8), "max_bytes": 9000}, "exclude each other"),
        ({"max_payload": 9000, "tolerance": 0.1}, "exclude each other"),
        ({"knots": "random"}, "knots is 'random'"),
        ({"chart": "rusinkiewicz"}, "chart is 'rusinkiewicz'"),
        ({"size": (8, 8)}, "not three whole numbers"),
        ({"size": 8}, "Size: 8 is no list"),
        ({"size": (8, 8, 3)}, "Give at least 4, 4, 4 for degrees [3, 3, 3]"),
        ({"size": (900, 900, 900)}, "too large"),
        ({"size": (8, 8, 8.0)}, "size is 8.0"),
        ({"degrees": (3, 3, 17)}, "degrees is 17"),
        ({"degrees": 3}, "Degrees: 3 is no list"),
        ({"max_bytes": 0}, "max_bytes is 0"),
        ({"tolerance": float("nan")}, "tolerance is nan"),
        ({"thorough": "yes"}, "thorough is 'yes'"),
    ],
)
def test_a_mistake_is_told_when_the_edit_is_made(kind, options, words):
    assert words in refusal(lambda: kind(**options))


# ------------------------------------------------------------------------------------------------- documents


def test_a_result_that_is_known_is_not_made_again(monkeypatch):
    def refuse(*_):
        raise AssertionError

    model = made(SMALL)
    monkeypatch.setattr(Fit, "apply", refuse)
    document = Document.of(smooth()).do(Gain(factor=2)).undo().named("start").done(SMALL, model)
    assert document.model is model
    assert document.lines == ("fit chart=half-diff encoding=root size=6,5,4 knots=averaged",)
    assert (document.position, dict(document.names)) == (1, {"start": 0})
    assert document.undo().redo().model is model


def again(path):
    """The outcome of the recipe of a file, and the file that it makes."""
    recipe = path.with_suffix(".toml")
    told = {key: value for key, value in load_recipe(path).items() if key != "made"}
    recipe.write_text(to_toml(told, ["again.bvb"], bvbedit.load(path).storage.precision))
    (outcome,) = run(jobs_of(recipe))
    assert outcome.error is None
    return outcome, path.with_name("again.bvb")


def test_a_fit_in_a_history_is_made_again_bit_for_bit(tmp_path):
    bvbedit.save(smooth(), tmp_path / "start.bvb", precision="float64")
    start = Document.open(tmp_path / "start.bvb")
    document = start.done(SMALL, made(SMALL)).do(Gain(factor=1.5, theta_h=(0, 20)))
    document.save(tmp_path / "edited.bvb")
    outcome, path = again(tmp_path / "edited.bvb")
    assert digest(bvbedit.load(path)) == digest(bvbedit.load(tmp_path / "edited.bvb"))
    assert any(note.startswith("fit: half-diff, root, 6 x 5 x 4: ") for note in outcome.notes)


def test_a_measurement_that_was_fitted_and_edited_is_made_again_bit_for_bit(tmp_path):
    bvbedit.save(table(), tmp_path / "plastic.npz")
    options = FitOptions(max_bytes=3000, **SHARP)
    model = options.fitted(bvbedit.load(tmp_path / "plastic.npz"))
    assert len(dumps(model)) <= 3000
    document = Document.of_fit(model, options, file=str(tmp_path / "plastic.npz"))
    assert document.source["digest"] == digest(model)
    document = document.do(Gain(factor=1.5, part="highlight")).do(Tint(rgb=(1, 0.9, 0.7)))
    document.save(tmp_path / "edited.bvb")
    _, path = again(tmp_path / "edited.bvb")
    assert digest(bvbedit.load(path)) == digest(bvbedit.load(tmp_path / "edited.bvb"))
    assert load_recipe(path)["source"] == load_recipe(tmp_path / "edited.bvb")["source"]


def test_a_fitted_model_without_edits_is_made_again_too(tmp_path):
    bvbedit.save(table(), tmp_path / "plastic.npz")
    options = FitOptions(size=(7, 5, 4), knots="averaged", **SHARP)
    model = options.fitted(bvbedit.load(tmp_path / "plastic.npz"))
    Document.of_fit(model, options, file=str(tmp_path / "plastic.npz")).save(tmp_path / "plain.bvb")
    _, path = again(tmp_path / "plain.bvb")
    assert digest(bvbedit.load(path)) == digest(bvbedit.load(tmp_path / "plain.bvb"))


def test_a_sample_that_was_measured_and_fitted_is_told_as_its_recipe_reads_it(tmp_path):
    source = Source(sample="chrome", noise=0.02, seed=7)
    options = FitOptions(max_bytes=16384, size=None, thorough=True)
    document = Document.of_fit(smooth(), options, **source.told()).do(Gain(factor=2))
    (tmp_path / "look.toml").write_text(to_toml(document.recipe()))
    recipe = read_recipe(tmp_path / "look.toml")
    assert recipe.source == Source(sample="chrome", noise=0.02, seed=7, digest=digest(smooth()))
    assert recipe.fit == options
    assert recipe.apply(smooth(), recipe.source, fitted=True).source == document.source
