"""`explorer path`: a path between two poses within all limits and clearances, over time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path as File
from typing import TYPE_CHECKING, Annotated

import numpy as np
import tyro

from explorer.cli import output
from explorer.cli.load_options import check_has_limits
from explorer.cli.options import (
    DesignOptions,
    EndOptions,
    JsonOptions,
    PointOptions,
    RadiiOptions,
    make_pose,
    write_files,
)
from explorer.cli.values import (
    OF_HOME,
    OPTIONAL,
    Numbers,
    fold_numbers,
    hint,
    load_numbers,
    numbers,
    pose_numbers,
    positive,
    whole_number,
)
from explorer.errors import InputError
from explorer.mechanism.design import Design
from explorer.mechanism.machine import Six
from explorer.mechanism.pose import Pose, Quadruple, Triple
from explorer.statics.reactions import LIMITED, PART_NAMES

if TYPE_CHECKING:
    from explorer.paths.loads import PathLoads
    from explorer.paths.planning import PlannedPath
    from explorer.paths.trajectory import Trajectory


@dataclass(frozen=True, kw_only=True)
class Path(JsonOptions, RadiiOptions, EndOptions, PointOptions, DesignOptions):
    """Plan a path between two poses within limits, margins and clearances.

    Both poses must have the same assembly mode. A pose is a position x y z, or a position and yaw
    pitch roll in degrees, or a position and a quaternion w x y z. With `--at tool` positions are
    those of the tool, which then goes straight in each move. Needs the extra `planning`.
    """

    from_: Annotated[
        Numbers | None,
        pose_numbers("--from"),
        tyro.conf.arg(name="from", help_behavior_hint="(default: the home pose)"),
    ] = None
    """Start of the path; lengths are in design units."""

    from_quaternion: Annotated[
        Quadruple | None, numbers("--from-quaternion", "w x y z"), OF_HOME
    ] = None
    """Orientation of the platform at the start."""

    from_yaw_pitch_roll: Annotated[
        Triple | None,
        numbers("--from-yaw-pitch-roll", "yaw pitch roll"),
        hint("instead of --from-quaternion"),
    ] = None
    """Orientation of the platform at the start, in degrees."""

    from_tilt_torsion: Annotated[
        Triple | None,
        numbers("--from-tilt-torsion", "azimuth tilt torsion"),
        hint("instead of --from-quaternion"),
    ] = None
    """Azimuth, tilt and torsion of the platform at the start, in degrees."""

    from_folds: Annotated[Six | None, fold_numbers("--from-folds"), hint("instead of --from")] = (
        None
    )
    """Folds of the pose at the start; r in design units, angles in degrees."""

    to: Annotated[Numbers | None, pose_numbers("--to"), OPTIONAL] = None
    """End of the path; lengths are in design units."""

    load: Annotated[Six | None, load_numbers("--load"), OPTIONAL] = None
    """Force in N and moment in N × unit at the tool, along the axes of the base, besides the
    payload: the path holds them within the limits of actuators, struts and guide."""

    seconds: Annotated[float, positive("--seconds")] = 2.0
    """Longest time to search for a path, in seconds."""

    speed: Annotated[float | None, positive("--speed"), hint("default: a tenth of the reach")] = (
        None
    )
    """Speed of the fastest actuator, in design units per second."""

    samples: Annotated[int, whole_number("--samples", 2, 100_000)] = 201
    """Number of rows of the trajectory."""

    out: Annotated[File | None, hint("optional", "FILE.csv")] = None
    """File for the trajectory as CSV: time, joints and pose, and the tool's position with `--at
    tool`."""

    def run(self) -> None:
        """Write the path."""
        from explorer.export.tables import trajectory_csv
        from explorer.files.writing import check_writable
        from explorer.paths.loads import path_loads
        from explorer.paths.planning import NoPathError, plan_path
        from explorer.paths.trajectory import trajectory

        design = self.with_radii(self.read_design())
        tool = self.tool(design)
        starts = (
            self.from_,
            self.from_quaternion,
            self.from_yaw_pitch_roll,
            self.from_tilt_torsion,
            self.from_folds,
        )
        ends = (self.to, *self.end)
        start = _pose("--from", design.home_pose, *starts, tool)
        if ends == (None,) * 5:
            raise InputError(
                "say where the path ends with --to, --to-quaternion, --to-yaw-pitch-roll, "
                "--to-tilt-torsion or --to-folds"
            )
        goal = _pose("--to", start, *ends, tool)
        if self.load is not None:
            check_has_limits(design)
        if self.out is not None:
            check_writable(self.out)
        try:
            path = plan_path(design, start, goal, seconds=self.seconds, tool=tool, load=self.load)
        except NoPathError as error:
            if self.json:
                output.write_json({"found": False, "reason": error.reason, "poses": []})
            raise
        timed = trajectory(design, path.poses, speed=self.speed, samples=self.samples, tool=tool)
        loads = None
        if self.load is not None:
            loads = path_loads(design, path.poses, self.load, tool=tool)
        files = {} if self.out is None else {self.out: trajectory_csv(timed).encode()}
        written, errors = write_files(files)
        out = next(iter(written), None)
        self.write(
            lambda: _as_json(path, timed, loads, out),
            lambda: _as_lines(design, path, timed, loads, out),
            errors,
        )


def _pose(
    option: str,
    default: Pose,
    values: Numbers | None,
    quaternion: Quadruple | None,
    yaw_pitch_roll: Triple | None,
    tilt_torsion: Triple | None,
    folds: Six | None,
    tool: Triple | None,
) -> Pose:
    """Return the pose of an option whose position an orientation may follow."""
    position, rest = (None, ()) if values is None else (values[:3], values[3:])
    others = (quaternion, yaw_pitch_roll, tilt_torsion, folds)
    names = ("quaternion", "yaw-pitch-roll", "tilt-torsion", "folds")
    for name, value in zip(names, others, strict=True):
        if rest and value is not None:
            raise InputError(f"{option} has an orientation already; leave {option}-{name} out")
    if len(rest) == 3:
        others = (None, rest, None, None)
    elif rest:
        others = (rest, None, None, None)
    return make_pose(f"{option}-", default, position, *others, tool)  # pyright: ignore[reportArgumentType]


def _as_json(
    path: PlannedPath, timed: Trajectory, loads: PathLoads | None, out: File | None
) -> dict[str, object]:
    names = "time joints position quaternion" + (" tool_position" if path.tool else "")
    answer: dict[str, object] = {
        "found": True,
        "reason": None,
        "poses": [output.pose_json(pose, path.tool) for pose in path.poses],
        **output.attributes(path, "length margin clearance seconds checked"),
        "duration": timed.duration,
        "trajectory": output.attributes(timed, names),
    }
    if loads is not None:
        answer["largest_share"] = loads.share
        answer["largest_share_bound"] = loads.bound
        answer["largest_share_part"] = None if loads.part is None else LIMITED[loads.part]
        answer["largest_share_at"] = loads.place
    return answer if out is None else {**answer, "file": out}


def _as_lines(
    design: Design,
    path: PlannedPath,
    timed: Trajectory,
    loads: PathLoads | None,
    out: File | None,
) -> Iterator[str]:
    from explorer.paths.crossings import path_margins

    least = path_margins(path.poses, tool=path.tool).least
    plural = "" if path.checked == 1 else "s"
    yield output.heading(design)
    for name, pose in (("from", path.poses[0]), ("to", path.poses[-1])):
        yield from (name, *output.indent(output.pose_table(design, pose, path.tool)))
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
