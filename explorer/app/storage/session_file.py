"""The files of sessions in the user's data folder, one for each explorer.

A file belongs to the process that holds the lock beside it; the system releases the lock when the
process ends, however it does. The next explorer that starts goes on with the newest session
without a process.
"""

from __future__ import annotations

import contextlib
import secrets
import threading
import time
from dataclasses import dataclass
from pathlib import Path

from filelock import FileLock

from explorer.app.session.history import History
from explorer.app.storage.folder import data_folder, make_data_folder, try_lock
from explorer.app.storage.session_format import (
    LARGEST_FILE,
    LARGEST_GENERATION,
    LARGEST_HEADER,
    DamagedError,
    decode_header,
    decode_session,
    encode_session,
)
from explorer.errors import StorageError
from explorer.files.writing import move, read_at_most, write_whole

SESSIONS = "sessions"
"""Name of the folder of sessions in the user's data folder."""

BROKEN = ".broken"
"""Suffix added to the name of a file that cannot be used."""

MOST_ORPHANS = 10
"""Largest number of other sessions kept of explorers that have ended; the newest are kept."""


@dataclass(frozen=True)
class Resumed:
    """The session with which an explorer starts.

    Attributes:
        history: History of the newest session; None if there is none.
        messages: Messages for people about files that could not be used.
    """

    history: History | None
    messages: tuple[str, ...] = ()


class SessionFile:
    """The file of this explorer's session.

    Args:
        folder: The folder of sessions; that in the user's data folder if None.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self.folder = data_folder() / SESSIONS if folder is None else folder
        self.path: Path | None = None
        self._lock: FileLock | None = None
        self._generation = 0
        # Only one thread at a time writes.
        self._writing = threading.Lock()

    def resume(self) -> Resumed:
        """Take over the newest session of an explorer that has ended.

        Its file becomes that of this explorer; without one, the first `save` makes one.
        Damaged files are renamed and never removed, those of other versions left alone.
        Where nothing can be written, the session is only read.
        """
        messages: list[str] = []
        with self._writing:
            paths = sorted(self._files(), key=_generation_of, reverse=True)
            histories = (self._take_over(path, messages) for path in paths)
            history = next((each for each in histories if each is not None), None)
            others = [path for path in paths if path != self.path]
            for path in others[MOST_ORPHANS:]:
                _remove_orphan(path)
        return Resumed(history, tuple(messages))

    def save(self, history: History) -> None:
        """Write the session.

        Once this returns, the session outlasts a kill and a power failure. Until then the
        file holds the session that was saved before.

        Raises:
            StorageError: it cannot be written now; a later call may succeed.
        """
        with self._writing:
            path = self.path or self._create()
            self._generation = max(self._generation + 1, time.time_ns())
            write_whole(path, encode_session(history, self._generation))

    def close(self) -> None:
        """Leave the session to the next explorer that starts."""
        with self._writing:
            _release(self._lock)
            self.path = self._lock = None

    def _create(self) -> Path:
        path = make_data_folder(self.folder) / f"{secrets.token_hex(8)}.json"
        self._lock = try_lock(_lock_of(path))
        self.path = path
        return path

    def _take_over(self, path: Path, messages: list[str]) -> History | None:
        """Return the session in a file that no explorer has; extend the messages if it has none."""
        lock = None
        try:
            lock = try_lock(_lock_of(path))
            if lock is None:
                return None
        except StorageError as error:
            messages.append(str(error))
        try:
            history = decode_session(read_at_most(path, LARGEST_FILE), repr(str(path)))
        except StorageError as error:
            messages.append(_set_aside(path, error))
            _release(lock)
            return None
        if lock is not None:
            self.path, self._lock, self._generation = path, lock, _generation_of(path)
        return history

    def _files(self) -> list[Path]:
        try:
            return [path for path in self.folder.glob("*.json") if path.is_file()]
        except OSError:
            return []


def _generation_of(path: Path) -> int:
    """Return the generation of a file; the largest if it cannot be read, so that this is told."""
    with contextlib.suppress(StorageError, OSError), path.open("rb") as file:
        return decode_header(file.read(LARGEST_HEADER), "").generation
    return LARGEST_GENERATION


def _set_aside(path: Path, error: StorageError) -> str:
    """Rename a damaged file; return a message for people on a file that cannot be used."""
    if isinstance(error, DamagedError):
        aside = path.with_name(path.name + BROKEN)
        with contextlib.suppress(StorageError):
            move(path, aside)
            return f"{error}; it is kept as {aside.name!r}"
    return f"{error}; it is left as it is"


def _remove_orphan(path: Path) -> None:
    """Remove a session, unless an explorer has it or the folder cannot be changed."""
    with contextlib.suppress(StorageError, OSError):
        lock = try_lock(_lock_of(path))
        if lock is not None:
            path.unlink()
            lock.release()
            _lock_of(path).unlink()


def _lock_of(path: Path) -> Path:
    return path.with_suffix(".lock")


def _release(lock: FileLock | None) -> None:
    if lock is not None:
        lock.release()
