"""A viewer without its page, for tests: what the page's variables and methods do."""

import asyncio
from collections.abc import Callable, Coroutine
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from uuid import uuid4

from bvbedit_gui.places import Places
from bvbedit_gui.session import Session, opened_file


def with_viewer(
    folder: Path, use: Callable[[Any], Coroutine[Any, Any, None]], *names: str, passes: bool = False
) -> None:
    """Run ``use`` with a viewer that was started in ``folder`` with the files of these names."""

    async def main() -> None:
        from trame.app import get_server

        from bvbedit_gui.viewer import Viewer

        session = Session(Places.of(folder))
        for name in names:
            session.add(opened_file(folder / name, name))
        viewer = Viewer(get_server(f"test-{uuid4().hex}", client_type="vue3"), session, passes=passes)
        viewer.state.ready()
        try:
            viewer.start()
            await viewer.settled()
            await use(viewer)
        finally:
            viewer.end()

    asyncio.run(main())


async def let(viewer: Any, **variables: Any) -> None:
    """Do what a page does when its controls are moved, and wait until all is drawn."""
    with viewer.state:
        viewer.state.update(variables)
    await asyncio.sleep(0)
    await viewer.settled()


async def do(viewer: Any, method: Callable[..., Any], *args: Any, **options: Any) -> None:
    """Do what a page does when a button is pressed, and wait until all is drawn."""
    with viewer.state:
        done = method(*args, **options)
        if asyncio.iscoroutine(done):
            await done
    await viewer.settled()


@contextmanager
def no_errors(viewer: Any) -> Any:
    """Check that nothing was told to have gone wrong."""
    yield
    told = {k: viewer.state[k] for k in viewer.state.to_dict() if k.startswith("error_") and viewer.state[k]}
    assert not told
