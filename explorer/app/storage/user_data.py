"""What an explorer keeps in the user's data folder: designs, session, preferences and a log.

The preferences belong neither to a design nor to the history, so that no undo changes them.
Several explorers may share the folder.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import msgspec

from explorer.app.session.history import History
from explorer.app.state.state import State
from explorer.app.storage.folder import make_data_folder
from explorer.app.storage.library import Library
from explorer.app.storage.session_file import SessionFile
from explorer.errors import ExplorerError, StorageError
from explorer.files.json_text import one_line
from explorer.files.writing import read_at_most, write_whole

PREFERENCES = "preferences.json"
# Size in bytes beyond which no explorer wrote the file.
LARGEST_PREFERENCES = 10_000
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
    """Return what the user's data folder holds; with `resume` the newest session is continued."""
    store = SessionFile()
    history, messages = store.resume() if resume else (None, ())
    return UserData(Library(), store, history, messages)


class Autosaver:
    """Saves the newest history on a thread of its own, a moment after a change.

    Args:
        store: Where the session is saved.
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

    def follow(self, state: State, history: History) -> None:
        """Queue a history to be saved if it has changed, in place of one that waits.

        A search for a better design is no step before it ends: until then the file holds the
        session before it.
        """
        if history is not self._newest and not state.optimisation.is_on:
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


class Preferences(msgspec.Struct, frozen=True):
    """The preferences: whether the page is dark, None until chosen; whether the tour was seen."""

    dark: bool | None = None
    tour_seen: bool = False


class PreferenceFile:
    """The file of the preferences, whose folder is made at the first choice.

    A file that cannot be read gives the defaults.
    """

    def __init__(self, folder: Path) -> None:
        self._path = folder / PREFERENCES
        self._lock = threading.Lock()
        self.chosen = self._read()

    def choose(self, **chosen: bool) -> None:
        """Set the preferences that are given, by name.

        Raises:
            StorageError: The file cannot be written; the choice holds until this process ends.
        """
        with self._lock:
            # Another explorer may have written the file meanwhile.
            self.chosen = msgspec.structs.replace(self._read(), **chosen)
            make_data_folder(self._path.parent)
            write_whole(self._path, msgspec.json.encode(self.chosen))

    def _read(self) -> Preferences:
        try:
            return msgspec.json.decode(
                read_at_most(self._path, LARGEST_PREFERENCES), type=Preferences
            )
        except (StorageError, msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
            return Preferences()
