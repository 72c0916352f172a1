"""Plays paths, and has them planned in a process of its own, as the state asks for it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

from explorer.app.features.paths import tasks
from explorer.app.features.paths.actions import Advance, TakePlan
from explorer.app.session.faults import Faults
from explorer.app.session.jobs import Worker
from explorer.app.session.session import Session
from explorer.app.state.action import Action
from explorer.app.state.frame import Frame
from explorer.app.state.paths import Journey
from explorer.app.state.state import State
from explorer.paths.planning import PlannedPath

# Seconds between two frames that are played.
PACE = 0.04
# The longest way on in one frame, however long it took to draw.
LONGEST = 0.25
DIED = "the planner's process ended; Plan starts it again"


class PathRunner:
    """Follows the frames: plays while one is playing, plans while one is planning.

    Args:
        session: Which is told.
        report: Called with a message when the process died or failed unexpectedly.
        faults: Where requests are kept that failed unexpectedly; None to keep none.
    """

    def __init__(
        self, session: Session, report: Callable[[str], None], faults: Faults | None = None
    ) -> None:
        self.worker = Worker(report, preload=[tasks.__name__], died=DIED, faults=faults)
        self._session = session
        self._stopped = threading.Event()
        self._playing = threading.Event()
        self._played = 0.0
        self._thread: threading.Thread | None = None
        # Of the last request: its number and its order, None once it is over.
        self._request = 0
        self._order: int | None = None

    def follow(self, frame: Frame) -> None:
        """Do what a frame asks for, unless it is done already."""
        journey, paths = frame.state.journey, frame.state.paths
        if journey is not None and journey.is_playing:
            self._play()
        else:
            self._playing.clear()
        if paths.is_planning and paths.request != self._request:
            self._request = paths.request
            self._plan(frame.state)
        elif not paths.is_planning and self._order is not None:
            self.worker.cancel(self._order, 0.0)
            self._order = None

    def stop(self) -> None:
        """End the process and the playing."""
        self._stopped.set()
        self._playing.set()
        self.worker.stop()
        if self._thread is not None:
            self._thread.join(timeout=5.0)

    def _plan(self, state: State) -> None:
        request, design, paths = self._request, state.design, state.paths

        def found(path: PlannedPath) -> None:
            moves = len(path.poses) - 1
            title = f"Planned path of {moves} {'move' if moves == 1 else 'moves'}"
            self._end(request, Journey("plan", title, design, path.poses), None)

        self._order = self.worker.submit(
            "plan",
            tasks.plan,
            (design, paths.start, paths.goal, paths.seconds),
            found,
            lambda problem: self._end(request, None, problem),
        )

    def _end(self, request: int, journey: Journey | None, problem: str | None) -> None:
        if request == self._request:
            self._order = None
        self._session.do(TakePlan(request, journey, problem))

    def _play(self) -> None:
        if self._playing.is_set():
            return
        self._played = time.monotonic()
        self._playing.set()
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, name="player", daemon=True)
            self._thread.start()

    def _run(self) -> None:
        while self._playing.wait() and not self._stopped.wait(PACE):
            # One that waits covers the time until it is its turn.
            if self._playing.is_set() and not self._session.is_waiting(self):
                self._session.post(self, self._advance)

    def _advance(self, _: State) -> Action:
        now = time.monotonic()
        passed, self._played = min(now - self._played, LONGEST), now
        return Advance(passed)
