"""What an explorer keeps in the user's data folder: designs, session, preferences and a log.

The preferences belong neither to a design nor to the history, so that no undo changes them.
Several explorers may share the folder.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass
from pathlib import Path

import msgspec

from explorer.app.session.history import History
from explorer.app.storage.folder import make_data_folder
from explorer.app.storage.library import Library
from explorer.app.storage.session_file import SessionFile
from explorer.errors import StorageError
from explorer.files.writing import read_at_most, write_whole

PREFERENCES = "preferences.json"
# Size in bytes beyond which no explorer wrote the file.
LARGEST_PREFERENCES = 10_000


@dataclass(frozen=True)
class UserData:
    """The designs and the session of the user.

    Attributes:
        library: The named designs.
        store: Where the session is saved.
        history: History of the session to go on with; None to begin a new one.
        messages: Messages for people about files that could not be used.
    """

    library: Library
    store: SessionFile
    history: History | None = None
    messages: tuple[str, ...] = ()


def open_user_data(*, resume: bool) -> UserData:
    """Return what the user's data folder holds.

    Args:
        resume: Whether to go on with the newest session.
    """
    library, store = Library(), SessionFile()
    if not resume:
        return UserData(library, store)
    resumed = store.resume()
    return UserData(library, store, resumed.history, resumed.messages)


class Preferences(msgspec.Struct, frozen=True):
    """The preferences.

    Attributes:
        dark: Whether the page is dark; None until the user chose.
        tour_seen: Whether the tour was seen to its end, or skipped.
    """

    dark: bool | None = None
    tour_seen: bool = False


class PreferenceFile:
    """The file of the preferences; one that cannot be read gives the defaults.

    Args:
        folder: The folder of the file, made at the first choice.
    """

    def __init__(self, folder: Path) -> None:
        self._path = folder / PREFERENCES
        self._lock = threading.Lock()
        self.chosen = self._read()

    def choose(self, *, dark: bool | None = None, tour_seen: bool | None = None) -> None:
        """Set the preferences that are given; those that are None stay.

        Raises:
            StorageError: The file cannot be written; the choice holds until this process ends.
        """
        with self._lock:
            # Another explorer may have written the file meanwhile.
            given = {"dark": dark, "tour_seen": tour_seen}
            changed = {name: value for name, value in given.items() if value is not None}
            self.chosen = msgspec.structs.replace(self._read(), **changed)
            make_data_folder(self._path.parent)
            write_whole(self._path, msgspec.json.encode(self.chosen))

    def _read(self) -> Preferences:
        try:
            return msgspec.json.decode(
                read_at_most(self._path, LARGEST_PREFERENCES), type=Preferences
            )
        except (StorageError, msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
            return Preferences()
