"""What was done, step by step, to be undone, redone and gone back to.

A step is what one hand does with one control from press to release, however long it rests, so
that a drag of many events is one step; without a press, as with keys, a pause ends it. What
happens by itself, such as a path that plays on, belongs to the step before it. Steps hold whole
states, which share all that did not change.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from explorer.app.session.gestures import ByHand
from explorer.app.state.presses import Press
from explorer.app.state.state import State
from explorer.errors import InputError

# Beyond so many the oldest are forgotten.
MOST_STEPS = 1000


@dataclass(frozen=True)
class Step:
    """What was done at one time.

    Attributes:
        number: From 0, the opening; it stays as long as the step does.
        words: What was done.
        state: After it.
        source: The control that it came from.
        last: When its last event happened, in seconds.
        press: The last press of a browser that it was part of; None if it is not known.
    """

    number: int
    words: str
    state: State
    source: object = None
    last: float = 0.0
    press: Press | None = None


@dataclass(frozen=True)
class History:
    """All steps, and which of them the page shows.

    Attributes:
        steps: In the order in which they were done; at least the opening.
        at: The index of the step at which the page is; those after it were undone.
        is_open: Whether the step at hand may go on; not once it was gone back to.
    """

    steps: tuple[Step, ...]
    at: int = 0
    is_open: bool = False

    @property
    def step(self) -> Step:
        """The step at which the page is."""
        return self.steps[self.at]

    @property
    def can_undo(self) -> bool:
        """Whether there is a step before."""
        return self.at > 0

    @property
    def can_redo(self) -> bool:
        """Whether a step was undone."""
        return self.at < len(self.steps) - 1

    def recorded(self, act: ByHand, state: State) -> History:
        """Return the history after an action that led to a state.

        A search for a better design is one step, made when it ends.
        """
        here, kept = self.step, document(state)
        if state.optimisation.is_on or kept == here.state:
            return self
        if act.action.continues:
            return replace(self, steps=_with(self.steps, self.at, replace(here, state=kept)))
        done = self.steps[: self.at + 1]
        if self._goes_on(act):
            if self.at > 0 and self.steps[self.at - 1].state == kept:
                # Back where it began.
                return History(done[:-1], self.at - 1)
            before = self.steps[max(self.at - 1, 0)].state
            called, press = act.action.describe(before, kept), act.press or here.press
            step = Step(here.number, called, kept, here.source, act.time, press)
            return History((*done[:-1], step), self.at, is_open=True)
        called = act.action.describe(here.state, kept)
        step = Step(here.number + 1, called, kept, act.source, act.time, act.press)
        done = (*done, step)[-MOST_STEPS:]
        return History(done, len(done) - 1, is_open=True)

    def moved(self, steps: int) -> History:
        """Return the history so many steps later, or earlier.

        Raises:
            InputError: there are not so many.
        """
        at = self.at + steps
        if not 0 <= at < len(self.steps):
            raise InputError("there is nothing to undo" if at < 0 else "there is nothing to redo")
        return replace(self, at=at, is_open=False)

    def moved_to(self, number: int) -> History:
        """Return the history at the step with a number.

        Raises:
            InputError: there is none, or no more.
        """
        first = self.steps[0].number
        if not first <= number <= self.steps[-1].number:
            raise InputError(
                f"step {number} is not kept; the steps are {first} to {self.steps[-1].number}"
            )
        return replace(self, at=number - first, is_open=False)

    def _goes_on(self, act: ByHand) -> bool:
        here = self.step
        return self.is_open and act.goes_on(here.source, here.last, here.press)


def begun(state: State) -> History:
    """Return the history of a state that has just been opened."""
    return History((Step(0, f"Open {state.design.name}", document(state)),))


def document(state: State) -> State:
    """Return what of a state is a step: all that does not go on by itself."""
    paths = state.paths
    journey = paths.journey
    if journey is not None and journey.is_playing:
        journey = replace(journey, is_playing=False)
    if paths.is_planning or journey is not paths.journey:
        paths = replace(paths, is_planning=False, journey=journey)
    return replace(state, gesture=None, paths=paths)


def restored(step: Step, present: State) -> State:
    """Return the state of a step, to follow on the present one.

    Raises:
        InputError: a design is being optimised.
    """
    if present.optimisation.is_on:
        raise InputError(
            "the design is being optimised: cancel that first, then undo what led to it"
        )
    state = step.state
    # Numbers of requests are given once.
    request = max(state.paths.request, present.paths.request)
    count = max(state.optimisation.count, present.optimisation.count)
    return replace(
        state,
        paths=replace(state.paths, request=request),
        optimisation=replace(state.optimisation, count=count),
    )


def _with(steps: tuple[Step, ...], at: int, step: Step) -> tuple[Step, ...]:
    return (*steps[:at], step, *steps[at + 1 :])
