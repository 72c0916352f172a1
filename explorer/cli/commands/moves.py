"""`explorer interference` and `path`: clearances of poses and moves, and planned paths."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path as File
from typing import Annotated

import numpy as np

from explorer.cli import options, output, values
from explorer.errors import InputError
from explorer.export.tables import corners_csv, trajectory_csv
from explorer.files.writing import check_writable
from explorer.legs import moves
from explorer.legs.clearance import PAIRS
from explorer.measures.blocks.clearances import move_clearances, pose_clearances
from explorer.measures.snapshot import Snapshot, evaluate
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose, Triple
from explorer.paths import planning
from explorer.paths.crossings import path_margins
from explorer.paths.loads import PathLoads, path_loads
from explorer.paths.time_law import law_at_speed
from explorer.paths.trajectory import DEFAULT_SPEED, Trajectory, trajectory
from explorer.statics.reactions import LIMITED, PART_NAMES
from explorer.workspace.slices.volume import node_step_of

MOST_STEPS = 100_000


@dataclass(frozen=True, kw_only=True)
class Interference(
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
        if end is None:
            if self.steps is not None:
                raise InputError(f"--steps divides a move; say where it goes {options.END_OPTIONS}")
            self.write(lambda: _pose_json(here, tool), _pose_lines(here, tool))
            return
        steps = self.steps or _steps_of(design, start, end, tool)
        move = moves.move_clearance(design, start, end, steps=steps, tool=tool)
        there = evaluate(design, end)
        self.write(lambda: _move_json(move, here, there), _move_lines(move, here, there))


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
    yield from (output.heading(design), *_end_lines(design, move.start, move.end, move.tool))
    yield output.radii_line(design)
    yield from (*output.block_lines(move_clearances(move, design)), "")
    yield from output.limits_lines(start, "the start is ")
    yield from output.limits_lines(end, "the end is ")


def _end_lines(design: Design, start: Pose, end: Pose, tool: Triple | None) -> Iterator[str]:
    for name, pose in (("from", start), ("to", end)):
        yield from (name, *output.indent(output.pose_table(design, pose, tool)))


def _pose_json(snapshot: Snapshot, tool: Triple | None) -> dict[str, object]:
    legs = snapshot.clearances
    return {
        "pairs": [
            {
                "legs": pair,
                "distance": output.finite(float(legs.distance[index])),
                "clearance": output.finite(float(legs.clearance[index])),
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
                "clearance": output.finite(float(move.clearance[index])),
                "bound": output.finite(float(move.bound[index])),
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


@dataclass(frozen=True, kw_only=True)
class Path(options.JsonOptions, options.RadiiOptions, options.PathEndOptions):
    """Plan a path between two poses within limits, margins and clearances.

    Both poses must have the same assembly mode. A pose is a position x y z, or a position and yaw
    pitch roll in degrees, or a position and a quaternion w x y z. With `--at tool` positions are
    those of the tool, which then goes straight in each move. Needs the extra `planning`.
    """

    load: Annotated[values.Load, values.OPTIONAL] = None
    """Force in N and moment in N × unit at the tool, along the axes of the base, besides the
    payload: the path holds them within the limits of actuators, struts and guide."""

    seconds: Annotated[float, values.POSITIVE] = 2.0
    """Longest time to search for a path, in seconds."""

    speed: Annotated[values.Positive, values.hint("default: a tenth of the reach")] = None
    """Speed of the fastest actuator, in design units per second."""

    acceleration: Annotated[values.Positive, values.hint("default: at the speed at once")] = None
    """Acceleration with which the fastest actuator reaches this speed, and stops at every corner,
    in design units per s²."""

    samples: Annotated[int, values.whole_number(2, 100_000)] = 201
    """Number of rows of the trajectory."""

    out: Annotated[File | None, values.hint("optional", "FILE.csv")] = None
    """File for the trajectory as CSV: time, joints and pose, and the tool's position with `--at
    tool`."""

    corners: Annotated[File | None, values.hint("optional", "FILE.csv")] = None
    """File for the corners of the path as CSV, for `explorer drives --path`."""

    def run(self) -> None:
        """Write the path."""
        design = self.with_radii(self.read_design())
        tool = self.tool(design)
        start, goal = self.ends(design)
        if goal is None:
            raise InputError(f"say where the path ends {options.END_OPTIONS}")
        if self.load is not None:
            options.check_has_limits(design)
        for file in filter(None, (self.out, self.corners)):
            check_writable(file)
        try:
            path = planning.plan_path(
                design, start, goal, seconds=self.seconds, tool=tool, load=self.load
            )
        except planning.NoPathError as error:
            if self.json:
                output.write_json({"found": False, "reason": error.reason, "poses": []})
            raise
        law = None
        if self.acceleration is not None:
            speed = self.speed or DEFAULT_SPEED * design.reach
            straight = moves.StraightMoves.along(path.poses, tool)
            law = law_at_speed(design, straight, speed, self.acceleration)
        timed = trajectory(
            design, path.poses, speed=self.speed, samples=self.samples, tool=tool, law=law
        )
        loads = None
        if self.load is not None:
            loads = path_loads(design, path.poses, self.load, tool=tool)
        texts = {self.corners: corners_csv(path.poses, tool), self.out: trajectory_csv(timed)}
        files = {file: text.encode() for file, text in texts.items() if file is not None}
        written, errors = options.write_files(files)
        out = self.out if self.out in written else None
        self.write(
            lambda: _path_json(path, timed, loads, out),
            _path_lines(design, path, timed, loads, out),
            errors,
        )


def _path_json(
    path: planning.PlannedPath, timed: Trajectory, loads: PathLoads | None, out: File | None
) -> dict[str, object]:
    names = "time joints position quaternion" + (" tool_position" if path.tool else "")
    largest = loads and {
        "largest_share": loads.share,
        "largest_share_bound": loads.bound,
        "largest_share_part": None if loads.part is None else LIMITED[loads.part],
        "largest_share_at": loads.place,
    }
    return {
        "found": True,
        "reason": None,
        "poses": [output.pose_json(pose, path.tool) for pose in path.poses],
        **output.attributes(path, "length margin clearance seconds checked"),
        "duration": timed.duration,
        "trajectory": output.attributes(timed, names),
        **(largest or {}),
        **({} if out is None else {"file": out}),
    }


def _path_lines(
    design: Design,
    path: planning.PlannedPath,
    timed: Trajectory,
    loads: PathLoads | None,
    out: File | None,
) -> Iterator[str]:
    least = path_margins(path.poses, tool=path.tool).least
    plural = "" if path.checked == 1 else "s"
    yield output.heading(design)
    yield from _end_lines(design, path.poses[0], path.poses[-1], path.tool)
    rows = [
        ("moves", f"{len(path.poses) - 1}, each proved to keep limits and clearances"),
        ("length", f"{output.figure(path.length)} (root mean square of b1 to b4)"),
        (
            "keeps",
            f"|δ| {output.figure(path.margin)}, clearance {output.figure(path.clearance)} or more",
        ),
        ("planned in", f"{path.seconds:.3g} s, {path.checked} line{plural} tried"),
        ("takes", f"{output.figure(timed.duration)} s"),
        ("least |δ|", "  ".join(f"δ{i + 1} {output.figure(v)}" for i, v in enumerate(least))),
    ]
    if loads is not None:
        words = f"held, with {100.0 * loads.share:.1f} % of a limit"
        words += f" at {len(loads.at)} samples and {100.0 * loads.bound:.1f} % at most between them"
        if loads.part is not None:
            seconds = float(np.interp(loads.place, timed.at, timed.time))
            words += f": {PART_NAMES[loads.part]}, at {output.figure(seconds)} s"
        rows.append(("load", words))
    yield from ("", output.table(rows, "<<"))
    if out is not None:
        yield from ("", f"{len(timed.time)} rows in {out}")
