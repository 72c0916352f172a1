"""The problem of the optimiser for a design, with values that suit the design by default."""

from __future__ import annotations

import math
from functools import lru_cache

import msgspec
import numpy as np

from explorer.app.state.optimisation import PLACE, OptimisationRequest
from explorer.app.state.state import State
from explorer.errors import ExplorerError
from explorer.measures.size import longest_length
from explorer.mechanism.design import VARIABLES, Design
from explorer.mechanism.home import home_pose
from explorer.optimise.defaults import make_problem
from explorer.optimise.problem import (
    SHIFTS,
    YAW,
    Box,
    Problem,
)
from explorer.optimise.refutation.refutation import Refutation, paper_box, refutations
from explorer.workspace.limits.constraints import Never, constraints
from explorer.workspace.slices.volume import workspace_volume

# Default volume to match, as a multiple of the present volume.
MORE = 1.1
# Edge of the default box, as a share of that of the largest box about home in the workspace.
SHARE_OF_BOX = 0.5
# Number of positions checked on each edge of a box, and of halvings of the edge.
TRIED, HALVINGS = 5, 30


def requested_volume(state: State) -> float:
    """Return the required volume."""
    return _requested_volume(state.base, state.optimisation.request)


def requested_reach(state: State) -> float:
    """Return the largest reach allowed."""
    return _requested_reach(state.base, state.optimisation.request)


def requested_box(state: State) -> Box:
    """Return the required box."""
    return _requested_box(state.base, state.optimisation.request)


def _requested_volume(base: Design, request: OptimisationRequest) -> float:
    if request.volume is not None:
        return request.volume
    return _default_volume(base, same=request.objective == "smallest-reach")


def _requested_reach(base: Design, request: OptimisationRequest) -> float:
    return longest_length(base) if request.reach is None else request.reach


def _requested_box(base: Design, request: OptimisationRequest) -> Box:
    return request.box or box_within(base)


def problem_of(state: State) -> Problem:
    """Return the problem of the present design.

    Raises:
        ExplorerError: the values make no problem.
    """
    return _problem(state.design, state.base, state.optimisation.request)


def _problem(design: Design, base: Design, request: OptimisationRequest) -> Problem:
    free = [name for name in request.free if name in (*VARIABLES, YAW)]
    if request.needs_box and PLACE in request.free:
        free += SHIFTS
    problem = make_problem(
        design,
        request.objective,
        volume=_requested_volume(base, request) if request.needs_volume else None,
        reach=_requested_reach(base, request) if request.needs_reach else None,
        clearance=None if request.clearance == 0.0 else request.clearance,
        required_box=_requested_box(base, request) if request.needs_box else None,
        free=[name for name in free if name not in VARIABLES],
    )
    variables = tuple(variable for variable in problem.variables if variable.name in free)
    return msgspec.structs.replace(problem, variables=variables)


def refuted(state: State) -> tuple[Refutation, ...]:
    """Return the demands that the limits rule out.

    Empty if a search may keep all, and if the values make no problem, which `StartRun` reports.
    """
    return _refuted(state.design, state.base, state.optimisation.request)


@lru_cache(maxsize=8)
def _refuted(design: Design, base: Design, request: OptimisationRequest) -> tuple[Refutation, ...]:
    problem = _problem_or_none(design, base, request)
    return () if problem is None else refutations(problem)


def box_on_offer(state: State) -> Box | None:
    """Return the box of the paper's optimum if it can hold what is required; else None."""
    return _box_on_offer(state.design, state.base, state.optimisation.request)


@lru_cache(maxsize=8)
def _box_on_offer(design: Design, base: Design, request: OptimisationRequest) -> Box | None:
    problem = _problem_or_none(design, base, request)
    return None if problem is None else paper_box(problem)


def _problem_or_none(design: Design, base: Design, request: OptimisationRequest) -> Problem | None:
    try:
        return _problem(design, base, request)
    except ExplorerError:
        return None


@lru_cache(maxsize=8)
def box_within(design: Design) -> Box:
    """Return a box in the workspace about the home position; a small one if home is outside."""
    home = home_pose(design)
    limits = constraints(design, home.rotation)
    middle = np.array(home.position)
    grid = np.indices((TRIED,) * 3).reshape(3, -1).T / (TRIED - 1.0) - 0.5

    def is_within(edge: float) -> bool:
        at = middle + edge * grid
        return all(
            not isinstance(limit, Never) and bool((limit.slack(at) >= 0.0).all())
            for limit in limits
        )

    low, high = 0.0, 2.0 * design.reach
    for _ in range(HALVINGS):
        half = 0.5 * (low + high)
        low, high = (half, high) if is_within(half) else (low, half)
    edge = SHARE_OF_BOX * low or 0.1 * design.reach
    # Round numbers read better, and the box need not be exact.
    unit = 10.0 ** math.floor(math.log10(edge) - 1.0)
    digits = max(0, -round(math.log10(unit)))
    lows, highs = (
        [round(float(value), digits) for value in middle + side * 0.5 * edge]
        for side in (-1.0, 1.0)
    )
    return (lows[0], lows[1], lows[2]), (highs[0], highs[1], highs[2])


@lru_cache(maxsize=8)
def _default_volume(design: Design, *, same: bool) -> float:
    """Return the volume of a design to six digits if `same`, else the next larger round one."""
    volume = workspace_volume(design).volume or design.reach**3
    if same:
        return float(f"{volume:.6g}")
    power = 10.0 ** math.floor(math.log10(MORE * volume))
    return math.ceil(MORE * volume / power) * power
