"""The files of sessions in the user's data folder, one for each explorer.

A file belongs to the process that holds the lock beside it; the system releases the lock when the
process ends, however it does. The next explorer that starts goes on with the newest session
without a process. The newest is the one of the highest generation: clocks may be set back.
"""

from __future__ import annotations

import contextlib
import secrets
import threading
from dataclasses import dataclass
from pathlib import Path

from filelock import FileLock

from explorer.app.session.history import History
from explorer.app.storage.folder import LOCK, data_folder, lock_folder, try_lock
from explorer.app.storage.session_format import (
    LARGEST_FILE,
    LARGEST_GENERATION,
    LARGEST_HEADER,
    SchemaError,
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
"""Largest number of sessions kept of explorers that have ended; the newest are kept."""


@dataclass(frozen=True)
class Resumed:
    """The session with which an explorer starts.

    Attributes:
        history: History of the newest session; None if there is none.
        messages: Messages for people about files that could not be used.
    """

    history: History | None
    messages: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Orphan:
    """A session without an explorer, and the lock of its file; None if it is only read."""

    path: Path
    generation: int
    history: History
    lock: FileLock | None

    @property
    def age(self) -> tuple[int, str]:
        """A key that sorts the oldest first."""
        return self.generation, self.path.name


class SessionFile:
    """The file of this explorer's session.

    Args:
        folder: The folder of sessions; that in the user's data folder if None.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self.folder = data_folder() / SESSIONS if folder is None else folder
        self._path: Path | None = None
        self._lock: FileLock | None = None
        self._generation = 0
        # Only one thread at a time writes.
        self._writing = threading.Lock()

    @property
    def path(self) -> Path | None:
        """The file; None until this explorer has one."""
        return self._path

    def resume(self) -> Resumed:
        """Take over the newest session of an explorer that has ended.

        Its file becomes that of this explorer; without one, the first `save` makes one.
        Damaged files are renamed and never removed, those of newer explorers left alone.
        Where nothing can be written, the session is only read.
        """
        with self._writing:
            self._release()
            try:
                with lock_folder(self.folder):
                    return self._take_over()
            except StorageError as error:
                orphans, messages = self._orphans(locked=False)
                newest = max(orphans, key=lambda each: each.age, default=None)
                history = None if newest is None else newest.history
                return Resumed(history, (*messages, str(error)))

    def save(self, history: History) -> int:
        """Write the session; return the generation of the file.

        Once this returns, the session outlasts a kill and a power failure. Until then the
        file holds the session that was saved before.

        Raises:
            StorageError: it cannot be written now; a later call may succeed.
        """
        with self._writing:
            path = self._path
            if path is None or not _lock_of(path).exists():
                # Without its lock, which somebody has removed, the file has no owner.
                self._release()
                path = self._create()
            newest = max(self._generation, self._newest_generation())
            # A file that says so much was written by no explorer; what is beyond cannot be read.
            generation = min(1 + newest, LARGEST_GENERATION)
            write_whole(path, encode_session(history, generation))
            self._generation = generation
            return generation

    def close(self) -> None:
        """Leave the session to the next explorer that starts."""
        with self._writing:
            self._release()

    def _release(self) -> None:
        _release(self._lock)
        self._path = self._lock = None

    def _create(self) -> Path:
        with lock_folder(self.folder):
            path = self.folder / f"{secrets.token_hex(8)}.json"
            lock = try_lock(_lock_of(path))
        if lock is None:
            raise StorageError(f"{str(path)!r} is in use by another explorer; try again")
        self._path, self._lock = path, lock
        return path

    def _take_over(self) -> Resumed:
        orphans, messages = self._orphans(locked=True)
        orphans.sort(key=lambda each: each.age, reverse=True)
        for old in orphans[1 + MOST_ORPHANS :]:
            _unlink(old.path)
        self._remove_leftovers({each.path.name for each in orphans})
        for other in orphans[1:]:
            _release(other.lock)
        if not orphans:
            return Resumed(None, messages)
        newest = orphans[0]
        self._path, self._lock, self._generation = newest.path, newest.lock, newest.generation
        return Resumed(newest.history, messages)

    def _orphans(self, *, locked: bool) -> tuple[list[_Orphan], tuple[str, ...]]:
        """Return the sessions without an explorer, and messages about unusable files.

        Args:
            locked: Whether to lock their files and rename damaged ones; else all are only read.
        """
        orphans: list[_Orphan] = []
        messages: list[str] = []
        for path in self._files():
            lock = None
            try:
                if locked:
                    lock = try_lock(_lock_of(path))
                    if lock is None:
                        continue
                orphans.append(_read(path, lock))
            except _DamagedError as error:
                messages.append(_set_aside(path, error) if locked else str(error))
                _release(lock)
            except StorageError as error:
                messages.append(f"{error}; it is left as it is")
                _release(lock)
        return orphans, tuple(messages)

    def _remove_leftovers(self, own: set[str]) -> None:
        """Remove scratch files of writers that were killed, and locks without a session.

        Args:
            own: Names of files whose locks this explorer has. While this runs, no other explorer
                creates a file, and one that writes a file has its lock.
        """
        for scratch in self._paths(".part"):
            name = scratch.name[1:].partition(".json.")[0] + ".json"
            if name in own or _is_free(self.folder / name):
                _unlink(scratch)
        for path in self._paths(".lock"):
            session = path.with_suffix(".json")
            if path.name != LOCK and not session.exists() and _is_free(session):
                _unlink(path)

    def _newest_generation(self) -> int:
        """Return the largest generation of all files; 0 without any."""
        largest = 0
        for path in self._files():
            with contextlib.suppress(StorageError, OSError), path.open("rb") as file:
                largest = max(largest, decode_header(file.read(LARGEST_HEADER), "").generation)
        return largest

    def _files(self) -> list[Path]:
        return [path for path in self._paths(".json") if path.is_file()]

    def _paths(self, ending: str) -> list[Path]:
        try:
            return sorted(path for path in self.folder.iterdir() if path.name.endswith(ending))
        except OSError:
            return []


class _DamagedError(StorageError):
    """A file that no explorer can use."""


def _read(path: Path, lock: FileLock | None) -> _Orphan:
    data = read_at_most(path, LARGEST_FILE)
    try:
        generation = decode_header(data, repr(str(path))).generation
        return _Orphan(path, generation, decode_session(data, repr(str(path))), lock)
    except SchemaError:
        raise
    except StorageError as error:
        raise _DamagedError(str(error)) from None


def _set_aside(path: Path, error: StorageError) -> str:
    """Rename a file that cannot be used; return a message for people."""
    for number in range(1, 1000):
        aside = path.with_name(path.name + BROKEN + ("" if number == 1 else str(number)))
        if not aside.exists():
            with contextlib.suppress(StorageError):
                move(path, aside)
                return f"{error}; it is kept as {aside.name!r}"
            break
    return f"{error}; it is left as it is"


def _lock_of(path: Path) -> Path:
    return path.with_suffix(".lock")


def _is_free(path: Path) -> bool:
    """Whether no explorer has the file of a session."""
    try:
        lock = try_lock(_lock_of(path))
    except StorageError:
        return False
    _release(lock)
    return lock is not None


def _release(lock: FileLock | None) -> None:
    if lock is not None:
        lock.release()


def _unlink(path: Path) -> None:
    # A file that cannot be removed now is removed at the next start.
    with contextlib.suppress(OSError):
        path.unlink()
