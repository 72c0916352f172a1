"""What `explorer path` answers, and how it says that there is no path."""

from __future__ import annotations

import csv
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from command_line import CommandLine
from machines import PRESS

import explorer
from explorer.mechanism.pose import rotation_from_yaw_pitch_roll
from explorer.mechanism.tilt_torsion import tilt_torsion_of
from explorer.paths.loads import path_loads
from explorer.statics.reactions import LIMITED

COMMAND = ("path",)
PRESET = explorer.PRESETS["paper-optimal"]
HOME = PRESET.home_pose


def test_path_json_has_poses_and_trajectory(cli: CommandLine, tmp_path: Path) -> None:
    file = tmp_path / "path.csv"
    words = ["--to", "12", "8", "7", "--radii", "0.2", "--samples", "21", "--speed", "2"]
    found = cli.answer(*words, "--out", file)
    assert found["found"] is True
    assert found["reason"] is None
    assert found["poses"][0]["position"] == list(HOME.position)
    r, *angles = explorer.to_folds([12.0, 8.0, 7.0], HOME.rotation).tolist()
    assert found["poses"][-1] == {
        "position": [12.0, 8.0, 7.0],
        "quaternion": list(HOME.quaternion),
        "tilt_torsion": list(tilt_torsion_of(HOME.rotation)),
        "folds": [r, *np.degrees(angles).tolist()],
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
    assert [float(row["l4 [10 mm]"]) for row in rows] == [q[5] for q in course["joints"]]
    assert found["file"] == str(file)
    text = cli.text(*words[:4])
    assert "moves       1, each proved to keep limits and clearances" in text
    assert "1 line tried" in text
    assert "least |δ|" in text


def test_path_with_an_acceleration_starts_and_ends_at_rest(cli: CommandLine) -> None:
    words = ["--to", "12", "8", "7", "--speed", "2", "--samples", "401"]
    at_once, found = cli.answer(*words), cli.answer(*words, "--acceleration", "8")
    # The way up to the speed and down from it takes speed / acceleration longer.
    assert found["duration"] == pytest.approx(at_once["duration"] + 0.25, rel=1e-3)
    speeds = np.abs(np.diff(found["trajectory"]["joints"], axis=0)).max(axis=1) / (
        found["duration"] / 400.0
    )
    assert speeds.max() == pytest.approx(2.0, rel=1e-3)
    assert speeds[[0, -1]].max() < 0.02


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


def test_path_to_where_the_platform_is_is_refused(cli: CommandLine) -> None:
    here = [f"{x:g}" for x in HOME.position]
    assert "needs two poses that differ" in cli.refusal("--to", *here)
    assert "needs two poses that differ" in cli.refusal("--to", *here, "--acceleration", "9")


def test_path_without_solution_has_status_1_and_reason(cli: CommandLine) -> None:
    found = cli.answer("--to", "12", "8", "-7", status=1)
    assert found == {"found": False, "reason": "other mode", "poses": []}
    refused = cli.refusal("--to", "12", "8", "-7", status=1)
    assert "mode 1 (− − +)" in refused


# Both ends hold 40 N downwards; the straight move between them, low over the base, does not.
LOW = (
    *("--from", "2.4", "0.2", "1.7", "-53", "-3", "2"),
    *("--to", "18.5", "9.2", "2.1", "-82", "-5", "1"),
)
DOWN = ("--load", "0", "0", "-40")
DESIGN = ("--design", PRESS)


@pytest.mark.skipif(find_spec("ompl") is None, reason="OMPL is not installed")
def test_path_with_load_holds_it_and_tells_the_largest_share(cli: CommandLine) -> None:
    free = cli.answer(*DESIGN, *LOW)
    assert len(free["poses"]) == 2
    assert "largest_share" not in free
    found = cli.answer(*DESIGN, *LOW, *DOWN, "--seconds", "20")
    load = [0.0, 0.0, -40.0, 0.0, 0.0, 0.0]
    for answer, holds in ((free, False), (found, True)):
        poses = [
            explorer.Pose(tuple(each["position"]), tuple(each["quaternion"]))
            for each in answer["poses"]
        ]
        largest = path_loads(PRESS, poses, load)
        assert (largest.utilisation <= 1.0 + 1e-4) == holds
    assert found["largest_share"] == pytest.approx(largest.utilisation, abs=1e-6)
    assert found["largest_share_bound"] == pytest.approx(largest.bound, rel=0.02)
    assert largest.part is not None
    assert found["largest_share_part"] == LIMITED[largest.part]
    assert 0.0 <= found["largest_share_at"] <= len(found["poses"]) - 1
    # A straight path that holds it tells the same in words.
    up = ("--to", "11", "5", "9", "--load", "0", "0", "-10", "0", "0", "2")
    straight = cli.answer(*DESIGN, *up)
    assert 0.0 < straight["largest_share"] < 1.0
    text = cli.text(*DESIGN, *up)
    share = f"{100.0 * straight['largest_share']:.1f}"
    assert f"load        held, with {share} % of a limit at " in text
    bound = f"{100.0 * straight['largest_share_bound']:.1f}"
    assert f" samples and {bound} % at most between them: " in text
