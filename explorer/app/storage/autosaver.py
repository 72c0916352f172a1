"""Autosaver: saves the session on a thread of its own, a moment after a change."""

from __future__ import annotations

import threading
from collections.abc import Callable

from explorer.app.session.history import History
from explorer.app.state.state import State
from explorer.app.storage.session_file import SessionFile
from explorer.errors import ExplorerError

# Seconds from the first unsaved change until it is saved.
DELAY_SECONDS = 1.0
# Seconds until a failed save is tried again.
RETRY_SECONDS = 10.0


class Autosaver:
    """Saves the newest history.

    Args:
        store: Where the session is saved.
        notify: Called with one line for people when saving begins to fail, and when it works
            again, on the thread that saves.
        delay, retry: Seconds as in the constants of this module.

    Attributes:
        problem: A line for people on why the last save failed; None if it did not.
    """

    def __init__(
        self,
        store: SessionFile,
        notify: Callable[[str], None],
        *,
        delay: float = DELAY_SECONDS,
        retry: float = RETRY_SECONDS,
    ) -> None:
        self.problem: str | None = None
        self._store = store
        self._notify = notify
        self._delay, self._retry = delay, retry
        self._followed: History | None = None
        # The first lock is held during a save, the second one guards the history that waits.
        self._saving, self._lock = threading.Lock(), threading.Lock()
        self._waiting: History | None = None
        self._changed, self._stopped = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._run, name="autosave", daemon=True)
        self._thread.start()

    def follow(self, state: State, history: History) -> None:
        """Queue a history to be saved if it has changed, in place of one that waits.

        A search for a better design is no step before it ends: until then the file holds the
        session before it.
        """
        if history is not self._followed and not state.optimisation.is_on:
            with self._lock:
                self._followed = self._waiting = history
            self._changed.set()

    def flush(self) -> bool:
        """Save the history that waits; return whether none waits any more."""
        with self._saving:
            history, problem, before = self._waiting, None, self.problem
            if history is None:
                return True
            try:
                self._store.save(history)
            except ExplorerError as error:
                problem = str(error)
            except Exception as error:  # noqa: BLE001 - a fault here must not end the saving
                problem = f"{type(error).__name__}: {error}"
            if problem is None:
                self.problem = None
                with self._lock:
                    if self._waiting is history:
                        self._waiting = None
            else:
                line = " ".join(problem.split())
                self.problem = f"The session is not saved: {line}. The explorer keeps trying."
        if self.problem is not None and before is None:
            self._notify(self.problem)
        elif self.problem is None and before is not None:
            self._notify("The session is saved again.")
        return problem is None

    def stop(self) -> None:
        """Save the history that waits, end the thread and release the store."""
        self._stopped.set()
        self._changed.set()
        self._thread.join(timeout=5.0)
        self.flush()
        self._store.close()

    def _run(self) -> None:
        while self._changed.wait() and not self._stopped.wait(self._delay):
            self._changed.clear()
            while not self.flush() and not self._stopped.wait(self._retry):
                pass
