"""What the page remembers of its user beside the work: the theme, and that the tour was seen.

Neither belongs to a design nor to the history: to undo a step must not turn the lights on.
It is one small file in the user's data folder, which several explorers may share.
"""

from __future__ import annotations

import threading
from pathlib import Path

import msgspec

from explorer.app.storage.folder import made_folder
from explorer.errors import StorageError
from explorer.files.writing import read_at_most, write_whole

NAME = "preferences.json"
# In bytes; more was not written by this.
LARGEST = 10_000


class Preferences(msgspec.Struct, frozen=True):
    """What is remembered.

    Attributes:
        dark: Whether the page is dark; None until somebody chose.
        tour_seen: Whether the tour was seen to its end, or skipped.
    """

    dark: bool | None = None
    tour_seen: bool = False


class PreferenceFile:
    """The file of the preferences; what it cannot be read as counts as never chosen.

    Args:
        folder: In which it lies, made when something is first remembered.
    """

    def __init__(self, folder: Path) -> None:
        self._path = folder / NAME
        self._lock = threading.Lock()
        self._chosen = self._read()

    @property
    def chosen(self) -> Preferences:
        """What was chosen last."""
        return self._chosen

    def choose(self, *, dark: bool | None = None, tour_seen: bool | None = None) -> None:
        """Remember what is given; what is None stays.

        Raises:
            StorageError: it cannot be written; it is remembered until this process ends.
        """
        with self._lock:
            # Another explorer may have remembered something meanwhile.
            last = self._read()
            self._chosen = Preferences(
                last.dark if dark is None else dark,
                last.tour_seen if tour_seen is None else tour_seen,
            )
            made_folder(self._path.parent)
            write_whole(self._path, msgspec.json.encode(self._chosen))

    def _read(self) -> Preferences:
        try:
            return msgspec.json.decode(read_at_most(self._path, LARGEST), type=Preferences)
        except (StorageError, msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
            return Preferences()
