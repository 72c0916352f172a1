"""Runs the optimiser in a process of its own and lets the page follow its iterates.

The search may be done in a blink, which nobody would see: its iterates are shown one after
the other, no faster than they are drawn, and many of them in few steps.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable

from explorer.app.features.optimise import tasks
from explorer.app.features.optimise.actions import Advance, Compare, EndRun
from explorer.app.session.faults import Faults
from explorer.app.session.jobs import Worker
from explorer.app.session.session import Session
from explorer.app.state.action import Action
from explorer.app.state.frame import Frame
from explorer.app.state.optimisation import SearchResult, cut_short, verdict_of
from explorer.app.state.state import Run, State
from explorer.optimise.outcome import Iterate, Outcome

# Seconds between two iterates that are shown, and that one waits to be drawn at the most.
PACE, LONGEST = 0.07, 0.25
# However many iterates wait, about so many steps show them.
STEPS = 25
# Seconds after which a search that was cancelled ends with its process.
PATIENCE = 0.1

DIED = "the optimiser's process died; the design is as it was, and Optimise starts it again"


class Optimiser:
    """Does what the state asks for: begins the search, cancels it, tells how it goes.

    Args:
        session: Which is told.
        report: Called with a message when the process died or failed unexpectedly.
        is_drawn: Whether the page shows all of the last iterate.
        faults: Where requests are kept that failed unexpectedly; None to keep none.
    """

    def __init__(
        self,
        session: Session,
        report: Callable[[str], None],
        is_drawn: Callable[[], bool],
        faults: Faults | None = None,
    ) -> None:
        self.worker = Worker(report, preload=[tasks.__name__], died=DIED, faults=faults)
        self._session = session
        self._is_drawn = is_drawn
        self._stopped = threading.Event()
        # What has come and was not shown yet; written by the worker's thread too.
        self._lock = threading.Lock()
        self._waiting: list[Iterate] = []
        self._ending: Outcome | str | None = None
        # Of the run that was begun last: its number, its order, when it was last advanced.
        self._number = 0
        self._order = 0
        self._advanced = 0.0
        self._is_cancelled = False
        self._compared = 0

    def follow(self, frame: Frame) -> None:
        """Do what a frame asks for, unless it is done already."""
        run = frame.state.optimisation.run
        if run is None:
            return
        if run.phase == "running" and run.number != self._number:
            self._begin(run)
        elif run.phase == "cancelling" and not self._is_cancelled:
            self._is_cancelled = True
            self.worker.cancel(self._order, PATIENCE)
        elif run.phase == "ended" and run.number != self._compared:
            self._compared = run.number
            self._compare(run)

    def stop(self) -> None:
        """End the process and whatever waits for it."""
        self._stopped.set()
        self.worker.stop()

    def _begin(self, run: Run) -> None:
        number = run.number
        with self._lock:
            self._number, self._waiting, self._ending = number, [], None
            self._is_cancelled, self._advanced = False, 0.0
        self._order = self.worker.submit(
            "optimise",
            tasks.optimise,
            (run.problem, run.starts),
            self._ended,
            self._ended,
            told=self._told,
        )
        threading.Thread(target=self._play, args=(number,), name="iterates", daemon=True).start()

    def _told(self, iterate: Iterate) -> None:
        with self._lock:
            self._waiting.append(iterate)

    def _ended(self, ending: Outcome | str) -> None:
        with self._lock:
            self._ending = ending
        if self._is_cancelled:
            self._post()

    def _play(self, number: int) -> None:
        """Advance the page from iterate to iterate until the run has ended."""
        while not self._stopped.wait(PACE):
            with self._lock:
                if self._number != number:
                    return
                is_idle = not self._waiting and self._ending is None
            if is_idle or self._session.is_waiting(self):
                continue
            if self._is_drawn() or time.monotonic() - self._advanced > LONGEST:
                self._post()

    def _post(self) -> None:
        self._session.post(self, self._advance)

    def _advance(self, state: State) -> Action:
        """Return what shows the next iterates, or the end once all are shown."""
        run = state.optimisation.run
        with self._lock:
            if run is None or run.number != self._number or run.phase == "ended":
                return Advance(0, ())
            self._advanced = time.monotonic()
            count = len(self._waiting)
            is_hasty = self._is_cancelled or isinstance(self._ending, str)
            is_over = self._ending is not None and (count == 0 or is_hasty)
            taken = count if is_over else math.ceil(count / STEPS)
            shown, self._waiting = tuple(self._waiting[:taken]), self._waiting[taken:]
            if not is_over or self._ending is None:
                return Advance(run.number, shown)
            self._number = 0
            verdict = _verdict(run, run.iterates + shown, self._ending, self._is_cancelled)
            return EndRun(run.number, verdict, shown)

    def _compare(self, run: Run) -> None:
        best, problem = run.best, run.problem
        if best is None:
            return
        demands = problem.demands
        margin = None if demands.clearance is None else demands.clearance_margin
        box = demands.required_box
        boxes = (box, None if box is None else problem.required_box_at(best.values))
        self.worker.submit(
            "compare",
            tasks.compare,
            (run.own.design, best.design, margin, boxes),
            lambda found: self._session.do(Compare(run.number, found)),
            lambda _: None,
        )


def _verdict(
    run: Run, iterates: tuple[Iterate, ...], ending: Outcome | str, is_cancelled: bool
) -> SearchResult:
    if isinstance(ending, Outcome):
        return verdict_of(ending, run.starts)
    if is_cancelled:
        return cut_short(run.problem, iterates)
    return SearchResult("failed", ending)
