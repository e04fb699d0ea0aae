"""Renders the sample scenes into one picture: ``python samples/scenes/picture.py scenes.png``."""

import sys
from pathlib import Path

from bvbedit.brdf.materials import material_named
from bvbedit.io.png import write_png
from bvbedit.render import render
from bvbedit.render.sheet import sheet
from bvbedit.render.tonemap import tone_map

HERE = Path(__file__).parent
SIDE, SPP, COLUMNS = 300, 128, 3
SCENES = ("blob", "swatches", "backlit", "panorama", "gem")
MATERIAL = "gold-metallic-paint"

if __name__ == "__main__":
    brdf = material_named(MATERIAL).brdf
    shown = [(name, HERE / f"{name}.toml") for name in SCENES] + [("studio", "studio")]
    pictures = [
        (name, tone_map(render(brdf, scene, width=SIDE, height=SIDE, spp=SPP, noise=0.005))) for name, scene in shown
    ]
    write_png(Path(sys.argv[1]), sheet(pictures, columns=COLUMNS))
