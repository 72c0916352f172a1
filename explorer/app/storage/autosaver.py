"""Saving while people work: on a thread of its own, a moment after the last change."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from typing import Protocol

from explorer.app.storage.document import Document
from explorer.errors import ExplorerError

# Seconds after the last change, and after the first that is not saved, until it is.
QUIET_SECONDS, LONGEST_SECONDS = 0.3, 2.0
# Seconds until what could not be saved is tried again without another change.
AGAIN_SECONDS = 10.0


class Store(Protocol):
    """What a session is saved in."""

    def save(self, document: Document) -> int:
        """Save it.

        Raises:
            ExplorerError: it cannot be saved.
        """
        ...

    def close(self) -> None:
        """Let go of it."""
        ...


class Autosaver:
    """Saves what is posted, the newest only.

    Args:
        store: Where to.
        told: Called with one line for people when saving begins to fail, and when it works
            again; on the thread that saves.
        quiet, longest, again: Seconds, see above.
    """

    def __init__(
        self,
        store: Store,
        told: Callable[[str], None],
        *,
        quiet: float = QUIET_SECONDS,
        longest: float = LONGEST_SECONDS,
        again: float = AGAIN_SECONDS,
    ) -> None:
        self._store = store
        self._told = told
        self._quiet, self._longest, self._again = quiet, longest, again
        self._condition = threading.Condition()
        self._waiting: Document | None = None
        # When it is to be saved, and at the latest, by the monotonic clock.
        self._due, self._latest = 0.0, math.inf
        self._is_busy = self._is_failing = self._is_stopped = False
        # How often it was tried to save, and until how often that is to be at once.
        self._tries = self._hurried = 0
        self._thread = threading.Thread(target=self._run, name="autosave", daemon=True)
        self._thread.start()

    @property
    def is_failing(self) -> bool:
        """Whether what was posted last could not be saved."""
        return self._is_failing

    def post(self, document: Document) -> None:
        """Leave a session to be saved; it replaces one that waits. This returns at once."""
        with self._condition:
            now = time.monotonic()
            if self._waiting is None or self._latest == math.inf:
                self._latest = now + self._longest
            self._waiting = document
            self._due = min(now + self._quiet, self._latest)
            self._condition.notify_all()

    def flush(self, timeout: float = 10.0) -> bool:
        """Save what waits now; say whether everything that was posted is saved."""
        with self._condition:
            tries = self._hurried = self._tries + (2 if self._is_busy else 1)
            self._condition.notify_all()
            self._condition.wait_for(lambda: self._is_idle or self._tries >= tries, timeout)
            self._hurried = self._tries
            return self._is_idle

    def stop(self) -> None:
        """Save what waits, end the thread and let go of the store."""
        self.flush()
        with self._condition:
            self._is_stopped = True
            self._condition.notify_all()
        self._thread.join(timeout=5.0)
        self._store.close()

    def _run(self) -> None:
        while True:
            with self._condition:
                self._is_busy = False
                self._condition.notify_all()
                while not self._is_stopped and (left := self._seconds_left()) != 0.0:
                    self._condition.wait(left)
                if self._is_stopped:
                    return
                document, self._waiting = self._waiting, None
                self._is_busy = True
            if document is not None:
                self._save(document)

    @property
    def _is_idle(self) -> bool:
        return self._waiting is None and not self._is_busy

    def _seconds_left(self) -> float | None:
        """Return how long to wait until the next is saved; None if nothing waits."""
        if self._waiting is None:
            return None
        if self._tries < self._hurried:
            return 0.0
        return max(0.0, self._due - time.monotonic())

    def _save(self, document: Document) -> None:
        problem = None
        try:
            self._store.save(document)
        except ExplorerError as error:
            problem = str(error)
        except Exception as error:  # noqa: BLE001 - a fault here must not end the saving
            problem = f"{type(error).__name__}: {error}"
        was_failing = self._is_failing
        with self._condition:
            self._tries += 1
            self._is_failing = problem is not None
            if problem is not None and self._waiting is None:
                self._waiting = document
                self._due, self._latest = time.monotonic() + self._again, math.inf
        if problem is not None and not was_failing:
            line = " ".join(problem.split())
            self._told(f"What you do is not saved: {line}. It goes on trying.")
        elif problem is None and was_failing:
            self._told("What you do is saved again.")
