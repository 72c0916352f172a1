"""What the commands answer, whole and once, as the package computes it; and the process."""

from __future__ import annotations

import dataclasses
import errno
import inspect
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from command_line import CommandLine

import explorer
from explorer import __version__
from explorer.cli import COMMANDS, run
from explorer.cli.parsing import load_command
from explorer.mechanism.feasible_intervals import feasible_intervals
from explorer.mechanism.kinematics import discriminants
from explorer.mechanism.pose import quaternion_from_rotation
from explorer.mechanism.tilt_torsion import tilt_torsion_of

POSITION = (8.0, -2.5, 1.1e1)
ANGLES = (-60.0, 12.5, -7.0)
POSE = [*("--position", "8", "-2.5", "1.1e1"), *("--yaw-pitch-roll", "-60", "12.5", "-7")]
PRESET = explorer.PRESETS["paper-optimal"]


def snapshot() -> explorer.Snapshot:
    return explorer.evaluate(PRESET, explorer.Pose.of_yaw_pitch_roll(POSITION, ANGLES))


def folds_of(pose: explorer.Pose) -> list[float]:
    """Return the folds of a pose, angles in degrees."""
    r, *angles = explorer.to_folds(pose.position, pose.rotation).tolist()
    return [r, *np.degrees(angles).tolist()]


def test_inverse_has_joints_in_order_and_text_their_millimetres(cli: CommandLine) -> None:
    found = cli.answer("inverse", *POSE)
    expected = snapshot()
    assert set(found) == {"joints", "folds", "within_limits", "violations"}
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


def test_singularity_json_has_the_snapshot(cli: CommandLine) -> None:
    found = cli.answer("singularity", *POSE)
    expected = snapshot()
    assert found == {
        "margins": expected.margins.tolist(),
        "volumes": expected.volumes.tolist(),
        "determinant": expected.determinant,
        "inverse_condition": expected.inverse_condition,
        "smallest_singular_value": expected.smallest_singular_value,
        "manipulability": expected.manipulability,
        "transmissions": expected.transmissions.tolist(),
        "transmission_index": expected.transmission_index,
        "stratum": list(expected.stratum),
        "stratum_dimension": expected.stratum_dimension,
        "mode": expected.mode,
        "signs": list(expected.signs),
        "proximity": expected.proximity,
        "folds": folds_of(expected.pose),
        "incidences": [],
        "nearest": [
            {
                "incidence": index + 1,
                "distance": expected.nearest[index].distance,
                "position": list(expected.nearest[index].pose.position),
                "quaternion": list(expected.nearest[index].pose.quaternion),
                "tilt_torsion": list(tilt_torsion_of(expected.nearest[index].pose.rotation)),
                "folds": folds_of(expected.nearest[index].pose),
            }
            for index in range(3)
        ],
    }


def test_singularity_singular_pose_has_status_0_and_names_its_incidence(cli: CommandLine) -> None:
    found = cli.answer("singularity", "--position", "0", "0", "0")
    assert found["determinant"] == 0.0
    assert found["stratum_dimension"] < 5
    assert found["incidences"] == [1, 2, 3]
    assert [each["distance"] for each in found["nearest"]] == [0.0, 0.0, 0.0]
    assert all(each["position"] == [0.0, 0.0, 0.0] for each in found["nearest"])
    argv = ["singularity", "--position", "10", "5", "0", "--yaw-pitch-roll", "-70", "20", "30"]
    text = cli.text(*argv)
    assert "Singular: δ3 = 0: b4 on the base plane" in text
    assert "(4, 3, 1, 2), dimension 5: δ3 = 0: b4 on the base plane" in text
    assert "With all actuators locked the platform can still move" in text
    (row,) = [line for line in text.splitlines() if line.startswith("δ3 = 0")]
    assert [float(word) for word in row.split()[3:6]] == [10.0, 5.0, 0.0]


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
    keys = "mode signs position quaternion tilt_torsion margins folds"
    assert set(mode) == set(keys.split())
    np.testing.assert_allclose(mode["position"], POSITION, rtol=1e-9)
    rotation = explorer.rotation_from_quaternion(mode["quaternion"])
    np.testing.assert_allclose(rotation, expected.rotation, atol=1e-9)
    rows = [line.split() for line in cli.text(*argv).splitlines()[-8:]]
    assert [row[0] for row in rows] == list("01234567")
    assert [float(value) for value in rows[expected.mode][4:7]] == pytest.approx(POSITION)


def test_folds_of_an_answer_give_its_pose(cli: CommandLine) -> None:
    joints = snapshot().joints
    argv = ["forward", "--joints", *map(repr, joints.tolist())]
    modes = cli.answer(*argv)["modes"]
    rows = [line.split() for line in cli.text(*argv).splitlines()[-8:]]
    for mode, row in zip(modes, rows, strict=True):
        given = ["--folds", *map(repr, mode["folds"])]
        found = cli.answer("inverse", *given)
        np.testing.assert_allclose(found["joints"], joints, rtol=1e-9)
        np.testing.assert_allclose(found["folds"], mode["folds"], rtol=1e-9)
        singularity = cli.answer("singularity", *given)
        assert singularity["signs"] == np.sign(mode["folds"][3:]).tolist()
        np.testing.assert_allclose(singularity["folds"], mode["folds"], rtol=1e-9)
        shown = [float(word.rstrip("°")) for word in row[-3:]]
        np.testing.assert_allclose(shown, mode["folds"][3:], atol=6e-4)
        # r, β and ε are the same in all modes.
        np.testing.assert_allclose(mode["folds"][:3], modes[0]["folds"][:3], rtol=1e-9)
    r, *angles = folds_of(snapshot().pose)
    words = "  ".join([f"{r:.4f}", *(f"{angle:.3f}°" for angle in angles)])
    for command in ("inverse", "singularity"):
        assert f"r β ε φ1 φ2 φ3        {words}\n" in cli.text(command, *POSE)
    between = "  ".join([f"{r:.4f}", *(f"{angle:.3f}°" for angle in angles[:2])])
    assert f"r β ε  {between}, in every mode\n" in cli.text(*argv)


def test_folds_at_the_ends_of_their_ranges_are_poses(cli: CommandLine) -> None:
    walls = ["--folds", "0", "0", "180", "-180", "180", "180"]
    assert cli.answer("singularity", *walls)["incidences"] == [1, 2, 3]


def test_forward_infeasible_joints_suggested_value_is_feasible(cli: CommandLine) -> None:
    for joint in range(6):
        joints = snapshot().joints.copy()
        joints[joint] = feasible_intervals(PRESET, joints)[joint][-1][1] + 0.25
        refused = cli.refusal("forward", "--joints", *map(repr, joints.tolist()), status=1)
        assert "tetrahedron" in refused
        name, *_, closing = refused.strip().rpartition(" is ")[2].split()
        joints[explorer.JOINTS.index(name)] = float(closing)
        assert explorer.forward(PRESET, joints).feasible


def test_forward_infeasible_joints_have_status_1_and_name_the_tetrahedron(cli: CommandLine) -> None:
    joints = snapshot().joints.copy()
    joints[5] = 60.0
    argv = ["forward", "--joints", *map(repr, joints.tolist())]
    squares = discriminants(PRESET, joints)
    assert [square < 0 for square in squares.tolist()] == [False, False, True]
    found = cli.answer(*argv, status=1)
    assert (found["feasible"], found["modes"]) == (False, [])
    assert found["discriminants"] == squares.tolist()
    message = cli.refusal(*argv, status=1)
    assert message.startswith("explorer: ")
    assert "trilateration 3 (tetrahedron b4 a1 a2 a3)" in message
    assert f"{squares[2]:.4g}" in message
    assert "l4 from 60 to " in message


def test_pose_options_are_completed_from_the_home_pose(cli: CommandLine) -> None:
    home = PRESET.home_pose
    rotation = explorer.rotation_from_yaw_pitch_roll(ANGLES)
    # Of any length, and -q is the same rotation as q.
    quaternion = (-3.0 * quaternion_from_rotation(rotation)).tolist()
    for argv, *pose in (
        ([], home.position, home.rotation),
        (POSE[:4], POSITION, home.rotation),
        (POSE[4:], home.position, rotation),
        ([*POSE[:4], "--quaternion", *map(repr, quaternion)], POSITION, rotation),
    ):
        expected = explorer.inverse(PRESET, *pose)
        np.testing.assert_allclose(cli.answer("inverse", *argv)["joints"], expected, rtol=1e-12)


def test_answers_are_free_of_messages_of_libraries(
    cli: CommandLine, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
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


# Commands that write files beside their answer, the option of each file, and what names it.
PAPER = ("optimise", "--design", "paper-initial", "--target-volume", "900")
WITH_FILES: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "path": (("path", "--to", "12", "8", "7"), ("--out",)),
    "budget": (("budget", "--typical", "--wanted", "5"), ("--out",)),
    "optimise": (PAPER, ("--out", "--record")),
}
PROGRESS = re.compile(r"\[[#.]*\] .*")


def run_with_progress(cli: CommandLine, *argv: object, status: int) -> tuple[str, list[str]]:
    """Return standard output, and the lines of standard error without those of progress."""
    cli.has_progress = True
    out, err = cli.run(*argv, status=status)
    return out, [line for line in err.splitlines() if not PROGRESS.fullmatch(line)]


def fail_for_space(*_: object) -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@pytest.mark.parametrize("name", WITH_FILES)
def test_answer_is_printed_though_the_disk_is_full(
    cli: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    cli.has_progress = True
    argv, options = WITH_FILES[name]
    files = [(option, tmp_path / f"{option[2:]}.x") for option in options]
    given = [*argv, *(word for pair in files for word in pair)]

    whole = cli.answer(*argv)
    text, _ = run_with_progress(cli, *argv, status=0)
    monkeypatch.setattr(os, "fsync", fail_for_space)
    found = cli.answer(*given, status=1)
    ignored = {"seconds", "trajectory"}
    assert {key: found[key] for key in whole if key not in ignored} == {
        key: value for key, value in whole.items() if key not in ignored
    }
    assert not any(str(path) in str(found) for _, path in files)
    page, complaints = run_with_progress(cli, *given, status=1)
    without_numbers = [re.sub("[0-9.]+ (s|ms)", "", each) for each in (page, text)]
    assert without_numbers[0] == without_numbers[1]
    (line,) = complaints
    assert line.startswith("explorer: cannot write ")
    assert all(str(path) in line for _, path in files)
    assert os.strerror(errno.ENOSPC) in line
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("failing", ["design.json", "run.json"])
def test_optimise_writes_each_file_that_it_can(
    cli: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failing: str
) -> None:
    cli.has_progress = True
    usual = Path.replace

    def replace(self: Path, target: Path) -> Path:
        if Path(target).name == failing:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return usual(self, target)

    monkeypatch.setattr(Path, "replace", replace)
    out, record = tmp_path / "design.json", tmp_path / "run.json"
    found = cli.answer(*PAPER, "--out", out, "--record", record, status=1)
    (left,) = tmp_path.iterdir()
    assert found["converged"] is True
    assert found["files"] == [str(left)]
    assert {left.name, failing} == {"design.json", "run.json"}


@pytest.mark.parametrize(
    "argv",
    [
        ("forces", "--position", "3", "4", "0"),
        ("accuracy", "--position", "3", "4", "0"),
        ("budget", "--position", "3", "4", "0"),
        ("budget", "--over", "box"),
        ("budget", "--typical", "--keep-actuators", "--wanted", "1e-6"),
        ("path", "--to", "12", "8", "-7"),
        ("forward", "--joints", "1", "2", "3", "4", "5", "600"),
        ("optimise", "--design", "paper-initial", "--target-volume", "20000"),
        ("export", "workspace", "--out", "x.stl", "--yaw-pitch-roll", "0", "0", "0"),
    ],
)
def test_question_without_answer_gives_one_object_and_status_1(
    cli: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, argv: tuple[str, ...]
) -> None:
    monkeypatch.chdir(tmp_path)
    found = cli.answer(*argv, status=1)
    _, complaint = cli.run(*argv, status=1)
    if not {"found", "feasible"} & set(found):
        assert complaint == f"explorer: {found['message']}\n"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "argv",
    [
        ("path", "--from", "40", "8", "7", "--to", "12", "8", "7"),
        ("path", "--to", "40", "8", "7"),
        ("path", "--to", "12", "8", "0"),
        ("path",),
        ("inverse", "--design", "nowhere"),
        ("optimise",),
        ("export", "workspace", "--out", "x.stl", "--density", "3"),
        ("sweep", "--out", "nowhere", "--summary"),
    ],
)
def test_bad_input_gives_no_object_and_status_2(cli: CommandLine, argv: tuple[str, ...]) -> None:
    assert cli.refusal(*argv, "--json", status=2)


PROGRAM = [sys.executable, "-m", "explorer"]


def test_version_and_help_are_those_of_the_package(cli: CommandLine) -> None:
    assert cli.text("--version") == f"explorer {__version__}\n"
    listed = cli.text("--help")
    assert cli.text("-h") == listed
    for name, summary in COMMANDS.items():
        assert f"{name} " in listed
        assert summary in listed


@pytest.mark.parametrize("name", COMMANDS)
def test_help_of_a_command_describes_every_option(cli: CommandLine, name: str) -> None:
    page, command = cli.text(name, "--help"), load_command(name, COMMANDS)
    assert page.startswith(f"usage: explorer {name} ")
    assert COMMANDS[name] in page
    assert (inspect.getdoc(command) or "").splitlines()[0] == COMMANDS[name]
    for field in dataclasses.fields(command):
        option = f"--{field.name.replace('_', '-')}"
        is_placed = field.default is dataclasses.MISSING or f"[{field.name.upper()}]" in page
        assert option in page or (is_placed and "positional" in page)


def test_small_commands_import_no_slow_library() -> None:
    code = (
        "import sys; from explorer.cli import run; "
        "run(['inverse']); run(['forward', '--joints', *'123456']); run(['--help']); "
        "large = {'viser', 'numba', 'trimesh', 'manifold3d', 'playwright', 'scipy.optimize'}; "
        "sys.stderr.write(repr(sorted(large & set(sys.modules))))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.endswith("[]")


def raise_in_command(monkeypatch: pytest.MonkeyPatch, error: BaseException) -> None:
    """Make each command that loads a design raise an error."""

    def load(name: str) -> object:
        raise error

    monkeypatch.setattr("explorer.cli.options.load_design", load)


def test_interrupt_is_silent_with_status_130(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    raise_in_command(monkeypatch, KeyboardInterrupt())
    assert run(["inverse"]) == 130
    assert capsys.readouterr() == ("", "")


def test_internal_error_is_one_line_with_status_70(
    cli: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    raise_in_command(monkeypatch, ZeroDivisionError("a\nb"))
    monkeypatch.delenv("EXPLORER_DEBUG", raising=False)
    refused = cli.refusal("inverse", "--json", status=70)
    assert "ZeroDivisionError" in refused
    assert "report" in refused
    monkeypatch.setenv("EXPLORER_DEBUG", "1")
    assert run(["inverse", "--json"]) == 70
    assert "Traceback" in cli.capsys.readouterr().err


@pytest.mark.skipif(os.name != "posix", reason="pipes of POSIX")
def test_closed_pipe_is_silent() -> None:
    read, write = os.pipe()
    os.close(read)
    done = subprocess.run([*PROGRAM, "inverse"], stdout=write, stderr=subprocess.PIPE, check=False)
    os.close(write)
    assert (done.returncode, done.stderr) == (141, b"")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a full device")
def test_full_streams_end_with_one_line_or_keep_answer_and_status() -> None:
    argv, refused = [*PROGRAM, "inverse", "--json"], [*PROGRAM, "inverse", "--design", "nowhere"]
    pipe = subprocess.PIPE
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(argv, stdout=full, stderr=pipe, check=False)
        kept = [subprocess.run(a, stdout=pipe, stderr=full, check=False) for a in (argv, refused)]
    assert done.returncode == 2
    assert done.stderr.startswith(b"explorer: cannot write to standard output: ")
    assert done.stderr.count(b"\n") == 1
    assert [(each.returncode, each.stdout.count(b"\n")) for each in kept] == [(0, 1), (2, 0)]


def test_pipe_takes_utf_8_in_any_language_of_the_machine() -> None:
    text = "−1.5 – 4² ≥ “Größe” 漢δ\udc80"
    code = (
        "from explorer.cli import streams; streams.prepare(); "
        f"streams.write({text!r}); streams.write_error({text!r})"
    )
    environment = {**os.environ, "PYTHONIOENCODING": "cp1252", "PYTHONUTF8": "0"}
    argv = [sys.executable, "-c", code]
    done = subprocess.run(argv, capture_output=True, env=environment, check=True)
    shown = text.replace("\udc80", "?")
    assert (done.stdout.decode(), done.stderr.decode().rstrip()) == (shown, shown)
