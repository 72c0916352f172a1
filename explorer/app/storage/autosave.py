"""The sessions in the user's data folder, each in a file of its own explorer's.

A file belongs to the process that holds the lock beside it; the system lets go of that
when the process ends, however it does. What a file was left with is taken up by the next
explorer that starts. Which is the newest is told by generations, since clocks are set back.
"""

from __future__ import annotations

import contextlib
import secrets
import threading
from dataclasses import dataclass
from pathlib import Path

from filelock import FileLock

from explorer.app.storage.document import (
    LARGEST_FILE,
    LARGEST_HEADER,
    Document,
    SchemaError,
    decode_document,
    decode_header,
    encode_document,
)
from explorer.app.storage.folder import LOCK, alone_in, data_folder, taken
from explorer.errors import StorageError
from explorer.files.writing import move, read_at_most, write_whole

SESSIONS = "sessions"
"""The folder of sessions, in that of the user's data."""

BROKEN = ".broken"
"""What the name of a file that cannot be used is lengthened by."""

MOST_ORPHANS = 10
"""Sessions of explorers that have ended that are kept, the newest of them."""


@dataclass(frozen=True)
class Found:
    """What an explorer finds when it starts.

    Attributes:
        document: The session that was left last; None if there is none.
        messages: For people, about files that could not be used.
    """

    document: Document | None
    messages: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Left:
    """A session without an explorer, with the lock of its file; None where none can be had."""

    path: Path
    generation: int
    document: Document
    lock: FileLock | None


class Autosave:
    """The file of this explorer's session.

    Args:
        folder: Of sessions; that in the user's data folder if None.
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

    def adopt(self) -> Found:
        """Go on with the session that was left last by an explorer that has ended.

        Its file becomes that of this explorer; without one, the first `save` makes one.
        Damaged files are renamed and never removed, those of newer explorers left alone.
        Where nothing can be written, the session is only read.
        """
        with self._writing:
            self._let_go()
            try:
                with alone_in(self.folder):
                    return self._adopt()
            except StorageError as error:
                left, messages = self._left(locked=False)
                newest = max(left, key=_age, default=None)
                return Found(None if newest is None else newest.document, (*messages, str(error)))

    def save(self, document: Document) -> int:
        """Write the session; return the generation of the file.

        Once this returns, the session outlasts a kill and a power failure. Until then the
        file holds the session that was saved before.

        Raises:
            StorageError: it cannot be written; the next time it may.
        """
        with self._writing:
            path = self._path
            if path is None or not _lock_of(path).exists():
                # Without its lock, which somebody has removed, a file is nobody's.
                self._let_go()
                path = self._begin()
            generation = 1 + max(self._generation, self._newest())
            write_whole(path, encode_document(document, generation))
            self._generation = generation
            return generation

    def close(self) -> None:
        """Leave the session to the next explorer that starts."""
        with self._writing:
            self._let_go()

    def _let_go(self) -> None:
        if self._lock is not None:
            self._lock.release()
        self._path = self._lock = None

    def _begin(self) -> Path:
        """Take a file that nobody has."""
        with alone_in(self.folder):
            path = self.folder / f"{secrets.token_hex(8)}.json"
            lock = taken(_lock_of(path))
        if lock is None:
            raise StorageError(f"{str(path)!r} is in use by another explorer; try again")
        self._path, self._lock = path, lock
        return path

    def _adopt(self) -> Found:
        left, messages = self._left(locked=True)
        left.sort(key=_age, reverse=True)
        for old in left[1 + MOST_ORPHANS :]:
            _unlink(old.path)
        self._sweep({each.path.name for each in left})
        for other in left[1:]:
            _release(other.lock)
        if not left:
            return Found(None, messages)
        newest = left[0]
        self._path, self._lock, self._generation = newest.path, newest.lock, newest.generation
        return Found(newest.document, messages)

    def _left(self, *, locked: bool) -> tuple[list[_Left], tuple[str, ...]]:
        """Return the sessions that no explorer has, and messages about those of no use.

        Args:
            locked: Whether their files are locked and damaged ones put aside; only read if not.
        """
        left: list[_Left] = []
        messages: list[str] = []
        for path in self._files():
            lock = None
            try:
                if locked:
                    lock = taken(_lock_of(path))
                    if lock is None:
                        continue
                left.append(_read(path, lock))
            except _DamagedError as error:
                messages.append(_put_aside(path, error) if locked else str(error))
                _release(lock)
            except StorageError as error:
                messages.append(f"{error}; it is left as it is")
                _release(lock)
        return left, tuple(messages)

    def _sweep(self, own: set[str]) -> None:
        """Remove what writers that were killed left behind, and locks without a session.

        Args:
            own: The names of files whose locks this explorer has. While this runs, no other
                one begins a file, and who writes one has its lock.
        """
        for scratch in self._those(".part"):
            name = scratch.name[1:].partition(".json.")[0] + ".json"
            if name in own or _is_free(self.folder / name):
                _unlink(scratch)
        for path in self._those(".lock"):
            session = path.with_suffix(".json")
            if path.name != LOCK and not session.exists() and _is_free(session):
                _unlink(path)

    def _newest(self) -> int:
        """Return the largest generation of all files; 0 without any."""
        found = 0
        for path in self._files():
            with contextlib.suppress(StorageError, OSError), path.open("rb") as file:
                found = max(found, decode_header(file.read(LARGEST_HEADER), "").generation)
        return found

    def _files(self) -> list[Path]:
        return [path for path in self._those(".json") if path.is_file()]

    def _those(self, ending: str) -> list[Path]:
        try:
            return sorted(each for each in self.folder.iterdir() if each.name.endswith(ending))
        except OSError:
            return []


class _DamagedError(StorageError):
    """A file that no explorer can use."""


def _read(path: Path, lock: FileLock | None) -> _Left:
    data = read_at_most(path, LARGEST_FILE)
    try:
        generation = decode_header(data, repr(str(path))).generation
        return _Left(path, generation, decode_document(data, repr(str(path))), lock)
    except SchemaError:
        raise
    except StorageError as error:
        raise _DamagedError(str(error)) from None


def _put_aside(path: Path, error: StorageError) -> str:
    """Rename a file that cannot be used; return what to tell people."""
    for number in range(1, 1000):
        aside = path.with_name(path.name + BROKEN + ("" if number == 1 else str(number)))
        if not aside.exists():
            with contextlib.suppress(StorageError):
                move(path, aside)
                return f"{error}; it is kept as {aside.name!r}"
            break
    return f"{error}; it is left as it is"


def _age(left: _Left) -> tuple[int, str]:
    return left.generation, left.path.name


def _lock_of(path: Path) -> Path:
    return path.with_suffix(".lock")


def _is_free(path: Path) -> bool:
    """Whether the file of a session is that of no explorer."""
    try:
        lock = taken(_lock_of(path))
    except StorageError:
        return False
    _release(lock)
    return lock is not None


def _release(lock: FileLock | None) -> None:
    if lock is not None:
        lock.release()


def _unlink(path: Path) -> None:
    # What cannot be removed now is the next start's.
    with contextlib.suppress(OSError):
        path.unlink()
