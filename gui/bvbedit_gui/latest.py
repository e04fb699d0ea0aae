"""Work in a thread of which only the newest result is wanted: a slider asks faster than pictures are made."""

import asyncio
from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import suppress
from typing import Any


class Latest:
    """Does one thing at a time in an executor; of what is asked for meanwhile only the newest is done."""

    def __init__(
        self,
        executor: Executor,
        failed: Callable[[Exception], object],
        asked: Callable[[], object] = lambda: None,
        rest: float = 0.0,
    ) -> None:
        self._executor = executor
        self._failed, self._asked = failed, asked
        # Seconds to wait before each piece of work: what is less urgent leaves the processors to what is more.
        self._rest = rest
        self._awaited = asyncio.Event()
        self._next: tuple[Callable[[], Any], Callable[[Any], object]] | None = None
        self._task: asyncio.Task[None] | None = None

    @property
    def busy(self) -> bool:
        """Whether something is being done or waits."""
        return self._task is not None and not self._task.done()

    @property
    def waiting(self) -> bool:
        """Whether something newer was asked for than what is being done."""
        return self._next is not None

    def ask(self, work: Callable[[], Any], then: Callable[[Any], object]) -> None:
        """Do ``work`` in the executor, then hand its result to ``then`` in the event loop, unless something newer came.

        What ``work`` raises is handed to ``failed``; ``asked`` is called at once.
        """
        self._asked()
        self._next = work, then
        if not self.busy:
            self._task = asyncio.get_running_loop().create_task(self._run())

    def forget(self) -> None:
        """Drop what waits; the result of what is being done is dropped as well."""
        self._next = (lambda: None), (lambda _: None)

    async def done(self) -> None:
        """Return when nothing is being done and nothing waits; who waits for it lets nothing rest."""
        self._awaited.set()
        try:
            while self._task is not None and not self._task.done():
                await self._task
        finally:
            self._awaited.clear()

    async def _run(self) -> None:
        loop = asyncio.get_running_loop()
        while self._next is not None:
            if self._rest:
                with suppress(TimeoutError):
                    await asyncio.wait_for(self._awaited.wait(), self._rest)
            (work, then), self._next = self._next, None
            try:
                result = await loop.run_in_executor(self._executor, work)
                if self._next is None:
                    then(result)
            except Exception as error:
                if self._next is None:
                    self._failed(error)
