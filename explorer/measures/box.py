"""Positions in a box or a workspace at which errors are computed, and the margins over a box.

Errors are not linear in the position, so corners alone do not bound them: they are computed at the
nodes of a grid that has the corners among its nodes.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from explorer.errors import InputError, NoAnswerError
from explorer.mechanism.design import Design
from explorer.mechanism.margins import SINGULAR, margins
from explorer.mechanism.pose import Pose, Triple
from explorer.numerics.arrays import FloatArray, lengths_of
from explorer.workspace.least_clearance import node_measures
from explorer.workspace.workspace import Workspace

BOX_NODES = 9
"""Number of nodes on each axis of the grid over a box, its faces included."""

PositionSet = Literal["pose", "box", "workspace"]
"""The position of a pose, the nodes of a box, or nodes of the workspace."""


def corners_of(box: tuple[Triple, Triple] | FloatArray) -> FloatArray:
    """Return the corners of a box (lows, highs), shape (8, 3)."""
    lows, highs = box
    return np.array([[(lows, highs)[c >> a & 1][a] for a in range(3)] for c in range(8)])


def box_nodes(box: tuple[Triple, Triple]) -> FloatArray:
    """Return the nodes of a grid over a box (lows, highs), its corners included, shape (n, 3).

    An axis has `BOX_NODES` of them, or one if its low is its high.
    """
    axes = [
        np.linspace(low, high, BOX_NODES if high > low else 1)
        for low, high in zip(*box, strict=True)
    ]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def positions_over(
    design: Design, over: PositionSet, pose: Pose, box: tuple[Triple, Triple] | None
) -> FloatArray:
    """Return positions of b4 in the base frame, shape (n, 3), in design units.

    By their kind they are the position of the pose, the nodes of a box (lows, highs), or the
    centres, within the limits, of 20 × 20 × 20 cells about the workspace at its orientation.

    Raises:
        InputError: Positions over a box are meant, and there is none.
        NoAnswerError: No node is within the limits.
    """
    if over == "pose":
        return np.array([pose.position])
    if over == "box":
        if box is None:
            raise InputError("positions over a box need a box, and the design has none")
        return box_nodes(box)
    nodes = node_measures(Workspace(design, pose.rotation)).positions
    if not len(nodes):
        raise NoAnswerError("no position of a grid of 20 × 20 × 20 nodes is within the limits")
    return nodes


def box_margins(box: tuple[Triple, Triple], rotation: FloatArray) -> FloatArray:
    """Return the least |δ1|, |δ2| and |δ3| over a box, shape (3,), in design units.

    Margins are linear in the position, so that the corners decide: of one sign, they have the
    least value; of both, there is a zero between them. What is zero but for rounding is 0.
    """
    corners = corners_of(box)
    at = margins(corners, rotation)
    least = np.maximum(at.min(axis=0), -at.max(axis=0))
    return np.where(least > SINGULAR * lengths_of(corners).max(), least, 0.0)
