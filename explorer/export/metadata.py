"""Metadata of the files: the program, names, comments, the design as JSON, and colours."""

from __future__ import annotations

import json
import re
import unicodedata
from typing import TypeAlias

import msgspec

from explorer import __version__
from explorer.mechanism.design import Design

Rgb: TypeAlias = tuple[int, int, int]
"""A colour in sRGB, each channel from 0 to 255."""

APPLICATION = f"flagged-explorer {__version__}"


# Largest number of characters of a name in a file.
LONGEST_NAME = 160

# Readers of PLY take lines of a few hundred characters only. A piece of a comment ends after a
# comma if it can; never at a blank, which programs trim, nor at a backslash, which in OBJ would
# append the next line.
_PIECE = re.compile(r".{1,160}(?<![ \\])(?! )(?:(?<=,)|$)|.{1,160}(?<![ \\])(?! )")


def json_line(value: object) -> str:
    """Return plain values as JSON on one line, in ASCII, that readers of comments stand.

    It has no two backslashes in a row, and not the last word of the header of a PLY file.
    """
    text = json.dumps(value, separators=(",", ":")).replace("\\\\", "\\u005c")
    return text.replace("end_header", "end\\u005fheader")


def design_json(design: Design) -> str:
    """Return the design as JSON, as `json_line` does."""
    return json_line(json.loads(msgspec.json.encode(design)))


def printable_name(name: str) -> str:
    """Return a name as one printable line of 1 to `LONGEST_NAME` characters."""
    printable = "".join(letter if letter.isprintable() else " " for letter in name)
    return " ".join(printable.split())[:LONGEST_NAME].rstrip() or "workspace"


def ascii_name(name: str) -> str:
    """Return a name in ASCII: letters without their accents, others left out; δ1 becomes 1."""
    return printable_name(unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode())


def comments(mark: str, text: str) -> list[str]:
    """Return a text in ASCII as comments of at most 160 characters, each after the same mark.

    Args:
        mark: Start of a comment, such as "comment design".
        text: What `json_line` returns; joining what follows the marks gives it back.
    """
    return [f"{mark} {piece}" for piece in _PIECE.findall(text)]


def linear(channel: int) -> float:
    """Return a channel of sRGB, 0 to 255, as linear light from 0 to 1 (IEC 61966-2-1)."""
    share = channel / 255.0
    return share / 12.92 if share <= 0.04045 else ((share + 0.055) / 1.055) ** 2.4
