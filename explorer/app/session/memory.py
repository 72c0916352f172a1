"""Memory over a long day: the allocator may not hoard, and the collector has little to look at.

glibc gives each busy thread an arena of its own, up to eight a core, and what is freed in
one is of no use to the others. A page has dozens of threads, of which the interpreter lets
one run at a time: few arenas serve them as well. And of what is freed glibc returns to the
system only what lies at the very end: the rest it is asked to return now and then.
"""

from __future__ import annotations

import ctypes
import gc
import sys
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager

# Of mallopt in glibc's malloc.h.
M_ARENA_MAX = -8
ARENAS = 2
# Seconds between two times that memory is given back; each takes some milliseconds.
GIVE_BACK_SECONDS = 10.0


def limit_arenas() -> bool:
    """Have glibc use few arenas in this process; return whether that is done.

    Other C libraries are left as they are.
    """
    mallopt = _of_glibc("mallopt")
    return mallopt is not None and mallopt(M_ARENA_MAX, ARENAS) == 1


def give_back() -> bool:
    """Have glibc return freed memory to the system; return whether it returned any."""
    malloc_trim = _of_glibc("malloc_trim")
    return malloc_trim is not None and malloc_trim(0) == 1


@contextmanager
def given_back() -> Generator[None]:
    """Give back freed memory now and then, as long as this lasts."""
    ended = threading.Event()

    def attend() -> None:
        while not ended.wait(GIVE_BACK_SECONDS):
            give_back()

    thread = threading.Thread(target=attend, name="memory", daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


def keep_for_good() -> None:
    """Have the collector never look at what is there now.

    Modules, kernels and the page stay anyway, and to look at all of them takes a tenth of a
    second, in mid-drag as likely as at any time.
    """
    gc.collect()
    gc.freeze()


def _of_glibc(name: str) -> Callable[..., int] | None:
    """Return a function of glibc; None where another C library is used."""
    return getattr(ctypes.CDLL(None), name, None) if sys.platform == "linux" else None
