"""The sample recipes do to their materials what they say."""

from pathlib import Path

import numpy as np

from bvbedit import fit
from bvbedit.brdf.charts import HALF_DIFF
from bvbedit.brdf.encodings import Log
from bvbedit.brdf.geometry import spherical
from bvbedit.brdf.materials import material_named
from bvbedit.brdf.metrics import estimate
from bvbedit.brdf.plausibility import check
from bvbedit.edit.recipe import read_recipe
from tests.edit.samples import lofted

FOLDER = Path(__file__).parents[2] / "samples/recipes"


def before_and_after(name, size=(16, 8, 4)):
    """A small model of a recipe's source, and what the recipe makes of it."""
    recipe = read_recipe(FOLDER / f"{name}.toml")
    model = lofted(material_named(recipe.source.sample).brdf, HALF_DIFF, Log(), size)
    return model, recipe.apply(model, recipe.source).model


def at_half_angle(model, degrees):
    """The reflectance (n, 3) at half angles, light and viewer turned by as much to both sides."""
    theta = np.radians(degrees)
    return model.evaluate(spherical(theta, 0.0), np.broadcast_to([0.0, 0.0, 1.0], (len(theta), 3)))


def at_difference(model, degrees):
    """The reflectance (3,) in the mirror direction."""
    theta = np.radians(degrees)
    return model.evaluate(spherical(theta, 0.0), spherical(theta, np.pi))


def width(model):
    """The angle of light at which the highlight has fallen to half of what it is above the body."""
    degrees = np.linspace(0, 80, 801)
    f = at_half_angle(model, degrees).sum(axis=1)
    return degrees[np.argmax(f < 0.5 * (f[0] + f[-1]))]


def test_all_recipes_are_tested_here():
    names = {"worn_gold", "satin_to_gloss", "two_tone_paint", "cleaned_measurement", "plausible_chrome"}
    assert {path.stem for path in FOLDER.glob("*.toml")} == names


def test_worn_gold_is_duller_and_browner():
    before, after = before_and_after("worn_gold")
    assert width(after) > 1.5 * width(before)
    assert at_difference(after, 0)[0] < 0.6 * at_difference(before, 0)[0]
    aside = spherical(np.radians(70), 0.0)  # back towards the light: the half angle is 70 degrees
    red, _, blue = after.evaluate(aside, aside) / before.evaluate(aside, aside)
    assert red > 1.2 * blue


def test_polished_satin_has_a_sharper_highlight():
    before, after = before_and_after("satin_to_gloss")
    assert width(after) < 0.5 * width(before)
    assert at_difference(after, 0).min() > 1.5 * at_difference(before, 0).min()


def test_two_tone_paint_turns_from_violet_to_green():
    _, after = before_and_after("two_tone_paint")
    face, flop = at_difference(after, 5), at_difference(after, 70)
    assert face[2] > face[0] > 1.5 * face[1]
    assert flop[1] > 1.5 * flop[2] > 1.5 * flop[0]


def test_a_cleaned_measurement_is_nearer_to_the_material_than_the_measurement_was():
    recipe = read_recipe(FOLDER / "cleaned_measurement.toml")
    truth = material_named(recipe.source.sample).brdf
    measured = recipe.source.read()
    model = recipe.apply(fit(measured, size=(20, 12, 4), chart="half-diff", encoding="log"), recipe.source).model
    assert estimate(model, truth).nodes.log_cosine_rms < 0.4 * estimate(measured, truth).nodes.log_cosine_rms
    assert not check(model).creates_energy


def test_plausible_chrome_gives_back_no_more_light_than_arrives():
    recipe = read_recipe(FOLDER / "plausible_chrome.toml")
    before, after = before_and_after("plausible_chrome", size=(20, 10, 4))
    bright = recipe.steps[0].apply(before)
    assert max(check(bright).largest_albedo) > 1.05
    assert max(check(after).largest_albedo) <= 1
    assert np.ptp(after.spline.control[:, 0], axis=1).max() < 1e-12 * np.abs(after.spline.control).max()
    assert after.chart is HALF_DIFF
