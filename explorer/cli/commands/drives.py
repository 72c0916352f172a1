"""`explorer drives`: what a path asks of the actuators in time, and the least motor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from explorer.cli import options, output, values
from explorer.errors import InputError
from explorer.export.pose_tables import MOST_BYTES, parse_table, read_poses
from explorer.export.tables import drives_csv
from explorer.files.writing import check_writable, read_at_most
from explorer.legs.moves import StraightMoves
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose
from explorer.paths.drives import Drives as DrivesOfPath, drive_blocks
from explorer.paths.time_law import TimeLaw, law_at_speed
from explorer.paths.trajectory import trajectory
from explorer.prototype.dynamics import TimedPath, drives_along
from explorer.prototype.weights import DENSITY


@dataclass(frozen=True, kw_only=True)
class Drives(options.JsonOptions, options.PathEndOptions):
    """Compute speeds, forces and powers of the actuators along a path; the least motor.

    A path rests at every corner. It takes the shortest time within the design's limits of speeds,
    accelerations and forces, which needs the extra `timing`; or `--duration`; or it has `--speed`
    and `--acceleration`. Forces hold and accelerate platform, payload and legs; friction and the
    rotors of motors are left out.
    """

    path: Annotated[Path | None, values.hint("instead of --from and --to", "FILE")] = None
    """Corners of the path: a table of poses as that of `explorer inverse --poses`, such as
    `explorer path --corners` writes."""

    duration: Annotated[values.Positive, values.hint("default: the shortest")] = None
    """Duration in seconds, with the least acceleration of the fastest actuator."""

    speed: Annotated[values.Positive, values.hint("with --acceleration")] = None
    """Speed of the fastest actuator, in design units per second."""

    acceleration: Annotated[values.Positive, values.hint("with --speed")] = None
    """Acceleration with which the fastest actuator reaches this speed, and stops at every corner,
    in design units per s²."""

    payload: Annotated[values.NotNegative, values.OF_DESIGN] = None
    """Mass of the payload, in kg."""

    density: Annotated[float, values.POSITIVE] = DENSITY
    """Density of the legs and the platform in kg/m³, as bars with the legs' radii."""

    samples: Annotated[int, values.whole_number(2, 100_000)] = 201
    """Number of rows of the table."""

    out: Annotated[Path | None, values.hint("optional", "FILE.csv")] = None
    """File for a table: time in s, then joints and pose in mm, speeds in mm/s, forces in N and
    powers in W."""

    def run(self) -> None:
        """Write what the path asks of the actuators."""
        design = self.read_design()
        payload = options.replace_given(design.payload, mass_kg=self.payload)
        design = options.replace_given(design, payload=payload)
        if self.out is not None:
            check_writable(self.out)
        poses, tool = self._poses(design), self.tool(design)
        law = self._law(design, StraightMoves.along(poses, tool))
        found = drives_along(design, TimedPath(poses, law, tool, self.density))
        timed = trajectory(design, poses, law=found.law, samples=self.samples, tool=tool)
        files = {} if self.out is None else {self.out: drives_csv(found, timed).encode()}
        written, errors = options.write_files(files)
        lines = [output.heading(design), *output.block_lines(drive_blocks(found))]
        lines += [line for file in written for line in ("", f"{self.samples} rows in {file}")]
        self.write(lambda: _drives_json(found, written), lines, errors)

    def _poses(self, design: Design) -> tuple[Pose, ...]:
        """Return the corners of the path."""
        start, goal = self.ends(design)
        if self.path is None:
            if goal is None:
                raise InputError(
                    f"give the path with --path, or say where it ends {options.END_OPTIONS}"
                )
            return start, goal
        if goal is not None or start != design.home_pose:
            raise InputError("--path has the ends of the path; leave --from and --to out")
        table = parse_table(str(self.path), read_at_most(self.path, MOST_BYTES), design.unit_mm)
        if "time" in table.columns:
            raise InputError(
                f"{self.path} has a column time, so it is a path in time already: give the "
                "corners alone, such as those of explorer path --corners"
            )
        c = read_poses(table, design, start.rotation, self.at)
        return tuple(Pose.of(*each) for each in zip(c.positions, c.rotations, strict=True))

    def _law(self, design: Design, moves: StraightMoves) -> TimeLaw | float | None:
        """Return the time law that the options give, as `TimedPath` takes it."""
        if (self.speed is None) != (self.acceleration is None):
            raise InputError("--speed and --acceleration belong together: give both")
        if self.speed is None or self.acceleration is None:
            return self.duration
        if self.duration is not None:
            raise InputError("give either --duration, or --speed and --acceleration")
        return law_at_speed(design, moves, self.speed, self.acceleration)


def _drives_json(found: DrivesOfPath, written: Sequence[Path]) -> dict[str, object]:
    return {
        **found.figures._asdict(),
        "duration": found.law.duration,
        "binding": [each and each._asdict() for each in found.binding],
        "least_motor": found.least_motor,
        **({"file": written[0]} if written else {}),
    }
