"""Processes that are spawned for long work: what they are given, and that it is taken back."""

import ctypes
import os
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from threading import Barrier, Thread

import pytest

from bvbedit.threads import SPAWNED, spawning

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
