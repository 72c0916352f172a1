"""The history: steps that can be undone, redone and gone back to.

A step is one gesture with one control, from press to release, so that a drag of many events is
one step and one move, from the pose where it began; without a press, as with keys, a pause ends it.
No event leads to a length that cannot be drawn. A change that happens by itself, such as
a path that plays on, belongs to the step before it, and so does what is shown and how: undo leaves
it as it is, but for the point whose position is shown and set. Steps hold whole states, which share
all that did not change.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from explorer.app.state.actions import Action
from explorer.app.state.state import Gesture, State
from explorer.errors import InputError
from explorer.mechanism.design import JOINTS, VARIABLES
from explorer.page.state.presses import Press

# Number of steps beyond which the oldest are dropped.
MOST_STEPS = 1000
# Seconds without an event of a control after which the next one begins a new gesture, where no
# press is known.
PAUSE_SECONDS = 1.0
# Largest length over the reach of the design as it was opened: browsers draw in single precision.
LARGEST_SHARE = 1e6


@dataclass(frozen=True)
class UserAction:
    """An action with its origin, which makes the events of one drag one gesture.

    Attributes:
        source: The control that it came from; a new object for an event that is part of no drag.
        time: Time of the event, in seconds.
        press: The press during which it happened; None for keys, and where none is known.
        who: Id of the client that did it; None for none in particular.
    """

    action: Action
    source: object
    time: float
    press: Press | None = None
    who: int | None = None

    def continues(self, earlier: Gesture | HistoryStep) -> bool:
        """Whether this continues an earlier gesture with the same control."""
        press = earlier.press
        if self.source != earlier.source:
            return False
        if self.press is not None and press is not None and self.press.client == press.client:
            return self.press == press
        return self.time - earlier.last <= PAUSE_SECONDS

    def apply(self, state: State) -> State:
        """Return the next state, with the gesture that led to its pose.

        Raises:
            ExplorerError: The change is not possible, or its result cannot be drawn.
        """
        after = self.action.apply(state)
        check_drawable(after)
        return replace(after, gesture=self._gesture(state, after))

    def _gesture(self, before: State, after: State) -> Gesture | None:
        if self.action.is_jump or after.design.variables != before.design.variables:
            # The legs did not move from one pose to the other.
            return None
        gesture = before.gesture
        if gesture is not None and self.continues(gesture):
            last = max(gesture.last, self.time)
            return replace(gesture, last=last, press=self.press or gesture.press)
        if after.pose == before.pose:
            return gesture
        return Gesture(before.pose, self.source, self.time, self.press)


@dataclass(frozen=True)
class HistoryStep:
    """One step of the history.

    Attributes:
        number: Number from 0, the opening; it stays as long as the step does.
        words: What was done.
        state: The state after it.
        source: The control that it came from.
        last: Time of its last event, in seconds.
        press: The last press of a browser that was part of it; None if none is known.
        who: Id of the client that did it; None for none in particular, or in an earlier session.
    """

    number: int
    words: str
    state: State
    source: object = None
    last: float = 0.0
    press: Press | None = None
    who: int | None = None


@dataclass(frozen=True)
class History:
    """All steps, and the one that the page shows.

    Attributes:
        steps: The steps in order of time; at least the opening.
        at: Index of the step that the page shows; those after it were undone.
        is_open: Whether further events may extend the present step; not after undo or redo.
    """

    steps: tuple[HistoryStep, ...]
    at: int = 0
    is_open: bool = False

    @property
    def step(self) -> HistoryStep:
        """The step that the page shows."""
        return self.steps[self.at]

    def record(self, event: UserAction, state: State) -> History:
        """Return the history after an action that led to a state.

        Long work on the design, such as a search, is one step, made when it ends.
        """
        present, after = self.step, state.for_step()
        if state.busy or after == present.state:
            return self
        earlier = self.steps[: self.at]
        shown = after.with_view_of(present.state)
        words = event.action.describe(after)
        repeats = self.is_open and event.action.repeats and words == present.words
        if event.action.continues or shown == present.state or repeats:
            return self.with_state(after)
        if self.is_open and event.continues(present):
            if earlier and earlier[-1].state == after:
                # The gesture ended where it began, so that its step is dropped.
                return History(earlier, self.at - 1)
            press = event.press or present.press
            step = replace(present, words=words, state=after, last=event.time, press=press)
            return History((*earlier, step), self.at, is_open=True)
        number, source = present.number + 1, event.source
        step = HistoryStep(number, words, after, source, event.time, event.press, event.who)
        steps = (*earlier, present, step)[-MOST_STEPS:]
        return History(steps, len(steps) - 1, is_open=True)

    def restore(self, present: State) -> History:
        """Return the history with the state of its step restored in place of the present one.

        Raises:
            InputError: The design cannot be changed now.
        """
        return self.with_state(self.step.state.restore_over(present))

    def with_state(self, state: State) -> History:
        """Return the history with another state in the step that the page shows."""
        step = replace(self.step, state=state)
        return replace(self, steps=(*self.steps[: self.at], step, *self.steps[self.at + 1 :]))

    def move(self, steps: int) -> History:
        """Return the history moved by a number of steps; a negative number undoes.

        Raises:
            InputError: There are not that many steps.
        """
        at = self.at + steps
        if not 0 <= at < len(self.steps):
            raise InputError("there is nothing to undo" if at < 0 else "there is nothing to redo")
        return replace(self, at=at, is_open=False)

    def move_to(self, number: int) -> History:
        """Return the history at the step with a number.

        Raises:
            InputError: There is no such step, or it was dropped.
        """
        first = self.steps[0].number
        if not first <= number <= self.steps[-1].number:
            raise InputError(
                f"step {number} is not kept; the steps are {first} to {self.steps[-1].number}"
            )
        return replace(self, at=number - first, is_open=False)


def start_history(state: State) -> History:
    """Return the history of a design that has just been opened."""
    return History((HistoryStep(0, f"Open {state.design.name}", state.for_step()),))


def check_drawable(state: State) -> None:
    """Check that every length of a state can be drawn at the scale that it was opened in.

    Raises:
        InputError: A design variable, a coordinate or a joint is too long.
    """
    reach = state.base.reach
    for names, values in (
        (VARIABLES, state.design.variables),
        ("xyz", state.pose.position),
        (JOINTS, state.joints),
    ):
        for name, value in zip(names, values, strict=True):
            # Also where it is no number.
            if not abs(value) <= LARGEST_SHARE * reach:
                most = state.unit.text(LARGEST_SHARE * reach)
                raise InputError(
                    f"{name} = {state.unit.text(value)} is too far to be drawn; "
                    f"{most}, a million times the reach, is the most"
                )
