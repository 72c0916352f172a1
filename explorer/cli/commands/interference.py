"""`explorer interference`: how far the legs keep from each other, in a pose or over a move."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import numpy as np
import tyro

from explorer.cli.options import DesignOptions, JsonOptions, PoseOptions, RadiiOptions
from explorer.cli.output import figure, figures, heading, pose_table, table, write_json, write_lines
from explorer.cli.values import numbers, whole_number
from explorer.errors import InputError
from explorer.legs.clearance import PAIRS
from explorer.measures.snapshot import Snapshot, evaluate
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose, Quadruple, Triple, rotation_from_yaw_pitch_roll
from explorer.numerics.arrays import BoolArray, FloatArray

if TYPE_CHECKING:
    from explorer.legs.moves import MoveClearance

MOST_STEPS = 100_000

_OPTIONAL = tyro.conf.arg(help_behavior_hint="(optional)")


@dataclass(frozen=True, kw_only=True)
class Interference(JsonOptions, RadiiOptions, PoseOptions, DesignOptions):
    """Tell how far the legs keep from each other, in a pose or over a move.

    Legs are capsules about their axes; the clearance of two is the distance of the axes less
    both radii, and below zero they collide. A straight move is judged twice: exactly, and by the
    paper's test of swept tetrahedra, which knows no radii and depends on the number of steps.
    """

    to: Annotated[Triple | None, numbers("--to", "x y z"), _OPTIONAL] = None
    """Move b4 straight to this position, in design units."""

    to_quaternion: Annotated[Quadruple | None, numbers("--to-quaternion", "w x y z"), _OPTIONAL] = (
        None
    )
    """Turn the platform to this orientation on the move, the shorter way."""

    to_yaw_pitch_roll: Annotated[
        Triple | None,
        numbers("--to-yaw-pitch-roll", "yaw pitch roll"),
        tyro.conf.arg(help_behavior_hint="(instead of --to-quaternion)"),
    ] = None
    """Turn the platform to this orientation on the move, in degrees."""

    steps: Annotated[
        int | None,
        whole_number("--steps", 1, MOST_STEPS),
        tyro.conf.arg(help_behavior_hint="(default: none longer than the node step)"),
    ] = None
    """Into how many steps the paper's test cuts the move."""

    def run(self) -> None:
        """Write the clearances of the pose or of the move.

        Raises:
            InputError: a design, pose, move or number that cannot be used.
        """
        design = self.with_radii(self.load())
        start = self.pose(design)
        end = self._end(start)
        if end is None:
            if self.steps is not None:
                raise InputError(
                    "--steps cuts a move; say where it goes with --to, --to-quaternion or "
                    "--to-yaw-pitch-roll"
                )
            self._write_pose(evaluate(design, start))
            return
        from explorer.legs.moves import move_clearance

        steps = _steps_of(design, start, end) if self.steps is None else self.steps
        self._write_move(design, move_clearance(design, start, end, steps=steps))

    def _end(self, start: Pose) -> Pose | None:
        """Return where the move goes, None if there is none."""
        if self.to_quaternion is not None and self.to_yaw_pitch_roll is not None:
            raise InputError("give one of --to-quaternion and --to-yaw-pitch-roll, not both")
        position = start.position if self.to is None else self.to
        if self.to_yaw_pitch_roll is not None:
            return Pose.of(position, rotation_from_yaw_pitch_roll(self.to_yaw_pitch_roll))
        if self.to_quaternion is not None:
            return Pose(position, self.to_quaternion)
        return None if self.to is None else Pose(position, start.quaternion)

    def _write_pose(self, snapshot: Snapshot) -> None:
        if self.json:
            write_json(_pose_json(snapshot))
            return
        write_lines(
            heading(snapshot.design),
            pose_table(snapshot.design, snapshot.pose),
            _radii_line(snapshot.design),
            "",
            _pose_pairs(snapshot),
            "",
            *_pose_verdict(snapshot),
            *_limits_verdict("the pose", snapshot),
        )

    def _write_move(self, design: Design, found: MoveClearance) -> None:
        start, end = evaluate(design, found.start), evaluate(design, found.end)
        nearest = _poses_of_least(found)
        if self.json:
            write_json(_move_json(found, nearest, start, end))
            return
        write_lines(
            heading(design),
            "from",
            _indented(pose_table(design, found.start)),
            "to",
            _indented(pose_table(design, found.end)),
            _radii_line(design),
            "",
            _move_pairs(design, found, nearest),
            "",
            *_move_verdict(design, found),
            *_limits_verdict("the start", start),
            *_limits_verdict("the end", end),
        )


def _steps_of(design: Design, start: Pose, end: Pose) -> int:
    """Return how many steps a move needs so that no leg's end moves farther than a node step.

    Raises:
        InputError: more than there may be.
    """
    from explorer.workspace.slices.volume import STEPS_IN_REACH

    step = design.node_step or design.reach / STEPS_IN_REACH
    turn = math.acos(
        min(1.0, max(-1.0, 0.5 * (float(np.trace(end.rotation @ start.rotation.T)) - 1.0)))
    )
    arm = max(math.hypot(*design.b1), abs(design.b2), abs(design.b3))
    count = math.ceil((math.dist(start.position, end.position) + turn * arm) / step * (1.0 - 1e-9))
    if count > MOST_STEPS:
        raise InputError(
            f"in steps of {step:g}, the node step, this move takes {count:.3g}; at most "
            f"{MOST_STEPS} are tested: give their number with --steps"
        )
    return max(1, count)


def _poses_of_least(found: MoveClearance) -> list[Pose]:
    """Return where on the move each pair is closest."""
    from explorer.legs.moves import poses_between

    positions, rotations = poses_between(found.start, found.end, found.share)
    return [Pose.of(p, r) for p, r in zip(positions, rotations, strict=True)]


def _pose_json(snapshot: Snapshot) -> dict[str, object]:
    found = snapshot.clearances
    return {
        "pairs": [
            {
                "legs": list(legs),
                "distance": _finite(distance),
                "clearance": _finite(clearance),
                "points": points,
                "collides": clearance < 0.0,
            }
            for legs, distance, clearance, points in zip(
                PAIRS,
                found.distance.tolist(),
                found.clearance.tolist(),
                found.points.tolist(),
                strict=True,
            )
        ],
        "closest": list(PAIRS[int(found.closest)]),
        "is_clear": bool((found.clearance > 0.0).all()),
        "radii": list(snapshot.design.limits.leg_radii),
        **_limits_json(snapshot),
    }


def _move_json(
    found: MoveClearance, nearest: list[Pose], start: Snapshot, end: Snapshot
) -> dict[str, object]:
    return {
        "pairs": [
            {
                "legs": list(legs),
                "clearance": _finite(float(found.clearance[index])),
                "bound": _finite(float(found.bound[index])),
                "share": float(found.share[index]),
                "position": list(nearest[index].position),
                "quaternion": list(nearest[index].quaternion),
                "points": found.points[index].tolist(),
                "overlaps": bool(found.overlaps[index]),
            }
            for index, legs in enumerate(PAIRS)
        ],
        "closest": list(PAIRS[found.closest]),
        "is_clear": found.is_clear,
        "is_free": found.is_free,
        "steps": found.steps,
        "tolerance": found.tolerance,
        "radii": list(start.design.limits.leg_radii),
        "within_limits": not (start.violations or end.violations),
        "start": _pose_of(start) | _limits_json(start),
        "end": _pose_of(end) | _limits_json(end),
    }


def _pose_of(snapshot: Snapshot) -> dict[str, object]:
    pose = snapshot.pose
    return {"position": list(pose.position), "quaternion": list(pose.quaternion)}


def _limits_json(snapshot: Snapshot) -> dict[str, object]:
    return {
        "within_limits": not snapshot.violations,
        "violations": [str(violation) for violation in snapshot.violations],
    }


def _finite(value: float) -> float | None:
    """Return the value, None for the infinite one of a pair that shares a joint."""
    return None if math.isinf(value) else value


def _radii_line(design: Design) -> str:
    radii = "  ".join(f"{radius:.6g}" for radius in design.limits.leg_radii)
    return f"radii of the legs  {radii}"


def _pose_pairs(snapshot: Snapshot) -> str:
    found, unit = snapshot.clearances, snapshot.design.unit_mm
    rows = [("legs", "axes apart", "clearance", "mm", "", "closest points", "")]
    for index, legs in enumerate(PAIRS):
        clearance = float(found.clearance[index])
        first, second = found.points[index].tolist()
        if math.isinf(clearance):
            rows.append((_name(legs), "joined", "", "", "", "share the joint", _at(first)))
            continue
        rows.append(
            (
                _name(legs),
                figure(float(found.distance[index])),
                figure(clearance),
                figure(clearance * unit),
                "collide" if clearance < 0.0 else "",
                _at(first),
                _at(second),
            )
        )
    return table(rows, "<>>><<<")


def _move_pairs(design: Design, found: MoveClearance, nearest: list[Pose]) -> str:
    rows = [("legs", "clearance", "mm", "never below", "at", "b4 there", "", "step test")]
    for index, legs in enumerate(PAIRS):
        clearance = float(found.clearance[index])
        if math.isinf(clearance):
            rows.append((_name(legs), "joined", "", "", "", "share a joint", "", "left out"))
            continue
        rows.append(
            (
                _name(legs),
                figure(clearance),
                figure(clearance * design.unit_mm),
                figure(float(found.bound[index])),
                f"{100.0 * float(found.share[index]):.1f} %",
                _at(nearest[index].position),
                "collide" if clearance < 0.0 else "",
                "overlap" if found.overlaps[index] else "free",
            )
        )
    return table(rows, "<>>>><<<")


def _pose_verdict(snapshot: Snapshot) -> list[str]:
    found = snapshot.clearances
    closest = int(found.closest)
    verdict = _exact_verdict(found.clearance, found.clearance)
    return [f"{verdict}; closest {_closest(snapshot.design, closest, found.clearance[closest])}"]


def _move_verdict(design: Design, found: MoveClearance) -> list[str]:
    exact = _exact_verdict(found.clearance, found.bound)
    steps = "1 step" if found.steps == 1 else f"{found.steps} steps"
    paper = "free" if found.is_free else f"swept tetrahedra overlap: {_names(found.overlaps)}"
    closest = _closest(design, found.closest, float(found.clearance[found.closest]))
    return [
        table(
            [
                ("exact, with the radii", f"{exact}; closest {closest}"),
                ("the paper's, without", f"{paper}, in {steps}"),
            ],
            "<<",
        )
    ]


def _exact_verdict(clearance: FloatArray, bound: FloatArray) -> str:
    if (clearance < 0.0).any():
        return f"legs collide: {_names(clearance < 0.0)}"
    if (bound <= 0.0).any():
        return f"legs touch: {_names(bound <= 0.0)}"
    return "the legs are clear"


def _limits_verdict(what: str, snapshot: Snapshot) -> list[str]:
    if not snapshot.violations:
        return [f"{what} is within the limits"]
    return [f"{what} is outside the limits:", *(f"  {each}" for each in snapshot.violations)]


def _closest(design: Design, pair: int, clearance: float) -> str:
    return f"{_name(PAIRS[pair])}, {clearance:.6g} [{clearance * design.unit_mm:.6g} mm]"


def _name(legs: tuple[int, int]) -> str:
    return f"{legs[0]}–{legs[1]}"


def _names(chosen: BoolArray) -> str:
    return ", ".join(_name(legs) for legs, is_so in zip(PAIRS, chosen, strict=True) if is_so)


def _at(point: Triple | list[float]) -> str:
    return f"({', '.join(figures(point))})"


def _indented(text: str) -> str:
    return "\n".join(f"  {line}" for line in text.splitlines())
