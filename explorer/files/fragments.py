"""Values in the fragment of an address: the part after "#", which no browser sends to a server.

A fragment has three parts, joined by dots: the number of its schema, a JSON text that is deflated
without a header and written as base64url, and the CRC-32 of both in hexadecimal digits. The moving
page reads the same by `explorer/export/templates/link.js`.
"""

from __future__ import annotations

import base64
import dataclasses
import re
import zlib
from collections.abc import Iterator
from typing import Any, cast

import msgspec

from explorer.errors import InputError

SCHEMA = 1
"""Newest schema of links, see `explorer.app.features.sharing.links`; all from 1 on are read."""
_FORM = re.compile(r"([0-9]{1,3})\.([A-Za-z0-9_-]+)\.([0-9a-f]{8})", re.ASCII)
# Largest text that a fragment may unpack to, in bytes.
_LARGEST = 100_000
DAMAGED = "the link is damaged: letters of it are missing or changed; copy the whole of it again"


def encode_fragment(value: Any, schema: int = SCHEMA) -> str:
    """Return the fragment with a value of plain types."""
    deflate = zlib.compressobj(9, wbits=-15)
    packed = deflate.compress(msgspec.json.encode(value)) + deflate.flush()
    text = f"{schema}.{base64.urlsafe_b64encode(packed).decode().rstrip('=')}"
    return f"{text}.{_checksum(text)}"


def decode_fragment(fragment: str) -> bytes:
    """Return the JSON text in a fragment.

    Raises:
        InputError: The fragment is damaged, or has a schema above the newest one that is read.
    """
    parts = _FORM.fullmatch(fragment)
    if parts is None or _checksum(f"{parts[1]}.{parts[2]}") != parts[3]:
        raise InputError(DAMAGED)
    if not 1 <= int(parts[1]) <= SCHEMA:
        raise InputError(
            f"the link has schema {parts[1]}, of another version of the explorer; this one reads "
            f"schemas up to {SCHEMA}"
        )
    inflate = zlib.decompressobj(wbits=-15)
    try:
        packed = base64.urlsafe_b64decode(parts[2] + "=" * (-len(parts[2]) % 4))
        return inflate.decompress(packed, _LARGEST)
    except (ValueError, zlib.error):
        raise InputError(DAMAGED) from None


def sparse(value: Any) -> Any:
    """Return a value as plain types, without the fields of its parts that have their defaults.

    Parts are dataclasses and structs, which `msgspec.convert` reads back.
    """
    if isinstance(value, msgspec.Struct) or dataclasses.is_dataclass(value):
        return {
            name: sparse(each)
            for name, default in _defaults(type(value))
            if (each := getattr(value, name)) != default
        }
    if isinstance(value, list | tuple):
        return [sparse(each) for each in cast("list[Any]", value)]
    return value


def _defaults(kind: Any) -> Iterator[tuple[str, Any]]:
    """Yield the names of the fields of a type and their defaults; a field may have none."""
    is_struct = issubclass(kind, msgspec.Struct)
    for field in msgspec.structs.fields(kind) if is_struct else dataclasses.fields(kind):
        make: Any = field.default_factory
        has_none = make in (msgspec.NODEFAULT, dataclasses.MISSING)
        yield field.name, field.default if has_none else make()


def _checksum(text: str) -> str:
    return f"{zlib.crc32(text.encode()):08x}"
