"""`explorer path` and `drives`: planned paths, and what a path asks of the actuators in time."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro

from explorer.cli import options, output, values
from explorer.errors import InputError
from explorer.export.pose_tables import read_corners, read_table
from explorer.export.tables import corners_csv, drives_csv, trajectory_csv
from explorer.files.writing import check_writable
from explorer.legs.moves import StraightMoves
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose
from explorer.motion.masses import DENSITY
from explorer.paths import drives, planning
from explorer.paths.crossings import path_margins
from explorer.paths.loads import PathLoads, path_loads
from explorer.paths.time_law import TimeLaw, law_at_speed
from explorer.paths.trajectory import DEFAULT_SPEED, Trajectory, trajectory
from explorer.statics.reactions import LIMITED, PART_NAMES

INSTEAD = values.hint("instead of --from-quaternion")


@dataclass(frozen=True, kw_only=True)
class TimedOptions(
    options.RadiiOptions, options.JsonOptions, options.EndOptions, options.PointOptions
):
    """The options for the design, the two ends of a path, and its time."""

    from_: Annotated[
        values.PoseNumbers,
        tyro.conf.arg(name="from", help_behavior_hint="(default: the home pose)"),
    ] = None
    """Start of the path; lengths are in design units."""

    from_quaternion: Annotated[values.Quaternion, values.OF_HOME] = None
    """Orientation of the platform at the start."""

    from_yaw_pitch_roll: Annotated[values.YawPitchRoll, INSTEAD] = None
    """Orientation of the platform at the start, in degrees."""

    from_tilt_torsion: Annotated[values.TiltTorsion, INSTEAD] = None
    """Azimuth, tilt and torsion of the platform at the start, in degrees."""

    from_folds: Annotated[values.Folds, values.hint("instead of --from")] = None
    """Folds of the pose at the start; r in design units, angles in degrees."""

    to: Annotated[values.PoseNumbers, values.OPTIONAL] = None
    """End of the path; lengths are in design units."""

    speed: Annotated[values.Positive, values.hint("default: a tenth of the reach")] = None
    """Speed of the fastest actuator, in design units per second."""

    acceleration: Annotated[values.Positive, values.OPTIONAL] = None
    """Acceleration with which the fastest actuator reaches this speed, and stops at every corner,
    in design units per s²."""

    samples: Annotated[int, values.whole_number(2, 100_000)] = 201
    """Number of rows of the table."""

    def ends(self, design: Design) -> tuple[Pose, Pose | None]:
        """Return the poses at start and end; the end is None if it is not given."""
        tool = self.tool(design)
        start = options.make_pose(self, "from_", design.home_pose, self.from_, tool)
        return start, self.end(start, self.to, tool)

    def law(self, design: Design, poses: Sequence[Pose]) -> TimeLaw:
        """Return the time law, at the speed and with the acceleration, of the path with corners."""
        moves, speed = StraightMoves.along(poses, self.tool(design)), self.speed
        speed = DEFAULT_SPEED * design.reach if speed is None else speed
        return law_at_speed(design, moves, speed, self.acceleration or math.inf)


@dataclass(frozen=True, kw_only=True)
class PathCommand(TimedOptions):
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

    out: Annotated[Path | None, values.hint("optional", "FILE.csv")] = None
    """File for the trajectory as CSV: time, joints and pose, and the tool's position with `--at
    tool`."""

    corners: Annotated[Path | None, values.hint("optional", "FILE.csv")] = None
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
        if self.out is not None and self.out == self.corners:
            raise InputError(f"--out and --corners need two files; got {self.out} for both")
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
        law = self.law(design, path.poses)
        timed = trajectory(design, path.poses, samples=self.samples, tool=tool, law=law)
        loads = None
        if self.load is not None:
            loads = path_loads(design, path.poses, self.load, tool=tool)
        corners, count = corners_csv(path.poses, tool), len(path.poses)
        files = {
            file: (name, text, words)
            for file, name, text, words in (
                (self.corners, "corners_file", corners, f"{count} corners"),
                (self.out, "file", trajectory_csv(timed), f"{len(timed.time)} rows"),
            )
            if file is not None
        }
        written, errors = options.write_files({f: row[1].encode() for f, row in files.items()})
        lines = [*_path_lines(design, path, timed, loads), *[""] * bool(written)]
        self.write(
            lambda: _path_json(path, timed, loads) | {files[file][0]: file for file in written},
            [*lines, *(f"{files[file][2]} in {file}" for file in written)],
            errors,
        )


def _path_json(
    path: planning.PlannedPath, timed: Trajectory, loads: PathLoads | None
) -> dict[str, object]:
    names = "time joints position quaternion" + (" tool_position" if path.tool else "")
    largest = loads and {
        "largest_share": loads.utilisation,
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
    }


def _path_lines(
    design: Design, path: planning.PlannedPath, timed: Trajectory, loads: PathLoads | None
) -> Iterator[str]:
    least = path_margins(path.poses, tool=path.tool).least
    plural, margin = "" if path.checked == 1 else "s", output.figure(path.margin)
    yield output.heading(design)
    yield from output.end_lines(design, path.poses[0], path.poses[-1], path.tool)
    rows = [
        ("moves", f"{len(path.poses) - 1}, each proved to keep limits and clearances"),
        ("length", f"{output.figure(path.length)} (root mean square of b1 to b4)"),
        ("keeps", f"|δ| {margin}, clearance {output.figure(path.clearance)} or more"),
        ("planned in", f"{path.seconds:.3g} s, {path.checked} line{plural} tried"),
        ("takes", f"{output.figure(timed.duration)} s"),
        ("least |δ|", "  ".join(f"δ{i + 1} {output.figure(v)}" for i, v in enumerate(least))),
    ]
    if loads is not None:
        words = f"held, with {100.0 * loads.utilisation:.1f} % of a limit"
        words += f" at {len(loads.at)} samples and {100.0 * loads.bound:.1f} % at most between them"
        if loads.part is not None:
            seconds = float(np.interp(loads.place, timed.at, timed.time))
            words += f": {PART_NAMES[loads.part]}, at {output.figure(seconds)} s"
        rows.append(("load", words))
    yield from ("", output.table(rows, "<<"))


@dataclass(frozen=True, kw_only=True)
class DrivesCommand(TimedOptions):
    """Compute speeds, forces and powers of the actuators along a path; one motor for all.

    A path rests at every corner. It takes the shortest time within the design's limits of speeds,
    accelerations and forces, which needs the extra `timing`; or `--duration`; or the time that
    `--acceleration` and `--speed` give. Forces hold and accelerate platform, payload and legs;
    friction and the rotors of motors are left out.
    """

    path: Annotated[Path | None, values.hint("instead of --from and --to", "FILE")] = None
    """Corners of the path: a table of poses as that of `explorer inverse --poses`, such as
    `explorer path --corners` writes; a column `pause_s` has the pauses there."""

    duration: Annotated[values.Positive, values.hint("default: the shortest")] = None
    """Duration in seconds with all pauses, in which the fastest actuator accelerates over one half
    of each move and brakes over the other, always by the same."""

    payload: Annotated[values.NotNegative, values.OF_DESIGN] = None
    """Mass of the payload, in kg."""

    density: Annotated[float, values.POSITIVE] = DENSITY
    """Density of the legs and the platform in kg/m³, as bars with the legs' radii."""

    out: Annotated[Path | None, values.hint("optional", "FILE.csv")] = None
    """File for a table: time in s, then joints and pose in mm, speeds in mm/s, forces in N and
    powers in W."""

    def run(self) -> None:
        """Write what the path asks of the actuators."""
        design = self.with_radii(self.read_design())
        design = options.with_payload(design, self.payload)
        if self.out is not None:
            check_writable(self.out)
        (poses, pauses), tool = self._corners(design), self.tool(design)
        law = None
        if self.acceleration is not None:
            law = self.law(design, poses).with_pauses(pauses)
        if self.speed is not None and law is None:
            raise InputError("--speed needs --acceleration: a path starts and ends at rest")
        if self.duration is not None and law is not None:
            raise InputError("give either --duration, or --speed and --acceleration")
        path = drives.TimedPath(poses, self.duration, tool, self.density, law, pauses)
        found = drives.drives_along(design, path)
        timed = trajectory(design, poses, law=found.law, samples=self.samples, tool=tool)
        files = {} if self.out is None else {self.out: drives_csv(found, timed).encode()}
        written, errors = options.write_files(files)
        lines = [output.heading(design), *output.block_lines(drives.drive_blocks(found))]
        lines += [line for file in written for line in ("", f"{self.samples} rows in {file}")]
        answer: dict[str, object] = {
            **found.summary._asdict(),
            "duration": found.law.duration,
            "binding": [[each._asdict() for each in limits] for limits in found.binding],
            "least_motor": found.least_motor,
            **({"file": written[0]} if written else {}),
        }
        self.write(lambda: answer, lines, errors)

    def _corners(self, design: Design) -> tuple[tuple[Pose, ...], tuple[float, ...]]:
        """Return the corners of the path, and its pauses there."""
        start, goal = self.ends(design)
        if self.path is None:
            if goal is None:
                raise InputError(f"give --path, or say where the path ends {options.END_OPTIONS}")
            return (start, goal), (0.0, 0.0)
        if goal is not None or start != design.home_pose:
            raise InputError("--path has the ends: leave out --from, --to and their orientations")
        return read_corners(read_table(self.path, design.unit_mm), design, start.rotation, self.at)
