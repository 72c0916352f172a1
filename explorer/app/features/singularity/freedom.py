"""What a singular pose means: the motions that locked actuators allow, in words and as a ghost.

A press on a motion has a ghost of the platform swing to and fro about its line. It is no part of
the state, and ends once the platform or the design is another one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import viser

from explorer.app.features.feature import Services
from explorer.app.features.singularity.scene import PlatformGhost
from explorer.app.scene.labels import add_label
from explorer.app.scene.part import ScenePart
from explorer.app.scene.placing import Placed
from explorer.app.scene.shapes import add_lines
from explorer.app.session.clock import now, start_timer
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.buttons import press_button
from explorer.app.widgets.colours import SINGULAR
from explorer.mechanism.folds import FOLD_LINES
from explorer.numerics.arrays import FloatArray
from explorer.singularity.freedoms import FreeTurn

SHOW = "singular.show"
SHOW_HINT = "Swing a ghost of the platform about this line, by up to 5 % of the reach."
# Seconds of a swing to and fro, number of swings, and seconds between two frames.
PERIOD, PERIODS, FRAME_SECONDS = 1.8, 2, 0.04
# Way of the fastest of b1 to b4 from its place, over the reach, and the largest angle.
AMPLITUDE, LARGEST_ANGLE = 0.05, math.radians(30.0)
# Length of the axis beyond the points of the mechanism, over the reach.
OVERHANG = 0.15


@dataclass(frozen=True)
class _Shown:
    """A motion that is shown: a turn of the platform in a frame, since a time of the clock."""

    frame: Frame
    turn: FreeTurn
    begun: float

    @property
    def is_over(self) -> bool:
        return now() - self.begun >= PERIODS * PERIOD

    def is_of(self, state: State) -> bool:
        """Whether a state has its design and pose."""
        own = self.frame.state
        return state.pose == own.pose and state.design == own.design

    @property
    def angle(self) -> float:
        """The angle of the ghost at present, in radians."""
        points = self.frame.snapshot.points
        arms = np.array([points.b1, points.b2, points.b3, points.b4]) - self.turn.point
        longest = float(np.linalg.norm(np.cross(arms, self.turn.direction), axis=1).max())
        way = AMPLITUDE * self.frame.state.design.reach
        largest = way / longest if way < LARGEST_ANGLE * longest else LARGEST_ANGLE
        return largest * math.sin(2.0 * math.pi * (now() - self.begun) / PERIOD)


class FreeMotion(ScenePart):
    """The ghost of the platform that shows a motion, and the line about which it turns."""

    def __init__(self, services: Services) -> None:
        scene, self._session = services.scene, services.session
        self._ghost = PlatformGhost(scene, "/freedom")
        self._axis = add_lines(scene, "/freedom/axis", 1, SINGULAR, 3.0)
        self._label = add_label(scene, "/freedom/label", "", visible=False)
        self._frame: Frame | None = None
        self._shown: _Shown | None = None
        services.buttons.on(SHOW, self._begin, values={"1", "2", "3"})
        for incidence, line in enumerate(FOLD_LINES, 1):
            services.buttons.offer(
                f"Singularity › Show the turn about the {line}",
                f"{SHOW_HINT} It is one that locked actuators allow where δ{incidence} = 0.",
                SHOW,
                str(incidence),
                lambda incidence=incidence: self._motion(incidence) is not None,
            )
        services.at_end(self._end)

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw the motion at this time."""
        self._frame, shown = placed.frame, self._shown
        if shown is not None and (shown.is_over or not shown.is_of(placed.frame.state)):
            shown = self._shown = None
        yield from self._ghost.show(shown is not None)
        yield self._axis, "visible", shown is not None
        yield self._label, "visible", shown is not None
        if shown is None:
            return
        yield from self._ghost.draw(placed, shown.turn.move(shown.frame.state.pose, shown.angle))
        low, high = _ends_of_axis(placed, shown.turn)
        yield self._axis, "points", np.stack([low, high])[None].astype(np.float32)
        yield self._label, "text", f"turns about {shown.turn.line_name}"
        yield self._label, "position", tuple(high.tolist())

    def _motion(self, incidence: int) -> _Shown | None:
        """Return the motion that begins now in the last frame; None if it is not free there."""
        frame = self._frame
        if frame is None or not frame.snapshot.is_singular:
            return None
        motions = (_Shown(frame, turn, now()) for turn in frame.snapshot.freedoms.turns)
        return next((each for each in motions if each.turn.incidence == incidence), None)

    def _begin(self, value: str, client: viser.ClientHandle) -> None:
        del client
        motion = self._motion(int(value))
        if motion is not None:
            self._shown = motion
            self._draw_on(motion)

    def _draw_on(self, shown: _Shown) -> None:
        """Draw a motion again and again until it is over, or another one is shown."""
        self._session.redraw()
        if shown is self._shown and not shown.is_over:
            start_timer(FRAME_SECONDS, self._draw_on, shown)

    def _end(self) -> None:
        self._shown = None


def _ends_of_axis(placed: Placed, turn: FreeTurn) -> tuple[FloatArray, FloatArray]:
    """Return the ends of the part of the line that is drawn, beyond all points beside it."""
    foot = placed.scale * turn.point
    along = (np.array(list(placed.points.values())) - foot) @ turn.direction
    overhang = OVERHANG * placed.reach
    low, high = float(along.min()) - overhang, float(along.max()) + overhang
    return foot + low * turn.direction, foot + high * turn.direction


def show_button(incidence: int) -> str:
    """Return the button that shows the turn of an incidence, as HTML."""
    label = f"Show the motion: turn about the {FOLD_LINES[incidence - 1]}"
    return press_button(
        SHOW, incidence, "Show the motion", hint=SHOW_HINT, label=label, class_name="ex-link"
    )
