"""The format of a session's file: its history, with the state after each step.

The first line holds the schema, the generation of the file and a checksum; the second holds the
rest, see `explorer.app.storage.packing`.
"""

from __future__ import annotations

import contextlib
import zlib
from dataclasses import replace
from typing import Annotated, Any

import msgspec

from explorer.app.session.history import History, Step
from explorer.app.storage.packing import Packer, Unpacker, resolve
from explorer.errors import ExplorerError, InputError, StorageError
from explorer.files.json_text import one_line

SCHEMA = 3
"""The schema of the files."""

MOST_STEPS = 50
"""Largest number of steps in a file."""

MOST_BYTES = 300_000
"""Size beyond which a file has fewer steps; it always has the present one."""

# Largest sizes in bytes of a file and of its first line; no explorer writes one near them.
LARGEST_FILE, LARGEST_HEADER = 50_000_000, 200
LARGEST_GENERATION = 2**62

Index = Annotated[int, msgspec.Meta(ge=0)]


class DamagedError(StorageError):
    """A file that no explorer can use."""


class Header(msgspec.Struct, frozen=True):
    """The first line, of which every schema has the first two fields.

    Attributes:
        schema: Schema of the rest.
        generation: A number larger than that of the files that were written before.
        checksum: Checksum of the other fields and the rest.
    """

    schema: Annotated[int, msgspec.Meta(ge=1, le=2**31)]
    generation: Annotated[int, msgspec.Meta(ge=0, le=LARGEST_GENERATION)]
    checksum: int = 0


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
    objects: list[dict[str, Any]]
    states: list[Index]


def encode_session(history: History, generation: int) -> bytes:
    """Return the file of a session, which `decode_session` reads back.

    It holds the steps nearest to the present one, as many as a file may have.

    Raises:
        StorageError: a number in it is not finite.
    """
    most = MOST_STEPS
    while True:
        saved = _shorten(history, most)
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
    header = Header(SCHEMA, generation, _checksum(generation, data))
    return msgspec.json.encode(header) + b"\n" + data


def decode_header(data: bytes, source: str) -> Header:
    """Return the first line of a file, of whose contents this is at least the beginning.

    Raises:
        DamagedError: it is no file of a session.
    """
    line, newline, _ = data[:LARGEST_HEADER].partition(b"\n")
    with contextlib.suppress(msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
        if newline:
            return msgspec.json.decode(line, type=Header)
    raise DamagedError(f"{source} is not the file of a session")


def decode_session(data: bytes, source: str) -> History:
    """Return the history in the file of a session.

    Raises:
        StorageError: another version of the explorer wrote it.
        DamagedError: it is damaged, not the file of a session, or holds a state that no page
            shows.
    """
    header = decode_header(data, source)
    if header.schema != SCHEMA:
        raise StorageError(
            f"{source} is a session of another version of the explorer: it has schema "
            f"{header.schema}, and this version reads schema {SCHEMA}"
        )
    body = data.partition(b"\n")[2]
    if header.checksum != _checksum(header.generation, body):
        raise DamagedError(f"{source} is damaged: its checksum is wrong")
    try:
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


def _shorten(history: History, most: int) -> History:
    """Return a history with at most `most` steps, those nearest to the present one."""
    start = max(0, min(len(history.steps) - most, history.at - most // 2))
    return replace(
        history, steps=history.steps[start : start + most], at=history.at - start, is_open=False
    )


def _history_of(data: bytes) -> History:
    body = msgspec.json.decode(data, type=_Body)
    if not body.at < len(body.states):
        raise InputError(f"there is no step {body.at}")
    objects, unpacker = resolve(body.objects), Unpacker()
    steps = (
        Step(number, words, unpacker.state(objects[state]))
        for number, (words, state) in enumerate(
            zip(body.words, body.states, strict=True), body.first
        )
    )
    return History(tuple(steps), body.at)


def _checksum(generation: int, body: bytes) -> int:
    return zlib.crc32(body, zlib.crc32(b"%d %d " % (SCHEMA, generation)))
