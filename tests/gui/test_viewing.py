"""What tests of the viewer rely on: an exception that trame would only write to the log fails the test."""

import asyncio

import pytest

from tests.gui.opengl import needs_opengl
from tests.gui.viewing import let, with_viewer

pytestmark = needs_opengl


def broken(**_: object) -> None:
    raise ZeroDivisionError("broken")


def test_what_a_callback_of_the_state_raises_is_noticed(tmp_path):
    async def use(viewer):
        viewer.state.change("toast")(broken)
        await let(viewer, toast="hello")

    with pytest.raises(AssertionError, match="escaped: 1") as caught:
        with_viewer(tmp_path, use)
    assert isinstance(caught.value.__cause__, ZeroDivisionError)


def test_what_an_asynchronous_callback_raises_is_noticed(tmp_path):
    async def use(viewer):
        async def later(**_: object) -> None:
            broken()

        viewer.state.change("toast")(later)
        await let(viewer, toast="hello")
        await asyncio.sleep(0.01)

    with pytest.raises(AssertionError, match="escaped: 1"):
        with_viewer(tmp_path, use)


def test_what_a_forgotten_task_raises_is_noticed(tmp_path):
    async def use(_):
        async def later() -> None:
            broken()

        asyncio.get_running_loop().create_task(later())
        await asyncio.sleep(0.01)

    with pytest.raises(AssertionError, match="escaped: 1"):
        with_viewer(tmp_path, use)
