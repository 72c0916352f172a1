"""The history: steps that can be undone, redone and gone back to.

A step is one gesture with one control, from press to release, so that a drag of many events is
one step; without a press, as with keys, a pause ends it. A change that happens by itself, such as
a path that plays on, belongs to the step before it, and so does what is shown and how: undo leaves
it as it is, but for the point whose position is shown and set. Steps hold whole states, which share
all that did not change.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from explorer.app.session.gestures import UserAction
from explorer.app.state.presses import Press
from explorer.app.state.state import State
from explorer.app.state.view import View
from explorer.errors import InputError

# Number of steps beyond which the oldest are dropped.
MOST_STEPS = 1000


@dataclass(frozen=True)
class Step:
    """One step of the history.

    Attributes:
        number: Number from 0, the opening; it stays as long as the step does.
        words: What was done.
        state: The state after it.
        source: The control that it came from.
        last: Time of its last event, in seconds.
        press: The last press of a browser that was part of it; None if none is known.
    """

    number: int
    words: str
    state: State
    source: object = None
    last: float = 0.0
    press: Press | None = None


@dataclass(frozen=True)
class History:
    """All steps, and the one that the page shows.

    Attributes:
        steps: The steps in order of time; at least the opening.
        at: Index of the step that the page shows; those after it were undone.
        is_open: Whether further events may extend the present step; not after undo or redo.
    """

    steps: tuple[Step, ...]
    at: int = 0
    is_open: bool = False

    @property
    def step(self) -> Step:
        """The step that the page shows."""
        return self.steps[self.at]

    def record(self, event: UserAction, state: State) -> History:
        """Return the history after an action that led to a state.

        A search for a better design is one step, made when it ends.
        """
        present, settled = self.step, settle(state)
        if state.optimisation.is_on or settled == present.state:
            return self
        earlier = self.steps[: self.at]
        shown = replace(settled, view=_with_point_of(present.state.view, settled.view))
        if event.action.continues or shown == present.state:
            return self.with_state(settled)
        if self.is_open and event.continues(present.source, present.last, present.press):
            if earlier and earlier[-1].state == settled:
                # The gesture ended where it began, so that its step is dropped.
                return History(earlier, self.at - 1)
            before = earlier[-1].state if earlier else present.state
            words, press = event.action.describe(before, settled), event.press or present.press
            step = Step(present.number, words, settled, present.source, event.time, press)
            return History((*earlier, step), self.at, is_open=True)
        words = event.action.describe(present.state, settled)
        step = Step(present.number + 1, words, settled, event.source, event.time, event.press)
        steps = (*earlier, present, step)[-MOST_STEPS:]
        return History(steps, len(steps) - 1, is_open=True)

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
    return History((Step(0, f"Open {state.design.name}", settle(state)),))


def settle(state: State) -> State:
    """Return the state that a step holds: without gesture, planning and playing."""
    paths = state.paths
    journey = paths.journey
    if journey is not None and journey.is_playing:
        journey = replace(journey, is_playing=False)
    if paths.is_planning or journey is not paths.journey:
        paths = replace(paths, planning=None, journey=journey)
    return replace(state, gesture=None, paths=paths)


def restore(history: History, present: State) -> tuple[State, History]:
    """Return the state of the step of a history, and the history with this state in its step.

    The view, but for its point, and the counts of requests are those of the present state.

    Raises:
        InputError: A design is being optimised.
    """
    if present.optimisation.is_on:
        raise InputError(
            "the design is being optimised: cancel that first, then undo what led to it"
        )
    step = history.step.state
    state = replace(step, view=_with_point_of(present.view, step.view))
    # No number of a request is used twice.
    request = max(state.paths.request, present.paths.request)
    count = max(state.optimisation.count, present.optimisation.count)
    restored = replace(
        state,
        paths=replace(state.paths, request=request),
        optimisation=replace(state.optimisation, count=count),
    )
    return restored, history.with_state(restored)


def _with_point_of(view: View, other: View) -> View:
    """Return a view with the point whose position is shown and set in another one."""
    return view if view.at == other.at else replace(view, at=other.at)
