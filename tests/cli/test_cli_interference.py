"""`explorer interference` answers what the package computes, and refuses what it cannot."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from command_line import CommandLine

import explorer
from explorer.legs.clearance import PAIRS, leg_axes
from explorer.legs.moves import move_clearance, poses_between
from explorer.mechanism.configuration import Configuration

COMMAND = ("interference",)
OPTIMAL = explorer.PRESETS["paper-optimal"]
HOME = OPTIMAL.home_pose
POSITION = (8.0, -2.5, 11.0)
ANGLES = (-60.0, 12.5, -7.0)
POSE = ["--position", "8", "-2.5", "1.1e1", "--yaw-pitch-roll", "-60", "12.5", "-7"]
END = explorer.Pose.of_yaw_pitch_roll((14.0, -2.0, 6.0), (-20.0, 0.0, 15.0))
MOVE = ["--to", "14", "-2", "6", "--to-yaw-pitch-roll", "-20", "0", "15"]
# Its legs 2 and 4 share the joint b4.
JOINED = explorer.Design(a3=(10, 4), b1=(4, -1), b2=0.0, b3=2.0)
RADII = (0.1, 0.2, 0.6, 0.3)


def column(found: dict[str, Any], key: str) -> list[Any]:
    return [pair[key] for pair in found["pairs"]]


def with_radii(radii: tuple[float, float, float, float]) -> explorer.Design:
    return OPTIMAL.with_limits(leg_radii=radii)


def test_interference_pose_has_clearances_of_pairs(cli: CommandLine) -> None:
    found = cli.answer(*POSE, "--radii", *map(str, RADII))
    expected = explorer.evaluate(
        with_radii(RADII), explorer.Pose.of_yaw_pitch_roll(POSITION, ANGLES)
    )
    legs = expected.clearances
    assert set(found) == {*("pairs", "closest", "is_clear", "radii", "within_limits", "violations")}
    assert column(found, "legs") == [list(pair) for pair in PAIRS]
    assert column(found, "distance") == legs.distance.tolist()
    assert column(found, "clearance") == legs.clearance.tolist()
    assert column(found, "points") == legs.points.tolist()
    assert column(found, "collides") == (legs.clearance < 0.0).tolist()
    assert found["is_clear"] is not any(column(found, "collides"))
    assert found["closest"] == list(PAIRS[int(legs.clearance.argmin())])
    assert found["radii"] == list(RADII)
    assert found["within_limits"] is (not expected.violations)


def test_interference_move_has_exact_and_swept_tests(cli: CommandLine) -> None:
    found = cli.answer(*MOVE, "--steps", "3", "--radii", *map(str, RADII))
    expected = move_clearance(with_radii(RADII), HOME, END, steps=3)
    for key in ("clearance", "bound", "share", "points", "overlaps"):
        np.testing.assert_allclose(column(found, key), getattr(expected, key), atol=1e-12)
    assert found["closest"] == list(PAIRS[expected.closest])
    assert (found["is_clear"], found["is_free"]) == (expected.is_clear, expected.is_free)
    assert (found["steps"], found["tolerance"]) == (3, expected.tolerance)
    ends = [explorer.evaluate(with_radii(RADII), pose).violations for pose in (HOME, END)]
    assert found["within_limits"] is not any(ends)
    assert found["start"]["position"] == list(HOME.position)
    assert found["end"]["position"] == list(END.position)


@pytest.mark.parametrize("words", [MOVE, MOVE[:4], ["--to-quaternion", "1", "0.5", "-0.2", "0"]])
def test_interference_default_steps_are_within_the_node_step(
    cli: CommandLine, words: list[str]
) -> None:
    design = OPTIMAL
    found = cli.answer(*words)
    start, end = (
        explorer.Pose(tuple(found[key]["position"]), tuple(found[key]["quaternion"]))
        for key in ("start", "end")
    )
    step = design.node_step or design.reach / 15.0

    def farthest(steps: int) -> float:
        shares = np.linspace(0.0, 1.0, steps + 1)
        axes = leg_axes(Configuration(design, *poses_between(start, end, shares)))
        return float(np.linalg.norm(np.diff(axes, axis=0), axis=-1).max())

    assert farthest(found["steps"]) <= step * (1.0 + 1e-9)
    if words == MOVE[:4]:
        # A move without a turn has no more steps than it needs.
        assert farthest(found["steps"] - 1) > step


def test_interference_joined_legs_are_null_and_in_words(cli: CommandLine) -> None:
    index = PAIRS.index((2, 4))
    pair = cli.answer("--design", JOINED)["pairs"][index]
    assert pair["distance"] is pair["clearance"] is None
    assert pair["collides"] is False
    moved = cli.answer("--design", JOINED, *MOVE)["pairs"][index]
    assert moved["clearance"] is moved["bound"] is None
    assert moved["overlaps"] is False
    for words in ([], MOVE):
        (row,) = [
            line
            for line in cli.text("--design", JOINED, *words).splitlines()
            if line.startswith("2–4")
        ]
        assert "joined" in row
        assert "inf" not in row


def test_interference_verdict_separates_clear_touching_and_colliding(cli: CommandLine) -> None:
    assert "Legs are clear: Least clearance: legs 2–3" in cli.text()
    assert "Legs 2–3 collide: Least clearance: legs 2–3" in cli.text("--radii", "0.4")
    # With the two lines perpendicular both carriages stand in one place.
    assert "Legs 2–3 touch: Least clearance: legs 2–3" in cli.text(
        "--quaternion", "1", "0", "0", "-1"
    )
