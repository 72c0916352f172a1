"""What hands do: an action with the control that it came from, its press and its time.

The many events of one drag are one gesture, of which the pose where it began is kept.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from explorer.app.state.action import Action
from explorer.app.state.actions import Open, Reset, SetMode
from explorer.app.state.drawable import check_drawable
from explorer.app.state.presses import Press
from explorer.app.state.state import Gesture, State

# Where no press is told of, a hand that has not moved a control for longer, in seconds, begins a
# new gesture with it.
PAUSE_SECONDS = 1.0


@dataclass(frozen=True)
class ByHand:
    """An action with its origin, by which the many events of one drag become one gesture.

    Attributes:
        action: What is done.
        source: The control that it came from; one of its own for what is no drag.
        time: When it happened, in seconds.
        press: During which it happened; None for keys, and where no press is told of.
    """

    action: Action
    source: object
    time: float
    press: Press | None = None

    def goes_on(self, source: object, last: float, press: Press | None) -> bool:
        """Whether this belongs to what was done before with the same control.

        From press to release is one, and two presses of one browser are two; all else is told
        apart by pauses.

        Args:
            source: The control of what was done before.
            last: When its last event happened, in seconds.
            press: The last press that it had, if any.
        """
        if self.source != source:
            return False
        if self.press is not None and press is not None and self.press.client == press.client:
            return self.press == press
        return self.time - last <= PAUSE_SECONDS

    def apply(self, state: State) -> State:
        """Return the next state, with the gesture that led to its pose.

        Raises:
            ExplorerError: the change is not possible, or leads to what cannot be drawn.
        """
        after = self.action.apply(state)
        check_drawable(after)
        return replace(after, gesture=self._gesture(state, after))

    def _gesture(self, before: State, after: State) -> Gesture | None:
        is_jump = isinstance(self.action, Open | Reset | SetMode)
        if is_jump or after.design.variables != before.design.variables:
            # The legs did not go from one to the other.
            return None
        gesture = before.gesture
        if gesture is not None and self.goes_on(gesture.source, gesture.last, gesture.press):
            last = max(gesture.last, self.time)
            return replace(gesture, last=last, press=self.press or gesture.press)
        if after.pose == before.pose:
            return gesture
        return Gesture(before.pose, self.source, self.time, self.press)
