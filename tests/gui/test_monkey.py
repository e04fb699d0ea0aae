"""Two thousand random actions leave the viewer working and every document replayable."""

import asyncio
from pathlib import Path

import numpy as np

from bvbedit.cli import app
from bvbedit.edit.document import Document, digest
from bvbedit.edit.operations import edit_of_line
from bvbedit_gui.viewer import Viewer
from tests.edit.samples import smooth
from tests.gui.monkey import Monkey, damaged, points
from tests.gui.opengl import needs_opengl
from tests.gui.steps import Steps, steps_measured
from tests.gui.viewing import do, let, with_viewer

pytestmark = needs_opengl

ACTIONS, SEED = 2000, 20081111
# Everything is drawn after each so-manieth action; between them newer wishes overtake older ones.
SETTLE = 20
# Larger models make every step slow, and are no other case.
LARGEST = 4000
# Memory may grow by so much over the last three fifths: a kernel or a scene may be made for the first time there.
GROWTH = 1.5


def folder_of(tmp_path: Path) -> Path:
    folder = tmp_path / "folder"
    (folder / "sub").mkdir(parents=True)
    for name in ("a.bvb", "b.bvb", "sub/c.bvb"):
        Document.of(smooth(), file=str(folder / name)).save(folder / name)
    axes = {f"axis_{n}": np.linspace(0, 1, 5) for n in range(3)}
    np.savez(folder / "m.npz", values=np.ones((5, 5, 5, 3)), valid=np.ones((5, 5, 5), bool), chart="half-diff", **axes)
    damaged(folder / "damaged.bvb")
    (folder / "bad.toml").write_text("nothing = 1\n")
    Document.of(smooth(), file="outside.bvb").save(tmp_path / "outside.bvb")
    (folder / "link.bvb").symlink_to(tmp_path / "outside.bvb")
    return folder


def resident() -> float:
    """Return MiB of memory that the process has."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 2**20


async def used(viewer: Viewer, steps: Steps) -> list[float]:
    """Do the actions; return the memory at five times."""
    monkey = Monkey(viewer, SEED)
    memory = []
    fits = np.linspace(100, ACTIONS - 100, 4).astype(int)
    for n in range(ACTIONS):
        told, action = monkey.draw()
        steps.now = f"{n}: {told}"
        with viewer.state:
            done = action()
            if asyncio.iscoroutine(done):
                await done
        await asyncio.sleep(0)
        if n % SETTLE == 0:
            await viewer.settled()
            viewer.volume.area.img_cols_rows, viewer.preview.area.img_cols_rows  # noqa: B018
        failed = [v for k, v in viewer.state.to_dict().items() if k.startswith("error_") and "failed unexp" in str(v)]
        assert not failed, (steps.now, failed)
        if n in fits:
            await fitted(viewer, stop=n == fits[1])
        document = viewer.document
        if document is not None and (points(document.model.spline) > LARGEST or len(document.edits) > 40):
            await do(viewer, viewer.opening.close, viewer.session.current, discard=True)
            await do(viewer, viewer.opening.open_file, "a.bvb")
        if n % (ACTIONS // 5) == ACTIONS // 5 - 1:
            await viewer.settled()
            memory.append(resident())
    return memory


async def fitted(viewer: Viewer, *, stop: bool) -> None:
    """Fit with a tiny size, or stop at once."""
    await let(viewer, fit_by="size", fit_size=[4, 4, 4], fit_chart="half-diff", fit_encoding="root", fit_of="model")
    fitting = asyncio.ensure_future(do(viewer, viewer.fitting.fit))
    if stop:
        await asyncio.sleep(0.05)
        viewer.fitting.stop()
    await fitting


def replayed(document: Document) -> str:
    """Return the digest of what the lines of a document make of its first model."""
    model = document.at(0)
    for edit in document.edits[: document.position]:
        model = edit_of_line(edit.line()).apply(model)
    return digest(model)


def test_random_actions_leave_documents_that_can_be_replayed_and_saved(tmp_path, capsys):
    folder = folder_of(tmp_path)
    memory: list[float] = []

    async def use(viewer):
        picture = []
        for _ in range(5):
            with steps_measured() as one:
                asyncio.get_running_loop().call_soon(lambda: viewer.volume.area.img_cols_rows)
                await asyncio.sleep(0.01)
            picture.append(one.longest[0][0])
        with steps_measured() as steps:
            memory.extend(await used(viewer, steps))
        await viewer.settled()
        unit = float(np.median(picture))
        with capsys.disabled():
            print(f"\npicture {1000 * unit:.1f} ms; longest steps:")
            for seconds, what in steps.longest:
                print(f"  {1000 * seconds:.0f} ms, {seconds / unit:.1f} pictures: {what}")
            print("MiB after each fifth:", ", ".join(f"{m:.0f}" for m in memory))
        await do(viewer, viewer.editing.cancel)
        for key, opened in viewer.session:
            if opened.document is None:
                continue
            assert replayed(opened.document) == digest(opened.document.model)
            await let(viewer, current=key)
            await let(viewer, save_name=f"end-{key}.bvb", save_precision="float64", save_pdf=False)
            await do(viewer, viewer.saving.save_as, over=True)
            assert viewer.state.error_save == ""
            assert digest(Document.open(folder / f"end-{key}.bvb").model) == digest(opened.document.model)
            app(["history", str(folder / f"end-{key}.bvb")], result_action="return_value")
            assert len(opened.document.lines) <= len(capsys.readouterr().out.splitlines())

    with_viewer(folder, use, "a.bvb", "m.npz", "b.bvb")
    assert {path.name for path in tmp_path.iterdir()} == {"folder", "outside.bvb"}
    assert memory[-1] < GROWTH * memory[1]
