"""Progress on standard error: a bar in a terminal, elsewhere one line per second."""

from __future__ import annotations

import sys
import time
from types import TracebackType
from typing import TYPE_CHECKING, Self

from explorer.cli.streams import write_progress

if TYPE_CHECKING:
    from explorer.optimise.outcome import Iterate

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
