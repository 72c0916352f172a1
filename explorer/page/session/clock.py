"""The clock of the server's pauses: what still waits for it is known, and it can be advanced.

Whatever happens after a pause is timed here, so that a test need not sleep: it puts another
function in the place of `ahead`, by which the clock runs ahead or slowly.
Times that viser and the browsers state are those of the machine; `moment_of` turns one into a
time of this clock.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

changed = threading.Condition()
"""Guards all below; notified when a pause is over and when the clock is advanced."""

pending: set[object] = set()
"""The pauses that are not over, or whose call is at work."""


class Pause:
    """A call of a function with arguments after a pause, on a thread of its own.

    There is none if the program ends before. The last pause is over when this clock shows `due`.
    """

    def __init__(self, seconds: float, call: Callable[..., None], *arguments: object) -> None:
        self._seconds = seconds
        self._call, self._arguments = call, arguments
        self.due = 0.0
        # The pause that is not over.
        self._current: object = None

    def begin(self) -> None:
        """Begin the pause, anew if it is not over."""
        with changed:
            self.due = now() + self._seconds
            if self._current is not None:
                return
            self._current = current = object()
            pending.add(current)
        threading.Thread(target=self._run, args=(current,), name="pause", daemon=True).start()

    def cancel(self) -> None:
        """Call nothing, unless the pause is over."""
        with changed:
            pending.discard(self._current)
            self._current = None
            changed.notify_all()

    def _run(self, current: object) -> None:
        with changed:
            while self._current is current and (left := self.due - now()) > 0.0:
                changed.wait(left)
            if self._current is not current:
                return
            self._current = None
        try:
            self._call(*self._arguments)
        finally:
            with changed:
                pending.discard(current)
                changed.notify_all()


class Timer(Pause):
    """A pause that begins when it is made."""

    def __init__(self, seconds: float, call: Callable[..., None], *arguments: object) -> None:
        super().__init__(seconds, call, *arguments)
        self.begin()


class Ticker:
    """Calls a function every so many seconds, on a thread of its own, until it returns False.

    These seconds are the machine's: a test neither advances them nor waits for their end.
    """

    def __init__(self, seconds: float, tick: Callable[[], bool]) -> None:
        self._seconds, self._tick = seconds, tick
        self._stopped = threading.Event()
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Begin to call, unless that goes on."""
        with self._lock:
            if self._thread is None:
                self._thread = threading.Thread(target=self._run, name="ticker", daemon=True)
                self._thread.start()

    def stop(self) -> None:
        """End for good."""
        self._stopped.set()

    def _run(self) -> None:
        while not self._stopped.wait(self._seconds):
            with self._lock:
                if not self._tick():
                    self._thread = None
                    return


def ahead() -> float:
    """Return by how many seconds the clock is ahead of the machine's; tests replace this."""
    return 0.0


def now() -> float:
    """Return the monotonic time in seconds."""
    return time.monotonic() + ahead()


def moment_of(stamp: float) -> float:
    """Return the time of this clock, in seconds since 1970, for a stamp of the machine's clock."""
    return stamp + ahead()
