"""The clearances of the legs in a pose or over a move, for `explorer interference`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from explorer.cli.output import figure, figures, heading, pose_table, table
from explorer.legs.clearance import PAIRS
from explorer.measures.snapshot import Snapshot
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose, Triple
from explorer.numerics.arrays import BoolArray, FloatArray

if TYPE_CHECKING:
    from explorer.legs.moves import MoveClearance


def _poses_of_least(found: MoveClearance) -> list[Pose]:
    """Return the pose of the move at which each pair is closest."""
    from explorer.legs.moves import poses_between

    positions, rotations = poses_between(found.start, found.end, found.share)
    return [Pose.of(p, r) for p, r in zip(positions, rotations, strict=True)]


def pose_lines(snapshot: Snapshot) -> list[str]:
    """Return the clearances in a pose as lines of text."""
    return [
        heading(snapshot.design),
        pose_table(snapshot.design, snapshot.pose),
        _radii_line(snapshot.design),
        "",
        _pose_pairs(snapshot),
        "",
        *_pose_verdict(snapshot),
        *_limits_verdict("the pose", snapshot),
    ]


def move_lines(move: MoveClearance, start: Snapshot, end: Snapshot) -> list[str]:
    """Return the clearances over a move as lines of text, from the snapshots of its ends."""
    design = start.design
    return [
        heading(design),
        "from",
        _indented(pose_table(design, move.start)),
        "to",
        _indented(pose_table(design, move.end)),
        _radii_line(design),
        "",
        _move_pairs(design, move, _poses_of_least(move)),
        "",
        *_move_verdict(design, move),
        *_limits_verdict("the start", start),
        *_limits_verdict("the end", end),
    ]


def pose_json(snapshot: Snapshot) -> dict[str, object]:
    """Return the clearances in a pose as plain values."""
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


def move_json(move: MoveClearance, start: Snapshot, end: Snapshot) -> dict[str, object]:
    """Return the clearances over a move as plain values, from the snapshots of its ends."""
    nearest = _poses_of_least(move)
    return {
        "pairs": [
            {
                "legs": list(legs),
                "clearance": _finite(float(move.clearance[index])),
                "bound": _finite(float(move.bound[index])),
                "share": float(move.share[index]),
                "position": list(nearest[index].position),
                "quaternion": list(nearest[index].quaternion),
                "points": move.points[index].tolist(),
                "overlaps": bool(move.overlaps[index]),
            }
            for index, legs in enumerate(PAIRS)
        ],
        "closest": list(PAIRS[move.closest]),
        "is_clear": move.is_clear,
        "is_free": move.is_free,
        "steps": move.steps,
        "tolerance": move.tolerance,
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
