"""The commands that make pictures: layouts, when they stop, and fits for a scene."""

import json

import numpy as np
import pytest
from PIL import Image

import bvbedit
from bvbedit.brdf.sampling import half_vector_density
from bvbedit.cli import layouts
from bvbedit.io.exr import read_exr

SMALL = ("--width", 16, "--height", 12, "--spp", 2)
PAPER = ("--chart", "in-out", "--encoding", "linear", "--knots", "piegl-tiller")
TWO = """
[camera]
position = [0.0, -8.0, 2.0]
look_at = [0.0, 0.0, 1.0]
vertical_fov_degrees = 30.0
[[objects]]
kind = "sphere"
centre = [-1.2, 0.0, 1.0]
[[objects]]
kind = "sphere"
centre = [1.2, 0.0, 1.0]
material = 2
[environment]
kind = "constant"
"""


def told(run, *arguments):
    status, out, err = run(*arguments, "--json")
    assert (status, err) == (0, "")
    return json.loads(out)


def test_a_row_is_the_pictures_of_each(run, folder, tmp_path):
    satin, grey, row = folder / "satin.bvb", folder / "grey.bvb", tmp_path / "row.exr"
    report = told(run, "render", satin, grey, row, "--row", *SMALL)
    assert (report["width"], report["height"], report["spp"]) == (32, 12, 2)
    for n, file in enumerate((satin, grey)):
        told(run, "render", file, tmp_path / "one.exr", *SMALL)
        np.testing.assert_array_equal(read_exr(row)[:, 16 * n : 16 * n + 16], read_exr(tmp_path / "one.exr"))


def test_a_scene_of_two_models_shows_both_in_the_order_that_they_are_named(run, folder, tmp_path):
    (tmp_path / "two.toml").write_text(TWO)
    satin, grey = folder / "satin.bvb", folder / "grey.bvb"
    options = ("--scene", tmp_path / "two.toml", "--width", 40, "--height", 20, "--spp", 4)
    assert told(run, "render", satin, grey, tmp_path / "a.exr", *options)["width"] == 40
    told(run, "render", grey, satin, tmp_path / "b.exr", *options)
    a, b = (read_exr(tmp_path / name) for name in ("a.exr", "b.exr"))
    # In even light a picture is symmetric but for its noise: the balls have changed places.
    assert np.abs(a - b[:, ::-1]).mean() < 0.02
    assert np.abs(a - b).mean() > 0.03


def test_too_few_models_for_a_scene_are_refused(run, folder, tmp_path):
    (tmp_path / "two.toml").write_text(TWO)
    status, out, err = run("render", folder / "satin.bvb", tmp_path / "p.png", "--scene", tmp_path / "two.toml")
    assert (status, out) == (1, "")
    assert "asks for 2 models, 1 given" in err


def test_differences_are_none_of_a_model_from_itself_and_told_of_another(run, folder, tmp_path):
    satin, grey, out = folder / "satin.bvb", folder / "grey.bvb", tmp_path / "d.png"
    report = told(run, "render", satin, satin, grey, out, "--difference", *SMALL)
    same, other = report["differences"]
    assert (same["file"], same["mae"], same["pae"], same["psnr"]) == ("satin.bvb", 0, 0, None)
    assert other["file"] == "grey.bvb"
    assert 0 < other["mae"] < other["pae"]
    assert Image.open(out).size == (report["width"], report["height"])


def test_swatches_are_in_rows(run, folder, tmp_path):
    files = [folder / "grey.bvb"] * (layouts.SWATCHES + 1)
    report = told(run, "render", *files, tmp_path / "s.png", "--swatches", *SMALL)
    assert report["width"] < (layouts.SWATCHES + 1) * 16 + layouts.SWATCHES * 8
    assert report["height"] > 2 * 12


@pytest.mark.parametrize("option", [("--noise", 10), ("--time-limit", 1e-9)])
def test_a_picture_stops_when_it_is_good_enough_or_has_taken_long_enough(run, folder, tmp_path, option):
    report = told(run, "render", folder / "grey.bvb", tmp_path / "p.png", *SMALL[:4], "--spp", 512, *option)
    assert report["spp"] <= 2


@pytest.mark.parametrize("layout", [(), ("--row",), ("--difference",), ("--swatches",)])
def test_ctrl_c_keeps_what_there_is(run, folder, tmp_path, monkeypatch, layout):
    """It comes after the first pass of the second picture, of two, or of the only one."""
    begun = []

    def interrupted(*arguments, **options):
        begun.append(arguments)
        passes = bvbedit.render.render_passes(*arguments, **options)
        yield next(passes)
        if len(begun) == (2 if layout else 1):
            raise KeyboardInterrupt
        yield from passes

    monkeypatch.setattr(layouts, "render_passes", interrupted)
    files = [folder / "satin.bvb", folder / "grey.bvb"] if layout else [folder / "satin.bvb"]
    report = told(run, "render", *files, tmp_path / "p.png", *layout, *SMALL)
    assert report["stopped"]
    assert report["spp"] == 1
    assert Image.open(tmp_path / "p.png").size == (report["width"], report["height"])


def test_ctrl_c_before_the_first_pass_leaves_nothing(run, folder, tmp_path, monkeypatch):
    def interrupted(*_arguments, **_options):
        raise KeyboardInterrupt
        yield

    monkeypatch.setattr(layouts, "render_passes", interrupted)
    status, out, err = run("render", folder / "satin.bvb", tmp_path / "p.png")
    assert (status, out) == (130, "")
    assert "Interrupted" in err
    assert list(tmp_path.iterdir()) == []


def test_what_there_is_of_a_long_picture_is_written_on_the_way(run, folder, tmp_path, monkeypatch):
    monkeypatch.setattr(layouts, "PATIENCE", 0.0)
    written, real = [], layouts._write
    monkeypatch.setattr(layouts, "_write", lambda *a: (written.append(a[0]), real(*a)))
    told(run, "render", folder / "grey.bvb", tmp_path / "p.png", *SMALL[:4], "--spp", 4)
    assert len(written) >= 3


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["render", "{here}/grey.bvb", "{here}/grey.bvb", "{out}/p.png", "--row", "--swatches"], "exclude"),
        (["render", "{here}/grey.bvb", "{out}/p.png", "--difference"], "two files"),
        (["render", "{here}/grey.bvb", "{here}/grey.bvb", "{out}/p.exr", "--difference"], ".png"),
        (["render", "{here}/grey.bvb", "{out}/p.png", "--noise", "0"], "noise is 0"),
        (["render", "{here}/grey.bvb", "{out}/p.png", "--time-limit", "-1"], "time_limit is -1"),
        (["fit", "{here}/small.npz", "{out}/m.bvb", "--image-tolerance", "0.1"], "--scene"),
        (
            [
                "fit",
                "{here}/small.npz",
                "{out}/m.bvb",
                "--scene",
                "sphere",
                "--image-tolerance",
                "0.1",
                "--size",
                "6,6,6",
            ],
            "exclude",
        ),
        (["fit", "{here}/small.npz", "{out}/m.bvb", "--scene", "mars"], "mars"),
        (
            ["fit", "{here}/small.npz", "{out}/m.bvb", "--scene", "sphere", *PAPER],
            "weighs all alike",
        ),
    ],
    ids=lambda a: " ".join(a[3:]).replace("/", "|") if isinstance(a, list) else None,
)
def test_what_cannot_be_shown_or_fitted_is_refused_in_one_line(run, folder, tmp_path, arguments, words):
    status, out, err = run(*(a.format(here=folder, out=tmp_path) for a in arguments))
    assert (status, out, err.count("\n")) == (1, "", 1)
    assert words in err
    assert list(tmp_path.iterdir()) == []


def test_a_fit_for_a_scene_within_an_image_tolerance_tells_what_it_is(run, folder, tmp_path):
    options = ("--scene", "furnace", "--image-tolerance", 0.05, "--chart", "half-diff", "--encoding", "root")
    report = told(run, "fit", folder / "small.npz", tmp_path / "m.bvb", *options, "--pdf")
    assert report["image"]["pae"] <= 0.05
    assert report["image"]["scene"] == "furnace"
    stored = bvbedit.load(tmp_path / "m.bvb")
    assert not np.array_equal(stored.density.spline.control, half_vector_density(stored).spline.control)
