"""The clearances of the legs in a pose or over a move, for `explorer interference`."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

from explorer.cli.output import (
    attributes,
    figure,
    figures,
    finite,
    heading,
    indented,
    lengths,
    limits_json,
    limits_lines,
    pose_table,
    radii_line,
    table,
    tool_json,
)
from explorer.legs.clearance import PAIRS
from explorer.measures.snapshot import Snapshot
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose, Triple
from explorer.mechanism.tool_point import tool_position
from explorer.numerics.arrays import BoolArray, FloatArray

if TYPE_CHECKING:
    from explorer.legs.moves import MoveClearance


def pose_lines(snapshot: Snapshot, tool: Triple | None = None) -> Iterator[str]:
    """Yield the clearances in a pose as lines of text."""
    design, legs = snapshot.design, snapshot.clearances
    yield from (heading(design), pose_table(design, snapshot.pose, tool), radii_line(design), "")
    rows = [("legs", "axes apart", "clearance", "mm", "", "closest points", "")]
    for index, pair in enumerate(PAIRS):
        clearance = float(legs.clearance[index])
        first, second = map(_at, legs.points[index].tolist())
        if math.isinf(clearance):
            rows.append((_name(pair), "joined", "", "", "", "share the joint", first))
            continue
        apart = figure(float(legs.distance[index]))
        rows.append(
            (_name(pair), apart, *lengths(design, clearance), _collide(clearance), first, second)
        )
    closest = _closest(design, int(legs.closest), legs.clearance)
    verdict = _exact_verdict(legs.clearance, legs.clearance)
    yield from (table(rows, "<>>><<<"), "", f"{verdict}; closest {closest}")
    yield from limits_lines(snapshot, "the pose is ")


def move_lines(move: MoveClearance, start: Snapshot, end: Snapshot) -> Iterator[str]:
    """Yield the clearances over a move as lines of text, from the snapshots of its ends."""
    design = start.design
    yield heading(design)
    for name, pose in (("from", move.start), ("to", move.end)):
        yield from (name, *indented(pose_table(design, pose, move.tool)))
    yield from (radii_line(design), "")
    there = "b4 there" if move.tool is None else "tool there"
    rows = [("legs", "clearance", "mm", "never below", "at", there, "", "step test")]
    for index, (pair, pose) in enumerate(zip(PAIRS, _poses_of_least(move), strict=True)):
        clearance = float(move.clearance[index])
        if math.isinf(clearance):
            rows.append((_name(pair), "joined", "", "", "", "share a joint", "", "left out"))
            continue
        rows.append(
            (
                _name(pair),
                *lengths(design, clearance),
                figure(float(move.bound[index])),
                f"{100.0 * float(move.share[index]):.1f} %",
                _at(pose.position if move.tool is None else tool_position(pose, move.tool)),
                _collide(clearance),
                "overlap" if move.overlaps[index] else "free",
            )
        )
    exact = _exact_verdict(move.clearance, move.bound)
    closest = _closest(design, move.closest, move.clearance)
    steps = "1 step" if move.steps == 1 else f"{move.steps} steps"
    paper = "free" if move.is_free else f"swept tetrahedra overlap: {_names(move.overlaps)}"
    verdicts = [
        ("exact, with the radii", f"{exact}; closest {closest}"),
        ("the paper's, without", f"{paper}, in {steps}"),
    ]
    yield from (table(rows, "<>>>><<<"), "", table(verdicts, "<<"))
    yield from limits_lines(start, "the start is ")
    yield from limits_lines(end, "the end is ")


def pose_json(snapshot: Snapshot, tool: Triple | None = None) -> dict[str, object]:
    """Return the clearances in a pose as plain values."""
    legs = snapshot.clearances
    return {
        "pairs": [
            {
                "legs": pair,
                "distance": finite(float(legs.distance[index])),
                "clearance": finite(float(legs.clearance[index])),
                "points": legs.points[index],
                "collides": legs.clearance[index] < 0.0,
            }
            for index, pair in enumerate(PAIRS)
        ],
        "closest": PAIRS[int(legs.closest)],
        "is_clear": (legs.clearance > 0.0).all(),
        "radii": snapshot.design.limits.leg_radii,
        **tool_json(snapshot.pose, tool),
        **limits_json(snapshot),
    }


def move_json(move: MoveClearance, start: Snapshot, end: Snapshot) -> dict[str, object]:
    """Return the clearances over a move as plain values, from the snapshots of its ends."""
    place = "position quaternion"
    return {
        "pairs": [
            {
                "legs": pair,
                "clearance": finite(float(move.clearance[index])),
                "bound": finite(float(move.bound[index])),
                "share": move.share[index],
                **attributes(pose, place),
                **tool_json(pose, move.tool),
                "points": move.points[index],
                "overlaps": move.overlaps[index],
            }
            for index, (pair, pose) in enumerate(zip(PAIRS, _poses_of_least(move), strict=True))
        ],
        "closest": PAIRS[move.closest],
        **attributes(move, "is_clear is_free steps tolerance"),
        "radii": start.design.limits.leg_radii,
        "within_limits": not (start.violations or end.violations),
        "start": attributes(start.pose, place)
        | tool_json(start.pose, move.tool)
        | limits_json(start),
        "end": attributes(end.pose, place) | tool_json(end.pose, move.tool) | limits_json(end),
    }


def _poses_of_least(move: MoveClearance) -> list[Pose]:
    """Return the pose of the move at which each pair is closest."""
    from explorer.legs.moves import poses_between

    positions, rotations = poses_between(move.start, move.end, move.share, move.tool)
    return [Pose.of(p, r) for p, r in zip(positions, rotations, strict=True)]


def _collide(clearance: float) -> str:
    return "collide" if clearance < 0.0 else ""


def _exact_verdict(clearance: FloatArray, bound: FloatArray) -> str:
    if (clearance < 0.0).any():
        return f"legs collide: {_names(clearance < 0.0)}"
    if (bound <= 0.0).any():
        return f"legs touch: {_names(bound <= 0.0)}"
    return "the legs are clear"


def _closest(design: Design, pair: int, clearance: FloatArray) -> str:
    least = float(clearance[pair])
    return f"{_name(PAIRS[pair])}, {least:.6g} [{least * design.unit_mm:.6g} mm]"


def _name(legs: tuple[int, int]) -> str:
    return f"{legs[0]}–{legs[1]}"


def _names(chosen: BoolArray) -> str:
    return ", ".join(_name(legs) for legs, is_so in zip(PAIRS, chosen, strict=True) if is_so)


def _at(point: Iterable[float]) -> str:
    return f"({', '.join(figures(point))})"
