"""Gestures: the events of one drag count as one move, from the pose where the drag began.

No event leads to a length that cannot be drawn.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from explorer.app.state.action import Action
from explorer.app.state.actions import Open, Reset, SetMode
from explorer.app.state.presses import Press
from explorer.app.state.state import Gesture, State
from explorer.errors import InputError
from explorer.mechanism.design import JOINTS, VARIABLES
from explorer.numerics.number_text import format_number

# Seconds without an event of a control after which the next one begins a new gesture, where no
# press is known.
PAUSE_SECONDS = 1.0
# Largest length over the reach of the design as it was opened: browsers draw in single precision.
LARGEST_SHARE = 1e6


@dataclass(frozen=True)
class UserAction:
    """An action with its origin, which makes the events of one drag one gesture.

    Attributes:
        action: The action.
        source: The control that it came from; a new object for an event that is part of no drag.
        time: Time of the event, in seconds.
        press: The press during which it happened; None for keys, and where none is known.
    """

    action: Action
    source: object
    time: float
    press: Press | None = None

    def continues(self, source: object, last: float, press: Press | None) -> bool:
        """Whether this continues an earlier gesture with the same control.

        All events from press to release are one gesture, and two presses of one browser are two;
        where no press is known, a pause ends a gesture.

        Args:
            source: The control of the earlier gesture.
            last: Time of its last event, in seconds.
            press: Its last press, if any.
        """
        if self.source != source:
            return False
        if self.press is not None and press is not None and self.press.client == press.client:
            return self.press == press
        return self.time - last <= PAUSE_SECONDS

    def apply(self, state: State) -> State:
        """Return the next state, with the gesture that led to its pose.

        Raises:
            ExplorerError: The change is not possible, or its result cannot be drawn.
        """
        after = self.action.apply(state)
        check_drawable(after)
        return replace(after, gesture=self._gesture(state, after))

    def _gesture(self, before: State, after: State) -> Gesture | None:
        is_jump = isinstance(self.action, Open | Reset | SetMode)
        if is_jump or after.design.variables != before.design.variables:
            # The legs did not move from one pose to the other.
            return None
        gesture = before.gesture
        if gesture is not None and self.continues(gesture.source, gesture.last, gesture.press):
            last = max(gesture.last, self.time)
            return replace(gesture, last=last, press=self.press or gesture.press)
        if after.pose == before.pose:
            return gesture
        return Gesture(before.pose, self.source, self.time, self.press)


def check_drawable(state: State) -> None:
    """Check that every length of a state can be drawn at the scale that it was opened in.

    Raises:
        InputError: A design variable, a coordinate, a joint, the guide or a radius is too long.
    """
    reach = state.base.reach
    for names, values in (
        (VARIABLES, state.design.variables),
        ("xyz", state.pose.position),
        (JOINTS, state.joints),
        (("the end of the guide",) * 2, state.design.limits.guide or (0.0, 0.0)),
        (("the radius of a leg",) * 4, state.design.limits.leg_radii),
    ):
        for name, value in zip(names, values, strict=True):
            # Also where it is no number.
            if not abs(value) <= LARGEST_SHARE * reach:
                most = format_number(LARGEST_SHARE * reach)
                raise InputError(
                    f"{name} = {format_number(value)} is too far to be drawn; "
                    f"{most}, a million times the reach, is the most"
                )
