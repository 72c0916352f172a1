"""The file of a session: its present state and the steps that led there.

The first line tells the schema, the generation of the file and a checksum; the second holds
the rest. Most of a step is what it was in the step before, so each value of each field is
written once, and a step names which of them it has.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any, TypeVar, cast

import msgspec

from explorer.app.state.state import State
from explorer.app.storage.saved import SavedSession, restored, saved
from explorer.errors import ExplorerError, InputError, StorageError
from explorer.mechanism.design_file import MIGRATIONS as MIGRATIONS_OF_DESIGNS, up_to_date

SCHEMA = 2
"""The schema of the files that are written; files of an older one are migrated."""

Migration = Callable[[dict[str, Any]], dict[str, Any]]


def _name_margins_delta(session: dict[str, Any]) -> dict[str, Any]:
    """Return a session of the second schema: the ghost is called δ1 = 0, no longer κ1 = 0."""
    view = session["view"]
    singular = view.get("singular", {})
    if "ghost" not in singular:
        return session
    singular = {**singular, "ghost": singular["ghost"].replace("κ", "δ")}
    return {**session, "view": {**view, "singular": singular}}


MIGRATIONS: Mapping[int, Migration] = {1: _name_margins_delta}
"""By schema: what turns the fields of a session into those of the next schema."""

MOST_STEPS = 50
"""Steps that are kept at most."""

MOST_BYTES = 300_000
"""Beyond this size fewer steps are kept; the present state always is."""

# What a design of any schema has, and the schemas whose designs are brought up to date.
_DESIGN_FIELDS = frozenset({"schema", "unit_mm"})
_OLDER_DESIGNS = MIGRATIONS_OF_DESIGNS.keys()

# No honest file comes near this size, and no honest first line near that one, in bytes.
LARGEST_FILE, LARGEST_HEADER = 50_000_000, 200


class SchemaError(StorageError):
    """A file that a newer explorer wrote."""


@dataclass(frozen=True)
class Kept:
    """A step of the history: what was done, in words, and the state after it."""

    words: str
    state: State


@dataclass(frozen=True)
class Document:
    """All of a session that is kept.

    Attributes:
        present: The state on the page.
        steps: Those that can be undone and redone.
        at: Index of the one at which the page is; 0 without steps.
        first: The number of the first of them.
    """

    present: State
    steps: tuple[Kept, ...] = ()
    at: int = 0
    first: int = 0


class Header(msgspec.Struct, frozen=True):
    """What the first line tells in every schema; what else it tells is passed over.

    Attributes:
        schema: Of the rest.
        generation: Larger than that of all files that were there when it was written.
    """

    schema: Annotated[int, msgspec.Meta(ge=1, le=2**31)]
    generation: Annotated[int, msgspec.Meta(ge=0, le=2**62)]


class _Signed(Header, frozen=True, forbid_unknown_fields=True):
    """The first line of this schema, with a checksum of it and the rest."""

    checksum: int


Index = Annotated[int, msgspec.Meta(ge=0)]


class _Column(msgspec.Struct, forbid_unknown_fields=True):
    values: list[Any]
    rows: list[Index]


class _Body(msgspec.Struct, forbid_unknown_fields=True):
    words: list[str]
    at: Index
    first: Index
    columns: dict[str, _Column]


_FIELDS = msgspec.structs.fields(SavedSession)


def encode_document(document: Document, generation: int) -> bytes:
    """Return the file of a session, which `decode_document` reads back.

    Raises:
        StorageError: there is a number in it that is not finite.
    """
    most = MOST_STEPS
    sessions: dict[int, SavedSession] = {}
    while True:
        kept = shortened(document, most)
        body = msgspec.json.encode(_packed(kept, sessions)) + b"\n"
        most = len(kept.steps) // 2
        if len(body) <= MOST_BYTES or not kept.steps:
            break
    header = _Signed(SCHEMA, generation, _checksum(SCHEMA, generation, body))
    return msgspec.json.encode(header) + b"\n" + body


def decode_header(data: bytes, source: str) -> Header:
    """Return the first line of a file, of whose contents this is at least the beginning.

    Raises:
        StorageError: it is no file of a session.
    """
    return _decode_line(data, Header, source)


def decode_document(data: bytes, source: str) -> Document:
    """Return what is in the file of a session.

    Raises:
        SchemaError: a newer explorer wrote it.
        StorageError: it is damaged, or no such file.
    """
    header = decode_header(data, source)
    if header.schema > SCHEMA:
        raise SchemaError(
            f"{source} has schema {header.schema}, of a newer explorer; this one reads up to "
            f"{SCHEMA}"
        )
    body = data.partition(b"\n")[2]
    signed = _decode_line(data, _Signed, source)
    if signed.checksum != _checksum(header.schema, header.generation, body):
        raise StorageError(f"{source} is damaged: its checksum is wrong")
    try:
        return _unpacked(msgspec.json.decode(body, type=_Body), header.schema)
    except (
        ExplorerError,
        msgspec.MsgspecError,
        UnicodeDecodeError,
        RecursionError,
        LookupError,
        TypeError,
        AttributeError,
    ) as error:
        reason = " ".join(f"{error}".split())
        raise StorageError(f"{source} cannot be used: {reason}") from None


_Line = TypeVar("_Line", bound=Header)


def _decode_line(data: bytes, kind: type[_Line], source: str) -> _Line:
    line, found, _ = data[:LARGEST_HEADER].partition(b"\n")
    try:
        header = msgspec.json.decode(line, type=kind)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
        header = None
    if header is None or not found:
        raise StorageError(f"{source} is not the file of a session")
    return header


def first_of(count: int, at: int, most: int) -> int:
    """Return the index of the first of the steps nearest to one, so many at most."""
    return max(0, min(count - most, at - most // 2))


def shortened(document: Document, most: int) -> Document:
    """Return a document with the steps that are nearest to the present one, so many at most."""
    if len(document.steps) <= most:
        return document
    if most == 0:
        return Document(document.present)
    start = first_of(len(document.steps), document.at, most)
    return replace(
        document,
        steps=document.steps[start : start + most],
        at=document.at - start,
        first=document.first + start,
    )


def _packed(document: Document, sessions: dict[int, SavedSession]) -> _Body:
    """Return a document by columns; what is found of states is put into `sessions`, by id."""
    states = [*(step.state for step in document.steps), document.present]
    for state in states:
        if id(state) not in sessions:
            sessions[id(state)] = saved(state)
    rows = [sessions[id(state)] for state in states]
    columns = {
        field.name: _column([getattr(row, field.name) for row in rows], field.type)
        for field in _FIELDS
    }
    words = [step.words for step in document.steps]
    return _Body(words, document.at, document.first, columns)


def _column(values: list[Any], kind: Any) -> _Column:
    """Return the distinct values as JSON, and which of them each is."""
    numbers: dict[bytes, int] = {}
    seen: dict[int, int] = {}
    rows: list[int] = []
    for value in values:
        # States share what did not change, so most values need not be looked at.
        number = seen.get(id(value))
        if number is None:
            text = msgspec.json.encode(value)
            if text not in numbers:
                _check_readable(text, kind)
            number = seen[id(value)] = numbers.setdefault(text, len(numbers))
        rows.append(number)
    return _Column([msgspec.Raw(text) for text in numbers], rows)


def _check_readable(text: bytes, kind: Any) -> None:
    """Refuse to write what could not be read: JSON has no infinity.

    Raises:
        StorageError: it could not be read.
    """
    try:
        msgspec.json.decode(text, type=kind)
    except msgspec.MsgspecError as error:
        raise StorageError(f"the session holds a value that no file can: {error}") from None


def _unpacked(body: _Body, schema: int) -> Document:
    sessions = [
        {name: column.values[column.rows[row]] for name, column in body.columns.items()}
        for row in range(len(body.words) + 1)
    ]
    if any(len(column.rows) != len(sessions) for column in body.columns.values()):
        raise InputError("its columns differ in length")
    if body.at >= max(1, len(body.words)):
        raise InputError(f"there is no step {body.at}")
    for version in range(schema, SCHEMA):
        sessions = [_migrated(session, MIGRATIONS[version]) for session in sessions]
    # What is the same value in many steps is read once, and shared again.
    read: dict[tuple[str, int], Any] = {}
    found: list[State] = []
    for given in sessions:
        fields = {name: _read(name, value, read) for name, value in given.items()}
        session = SavedSession(**fields)
        found.append(restored(session))
    *steps, present = found
    kept = tuple(Kept(words, state) for words, state in zip(body.words, steps, strict=True))
    return Document(present, kept, body.at, body.first)


def _migrated(session: dict[str, Any], migration: Migration) -> dict[str, Any]:
    session = migration(session)
    run = session.get("run")
    if run is None:
        return session
    return {**session, "run": {**run, "own": migration(run["own"])}}


_KINDS = {field.name: field.type for field in _FIELDS}


def _read(name: str, value: Any, read: dict[tuple[str, int], Any]) -> Any:
    key = name, id(value)
    if key not in read:
        if name not in _KINDS:
            raise InputError(f"there is no field {name!r}")
        present = _with_present_designs(value)
        known = msgspec.convert(present, _KINDS[name])
        _refuse_unknown(present, msgspec.to_builtins(known), name)
        read[key] = known
    return read[key]


def _with_present_designs(value: Any) -> Any:
    """Return a value in which each design of an older schema is one of the present schema."""
    if isinstance(value, list):
        return [_with_present_designs(each) for each in cast("list[Any]", value)]
    if not isinstance(value, dict):
        return value
    fields = cast("dict[str, Any]", value)
    if {*fields} >= _DESIGN_FIELDS and fields.get("schema") in _OLDER_DESIGNS:
        return up_to_date(fields)
    return {name: _with_present_designs(each) for name, each in fields.items()}


def _refuse_unknown(given: Any, known: Any, where: str) -> None:
    """Refuse fields that were passed over: msgspec does so where a dataclass lacks them.

    Raises:
        InputError: there is one.
    """
    if isinstance(given, dict):
        fields = cast("dict[str, Any]", given)
        for name, value in fields.items():
            if name not in known:
                raise InputError(f"{where} has no field {name!r}")
            _refuse_unknown(value, known[name], f"{where}.{name}")
    elif isinstance(given, list):
        for value, other in zip(cast("list[Any]", given), known, strict=True):
            _refuse_unknown(value, other, where)


def _checksum(schema: int, generation: int, body: bytes) -> int:
    return zlib.crc32(body, zlib.crc32(b"%d %d " % (schema, generation)))
