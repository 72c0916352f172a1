"""The user's preferences: the theme of the page, and whether the tour was seen.

Neither belongs to a design nor to the history, so that no undo changes them. They are one small
file in the user's data folder, which several explorers may share.
"""

from __future__ import annotations

import threading
from pathlib import Path

import msgspec

from explorer.app.storage.folder import make_data_folder
from explorer.errors import StorageError
from explorer.files.writing import read_at_most, write_whole

NAME = "preferences.json"
# Size in bytes beyond which no explorer wrote the file.
LARGEST = 10_000


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
        self._path = folder / NAME
        self._lock = threading.Lock()
        self._chosen = self._read()

    @property
    def chosen(self) -> Preferences:
        """The preferences chosen last."""
        return self._chosen

    def choose(self, *, dark: bool | None = None, tour_seen: bool | None = None) -> None:
        """Set the preferences that are given; those that are None stay.

        Raises:
            StorageError: the file cannot be written; the choice holds until this process ends.
        """
        with self._lock:
            # Another explorer may have written the file meanwhile.
            last = self._read()
            self._chosen = Preferences(
                last.dark if dark is None else dark,
                last.tour_seen if tour_seen is None else tour_seen,
            )
            make_data_folder(self._path.parent)
            write_whole(self._path, msgspec.json.encode(self._chosen))

    def _read(self) -> Preferences:
        try:
            return msgspec.json.decode(read_at_most(self._path, LARGEST), type=Preferences)
        except (StorageError, msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
            return Preferences()
