"""`explorer forward`: the eight assembly modes of the joints, or why there is none."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from explorer.cli.options import DesignOptions, JsonOptions
from explorer.cli.output import degrees, figures, heading, table, write_json, write_lines
from explorer.cli.values import numbers
from explorer.errors import NoAnswerError
from explorer.mechanism.design import JOINTS, Design
from explorer.mechanism.feasible_intervals import feasible_intervals, nearest_feasible
from explorer.mechanism.kinematics import checked_joints, discriminants, forward
from explorer.mechanism.margins import TETRAHEDRA, margins, mode_name, signs_of
from explorer.mechanism.pose import quaternion_from_rotation, yaw_pitch_roll_from_rotation
from explorer.numerics.arrays import FloatArray

Joints = tuple[float, float, float, float, float, float]


@dataclass(frozen=True, kw_only=True)
class Forward(JsonOptions, DesignOptions):
    """Compute the eight assembly modes of the joints.

    All eight are real or none is. If none is, the exit status is 1 and the message names the
    failing trilateration and the smallest change of a joint that makes it feasible.
    """

    joints: Annotated[Joints, numbers("--joints", " ".join(JOINTS))]
    """Values of the joints, in design units."""

    def run(self) -> None:
        """Write all eight poses of the joints.

        Raises:
            InputError: a design or joints that cannot be used.
            NoAnswerError: the lengths do not close.
        """
        design = self.load()
        joints = checked_joints(design, self.joints)
        squares = discriminants(design, joints)
        solution = forward(design, joints)
        feasible = bool(solution.feasible)
        if self.json:
            write_json(
                {
                    "feasible": feasible,
                    "discriminants": squares.tolist(),
                    "modes": _modes(solution.position, solution.rotation) if feasible else [],
                }
            )
        elif feasible:
            write_lines(
                heading(design),
                table(
                    [("joint", *JOINTS), ("units", *figures(self.joints))],
                    "<>>>>>>",
                ),
                "",
                _mode_table(solution.position, solution.rotation),
            )
        if not feasible:
            raise NoAnswerError(_why_not(design, joints, squares))


def _modes(position: FloatArray, rotation: FloatArray) -> list[dict[str, object]]:
    quaternion = quaternion_from_rotation(rotation)
    margin = margins(position, rotation)
    return [
        {
            "mode": mode,
            "signs": list(signs_of(mode)),
            "position": position[mode].tolist(),
            "quaternion": quaternion[mode].tolist(),
            "margins": margin[mode].tolist(),
        }
        for mode in range(len(position))
    ]


def _mode_table(position: FloatArray, rotation: FloatArray) -> str:
    angles = yaw_pitch_roll_from_rotation(rotation)
    margin = margins(position, rotation)
    rows = [("mode", "signs", *"xyz", "yaw", "pitch", "roll", "δ1", "δ2", "δ3")]
    rows += [
        (
            str(mode),
            mode_name(mode),
            *figures(position[mode].tolist()),
            *degrees(angles[mode].tolist()),
            *figures(margin[mode].tolist()),
        )
        for mode in range(len(position))
    ]
    return table(rows, "<<" + ">" * 9)


def _why_not(design: Design, joints: FloatArray, squares: FloatArray) -> str:
    failures = [
        f"trilateration {index + 1} (tetrahedron {' '.join(TETRAHEDRA[index])}) has "
        f"δ{index + 1}² = {square:.4g}"
        for index, square in enumerate(squares.tolist())
        if square < 0.0
    ]
    return (
        f"the lengths do not close: {' and '.join(failures)}, which must not be negative; "
        f"{_way_out(design, joints)}"
    )


def _way_out(design: Design, joints: FloatArray) -> str:
    """Return the smallest change of a single joint with which the lengths close, in words."""
    moves: list[tuple[float, str]] = []
    for index, intervals in enumerate(feasible_intervals(design, joints)):
        nearest = nearest_feasible(design, joints, index, intervals)
        if nearest is None:
            continue
        value, name = float(joints[index]), JOINTS[index]
        closing = _in_few_digits(design, joints, index, nearest)
        moves.append((abs(nearest - value), f"{name} from {value:.10g} to {closing}"))
    if not moves:
        return "no change of a single joint closes them"
    return f"the least change of one joint that closes them is {min(moves)[1]}"


def _in_few_digits(design: Design, joints: FloatArray, joint: int, closing: float) -> str:
    """Return a closing value of a joint in the fewest digits with which it still closes."""
    trial = joints.copy()
    for digits in range(6, 17):
        written = f"{closing:.{digits}g}"
        trial[joint] = float(written)
        if forward(design, trial).feasible:
            return written
    return repr(closing)
