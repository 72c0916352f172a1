"""The worker's tasks: orientations of a position, tilts over the workspace, ranges of tilts."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from explorer.app.features.workspace.tasks import LIVE_TOLERANCE
from explorer.app.session.feed import watch_of
from explorer.app.session.worker import Channel
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose, Triple
from explorer.mechanism.tilt_torsion import rotation_from_tilt_torsion
from explorer.mechanism.tool_point import tool_offset
from explorer.numerics.arrays import FloatArray
from explorer.workspace.extremes import extent_of
from explorer.workspace.orientations.sets import cone_of_directions
from explorer.workspace.orientations.share import OrientationShare, orientation_share
from explorer.workspace.orientations.tilts import greatest_tilts
from explorer.workspace.orientations.torsions import TiltByTorsion, tilt_by_torsion
from explorer.workspace.solids.solid import Solid
from explorer.workspace.solids.solids import inclusive_solid, total_solid

NODES = 20
"""Number of nodes on each axis of the extent, at which tilts are computed."""

# Number of parts of the nodes, between which progress is reported.
PARTS = 10

ORIENTATIONS = 33
"""Number of orientations that stand for a range of tilts."""

TURNED_ORIENTATIONS = 17
"""The same for each of three torsions, if the range has several."""


@dataclass(frozen=True)
class PositionRequest:
    """A request for the orientations that a position can have.

    Attributes:
        design: The manipulator.
        position: Position of b4 or of the tool point.
        tool: The tool point in the platform frame; None for b4.
    """

    design: Design
    position: Triple
    tool: Triple | None = None


@dataclass(frozen=True)
class PositionDrawing:
    """The orientations that a position can have.

    Attributes:
        request: The request.
        share: Share of all orientations.
        by_torsion: Greatest tilt in every azimuth at each torsion.
    """

    request: PositionRequest
    share: OrientationShare
    by_torsion: TiltByTorsion


def orientations_at(request: PositionRequest) -> PositionDrawing:
    """Return the orientations that a position can have."""
    design, position, tool = request.design, request.position, request.tool
    share = orientation_share(design, position, tool=tool)
    return PositionDrawing(request, share, tilt_by_torsion(design, position, tool=tool))


@dataclass(frozen=True)
class TiltsRequest:
    """A request for the greatest tilts over the workspace of one torsion.

    Attributes:
        design: The manipulator.
        torsion: Torsion, in degrees.
        tool: Tool point that has the positions, in the platform frame; None for b4.
    """

    design: Design
    torsion: float
    tool: Triple | None = None


@dataclass(frozen=True)
class TiltsDrawing:
    """The greatest tilts in every azimuth at the nodes of a grid.

    Attributes:
        request: The request.
        positions: Nodes at which tilt zero keeps all limits, shape (n, 3), in design units.
        tilts: Greatest tilts there, shape (n,), in degrees.
        step: Largest distance of neighbouring nodes, in design units.
    """

    request: TiltsRequest
    positions: FloatArray
    tilts: FloatArray
    step: float


def tilts_at_nodes(request: TiltsRequest, channel: Channel | None = None) -> TiltsDrawing:
    """Return the greatest tilts at nodes over the workspace of tilt zero.

    Args:
        request: The request.
        channel: Channel to the parent, which gets each `Stage` and may cancel; None for neither.
    """
    design, watch = request.design, watch_of(channel)
    rotation = rotation_from_tilt_torsion((0.0, 0.0, request.torsion))
    ends = extent_of(design, rotation)
    if ends is None:
        return TiltsDrawing(request, np.zeros((0, 3)), np.zeros(0), 0.0)
    lows, highs = np.array(ends) + tool_offset(rotation, request.tool)
    # Nodes in the middle of cells: on the surface of the workspace no tilt is left.
    shares = (np.arange(NODES) + 0.5) / NODES
    axes = [low + shares * (high - low) for low, high in zip(lows, highs, strict=True)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    parts: list[FloatArray] = []
    for index, part in enumerate(np.array_split(nodes, PARTS)):
        watch("greatest tilts", index / PARTS)
        parts.append(greatest_tilts(design, part, request.torsion, tool=request.tool))
    tilts = np.concatenate(parts)
    known = np.isfinite(tilts)
    step = float((highs - lows).max()) / NODES
    return TiltsDrawing(request, nodes[known], tilts[known], step)


@dataclass(frozen=True)
class RangeRequest:
    """A request for a workspace over a range of tilts from the orientation of home.

    Attributes:
        design: The manipulator.
        home: Its home pose.
        tilt: Largest tilt, in degrees.
        turn: Largest change of the torsion either way, in degrees.
        over: Whether positions have one of the orientations at least, or all of them.
        tool: Tool point that has the positions, in the platform frame; None for b4.
    """

    design: Design
    home: Pose
    tilt: float
    turn: float
    over: Literal["inclusive", "total"]
    tool: Triple | None = None


@dataclass(frozen=True)
class RangeDrawing:
    """A workspace over a range of tilts."""

    request: RangeRequest
    solid: Solid


def orientations_over(request: RangeRequest) -> FloatArray:
    """Return the orientations that stand for a range, shape (n, 3, 3)."""
    rotation, turn = request.home.rotation, math.radians(request.turn)
    if turn == 0.0:
        return cone_of_directions(rotation, request.tilt, ORIENTATIONS)
    tilted = cone_of_directions(rotation, request.tilt, TURNED_ORIENTATIONS)
    turns = Rotation.from_rotvec([[0.0, 0.0, angle] for angle in (-turn, 0.0, turn)]).as_matrix()
    return (tilted[:, None] @ turns).reshape(-1, 3, 3)


def range_solid(request: RangeRequest) -> RangeDrawing:
    """Return the workspace over a range of orientations."""
    design = request.design
    make = inclusive_solid if request.over == "inclusive" else total_solid
    tolerance = LIVE_TOLERANCE * design.reach
    solid = make(design, orientations_over(request), tolerance, request.tool)
    return RangeDrawing(request, solid)
