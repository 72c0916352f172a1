"""The actions of an optimisation, from the wish to accepting what was found.

While a run goes on, the design belongs to it: the actions of `explorer.app.state.actions` that
would change it are refused. A run is long or it is short; in either case a slider touched
in passing must not throw it away, and cancelling takes one press of the same button.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar

import msgspec

from explorer.app.features.optimise.problem import problem_of, refuted
from explorer.app.state.action import Action, changes
from explorer.app.state.actions import check_free, moved
from explorer.app.state.optimisation import PLACE, Comparison, SearchResult, Wish
from explorer.app.state.state import Optimisation, Run, State
from explorer.errors import ExplorerError, NoAnswerError
from explorer.mechanism.design import Design
from explorer.mechanism.home import home_pose
from explorer.mechanism.pose import Pose
from explorer.optimise.outcome import Iterate
from explorer.optimise.problem import YAW
from explorer.optimise.refutation.refutation import PAPER_BOX, with_box, words_of

SUFFIX = "-optimised"
LONGEST_NAME = 100


@dataclass(frozen=True)
class SetWish(Action):
    """Change what is asked for."""

    wish: Wish

    def apply(self, state: State) -> State:
        """Return the next state.

        Raises:
            InputError: a number that nothing can be asked with, see `Wish.check`.
        """
        wish = self.wish
        wish.check()
        if wish.objective == "largest-margin" and not {YAW, PLACE} & {*wish.free}:
            # Nothing else has an influence on margins over a box.
            wish = replace(wish, free=(*wish.free, YAW, PLACE))
        return replace(state, optimisation=replace(state.optimisation, wish=wish, refusal=None))

    def describe(self, before: State, after: State) -> str:
        """Return what the step did."""
        return changes("Wanted", before.optimisation.wish, after.optimisation.wish)


@dataclass(frozen=True)
class StartRun(Action):
    """Begin to look for the best design."""

    def apply(self, state: State) -> State:
        """Return the next state; with the reason if it cannot begin.

        Raises:
            NoAnswerError: the limits cannot give what is asked for.
        """
        found = state.optimisation
        if found.is_on:
            return state
        try:
            problem = problem_of(state)
        except ExplorerError as error:
            return replace(state, optimisation=replace(found, refusal=str(error)))
        impossible = refuted(state)
        if impossible:
            raise NoAnswerError(words_of(impossible))
        last = found.run
        # What was found and not accepted is no design of the user's yet.
        own = last.own if last is not None and last.is_undecided else state
        run = Run(
            number=found.count + 1,
            problem=problem,
            starts=found.wish.starts,
            own=replace(own, optimisation=Optimisation()),
        )
        workspace = replace(state.view.workspace, solid=True)
        return replace(
            state,
            optimisation=Optimisation(found.wish, run, run.number),
            # The workspace is what it is all about.
            view=replace(state.view, workspace=workspace),
        )


@dataclass(frozen=True)
class LiftBox(Action):
    """Take the box out of the design's limits; its home pose stays where it is."""

    template: ClassVar[str] = "Lift the box"

    def apply(self, state: State) -> State:
        """Return the next state.

        Raises:
            InputError: the design is being optimised.
        """
        check_free(state)
        return replace(state, design=with_box(state.design, None))


@dataclass(frozen=True)
class TakePaperBox(Action):
    """Bound the design by the box of the paper's optimum; its home pose stays where it is."""

    template: ClassVar[str] = "Take the paper's box"

    def apply(self, state: State) -> State:
        """Return the next state.

        Raises:
            InputError: the design is being optimised.
        """
        check_free(state)
        return replace(state, design=with_box(state.design, PAPER_BOX))


@dataclass(frozen=True)
class CancelRun(Action):
    """Ask the run to end."""

    def apply(self, state: State) -> State:
        """Return the next state."""
        return _with_run(state, lambda run: replace(run, phase="cancelling"))


@dataclass(frozen=True)
class Advance(Action):
    """Show iterates of a run, the last of which is drawn."""

    continues: ClassVar[bool] = True

    number: int
    iterates: tuple[Iterate, ...]

    def apply(self, state: State) -> State:
        """Return the next state."""
        run = state.optimisation.run
        if run is None or run.number != self.number or not self.iterates:
            return state
        after = _with_run(state, lambda run: replace(run, iterates=run.iterates + self.iterates))
        return _showing(after, self.iterates[-1].design)


@dataclass(frozen=True)
class EndRun(Action):
    """End a run: what it found is shown, or if that is nothing, the user's own design."""

    template: ClassVar[str] = "Optimise: {design}"

    number: int
    verdict: SearchResult
    iterates: tuple[Iterate, ...] = ()

    def apply(self, state: State) -> State:
        """Return the next state."""
        state = Advance(self.number, self.iterates).apply(state)
        run = state.optimisation.run
        if run is None or run.number != self.number:
            return state
        after = _with_run(state, lambda run: replace(run, phase="ended", verdict=self.verdict))
        if self.verdict.best is None:
            return _back(after, run.own)
        return _showing(after, _named(self.verdict.best.design))


@dataclass(frozen=True)
class Compare(Action):
    """Put the measures of own and found design side by side."""

    continues: ClassVar[bool] = True

    number: int
    comparison: Comparison

    def apply(self, state: State) -> State:
        """Return the next state."""
        run = state.optimisation.run
        if run is None or run.number != self.number:
            return state
        changed = replace(run, comparison=self.comparison)
        return replace(state, optimisation=replace(state.optimisation, run=changed))


@dataclass(frozen=True)
class Accept(Action):
    """Make what was found the design of the user."""

    template: ClassVar[str] = "Accept {design}"

    def apply(self, state: State) -> State:
        """Return the next state."""
        run = state.optimisation.run
        if run is None or not run.is_undecided:
            return state
        accepted = replace(run, accepted=True)
        return replace(state, optimisation=replace(state.optimisation, run=accepted))


@dataclass(frozen=True)
class Revert(Action):
    """Return to the user's own design in its pose, exactly."""

    template: ClassVar[str] = "Revert to {design}"

    def apply(self, state: State) -> State:
        """Return the next state."""
        found = state.optimisation
        if found.run is None or not found.run.is_undecided:
            return state
        forgotten = replace(state, optimisation=replace(found, run=None))
        return _back(forgotten, found.run.own)


def _with_run(state: State, change: Callable[[Run], Run]) -> State:
    found = state.optimisation
    if found.run is None or not found.is_on:
        return state
    return replace(state, optimisation=replace(found, run=change(found.run)))


def _back(state: State, own: State) -> State:
    """Return the user's own state, with what is looked at as it is now."""
    return replace(
        own,
        view=state.view,
        hold=state.hold,
        optimisation=state.optimisation,
        compared=state.compared,
        studies=state.studies,
    )


def _showing(state: State, design: Design) -> State:
    """Return the state with a design of a run, in the orientation that its workspace has."""
    pose = Pose(state.pose.position, home_pose(design).quaternion)
    return moved(replace(state, design=design), pose)


def _named(design: Design) -> Design:
    """Return a design by a name of its own: it is not the one that it came from."""
    if design.name.endswith(SUFFIX):
        return design
    name = design.name[: LONGEST_NAME - len(SUFFIX)] + SUFFIX
    return msgspec.structs.replace(design, name=name)
