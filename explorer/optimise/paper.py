"""The paper's problem of optimisation, by our reading, and the smallest reach for its volume.

All designs have the orientation of the paper's optimum, its box, and lengths up to the reach.
"""

from __future__ import annotations

import msgspec

from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS
from explorer.optimise.defaults import make_problem
from explorer.optimise.problem import Problem, Variable
from explorer.workspace.slices.volume import workspace_volume

PAPER_VOLUME = 8000.0
"""Volume that the paper demands, V′, in cubed design units."""

CLEARANCE = 0.2
"""Clearance demanded where interference is on, in design units; the legs have no radii."""


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
