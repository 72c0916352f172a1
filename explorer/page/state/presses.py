"""Presses: the times during which a user holds a control, as each browser reports them.

All events from press to release are one step of the history and one move of the platform,
whatever the pauses between them. Where no press is reported, as with keys, pauses end a step.
"""

from __future__ import annotations

import math
import threading
from collections import deque
from dataclasses import dataclass

# Number of presses kept of each browser: changes may wait for the session during later presses.
MOST_PRESSES = 16


@dataclass(frozen=True)
class Press:
    """One press of one browser: the browser's id, and the number of the press among its own."""

    client: int
    number: int


@dataclass
class _Period:
    number: int
    began: float
    ended: float = math.inf


class Presses:
    """The last presses of every browser."""

    def __init__(self) -> None:
        self._periods: dict[int, deque[_Period]] = {}
        self._lock = threading.Lock()

    def record(self, client: int, number: int, time: float) -> None:
        """Record a press or a release of a browser, given by its id, and its time in seconds.

        The number of the press comes where it begins or goes on, its negative where it ends.
        """
        with self._lock:
            periods = self._periods.setdefault(client, deque(maxlen=MOST_PRESSES))
            last = periods[-1] if periods else None
            if number <= 0:
                if last is not None and last.number == -number:
                    last.ended = time
            elif last is not None and last.number == number:
                last.ended = math.inf
            else:
                periods.append(_Period(number, time))

    def at(self, client: int | None, time: float) -> Press | None:
        """Return the press of a browser at a time; None if there is none, or no such browser."""
        if client is None:
            return None
        with self._lock:
            for period in reversed(self._periods.get(client, ())):
                if period.began <= time:
                    return Press(client, period.number) if time <= period.ended else None
        return None

    def forget(self, client: int) -> None:
        """Forget a browser that has disconnected, even in the middle of a press."""
        with self._lock:
            self._periods.pop(client, None)
