"""The problem that a wish makes of a design, and what suits the design where nothing is said."""

from __future__ import annotations

import math
from functools import lru_cache

import msgspec
import numpy as np

from explorer.app.state.optimisation import PLACE, Wish
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

# The volume to match, unless one is given: more than the design has, by this factor or so.
MORE = 1.1


# Of the largest box about home in the workspace: the edge of the one that is suggested.
SHARE_OF_BOX = 0.5


# Positions on each edge of a box at which it is tried, and halvings of its edge.
TRIED, HALVINGS = 5, 30


def wished_volume(state: State) -> float:
    """Return the volume that is asked for."""
    return _wished_volume(state.base, state.optimisation.wish)


def wished_reach(state: State) -> float:
    """Return the largest reach that is asked for."""
    return _wished_reach(state.base, state.optimisation.wish)


def wished_box(state: State) -> Box:
    """Return the box that is required."""
    return _wished_box(state.base, state.optimisation.wish)


def _wished_volume(base: Design, wish: Wish) -> float:
    if wish.volume is not None:
        return wish.volume
    return _volume(base, same=wish.objective == "smallest-reach")


def _wished_reach(base: Design, wish: Wish) -> float:
    return longest_length(base) if wish.reach is None else wish.reach


def _wished_box(base: Design, wish: Wish) -> Box:
    return wish.box or box_within(base)


def problem_of(state: State) -> Problem:
    """Return the problem that is asked for, from the present design.

    Raises:
        ExplorerError: it cannot be asked like that.
    """
    return _problem(state.design, state.base, state.optimisation.wish)


def _problem(design: Design, base: Design, wish: Wish) -> Problem:
    free = [name for name in wish.free if name in (*VARIABLES, YAW)]
    if wish.needs_box and PLACE in wish.free:
        free += SHIFTS
    problem = make_problem(
        design,
        wish.objective,
        volume=_wished_volume(base, wish) if wish.needs_volume else None,
        reach=_wished_reach(base, wish) if wish.needs_reach else None,
        clearance=None if wish.clearance == 0.0 else wish.clearance,
        required_box=_wished_box(base, wish) if wish.needs_box else None,
        free=[name for name in free if name not in VARIABLES],
    )
    variables = tuple(each for each in problem.variables if each.name in free)
    return msgspec.structs.replace(problem, variables=variables)


def refuted(state: State) -> tuple[Refutation, ...]:
    """Return what the limits cannot give of what is asked for.

    Empty if a search may give it, and where no problem can be made of it: that is told when
    the search is asked for.
    """
    return _refuted(state.design, state.base, state.optimisation.wish)


@lru_cache(maxsize=8)
def _refuted(design: Design, base: Design, wish: Wish) -> tuple[Refutation, ...]:
    problem = _problem_or_none(design, base, wish)
    return () if problem is None else refutations(problem)


def box_on_offer(state: State) -> Box | None:
    """Return the box of the paper's optimum where that holds what is asked for."""
    return _box_on_offer(state.design, state.base, state.optimisation.wish)


@lru_cache(maxsize=8)
def _box_on_offer(design: Design, base: Design, wish: Wish) -> Box | None:
    problem = _problem_or_none(design, base, wish)
    return None if problem is None else paper_box(problem)


def _problem_or_none(design: Design, base: Design, wish: Wish) -> Problem | None:
    try:
        return _problem(design, base, wish)
    except ExplorerError:
        return None


@lru_cache(maxsize=8)
def box_within(design: Design) -> Box:
    """Return a box in the workspace about the home position, or where that is not, a small one."""
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
    # Round numbers read better, and the box need not be just this one.
    unit = 10.0 ** math.floor(math.log10(edge) - 1.0)
    digits = max(0, -round(math.log10(unit)))
    lows, highs = (
        [round(float(value), digits) for value in middle + side * 0.5 * edge]
        for side in (-1.0, 1.0)
    )
    return (lows[0], lows[1], lows[2]), (highs[0], highs[1], highs[2])


@lru_cache(maxsize=8)
def _volume(design: Design, *, same: bool) -> float:
    """Return the volume of a design to six digits, or the next round one that is larger."""
    volume = workspace_volume(design).volume or design.reach**3
    if same:
        return float(f"{volume:.6g}")
    power = 10.0 ** math.floor(math.log10(MORE * volume))
    return math.ceil(MORE * volume / power) * power
