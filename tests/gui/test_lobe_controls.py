"""Each control of the lobes' panel changes what the scene shows."""

import numpy as np
import pytest

from bvbedit.brdf.encodings import Linear, Log, Root
from bvbedit.brdf.geometry import spherical
from tests.edit.samples import smooth
from tests.gui.files import dimmed, mesh, model_file, points
from tests.gui.opengl import needs_opengl
from tests.gui.viewing import do, let, no_errors, with_viewer

pytestmark = needs_opengl


@pytest.fixture
def folder(tmp_path):
    model_file(tmp_path)
    model_file(tmp_path, "dim.bvb", dimmed(smooth()))
    return tmp_path


def peak(model, theta_i):
    """The largest length of f over directions near the mirror's and on a coarse grid."""
    wo = np.concatenate([spherical(np.linspace(0, 1.5, 181)[:, None], phi) for phi in np.linspace(0, np.pi, 37)])
    return np.linalg.norm(model.evaluate(spherical(theta_i, np.pi), wo.reshape(-1, 3)), axis=-1).max()


def test_the_angle_of_light_turns_the_arrows_and_the_lobe(folder):
    async def use(viewer):
        model = viewer.session.here.model
        with no_errors(viewer):
            for degrees in (0, 30, 70):
                await let(viewer, theta_i=degrees)
                light = points(viewer.lobes, "light").mean(axis=0)
                expected = spherical(np.radians(degrees), np.pi)
                away = np.degrees(np.arccos(min(light @ expected / np.linalg.norm(light), 1.0)))
                assert away < (4 if degrees == 0 else 1)  # at 0 the two arrows stand beside one another
                assert float(viewer.state.lobe_note.split()[1].split("/")[0]) == pytest.approx(
                    peak(model, np.radians(degrees)), rel=0.02
                )

    with_viewer(folder, use, "gold.bvb")


def test_the_radius_is_scaled_as_is_chosen(folder):
    async def use(viewer):
        await let(viewer, theta_i=45)
        radii, words = [], []
        for name, scale in (("linear", Linear()), ("root", Root()), ("log", Log())):
            await let(viewer, lobe_scale=name)
            radii.append(np.linalg.norm(points(viewer.lobes, "model"), axis=1))
            words.append(viewer.state.lobe_note.split(", ")[1])
            top = radii[0].max()
            assert radii[-1].max() == pytest.approx(1, rel=1e-5)
            if name == "root":
                np.testing.assert_allclose(radii[1], scale.encode(radii[0]) / scale.encode(np.array(top)), atol=1e-5)
        assert words == ["linear radius", "cube-root radius", "logarithmic radius"]
        # A soft lobe is shown as it is.
        await let(viewer, lobe_scale="auto")
        np.testing.assert_allclose(np.linalg.norm(points(viewer.lobes, "model"), axis=1), radii[0], atol=1e-6)

    with_viewer(folder, use, "gold.bvb")


def test_what_it_is_compared_with_is_a_wire_or_stands_beside(folder):
    async def use(viewer):
        scene = viewer.lobes.plotter.actors
        await let(viewer, lobe_beside="wire")
        assert not scene["other"].visibility  # nothing to compare with
        await let(viewer, current=1)
        await let(viewer, against="document 2")
        assert mesh(viewer.lobes, "other").n_lines > 10
        assert "compared: peak" in viewer.state.lobe_note
        assert scene["model"].position[0] == 0
        await let(viewer, lobe_beside="beside")
        assert mesh(viewer.lobes, "other").n_lines == 0
        assert scene["model"].position[0] < 0 < scene["other"].position[0]
        ours, theirs = (np.linalg.norm(points(viewer.lobes, name), axis=1).max() for name in ("model", "other"))
        assert ours == pytest.approx(1, rel=1e-5)
        # On one scale: a half of the encoded value is an eighth of the reflectance.
        assert theirs == pytest.approx(1 / 8, rel=0.01)
        await let(viewer, lobe_beside="none")
        assert not scene["other"].visibility
        assert scene["model"].position[0] == 0
        assert "compared" not in viewer.state.lobe_note

    with_viewer(folder, use, "gold.bvb", "dim.bvb")


def test_views_turn_the_camera_and_pictures_change(folder):
    async def use(viewer):
        area = viewer.lobes.area
        pictures = []
        for view in ("oblique", "side", "top"):
            await do(viewer, viewer.lobes.look_from, view)
            pictures.append(area.img_cols_rows[0].copy())
        assert (pictures[0] != pictures[1]).any()
        assert (pictures[1] != pictures[2]).any()

    with_viewer(folder, use, "gold.bvb")
