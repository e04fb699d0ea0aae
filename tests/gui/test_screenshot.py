"""The picture of a model: drawn where OpenGL is there, refused in words where it is not."""

import signal
import subprocess
import sys

import numpy as np
import pytest

import bvbedit
from bvbedit import BvbError
from bvbedit.brdf.analytic import GGX, Lambert, Schlick
from bvbedit.io.png import read_png
from bvbedit_gui import opengl, screenshot
from tests.gui.opengl import needs_opengl

# Which chart and encoding serve best is not what pictures are tested for.
SHARP = {"chart": "half-diff", "encoding": "root"}


@pytest.fixture(scope="module")
def model():
    return bvbedit.fit(GGX(0.3, Schlick((0.9, 0.6, 0.2))), size=(8, 6, 4), **SHARP)


@needs_opengl
def test_a_picture_is_drawn(model, tmp_path):
    path = tmp_path / "p.png"
    screenshot(model, path, measured=GGX(0.3, Schlick((0.9, 0.6, 0.2))), width=800, height=500, title="gold")
    picture = read_png(path)
    assert picture.shape == (500, 800, 3)
    # The lobes' panels are dark, the volume's is white; on them stand words, surfaces and golden lobes.
    lobes, volume = picture[60:, 360:].reshape(-1, 3).astype(int), picture[60:, :340].reshape(-1, 3).astype(int)
    assert np.median(lobes, axis=0).max() < 80
    assert np.median(volume, axis=0).min() > 240
    golden = (lobes[:, 0] > 150) & (lobes[:, 0] > lobes[:, 1] + 20) & (lobes[:, 1] > lobes[:, 2] + 20)
    assert golden.sum() > 1000
    assert len(np.unique(volume, axis=0)) > 200


@needs_opengl
@pytest.mark.parametrize("albedo", [0.0, 0.5])
def test_black_and_constant_models_are_drawn(albedo, tmp_path):
    flat = bvbedit.fit(Lambert((albedo,) * 3), size=(4, 4, 4), **SHARP)
    screenshot(flat, tmp_path / "p.png", width=500, height=400)
    assert read_png(tmp_path / "p.png").shape == (400, 500, 3)


def test_what_cannot_be_written_is_refused_before_drawing(model, tmp_path):
    for path, options, word in (
        (tmp_path / "p.jpg", {}, "suffix"),
        (tmp_path / "no" / "p.png", {}, "no folder"),
        (tmp_path / "p.png", {"width": 10}, "width is 10"),
        (tmp_path / "p.png", {"height": 100_000}, "height is 100000"),
    ):
        with pytest.raises(BvbError, match=word):
            screenshot(model, path, **options)
    assert list(tmp_path.iterdir()) == []


class Child:
    """What a probe that ended so leaves behind."""

    def __init__(self, returncode: int, stderr: bytes = b"") -> None:
        self.returncode, self.stderr = returncode, stderr


@pytest.mark.parametrize(
    ("outcome", "words"),
    [
        (Child(-signal.SIGSEGV), r"ends the process \(SIGSEGV\)"),
        (Child(-250), r"ends the process \(signal 250\)"),
        (Child(1, b"noise\nthe picture came out wrong\n"), "the picture came out wrong"),
        (Child(3), "exit status 3"),
        (subprocess.TimeoutExpired("python", 60), "longer than 60 s"),
        (OSError("no processes left"), "no processes left"),
    ],
    ids=["fault", "signal", "picture", "status", "time", "processes"],
)
def test_without_opengl_it_says_what_to_install(outcome, words, model, monkeypatch, tmp_path):
    def run(*_arguments: object, **_options: object) -> Child:
        if isinstance(outcome, Exception):
            raise outcome
        return outcome

    monkeypatch.setattr(subprocess, "run", run)
    opengl._failure.cache_clear()
    try:
        with pytest.raises(BvbError, match=f"{words}.*Install OpenGL: apt-get install libegl1 libgl1-mesa-dri"):
            screenshot(model, tmp_path / "p.png")
    finally:
        opengl._failure.cache_clear()
    assert list(tmp_path.iterdir()) == []


def test_importing_the_viewer_imports_no_vtk():
    code = "import sys, bvbedit_gui; assert not {'pyvista', 'vtkmodules'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)
