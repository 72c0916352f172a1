"""The manual's table of our optima beside the paper's, computed again.

All have the orientation of the paper's optimum, its box, and lengths up to the reach.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import msgspec

from explorer.measures.case import Case
from explorer.measures.catalogue import measures_in
from explorer.measures.measurements import Measurements, measure_design
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS
from explorer.optimise.defaults import make_problem
from explorer.optimise.problem import Box, Problem, Variable
from explorer.optimise.solver import optimise_design
from explorer.workspace.slices.volume import workspace_volume

PAPER_VOLUME = 8000.0
"""Volume that the paper demands, V′, in cubed design units."""

CLEARANCE = 0.2
"""Clearance demanded where interference is on, in design units; the legs have no radii."""

BOX: Box = ((8.0, 3.0, 7.0), (12.0, 7.0, 11.0))
"""Box about the home position, over which margins are compared; it lies in all workspaces but the
initial one's."""

STEP = 2.0
"""Step of the paper's nodes, in design units."""

STARTS = 14


@dataclass(frozen=True)
class Finding:
    """A row of the table: a design and its search.

    Attributes:
        name: Name of the row.
        iterations: Number of iterations; None for the initial design.
        objective: F = |1 − V/V′|, with V as its source measures it; None without a volume to match.
        seconds: Duration of the searches from all starts; None for the paper's designs.
        measured: Measures of the optimiser, and the step of the nodes.
    """

    name: str
    iterations: int | None
    objective: float | None
    seconds: float | None
    measured: Measurements


def paper_start() -> Design:
    """Return the paper's initial design with the box of its optimum."""
    initial, optimal = PRESETS["paper-initial"], PRESETS["paper-optimal"]
    return msgspec.structs.replace(initial, limits=optimal.limits)


def paper_problem(clearance: float | None = CLEARANCE) -> Problem:
    """Return the paper's problem: from its initial design to a volume of 8000."""
    return make_problem(paper_start(), "match-volume", volume=PAPER_VOLUME, clearance=clearance)


def reach_problem(clearance: float | None = None) -> Problem:
    """Return the smallest reach for the exact volume of the paper's optimum.

    |b1y|, |a3y| and |b3 − b2| are at least 1 and every coordinate of b within ±10.
    """
    optimal = PRESETS["paper-optimal"]
    bounds = [Variable(name, -10.0, 10.0) for name in ("b1x", "b1y", "b2", "b3")]
    bounds += [Variable("a3x", -40.0, 40.0), Variable("a3y", 1.0, 40.0)]
    return make_problem(
        optimal,
        "smallest-reach",
        volume=workspace_volume(optimal).volume,
        clearance=clearance,
        clearance_margin=paper_problem().demands.clearance_margin,
        least=1.0,
        bounds=bounds,
    )


def findings(tell: Callable[[str], None]) -> Iterator[Finding]:
    """Yield the rows of the table.

    Args:
        tell: Called with the name of each search before it starts.
    """
    margin = paper_problem().demands.clearance_margin

    def measure(design: Design) -> Measurements:
        case = Case(design, demanded_margin=margin, box=BOX, node_step=STEP)
        return measure_design(case, (*measures_in("optimise"), "reach", "node_step"))

    optimal = measure(PRESETS["paper-optimal"])
    node_objective = abs(1.0 - (optimal["node_volume"] or 0.0) / PAPER_VOLUME)
    yield Finding("the paper's initial design", None, None, None, measure(paper_start()))
    yield Finding("the paper's optimum, by nodes", 220, node_objective, None, optimal)
    for name, problem, starts in (
        ("volume 8000, interference off", paper_problem(None), 1),
        ("volume 8000, interference on", paper_problem(), 1),
        ("smallest reach, interference off", reach_problem(), STARTS),
        ("smallest reach, interference on", reach_problem(CLEARANCE), STARTS),
    ):
        tell(name)
        outcome = optimise_design(problem, starts=starts)
        is_match = problem.objective == "match-volume"
        yield Finding(
            name,
            outcome.iterations,
            outcome.best.objective if is_match else None,
            outcome.seconds,
            measure(outcome.design),
        )
