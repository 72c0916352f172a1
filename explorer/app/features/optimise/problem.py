"""The problem of the optimiser for a design, with values that suit the design by default."""

from __future__ import annotations

import math
from functools import lru_cache

import msgspec
import numpy as np

from explorer.app.state.optimisation import PLACE, OptimisationRequest
from explorer.app.state.state import State
from explorer.errors import ExplorerError
from explorer.measures.case import Case
from explorer.measures.size import longest_leg
from explorer.mechanism.design import LENGTHS, VARIABLES, Design, Swing
from explorer.optimise.defaults import make_problem
from explorer.optimise.demands import Box
from explorer.optimise.problem import (
    SHIFTS,
    YAW,
    Problem,
)
from explorer.optimise.refutation.lifting import BOX_LIMIT, MAXIMA, SWING_LIMIT, lift
from explorer.optimise.refutation.refutation import Refutation, paper_box, refutations
from explorer.workspace.limits.constraints import Never, constraints
from explorer.workspace.slices.volume import workspace_volume

NO_LOAD, NO_ERRORS, RIGID = "no load", "no errors", "rigid"
"""What a design may lack for the demands; they stand for the limit of a refusal."""

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
    """Return the longest leg allowed."""
    return _requested_reach(state.base, state.optimisation.request)


def requested_box(state: State) -> Box:
    """Return the required box."""
    return _requested_box(state.base, state.optimisation.request)


def _requested_volume(base: Design, request: OptimisationRequest) -> float:
    if request.volume is not None:
        return request.volume
    same = request.objective != "match-volume"
    return _default_volume(base, same=same)


def _requested_reach(base: Design, request: OptimisationRequest) -> float:
    return longest_leg(base) if request.reach is None else request.reach


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
        held=request.held,
        error=request.error or None,
        deflection=request.deflection or None,
        tilt=request.tilt or None,
        free=[name for name in free if name not in VARIABLES],
    )
    variables = tuple(variable for variable in problem.variables if variable.name in free)
    return msgspec.structs.replace(problem, variables=variables)


def refuted(state: State) -> tuple[Refutation, ...]:
    """Return why no search can start: demands that the limits rule out, or no problem at all."""
    return _refuted(state.design, state.base, state.optimisation.request)


@lru_cache(maxsize=16)
def _refuted(design: Design, base: Design, request: OptimisationRequest) -> tuple[Refutation, ...]:
    try:
        problem = _problem(design, base, request)
    except ExplorerError as error:
        return (Refutation(_limit_against_problem(design, request), str(error)),)
    return refutations(problem)


def _limit_against_problem(design: Design, request: OptimisationRequest) -> str:
    """Return the limit or lack because of which values make no problem, "" if it is none."""
    limits, case = design.limits, Case(design)
    needs_load = request.held or request.objective == "smallest-load"
    if needs_load and not (case.is_loaded and case.is_limited):
        return NO_LOAD
    if (request.error or request.objective == "smallest-error") and not case.has_errors:
        return NO_ERRORS
    bends = request.deflection > 0.0 or request.objective == "smallest-deflection"
    if bends and not case.is_loaded:
        return NO_LOAD
    if bends and not case.is_elastic:
        return RIGID
    if limits.swing != Swing():
        return SWING_LIMIT
    has_fixed = any(getattr(limits, name)[1] is not None for name in LENGTHS)
    return MAXIMA if request.objective == "smallest-reach" and has_fixed else ""


def liftable(state: State) -> tuple[str, ...]:
    """Return the limits that can be lifted of those that prevent a search or held the last one."""
    if state.optimisation.is_on:
        return ()
    refusals = refuted(state)
    found: list[str] = []
    for limit in dict.fromkeys([refusal.limit for refusal in refusals] + _holding(state)):
        lifted = lift(state.design, limit)
        if lifted is None:
            continue
        after = _refuted(lifted, state.base, state.optimisation.request)
        messages = {refusal.message for refusal in refusals if refusal.limit == limit}
        if all(left.limit != limit and left.message not in messages for left in after):
            found.append(limit)
    return tuple(found)


def _holding(state: State) -> list[str]:
    """Return the limit that kept the last search from all demands, if it is still in force."""
    run = state.optimisation.run
    if run is None or run.accepted or run.verdict is None or run.verdict.status != "infeasible":
        return []
    is_same = run.problem.start.limits == state.design.limits
    return [run.verdict.holding] if is_same else []


def box_on_offer(state: State) -> Box | None:
    """Return the box of the paper's optimum in place of one that is too small, if it may do."""
    if BOX_LIMIT not in liftable(state):
        return None
    box = _box_on_offer(state.design, state.base, state.optimisation.request)
    return None if box == state.design.limits.box else box


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
    home = design.home_pose
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
