"""Texts in JSON, read strictly: no unknown field, none given twice, one line if it cannot be."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Generator
from typing import TypeVar

import msgspec

from explorer.errors import InputError

T = TypeVar("T")

# Of what a message quotes, in characters.
LONGEST_LINE = 300


def decode_strictly(data: bytes, kind: type[T], source: str) -> T:
    """Return what a JSON text holds.

    Args:
        data: The text, UTF-8.
        kind: What it shall hold; its structs forbid unknown fields.
        source: What to call the text in an error message.

    Raises:
        InputError: not JSON, or not of that kind, or with a field given twice.
    """
    with refusing(source):
        value = msgspec.json.decode(data, type=kind)
        check_each_once(data)
        return value


def check_each_once(data: bytes) -> None:
    """Refuse a text in which a field is given twice; it is known to be shallow.

    Raises:
        InputError: there is one, of which readers would take either.
    """
    # The lengths of integers are no matter here.
    json.loads(data, object_pairs_hook=_each_once, parse_int=float)


@contextlib.contextmanager
def refusing(source: str, refusal: type[InputError] = InputError) -> Generator[None]:
    """Tell in one short line, which can be shown, what is wrong with a text.

    Args:
        source: What to call the text.
        refusal: What to raise.

    Raises:
        InputError: of that type, whatever is wrong.
    """
    try:
        yield
    except (InputError, msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise refusal(_one_line(f"{source}: {error}")) from None


def _one_line(message: str) -> str:
    words = " ".join(message.split())
    shown = "".join(letter if letter.isprintable() else "\ufffd" for letter in words[:LONGEST_LINE])
    return shown if len(words) <= LONGEST_LINE else f"{shown}…"


def _each_once(fields: list[tuple[str, object]]) -> dict[str, object]:
    seen = dict(fields)
    if len(seen) < len(fields):
        names = [name for name, _ in fields]
        twice = next(name for name in names if names.count(name) > 1)
        raise InputError(f"the field {twice!r} is given twice; leave one of them out")
    return seen
