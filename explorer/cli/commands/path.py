"""`explorer path`: a path between two poses within all limits and clearances, over time."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path as File
from typing import TYPE_CHECKING, Annotated

import numpy as np
import tyro

from explorer.cli.options import DesignOptions, JsonOptions, RadiiOptions
from explorer.cli.output import figure, heading, pose_table, table, write_json, write_lines
from explorer.cli.values import numbers, pose_numbers, positive, whole_number
from explorer.errors import InputError
from explorer.mechanism.design import Design
from explorer.mechanism.home import home_pose
from explorer.mechanism.pose import Pose, Quadruple, Triple, rotation_from_yaw_pitch_roll

if TYPE_CHECKING:
    from explorer.paths.planning import PlannedPath
    from explorer.paths.trajectory import Trajectory

_OPTIONAL = tyro.conf.arg(help_behavior_hint="(optional)")
_HOME = tyro.conf.arg(name="from", help_behavior_hint="(default: the home pose)")
_ORIENTATION_OF_HOME = tyro.conf.arg(help_behavior_hint="(default: that of the home pose)")
_ORIENTATION_OF_START = tyro.conf.arg(help_behavior_hint="(default: that of the start)")

Numbers = tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class Path(JsonOptions, RadiiOptions, DesignOptions):
    """Plan a path between two poses within limits, margins and clearances.

    Both poses must have the same assembly mode. A pose is a position x y z, or a position and yaw
    pitch roll in degrees, or a position and a quaternion w x y z. Needs the extra `planning`.
    """

    from_: Annotated[Numbers | None, pose_numbers("--from"), _HOME] = None
    """Start of the path; lengths are in design units."""

    from_quaternion: Annotated[
        Quadruple | None, numbers("--from-quaternion", "w x y z"), _ORIENTATION_OF_HOME
    ] = None
    """Orientation of the platform at the start."""

    from_yaw_pitch_roll: Annotated[
        Triple | None,
        numbers("--from-yaw-pitch-roll", "yaw pitch roll"),
        tyro.conf.arg(help_behavior_hint="(instead of --from-quaternion)"),
    ] = None
    """Orientation of the platform at the start, in degrees."""

    to: Annotated[Numbers | None, pose_numbers("--to"), _OPTIONAL] = None
    """End of the path; lengths are in design units."""

    to_quaternion: Annotated[
        Quadruple | None, numbers("--to-quaternion", "w x y z"), _ORIENTATION_OF_START
    ] = None
    """Orientation of the platform at the end."""

    to_yaw_pitch_roll: Annotated[
        Triple | None,
        numbers("--to-yaw-pitch-roll", "yaw pitch roll"),
        tyro.conf.arg(help_behavior_hint="(instead of --to-quaternion)"),
    ] = None
    """Orientation of the platform at the end, in degrees."""

    seconds: Annotated[float, positive("--seconds")] = 2.0
    """Longest time to search for a path, in seconds."""

    speed: Annotated[
        float | None,
        positive("--speed"),
        tyro.conf.arg(help_behavior_hint="(default: a tenth of the reach)"),
    ] = None
    """Speed of the fastest actuator, in design units per second."""

    samples: Annotated[int, whole_number("--samples", 2, 100_000)] = 201
    """Number of rows of the trajectory."""

    out: Annotated[File | None, tyro.conf.arg(metavar="FILE.csv"), _OPTIONAL] = None
    """File for the trajectory as CSV: time, joints and pose."""

    def run(self) -> None:
        """Write the path.

        Raises:
            InputError: a design, pose, number or file that cannot be used.
            NoPathError: there is no path, or the time ended before one was found.
            MissingExtraError: OMPL is not installed.
        """
        from explorer.export.trajectory import write_trajectory
        from explorer.files.writing import check_writable
        from explorer.paths.planning import EndError, NoPathError, plan_path
        from explorer.paths.trajectory import trajectory

        design = self.with_radii(self.load())
        start = _pose(
            "from", self.from_, self.from_quaternion, self.from_yaw_pitch_roll, home_pose(design)
        )
        if self.to is None and self.to_quaternion is None and self.to_yaw_pitch_roll is None:
            raise InputError(
                "say where the path ends with --to, --to-quaternion or --to-yaw-pitch-roll"
            )
        goal = _pose("to", self.to, self.to_quaternion, self.to_yaw_pitch_roll, start)
        if self.out is not None:
            check_writable(self.out)
        try:
            path = plan_path(design, start, goal, seconds=self.seconds)
        except (EndError, NoPathError) as error:
            if self.json:
                write_json({"found": False, "reason": error.reason, "poses": []})
            raise
        timed = trajectory(design, path.poses, speed=self.speed, samples=self.samples)
        if self.out is not None:
            write_trajectory(timed, self.out)
        if self.json:
            write_json(_as_json(path, timed, self.out))
        else:
            write_lines(*_as_lines(design, path, timed, self.out))


def _pose(
    option: str,
    values: Numbers | None,
    quaternion: Quadruple | None,
    yaw_pitch_roll: Triple | None,
    otherwise: Pose,
) -> Pose:
    """Return the pose that options give, completed from another pose."""
    given = [
        name
        for name, value in (("quaternion", quaternion), ("yaw-pitch-roll", yaw_pitch_roll))
        if value
    ]
    if len(given) == 2:
        raise InputError(
            f"give one of --{option}-quaternion and --{option}-yaw-pitch-roll, not both"
        )
    x, y, z = otherwise.position if values is None else values[:3]
    rest = () if values is None else values[3:]
    if rest and given:
        raise InputError(f"--{option} has an orientation already; leave --{option}-{given[0]} out")
    if len(rest) == 4:
        w, i, j, k = rest
        return Pose((x, y, z), (w, i, j, k))
    if rest:
        return Pose.of((x, y, z), rotation_from_yaw_pitch_roll(rest))
    if yaw_pitch_roll is not None:
        return Pose.of((x, y, z), rotation_from_yaw_pitch_roll(yaw_pitch_roll))
    return Pose((x, y, z), quaternion or otherwise.quaternion)


def _as_json(path: PlannedPath, timed: Trajectory, out: File | None) -> dict[str, object]:
    answer: dict[str, object] = {
        "found": True,
        "reason": None,
        "poses": [
            {"position": list(each.position), "quaternion": list(each.quaternion)}
            for each in path.poses
        ],
        "length": path.length,
        "margin": path.margin,
        "clearance": path.clearance,
        "seconds": path.seconds,
        "checked": path.checked,
        "duration": timed.duration,
        "trajectory": {
            "time": timed.time.tolist(),
            "joints": timed.joints.tolist(),
            "position": timed.position.tolist(),
            "quaternion": timed.quaternion.tolist(),
        },
    }
    if out is not None:
        answer["file"] = str(out)
    return answer


def _as_lines(design: Design, path: PlannedPath, timed: Trajectory, out: File | None) -> list[str]:
    from explorer.paths.crossings import path_margins

    least = np.abs(path_margins(path.poses).margins).min(axis=0).tolist()
    lines = [
        heading(design),
        "from",
        *(f"  {line}" for line in pose_table(design, path.poses[0]).splitlines()),
        "to",
        *(f"  {line}" for line in pose_table(design, path.poses[-1]).splitlines()),
        "",
        table(
            [
                ("moves", f"{len(path.poses) - 1}, each proved to keep limits and clearances"),
                ("length", f"{figure(path.length)} (root mean square of b1 to b4)"),
                ("keeps", f"|δ| {figure(path.margin)}, clearance {figure(path.clearance)} or more"),
                ("planned in", f"{path.seconds:.3g} s, {path.checked} moves checked"),
                ("takes", f"{figure(timed.duration)} s"),
                ("least |δ|", "  ".join(f"δ{i + 1} {figure(v)}" for i, v in enumerate(least))),
            ],
            "<<",
        ),
    ]
    if out is not None:
        lines += ["", f"{len(timed.time)} rows in {out}"]
    return lines
