"""Sets of positions over which a measure is the worst: one position, a box, the workspace."""

from __future__ import annotations

from typing import Literal

import numpy as np

from explorer.errors import InputError, NoAnswerError
from explorer.measures.size import box_nodes
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose, Triple
from explorer.numerics.arrays import FloatArray
from explorer.workspace.node_measures import node_measures

PositionSet = Literal["pose", "box", "workspace"]
"""The position of a pose, the nodes of a box, or nodes of the workspace."""


def positions_over(
    design: Design, over: PositionSet, pose: Pose, box: tuple[Triple, Triple] | None
) -> FloatArray:
    """Return positions of b4 in the base frame, shape (n, 3), in design units.

    Those of the workspace are the centres of 20 × 20 × 20 cells about it that lie within the
    limits.

    Args:
        design: The manipulator.
        over: Kind of the set.
        pose: Pose with the one position, and with the orientation of the workspace.
        box: Lows and highs of the box; None for none.

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
    nodes = node_measures(design, pose.rotation).positions
    if not len(nodes):
        raise NoAnswerError("no position of a grid of 20 × 20 × 20 nodes is within the limits")
    return nodes
