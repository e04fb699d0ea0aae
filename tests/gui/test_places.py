"""Nothing outside of the folder is read or written, however it is named; files that were named at the start are."""

import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bvbedit.errors import BvbError
from bvbedit_gui.places import MATERIALS, MODELS, Places
from bvbedit_gui.session import kept_files
from tests.gui.files import model_file
from tests.gui.opengl import needs_opengl
from tests.gui.viewing import do, let, with_viewer

PARTS = st.sampled_from(
    ["..", ".", "", "a", "sub", "out", "link", "~", "...", " ", "a.bvb", ".a.bvb", "é", "\x00", "\n"]
)
ODD = st.text(max_size=12)
NAMES = st.lists(PARTS | ODD, max_size=6).map("/".join) | ODD.map(lambda t: f"/{t}") | st.just("/" * 3)


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    """A folder with links that lead outside, and files there."""
    root = tmp_path_factory.mktemp("tree").resolve()
    folder, outside = root / "folder", root / "out"
    (folder / "sub").mkdir(parents=True)
    outside.mkdir()
    for path in (folder / "a.bvb", folder / "sub" / "b.bvb", outside / "x.bvb", outside / "named.bvb"):
        path.write_bytes(b"x")
    (folder / "link").symlink_to(outside)
    (folder / "x.bvb").symlink_to(outside / "x.bvb")
    (folder / "inner.bvb").symlink_to(folder / "a.bvb")
    (folder / "loop.bvb").symlink_to(folder / "loop.bvb")
    return root


@given(name=NAMES, suffix=st.sampled_from(["", ".bvb", ".BVB", ".npz", ".txt", ".bvb.", ".bvb/"]))
def test_no_name_leads_outside(tree, name, suffix):
    places = Places.of(tree / "folder")
    try:
        path = places.path(name + suffix, MODELS)
    except BvbError:
        return
    assert path.resolve() == path
    assert os.path.commonpath([path, places.folder]) == str(places.folder)
    assert path.suffix.lower() == ".bvb"


@given(value=st.none() | st.integers() | st.floats() | st.lists(st.text()) | st.dictionaries(st.text(), st.text()))
def test_what_is_no_text_is_no_name(tree, value):
    with pytest.raises(BvbError, match="No file is named"):
        Places.of(tree / "folder").path(value, MODELS)


@pytest.mark.parametrize(
    ("name", "word"),
    [
        ("../out/x.bvb", "outside"),
        ("/etc/passwd", "outside"),
        ("link/x.bvb", "outside"),
        ("link/new.bvb", "outside"),
        ("x.bvb", "outside"),
        ("sub/../../out/x.bvb", "outside"),
        ("~/x.txt", "ends in"),
        ("a.txt", "ends in"),
        ("a", "ends in nothing"),
        (".", "ends in nothing"),
        (" ", "No file"),
        ("a\x00.bvb", "no file name"),
    ],
)
def test_it_is_said_why_a_name_is_refused(tree, name, word):
    with pytest.raises(BvbError, match=word):
        Places.of(tree / "folder").path(name, MODELS)


def test_names_inside_are_allowed_and_links_that_stay_inside(tree):
    places = Places.of(tree / "folder")
    for name in ("a.bvb", "./a.bvb", " a.bvb ", "sub/../a.bvb", "inner.bvb", str(tree / "folder" / "a.bvb")):
        assert places.path(name, MODELS) == tree / "folder" / "a.bvb"
    assert places.path("sub/new.bvb", MODELS) == tree / "folder" / "sub" / "new.bvb"


def test_named_files_are_allowed_and_only_these(tree):
    named = tree / "out" / "named.bvb"
    places = Places.of(tree / "folder", named)
    assert places.path(str(named), MODELS) == named
    assert places.path("link/named.bvb", MODELS) == named
    assert places.path(places.shown(named), MODELS) == named
    with pytest.raises(BvbError, match="outside"):
        places.path(str(tree / "out" / "x.bvb"), MODELS)
    assert places.with_file(tree / "out" / "x.bvb").path("x.bvb", MODELS) == tree / "out" / "x.bvb"


def test_only_what_may_be_opened_is_listed(tree):
    places = Places.of(tree / "folder", tree / "out" / "named.bvb")
    listed = places.files(MATERIALS)
    assert listed == [str(tree / "out" / "named.bvb"), "a.bvb", "sub/b.bvb"]
    for name in listed:
        assert places.path(name, MATERIALS).exists()


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@needs_opengl
@pytest.mark.parametrize("name", ["../out/secret.bvb", "link/secret.bvb", "secret.bvb", "{out}/secret.bvb"])
def test_the_viewer_neither_reads_nor_writes_outside(tmp_path, name):
    folder, outside = tmp_path / "folder", tmp_path / "out"
    folder.mkdir()
    outside.mkdir()
    model_file(folder)
    model_file(outside, "secret.bvb")
    (folder / "link").symlink_to(outside)
    (folder / "secret.bvb").symlink_to(outside / "secret.bvb")
    before = contents(outside)
    name = name.format(out=outside)

    async def use(viewer):
        for method in (viewer.opening.open_file, viewer.opening.recover, viewer.opening.discard_kept):
            viewer.state.error_open = ""
            await do(viewer, method, name)
            assert "outside" in viewer.state.error_open
        assert len(viewer.state.documents) == 1
        await let(viewer, save_name=name)
        await do(viewer, viewer.saving.save_as, over=True)
        assert "outside" in viewer.state.error_save
        await let(viewer, op="blend", knob_blend_partner=name, knob_blend_t=0.5)
        assert "outside" in viewer.state.error_edit
        await do(viewer, viewer.editing.apply)
        assert viewer.session.document.edits == ()
        for scene in (name, name.replace(".bvb", ".toml")):
            await let(viewer, scene=scene)
            assert any(word in viewer.state.error_preview for word in ("outside", "ends in", "does not exist"))

    with_viewer(folder, use, "gold.bvb")
    assert contents(outside) == before


@needs_opengl
def test_what_was_kept_is_neither_read_through_a_link_nor_written_through_it(tmp_path):
    folder, outside = tmp_path / "folder", tmp_path / "out"
    folder.mkdir()
    outside.mkdir()
    model_file(folder)
    model_file(outside, "secret.bvb")
    (folder / ".gold.bvb.autosave").symlink_to(outside / "secret.bvb")
    (folder / ".lost.bvb.autosave").symlink_to(outside / "secret.bvb")
    before = contents(outside)

    async def use(viewer):
        assert viewer.state.kept_files == []
        await do(viewer, viewer.opening.recover, "lost.bvb")
        assert "link to elsewhere" in viewer.state.error_open
        await let(viewer, op="gain", knob_gain_factor=2.0)
        await do(viewer, viewer.editing.apply)

    with_viewer(folder, use, "gold.bvb")
    assert contents(outside) == before
    assert [path.name for path in kept_files(Places.of(folder))] == ["gold.bvb"]
    assert not (folder / ".gold.bvb.autosave").is_symlink()
