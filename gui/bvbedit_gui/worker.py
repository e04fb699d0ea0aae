"""A process for what takes long: the page goes on meanwhile, sees how far it is, and can stop it at once.

A fit holds the interpreter's lock for seconds, and NLopt cannot be interrupted; a process can.
"""

import asyncio
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

from bvbedit.errors import BvbError
from bvbedit.processes import spawning

# What is done in the process: called with its arguments and a function that is told the share done. It and its
# arguments must pickle.
Task = Callable[..., Any]
# Seconds between looks at what the process says.
PAUSE = 0.03


class Stopped(BvbError):  # noqa: N818  (it is what the user wanted)
    """The user has stopped the work."""


class Worker:
    """One process, started when it is first needed and kept, as its start takes longer than many a fit."""

    def __init__(self) -> None:
        self._process: BaseProcess | None = None
        self._pipe: Connection | None = None
        self.busy = False

    def warm(self) -> None:
        """Start the process, so that the first task does not wait for it."""
        if self._process is not None and self._process.is_alive():
            return
        self._pipe, other = get_context("spawn").Pipe()
        process = get_context("spawn").Process(target=_serve, args=(other,), daemon=True)
        with spawning():
            process.start()
        self._process = process
        other.close()

    async def run(self, task: Task, *args: Any, progress: Callable[[float], object] | None = None) -> Any:
        """Return what ``task`` returns. Raises BvbError as the task does, where it is stopped, and where it ends.

        One task at a time: a second one is refused.
        """
        if self.busy:
            raise BvbError("Something is being worked on already. Stop it, or wait.")
        self.busy = True
        process = None
        try:
            self.warm()
            pipe, process = self._pipe, self._process
            assert pipe is not None
            assert process is not None
            pipe.send((task, args))
            while True:
                while not pipe.poll():
                    if not process.is_alive() and not pipe.poll():
                        raise EOFError
                    await asyncio.sleep(PAUSE)
                kind, value = pipe.recv()
                if kind == "done":
                    return value
                if kind == "failed":
                    raise BvbError(value)
                if progress is not None:
                    progress(value)
        except (EOFError, OSError):
            # Another process may have been started since.
            if self._process is not process:
                raise Stopped("Stopped. Nothing was changed.") from None
            self.close()
            raise BvbError("The process that worked on it has ended, perhaps for want of memory. Try less.") from None
        finally:
            self.busy = False

    def close(self) -> None:
        """End the process, and what it is working on with it."""
        process, self._process, self._pipe = self._process, None, None
        if process is not None:
            process.kill()
            process.join(5)


def _serve(pipe: Connection) -> None:
    """Work on one task after the other, until nobody is left to ask."""
    import signal

    # Ctrl-C in the terminal is for the server, which ends us.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with suppress(EOFError, OSError):
        while True:
            task, args = pipe.recv()
            try:
                result = task(*args, progress=lambda share: pipe.send(("progress", float(share))))
            except BvbError as error:
                pipe.send(("failed", str(error)))
            except MemoryError:
                pipe.send(("failed", "Not enough memory. Ask for less."))
            except Exception as error:
                pipe.send(("failed", f"It failed unexpectedly: {error!r}. Please report this."))
            else:
                pipe.send(("done", result))
