"""Of what is asked for quickly only the newest arrives; what fails is told, and the next thing is done."""

import asyncio
from concurrent.futures import ThreadPoolExecutor
from threading import Event

import pytest

from bvbedit_gui.latest import Latest


@pytest.fixture
def pool():
    with ThreadPoolExecutor(2) as executor:
        yield executor


def test_only_the_newest_result_arrives(pool):
    async def main():
        started, go, done, got = Event(), Event(), [], []

        def first():
            started.set()
            go.wait(10)
            return "first"

        latest = Latest(pool, got.append)
        latest.ask(first, got.append)
        while not started.is_set():
            await asyncio.sleep(0)
        for n in range(20):
            latest.ask(lambda n=n: done.append(n) or n, got.append)
        assert latest.busy
        assert latest.waiting
        go.set()
        await latest.done()
        assert got == [19]
        assert done == [19]
        assert not latest.busy

    asyncio.run(main())


def test_failures_are_handed_on_and_the_next_is_done(pool):
    async def main():
        failed, got = [], []
        latest = Latest(pool, failed.append)
        latest.ask(lambda: 1 / 0, got.append)
        await latest.done()
        assert [type(error) for error in failed] == [ZeroDivisionError]
        latest.ask(lambda: 3, got.append)
        await latest.done()
        assert got == [3]
        # What is done with a result may fail as well.
        latest.ask(lambda: 4, lambda _: [][0])
        await latest.done()
        assert [type(error) for error in failed] == [ZeroDivisionError, IndexError]

    asyncio.run(main())


def test_the_failure_of_what_is_not_wanted_any_more_is_not_told(pool):
    async def main():
        go, failed, got = Event(), [], []

        def broken():
            go.wait(10)
            raise ZeroDivisionError

        latest = Latest(pool, failed.append)
        latest.ask(broken, got.append)
        await asyncio.sleep(0.01)
        latest.ask(lambda: "newer", got.append)
        go.set()
        await latest.done()
        assert failed == []
        assert got == ["newer"]

    asyncio.run(main())


def test_what_is_forgotten_does_not_arrive_and_new_wishes_do(pool):
    async def main():
        go, got = Event(), []
        latest = Latest(pool, got.append)
        latest.ask(lambda: go.wait(10), lambda _: got.append("old"))
        await asyncio.sleep(0.01)
        latest.forget()
        go.set()
        await latest.done()
        assert got == []
        latest.forget()
        assert not latest.busy
        latest.ask(lambda: "new", got.append)
        await latest.done()
        assert got == ["new"]

    asyncio.run(main())


def test_what_is_asked_for_while_a_result_is_shown_is_done(pool):
    async def main():
        got = []
        latest = Latest(pool, got.append)

        def then(value):
            got.append(value)
            if value < 3:
                latest.ask(lambda: value + 1, then)

        latest.ask(lambda: 0, then)
        await latest.done()
        assert got == [0, 1, 2, 3]

    asyncio.run(main())


def test_it_rests_unless_it_is_waited_for(pool):
    async def main():
        began = []
        # An hour: only what waits for it can end it.
        latest = Latest(pool, began.append, rest=3600.0)
        latest.ask(lambda: began.append("work"), lambda _: None)
        for _ in range(10):
            await asyncio.sleep(0.001)
        assert latest.busy
        assert began == []
        await latest.done()
        assert began == ["work"]
        short = Latest(pool, began.append, rest=0.01)
        short.ask(lambda: None, began.append)
        while short.busy:
            await asyncio.sleep(0.001)
        assert began == ["work", None]

    asyncio.run(main())
