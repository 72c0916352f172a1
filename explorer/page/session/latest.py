"""A thread that handles what is posted to it, the newest item of each key only.

viser runs callbacks at the same time and in no order, so none of them computes. They post to one
thread, which handles all that waits in one go.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from typing import Generic, TypeVar

Item = TypeVar("Item")


class LatestWins(Generic[Item]):
    """A thread, with a name, that handles what is posted, the newest item of each key only.

    `handle` is called with all items that wait, in the order of their stamps. An exception from it
    would end the thread, so it must not raise any.
    """

    def __init__(self, handle: Callable[[Sequence[Item]], None], name: str) -> None:
        self._handle = handle
        self._waiting: dict[object, tuple[float, Item]] = {}
        self._condition = threading.Condition()
        self._busy = False
        self.is_stopped = False
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def post(self, key: object, stamp: float, item: Item) -> None:
        """Queue an item, in place of one with the same key that waits, as events of a slider have.

        An item with the stamp of an earlier event than that of the waiting one is dropped.
        """
        with self._condition:
            waiting = self._waiting.get(key)
            if waiting is None or waiting[0] <= stamp:
                self._waiting[key] = (stamp, item)
                self._condition.notify_all()

    @property
    def waiting(self) -> set[object]:
        """The keys of the items that wait."""
        with self._condition:
            return set(self._waiting)

    def wait_until_idle(self, timeout: float) -> bool:
        """Wait until no item waits and none is handled; return whether that is so."""
        with self._condition:
            return self._condition.wait_for(
                lambda: not self._waiting and not self._busy, timeout=timeout
            )

    def stop(self) -> None:
        """Drop the items that wait and end the thread."""
        with self._condition:
            self.is_stopped = True
            self._waiting.clear()
            self._condition.notify_all()
        if threading.current_thread() is not self._thread:
            self._thread.join(timeout=5.0)

    def _run(self) -> None:
        while True:
            with self._condition:
                self._busy = False
                self._condition.notify_all()
                self._condition.wait_for(lambda: self._waiting or self.is_stopped)
                if self.is_stopped:
                    return
                items = [item for _, item in sorted(self._waiting.values(), key=lambda w: w[0])]
                self._waiting.clear()
                self._busy = True
            self._handle(items)
