"""The clearances of the legs in a pose or over a move, for `explorer interference`."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from explorer.cli.blocks import lines
from explorer.cli.output import (
    attributes,
    finite,
    heading,
    indented,
    limits_json,
    limits_lines,
    pose_table,
    radii_line,
    tool_json,
)
from explorer.legs.clearance import PAIRS
from explorer.measures.blocks.clearances import move_clearances, pose_clearances
from explorer.measures.snapshot import Snapshot
from explorer.mechanism.pose import Pose, Triple

if TYPE_CHECKING:
    from explorer.legs.moves import MoveClearance


def pose_lines(snapshot: Snapshot, tool: Triple | None = None) -> Iterator[str]:
    """Yield the clearances in a pose as lines of text."""
    design = snapshot.design
    yield from (heading(design), pose_table(design, snapshot.pose, tool), radii_line(design))
    yield from (*lines(pose_clearances(snapshot)), "", *limits_lines(snapshot, "the pose is "))


def move_lines(move: MoveClearance, start: Snapshot, end: Snapshot) -> Iterator[str]:
    """Yield the clearances over a move as lines of text, from the snapshots of its ends."""
    design = start.design
    yield heading(design)
    for name, pose in (("from", move.start), ("to", move.end)):
        yield from (name, *indented(pose_table(design, pose, move.tool)))
    yield radii_line(design)
    yield from (*lines(move_clearances(move, design)), "")
    yield from limits_lines(start, "the start is ")
    yield from limits_lines(end, "the end is ")


def pose_json(snapshot: Snapshot, tool: Triple | None = None) -> dict[str, object]:
    """Return the clearances in a pose as plain values."""
    legs = snapshot.clearances
    return {
        "pairs": [
            {
                "legs": pair,
                "distance": finite(float(legs.distance[index])),
                "clearance": finite(float(legs.clearance[index])),
                "points": legs.points[index],
                "collides": legs.clearance[index] < 0.0,
            }
            for index, pair in enumerate(PAIRS)
        ],
        "closest": PAIRS[int(legs.closest)],
        "is_clear": (legs.clearance > 0.0).all(),
        "radii": snapshot.design.limits.leg_radii,
        **tool_json(snapshot.pose, tool),
        **limits_json(snapshot),
    }


def move_json(move: MoveClearance, start: Snapshot, end: Snapshot) -> dict[str, object]:
    """Return the clearances over a move as plain values, from the snapshots of its ends."""
    place = "position quaternion"
    poses = [Pose.of(position, rotation) for position, rotation in zip(*move.poses, strict=True)]
    return {
        "pairs": [
            {
                "legs": pair,
                "clearance": finite(float(move.clearance[index])),
                "bound": finite(float(move.bound[index])),
                "share": move.share[index],
                **attributes(pose, place),
                **tool_json(pose, move.tool),
                "points": move.points[index],
                "overlaps": move.overlaps[index],
            }
            for index, (pair, pose) in enumerate(zip(PAIRS, poses, strict=True))
        ],
        "closest": PAIRS[move.closest],
        **attributes(move, "is_clear is_free steps tolerance"),
        "radii": start.design.limits.leg_radii,
        "within_limits": not (start.violations or end.violations),
        "start": attributes(start.pose, place)
        | tool_json(start.pose, move.tool)
        | limits_json(start),
        "end": attributes(end.pose, place) | tool_json(end.pose, move.tool) | limits_json(end),
    }
