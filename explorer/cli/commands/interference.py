"""`explorer interference`: clearances of poses and moves."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from explorer.cli import options, output, values
from explorer.errors import InputError
from explorer.legs import moves
from explorer.legs.clearance import PAIRS
from explorer.measures.blocks.clearances import move_clearances, pose_clearances
from explorer.measures.snapshot import Snapshot, evaluate
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose, Triple
from explorer.workspace.slices.volume import node_step_of

MOST_STEPS = 100_000


@dataclass(frozen=True, kw_only=True)
class InterferenceCommand(
    options.JsonOptions, options.RadiiOptions, options.EndOptions, options.PoseOptions
):
    """Measure the clearances of the legs, in a pose or over a move.

    Legs are capsules about their axes; the clearance of two legs is the distance of the axes minus
    both radii, and below zero they collide. A straight move is tested twice: exactly, and by the
    paper's test of swept tetrahedra, which ignores radii and depends on the number of steps.
    """

    to: Annotated[values.Position, values.OPTIONAL] = None
    """Move b4, or the tool, straight to this position, in design units."""

    steps: Annotated[
        int | None,
        values.whole_number(1, MOST_STEPS),
        values.hint("default: none longer than the node step"),
    ] = None
    """Number of steps of the move in the paper's test."""

    def run(self) -> None:
        """Write the clearances of the pose or of the move."""
        design = self.with_radii(self.read_design())
        start, tool = self.pose(design), self.tool(design)
        here, end = evaluate(design, start), self.end(start, self.to, tool)
        if end is not None:
            steps = self.steps or _steps_of(design, start, end, tool)
            move = moves.move_clearance(design, start, end, steps=steps, tool=tool)
            there = evaluate(design, end)
            self.write(lambda: _move_json(move, here, there), _move_lines(move, here, there))
        elif self.steps is not None:
            raise InputError(f"--steps divides a move; say where it goes {options.END_OPTIONS}")
        else:
            self.write(lambda: _pose_json(here, tool), _pose_lines(here, tool))


def _steps_of(design: Design, start: Pose, end: Pose, tool: Triple | None) -> int:
    """Return the number of steps in which no leg's end moves farther than a node step."""
    step, move = node_step_of(design), moves.StraightMoves.along((start, end), tool)
    arm = float(np.linalg.norm(design.platform_points - move.tool, axis=1).max())
    way = float(np.linalg.norm(move.step) + arm * np.linalg.norm(move.turn))
    count = math.ceil(way / step * (1.0 - 1e-9))
    if count > MOST_STEPS:
        raise InputError(
            f"in steps of {step:g}, the node step, this move takes {count:.3g}; at most "
            f"{MOST_STEPS} are tested: give their number with --steps"
        )
    return max(1, count)


def _pose_lines(snapshot: Snapshot, tool: Triple | None) -> Iterator[str]:
    design = snapshot.design
    yield from (output.heading(design), output.pose_table(design, snapshot.pose, tool))
    yield output.radii_line(design)
    yield from (*output.block_lines(pose_clearances(snapshot)), "")
    yield from output.limits_lines(snapshot, "the pose is ")


def _move_lines(move: moves.MoveClearance, start: Snapshot, end: Snapshot) -> Iterator[str]:
    design = start.design
    yield from (output.heading(design), *output.end_lines(design, move.start, move.end, move.tool))
    yield output.radii_line(design)
    yield from (*output.block_lines(move_clearances(move, design)), "")
    yield from output.limits_lines(start, "the start is ")
    yield from output.limits_lines(end, "the end is ")


def _pose_json(snapshot: Snapshot, tool: Triple | None) -> dict[str, object]:
    legs = snapshot.clearances
    return {
        "pairs": [
            {
                "legs": pair,
                "distance": legs.distance[index],
                "clearance": legs.clearance[index],
                "points": legs.points[index],
                "collides": legs.clearance[index] < 0.0,
            }
            for index, pair in enumerate(PAIRS)
        ],
        "closest": PAIRS[int(legs.closest)],
        "is_clear": (legs.clearance > 0.0).all(),
        "radii": snapshot.design.limits.leg_radii,
        **output.tool_json(snapshot.pose, tool),
        **output.limits_json(snapshot),
    }


def _move_json(move: moves.MoveClearance, start: Snapshot, end: Snapshot) -> dict[str, object]:
    def place(pose: Pose) -> dict[str, object]:
        return output.attributes(pose, "position quaternion") | output.tool_json(pose, move.tool)

    poses = [Pose.of(position, rotation) for position, rotation in zip(*move.poses, strict=True)]
    return {
        "pairs": [
            {
                "legs": pair,
                "clearance": move.clearance[index],
                "bound": move.bound[index],
                "share": move.share[index],
                **place(pose),
                "points": move.points[index],
                "overlaps": move.overlaps[index],
            }
            for index, (pair, pose) in enumerate(zip(PAIRS, poses, strict=True))
        ],
        "closest": PAIRS[move.closest],
        **output.attributes(move, "is_clear is_free steps tolerance"),
        "radii": start.design.limits.leg_radii,
        "within_limits": not (start.violations or end.violations),
        "start": place(start.pose) | output.limits_json(start),
        "end": place(end.pose) | output.limits_json(end),
    }
