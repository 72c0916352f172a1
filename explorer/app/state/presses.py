"""Presses: the times during which a hand holds something, as each browser tells of them.

From press to release is one step of the history and one move of the platform, however long the
hand rests in between. Browsers that tell of no press, and keys, are told apart by pauses.
"""

from __future__ import annotations

import threading
from collections import deque
from dataclasses import dataclass

# A page sends the last value of a control up to 0.05 s after the hand let go of it.
LATE_SECONDS = 0.3
# Of one browser; changes may wait for the session while the hand goes on.
MOST_PRESSES = 16


@dataclass(frozen=True)
class Press:
    """One press of one browser.

    Attributes:
        client: The browser's id.
        number: Of the press among those of this browser.
    """

    client: int
    number: int


@dataclass
class _Held:
    number: int
    began: float
    ended: float | None = None

    def holds(self, time: float) -> bool:
        return self.began <= time and (self.ended is None or time <= self.ended + LATE_SECONDS)


class Presses:
    """The last presses of every browser."""

    def __init__(self) -> None:
        self._held: dict[int, deque[_Held]] = {}
        self._lock = threading.Lock()

    def tell(self, client: int, number: int, time: float) -> None:
        """Take note of a press or a release.

        Args:
            client: The browser's id.
            number: The number of the press where it begins or goes on, its negative where it
                ends.
            time: When that happened, in seconds.
        """
        with self._lock:
            held = self._held.setdefault(client, deque(maxlen=MOST_PRESSES))
            last = held[-1] if held else None
            if number <= 0:
                if last is not None and last.number == -number:
                    last.ended = time
            elif last is not None and last.number == number:
                last.ended = None
            else:
                held.append(_Held(number, time))

    def at(self, client: int | None, time: float) -> Press | None:
        """Return the press of a browser at a time; None if it held nothing, or is unknown."""
        if client is None:
            return None
        with self._lock:
            for held in reversed(self._held.get(client, ())):
                if held.began <= time:
                    return Press(client, held.number) if held.holds(time) else None
        return None

    def forget(self, client: int) -> None:
        """Forget a browser that has gone, whether or not it told of a release."""
        with self._lock:
            self._held.pop(client, None)
