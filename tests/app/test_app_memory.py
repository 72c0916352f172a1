"""Freed memory is returned to the system, and collections skip permanent objects."""

from __future__ import annotations

import gc
import threading
import weakref

import pytest

from explorer.app.session import memory
from explorer.app.session.memory import freeze_objects
from explorer.numerics.compiled import warm_in_background


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
