"""Signals that ask a process to end: work that looks for them ends by itself, and keeps its result.

Python would raise Ctrl-C at any point, and an exception within a finaliser is lost. Other signals
would end the process at once.
"""

from __future__ import annotations

import signal
import threading
from contextlib import AbstractContextManager
from typing import Any

# Windows has no SIGHUP, which comes where a terminal is closed.
NAMES = ("SIGINT", "SIGTERM", "SIGHUP")


class Interruption(AbstractContextManager["Interruption"]):
    """Request to end, by Ctrl-C, SIGTERM or SIGHUP, that comes within a `with` block.

    A second signal has its usual effect, and one that is ignored, as Ctrl-C in a background job,
    stays so.
    """

    def __init__(self) -> None:
        self._asked = threading.Event()
        self._usual: dict[int, Any] = {}

    def __enter__(self) -> Interruption:
        """Take the signals; only the main thread can."""
        if threading.current_thread() is threading.main_thread():
            for number in filter(None, (getattr(signal, name, None) for name in NAMES)):
                if signal.getsignal(number) is not signal.SIG_IGN:
                    self._usual[number] = signal.signal(number, self._ask)
        return self

    def __exit__(self, *_: object) -> None:
        """Give the signals their usual effect again."""
        while self._usual:
            signal.signal(*self._usual.popitem())

    def is_asked(self) -> bool:
        """Whether a signal has come."""
        return self._asked.is_set()

    def wait(self, seconds: float) -> bool:
        """Wait for a signal, at most so long; return whether one has come."""
        return self._asked.wait(seconds)

    def _ask(self, *_: object) -> None:
        self._asked.set()
        self.__exit__()
