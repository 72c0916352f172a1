"""Strict reading of JSON: unknown and repeated fields are errors, each reported on one line."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Generator
from typing import TypeVar

import msgspec

from explorer.errors import InputError

T = TypeVar("T")

# Longest error message in characters.
LONGEST_LINE = 300


def decode_strictly(data: bytes, kind: type[T], source: str) -> T:
    """Return the value that a JSON text holds.

    Args:
        data: The text, UTF-8.
        kind: Type of the value, whose structs forbid unknown fields.
        source: Name of the text in an error message.

    Raises:
        InputError: The text is not JSON or not of that type, or it gives a field twice.
    """
    with one_line_errors(source):
        value = msgspec.json.decode(data, type=kind)
        check_unique_fields(data)
        return value


def check_unique_fields(data: bytes) -> None:
    """Check that a text gives no field twice, since readers differ in which value they take.

    Args:
        data: JSON text that has been decoded once, so that its depth is known to be small.

    Raises:
        InputError: A field is given twice.
    """
    # As an integer, a number of thousands of digits would be refused.
    json.loads(data, object_pairs_hook=_unique_fields, parse_int=float)


@contextlib.contextmanager
def one_line_errors(source: str, kind: type[InputError] = InputError) -> Generator[None]:
    """Raise every error of reading a text as one printable line of limited length.

    Args:
        source: Name of the text, with which the line begins.
        kind: Type of the error to raise.

    Raises:
        InputError: The text cannot be read; the error is of type `kind`.
    """
    try:
        yield
    except (InputError, msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise kind(_one_line(f"{source}: {error}")) from None


def _one_line(message: str) -> str:
    words = " ".join(message.split())
    line = "".join(letter if letter.isprintable() else "\ufffd" for letter in words[:LONGEST_LINE])
    return line if len(words) <= LONGEST_LINE else f"{line}…"


def _unique_fields(fields: list[tuple[str, object]]) -> dict[str, object]:
    unique = dict(fields)
    if len(unique) < len(fields):
        names = [name for name, _ in fields]
        twice = next(name for name in names if names.count(name) > 1)
        raise InputError(f"the field {twice!r} is given twice; leave one of them out")
    return unique
