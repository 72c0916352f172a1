"""The files of sessions in the user's data folder, one for each explorer, with its history.

A file belongs to the process that holds the lock beside it; the system releases the lock when the
process ends, however it does. The next explorer that starts continues the newest session
without a process.

The first line of a file holds its schema, the second the steps. Most of a step is what it was in
the step before. So each object is written once, into a list; wherever else it occurs, a reference
`{"#": n}` gives its index in the list. An object refers only to those before it. Every number is
kept to the last bit.
"""

from __future__ import annotations

import contextlib
import math
import secrets
import threading
from collections.abc import Iterable, Mapping
from dataclasses import is_dataclass
from pathlib import Path
from typing import Annotated, Any, cast

import msgspec
from filelock import FileLock

from explorer.app.session.history import History, Step
from explorer.app.state.parts import FEATURE_PARTS, FeaturePart, saved_fields
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
SCHEMA = 3
# Largest number of steps in a file.
MOST_STEPS = 50
REFERENCE = "#"

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
    start = max(0, min(len(history.steps) - MOST_STEPS, history.at - MOST_STEPS // 2))
    steps = history.steps[start : start + MOST_STEPS]
    objects, states = _pack(step.state for step in steps)
    words, at = [step.words for step in steps], history.at - start
    body = _Body(words, at, steps[0].number, objects, states)
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
    pairs = zip(body.words, _unpack(body.objects, body.states), strict=True)
    steps = tuple(Step(number, *pair) for number, pair in enumerate(pairs, body.first))
    if not body.at < len(steps):
        raise InputError(f"there is no step {body.at}")
    return History(steps, body.at)


def _pack(states: Iterable[State]) -> tuple[list[Any], list[int]]:
    """Return the objects of states as JSON texts, and the index of each state among them."""
    numbers: dict[bytes, int] = {}
    # By the id of an object: its reference, and the object itself, which keeps the id.
    packed: dict[int, tuple[dict[str, int], object]] = {}

    def reference_to(value: object) -> dict[str, int]:
        if id(value) not in packed:
            fields = {name: pack(each) for name, each in _fields_of(value).items()}
            number = numbers.setdefault(msgspec.json.encode(fields), len(numbers))
            packed[id(value)] = {REFERENCE: number}, value
        return packed[id(value)][0]

    def pack(value: Any) -> Any:
        if isinstance(value, float) and not math.isfinite(value):
            raise StorageError(f"the session holds a value that no file can: {value}")
        if value is None or isinstance(value, bool | int | float | str):
            return value
        if isinstance(value, list | tuple):
            return [pack(each) for each in cast("list[Any]", value)]
        return reference_to(value)

    indices = [reference_to(state)[REFERENCE] for state in states]
    return [msgspec.Raw(text) for text in numbers], indices


def _fields_of(value: Any) -> Mapping[str, Any]:
    saved: Any = value.for_file() if hasattr(value, "for_file") else value
    if is_dataclass(saved):
        return {field.name: getattr(saved, field.name) for field in saved_fields(saved)}
    return cast("dict[str, Any]", saved) if isinstance(saved, dict) else msgspec.to_builtins(saved)


def _unpack(objects: list[dict[str, Any]], numbers: list[int]) -> list[State]:
    """Return the states with these indices in a list of objects.

    Raises:
        Exception: They are no states, or an object refers to one that does not come before.
    """
    resolved: list[Any] = []

    def value_of(raw: Any) -> Any:
        if isinstance(raw, list):
            return [value_of(each) for each in cast("list[Any]", raw)]
        if not isinstance(raw, dict):
            return raw
        (number,) = cast("dict[str, Any]", raw).values()
        if REFERENCE not in raw or not 0 <= number < len(resolved):
            raise InputError(f"there is no object {number}")
        return resolved[number]

    for each in objects:
        fields = {name: value_of(raw) for name, raw in each.items()}
        resolved.append(fields)
    states = {n: msgspec.convert(resolved[n], State, dec_hook=_part_of) for n in {*numbers}}
    return [states[number] for number in numbers]


def _part_of(base: type[FeaturePart], value: Any) -> Any:
    """Return the part of a feature, of which the state names the base alone."""
    return msgspec.convert(value, FEATURE_PARTS[base], dec_hook=_part_of)
