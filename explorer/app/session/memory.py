"""Memory of a process that runs for long: few arenas, freed memory returned, short collections.

glibc gives each busy thread an arena of its own, up to eight a core, and no other thread uses the
memory freed in it. A page has dozens of threads, of which the interpreter lets one run at a time:
few arenas serve them as well. And glibc returns freed memory to the system only at the end of an
arena, unless `malloc_trim` is called.
"""

from __future__ import annotations

import ctypes
import gc
import sys
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager

# Parameter of mallopt in glibc's malloc.h, and its value.
M_ARENA_MAX = -8
ARENAS = 2
# Seconds between two calls of malloc_trim; each takes some milliseconds.
TRIM_SECONDS = 10.0


def limit_arenas() -> bool:
    """Have glibc use few arenas in this process; return False with another C library."""
    mallopt = _glibc_function("mallopt")
    return mallopt is not None and mallopt(M_ARENA_MAX, ARENAS) == 1


def trim() -> bool:
    """Have glibc return freed memory to the system; return whether it returned any."""
    malloc_trim = _glibc_function("malloc_trim")
    return malloc_trim is not None and malloc_trim(0) == 1


@contextmanager
def trim_repeatedly() -> Generator[None]:
    """Return freed memory to the system now and then, within the context."""
    ended = threading.Event()

    def run() -> None:
        while not ended.wait(TRIM_SECONDS):
            trim()

    thread = threading.Thread(target=run, name="memory", daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


def freeze_objects() -> None:
    """Exclude all present objects from garbage collection.

    Modules, kernels and the page stay anyway, and to visit all of them takes a tenth of a second,
    in the middle of a drag as likely as at any time.
    """
    gc.collect()
    gc.freeze()


def _glibc_function(name: str) -> Callable[..., int] | None:
    """Return a function of glibc; None where another C library is used."""
    return getattr(ctypes.CDLL(None), name, None) if sys.platform == "linux" else None
