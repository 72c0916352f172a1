"""Actions on the orientation, and the worker's tasks on the tilts of positions."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from explorer.app.session.feed import Feed, FeedOf, watch_of
from explorer.app.state.actions import action
from explorer.app.state.frame import Frame
from explorer.app.state.moves import move_to, value_words
from explorer.app.state.state import State
from explorer.errors import InputError
from explorer.jobs.process import Channel
from explorer.mechanism.configuration import tool_offset
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Triple
from explorer.mechanism.tilt_torsion import (
    TiltTorsion,
    pose_of_tilt_torsion,
    rotation_from_tilt_torsion,
)
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_number
from explorer.workspace.accessible.nodes import make_cell_grid
from explorer.workspace.extremes import extent_of
from explorer.workspace.orientations.share import OrientationShare, orientation_share
from explorer.workspace.orientations.tilts import (
    TiltByTorsion,
    greatest_tilts,
    tilt_by_torsion,
    tilt_map,
)
from explorer.workspace.workspace import Workspace

ANGLES = ("azimuth", "tilt", "torsion")


@action(value_words(ANGLES))
def set_tilt_torsion(state: State, axis: int, value: float) -> State:
    """Set azimuth, tilt or torsion, 0 to 2, in degrees."""
    return _tilt_to(state, state.tilt_torsion._replace(**{ANGLES[axis]: value}))


def _tilt_words(after: State, azimuth: float, _: float) -> str:
    tilt = format_number(after.tilt_torsion.tilt, 4)
    return f"Tilt {tilt}° towards {format_number(azimuth, 4)}°"


@action(_tilt_words)
def go_to_tilt(state: State, azimuth: float, tilt: float) -> State:
    """Tilt the platform in an azimuth at its present torsion, as far as the limits allow it.

    Angles are in degrees. The next state has a remark if a limit ends the tilts before.

    Raises:
        InputError: Tilt zero breaks a limit itself, so that no tilt is reached from it.
    """
    torsion = state.tilt_torsion.torsion
    border = tilt_map(state.design, state.position, torsion, [azimuth], state.tool)
    (most,), (limit,) = border.tilts.tolist(), border.limits
    if math.isnan(most):
        raise InputError(f"no tilt is possible here: tilt zero is beyond the limit {limit}")
    if tilt <= most:
        return _tilt_to(state, TiltTorsion(azimuth, tilt, torsion))
    after = _tilt_to(state, TiltTorsion(azimuth, max(most - INSIDE, 0.0), torsion))
    towards = format_number(azimuth, 4)
    words = f"Tilts towards {towards}° end at {most:.1f}°, by {limit}: no farther."
    return replace(after, taken=(after.joints, words))


def _tilt_to(state: State, angles: TiltTorsion) -> State:
    """Return the state with azimuth, tilt and torsion in degrees, which it keeps as they are."""
    orientation = pose_of_tilt_torsion(state.pose.position, angles)
    pose = state.pose_at(state.position, orientation)
    return replace(move_to(state, pose), set_tilt_torsion=angles)


# Degrees that a tilt keeps from the limit that ends it, where the pose may be singular.
INSIDE = 0.1

# Number of nodes on each axis of the extent, at which tilts are computed.
NODES = 20
# Number of parts of the nodes, between which progress is reported.
PARTS = 10
# Digits of a torsion in degrees beyond which tilts are not computed again.
DIGITS = 3


@dataclass(frozen=True)
class PositionDrawing:
    """The share of orientations that a position can have, and the greatest tilts by torsion."""

    share: OrientationShare
    by_torsion: TiltByTorsion


def orientations_at(request: tuple[Design, Triple, Triple | None]) -> PositionDrawing:
    """Return the orientations that a position of b4, or of a tool point, can have."""
    design, position, tool = request
    share = orientation_share(design, position, tool=tool)
    return PositionDrawing(share, tilt_by_torsion(design, position, tool=tool))


@dataclass(frozen=True)
class TiltsDrawing:
    """The greatest tilts in every azimuth, in degrees, at nodes where tilt zero keeps all limits.

    The step is the largest distance of neighbouring nodes, in design units.
    """

    positions: FloatArray
    tilts: FloatArray
    step: float


def tilts_at_nodes(
    request: tuple[Design, float, Triple | None], channel: Channel | None = None
) -> TiltsDrawing:
    """Return the greatest tilts of a tool over the workspace of tilt zero at a torsion in degrees.

    The channel sends progress.
    """
    (design, torsion, tool), watch = request, watch_of(channel)
    rotation = rotation_from_tilt_torsion((0.0, 0.0, torsion))
    ends = extent_of(Workspace(design, rotation))
    if ends is None:
        return TiltsDrawing(np.zeros((0, 3)), np.zeros(0), 0.0)
    lows, highs = np.array(ends) + tool_offset(rotation, tool)
    # On the surface of the workspace no tilt is left.
    nodes = make_cell_grid(lows, highs, NODES).positions.reshape(-1, 3)
    parts: list[FloatArray] = []
    for index, part in enumerate(np.array_split(nodes, PARTS)):
        watch("greatest tilts", index / PARTS)
        parts.append(greatest_tilts(design, part, torsion, tool=tool))
    tilts = np.concatenate(parts)
    known = np.isfinite(tilts)
    step = float((highs - lows).max()) / NODES
    return TiltsDrawing(nodes[known], tilts[known], step)


def _tilts_of(frame: Frame) -> tuple[Design, float, Triple | None] | None:
    if not frame.state.view.tilts:
        return None
    torsion = round(frame.state.tilt_torsion.torsion, DIGITS)
    return frame.state.design, torsion, frame.state.tool


PositionFeed: TypeAlias = Feed[tuple[Design, Triple, Triple | None], PositionDrawing]
POSITION_FEED = FeedOf(
    orientations_at, lambda frame: (frame.state.design, frame.state.position, frame.state.tool)
)
TILTS_FEED = FeedOf(tilts_at_nodes, _tilts_of, has_stages=True)
