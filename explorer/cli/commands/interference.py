"""`explorer interference`: the clearances of the legs, in a pose or over a move."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import numpy as np

from explorer.cli.blocks import lines
from explorer.cli.options import (
    DesignOptions,
    EndOptions,
    JsonOptions,
    PoseOptions,
    RadiiOptions,
    make_pose,
)
from explorer.cli.output import (
    attributes,
    finite,
    heading,
    indent,
    limits_json,
    limits_lines,
    pose_table,
    radii_line,
    tool_json,
)
from explorer.cli.values import OPTIONAL, hint, numbers, whole_number
from explorer.errors import InputError
from explorer.legs.clearance import PAIRS
from explorer.measures.blocks.clearances import move_clearances, pose_clearances
from explorer.measures.snapshot import Snapshot, evaluate
from explorer.mechanism.configuration import tool_position
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose, Triple

if TYPE_CHECKING:
    from explorer.legs.moves import MoveClearance


MOST_STEPS = 100_000


@dataclass(frozen=True, kw_only=True)
class Interference(JsonOptions, RadiiOptions, EndOptions, PoseOptions, DesignOptions):
    """Measure the clearances of the legs, in a pose or over a move.

    Legs are capsules about their axes; the clearance of two legs is the distance of the axes minus
    both radii, and below zero they collide. A straight move is tested twice: exactly, and by the
    paper's test of swept tetrahedra, which ignores radii and depends on the number of steps.
    """

    to: Annotated[Triple | None, numbers("--to", "x y z"), OPTIONAL] = None
    """Move b4, or the tool, straight to this position, in design units."""

    steps: Annotated[
        int | None,
        whole_number("--steps", 1, MOST_STEPS),
        hint("default: none longer than the node step"),
    ] = None
    """Number of steps of the move in the paper's test."""

    def run(self) -> None:
        """Write the clearances of the pose or of the move."""
        design = self.with_radii(self.read_design())
        start, tool = self.pose(design), self.tool(design)
        here = evaluate(design, start)
        target = (self.to, *self.end)
        if target == (None,) * 5:
            if self.steps is not None:
                raise InputError(
                    "--steps divides a move; say where it goes with --to, --to-quaternion, "
                    "--to-yaw-pitch-roll, --to-tilt-torsion or --to-folds"
                )
            self.write(lambda: pose_json(here, tool), lambda: pose_lines(here, tool))
            return
        from explorer.legs.moves import move_clearance

        end = make_pose("--to-", start, *target, tool)
        steps = _steps_of(design, start, end, tool) if self.steps is None else self.steps
        move = move_clearance(design, start, end, steps=steps, tool=tool)
        there = evaluate(design, end)
        self.write(lambda: move_json(move, here, there), lambda: move_lines(move, here, there))


def _steps_of(design: Design, start: Pose, end: Pose, tool: Triple | None) -> int:
    """Return the number of steps in which no leg's end moves farther than a node step."""
    from explorer.workspace.slices.volume import node_step_of

    step = node_step_of(design)
    turn = math.acos(
        min(1.0, max(-1.0, 0.5 * (float(np.trace(end.rotation @ start.rotation.T)) - 1.0)))
    )
    point = tool or (0.0, 0.0, 0.0)
    arm = max(math.dist(end, point) for end in design.platform_points.tolist())
    way = math.dist(tool_position(start, point), tool_position(end, point))
    count = math.ceil((way + turn * arm) / step * (1.0 - 1e-9))
    if count > MOST_STEPS:
        raise InputError(
            f"in steps of {step:g}, the node step, this move takes {count:.3g}; at most "
            f"{MOST_STEPS} are tested: give their number with --steps"
        )
    return max(1, count)


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
        yield from (name, *indent(pose_table(design, pose, move.tool)))
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
