"""Standard output and standard error, robust against what they are connected to, and progress.

Commands write through these functions only, so that a closed pipe, a full disk or a terminal
without Greek letters causes no traceback. Progress goes to standard error: a bar in a terminal,
elsewhere one line per second.
"""

from __future__ import annotations

import codecs
import os
import re
import sys
import time
import unicodedata
from contextvars import ContextVar
from io import TextIOWrapper
from types import TracebackType
from typing import TYPE_CHECKING, Self

from explorer.errors import ExplorerError

if TYPE_CHECKING:
    from explorer.optimise.outcome import Iterate


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


class Meter:
    """A progress bar with a line of text."""

    def __init__(self) -> None:
        self.is_terminal = sys.stderr.isatty()
        self._last_update = 0.0
        self._last_width = 0

    def __enter__(self) -> Self:
        """Return the meter."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Erase the bar from a terminal."""
        self.clear()

    def clear(self) -> None:
        """Erase the bar from a terminal."""
        if self._last_width and self.is_terminal:
            write_progress("\r" + " " * self._last_width + "\r")
        self._last_width = 0

    @property
    def is_due(self) -> bool:
        """Whether the last update is old enough for another."""
        pause = IN_TERMINAL if self.is_terminal else ELSEWHERE
        return time.monotonic() - self._last_update >= pause

    def show(self, text: str, share: float) -> None:
        """Show a line, unless the last update is too recent.

        Args:
            text: Text beside the bar.
            share: Completed share of the work, from 0 to 1.
        """
        if not self.is_due:
            return
        self._last_update = time.monotonic()
        full = round(WIDTH * share)
        text = f"[{'#' * full}{'.' * (WIDTH - full)}] {text}"
        if self.is_terminal:
            write_progress("\r" + text.ljust(self._last_width)[:200])
            self._last_width = len(text)
        else:
            write_progress(text + "\n")


class SearchMeter(Meter):
    """A progress bar for the iterates of an optimisation.

    Args:
        starts: Number of starts.
        iterations: Largest number of iterations per start.
        objective: Symbol of the objective, such as "F".
    """

    def __init__(self, starts: int, iterations: int, objective: str) -> None:
        super().__init__()
        self.starts = starts
        self.iterations = iterations
        self.objective = objective
        self._steps = 0
        self._run: int = 0

    def show_iterate(self, iterate: Iterate) -> None:
        """Show an iterate, unless the last update is too recent."""
        if iterate.run != self._run:
            self._run, self._steps = iterate.run, 0
        self._steps += 1
        if not self.is_due:
            return
        share = (iterate.run + min(1.0, self._steps / self.iterations)) / self.starts
        text = (
            f"start {iterate.run + 1} of {self.starts}, "
            f"{iterate.phase} {self._steps}: {self.objective} {iterate.value:.6g}, "
            f"volume {iterate.volume:.6g}"
        )
        if iterate.spare < 0.0:
            text += f", missed: {iterate.worst}"
        self.show(text, share)
