"""Autosaver: saves the session on a thread of its own, a moment after the last change."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from typing import Protocol

from explorer.app.session.history import History
from explorer.app.state.state import State
from explorer.errors import ExplorerError

# Seconds until a save: after the last change, and at the latest after the first unsaved one.
QUIET_SECONDS, LONGEST_SECONDS = 0.3, 2.0
# Seconds until a failed save is tried again without another change.
RETRY_SECONDS = 10.0


class Store(Protocol):
    """What a session is saved in."""

    def save(self, history: History) -> int:
        """Save the session.

        Raises:
            ExplorerError: it cannot be saved.
        """
        ...

    def close(self) -> None:
        """Release the store."""
        ...


class Autosaver:
    """Saves the newest of the histories that are posted.

    Args:
        store: Where the session is saved.
        notify: Called with one line for people when saving begins to fail, and when it works
            again; on the thread that saves.
        quiet, longest, retry: Seconds as in the constants of this module.
    """

    def __init__(
        self,
        store: Store,
        notify: Callable[[str], None],
        *,
        quiet: float = QUIET_SECONDS,
        longest: float = LONGEST_SECONDS,
        retry: float = RETRY_SECONDS,
    ) -> None:
        self._store = store
        self._notify = notify
        self._quiet, self._longest, self._retry = quiet, longest, retry
        self._followed: History | None = None
        self._condition = threading.Condition()
        self._waiting: History | None = None
        # Times by the monotonic clock: when it is saved if nothing changes, and at the latest.
        self._due, self._latest = 0.0, math.inf
        self._is_busy = self._is_stopped = False
        self._problem: str | None = None
        # Number of attempts so far, and the number up to which they are made at once.
        self._attempts = self._urgent = 0
        self._thread = threading.Thread(target=self._run, name="autosave", daemon=True)
        self._thread.start()

    @property
    def problem(self) -> str | None:
        """A line for people on why the last save failed; None if it did not."""
        return self._problem

    def follow(self, state: State, history: History) -> None:
        """Post a history that has changed.

        A search for a better design is no step before it ends: until then the file holds the
        session before it.
        """
        if history is not self._followed and not state.optimisation.is_on:
            self._followed = history
            self.post(history)

    def post(self, history: History) -> None:
        """Queue a history to be saved, in place of one that waits; this returns at once."""
        with self._condition:
            now = time.monotonic()
            if self._waiting is None or self._latest == math.inf:
                self._latest = now + self._longest
            self._waiting = history
            self._due = min(now + self._quiet, self._latest)
            self._condition.notify_all()

    def flush(self, timeout: float = 10.0) -> bool:
        """Save the history that waits now; return whether all that was posted is saved."""
        with self._condition:
            attempts = self._urgent = self._attempts + (2 if self._is_busy else 1)
            self._condition.notify_all()
            self._condition.wait_for(lambda: self._is_idle or self._attempts >= attempts, timeout)
            self._urgent = self._attempts
            return self._is_idle

    def stop(self) -> None:
        """Save the history that waits, end the thread and release the store."""
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
                history, self._waiting = self._waiting, None
                self._is_busy = True
            if history is not None:
                self._save(history)

    @property
    def _is_idle(self) -> bool:
        return self._waiting is None and not self._is_busy

    def _seconds_left(self) -> float | None:
        """Return the seconds until the next save; None if nothing waits."""
        if self._waiting is None:
            return None
        if self._attempts < self._urgent:
            return 0.0
        return max(0.0, self._due - time.monotonic())

    def _save(self, history: History) -> None:
        reason = None
        try:
            self._store.save(history)
        except ExplorerError as error:
            reason = str(error)
        except Exception as error:  # noqa: BLE001 - a fault here must not end the saving
            reason = f"{type(error).__name__}: {error}"
        before = self._problem
        with self._condition:
            self._attempts += 1
            self._problem = None
            if reason is not None:
                line = " ".join(reason.split())
                self._problem = f"The session is not saved: {line}. The explorer keeps trying."
                if self._waiting is None:
                    self._waiting = history
                    self._due, self._latest = time.monotonic() + self._retry, math.inf
        if self._problem is not None and before is None:
            self._notify(self._problem)
        elif self._problem is None and before is not None:
            self._notify("The session is saved again.")
