"""The size of a design, the positions over which its measures are the worst, and its clearance."""

from __future__ import annotations

import math
from typing import Literal

import msgspec
import numpy as np

from explorer.errors import InputError, NoAnswerError
from explorer.legs.clearance import PAIRS
from explorer.mechanism.design import LENGTHS, Design
from explorer.mechanism.margins import margins
from explorer.mechanism.pose import Pose, Triple
from explorer.mechanism.tilt_torsion import tilt_torsion_of
from explorer.numerics.arrays import FloatArray, lengths_of
from explorer.statics.forces import SINGULAR
from explorer.workspace.least_clearance import least_clearances
from explorer.workspace.node_measures import node_measures
from explorer.workspace.orientations.tilts import greatest_tilts
from explorer.workspace.slices.volume import workspace_volume

CERTAIN = 1e-3
"""Accuracy of the least clearance, as a share of the reach."""

MARGIN_OF_CLEARANCE = 0.05
"""Least |δ| of the positions at which clearances count by default, as a share of the reach."""


def clearance_margin_of(design: Design) -> float:
    """Return the least |δ| at which clearances count by default, in design units."""
    return MARGIN_OF_CLEARANCE * design.reach


def clearance_beyond(
    design: Design, margin: float, rotation: FloatArray | None = None
) -> tuple[float, tuple[int, int] | None]:
    """Return the least clearance where every |δ| is at least some length, and its two legs.

    The clearance is accurate to a thousandth of the reach. They are NaN and None where the
    constant-orientation workspace has no such position, or no volume: the positions left may
    then all lie on a surface.

    Args:
        design: The manipulator; nearer to a singularity its legs may have to meet.
        margin: The least |δ|, in design units.
        rotation: Platform to base, shape (3, 3); that of the home pose if None.
    """
    r = design.home_pose.rotation if rotation is None else rotation
    if workspace_volume(design, r, explain=False).volume <= 0.0:
        return math.nan, None
    own_margin = design.limits.margin or 0.0
    limits = msgspec.structs.replace(design.limits, margin=max(own_margin, margin))
    clearances = least_clearances(
        msgspec.structs.replace(design, limits=limits),
        r,
        CERTAIN * design.reach,
        only_least=True,
    ).clearance
    pair = int(clearances.argmin())
    if not np.isfinite(clearances[pair]):
        return math.nan, None
    return float(clearances[pair]), PAIRS[pair]


BOX_NODES = 9
"""Number of nodes on each axis of the grid over a required box, its faces included."""

PositionSet = Literal["pose", "box", "workspace"]
"""The position of a pose, the nodes of a box, or nodes of the workspace."""


def longest_leg(design: Design) -> float:
    """Return the largest of the maximum lengths of l1, d2, d4 and l4, in design units.

    It is the reach |a3| where all four are tied to it.
    """
    return max(design.length_range(name)[1] for name in LENGTHS)


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


def box_margins(box: tuple[Triple, Triple], rotation: FloatArray) -> FloatArray:
    """Return the least |δ1|, |δ2| and |δ3| over a box, shape (3,), in design units.

    Margins are linear in the position, so that the corners decide: of one sign, they have the
    least value; of both, there is a zero between them. What is zero but for rounding is 0.

    Args:
        box: Lows and highs of the positions.
        rotation: Platform to base, shape (3, 3).
    """
    corners = corners_of(box)
    at = margins(corners, rotation)
    least = np.maximum(at.min(axis=0), -at.max(axis=0))
    return np.where(least > SINGULAR * lengths_of(corners).max(), least, 0.0)


def home_tilt(design: Design, pose: Pose) -> float:
    """Return the greatest tilt in every azimuth at the position and torsion of a pose, in degrees.

    It is 0 if tilt zero violates a limit.
    """
    torsion = tilt_torsion_of(pose.rotation).torsion
    return float(np.nan_to_num(greatest_tilts(design, pose.position, torsion)))


def box_tilt(design: Design, box: tuple[Triple, Triple], pose: Pose) -> float:
    """Return the least of the greatest tilts in every azimuth over the nodes of a box, in degrees.

    The torsion is that of the pose. The value is 0 if tilt zero violates a limit at a node.

    Args:
        design: The manipulator.
        box: Lows and highs of the positions.
        pose: Pose whose torsion the tilts have.
    """
    tilts = greatest_tilts(design, box_nodes(box), tilt_torsion_of(pose.rotation).torsion)
    return float(np.nan_to_num(tilts).min())
