"""What hands do: an action with the control that it came from and its time.

The many events of one drag are one gesture, of which the pose where it began is kept.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from explorer.app.actions import Action, Open, Reset, SetMode
from explorer.app.drawable import check_drawable
from explorer.app.state import Gesture, State

# A hand that has not moved a control for longer, in seconds, begins a new gesture with it.
PAUSE_SECONDS = 1.0


@dataclass(frozen=True)
class ByHand:
    """An action with its origin, by which the many events of one drag become one gesture.

    Attributes:
        action: What is done.
        source: The control that it came from; one of its own for what is no drag.
        time: When it happened, in seconds.
    """

    action: Action
    source: object
    time: float

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
        if (
            gesture is not None
            and gesture.source == self.source
            and self.time - gesture.last <= PAUSE_SECONDS
        ):
            return replace(gesture, last=max(gesture.last, self.time))
        if after.pose == before.pose:
            return gesture
        return Gesture(before.pose, self.source, self.time)
