"""Processes that share long work: what they are given, what becomes of it, and that Ctrl-C ends them at once."""

import ctypes
import os
import signal
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from multiprocessing import get_context
from pathlib import Path
from threading import Barrier, Lock, Thread

import pytest

from bvbedit.processes import SPAWNED, as_done, processes, spawning

THREADS = 6


def heaps_of_threads() -> int:
    """Return how many heaps glibc has when several threads have allocated at once."""
    together = Barrier(THREADS)

    def allocate() -> None:
        together.wait()
        held = [bytearray(5000) for _ in range(100)]
        together.wait()
        del held

    threads = [Thread(target=allocate) for _ in range(THREADS)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    libc = ctypes.CDLL(None)
    libc.fopen.restype = ctypes.c_void_p
    with tempfile.NamedTemporaryFile() as told:
        stream = ctypes.c_void_p(libc.fopen(told.name.encode(), b"w"))
        libc.malloc_info(0, stream)
        libc.fclose(stream)
        return told.read().count(b"<heap nr=")


def spawned(work):
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        return pool.submit(work).result()


@pytest.mark.skipif(not hasattr(ctypes.CDLL(None), "malloc_info"), reason="glibc alone tells its heaps")
def test_threads_of_spawned_processes_share_two_heaps():
    assert spawned(heaps_of_threads) > 2
    with spawning():
        assert spawned(heaps_of_threads) == 2


@pytest.mark.parametrize("before", [None, "3"])
def test_what_is_set_for_them_is_taken_back(monkeypatch, before):
    for name in SPAWNED:
        monkeypatch.delenv(name, raising=False) if before is None else monkeypatch.setenv(name, before)
    main = sys.modules["__main__"]
    with spawning():
        assert {name: os.environ[name] for name in SPAWNED} == SPAWNED
        assert sys.modules["__main__"] is not main
    assert {os.environ.get(name) for name in SPAWNED} == {before}
    assert sys.modules["__main__"] is main


def squared(n: int) -> int:
    if n < 0:
        raise ValueError(n)
    return n * n


def lost(n: int) -> int:
    if n == 2:
        os._exit(1)
    return n


def begun_for_ever(place: Path) -> None:
    place.touch()
    time.sleep(600)


def begin_for_ever(folder: Path) -> None:
    with processes(2) as executor:
        for _ in as_done(executor, begun_for_ever, [folder / str(n) for n in range(6)], 2):
            pass


@pytest.mark.parametrize("at_once", [1, 2, 5, None])
def test_each_item_is_yielded_once_with_what_became_of_it(at_once):
    items = [3, -1, 0, 7, -2]
    with processes(2) as executor:
        done = list(as_done(executor, squared, items, at_once))
    assert sorted(n for n, _ in done) == list(range(len(items)))
    for n, future in done:
        if items[n] < 0:
            assert isinstance(future.exception(), ValueError)
        else:
            assert future.result() == items[n] ** 2


def test_no_more_are_handed_over_than_at_once():
    lock, now, most = Lock(), 0, 0

    def work(_: int) -> None:
        nonlocal now, most
        with lock:
            now += 1
            most = max(most, now)
        time.sleep(0.002)
        with lock:
            now -= 1

    with ThreadPoolExecutor(8) as executor:
        assert len(list(as_done(executor, work, range(40), 3))) == 40
        assert most == 3
        # What is not begun when nobody asks any more is left undone.
        begun = []
        asked = as_done(executor, begun.append, range(40), 2)
        next(asked)
        asked.close()
    assert len(begun) <= 2


def test_a_lost_process_is_told_of_all_that_is_left():
    with processes(1) as executor:
        done = dict(as_done(executor, lost, range(5), 1))
    assert sorted(done) == list(range(5))
    assert [done[n].result() for n in range(2)] == [0, 1]
    assert all(isinstance(done[n].exception(), BrokenProcessPool) for n in range(2, 5))


def test_ctrl_c_ends_what_is_being_done_and_begins_no_more(tmp_path):
    told = tmp_path / "told"
    inside = tmp_path / "begun"
    inside.mkdir()
    command = [
        sys.executable,
        "-c",
        "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "from pathlib import Path; from tests.test_processes import begin_for_ever\n"
        "begin_for_ever(Path(sys.argv[1]))",
        str(inside),
    ]
    with told.open("w") as stream:
        child = subprocess.Popen(
            command, stderr=stream, start_new_session=True, cwd=Path(__file__).parents[1], env=os.environ
        )
        try:
            while len(list(inside.iterdir())) < 2:
                assert child.poll() is None, told.read_text()
                time.sleep(0.01)
            os.killpg(child.pid, signal.SIGINT)
            assert child.wait(60) != 0
        finally:
            with suppress(ProcessLookupError):
                os.killpg(child.pid, signal.SIGKILL)
    assert len(list(inside.iterdir())) == 2
    # One for the process itself, none of its workers.
    assert told.read_text().count("KeyboardInterrupt") == 1
