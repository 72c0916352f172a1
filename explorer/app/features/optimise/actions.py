"""The actions of an optimisation, from its problem to accepting the result.

During a run all actions that would change the design are refused by
`State.check_free`, so that a slider touched by accident does not end the run.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import msgspec

from explorer.app.features.optimise.state import Optimisation, SearchResult, SearchRun
from explorer.app.features.optimise.work import PAPER_REQUEST, find_refusals, problem_of
from explorer.app.state.actions import Set, action, open_design
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


@action("Start run")
def start_run(state: State) -> State:
    """Start the search for the best design; its workspace is shown.

    Raises:
        NoAnswerError: The limits rule out the demands.
    """
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
    shown = with_value(state, "view.workspace.solid", True)
    return with_value(shown, "optimisation", Optimisation(optimisation.request, run, run.number))


@action("The paper's problem")
def take_paper_problem(state: State) -> State:
    """Open the paper's initial design with the box of its optimum, and request its volume.

    The action is refused while the design is being optimised.
    """
    start = defaults.paper_start()
    # The paper's legs are lines.
    design = with_machine(start, state.design, state.view)
    after = open_design(design.with_limits(leg_radii=start.limits.leg_radii)).apply(state)
    return with_value(after, "optimisation.request", PAPER_REQUEST)


def lift_words(limit: str) -> str:
    """Return the label of the action that lifts a limit, such as "Lift the box"."""
    if limit == MAXIMA:
        return "Tie all maximum lengths to the reach"
    name, _, end = limit.partition(" ")
    if end == "maximum":
        return f"Tie the maximum of {name} to the reach"
    return f"Lift the {LIMIT_NAMES.get(name, name)}"


def _lift_words(_: State, limit: str) -> str:
    return lift_words(limit)


@action(_lift_words)
def lift_limit(state: State, limit: str) -> State:
    """Take a limit out of the design, or tie maximum lengths to the reach; see `without_limit`.

    Raises:
        InputError: A run goes on, or the design has no such limit.
    """
    state.check_free()
    design = conflicts.without_limit(state.design, limit)
    if design is None:
        raise InputError(f"the design has no limit named {limit!r} to lift")
    return replace(state, design=design)


@action("Cancel run")
def cancel_run(state: State) -> State:
    """Cancel the run."""
    is_on = Optimisation.of(state).is_on
    return with_value(state, "optimisation.run.phase", "cancelling") if is_on else state


@action("", continues=True)
def add_iterates(state: State, number: int, iterates: tuple[Iterate, ...]) -> State:
    """Add iterates to the run with a number, and draw the last one."""
    run = _running(state, number)
    if run is None or not iterates:
        return state
    after = with_value(state, "optimisation.run.iterates", run.iterates + iterates)
    return _with_design(after, iterates[-1].design)


@action("Optimise: {design}")
def end_run(
    state: State, number: int, verdict: SearchResult, iterates: tuple[Iterate, ...] = ()
) -> State:
    """End a run and show its result, or without one the user's own design."""
    state = add_iterates(number, iterates).apply(state)
    run = _running(state, number)
    if run is None:
        return state
    after = with_value(state, "optimisation.run", replace(run, phase="ended", verdict=verdict))
    if verdict.best is None:
        return restore_own(after, run.own)
    return _with_design(after, _rename(verdict.best.design))


@action("", continues=True)
def compare(state: State, number: int, comparison: tuple[Measurements, Measurements]) -> State:
    """Add the comparison of the user's own design and that of the run with a number."""
    run = Optimisation.of(state).run
    if run is None or run.number != number:
        return state
    return with_value(state, "optimisation.run.comparison", comparison)


@action("Accept {design}")
def accept(state: State) -> State:
    """Make the result the design of the user."""
    is_undecided = Optimisation.of(state).undecided is not None
    return with_value(state, "optimisation.run.accepted", True) if is_undecided else state


@action("Revert to {design}")
def revert(state: State) -> State:
    """Return to the user's own design in its pose, exactly."""
    run = Optimisation.of(state).undecided
    return (
        state if run is None else restore_own(with_value(state, "optimisation.run", None), run.own)
    )


def _running(state: State, number: int) -> SearchRun | None:
    """Return the run with a number; None if it is not there, or has ended."""
    run = Optimisation.of(state).run
    return run if run is not None and run.number == number and run.phase != "ended" else None


def restore_own(state: State, own: State) -> State:
    """Return the user's own state, that before a run, with the present view."""
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
