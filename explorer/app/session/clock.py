"""The clock of the server's pauses: what still waits for it is known, and it can be advanced.

Whatever happens after a pause is timed here, so that a test need not sleep: it advances the clock,
or slows it down while it does what a user does within a pause.
Times that viser and the browsers state are those of the machine; `moment_of` turns one into a
time of this clock.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

# Guards all below; notified when the clock is advanced and when a timer is over.
_condition = threading.Condition()
# Seconds of this clock in a second of the machine's, and when that began there.
_pace, _paced_at = 1.0, 0.0
# Seconds by which the clock was ahead then.
_ahead = 0.0
_timers: set[Timer] = set()


class Timer:
    """A call after a pause, on a thread of its own, unless the program ends before.

    Args:
        seconds: The pause.
        call: Function to call.
        arguments: Its arguments.
    """

    def __init__(self, seconds: float, call: Callable[..., None], *arguments: object) -> None:
        self._call, self._arguments = call, arguments
        self._due = now() + seconds
        self._is_waiting = True
        with _condition:
            _timers.add(self)
        threading.Thread(target=self._run, name="timer", daemon=True).start()

    def postpone(self, seconds: float) -> bool:
        """Start the pause again; return whether it was not over yet."""
        with _condition:
            self._due = now() + seconds
            return self._is_waiting

    def finish(self) -> None:
        """End the pause at once."""
        with _condition:
            self._due = now()
            _condition.notify_all()

    def cancel(self) -> None:
        """Call nothing, unless the pause is over."""
        with _condition:
            if self._is_waiting:
                self._is_waiting = False
                self._forget()

    def _run(self) -> None:
        with _condition:
            while self._is_waiting and (left := self._due - now()) > 0.0:
                _condition.wait(left / _pace)
            if not self._is_waiting:
                return
            self._is_waiting = False
        try:
            self._call(*self._arguments)
        finally:
            with _condition:
                self._forget()

    def _forget(self) -> None:
        _timers.discard(self)
        _condition.notify_all()


class Pause:
    """A call after a pause, which may be begun anew before it is over.

    Args:
        seconds: The pause.
        call: Function to call.
    """

    def __init__(self, seconds: float, call: Callable[[], None]) -> None:
        self._seconds, self._call = seconds, call
        self._timer: Timer | None = None
        self._lock = threading.Lock()

    def begin(self) -> None:
        """Begin the pause, anew if it is not over."""
        with self._lock:
            if self._timer is None or not self._timer.postpone(self._seconds):
                self._timer = Timer(self._seconds, self._call)

    def finish(self) -> None:
        """End the pause at once, if there is one."""
        with self._lock:
            if self._timer is not None:
                self._timer.finish()

    def cancel(self) -> None:
        """Call nothing, unless the pause is over."""
        with self._lock:
            if self._timer is not None:
                self._timer.cancel()


def now() -> float:
    """Return the monotonic time in seconds, which tests can shift."""
    return time.monotonic() + _shift()


def moment_of(stamp: float) -> float:
    """Return the time of this clock, in seconds since 1970, for a stamp of the machine's clock."""
    return stamp + _shift()


def advance(seconds: float) -> None:
    """Advance the clock, which ends the pauses that are over by then."""
    global _ahead  # noqa: PLW0603 - the clock is one for the whole process
    with _condition:
        _ahead += seconds
        _condition.notify_all()


def set_pace(pace: float) -> None:
    """Make so many seconds pass on this clock in a second of the machine's."""
    global _ahead, _pace, _paced_at
    with _condition:
        _ahead, _pace, _paced_at = _shift(), pace, time.monotonic()
        _condition.notify_all()


def _shift() -> float:
    """Return by how many seconds the clock is ahead of the machine's."""
    return _ahead + (_pace - 1.0) * (time.monotonic() - _paced_at)


def wait_until_quiet(timeout: float) -> bool:
    """Wait until no timer is pending or at work; return whether none is."""
    with _condition:
        return _condition.wait_for(lambda: not _timers, timeout)
