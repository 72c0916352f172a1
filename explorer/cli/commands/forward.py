"""`explorer forward`: the eight assembly modes of the joints, or why there is none."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

from explorer.cli import output
from explorer.cli.options import DesignOptions, JsonOptions, PointOptions
from explorer.cli.values import numbers
from explorer.errors import NoAnswerError
from explorer.mechanism.configuration import tool_offset
from explorer.mechanism.design import JOINTS, Design
from explorer.mechanism.feasible_intervals import feasible_intervals, nearest_feasible
from explorer.mechanism.folds import FOLDS
from explorer.mechanism.kinematics import (
    ForwardKinematics,
    checked_joints,
    discriminants,
    forward,
)
from explorer.mechanism.margins import TETRAHEDRA, margins, mode_name, signs_of
from explorer.mechanism.pose import (
    Triple,
    quaternion_from_rotation,
    yaw_pitch_roll_from_rotation,
)
from explorer.mechanism.tilt_torsion import tilt_torsion_from_rotation
from explorer.numerics.arrays import FloatArray

Joints = tuple[float, float, float, float, float, float]


@dataclass(frozen=True, kw_only=True)
class Forward(JsonOptions, PointOptions, DesignOptions):
    """Compute the eight assembly modes of the joints.

    All eight are real or none is. If none is, the exit status is 1 and the message names the
    failing trilateration and the smallest change of a joint that makes it feasible.
    """

    joints: Annotated[Joints, numbers("--joints", " ".join(JOINTS))]
    """Values of the joints, in design units."""

    def run(self) -> None:
        """Write all eight poses of the joints."""
        design = self.read_design()
        joints = checked_joints(self.joints)
        squares, modes = discriminants(design, joints), forward(design, joints)
        is_shown = self.at == "tool" or any(design.tool.position)
        tool = design.tool.position if is_shown else None
        if self.json:
            listed = _modes_json(modes, tool) if modes.feasible else []
            answer = {"feasible": modes.feasible, "discriminants": squares, "modes": listed}
            output.write_json(answer)
        elif modes.feasible:
            rows = [("joint", *JOINTS), ("units", *output.figures(self.joints))]
            output.write_lines(
                output.heading(design), output.table(rows, "<>>>>>>"), *_mode_lines(modes, tool)
            )
        if not modes.feasible:
            raise NoAnswerError(_failure_message(design, joints, squares))


def _modes_json(modes: ForwardKinematics, tool: Triple | None) -> list[dict[str, object]]:
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


def _mode_lines(modes: ForwardKinematics, tool: Triple | None) -> Iterator[str]:
    angles = yaw_pitch_roll_from_rotation(modes.rotation)
    margin = margins(modes.position, modes.rotation)
    folds = output.folds_in_degrees(modes.position, modes.rotation)
    r, *between = folds[0, :3].tolist()
    first = "  ".join([output.figure(r), *output.degrees(between)])
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
    failures = [
        f"trilateration {index + 1} (tetrahedron {' '.join(TETRAHEDRA[index])}) has "
        f"δ{index + 1}² = {square:.4g}"
        for index, square in enumerate(squares.tolist())
        if square < 0.0
    ]
    return (
        f"the lengths do not close: {' and '.join(failures)}, which must not be negative; "
        f"{_least_change(design, joints)}"
    )


def _least_change(design: Design, joints: FloatArray) -> str:
    """Return the smallest change of a single joint with which the lengths close, in words."""
    moves: list[tuple[float, str]] = []
    for index, intervals in enumerate(feasible_intervals(design, joints)):
        nearest = nearest_feasible(design, joints, index, intervals)
        if nearest is None:
            continue
        value, name = float(joints[index]), JOINTS[index]
        closing = _shortest_text(design, joints, index, nearest)
        moves.append((abs(nearest - value), f"{name} from {value:.10g} to {closing}"))
    if not moves:
        return "no change of a single joint closes them"
    return f"the least change of one joint that closes them is {min(moves)[1]}"


def _shortest_text(design: Design, joints: FloatArray, joint: int, closing: float) -> str:
    """Return a closing value of a joint in the fewest digits with which it still closes."""
    trial = joints.copy()
    for digits in range(6, 17):
        written = f"{closing:.{digits}g}"
        trial[joint] = float(written)
        if forward(design, trial).feasible:
            return written
    return repr(closing)
