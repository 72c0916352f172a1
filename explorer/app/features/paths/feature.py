"""Paths between two poses: their declaration, the line in the scene, and the runner that plays."""

from __future__ import annotations

import time
from threading import Thread

import numpy as np
import viser

from explorer.app.features.feature import Feature, Runner, Services, Tab, show
from explorer.app.features.paths.actions import DRIVES_FEED, advance_journey, plan, play, take_plan
from explorer.app.features.paths.panel import PathsPanel, slow_words
from explorer.app.features.paths.state import Journey, Paths, is_playing, journey_of
from explorer.app.features.paths.stops import stops_in_table, stops_of
from explorer.app.scene.placing import Placed, ScenePart
from explorer.app.scene.shapes import Balls, add_label, add_lines
from explorer.app.state.actions import Action
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.widgets.buttons import activity, press_button
from explorer.app.widgets.chips import StateCommand
from explorer.files.extras import is_missing, load_extra
from explorer.jobs.jobs import LongJob
from explorer.mechanism.configuration import position_of
from explorer.mechanism.pose import Pose, rotation_from_quaternion
from explorer.numerics.number_text import format_decimals, format_number
from explorer.page.session.clock import Ticker
from explorer.page.widgets.assigning import Updates
from explorer.page.widgets.palette import Key
from explorer.paths.shortest_time import TIMING
from explorer.singularity.colours import FAR, SINGULAR

# Number of crossings that are drawn at most.
MOST_CROSSINGS = 24
RADIUS = 0.2
# Time between two frames of a path, in seconds, and the longest step between them along it.
FRAME_SECONDS, LONGEST_STEP = 0.04, 0.25
DIED = "the planner's process ended; Go starts it again"


class PathScene(ScenePart):
    """A line with its label, and a ball at each crossing of a singularity."""

    def __init__(self, services: Services) -> None:
        scene = services.scene
        self._line = add_lines(scene, "/path/line", 1, FAR, 2.5)
        self._label = add_label(scene, "/path/label", "path")
        self._balls = Balls(scene, "/path/crossings", [SINGULAR] * MOST_CROSSINGS)

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that draw the path of this frame."""
        state, journey = placed.frame.state, journey_of(placed.frame.state)
        yield from show(journey is not None, self._line, self._label)
        crossings = () if journey is None else journey.margins.crossings[:MOST_CROSSINGS]
        yield from self._balls.show(bool(crossings))
        if journey is None:
            return
        timed = journey.trajectory
        track = timed.position + state.offset(rotation_from_quaternion(timed.quaternion))
        points = placed.scale * track
        segments = np.stack([points[:-1], points[1:]], axis=1)
        yield self._line, "points", segments.astype(np.float32)
        yield self._label, "position", tuple(points[len(points) // 2].tolist())
        if crossings:
            centres, radii = np.zeros((MOST_CROSSINGS, 3)), np.full(MOST_CROSSINGS, 1e-6)
            at = [position_of(state.design, each.pose, state.view.at) for each in crossings]
            centres[: len(at)], radii[: len(at)] = at, RADIUS
            yield from self._balls.at(placed.scale * centres, radii)


def path_chip(frame: Frame) -> str:
    """Return the path that is planned or played and a button that ends it, as HTML; else ""."""
    state = frame.state
    if Paths.of(state).is_planning:
        cancel = press_button("paths.cancel", "", "Cancel", class_name="ex-button")
        words = f"{format_number(Paths.of(state).seconds)} s at most"
        return activity("Paths", "Planning a path", words, None, cancel)
    journey = journey_of(state)
    if journey is None or not journey.is_playing:
        return ""
    pause = press_button("paths.play", "off", "Pause", class_name="ex-button")
    share = journey.at / journey.trajectory.duration
    words = f"{format_decimals(journey.at, 1)} s"
    if slow := slow_words(state):
        words += f", {slow}"
    return activity("Paths", "Playing", words, share, pause)


class PathRunner(Runner):
    """Plays and plans paths as the frames request."""

    def __init__(self, services: Services) -> None:
        self._jobs, self._session = services.jobs, services.session
        self._ticker = Ticker(FRAME_SECONDS, self._tick)
        services.at_end(self._ticker.stop)
        self._is_playing = False
        self._advanced_at = 0.0
        # The last request to plan: its number, and its job, None once it is done.
        self._request = 0
        self._job: LongJob | None = None

    def prepare(self) -> None:
        """Load what finds the shortest times, which takes seconds, before anybody asks for one."""
        if not is_missing("timing"):
            Thread(target=load_extra, args=("timing", *TIMING), daemon=True).start()

    def follow(self, frame: Frame) -> None:
        """Start or stop playing and planning as a frame requests."""
        paths = Paths.of(frame.state)
        was_playing, self._is_playing = self._is_playing, is_playing(frame.state)
        if self._is_playing and not was_playing:
            self._advanced_at = time.monotonic()
            self._ticker.start()
        if paths.is_planning and paths.request != self._request:
            self._request = paths.request
            self._plan(frame.state)
        elif not paths.is_planning and self._job is not None:
            self._job.cancel(0.0)
            self._job = None

    def _plan(self, state: State) -> None:
        number, design, paths = self._request, state.design, Paths.of(state)
        tool, view = state.tool, state.view
        load = state.load if paths.holds_load else None
        weighed, density = view.forces.weighed, view.prototype.density

        stops = stops_of(state)

        def take_path(path: tuple[tuple[Pose, ...], tuple[int, ...]]) -> None:
            corners, places = path
            moves, pauses = len(corners) - 1, [0.0] * len(corners)
            for stop, place in zip(stops, places, strict=True):
                pauses[place] += stop.pause
            title = f"Planned path of {moves} {'move' if moves == 1 else 'moves'}"
            kinds = "planned", title, design, corners
            journey = Journey(*kinds, is_playing=True, tool=tool, pauses=tuple(pauses))
            self._finish(number, journey, None)

        self._job = self._jobs.start(
            plan,
            (design, paths.planning, paths.seconds, tool, load, weighed, density),
            take_path,
            lambda problem: self._finish(number, None, problem),
            key="plan",
            process="plan",
            died=DIED,
        )

    def _finish(self, request: int, journey: Journey | None, problem: str | None) -> None:
        if request == self._request:
            self._job = None
        self._session.do(take_plan(request, journey, problem))

    def _tick(self) -> bool:
        # A step that still waits will cover the time until the session handles it.
        if self._is_playing and not self._session.is_waiting(self):
            self._session.post(self, self._advance)
        return self._is_playing

    def _advance(self, _: State) -> Action:
        now = time.monotonic()
        passed, self._advanced_at = min(now - self._advanced_at, LONGEST_STEP), now
        return advance_journey(passed)


def open_poses(services: Services, data: bytes, name: str) -> tuple[Action, str]:
    """Return the action that takes a table of poses for the next path; see `Opener`."""
    state = services.session.latest_state()
    action = stops_in_table(state, data, name)
    return action, f"{action.describe(state)}; the tab Paths has them."


PATHS = Feature(
    "paths",
    manual="singularity.md#Paths",
    tabs=(Tab("work", "Paths", PathsPanel, viser.Icon.ROUTE),),
    bar=(("right", lambda _: path_chip),),
    verdicts={
        "No singular pose": "The path crosses no singular pose.",
        "Singular once": "The path goes through a singular pose, where the platform is not held.",
        "No path": "No path was found that keeps what was asked for.",
    },
    scene=(PathScene,),
    later_feeds=(DRIVES_FEED,),
    runners=(PathRunner,),
    openers={".csv": open_poses},
    commands=(
        StateCommand(
            "Paths › Play or pause",
            "Play the present path, or pause it.",
            lambda state: play(not is_playing(state)),
            is_ready=lambda state: journey_of(state) is not None,
            keys=(Key("P"),),
        ),
    ),
)
