"""Standard output and standard error, robust against what they are connected to.

Commands write through these functions only, so that a closed pipe, a full disk or a terminal
without Greek letters causes no traceback.
"""

from __future__ import annotations

import codecs
import os
import re
import sys
import unicodedata
from contextvars import ContextVar
from io import TextIOWrapper

from explorer.errors import ExplorerError

# Characters of ASCII in place of those that a terminal cannot show.
_PLAIN = {
    **dict(zip("±∓≤≥≠→←", ["+-", "-+", "<=", ">=", "!=", "->", "<-"], strict=True)),
    **dict(zip("°∞√ßµ", [" deg", "inf", "sqrt", "ss", "u"], strict=True)),
    **dict(zip("−–—×·⁄›′‘’“”≈∂•", "---x./>'''\"\"~d*", strict=True)),
}
# Letters that Unicode does not decompose, by their names: ø becomes o, and δ is written out.
_LETTER = re.compile(r"(?:LATIN|GREEK) (SMALL|CAPITAL) (?:LETTER|LIGATURE) ([A-Z]+)\b.*")

answered: ContextVar[bool] = ContextVar("answered", default=False)
"""Whether anything was written to standard output since `prepare`."""


class OutputError(ExplorerError):
    """Standard output cannot be written, for instance because the disk is full."""


def prepare() -> None:
    """Make both streams accept any text: replace closed ones, and characters that they lack."""
    codecs.register_error("explorer.plain", _write_plainly)
    answered.set(False)
    # A stream that was closed when the process started is None.
    if sys.stdout is None or sys.stderr is None:
        nowhere = os.fdopen(os.open(os.devnull, os.O_WRONLY), "w", encoding="utf-8")
        sys.stdout, sys.stderr = sys.stdout or nowhere, sys.stderr or nowhere
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="explorer.plain")


def _write_plainly(error: UnicodeError) -> tuple[str | bytes, int]:
    """Return ASCII in place of what cannot be encoded, and where to go on.

    A minus sign becomes a hyphen, ä becomes a, ² becomes 2, δ becomes delta, and what has no like
    becomes ?.
    """
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return "".join(map(_plain, error.object[error.start : error.end])), error.end


def _plain(letter: str) -> str:
    """Return the ASCII most like a letter."""
    if letter.isascii() or letter in _PLAIN:
        return _PLAIN.get(letter, letter)
    parts = unicodedata.normalize("NFKD", letter)
    if parts != letter:
        return "".join(map(_plain, parts))
    named = _LETTER.fullmatch(unicodedata.name(letter, ""))
    if named is not None:
        return named[2].lower() if named[1] == "SMALL" else named[2].title()
    return "" if unicodedata.combining(letter) else "?"


def write(text: str) -> None:
    """Write text to standard output and flush it.

    Raises:
        OutputError: Standard output cannot be written.
        BrokenPipeError: The reader has closed the pipe.
    """
    answered.set(True)
    try:
        sys.stdout.write(text)
        sys.stdout.flush()
    except OSError as error:
        # The interpreter flushes the rest at exit: discard it.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if isinstance(error, BrokenPipeError):
            raise
        raise OutputError(f"cannot write to standard output: {error.strerror}") from None


def write_error(message: str) -> None:
    """Write one line to standard error."""
    write_progress(" ".join(message.split()) + "\n")


def write_progress(text: str) -> None:
    """Write text to standard error and flush it, or give it up for good if that fails."""
    try:
        sys.stderr.write(text)
        sys.stderr.flush()
    except OSError:
        # There is no place left to tell it, and the answer goes elsewhere.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stderr.fileno())
