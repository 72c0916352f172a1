"""What `explorer path` answers, and how it says that there is no path."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from command_line import CommandLine

import explorer
from explorer.mechanism.pose import rotation_from_yaw_pitch_roll
from explorer.mechanism.tilt_torsion import tilt_torsion_of

COMMAND = ("path",)
PRESET = explorer.PRESETS["paper-optimal"]
HOME = explorer.home_pose(PRESET)


def test_path_json_has_poses_and_trajectory(cli: CommandLine, tmp_path: Path) -> None:
    file = tmp_path / "path.csv"
    words = ["--to", "12", "8", "7", "--radii", "0.2", "--samples", "21", "--speed", "2"]
    found = cli.answer(*words, "--out", file)
    assert found["found"] is True
    assert found["reason"] is None
    assert found["poses"][0]["position"] == list(HOME.position)
    assert found["poses"][-1] == {
        "position": [12.0, 8.0, 7.0],
        "quaternion": list(HOME.quaternion),
        "tilt_torsion": list(tilt_torsion_of(HOME.rotation)),
    }
    course = found["trajectory"]
    assert course["time"][-1] == found["duration"] > 0.0
    assert found["length"] == pytest.approx(float(np.linalg.norm([2.0, 3.0, 2.0])))
    joints = explorer.inverse(
        PRESET, course["position"], explorer.rotation_from_quaternion(course["quaternion"])
    )
    np.testing.assert_allclose(course["joints"], joints, atol=1e-9)
    with file.open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == len(course["time"]) == 21
    assert [float(row["l4"]) for row in rows] == [q[5] for q in course["joints"]]
    assert found["file"] == str(file)


@pytest.mark.parametrize(
    "words",
    [
        ["--from", "9", "6", "8", "--from-yaw-pitch-roll", "-70", "5", "3", "--to", "10", "6", "8"],
        ["--from", "9", "6", "8", "-70", "5", "3", "--to", "10", "6", "8"],
        [
            *("--from", "9", "6", "8", "-70", "5", "3"),
            *("--to", "10", "6", "8", "--to-yaw-pitch-roll", "-70", "5", "3"),
        ],
    ],
)
def test_path_forms_of_a_pose_agree(cli: CommandLine, words: list[str]) -> None:
    found = cli.answer(*words)
    rotation = rotation_from_yaw_pitch_roll((-70.0, 5.0, 3.0))
    for end, place in ((0, [9.0, 6.0, 8.0]), (-1, [10.0, 6.0, 8.0])):
        assert found["poses"][end]["position"] == place
        np.testing.assert_allclose(
            explorer.rotation_from_quaternion(found["poses"][end]["quaternion"]),
            rotation,
            atol=1e-12,
        )


def test_path_quaternion_after_position_is_used(cli: CommandLine) -> None:
    words = [*map(repr, HOME.quaternion)]
    found = cli.answer("--to", "11", "6", "8", *words)
    assert found["poses"][-1] == {
        "position": [11.0, 6.0, 8.0],
        "quaternion": list(HOME.quaternion),
        "tilt_torsion": list(tilt_torsion_of(HOME.rotation)),
    }


def test_path_without_solution_has_status_1_and_reason(
    cli: CommandLine,
) -> None:
    found = cli.answer("--to", "12", "8", "-7", status=1)
    assert found == {"found": False, "reason": "other mode", "poses": []}
    refused = cli.refusal("--to", "12", "8", "-7", status=1)
    assert "mode 1 (− − +)" in refused


@pytest.mark.parametrize(("height", "reason"), [("30", "outside limits"), ("0", "singular")])
def test_path_invalid_end_has_status_2_and_reason(
    cli: CommandLine, height: str, reason: str
) -> None:
    found = cli.answer("--to", "12", "8", height, status=2)
    assert found == {"found": False, "reason": reason, "poses": []}


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--to", "40", "8", "7"], "the goal is outside the limits: "),
        (["--from", "40", "8", "7", "--to", "12", "8", "7"], "the start is outside the limits"),
        (["--to", "12", "8", "0"], "the goal is singular (a1 on the platform plane and"),
        (["--to", "1", "2"], "--to needs a position x y z"),
        ([], "say where the path ends with --to"),
        (["--to", "12", "8", "7", "0", "0", "0", "--to-quaternion", "1", "0", "0", "0"], "already"),
        (["--to", "12", "8", "7", "--seconds", "0"], "--seconds must be a positive number"),
        (["--to", "12", "8", "7", "--samples", "1"], "--samples must lie within"),
        (["--to", "12", "8", "7", "--out", "/nowhere/path.csv"], "there is no folder"),
        (["--form", "12", "8", "7"], "did you mean --from?"),
    ],
)
def test_path_bad_input_is_one_line_and_status_2(
    cli: CommandLine, words: list[str], message: str
) -> None:
    refused = cli.refusal(*words)
    assert message in refused


def test_path_text_has_ends_length_and_margins(
    cli: CommandLine,
) -> None:
    text = cli.text("--to", "12", "8", "7")
    assert "moves       1, each proved to keep limits and clearances" in text
    assert "least |δ|" in text
    assert all(line == line.rstrip() for line in text.splitlines())
