"""The files that an explorer keeps in the user's data folder: designs, session and a log.

Several explorers may share the folder.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass

from explorer.app.session.history import History
from explorer.app.storage.library import Library
from explorer.app.storage.session_file import SessionFile
from explorer.errors import ExplorerError
from explorer.files.json_text import one_line

# Seconds from the first unsaved change of the session until it is saved.
DELAY_SECONDS = 1.0
# Seconds until a failed save is tried again.
RETRY_SECONDS = 10.0


@dataclass(frozen=True)
class UserData:
    """The designs and the session of the user, with messages on files that could not be used.

    Without a history of a session to continue, a new one begins.
    """

    library: Library
    store: SessionFile
    history: History | None = None
    messages: tuple[str, ...] = ()


def open_user_data(*, resume: bool) -> UserData:
    """Return the contents of the user's data folder; `resume` continues the newest session."""
    store = SessionFile()
    history, messages = store.resume() if resume else (None, ())
    return UserData(Library(), store, history, messages)


class Autosaver:
    """Saves the newest history on a thread of its own, a moment after a change.

    Args:
        notify: Called with one line for people when saving begins to fail, and when it works
            again, on the thread that saves.

    Attributes:
        problem: A line for people on why the last save failed; None if it did not.
    """

    def __init__(self, store: SessionFile, notify: Callable[[str], None]) -> None:
        self.problem: str | None = None
        self._store = store
        self._notify = notify
        self._newest: History | None = None
        self._saved: History | None = None
        self._saving = threading.Lock()
        self._changed, self._stopped = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._run, name="autosave", daemon=True)
        self._thread.start()

    def follow(self, history: History) -> None:
        """Queue a history to be saved if it has changed, in place of one that waits."""
        if history is not self._newest:
            self._newest = history
            self._changed.set()

    def flush(self) -> bool:
        """Save the history that waits; return whether it is saved, or none waits."""
        with self._saving:
            history, before = self._newest, self.problem
            if history is None or history is self._saved:
                return True
            try:
                self._store.save(history)
                self._saved, self.problem = history, None
            except Exception as error:  # noqa: BLE001 - a fault here must not end the saving
                kind = "" if isinstance(error, ExplorerError) else f"{type(error).__name__}: "
                line = one_line(f"{kind}{error}")
                self.problem = f"The session is not saved: {line}. The explorer keeps trying."
        problem = self.problem
        if (problem is None) != (before is None):
            self._notify(problem or "The session is saved again.")
        return problem is None

    def stop(self) -> None:
        """Save the history that waits, end the thread and release the store."""
        self._stopped.set()
        self._changed.set()
        self._thread.join(timeout=5.0)
        self.flush()
        self._store.close()

    def _run(self) -> None:
        while self._changed.wait() and not self._stopped.wait(DELAY_SECONDS):
            self._changed.clear()
            while not self.flush() and not self._stopped.wait(RETRY_SECONDS):
                pass
