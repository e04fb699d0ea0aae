"""Renders what the sample recipes start from and what they make: ``python samples/recipes/picture.py recipes.png``."""

import sys
import tempfile
from pathlib import Path

from bvbedit import load
from bvbedit.edit.recipe import read_recipe
from bvbedit.io.png import write_png
from bvbedit.render import render
from bvbedit.render.sheet import sheet
from bvbedit.render.tonemap import tone_map
from bvbedit.run import jobs_of, run

HERE = Path(__file__).parent
SIDE, SPP = 240, 128
SCENE = HERE.parent / "scenes/blob.toml"
RECIPES = ("worn_gold", "satin_to_gloss", "two_tone_paint", "cleaned_measurement", "plausible_chrome")

if __name__ == "__main__":
    rows: tuple[list, list] = ([], [])
    with tempfile.TemporaryDirectory() as folder:
        for name in RECIPES:
            recipe = read_recipe(HERE / f"{name}.toml")
            (outcome,) = run(jobs_of(HERE / f"{name}.toml", folder=Path(folder)))
            assert recipe.source is not None
            models = (recipe.source.read(), load(outcome.outputs[0]))
            for row, model, label in zip(rows, models, (str(recipe.source), name.replace("_", " ")), strict=True):
                row.append((label, tone_map(render(model, SCENE, width=SIDE, height=SIDE, spp=SPP))))
    write_png(Path(sys.argv[1]), sheet([*rows[0], *rows[1]], columns=len(RECIPES)))
