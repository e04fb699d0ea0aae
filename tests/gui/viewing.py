"""A viewer without its page, for tests: what the page's variables and methods do."""

import asyncio
import gc
import logging
from collections.abc import Callable, Coroutine, Iterator
from contextlib import contextmanager
from functools import cache
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

        asyncio.get_running_loop().set_exception_handler(escaped.of_loop)

        from bvbedit_gui.viewer import Viewer

        leave_modules_alone()
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

    with escaping() as escaped:
        asyncio.run(main())


@cache
def leave_modules_alone() -> None:
    """Keep what was imported out of garbage collections, which take 0.1 s each otherwise."""
    gc.collect()
    gc.freeze()


class Escaped(logging.Handler):
    """Collects the exceptions that trame and the event loop write to the log and otherwise forget."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.errors: list[BaseException] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Keep an exception that is logged; trame's state gives it as an argument."""
        given = record.args if isinstance(record.args, tuple) else ()
        if record.exc_info and record.exc_info[1] is not None:
            self.errors.append(record.exc_info[1])
        self.errors += [value for value in given if isinstance(value, BaseException)]

    def of_loop(self, _: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """Keep an exception of a task that nobody waits for, or of a callback."""
        self.errors.append(context.get("exception") or RuntimeError(context["message"]))

    def check(self) -> None:
        """Raise the first exception that was kept."""
        if self.errors:
            raise AssertionError(f"exceptions that escaped: {len(self.errors)}") from self.errors[0]


@contextmanager
def escaping() -> Iterator[Escaped]:
    """Collect what callbacks of the state and tasks raise inside, and raise the first of it at the end."""
    escaped = Escaped()
    logging.getLogger().addHandler(escaped)
    try:
        yield escaped
        gc.collect()  # tasks tell of their exceptions when they are freed
        gc.freeze()  # the next test is not to look through what this one leaves
    finally:
        logging.getLogger().removeHandler(escaped)
    escaped.check()


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
