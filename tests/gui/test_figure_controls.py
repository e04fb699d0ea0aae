"""Each control of the figures' panel changes the plot or the numbers."""

import re

import pytest

from tests.edit.samples import smooth
from tests.gui.files import dimmed, model_file, table_file
from tests.gui.opengl import needs_opengl
from tests.gui.viewing import let, no_errors, with_viewer

pytestmark = needs_opengl


@pytest.fixture
def folder(tmp_path):
    model_file(tmp_path)
    model_file(tmp_path, "dim.bvb", dimmed(smooth()))
    table_file(tmp_path)
    return tmp_path


def test_each_control_of_the_line_draws_another_plot(folder):
    async def use(viewer):
        seen = {viewer.state.figure_svg}
        changes = (
            {"line_axis": 1},
            {"line_axis": 2},
            {"line_scale": "linear"},
            {"probe": [0.1, 0.2, 0.3]},
            {"figure_size": {"size": {"width": 700, "height": 400}}},
            {"theme": "dark"},
            {"against": "document 2"},
        )
        await let(viewer, current=1)
        with no_errors(viewer):
            for change in changes:
                await let(viewer, **change)
                assert viewer.state.figure_svg.startswith("<svg")
                assert viewer.state.figure_svg not in seen, change
                seen.add(viewer.state.figure_svg)

    with_viewer(folder, use, "gold.bvb", "dim.bvb")


def test_the_place_along_the_line_itself_changes_no_curve(folder):
    async def use(viewer):
        curves = []
        for u in (0.1, 0.9):
            await let(viewer, line_axis=0, probe=[u, 0.5, 0.5])
            curves.append(re.findall(r"<path[^>]*>|<polyline[^>]*>", viewer.state.figure_svg)[-3:])
        assert curves[0]
        assert curves[0] == curves[1]

    with_viewer(folder, use, "gold.bvb")


def test_the_size_is_kept_within_what_can_be_read(folder):
    async def use(viewer):
        for given, width in ((1, 380), (700, 700), (1e9, 1600), (None, 380), ("wide", 380)):
            await let(viewer, figure_size={"size": {"width": given, "height": given}})
            assert re.search(rf'viewBox="0 0 {width} ', viewer.state.figure_svg)
        for nonsense, width in ((None, 380), ({"size": 3}, 380), ([7, 8], 380)):
            await let(viewer, figure_size=nonsense)
            assert re.search(rf'viewBox="0 0 {width} ', viewer.state.figure_svg)

    with_viewer(folder, use, "gold.bvb")


def test_albedo_and_numbers_are_of_the_model_and_of_what_is_compared(folder):
    async def use(viewer):
        line = viewer.state.figure_svg
        await let(viewer, current=1)
        await let(viewer, figure="albedo")
        alone = viewer.state.figure_svg
        assert alone != line
        await let(viewer, against="document 2")
        assert viewer.state.figure_svg != alone
        await let(viewer, figure="numbers")
        rows = {row["label"]: row["value"] for row in viewer.state.figure_rows}
        assert rows["size"] == "8 x 6 x 5"
        assert "log-cosine RMS, grid" in rows
        await let(viewer, against="nothing")
        assert "log-cosine RMS, grid" not in {row["label"] for row in viewer.state.figure_rows}

    with_viewer(folder, use, "gold.bvb", "dim.bvb")


def test_of_a_measurement_there_is_a_line_alone(folder):
    async def use(viewer):
        assert viewer.state.figure_svg.startswith("<svg")
        before = viewer.state.figure_svg
        await let(viewer, line_axis=1)
        assert viewer.state.figure_svg != before
        # Going over from a model's numbers puts the line back.
        await let(viewer, current=1)
        await let(viewer, figure="numbers")
        await let(viewer, current=2)
        assert viewer.state.figure == "line"

    with_viewer(folder, use, "gold.bvb", "table.npz")
