"""The problem of the optimiser with values that suit a design, and the tasks of its process."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import msgspec

from explorer.app.features.optimise.state import Optimisation, OptimisationRequest
from explorer.app.state.state import State
from explorer.errors import ExplorerError
from explorer.jobs.process import Channel
from explorer.measures.measure import longest_leg
from explorer.mechanism.design import Design
from explorer.numerics.number_text import Unit
from explorer.optimise import conflicts, defaults, problem as problems, solver
from explorer.optimise.outcome import Outcome
from explorer.workspace.slices.volume import workspace_volume

PAPER_REQUEST = OptimisationRequest(volume=defaults.PAPER_VOLUME, clearance=defaults.CLEARANCE)
"""The request of the paper's problem."""

# Default volume to match, as a multiple of the present volume.
MORE = 1.1


def complete_request(state: State) -> OptimisationRequest:
    """Return the request with values that suit the design where the user gives none."""
    return _complete(Optimisation.of(state).request, state.base)


@lru_cache(maxsize=16)
def _complete(request: OptimisationRequest, base: Design) -> OptimisationRequest:
    return replace(
        request,
        volume=request.volume or _default_volume(base, request.objective),
        reach=request.reach or longest_leg(base),
    )


def problem_of(state: State) -> problems.Problem:
    """Return the problem of the present design.

    Raises:
        ExplorerError: The values make no problem.
    """
    return _problem(state.design, complete_request(state))


def _problem(design: Design, request: OptimisationRequest) -> problems.Problem:
    problem = defaults.make_problem(
        design,
        request.objective,
        volume=request.volume if request.needs_volume else None,
        reach=None if request.needs_volume else request.reach,
        clearance=request.clearance or None,
        free=request.free,
    )
    variables = tuple(each for each in problem.variables if each.name in request.free)
    return msgspec.structs.replace(problem, variables=variables)


def find_refusals(state: State) -> tuple[conflicts.Conflict, ...]:
    """Return why no search can start: demands that the limits rule out, or no problem at all."""
    return _find_refusals(state.design, complete_request(state), state.unit)


@lru_cache(maxsize=16)
def _find_refusals(
    design: Design, request: OptimisationRequest, unit: Unit
) -> tuple[conflicts.Conflict, ...]:
    try:
        problem = _problem(design, request)
    except ExplorerError as error:
        limit = error.limit if isinstance(error, problems.DesignStartError) else ""
        return (conflicts.Conflict(limit, str(error)),)
    return conflicts.find_conflicts(problem, unit)


def liftable_limits(state: State) -> tuple[str, ...]:
    """Return the limits that prevent a search and can be lifted, one press for each."""
    if Optimisation.of(state).is_on:
        return ()
    limits = dict.fromkeys(refusal.limit for refusal in find_refusals(state))
    return tuple(
        limit for limit in limits if conflicts.without_limit(state.design, limit) is not None
    )


@lru_cache(maxsize=8)
def _default_volume(design: Design, objective: problems.ObjectiveName) -> float:
    """Return the next larger round volume to match; else that of a design, to six digits."""
    volume = workspace_volume(design).volume or design.reach**3
    if objective != "match-volume":
        return float(f"{volume:.6g}")
    power = 10.0 ** math.floor(math.log10(MORE * volume))
    return math.ceil(MORE * volume / power) * power


def optimise(problem: problems.Problem, starts: int, channel: Channel) -> Outcome:
    """Search for the best design from a number of starts, and send each iterate to the parent."""
    return solver.optimise_design(
        problem, starts=starts, watch=channel.send, stop=channel.is_cancelled
    )
