"""The worker's tasks: the share of orientations, tilts over the workspace, ranges of tilts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from explorer.errors import ExplorerError
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose, Triple
from explorer.mechanism.tilt_torsion import rotation_from_tilt_torsion
from explorer.numerics.arrays import FloatArray
from explorer.workspace.extremes import extent_of
from explorer.workspace.orientations.sets import cone_of_directions
from explorer.workspace.orientations.share import OrientationShare, orientation_share
from explorer.workspace.orientations.tilts import greatest_tilts
from explorer.workspace.solids.solid import Solid
from explorer.workspace.solids.solids import dexterous_solid, reachable_solid, workspace_solid

NODES = 20
"""Number of nodes on each axis of the extent, at which tilts are computed."""

ORIENTATIONS = 33
"""Number of orientations that stand for a range of tilts."""


@dataclass(frozen=True)
class ShareRequest:
    """A request for the share of all orientations that a position can have."""

    design: Design
    position: Triple


@dataclass(frozen=True)
class ShareDrawing:
    """The share of all orientations that a position can have."""

    request: ShareRequest
    share: OrientationShare


def share_at(request: ShareRequest) -> ShareDrawing:
    """Return the share of all orientations that a position can have."""
    return ShareDrawing(request, orientation_share(request.design, request.position))


@dataclass(frozen=True)
class TiltsRequest:
    """A request for the greatest tilts over the workspace of one torsion, in degrees."""

    design: Design
    torsion: float


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


def tilts_at_nodes(request: TiltsRequest) -> TiltsDrawing:
    """Return the greatest tilts at nodes over the workspace of tilt zero."""
    design = request.design
    rotation = rotation_from_tilt_torsion((0.0, 0.0, request.torsion))
    solid = workspace_solid(design, rotation)
    if solid.is_empty:
        return TiltsDrawing(request, np.zeros((0, 3)), np.zeros(0), 0.0)
    lows, highs = extent_of(design, rotation, solid)
    # Nodes in the middle of cells: on the surface of the workspace no tilt is left.
    shares = (np.arange(NODES) + 0.5) / NODES
    axes = [low + shares * (high - low) for low, high in zip(lows, highs, strict=True)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    tilts = greatest_tilts(design, nodes, request.torsion)
    known = np.isfinite(tilts)
    step = float((highs - lows).max()) / NODES
    return TiltsDrawing(request, nodes[known], tilts[known], step)


@dataclass(frozen=True)
class RangeRequest:
    """A request for the workspaces over a range of tilts from the orientation of home.

    Attributes:
        design: The manipulator.
        home: Its home pose.
        tilt: Largest tilt, in degrees.
    """

    design: Design
    home: Pose
    tilt: float


@dataclass(frozen=True)
class RangeDrawing:
    """The workspaces over a range of tilts.

    Attributes:
        request: The request.
        reachable: Positions that have one of the orientations at least.
        dexterous: Positions that have all of them.
        problem: Why there are none; "" if there are.
    """

    request: RangeRequest
    reachable: Solid | None
    dexterous: Solid | None
    problem: str = ""


def range_solids(request: RangeRequest) -> RangeDrawing:
    """Return the reachable and the dexterous workspace over a range of tilts."""
    try:
        rotations = cone_of_directions(request.home.rotation, request.tilt, ORIENTATIONS)
        return RangeDrawing(
            request,
            reachable_solid(request.design, rotations),
            dexterous_solid(request.design, rotations),
        )
    except ExplorerError as error:
        return RangeDrawing(request, None, None, str(error))
