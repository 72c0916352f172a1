"""How large a design and its required box are: reach, longest length, corners, counted nodes."""

from __future__ import annotations

import numpy as np

from explorer.errors import InputError
from explorer.mechanism.design import LENGTHS, Design
from explorer.mechanism.home import home_pose
from explorer.mechanism.margins import margins
from explorer.mechanism.pose import Triple
from explorer.numerics.arrays import FloatArray
from explorer.workspace.slices.volume import NodeCount, workspace_nodes


def longest_length(design: Design) -> float:
    """Return the largest of the four maximum lengths, in design units."""
    return max(design.length_range(name)[1] for name in LENGTHS)


def reach_of(design: Design) -> float:
    """Return |a3|, or the largest maximum length where that is larger, in design units."""
    return max(design.reach, longest_length(design))


def nodes_of(design: Design, step: float | None = None) -> NodeCount | None:
    """Return the paper's nodes at the home's orientation; None if the grid is too fine to count.

    Args:
        design: The manipulator.
        step: Step of the grid, in design units; that of the design if None.
    """
    try:
        return workspace_nodes(design, step=step)
    except InputError:
        return None


def corners_of(box: tuple[Triple, Triple]) -> FloatArray:
    """Return the corners of a box (lows, highs), shape (8, 3)."""
    lows, highs = box
    return np.array([[(lows, highs)[c >> a & 1][a] for a in range(3)] for c in range(8)])


def box_margin(design: Design, box: tuple[Triple, Triple]) -> float:
    """Return the least |δ| at the corners of a box at the home's orientation, in design units.

    Margins are linear in the position: where none changes its sign within the box, this is the
    least over all of it.
    """
    return float(np.abs(margins(corners_of(box), home_pose(design).rotation)).min())
