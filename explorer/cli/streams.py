"""Standard output and standard error, whatever they are connected to.

Everything is written through here, so that a closed pipe, a full disk or a terminal
without Greek letters ends in a plain message at the most.
"""

from __future__ import annotations

import os
import sys
from io import TextIOWrapper

from explorer.errors import ExplorerError


class OutputError(ExplorerError):
    """Standard output takes nothing, for instance because the disk is full."""


def prepare() -> None:
    """Make both streams take any text: elsewhere if closed, with ? for what they lack."""
    # A process started with its output closed has None here.
    if sys.stdout is None or sys.stderr is None:
        nowhere = os.fdopen(os.open(os.devnull, os.O_WRONLY), "w", encoding="utf-8")
        sys.stdout, sys.stderr = sys.stdout or nowhere, sys.stderr or nowhere
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="replace")


def write(text: str) -> None:
    """Write text to standard output, at once.

    Raises:
        OutputError: it cannot be written.
        BrokenPipeError: nobody reads it any more.
    """
    try:
        sys.stdout.write(text)
        sys.stdout.flush()
    except OSError as error:
        # The interpreter writes out what is left at the exit: let that go nowhere.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if isinstance(error, BrokenPipeError):
            raise
        raise OutputError(f"cannot write to standard output: {error.strerror}") from None


def complain(message: str) -> None:
    """Write one line to standard error."""
    sys.stderr.write(" ".join(message.split()) + "\n")
