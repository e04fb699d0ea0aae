"""How long each step of the event loop takes: while one runs, no page is answered."""

import asyncio
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any


@dataclass
class Steps:
    """The longest steps so far: processor time of the loop's own thread, which other processes do not lengthen."""

    longest: list[tuple[float, str]] = field(default_factory=list)
    now: str = ""
    """What is being done, for the record."""

    def took(self, seconds: float) -> None:
        """Keep one of the ten longest steps."""
        self.longest = sorted([*self.longest, (seconds, self.now)], reverse=True)[:10]


@contextmanager
def steps_measured() -> Iterator[Steps]:
    """Measure all steps of event loops that run meanwhile."""
    steps = Steps()
    run: Any = asyncio.Handle._run

    def measured(handle: asyncio.Handle) -> None:
        started = time.thread_time()
        run(handle)
        steps.took(time.thread_time() - started)

    asyncio.Handle._run = measured  # type: ignore[method-assign]
    try:
        yield steps
    finally:
        asyncio.Handle._run = run  # type: ignore[method-assign]
