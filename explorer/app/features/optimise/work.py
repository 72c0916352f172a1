"""The problem of the optimiser with values that suit a design, and the tasks of its process."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import msgspec
import numpy as np

from explorer.app.features.optimise.state import PLACE, Optimisation, OptimisationRequest
from explorer.app.state.state import State
from explorer.errors import ExplorerError
from explorer.jobs.process import Channel
from explorer.measures.measure import longest_leg
from explorer.mechanism.design import Design
from explorer.numerics import checks
from explorer.numerics.number_text import Unit
from explorer.optimise import conflicts, defaults, problem as problems, solver
from explorer.optimise.outcome import Outcome
from explorer.workspace.slices.volume import workspace_volume
from explorer.workspace.workspace import Workspace

PAPER_REQUEST = OptimisationRequest(volume=defaults.PAPER_VOLUME, clearance=defaults.CLEARANCE)
"""The request of the paper's problem."""

# Default volume to match, as a multiple of the present volume.
MORE = 1.1
# Edge of the default box, as a share of that of the largest box about home in the workspace.
SHARE_OF_BOX = 0.5
# Number of positions checked on each edge of a box, and of halvings of the edge.
TRIED, HALVINGS = 5, 30


def complete_request(state: State) -> OptimisationRequest:
    """Return the request with values that suit the design where the user gives none."""
    return _complete(Optimisation.of(state).request, state.base)


@lru_cache(maxsize=16)
def _complete(request: OptimisationRequest, base: Design) -> OptimisationRequest:
    return replace(
        request,
        volume=request.volume or _default_volume(base, request.objective),
        reach=request.reach or longest_leg(base),
        box=request.box or default_box(base),
    )


def requested_box(state: State) -> problems.Box:
    """Return the required box."""
    return Optimisation.of(state).request.box or default_box(state.base)


def problem_of(state: State) -> problems.Problem:
    """Return the problem of the present design.

    Raises:
        ExplorerError: The values make no problem.
    """
    return _problem(state.design, complete_request(state))


def _problem(design: Design, request: OptimisationRequest) -> problems.Problem:
    free = [name for name in request.free if name != PLACE]
    if request.needs_box and PLACE in request.free:
        free += problems.SHIFTS
    problem = defaults.make_problem(
        design,
        request.objective,
        volume=request.volume if request.needs_volume else None,
        reach=request.reach if request.needs_reach else None,
        required_box=request.box if request.needs_box else None,
        held=request.held,
        **request.demanded,
        free=free,
    )
    variables = tuple(variable for variable in problem.variables if variable.name in free)
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


def is_paper_box_on_offer(state: State) -> bool:
    """Return whether the box of the paper's optimum may do in place of one that is too small."""
    if conflicts.BOX_LIMIT not in liftable_limits(state):
        return False
    boxed = problems.with_box(state.design, conflicts.PAPER_BOX)
    left = _find_refusals(boxed, complete_request(state), state.unit)
    return boxed != state.design and all(each.limit != conflicts.BOX_LIMIT for each in left)


def default_box(design: Design) -> problems.Box:
    """Return the box that a search has required of a design, or one within its workspace."""
    return design.required_box or box_within(design)


@lru_cache(maxsize=8)
def box_within(design: Design) -> problems.Box:
    """Return a box in the workspace about the home position; a small one if home is outside."""
    home = design.home_pose
    workspace, middle = Workspace(design), np.array(home.position)
    grid = np.indices((TRIED,) * 3).reshape(3, -1).T / (TRIED - 1.0) - 0.5
    low, high = 0.0, 2.0 * design.reach
    for _ in range(HALVINGS):
        half = 0.5 * (low + high)
        is_within = workspace.contains(middle + half * grid).all()
        low, high = (half, high) if is_within else (low, half)
    edge = SHARE_OF_BOX * low or 0.1 * design.reach
    # Round numbers read better, and the box need not be exact.
    digits = max(0, 1 - math.floor(math.log10(edge)))
    ends = np.round([middle - 0.5 * edge, middle + 0.5 * edge], digits)
    return checks.box("the required box", ends)


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
