"""Every sample scene is rendered, at low cost; what its own code makes is what lies there."""

import runpy
from pathlib import Path

import numpy as np
import pytest

from bvbedit.brdf.materials import MATERIALS
from bvbedit.io.exr import read_exr
from bvbedit.render import render
from bvbedit.render.scene_file import NAMES, read_scene

FOLDER = Path(__file__).parents[1] / "samples" / "scenes"
SCENES = sorted(FOLDER.glob("*.toml"))


@pytest.mark.parametrize("scene", [*NAMES, *SCENES], ids=lambda s: getattr(s, "stem", s))
def test_a_sample_scene_shows_the_model(scene):
    dark, bright = (
        render(MATERIALS[name].brdf, scene, width=24, height=24, spp=2) for name in ("black-rubber", "matte-paper")
    )
    assert np.isfinite(bright).all()
    assert bright.min() >= 0
    assert 0.01 < bright.mean() < 1.5
    assert bright.mean() > 1.05 * dark.mean()


def test_all_that_scenes_can_hold_is_used_by_one():
    used = set()
    for scene in [
        read_scene(path)
        for path in (*SCENES, *(Path(read_scene.__code__.co_filename).parent / "scenes").glob("*.toml"))
    ]:
        used |= {x.kind for x in (*scene.objects, *scene.lights, scene.environment)}
    assert used == {"sphere", "plane", "mesh", "blob", "sun", "point", "rectangle"} | {
        "constant",
        "gradient",
        "sky",
        "panorama",
    }


def test_the_files_beside_the_scenes_are_what_their_code_makes():
    made = runpy.run_path(str(FOLDER / "make.py"))
    assert (FOLDER / "gem.obj").read_text() == made["gem"]()
    np.testing.assert_allclose(read_exr(FOLDER / "panorama.exr"), made["panorama"](), atol=2e-3)
