"""What the commands answer is what the package computes, as JSON and as text."""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np
import pytest
from command_line import CommandLine

import explorer
from explorer.mechanism.feasible_intervals import feasible_intervals
from explorer.mechanism.tilt_torsion import tilt_torsion_of

POSITION = (8.0, -2.5, 1.1e1)
ANGLES = (-60.0, 12.5, -7.0)
POSE = [
    *("--position", "8", "-2.5", "1.1e1"),
    *("--yaw-pitch-roll", "-60", "12.5", "-7"),
]
PRESET = explorer.PRESETS["paper-optimal"]


def snapshot() -> explorer.Snapshot:
    return explorer.evaluate(PRESET, explorer.Pose.of_yaw_pitch_roll(POSITION, ANGLES))


def test_inverse_has_joints_in_order_and_text_their_millimetres(cli: CommandLine) -> None:
    found = cli.answer("inverse", *POSE)
    expected = snapshot()
    assert set(found) == {"joints", "within_limits", "violations"}
    assert found["joints"] == expected.joints.tolist()
    assert found["violations"] == [str(each) for each in expected.violations]
    assert found["within_limits"] is (not expected.violations)
    lines = cli.text("inverse", *POSE).splitlines()
    for name, value in zip(explorer.JOINTS, expected.joints.tolist(), strict=True):
        (row,) = [line.split() for line in lines if line.startswith(f"{name} ")]
        assert float(row[1]) == pytest.approx(value, rel=1e-5)
        assert float(row[2]) == pytest.approx(value * PRESET.unit_mm, rel=1e-5)
    outside = cli.answer("inverse", "--position", "30", "5", "9")
    assert outside["within_limits"] is False
    assert any("box x" in each for each in outside["violations"])


def test_inverse_swapped_carriages_names_their_order(cli: CommandLine, tmp_path: Path) -> None:
    other = ["--position", "10", "5", "9", "--yaw-pitch-roll", "-106.9", "0", "0"]
    found = cli.answer("inverse", *other)
    assert found["within_limits"] is False
    (violation,) = found["violations"]
    assert violation.startswith("carriage order: d3 − d1 = −0.66")
    limits = msgspec.structs.replace(PRESET.limits, carriage_order="any")
    plain = msgspec.structs.replace(PRESET, limits=limits)
    file = tmp_path / "plain.json"
    file.write_bytes(explorer.encode_design(plain))
    assert cli.answer("inverse", *other, "--design", file)["within_limits"] is True


def test_singularity_json_has_the_snapshot(cli: CommandLine) -> None:
    found = cli.answer("singularity", *POSE)
    expected = snapshot()
    assert found == {
        "margins": expected.margins.tolist(),
        "volumes": expected.volumes.tolist(),
        "determinant": expected.determinant,
        "inverse_condition": expected.inverse_condition,
        "smallest_singular_value": expected.smallest_singular_value,
        "stratum": list(expected.stratum),
        "stratum_dimension": expected.stratum_dimension,
        "mode": expected.mode,
        "signs": list(expected.signs),
        "proximity": expected.proximity,
        "incidences": [],
        "nearest": [
            {
                "incidence": index + 1,
                "distance": expected.nearest[index].distance,
                "position": list(expected.nearest[index].pose.position),
                "quaternion": list(expected.nearest[index].pose.quaternion),
                "tilt_torsion": list(tilt_torsion_of(expected.nearest[index].pose.rotation)),
            }
            for index in range(3)
        ],
    }


def test_singularity_singular_pose_has_status_0(cli: CommandLine) -> None:
    found = cli.answer("singularity", "--position", "0", "0", "0")
    assert found["determinant"] == 0.0
    assert found["stratum_dimension"] < 5
    assert found["incidences"] == [1, 2, 3]
    assert [each["distance"] for each in found["nearest"]] == [0.0, 0.0, 0.0]
    assert all(each["position"] == [0.0, 0.0, 0.0] for each in found["nearest"])


def test_singularity_singular_pose_names_its_incidence(cli: CommandLine) -> None:
    argv = ["singularity", "--position", "10", "5", "0", "--yaw-pitch-roll", "-70", "20", "30"]
    text = cli.text(*argv)
    (row,) = [line for line in text.splitlines() if line.startswith("singular ")]
    assert row.split(maxsplit=1)[1] == "b4 on the base plane"
    assert "stratum            4 3 1 2, dimension 5: b4 on the base plane" in text
    (row,) = [line for line in text.splitlines() if line.startswith("δ3 = 0")]
    assert [float(word) for word in row.split()[3:7]] == [0.0, 0.0, 10.0, 5.0]


def test_forward_joints_of_inverse_give_the_pose_in_its_mode(cli: CommandLine) -> None:
    expected = snapshot()
    argv = ["forward", "--joints", *map(repr, expected.joints.tolist())]
    found = cli.answer(*argv)
    assert set(found) == {"feasible", "discriminants", "modes"}
    assert found["feasible"] is True
    np.testing.assert_allclose(found["discriminants"], expected.margins**2, rtol=1e-9)
    assert [mode["mode"] for mode in found["modes"]] == list(range(8))
    for mode in found["modes"]:
        rotation = explorer.rotation_from_quaternion(mode["quaternion"])
        margins = explorer.margins(mode["position"], rotation)
        np.testing.assert_allclose(mode["margins"], margins, atol=1e-12)
        assert np.sign(mode["margins"]).tolist() == mode["signs"]
    mode = found["modes"][expected.mode]
    assert set(mode) == {"mode", "signs", "position", "quaternion", "tilt_torsion", "margins"}
    np.testing.assert_allclose(mode["position"], POSITION, rtol=1e-9)
    rotation = explorer.rotation_from_quaternion(mode["quaternion"])
    np.testing.assert_allclose(rotation, expected.rotation, atol=1e-9)
    rows = [line.split() for line in cli.text(*argv).splitlines()[-8:]]
    assert [row[0] for row in rows] == list("01234567")
    assert [float(value) for value in rows[expected.mode][4:7]] == pytest.approx(POSITION)


def test_forward_infeasible_joints_have_status_1(
    cli: CommandLine,
) -> None:
    joints = snapshot().joints.copy()
    joints[0] = 0.5
    found = cli.answer("forward", "--joints", *map(repr, joints.tolist()), status=1)
    assert found["feasible"] is False
    assert found["modes"] == []
    assert found["discriminants"] == explorer.discriminants(PRESET, joints).tolist()
    assert found["discriminants"][0] < 0.0


def test_forward_infeasible_joints_suggested_value_is_feasible(cli: CommandLine) -> None:
    for joint in range(6):
        joints = snapshot().joints.copy()
        joints[joint] = feasible_intervals(PRESET, joints)[joint][-1][1] + 0.25
        refused = cli.refusal("forward", "--joints", *map(repr, joints.tolist()), status=1)
        assert "tetrahedron" in refused
        name, *_, closing = refused.strip().rpartition(" is ")[2].split()
        joints[explorer.JOINTS.index(name)] = float(closing)
        assert explorer.forward(PRESET, joints).feasible


def test_forward_infeasible_joints_name_the_tetrahedron(
    cli: CommandLine,
) -> None:
    joints = snapshot().joints.copy()
    joints[5] = 60.0
    squares = explorer.discriminants(PRESET, joints)
    assert [square < 0 for square in squares.tolist()] == [False, False, True]
    message = cli.refusal("forward", "--joints", *map(repr, joints.tolist()), status=1)
    assert message.startswith("explorer: ")
    assert "trilateration 3 (tetrahedron b4 a1 a2 a3)" in message
    assert f"{squares[2]:.4g}" in message
    assert "l4 from 60 to " in message


def test_pose_options_are_completed_from_the_home_pose(cli: CommandLine) -> None:
    home = explorer.home_pose(PRESET)
    rotation = explorer.rotation_from_yaw_pitch_roll(ANGLES)
    # Of any length, and -q is the same rotation as q.
    quaternion = (-3.0 * explorer.quaternion_from_rotation(rotation)).tolist()
    for argv, *pose in (
        ([], home.position, home.rotation),
        (POSE[:4], POSITION, home.rotation),
        (POSE[4:], home.position, rotation),
        ([*POSE[:4], "--quaternion", *map(repr, quaternion)], POSITION, rotation),
    ):
        expected = explorer.inverse(PRESET, *pose)
        np.testing.assert_allclose(cli.answer("inverse", *argv)["joints"], expected, rtol=1e-12)


def test_design_option_file_equals_its_preset(cli: CommandLine, tmp_path: Path) -> None:
    file = tmp_path / "my design.json"
    file.write_bytes(explorer.encode_design(explorer.PRESETS["paper-initial"]))
    by_file = cli.answer("inverse", "--design", file, *POSE)
    assert by_file == cli.answer("inverse", "--design", "paper-initial", *POSE)
    assert by_file != cli.answer("inverse", *POSE)


def test_answers_are_free_of_messages_of_libraries(
    cli: CommandLine,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    def chatty(design: object, pose: explorer.Pose, **options: object) -> None:
        print("(a library) did this")
        assert pose.position == POSITION
        assert options == {
            "view": "top",
            "out": out,
            "size": (640, 480),
            "panels": True,
            "handle": handle,
        }

    out = tmp_path / "shot.png"
    monkeypatch.setattr("explorer.app.screenshot.take", chatty)
    words = ["--view", "top", "--out", out, "--size", "640x480", "--panels"]
    argv, handle = ["screenshot", *POSE, *words], False
    assert cli.text(*argv) == f"{out}\n"
    handle = True
    assert cli.answer(*argv, "--handle") == {"file": str(out), "size": [640, 480]}
