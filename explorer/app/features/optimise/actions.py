"""The actions of an optimisation, from its problem to accepting the result.

During a run all actions that would change the design are refused by
`State.check_free`, so that a slider touched by accident does not end the run.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import msgspec

from explorer.app.features.optimise.state import Optimisation, SearchResult, SearchRun
from explorer.app.features.optimise.work import PAPER_REQUEST, find_refusals, problem_of
from explorer.app.state.actions import Action, Open, Set
from explorer.app.state.geometry import with_machine
from explorer.app.state.moves import move_to
from explorer.app.state.parts import parts_kept_on_open, with_value
from explorer.app.state.state import State
from explorer.errors import InputError, NoAnswerError
from explorer.measures.catalogue import Measurements
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose
from explorer.numerics.checks import LONGEST_NAME
from explorer.optimise import conflicts, defaults
from explorer.optimise.outcome import Iterate
from explorer.optimise.problem import MAXIMA, SWING_LIMIT

SUFFIX = "-optimised"
LIMIT_NAMES = {SWING_LIMIT: "bounds of the swing"}


@dataclass(frozen=True)
class SetObjective(Set):
    """Change the objective, and reset the volume."""

    def apply(self, state: State) -> State:
        """Return the next state."""
        return super().apply(with_value(state, "optimisation.request.volume", None))


@dataclass(frozen=True)
class StartRun(Action):
    """Start the search for the best design."""

    def apply(self, state: State) -> State:
        """Return the next state; refuse if the limits rule out the demands."""
        optimisation = Optimisation.of(state)
        if optimisation.is_on:
            return state
        impossible = find_refusals(state)
        if impossible:
            raise NoAnswerError("; ".join(refusal.message for refusal in impossible))
        own = with_value(state, "optimisation", Optimisation(optimisation.request))
        if optimisation.undecided is not None:
            # A result that is not accepted is not yet a design of the user.
            own = optimisation.undecided.own
        run = SearchRun(
            number=optimisation.count + 1,
            problem=problem_of(state),
            starts=optimisation.request.starts,
            own=own,
        )
        # The run shows its workspace.
        shown = with_value(state, "view.workspace.solid", True)
        searching = Optimisation(optimisation.request, run, run.number)
        return with_value(shown, "optimisation", searching)


@dataclass(frozen=True)
class TakePaperProblem(Action):
    """Open the paper's initial design with the box of its optimum, and request its volume."""

    template: ClassVar[str] = "The paper's problem"

    def apply(self, state: State) -> State:
        """Return the next state; refuse while the design is being optimised."""
        start = defaults.paper_start()
        # The paper's legs are lines.
        design = with_machine(start, state.design, state.view)
        after = Open(design.with_limits(leg_radii=start.limits.leg_radii)).apply(state)
        return with_value(after, "optimisation.request", PAPER_REQUEST)


@dataclass(frozen=True)
class LiftLimit(Action):
    """Take a limit out of the design, or tie maximum lengths to the reach; see `without_limit`."""

    template: ClassVar[str] = "{action.title}"

    limit: str

    @property
    def title(self) -> str:
        """The label, such as "Lift the box"."""
        if self.limit == MAXIMA:
            return "Tie all maximum lengths to the reach"
        name, _, end = self.limit.partition(" ")
        if end == "maximum":
            return f"Tie the maximum of {name} to the reach"
        return f"Lift the {LIMIT_NAMES.get(name, name)}"

    def apply(self, state: State) -> State:
        """Return the next state; refuse during a run, or if the design has no such limit."""
        state.check_free()
        design = conflicts.without_limit(state.design, self.limit)
        if design is None:
            raise InputError(f"the design has no limit named {self.limit!r} to lift")
        return replace(state, design=design)


@dataclass(frozen=True)
class CancelRun(Action):
    """Cancel the run."""

    def apply(self, state: State) -> State:
        """Return the next state."""
        if not Optimisation.of(state).is_on:
            return state
        return with_value(state, "optimisation.run.phase", "cancelling")


@dataclass(frozen=True)
class AddIterates(Action):
    """Add iterates to a run, and draw the last one."""

    continues: ClassVar[bool] = True

    number: int
    iterates: tuple[Iterate, ...]

    def apply(self, state: State) -> State:
        """Return the next state."""
        run = _running(state, self.number)
        if run is None or not self.iterates:
            return state
        after = with_value(state, "optimisation.run.iterates", run.iterates + self.iterates)
        return _with_design(after, self.iterates[-1].design)


@dataclass(frozen=True)
class EndRun(Action):
    """End a run and show its result, or without one the user's own design."""

    template: ClassVar[str] = "Optimise: {design}"

    number: int
    verdict: SearchResult
    iterates: tuple[Iterate, ...] = ()

    def apply(self, state: State) -> State:
        """Return the next state."""
        state = AddIterates(self.number, self.iterates).apply(state)
        run = _running(state, self.number)
        if run is None:
            return state
        ended = replace(run, phase="ended", verdict=self.verdict)
        after = with_value(state, "optimisation.run", ended)
        if self.verdict.best is None:
            return _restore_own(after, run.own)
        return _with_design(after, _rename(self.verdict.best.design))


@dataclass(frozen=True)
class Compare(Action):
    """Add the comparison of the user's own design and the new one."""

    continues: ClassVar[bool] = True

    number: int
    comparison: tuple[Measurements, Measurements]

    def apply(self, state: State) -> State:
        """Return the next state."""
        run = Optimisation.of(state).run
        if run is None or run.number != self.number:
            return state
        return with_value(state, "optimisation.run.comparison", self.comparison)


@dataclass(frozen=True)
class Accept(Action):
    """Make the result the design of the user."""

    template: ClassVar[str] = "Accept {design}"

    def apply(self, state: State) -> State:
        """Return the next state."""
        is_undecided = Optimisation.of(state).undecided is not None
        return with_value(state, "optimisation.run.accepted", True) if is_undecided else state


@dataclass(frozen=True)
class Revert(Action):
    """Return to the user's own design in its pose, exactly."""

    template: ClassVar[str] = "Revert to {design}"

    def apply(self, state: State) -> State:
        """Return the next state."""
        run = Optimisation.of(state).undecided
        if run is None:
            return state
        return _restore_own(with_value(state, "optimisation.run", None), run.own)


def _running(state: State, number: int) -> SearchRun | None:
    """Return the run with a number; None if it is not there, or has ended."""
    run = Optimisation.of(state).run
    return run if run is not None and run.number == number and run.phase != "ended" else None


def _restore_own(state: State, own: State) -> State:
    """Return the user's own state with the present view."""
    present = state.in_unit_of(own.design)
    # A path belongs to the design that it was made for.
    parts = {**present.parts, "paths": own.parts["paths"]}
    return replace(own, **parts_kept_on_open(present) | {"parts": parts})


def _with_design(state: State, design: Design) -> State:
    """Return the state with a design of a run, in the orientation of its home pose."""
    pose = Pose(state.pose.position, design.home_pose.quaternion)
    return move_to(replace(state, design=design), pose)


def _rename(design: Design) -> Design:
    """Return a design with a name that differs from the user's own design."""
    name = design.name.removesuffix(SUFFIX)[: LONGEST_NAME - len(SUFFIX)]
    return msgspec.structs.replace(design, name=name + SUFFIX)
