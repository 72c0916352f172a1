"""Freed memory is returned to the system, and collections skip permanent objects."""

from __future__ import annotations

import gc
import platform
import threading
import weakref

import pytest

from explorer.app.session import memory
from explorer.app.session.memory import freeze_objects
from explorer.numerics.compiled import warm_in_background


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="for glibc alone")
def test_system_takes_back_freed_memory() -> None:
    # Too small to be mapped one by one; those that stay lie between those that go.
    kept = [bytearray(3000) for _ in range(70_000)][::70]
    assert memory.trim()
    assert len(kept) == 1000


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
