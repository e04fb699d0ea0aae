"""VTK is used in one thread alone, see ``bvbedit_gui.areas``: else two threads may wait for each other for ever."""

import gc
import threading

import pytest

from tests.edit.samples import smooth
from tests.gui.files import dimmed, model_file
from tests.gui.opengl import needs_opengl
from tests.gui.viewing import do, let, with_viewer

pytestmark = needs_opengl


@pytest.fixture
def folder(tmp_path):
    model_file(tmp_path)
    model_file(tmp_path, "dim.bvb", dimmed(smooth()))
    return tmp_path


async def look_at_all(viewer):
    """Draw everything that volume and lobes can show, while edits are tried."""
    await let(viewer, against="before", op="gain", show_net=True, show_knots=True, what="luminance")
    for n in range(3):
        await let(viewer, **{f"slice_{n}_on": True, "knob_gain_factor": 0.5 + n, "lobe_beside": "wire"})
        await let(viewer, **{f"slice_{n}": 0.3, "theta_i": 20.0 * n, "lobe_beside": "beside", "what": "difference"})
        await do(viewer, viewer.volume.look_from, str(n))
        assert viewer.volume.area.img_cols_rows[0].size
        assert viewer.lobes.area.img_cols_rows[0].size


def test_meshes_are_made_in_the_thread_of_the_events(folder, monkeypatch):
    from pyvista.core.dataobject import DataObject

    threads = set()
    make = DataObject.__init__

    def made(self, *args, **kwargs):
        threads.add(threading.current_thread())
        make(self, *args, **kwargs)

    async def use(viewer):
        monkeypatch.setattr(DataObject, "__init__", made)
        await look_at_all(viewer)
        assert threads == {threading.main_thread()}

    with_viewer(folder, use, "gold.bvb", "dim.bvb")


def test_none_is_left_to_the_garbage_collector_which_runs_in_any_thread(folder):
    from vtkmodules.vtkCommonCore import vtkObjectBase

    async def use(viewer):
        await look_at_all(viewer)
        gc.collect()
        gc.disable()
        gc.set_debug(gc.DEBUG_SAVEALL)
        try:
            await look_at_all(viewer)
            gc.collect()
            assert not [type(left) for left in gc.garbage if isinstance(left, vtkObjectBase)]
        finally:
            gc.set_debug(0)
            gc.garbage.clear()
            gc.enable()

    with_viewer(folder, use, "gold.bvb", "dim.bvb")
