"""Freed memory is returned to the system, and collections skip permanent objects."""

from __future__ import annotations

import gc
import platform
import subprocess
import sys
import threading
import weakref

import pytest

from explorer.app.session import memory
from explorer.app.session.memory import freeze_objects
from explorer.numerics.compiled import warm_in_background

# Prints how many arenas there are once many threads have had memory of their own.
COUNT = """
import ctypes, sys, tempfile, threading
from explorer.app.session.memory import limit_arenas
if sys.argv[1] == "few":
    assert limit_arenas()
everybody = threading.Barrier(16)
def take():
    kept = [bytearray(5000) for _ in range(50)]
    everybody.wait()
threads = [threading.Thread(target=take) for _ in range(16)]
[each.start() for each in threads]
[each.join() for each in threads]
libc = ctypes.CDLL(None)
libc.fopen.restype = ctypes.c_void_p
with tempfile.NamedTemporaryFile() as told:
    file = ctypes.c_void_p(libc.fopen(told.name.encode(), b"w"))
    libc.malloc_info(0, file)
    libc.fclose(file)
    print(open(told.name).read().count("<heap nr="))
"""


# Prints how many bytes the process has less once what it freed is given back.
RETURN = """
import psutil
from explorer.app.session.memory import trim
size = lambda: psutil.Process().memory_info().rss
# Too small to be mapped one by one; those that stay lie between those that go.
kept = [bytearray(3000) for _ in range(70_000)][::70]
before = size()
assert trim()
print(before - size())
"""

only_glibc = pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="for glibc alone")


@only_glibc
def test_threads_share_few_arenas() -> None:
    def count(arenas: str) -> int:
        command = [sys.executable, "-c", COUNT, arenas]
        return int(subprocess.run(command, capture_output=True, text=True, check=True).stdout)

    assert count("few") <= 2 < count("many")


@only_glibc
def test_freed_memory_is_returned_to_the_system() -> None:
    command = [sys.executable, "-c", RETURN]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    # Of 210 MB that were freed.
    assert int(done.stdout) > 100e6


def test_memory_is_trimmed_repeatedly_within_the_context(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    thrice = threading.Semaphore(0)
    monkeypatch.setattr(memory, "TRIM_SECONDS", 0.001)
    monkeypatch.setattr(memory, "trim", thrice.release)
    before = set(threading.enumerate())
    with memory.trim_repeatedly():
        assert all(thrice.acquire(timeout=60.0) for _ in range(3))
    assert set(threading.enumerate()) <= before


def test_frozen_objects_are_not_collected_and_later_ones_are() -> None:
    before = gc.get_freeze_count()
    try:
        warm_in_background(then=freeze_objects).join()
        assert gc.get_freeze_count() > before

        class Ring:
            own: Ring

        ring = Ring()
        ring.own = ring
        last = weakref.ref(ring)
        del ring
        gc.collect()
        assert last() is None
    finally:
        gc.unfreeze()
