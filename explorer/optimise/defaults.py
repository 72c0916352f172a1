"""Problems with sensible bounds and margins where none are given, the paper's among them.

The paper's designs have, by our reading, the orientation of its optimum, the optimum's box, and
lengths up to the reach.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import msgspec

from explorer.errors import InputError
from explorer.measures.measure import MARGIN_OF_CLEARANCE, longest_leg
from explorer.mechanism.design import VARIABLES, Design
from explorer.mechanism.design_file import PRESETS
from explorer.numerics.checks import MOST
from explorer.numerics.number_text import format_apart
from explorer.optimise import problem

PAPER_VOLUME = 8000.0
"""Volume that the paper demands, V′, in cubed design units."""

CLEARANCE = 0.2
"""Clearance demanded where interference is on, in design units; the legs have no radii."""

# Default bounds of a3 and of the reach, as multiples of the start's largest variable or reach;
# those of other lengths are the variable itself.
A3_WITHIN = 3.0
# Least distance from a degenerate design by default, as a share of that variable.
LEAST = 0.05
# Default change of the yaw, and least angle between the two lines, in degrees.
YAW_WITHIN, LINES_APART = 45.0, 5.0


def make_problem(
    start: Design,
    objective: problem.ObjectiveName,
    *,
    volume: float | None = None,
    reach: float | None = None,
    clearance: float | None = None,
    clearance_margin: float | None = None,
    least: float | None = None,
    free: Iterable[str] = (),
    bounds: Iterable[problem.Variable] = (),
) -> problem.Problem:
    """Return a problem with sensible bounds and margins where none are given.

    The start, the objective and the demands are those of `Problem` and `Demands`. A demand of None
    is none, but for the volume of the smallest reach and the reach of the largest volume, which are
    the start's own; for `clearance_margin`, a 20th of the start's reach; and for `least`, a 20th of
    the start's largest variable, or less where the start itself is half as far from degenerate.

    Besides the six design variables those of `OPTIONAL` may change that are free, or have bounds;
    a variable without bounds here has the default ones.

    Raises:
        InputError: A variable that is bounded twice, or see `Problem`.
    """
    given: dict[str, problem.Variable] = {}
    for variable in bounds:
        first = given.setdefault(variable.name, variable)
        if first is not variable:
            ends = format_apart((first.low, first.high, variable.low, variable.high))
            one, other = (" to ".join(pair) for pair in (ends[:2], ends[2:]))
            raise InputError(
                f"{variable.name} is bounded twice, from {one} and from {other}: give it one range"
            )
    names = [*VARIABLES, *free, *(name for name in given if name not in VARIABLES)]
    variables = [given.get(name) or default_variable(start, name) for name in dict.fromkeys(names)]
    size = max(map(abs, start.variables))
    if volume is None and objective == "smallest-reach":
        from explorer.workspace.slices.volume import workspace_volume

        volume = workspace_volume(start).volume
        if volume <= 0.0:
            raise InputError("the start has an empty workspace: give the volume to reach")
    if reach is None and objective == "largest-volume":
        reach = longest_leg(start)
    if least is None:
        distances = problem.distances_of(start).values()
        least = min(LEAST * size, 0.5 * min(map(abs, distances)))
    if clearance_margin is None:
        clearance_margin = MARGIN_OF_CLEARANCE * start.reach
    return problem.Problem(
        start=start,
        objective=objective,
        variables=tuple(variables),
        demands=problem.Demands(
            volume=volume,
            reach=reach,
            clearance=clearance,
            clearance_margin=clearance_margin,
            least=least,
        ),
    )


def default_variable(start: Design, name: str) -> problem.Variable:
    """Return a variable with bounds that leave room around a start.

    Raises:
        InputError: No such variable.
    """
    size = max(map(abs, start.variables))
    value = problem.start_value(start, name)
    if name in VARIABLES:
        within = min(size * (A3_WITHIN if name in ("a3x", "a3y") else 1.0), MOST)
        return problem.Variable(name, -within, within)
    if name == problem.REACH:
        low = max(value / A3_WITHIN, problem.longest_minimum(start))
        return problem.Variable(name, low, min(A3_WITHIN * value, MOST))
    # The lines are parallel at multiples of 180°; stay between two of them if the start does.
    below = 180.0 * math.floor(value / 180.0)
    low = max(value - YAW_WITHIN, min(value, below + LINES_APART))
    high = min(value + YAW_WITHIN, max(value, below + 180.0 - LINES_APART))
    return problem.Variable(name, low, high)


def paper_start() -> Design:
    """Return the paper's initial design with the box of its optimum."""
    initial, optimal = PRESETS["paper-initial"], PRESETS["paper-optimal"]
    return msgspec.structs.replace(initial, limits=optimal.limits)


def paper_problem(clearance: float | None = CLEARANCE) -> problem.Problem:
    """Return the paper's problem: from its initial design to a volume of 8000."""
    return make_problem(paper_start(), "match-volume", volume=PAPER_VOLUME, clearance=clearance)


def reach_problem(clearance: float | None = None) -> problem.Problem:
    """Return the smallest reach for the exact volume of the paper's optimum.

    |b1y|, |a3y| and |b3 − b2| are at least 1 and every coordinate of b within ±10.
    """
    bounds = [problem.Variable(name, -10.0, 10.0) for name in ("b1x", "b1y", "b2", "b3")]
    bounds += [problem.Variable("a3x", -40.0, 40.0), problem.Variable("a3y", 1.0, 40.0)]
    return make_problem(
        PRESETS["paper-optimal"],
        "smallest-reach",
        clearance=clearance,
        clearance_margin=paper_problem().demands.clearance_margin,
        least=1.0,
        bounds=bounds,
    )
