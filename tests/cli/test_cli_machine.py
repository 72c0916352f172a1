"""`--machine`: joints and poses of the machine that was built, and commands for its controller."""

from __future__ import annotations

import csv
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from command_line import CommandLine
from measured_machines import ELSEWHERE, TYPICAL, design_itself, true_machine
from numpy.testing import assert_allclose

from explorer import JOINTS, PRESETS, forward
from explorer.calibration.machine_file import encode_machine, load_machine
from explorer.mechanism.built_machine import BuiltMachine
from explorer.mechanism.pose import quaternion_from_rotation, rotation_from_quaternion
from explorer.numerics.arrays import FloatArray

HOME = TYPICAL.home_pose
MODE = 1


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """Return the file of a machine of the paper's optimum."""
    file = tmp_path / "machine.json"
    file.write_bytes(encode_machine(true_machine(np.random.default_rng(3)), ()))
    return file


def machine_in(file: Path) -> BuiltMachine:
    return load_machine(file, PRESETS["paper-optimal"])


def write_rows(file: Path, head: str, rows: FloatArray) -> Path:
    lines = [",".join(map(repr, row)) for row in rows.tolist()]
    file.write_text("\n".join([head, *lines, ""]))
    return file


def numbers_of(file: Path, *names: str) -> FloatArray:
    rows = csv.DictReader(file.read_text().splitlines())
    return np.array([[float(row[name]) for name in names] for row in rows])


def poses_of(file: Path) -> tuple[FloatArray, FloatArray]:
    places = numbers_of(file, *(f"{axis} [10 mm]" for axis in "xyz"))
    return places, rotation_from_quaternion(numbers_of(file, "qw", "qx", "qy", "qz"))


def test_inverse_and_forward_are_those_of_the_machine(cli: CommandLine, file: Path) -> None:
    machine = machine_in(file)
    found = cli.answer("inverse", "--machine", file)["joints"]
    assert_allclose(found, machine.inverse(HOME.position, HOME.rotation), rtol=1e-14)
    assert np.abs(found - design_itself().inverse(HOME.position, HOME.rotation)).max() > 1e-3
    modes = cli.answer("forward", "--joints", *found, "--machine", file)["modes"]
    assert len(modes) == 8
    assert_allclose(modes[MODE]["position"], HOME.position, atol=1e-12)
    for mode in modes:
        rotation = rotation_from_quaternion(mode["quaternion"])
        assert_allclose(machine.inverse(mode["position"], rotation), found, atol=1e-11)
    text = cli.text("inverse", "--machine", file)
    assert f"{10.0 * found[0]:.3f}" in text
    assert "in every mode" not in cli.text("forward", "--joints", *found, "--machine", file)
    assert "in every mode" in cli.text("forward", "--joints", *found)


def test_tables_have_joints_and_poses_of_the_machine(
    cli: CommandLine, file: Path, tmp_path: Path
) -> None:
    machine, out, back = machine_in(file), tmp_path / "joints.csv", tmp_path / "back.csv"
    quaternions = quaternion_from_rotation(ELSEWHERE.rotation)
    rows = np.hstack([np.arange(200.0)[:, None], ELSEWHERE.position, quaternions])
    table = write_rows(tmp_path / "poses.csv", "time_s,x,y,z,qw,qx,qy,qz", rows)
    cli.answer("inverse", "--poses", table, "--out", out, "--machine", file)
    heads = [f"{name} [10 mm]" for name in JOINTS]
    joints = numbers_of(out, *heads)
    assert_allclose(joints, machine.inverse(ELSEWHERE.position, ELSEWHERE.rotation), rtol=1e-13)
    assert (numbers_of(out, "time_s")[:, 0] == np.arange(200.0)).all()
    found = cli.answer("forward", "--joints-file", out, "--out", back, "--machine", file)
    assert found["closing"] == 200
    kept = numbers_of(back, "mode")[:, 0] == MODE
    position, rotation = (each[kept] for each in poses_of(back))
    assert_allclose(position, ELSEWHERE.position, atol=1e-11)
    assert_allclose(rotation, ELSEWHERE.rotation, atol=1e-11)


def test_controller_that_knows_the_design_alone_is_sent_where_the_machine_should_be(
    cli: CommandLine, file: Path, tmp_path: Path
) -> None:
    machine, out = machine_in(file), tmp_path / "commands.csv"
    rows = np.hstack([ELSEWHERE.position, quaternion_from_rotation(ELSEWHERE.rotation)])
    table = write_rows(tmp_path / "poses.csv", "x,y,z,qw,qx,qy,qz", rows)
    argv = ("inverse", "--poses", table, "--out", out, "--machine", file, "--nominal-firmware")
    assert cli.answer(*argv)["closing"] == 200
    # Its firmware has the inverse kinematics of the design, and drives the true machine.
    position, rotation = poses_of(out)
    reached = machine.forward(design_itself().inverse(position, rotation))
    assert reached.closes.all()
    assert_allclose(reached.position, ELSEWHERE.position, atol=1e-10)
    assert_allclose(reached.rotation, ELSEWHERE.rotation, atol=1e-10)
    assert np.abs(position - ELSEWHERE.position).max() > 1e-3


def test_poses_whose_joints_no_pose_of_the_design_has_are_told(
    cli: CommandLine, file: Path, tmp_path: Path
) -> None:
    # b4 is so near the base plane that the design does not close with the machine's joints.
    rows = np.array([[*HOME.position[:2], z, *HOME.quaternion] for z in (0.001, 5.0)])
    table, out = write_rows(tmp_path / "poses.csv", "x,y,z,qw,qx,qy,qz", rows), tmp_path / "o.csv"
    argv = ("inverse", "--poses", table, "--out", out, "--machine", file)
    joints = machine_in(file).inverse(rows[:, :3], HOME.rotation)
    assert forward(TYPICAL, joints).feasible.tolist() == [False, True]
    assert cli.answer(*argv)["closing"] == 2
    assert cli.answer(*argv, "--nominal-firmware")["closing"] == 1
    assert "the lengths do not close" in out.read_text().splitlines()[1]


def test_simulation_is_that_of_the_machine(cli: CommandLine, file: Path, tmp_path: Path) -> None:
    out = tmp_path / "machine.xml"
    cli.answer("export", "simulation", "--out", out, "--machine", file)
    assert ET.fromstring(out.read_text()) is not None
    first = machine_in(file).deviations[0] * TYPICAL.unit_mm
    assert f"l1: {first:+.6g} mm" in out.read_text()
    argv = ("export", "simulation", "--out", out, "--machine", file, "--errors", 1, "--typical")
    assert "give either --errors SEED or --machine" in cli.run(*argv, status=2)[1]


@pytest.mark.parametrize("what", ["kernel", "linuxcnc"])
def test_code_for_controllers_has_the_deviations(
    cli: CommandLine, file: Path, tmp_path: Path, what: str
) -> None:
    out, machine = tmp_path / what, machine_in(file)
    cli.answer("export", what, "--out", out, "--machine", file)
    texts = [each.read_text() for each in out.iterdir()]
    for value in 10.0 * machine.deviations[:6]:
        assert sum(text.count(repr(float(value))) for text in texts) == (
            1 if what == "kernel" else 2
        )
    assert (
        "--machine is not for"
        in cli.run("export", "page", "--out", tmp_path / "page.html", "--machine", file, status=2)[
            1
        ]
    )


def test_machine_of_another_design_is_refused_with_both_names(
    cli: CommandLine, file: Path, tmp_path: Path
) -> None:
    argv = ("inverse", "--machine", file, "--design", "paper-initial")
    _, error = cli.run(*argv, status=2)
    assert "'paper-optimal'" in error
    assert "'paper-initial'" in error
    _, error = cli.run("inverse", "--machine", file, "--nominal-firmware", status=2)
    assert "--nominal-firmware is for --machine FILE.json and --poses FILE.csv" in error
    _, error = cli.run("inverse", "--machine", tmp_path / "none.json", status=2)
    assert "none.json" in error
