"""The allocator hoards nothing, and the collector has little to look at."""

from __future__ import annotations

import gc
import platform
import subprocess
import sys
import threading
import weakref

import pytest

from explorer.app.session import memory
from explorer.app.session.memory import keep_for_good
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
from explorer.app.session.memory import give_back
size = lambda: psutil.Process().memory_info().rss
# Too small to be mapped one by one; those that stay lie between those that go.
kept = [bytearray(3000) for _ in range(70_000)][::70]
before = size()
assert give_back()
print(before - size())
"""

only_glibc = pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="for glibc alone")


@only_glibc
def test_many_threads_share_few_arenas() -> None:
    def count(arenas: str) -> int:
        command = [sys.executable, "-c", COUNT, arenas]
        return int(subprocess.run(command, capture_output=True, text=True, check=True).stdout)

    assert count("few") <= 2 < count("many")


@only_glibc
def test_what_is_freed_goes_back_to_the_system() -> None:
    command = [sys.executable, "-c", RETURN]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    # Of 210 MB that were freed.
    assert int(done.stdout) > 100e6


def test_memory_is_given_back_again_and_again_until_the_end(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    thrice = threading.Semaphore(0)
    monkeypatch.setattr(memory, "GIVE_BACK_SECONDS", 0.001)
    monkeypatch.setattr(memory, "give_back", thrice.release)
    before = set(threading.enumerate())
    with memory.given_back():
        assert all(thrice.acquire(timeout=60.0) for _ in range(3))
    assert set(threading.enumerate()) <= before


def test_what_is_kept_for_good_is_looked_at_no_more_and_what_comes_later_is() -> None:
    before = gc.get_freeze_count()
    try:
        warm_in_background(then=keep_for_good).join()
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
