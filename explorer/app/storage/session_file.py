"""The files of sessions in the user's data folder, one for each explorer, with its history.

A file belongs to the process that holds the lock beside it; the system releases the lock when the
process ends, however it does. The next explorer that starts goes on with the newest session
without a process. The first line of a file holds its schema, the second the steps, with the state
after each, see `explorer.app.storage.packing`.
"""

from __future__ import annotations

import contextlib
import secrets
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import msgspec
from filelock import FileLock

from explorer.app.session.history import History, Step
from explorer.app.storage.folder import data_folder, make_data_folder, try_lock
from explorer.app.storage.packing import Packer, unpack
from explorer.errors import ExplorerError, InputError, StorageError
from explorer.files.json_text import one_line
from explorer.files.writing import move, read_at_most, write_whole

SESSIONS = "sessions"
"""Name of the folder of sessions in the user's data folder."""

BROKEN = ".broken"
"""Suffix added to the name of a file that cannot be used."""

MOST_ORPHANS = 10
"""Largest number of other sessions kept of explorers that have ended; the newest are kept."""

SCHEMA = 3
"""The schema of the files."""

MOST_STEPS = 50
"""Largest number of steps in a file."""

MOST_BYTES = 300_000
"""Size beyond which a file has fewer steps; it always has the present one."""

# Size in bytes beyond which no explorer wrote the file.
LARGEST_FILE = 50_000_000

Index = Annotated[int, msgspec.Meta(ge=0)]


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
        # Only one thread at a time writes.
        self._writing = threading.Lock()

    def resume(self) -> Resumed:
        """Take over the newest session of an explorer that has ended.

        Its file becomes that of this explorer; without one, the first `save` makes one.
        Damaged files are renamed and never removed, those of other versions left alone.
        """
        messages: list[str] = []
        with self._writing:
            paths = _newest_first(self.folder)
            histories = (self._take_over(path, messages) for path in paths)
            history = next((each for each in histories if each is not None), None)
            for path in [path for path in paths if path != self.path][MOST_ORPHANS:]:
                _remove_orphan(path)
        return Resumed(history, tuple(messages))

    def save(self, history: History) -> None:
        """Write the session.

        Once this returns, the session outlasts a kill and a power failure. Until then the
        file holds the session that was saved before.

        Raises:
            StorageError: It cannot be written now; a later call may succeed.
        """
        with self._writing:
            if self.path is None:
                path = make_data_folder(self.folder) / f"{secrets.token_hex(8)}.json"
                self._lock = try_lock(_lock_of(path))
                self.path = path
            write_whole(self.path, encode_session(history))

    def close(self) -> None:
        """Leave the session to the next explorer that starts."""
        with self._writing:
            if self._lock is not None:
                self._lock.release()
            self.path = self._lock = None

    def _take_over(self, path: Path, messages: list[str]) -> History | None:
        """Return the session in a file that no explorer has; extend the messages if it has none."""
        lock = None
        try:
            lock = try_lock(_lock_of(path))
            if lock is not None:
                history = decode_session(read_at_most(path, LARGEST_FILE), repr(str(path)))
                self.path, self._lock = path, lock
                return history
        except StorageError as error:
            messages.append(_set_aside(path, error))
            if lock is not None:
                lock.release()
        return None


class DamagedError(StorageError):
    """A file that no explorer can use."""


class _Header(msgspec.Struct):
    schema: int


class _Body(msgspec.Struct, forbid_unknown_fields=True):
    """The second line.

    Attributes:
        words: What was done in each step.
        at: Index of the step that the page shows.
        first: Number of the first step.
        objects: All objects, each referring to those before it.
        states: Index of the state after each step.
    """

    words: list[str]
    at: Index
    first: Index
    objects: list[Any]
    states: list[Index]


def encode_session(history: History) -> bytes:
    """Return the file of a session, which `decode_session` reads back.

    It holds the steps nearest to the present one, as many as a file may have.

    Raises:
        StorageError: A number in it is not finite.
    """
    most = MOST_STEPS
    while True:
        start = max(0, min(len(history.steps) - most, history.at - most // 2))
        steps, packer = history.steps[start : start + most], Packer()
        states = [packer.add(step.state) for step in steps]
        words, at = [step.words for step in steps], history.at - start
        data = msgspec.json.encode(_Body(words, at, steps[0].number, packer.objects, states))
        most = len(steps) // 2
        if len(data) <= MOST_BYTES or most == 0:
            return msgspec.json.encode(_Header(SCHEMA)) + b"\n" + data + b"\n"


def decode_session(data: bytes, source: str) -> History:
    """Return the history in the file of a session.

    Raises:
        StorageError: Another version of the explorer wrote it.
        DamagedError: It is damaged, not the file of a session, or holds a state that no page
            shows.
    """
    header, _, body = data.partition(b"\n")
    try:
        schema = msgspec.json.decode(header, type=_Header).schema
        if schema == SCHEMA:
            return _history_of(body)
    except (
        ExplorerError,
        msgspec.MsgspecError,
        ValueError,
        ArithmeticError,
        RecursionError,
        LookupError,
        TypeError,
        AttributeError,
    ) as error:
        raise DamagedError(one_line(f"{source} cannot be used: {error}")) from None
    raise StorageError(
        f"{source} is a session of another version of the explorer: it has schema {schema}, and "
        f"this version reads schema {SCHEMA}"
    )


def _history_of(data: bytes) -> History:
    body = msgspec.json.decode(data, type=_Body)
    pairs = zip(body.words, unpack(body.objects, body.states), strict=True)
    steps = tuple(Step(number, *pair) for number, pair in enumerate(pairs, body.first))
    if not body.at < len(steps):
        raise InputError(f"there is no step {body.at}")
    return History(steps, body.at)


def _newest_first(folder: Path) -> list[Path]:
    files: list[tuple[int, Path]] = []
    # The folder, or a file in it, may not be there or not be readable.
    with contextlib.suppress(OSError):
        files = [(p.stat().st_mtime_ns, p) for p in folder.glob("*.json") if p.is_file()]
    return [path for _, path in sorted(files, reverse=True)]


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
