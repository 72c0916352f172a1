"""The optimiser in a process of its own, and its iterates on the page.

The iterates of a quick search are shown one after the other, no faster than they are drawn, and
many of them in few steps.
"""

from __future__ import annotations

import math
import threading
import time

from explorer.app.features.feature import Runner, Services
from explorer.app.features.optimise.actions import add_iterates, cancel_run, compare, end_run
from explorer.app.features.optimise.state import REACHED, Optimisation, SearchResult, SearchRun
from explorer.app.features.optimise.work import optimise
from explorer.app.features.workspace.feeds import WORKSPACE_FEED
from explorer.app.state.actions import Action
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.jobs.jobs import LongJob
from explorer.optimise.outcome import Iterate, Outcome, Settings, compare_designs, record_of
from explorer.optimise.search.sqp import Trail
from explorer.page.session.clock import Ticker

# Least seconds between two iterates on the page, and most to wait for the drawing of one.
PACE, LONGEST = 0.07, 0.25
# About the most advances of the page in a search: with more iterates each shows several.
STEPS = 25
# Seconds after which the process of a cancelled search is ended.
PATIENCE = 0.1
# Seconds in which a search ends before the explorer does.
LONGEST_END = 5.0

# Seconds between two checks for the end of a search.
WAIT_SECONDS = 0.02

SEARCH = "search"
"""Name of the process of the searches."""

DIED = "the optimiser's process died; the design is as it was, and Optimise starts it again"


class Optimiser(Runner):
    """Runner that starts and cancels searches as the state requests, and shows their iterates."""

    def __init__(self, services: Services) -> None:
        self._jobs, self._session = services.jobs, services.session
        # The page shows all of the last iterate once these are settled.
        self._drawings = services.get(WORKSPACE_FEED)
        self._ticker = Ticker(PACE, self._tick)
        services.at_end(self._ticker.stop)
        # Iterates and end that are not shown yet; the process's thread writes them too.
        self._lock = threading.Lock()
        self._waiting: list[Iterate] = []
        self._ending: Outcome | str | None = None
        # Number and job of the last run, no job once it is cancelled, and the time of its last
        # advance.
        self._number = 0
        self._job: LongJob | None = None
        self._advanced = 0.0
        self._compared = 0

    def follow(self, frame: Frame) -> None:
        """Start, cancel or compare as a frame requests, once."""
        run = Optimisation.of(frame.state).run
        if run is None:
            return
        if run.phase == "running" and run.number != self._number:
            self._begin(run)
        elif run.phase == "cancelling" and self._job is not None:
            self._job.cancel(PATIENCE)
            self._job = None
        elif run.phase == "ended" and run.number != self._compared:
            self._compared = run.number
            self._compare(run)

    def prepare(self) -> None:
        """Start the process of the searches."""
        self._jobs.prepare(SEARCH, [optimise.__module__])

    def finish(self) -> None:
        """Cancel a search that goes on, which keeps its best iterate."""
        if Optimisation.of(self._session.state).is_on:
            self._session.do(cancel_run())
            deadline = time.monotonic() + LONGEST_END
            while Optimisation.of(self._session.state).is_on and time.monotonic() < deadline:
                time.sleep(WAIT_SECONDS)
            # The end is saved once it is drawn.
            self._session.wait_until_idle(LONGEST_END)

    def _begin(self, run: SearchRun) -> None:
        with self._lock:
            self._number, self._waiting, self._ending, self._advanced = run.number, [], None, 0.0
        self._job = self._jobs.start(
            optimise,
            (run.problem, run.starts),
            self._keep_end,
            self._keep_end,
            self._receive,
            key=optimise,
            process=SEARCH,
            died=DIED,
        )
        self._ticker.start()

    def _receive(self, iterate: Iterate) -> None:
        with self._lock:
            self._waiting.append(iterate)

    def _keep_end(self, ending: Outcome | str) -> None:
        with self._lock:
            self._ending = ending
        # A cancelled search ends at once.
        self._session.post(self, self._advance)

    def _tick(self) -> bool:
        """Show the next iterates once the last are drawn; return whether the run goes on."""
        with self._lock:
            is_idle = not self._waiting and self._ending is None
        is_late = time.monotonic() - self._advanced > LONGEST
        if not (is_idle or self._session.is_waiting(self)) and (
            self._drawings.is_settled or is_late
        ):
            self._session.post(self, self._advance)
        return self._number != 0

    def _advance(self, state: State) -> Action | None:
        """Return the action that shows the next iterates, or the end once all are shown."""
        run = Optimisation.of(state).run
        with self._lock:
            if run is None or run.number != self._number or run.phase == "ended":
                return None
            self._advanced = time.monotonic()
            count = len(self._waiting)
            is_hasty = run.phase == "cancelling" or isinstance(self._ending, str)
            is_over = self._ending is not None and (count == 0 or is_hasty)
            taken = count if is_over else math.ceil((len(run.iterates) + count) / STEPS)
            iterates, self._waiting = tuple(self._waiting[:taken]), self._waiting[taken:]
            if not is_over or self._ending is None:
                return add_iterates(run.number, iterates)
            self._number = 0
            result = result_of(run, self._ending, run.iterates + iterates)
            return end_run(run.number, result, iterates)

    def _compare(self, run: SearchRun) -> None:
        best = run.best
        if best is not None:
            self._jobs.start(
                compare_designs,
                (run.problem, run.own.design, best.design),
                lambda both: self._session.do(compare(run.number, both)),
                key=compare_designs,
                process=SEARCH,
                died=DIED,
            )


def result_of(run: SearchRun, ending: Outcome | str, iterates: tuple[Iterate, ...]) -> SearchResult:
    """Return the result of a run by its outcome, or without one by its iterates or a problem."""
    if isinstance(ending, Outcome):
        return SearchResult(
            status=ending.status,
            message=ending.words(REACHED),
            best=ending.best,
            starts=len(ending.runs),
            converged=sum(tried.status == "converged" for tried in ending.runs),
            seconds=ending.seconds,
            record=record_of(ending, Settings(starts=run.starts)),
        )
    if run.phase != "cancelling":
        return SearchResult("failed", ending)
    if not iterates:
        return SearchResult("cancelled", "cancelled before the first iterate")
    found = min(iterates, key=Trail(run.problem).rank)
    message = f"cancelled: {REACHED} is the best of {len(iterates)} iterates"
    return SearchResult("cancelled", message, found, starts=iterates[-1].run + 1)
