"""The runner that plays paths, and plans them in a process of its own."""

from __future__ import annotations

import threading
import time

from explorer.app.features.feature import Runner, Services
from explorer.app.features.forces.tasks import load_of
from explorer.app.features.paths.actions import Advance, TakePlan
from explorer.app.features.paths.work import PlanRequest, plan
from explorer.app.session.jobs import Worker
from explorer.app.state.action import Action
from explorer.app.state.frame import Frame
from explorer.app.state.paths import Journey
from explorer.app.state.state import State
from explorer.paths.planning import PlannedPath

# Time between two frames of a path, in seconds.
FRAME_SECONDS = 0.04
# Longest step of a path between two frames, in seconds, even if a frame takes longer.
LONGEST_STEP = 0.25
DIED = "the planner's process ended; Go starts it again"


class PathRunner(Runner):
    """Plays and plans paths as the frames request."""

    def __init__(self, services: Services) -> None:
        self.worker = Worker(services.tell, preload=[plan.__module__], died=DIED)
        self._session = services.session
        services.at_end(self.stop)
        self._stopped = threading.Event()
        self._playing = threading.Event()
        self._advanced_at = 0.0
        self._thread: threading.Thread | None = None
        # The last request to plan: its number, and its order at the worker, None once it is done.
        self._request = 0
        self._order: int | None = None

    def follow(self, frame: Frame) -> None:
        """Start or stop playing and planning as a frame requests."""
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
        """End the planner's process and the thread that plays."""
        self._stopped.set()
        self._playing.set()
        self.worker.stop()
        if self._thread is not None:
            self._thread.join(timeout=5.0)

    def _plan(self, state: State) -> None:
        number, design, paths = self._request, state.design, state.paths
        if paths.planning is None:
            return
        tool, view = state.tool, state.view
        request = PlanRequest(
            design,
            *paths.planning,
            paths.seconds,
            tool,
            load_of(state) if paths.holds_load else None,
            view.forces.weighed,
            view.prototype.density,
        )

        def take_path(path: PlannedPath) -> None:
            moves = len(path.poses) - 1
            title = f"Planned path of {moves} {'move' if moves == 1 else 'moves'}"
            journey = Journey("planned", title, design, path.poses, is_playing=True, tool=tool)
            self._finish(number, journey, None)

        self._order = self.worker.submit(
            "plan",
            plan,
            (request,),
            take_path,
            lambda problem: self._finish(number, None, problem),
        )

    def _finish(self, request: int, journey: Journey | None, problem: str | None) -> None:
        if request == self._request:
            self._order = None
        self._session.do(TakePlan(request, journey, problem))

    def _play(self) -> None:
        if self._playing.is_set():
            return
        self._advanced_at = time.monotonic()
        self._playing.set()
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, name="player", daemon=True)
            self._thread.start()

    def _run(self) -> None:
        while self._playing.wait() and not self._stopped.wait(FRAME_SECONDS):
            # A step that still waits will cover the time until the session handles it.
            if self._playing.is_set() and not self._session.is_waiting(self):
                self._session.post(self, self._advance)

    def _advance(self, _: State) -> Action:
        now = time.monotonic()
        passed, self._advanced_at = min(now - self._advanced_at, LONGEST_STEP), now
        return Advance(passed)
