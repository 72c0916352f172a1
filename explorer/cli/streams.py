"""Standard output and standard error, robust against what they are connected to, and progress.

Commands write through these functions only, so that a closed pipe, a full disk or a terminal
without Greek letters causes no traceback. Progress goes to standard error: a bar in a terminal,
elsewhere one line per second.
"""

from __future__ import annotations

import os
import sys
import time
from contextlib import AbstractContextManager
from contextvars import ContextVar
from io import TextIOWrapper

from explorer.errors import ExplorerError

answered: ContextVar[bool] = ContextVar("answered", default=False)
"""Whether anything was written to standard output since `prepare`."""


class OutputError(ExplorerError):
    """Standard output cannot be written, for instance because the disk is full."""


def prepare() -> None:
    """Make both streams accept any text, and replace closed ones.

    A file and a pipe take UTF-8; a terminal gets ? for a character that it lacks.
    """
    answered.set(False)
    # A stream that was closed when the process started is None.
    if sys.stdout is None or sys.stderr is None:
        nowhere = os.fdopen(os.open(os.devnull, os.O_WRONLY), "w", encoding="utf-8")
        sys.stdout, sys.stderr = sys.stdout or nowhere, sys.stderr or nowhere
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(encoding=None if stream.isatty() else "utf-8", errors="replace")


def write(text: str) -> None:
    """Write text to standard output and flush it."""
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


WIDTH = 20
# Seconds between updates, in a terminal and elsewhere.
IN_TERMINAL, ELSEWHERE = 0.05, 1.0


class Meter(AbstractContextManager["Meter"]):
    """A progress bar with a line of text, which goes from a terminal at the end."""

    def __init__(self) -> None:
        self.is_terminal = sys.stderr.isatty()
        self._last_update = 0.0
        self._last_width = 0

    def __exit__(self, *_: object) -> None:
        """Erase the bar from a terminal."""
        if self._last_width and self.is_terminal:
            write_progress("\r" + " " * self._last_width + "\r")

    def tell(self, line: str) -> None:
        """Write a line that stays, above the bar."""
        erased = "\r" + " " * self._last_width + "\r" if self.is_terminal else ""
        write_progress(f"{erased}{line}\n")

    def show(self, text: str, share: float) -> None:
        """Show a line beside a bar of the completed share, unless the last update is too recent."""
        pause = IN_TERMINAL if self.is_terminal else ELSEWHERE
        if time.monotonic() - self._last_update < pause:
            return
        self._last_update = time.monotonic()
        full = round(WIDTH * share)
        text = f"[{'#' * full}{'.' * (WIDTH - full)}] {text}"
        if self.is_terminal:
            write_progress("\r" + text.ljust(self._last_width)[:200])
            self._last_width = len(text)
        else:
            write_progress(text + "\n")
