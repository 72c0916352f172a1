"""Standard output and standard error, robust against what they are connected to.

Commands write through these functions only, so that a closed pipe, a full disk or a terminal
without Greek letters causes no traceback.
"""

from __future__ import annotations

import os
import sys
from io import TextIOWrapper

from explorer.errors import ExplorerError


class OutputError(ExplorerError):
    """Standard output cannot be written, for instance because the disk is full."""


def prepare() -> None:
    """Make both streams accept any text: replace closed ones, write ? for missing characters."""
    # A stream that was closed when the process started is None.
    if sys.stdout is None or sys.stderr is None:
        nowhere = os.fdopen(os.open(os.devnull, os.O_WRONLY), "w", encoding="utf-8")
        sys.stdout, sys.stderr = sys.stdout or nowhere, sys.stderr or nowhere
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="replace")


def write(text: str) -> None:
    """Write text to standard output and flush it.

    Raises:
        OutputError: Standard output cannot be written.
        BrokenPipeError: The reader has closed the pipe.
    """
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
    sys.stderr.write(" ".join(message.split()) + "\n")
