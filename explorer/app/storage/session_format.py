"""The format of a session's file: its history, with the state after each step.

The first line holds the schema, the generation of the file and a checksum; the second holds the
rest, see `explorer.app.storage.packing`.
"""

from __future__ import annotations

import zlib
from dataclasses import replace
from typing import Annotated, Any, TypeVar

import msgspec

from explorer.app.session.history import History, Step, start_history
from explorer.app.storage import earlier
from explorer.app.storage.packing import Packer, Unpacker, resolve
from explorer.errors import ExplorerError, InputError, StorageError
from explorer.files.json_text import one_line

SCHEMA = 3
"""The schema of the files that are written; files of an older one are read too."""

MOST_STEPS = 50
"""Largest number of steps in a file."""

MOST_BYTES = 300_000
"""Size beyond which a file has fewer steps; it always has the present one."""

# Largest sizes in bytes of a file and of its first line; no explorer writes one near them.
LARGEST_FILE, LARGEST_HEADER = 50_000_000, 200
LARGEST_GENERATION = 2**62


class SchemaError(StorageError):
    """A file that a newer explorer wrote."""


class Header(msgspec.Struct, frozen=True):
    """The first line in every schema; its other fields are passed over.

    Attributes:
        schema: Schema of the rest.
        generation: A number larger than that of all files that existed when it was written.
    """

    schema: Annotated[int, msgspec.Meta(ge=1, le=2**31)]
    generation: Annotated[int, msgspec.Meta(ge=0, le=LARGEST_GENERATION)]


class _Signed(Header, frozen=True, forbid_unknown_fields=True):
    """The first line of this schema, with a checksum of it and the rest."""

    checksum: int


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
    at: earlier.Index
    first: earlier.Index
    objects: list[dict[str, Any]]
    states: list[earlier.Index]


def encode_session(history: History, generation: int) -> bytes:
    """Return the file of a session, which `decode_session` reads back.

    It holds the steps nearest to the present one, as many as a file may have.

    Raises:
        StorageError: a number in it is not finite.
    """
    most = MOST_STEPS
    while True:
        saved = shorten(history, most)
        packer = Packer()
        body = {
            "words": [step.words for step in saved.steps],
            "at": saved.at,
            "first": saved.steps[0].number,
            "states": [packer.add(step.state) for step in saved.steps],
            "objects": packer.objects,
        }
        data = msgspec.json.encode(body) + b"\n"
        most = len(saved.steps) // 2
        if len(data) <= MOST_BYTES or most == 0:
            break
    header = _Signed(SCHEMA, generation, _checksum(SCHEMA, generation, data))
    return msgspec.json.encode(header) + b"\n" + data


def decode_header(data: bytes, source: str) -> Header:
    """Return the first line of a file, of whose contents this is at least the beginning.

    Raises:
        StorageError: it is no file of a session.
    """
    return _decode_line(data, Header, source)


def decode_session(data: bytes, source: str) -> History:
    """Return the history in the file of a session.

    Raises:
        SchemaError: a newer explorer wrote it.
        StorageError: it is damaged, not the file of a session, or holds a state that no page
            shows.
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
        return _history_of(body) if header.schema == SCHEMA else _earlier(body, header.schema)
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
        raise StorageError(one_line(f"{source} cannot be used: {error}")) from None


def shorten(history: History, most: int) -> History:
    """Return a history with at most `most` steps, those nearest to the present one."""
    start = max(0, min(len(history.steps) - most, history.at - most // 2))
    return replace(
        history, steps=history.steps[start : start + most], at=history.at - start, is_open=False
    )


_Line = TypeVar("_Line", bound=Header)


def _decode_line(data: bytes, kind: type[_Line], source: str) -> _Line:
    line, newline, _ = data[:LARGEST_HEADER].partition(b"\n")
    try:
        header = msgspec.json.decode(line, type=kind)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
        header = None
    if header is None or not newline:
        raise StorageError(f"{source} is not the file of a session")
    return header


def _history_of(data: bytes) -> History:
    body = msgspec.json.decode(data, type=_Body)
    objects = resolve(body.objects)
    return _history(body, [objects[number] for number in body.states])


def _earlier(data: bytes, schema: int) -> History:
    body = msgspec.json.decode(data, type=earlier.Body)
    *states, present = earlier.states_of(body, schema)
    if states:
        return _history(body, states)
    # The steps of a session that was too large were left out.
    return start_history(Unpacker().state(present))


def _history(body: _Body | earlier.Body, states: list[dict[str, Any]]) -> History:
    if not body.at < len(states):
        raise InputError(f"there is no step {body.at}")
    unpacker = Unpacker()
    steps = (
        Step(number, words, unpacker.state(state))
        for number, (words, state) in enumerate(zip(body.words, states, strict=True), body.first)
    )
    return History(tuple(steps), body.at)


def _checksum(schema: int, generation: int, body: bytes) -> int:
    return zlib.crc32(body, zlib.crc32(b"%d %d " % (schema, generation)))
