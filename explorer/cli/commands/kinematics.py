"""`explorer inverse`, `forward` and `singularity`: joints, modes, and margins of poses."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Annotated

import numpy as np

from explorer.cli import options, output, values
from explorer.errors import InputError, NoAnswerError
from explorer.export import pose_tables
from explorer.files.writing import write_whole
from explorer.measures.snapshot import Snapshot, evaluate
from explorer.mechanism import kinematics
from explorer.mechanism.configuration import Configuration, tool_offset
from explorer.mechanism.design import JOINTS, Design
from explorer.mechanism.feasible_intervals import feasible_intervals, nearest_feasible
from explorer.mechanism.folds import FOLDS
from explorer.mechanism.machine import Six
from explorer.mechanism.margins import TETRAHEDRA, margins, mode_name, signs_of
from explorer.mechanism.pose import Triple, quaternion_from_rotation, yaw_pitch_roll_from_rotation
from explorer.mechanism.tilt_torsion import tilt_torsion_from_rotation
from explorer.numerics.arrays import FloatArray
from explorer.singularity import ellipsoids
from explorer.singularity.strata import incidences
from explorer.workspace.limits.table import joint_ranges


@dataclass(frozen=True, kw_only=True)
class InverseCommand(options.JsonOptions, options.MachineOptions, options.PoseOptions):
    """Compute the joints of a pose, or of a table of poses.

    Their order is l1 d1 d2 d3 d4 l4. The violated limits of the design and the legs that collide
    are listed. A table is a CSV file with the columns x, y, z (or tool_x, tool_y, tool_z with
    `--at tool`) and qw, qx, qy, qz, or yaw, pitch, roll, or azimuth, tilt, torsion. A heading may
    have a unit, such as x_mm, x [10 mm] or yaw_deg; without one it is the design's unit, or
    degrees. With `--machine` the joints are those that the encoders of that machine read; limits
    are the design's.
    """

    poses: Annotated[Path | None, values.hint("instead of one pose", "FILE.csv")] = None
    """Table of poses; without an orientation of their own they have that of the options."""

    out: Annotated[Path | None, values.hint("with --poses", "FILE.csv")] = None
    """Table to write: joints, mode, pose, and the violated limits of each line."""

    nominal_firmware: values.Flag = False
    """Write into the table the poses to command a controller that knows the design alone."""

    def run(self) -> None:
        """Write the joints of the pose or of the poses."""
        design = self.read_design()
        machine = self.read_machine(design)
        if self.nominal_firmware and (machine is None or self.poses is None):
            raise InputError("--nominal-firmware is for --machine FILE.json and --poses FILE.csv")
        files = _files("--poses", self.poses, self.out)
        if files is not None:
            if self.position is not None or self.folds is not None:
                raise InputError("--poses has the positions; leave --position and --folds out")
            table = pose_tables.read_table(files[0], design.unit_mm)
            if self.has_orientation and table.has_orientations:
                raise InputError(
                    f"{table.file} has orientations: leave its columns or the options of the "
                    "orientation out"
                )
            rotation = self.oriented_home(design).rotation
            poses = pose_tables.read_poses(table, design, rotation, self.at)
            joints = machine and machine.inverse(poses.positions, poses.rotations)
            closes = None
            if machine is not None and self.nominal_firmware:
                position, rotation, closes = machine.nominal_commands(
                    poses.positions, poses.rotations
                )
                poses = Configuration(design, position, rotation)
            answer = pose_tables.inverse_answer(table, poses, self.at, joints, closes)
            _write_answer(self, files, answer)
            return
        snapshot, tool = evaluate(design, self.pose(design)), self.tool(design)
        joints = (
            machine.inverse(snapshot.pose.position, snapshot.rotation)
            if machine
            else snapshot.joints
        )
        self.write(
            lambda: _inverse_json(snapshot, tool, joints), _inverse_lines(snapshot, tool, joints)
        )


def _inverse_json(snapshot: Snapshot, tool: Triple | None, joints: FloatArray) -> dict[str, object]:
    folds = output.folds_in_degrees(snapshot.pose.position, snapshot.rotation)
    answer = {"joints": joints, "folds": folds, **output.limits_json(snapshot)}
    return answer if tool is None else {**answer, **output.pose_json(snapshot.pose, tool)}


def _inverse_lines(snapshot: Snapshot, tool: Triple | None, joints: FloatArray) -> Iterator[str]:
    design, ranges = snapshot.design, joint_ranges(snapshot.design)
    rows = [("joint", "units", "mm", "limits")]
    for name, value in zip(JOINTS, joints.tolist(), strict=True):
        bounds = ranges.get(name)
        allowed = f"{bounds[0]:.6g} to {bounds[1]:.6g}" if bounds else "none"
        rows.append((name, *output.lengths(design, value, design.reach), allowed))
    pose = output.pose_table(design, snapshot.pose, tool)
    yield from (output.heading(design), pose, "", output.table(rows, "<>><"), "")
    yield from output.limits_lines(snapshot)


def _files(option: str, table: Path | None, out: Path | None) -> tuple[Path, Path] | None:
    """Return a table to read and the file to write; None if neither is given."""
    if table is None and out is None:
        return None
    if table is None or out is None:
        raise InputError(f"{option} FILE.csv is read and --out FILE.csv is written: give both")
    options.check_out(out, table)
    return table, out


def _write_answer(
    command: InverseCommand | ForwardCommand,
    files: tuple[Path, Path],
    answer: pose_tables.TableAnswer,
) -> None:
    """Write the table of an answer, and how many of its lines are within the limits."""
    table, out = files
    write_whole(out, answer.csv.encode())
    line, fault = answer.first or (None, None)
    lines = [f"lines of {table}, written to {out}: {answer.lines}"]
    if answer.closing < answer.lines:
        lines.append(f"lines that close: {answer.closing}")
    lines.append(f"lines within the limits: {answer.within}")
    if line is not None:
        lines.append(f"first of the others, line {line}: {fault}")
    if answer.skipped:
        lines.append(f"columns that are not read: {', '.join(answer.skipped)}")
    command.write(
        lambda: {
            "file": out,
            **output.attributes(answer, "lines closing within skipped"),
            "first_outside": None if line is None else {"line": line, "fault": fault},
        },
        lines,
    )


@dataclass(frozen=True, kw_only=True)
class ForwardCommand(options.JsonOptions, options.MachineOptions, options.PointOptions):
    """Compute the eight assembly modes of the joints, or of a table of joints.

    All eight are real or none is. If none is, the exit status is 1 and the message names the
    failing trilateration and the smallest change of a joint that makes it feasible. With
    `--machine` the joints are what the encoders of that machine read, and poses are the true ones.
    """

    joints: Annotated[Six | None, values.numbers(" ".join(JOINTS)), values.OPTIONAL] = None
    """Values of the joints, in design units."""

    joints_file: Annotated[Path | None, values.hint("instead of --joints", "FILE.csv")] = None
    """Table of joints: a CSV file with the columns l1, d1, d2, d3, d4 and l4; a heading may have a
    unit, such as l1_mm or l1 [10 mm], without which it is the design's unit."""

    out: Annotated[Path | None, values.hint("with --joints-file", "FILE.csv")] = None
    """Table to write: joints, mode, pose, and the violated limits, in eight lines for each."""

    def run(self) -> None:
        """Write all eight poses of the joints."""
        design = self.read_design()
        machine = self.read_machine(design)
        files = _files("--joints-file", self.joints_file, self.out)
        if (files is None) == (self.joints is None):
            raise InputError("give either --joints or --joints-file")
        if files is not None:
            table = pose_tables.read_table(files[0], design.unit_mm)
            joints = pose_tables.read_joints(table)
            modes = machine and machine.modes(joints)
            answer = pose_tables.forward_answer(table, design, joints, self.at, modes)
            _write_answer(self, files, answer)
            return
        joints = np.array(self.joints, dtype=np.float64)
        squares = kinematics.discriminants(design, joints)
        modes = machine.modes(joints) if machine else kinematics.forward(design, joints)
        if not modes.feasible:
            if self.json:
                output.write_json({"feasible": False, "discriminants": squares, "modes": []})
            raise NoAnswerError(
                "the legs of the machine do not close in every mode: move away from singular poses"
                if machine and (squares > 0.0).all()
                else _failure_message(design, joints, squares)
            )
        tool = design.tool.position
        shown_tool = tool if self.at == "tool" or any(tool) else None
        rows = [("joint", *JOINTS), ("units", *output.figures(joints.tolist()))]
        self.write(
            lambda: {
                "feasible": True,
                "discriminants": squares,
                "modes": _modes_json(modes, shown_tool),
            },
            chain(
                (output.heading(design), output.table(rows, "<>>>>>>")),
                _mode_lines(modes, shown_tool),
            ),
        )


def _modes_json(
    modes: kinematics.ForwardKinematics, tool: Triple | None
) -> list[dict[str, object]]:
    quaternion = quaternion_from_rotation(modes.rotation)
    tilt_torsion = tilt_torsion_from_rotation(modes.rotation)
    margin = margins(modes.position, modes.rotation)
    folds = output.folds_in_degrees(modes.position, modes.rotation)
    at_tool = modes.position + tool_offset(modes.rotation, tool)
    return [
        {
            "mode": mode,
            "signs": signs_of(mode),
            "position": modes.position[mode],
            **({} if tool is None else {"tool_position": at_tool[mode]}),
            "quaternion": quaternion[mode],
            "tilt_torsion": tilt_torsion[mode],
            "margins": margin[mode],
            "folds": folds[mode],
        }
        for mode in range(len(margin))
    ]


def _mode_lines(modes: kinematics.ForwardKinematics, tool: Triple | None) -> Iterator[str]:
    angles = yaw_pitch_roll_from_rotation(modes.rotation)
    margin = margins(modes.position, modes.rotation)
    folds = output.folds_in_degrees(modes.position, modes.rotation)
    r, *between = folds[0, :3].tolist()
    first = "  ".join([output.figure(r), *output.degrees(between)])
    # Those of a machine that was built differ a little.
    if np.allclose(folds[:, :3], folds[0, :3], rtol=1e-7):
        yield f"{' '.join(FOLDS[:3])}  {first}, in every mode"
    at_tool = modes.position + tool_offset(modes.rotation, tool)
    names = () if tool is None else ("tool x", "tool y", "tool z")
    heads = *names, "yaw", "pitch", "roll", "δ1", "δ2", "δ3", *FOLDS[3:]
    rows = [("mode", "signs", *"xyz", *heads)]
    rows += [
        (
            str(mode),
            mode_name(mode),
            *output.figures(modes.position[mode].tolist()),
            *(output.figures(at_tool[mode].tolist()) if names else ()),
            *output.degrees(angles[mode].tolist()),
            *output.figures(margin[mode].tolist()),
            *output.degrees(folds[mode, 3:].tolist()),
        )
        for mode in range(len(margin))
    ]
    yield from ("", output.table(rows, "<<" + ">" * (len(rows[0]) - 2)))


def _failure_message(design: Design, joints: FloatArray, squares: FloatArray) -> str:
    """Return the tetrahedron that does not close, and the least change of one joint to close it."""
    failures = [
        f"trilateration {index + 1} (tetrahedron {' '.join(TETRAHEDRA[index])}) has "
        f"δ{index + 1}² = {square:.4g}"
        for index, square in enumerate(squares.tolist())
        if square < 0.0
    ]
    moves: list[tuple[float, str]] = []
    for index, intervals in enumerate(feasible_intervals(design, joints)):
        nearest = nearest_feasible(design, joints, index, intervals)
        if nearest is not None:
            value = float(joints[index])
            words = f"{JOINTS[index]} from {value:.10g} to {nearest!r}"
            moves.append((abs(nearest - value), words))
    change = "no change of a single joint closes them"
    if moves:
        change = f"the least change of one joint that closes them is {min(moves)[1]}"
    return (
        f"the lengths do not close: {' and '.join(failures)}, which must not be negative; {change}"
    )


@dataclass(frozen=True, kw_only=True)
class SingularityCommand(options.JsonOptions, options.PoseOptions):
    """Measure how near a pose is to a singularity, and to which.

    A margin is zero where its tetrahedron is flat; δ1 and δ3 are distances, δ2 is a distance times
    a sine. The signs of the three margins name the assembly mode. The nearest singular poses
    minimise the root-mean-square displacement of the platform's points b1 to b4, Nawratil's metric.
    With `--at tool` the ellipsoids of speeds and forces at the tool
    follow; the singular poses themselves do not depend on the tool.
    """

    def run(self) -> None:
        """Write the margins of the pose and the measures of singularity."""
        design = self.read_design()
        snapshot, tool = evaluate(design, self.pose(design)), self.tool(design)
        self.write(lambda: _singularity_json(snapshot, tool), _singularity_lines(snapshot, tool))


def _singularity_json(snapshot: Snapshot, tool: Triple | None) -> dict[str, object]:
    indices = "inverse_condition smallest_singular_value manipulability transmissions"
    names = f"margins volumes determinant {indices} transmission_index proximity"
    return {
        **output.attributes(snapshot, f"{names} stratum stratum_dimension mode signs"),
        "folds": output.folds_in_degrees(snapshot.pose.position, snapshot.rotation),
        "incidences": incidences(snapshot.stratum),
        "nearest": [
            {
                **output.attributes(nearest, "incidence distance"),
                **output.pose_json(nearest.pose, tool),
            }
            for nearest in snapshot.nearest
        ],
        **({} if tool is None else _tool_json(snapshot, tool)),
    }


def _tool_json(snapshot: Snapshot, tool: Triple) -> dict[str, object]:
    """Return the tool's position, and the condition of J and the ellipsoids at the tool."""
    found = ellipsoids.performance(snapshot.design, snapshot.pose, tool)
    return {
        **output.tool_json(snapshot.pose, tool),
        "tool_inverse_condition": _condition_at(snapshot, tool),
        "tool_ellipsoids": {
            name: {"gain": each.gain, "axes": each.axes.T}
            for name, each in (("translation", found.translation), ("rotation", found.rotation))
        },
    }


def _condition_at(snapshot: Snapshot, tool: Triple) -> float:
    return float(Configuration.at(snapshot.design, snapshot.pose, tool).inverse_condition)


def _singularity_lines(snapshot: Snapshot, tool: Triple | None) -> Iterator[str]:
    # Only this text needs them, and they would delay every command of the module.
    from explorer.measures.blocks import singularity as blocks
    from explorer.measures.blocks.block import Block, Statement
    from explorer.measures.verdict import verdict

    design, here = snapshot.design, verdict(snapshot)
    yield from (output.heading(design), output.pose_table(design, snapshot.pose, tool))
    shown: list[Block] = [
        Statement(here.title, here.reason(design.millimetres)),
        *blocks.freedoms(snapshot),
        blocks.margin_table(snapshot),
        blocks.tetrahedra(snapshot),
        blocks.conditioning(snapshot),
        blocks.nearest_poses(snapshot),
    ]
    if tool is not None:
        found = ellipsoids.performance(design, snapshot.pose, tool)
        shown += blocks.ellipsoids(found, "the tool")
        shown.append(blocks.tool_condition(_condition_at(snapshot, tool)))
    yield from output.block_lines(shown)
