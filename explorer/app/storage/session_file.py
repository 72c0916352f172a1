"""The files of sessions in the user's data folder, one for each explorer, with its history.

A file belongs to the process that holds the lock beside it; the system releases the lock when the
process ends, however it does. The next explorer that starts continues the newest session
without a process.

The first line of a file holds its schema, the second the steps. Of each step it has the words and
the values that differ from those of the step before, by their paths in the state. Every number is
kept to the last bit.
"""

from __future__ import annotations

import contextlib
import math
import secrets
import threading
from dataclasses import is_dataclass
from pathlib import Path
from typing import Annotated, Any, cast, get_type_hints

import msgspec
from filelock import FileLock

from explorer.app.session.history import History, HistoryStep
from explorer.app.state.parts import FEATURE_PARTS, FeaturePart, saved_fields, value_at
from explorer.app.state.state import State
from explorer.errors import InputError, StorageError
from explorer.files.json_text import one_line
from explorer.files.writing import move, read_at_most, write_whole
from explorer.page.storage.folder import data_folder, make_data_folder, newest_first, try_lock

# Name of the folder of sessions in the user's data folder.
SESSIONS = "sessions"
# Suffix added to the name of a file that cannot be used.
BROKEN = ".broken"
# Number of other sessions kept of explorers that have ended, the newest ones.
MOST_ORPHANS = 10
# The schema of the files.
SCHEMA = 6
# Largest number of steps in a file.
MOST_STEPS = 50
# Field with the name of a part of the state within another value.
PART = "part"

Index = Annotated[int, msgspec.Meta(ge=0)]


class SessionFile:
    """The file of this explorer's session, in the user's data folder if no other is given."""

    def __init__(self, folder: Path | None = None) -> None:
        self.folder = data_folder() / SESSIONS if folder is None else folder
        self.path: Path | None = None
        self._lock: FileLock | None = None
        # Only one thread at a time writes.
        self._writing = threading.Lock()

    def resume(self) -> tuple[History | None, tuple[str, ...]]:
        """Take over the newest session of an explorer that has ended.

        Its file becomes that of this explorer; without one, the first `save` makes one.
        Damaged files are renamed and never removed, those of other versions left alone.

        Returns:
            The history of the session, None without one, and messages for people about files that
            could not be used.
        """
        messages: list[str] = []
        with self._writing:
            paths = [path for path in newest_first(self.folder) if path.is_file()]
            histories = (self._take_over(path, messages) for path in paths)
            history = next((each for each in histories if each is not None), None)
            for path in [path for path in paths if path != self.path][MOST_ORPHANS:]:
                _remove_orphan(path)
        return history, tuple(messages)

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
                self._lock = try_lock(path)
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
            lock = try_lock(path)
            if lock is not None:
                history = decode_session(read_at_most(path), repr(str(path)))
                self.path, self._lock = path, lock
                return history
        except StorageError as error:
            messages.append(_set_aside(path, error))
            if lock is not None:
                lock.release()
        return None


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
        lock = try_lock(path)
        if lock is not None:
            path.unlink()
            lock.release()
            Path(lock.lock_file).unlink()


class DamagedError(StorageError):
    """A file that no explorer can use."""


class _Step(msgspec.Struct, forbid_unknown_fields=True):
    """A step: what was done, and the values of the state that it changed, by path."""

    words: str
    changes: dict[str, Any]


class _Body(msgspec.Struct, forbid_unknown_fields=True):
    """The second line: the index of the step that the page shows, and the number of the first one.

    Of the steps the first has the whole state.
    """

    at: Index
    first: Index
    steps: list[_Step]


def encode_session(history: History) -> bytes:
    """Return the file of a session, which `decode_session` reads back.

    It holds the steps nearest to the present one, as many as a file may have.

    Raises:
        StorageError: A number in it is not finite.
    """
    start = max(0, min(len(history.steps) - MOST_STEPS, history.at - MOST_STEPS // 2))
    steps, before, paths = list[_Step](), dict[str, Any](), [*_kinds()]
    for step in history.steps[start : start + MOST_STEPS]:
        values = {path: value_at(step.state, path) for path in paths}
        changes = {
            path: _saved(value)
            for path, value in values.items()
            if path not in before or value is not before[path]
        }
        steps.append(_Step(step.words, changes))
        before = values
    body = _Body(history.at - start, history.steps[start].number, steps)
    return b'{"schema":%d}\n%b\n' % (SCHEMA, msgspec.json.encode(body))


def decode_session(data: bytes, source: str) -> History:
    """Return the history in the file of a session.

    Raises:
        StorageError: Another version of the explorer wrote it.
        DamagedError: It is damaged, or not the file of a session.
    """
    header, _, body = data.partition(b"\n")
    try:
        schema = msgspec.json.decode(header, type=dict[str, Any])["schema"]
        if schema == SCHEMA:
            return _history_of(msgspec.json.decode(body, type=_Body))
    except Exception as error:  # noqa: BLE001 - no end to what is wrong with a damaged file
        raise DamagedError(one_line(f"{source} cannot be used: {error}")) from None
    raise StorageError(
        f"{source} is a session of another version of the explorer: it has schema {schema}, and "
        f"this version reads schema {SCHEMA}"
    )


def _history_of(body: _Body) -> History:
    steps, values, kinds = list[HistoryStep](), dict[str, Any](), _kinds()
    for number, step in enumerate(body.steps, body.first):
        for path, raw in step.changes.items():
            values[path] = msgspec.convert(raw, kinds[path], dec_hook=_part_of)
        steps.append(HistoryStep(number, step.words, _state_of(values)))
    if not body.at < len(steps):
        raise InputError(f"there is no step {body.at}")
    return History(tuple(steps), body.at)


def _kinds() -> dict[str, Any]:
    """Return the types of the values that a file holds, by their paths in the state."""
    found = {field.name: get_type_hints(State)[field.name] for field in saved_fields(State)}
    del found["parts"]
    for name, kind in FEATURE_PARTS.items():
        hints = get_type_hints(kind)
        found |= {f"{name}.{field.name}": hints[field.name] for field in saved_fields(kind)}
    return found


def _state_of(values: dict[str, Any]) -> State:
    """Return the state with values by their paths; what a part lacks is as in a new state."""
    fields: dict[str, dict[str, Any]] = {name: {} for name in ("", *FEATURE_PARTS)}
    for path, value in values.items():
        part, _, name = path.rpartition(".")
        fields[part][name] = value
    parts = {name: kind(**fields[name]) for name, kind in FEATURE_PARTS.items()}
    return State(**fields[""], parts=parts)


def _saved(value: Any) -> Any:
    """Return a value as a file holds it, of plain types."""
    if hasattr(value, "for_file"):
        value = value.for_file()
    if isinstance(value, msgspec.Struct):
        value = msgspec.to_builtins(value)
    if is_dataclass(value):
        saved = {each.name: _saved(getattr(value, each.name)) for each in saved_fields(value)}
        return saved | {PART: value.in_state} if isinstance(value, FeaturePart) else saved
    if isinstance(value, dict):
        return {name: _saved(each) for name, each in cast("dict[str, Any]", value).items()}
    if isinstance(value, list | tuple):
        return [_saved(each) for each in cast("list[Any]", value)]
    if isinstance(value, float) and not math.isfinite(value):
        raise StorageError(f"the session holds a value that no file can: {value}")
    return value


def _part_of(_: type[FeaturePart], saved: dict[str, Any]) -> FeaturePart:
    """Return the part of a state within another value."""
    return msgspec.convert(saved, FEATURE_PARTS[saved.pop(PART)], dec_hook=_part_of)
