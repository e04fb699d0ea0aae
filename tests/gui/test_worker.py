"""The worker's process: results, progress and failures come back, a killed one is told, and the next task works."""

import asyncio
import os
import signal
import time

import pytest

from bvbedit.errors import BvbError
from bvbedit_gui.worker import Stopped, Worker


def counted(n, *, progress):
    for k in range(n):
        progress((k + 1) / n)
    return n, os.getpid()


def failing(kind, *, progress):
    progress(0.5)
    raise {"told": BvbError("No such thing."), "memory": MemoryError(), "other": ZeroDivisionError("oh")}[kind]


def killed(*, progress):
    progress(0.1)
    os.kill(os.getpid(), signal.SIGKILL)


def endless(*, progress):
    progress(0.1)
    while True:
        time.sleep(0.01)


def unsendable(*, progress):
    progress(1)
    return lambda: None


@pytest.fixture
def worker():
    made = Worker()
    yield made
    made.close()


def test_results_and_progress_come_back_from_one_process_that_is_kept(worker):
    async def main():
        shares = []
        result, process = await worker.run(counted, 4, progress=shares.append)
        assert result == 4
        assert shares == [0.25, 0.5, 0.75, 1.0]
        assert process != os.getpid()
        assert (await worker.run(counted, 2))[1] == process
        for kind, word in (("told", "No such thing"), ("memory", "Not enough memory"), ("other", "ZeroDivisionError")):
            with pytest.raises(BvbError, match=word):
                await worker.run(failing, kind)
        assert (await worker.run(counted, 2))[1] == process
        assert not worker.busy

    asyncio.run(main())


def test_a_process_that_was_killed_is_told_and_the_next_task_works(worker):
    async def main():
        with pytest.raises(BvbError, match="has ended") as caught:
            await worker.run(killed)
        assert not isinstance(caught.value, Stopped)
        assert (await worker.run(counted, 3))[0] == 3
        # Killed between two tasks, it is started anew.
        os.kill(worker._process.pid, signal.SIGKILL)
        worker._process.join(5)
        assert (await worker.run(counted, 3))[0] == 3

    asyncio.run(main())


def test_a_task_is_stopped_and_meanwhile_a_second_one_is_refused(worker):
    async def main():
        started = asyncio.Event()
        task = asyncio.ensure_future(worker.run(endless, progress=lambda _: started.set()))
        await started.wait()
        assert worker.busy
        with pytest.raises(BvbError, match="already"):
            await worker.run(counted, 1)
        worker.close()
        with pytest.raises(Stopped, match="Nothing was changed"):
            await task
        assert not worker.busy
        worker.close()
        assert (await worker.run(counted, 3))[0] == 3

    asyncio.run(main())


def test_a_task_that_is_stopped_and_followed_at_once_by_another_is_told_as_stopped(worker):
    async def main():
        started = asyncio.Event()
        task = asyncio.ensure_future(worker.run(endless, progress=lambda _: started.set()))
        await started.wait()
        worker.close()
        worker.warm()
        with pytest.raises(Stopped):
            await task
        assert (await worker.run(counted, 3))[0] == 3

    asyncio.run(main())


def test_what_cannot_be_sent_is_told(worker):
    async def main():
        with pytest.raises(BvbError, match="has ended"):
            await worker.run(unsendable)
        assert (await worker.run(counted, 3))[0] == 3

    asyncio.run(main())
