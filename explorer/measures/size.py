"""The size of a design and of its required box: longest leg, corners, margin."""

from __future__ import annotations

import numpy as np

from explorer.mechanism.design import LENGTHS, Design
from explorer.mechanism.margins import margins
from explorer.mechanism.pose import Triple
from explorer.numerics.arrays import FloatArray


def longest_leg(design: Design) -> float:
    """Return the largest of the maximum lengths of l1, d2, d4 and l4, in design units.

    It is the reach |a3| where all four are tied to it.
    """
    return max(design.length_range(name)[1] for name in LENGTHS)


def corners_of(box: tuple[Triple, Triple] | FloatArray) -> FloatArray:
    """Return the corners of a box (lows, highs), shape (8, 3)."""
    lows, highs = box
    return np.array([[(lows, highs)[c >> a & 1][a] for a in range(3)] for c in range(8)])


def box_margin(box: tuple[Triple, Triple], rotation: FloatArray) -> float:
    """Return the least |δ| at the corners of a box at an orientation, in design units.

    Margins are linear in the position: where none changes its sign within the box, this is the
    least over all of it.

    Args:
        box: Lows and highs of the positions.
        rotation: Platform to base, shape (3, 3).
    """
    return float(np.abs(margins(corners_of(box), rotation)).min())
