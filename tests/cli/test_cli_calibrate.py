"""`explorer calibrate`: from poses to what is measured there, to the machine and its words."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import CommandLine
from measured_machines import (
    BAR,
    GAUGE,
    PLACES,
    POSES,
    TARGETS,
    TYPICAL,
    WALLS,
    rms,
    tool_errors,
    true_machine,
    with_errors,
)
from scipy.spatial.transform import Rotation

from explorer import JOINTS, Measurement
from explorer.calibration.machine_file import load_machine
from explorer.mechanism.built_machine import BuiltMachine
from explorer.mechanism.pose import quaternion_from_rotation

TRUE = true_machine(np.random.default_rng(7))
KEYS = {
    *("file", "assumed", "machine", "seen", "unseen", "chi_square", "degrees", "outliers"),
    *(
        "beyond",
        "tool_before_mm",
        "tool_after_mm",
        "held_out_mm",
        "held_out_by_design_mm",
        "faults",
    ),
}


def write_points(folder: Path, count: int = 3) -> Path:
    file = folder / "t.csv"
    lines = [",".join(map(repr, row)) for row in (10.0 * PLACES[:count]).tolist()]
    file.write_text("\n".join(["x_mm,y_mm,z_mm", *lines, ""]))
    return file


def measure(
    poses: Path, kind: Measurement, machine: BuiltMachine = TRUE, shift: tuple[float, ...] = ()
) -> Path:
    """Write what is measured of a machine whose encoders read the joints of a table, in mm."""
    rows = csv.DictReader(poses.read_text().splitlines())
    joints = np.array([[float(row[f"{name} [10 mm]"]) for name in JOINTS] for row in rows])
    there = machine.forward(joints)
    values = kind.model(there.position, there.rotation, np.zeros(kind.unknowns))
    values = with_errors(replace(kind, values=values), np.random.default_rng(1)).values
    values[: len(shift), 0] += shift
    if kind.kind == "poses":
        names = ["x_mm", "y_mm", "z_mm", "qw", "qx", "qy", "qz"]
        turns = quaternion_from_rotation(Rotation.from_rotvec(values[:, 3:]).as_matrix())
        values = np.concatenate([10.0 * values[:, :3], turns], axis=1)
    else:
        names = {"targets": [f"t{k}_{axis}_mm" for k in (1, 2, 3) for axis in "xyz"]}.get(
            kind.kind, [f"{kind.kind}_mm"]
        )
        values = 10.0 * values
    file = poses.with_name("m.csv")
    head = [*(f"{name}_mm" for name in JOINTS), *names]
    lines = [",".join(map(repr, row)) for row in np.hstack([10.0 * joints, values]).tolist()]
    file.write_text("\n".join([",".join(head), *lines, ""]))
    return file


@pytest.mark.parametrize(
    ("kind", "count", "options"),
    [
        (POSES, 12, ()),
        (TARGETS, 14, ()),
        (BAR, 100, ("--ball", 5, -4, 0, "--sigma", 0.001)),
        (GAUGE, 100, ("--planes", 0, 0, 1, 2, "--sigma", 0.001)),
        (WALLS, 120, ("--planes", *WALLS.base.ravel().tolist(), "--sigma", 0.001)),
    ],
)
def test_poses_are_written_and_the_machine_found_there(
    cli: CommandLine, tmp_path: Path, kind: Measurement, count: int, options: tuple[Any, ...]
) -> None:
    kind = replace(kind, sigma=kind.sigma if kind.kind in ("poses", "targets") else np.array(1e-4))
    poses, out = tmp_path / "poses.csv", tmp_path / "machine.json"
    points = () if kind.kind == "poses" else ("--targets", write_points(tmp_path, len(kind.points)))
    setup = ("--typical", *points, *options)
    argv = ("calibrate", "poses", "--count", count, "--measure", kind.kind, "--out", poses)
    assert cli.answer(*argv, *setup)["count"] == count
    given = measure(poses, kind)
    found = cli.answer("calibrate", "--measured", given, "--out", out, *setup)
    assert set(found) == KEYS
    assert found["faults"] == []
    assert found["outliers"] == []
    assert found["machine"] == json.loads(out.read_text())
    assert found["unseen"] == found["machine"]["unseen"]
    assert found["seen"] + len(found["unseen"]) == 31
    assert 10.0 * found["tool_after_mm"] < found["tool_before_mm"]
    assert 2.0 * found["held_out_mm"] < found["held_out_by_design_mm"]
    machine = load_machine(out, TYPICAL)
    if kind.kind == "poses":
        assert rms(tool_errors(TRUE, machine)) < 0.02
    text = cli.text("calibrate", "--measured", given, "--out", out, *setup)
    assert f"{found['seen']} of 31 seen" in text
    assert "cannot be told from the guide's x, which changes no pose" in text
    assert "a1 beside the guide" in text


def test_targets_that_were_hidden_are_blank(cli: CommandLine, tmp_path: Path) -> None:
    poses, out, points = tmp_path / "poses.csv", tmp_path / "machine.json", write_points(tmp_path)
    setup = ("--typical", "--targets", points)
    argv = ("calibrate", "poses", "--measure", "targets", "--count", 20, "--out", poses)
    cli.run(*argv, *setup)
    given = measure(poses, TARGETS)
    head, *lines = given.read_text().splitlines()
    cells = [line.split(",") for line in lines]
    for k, row in enumerate(cells):
        row[6 + 3 * (k % 3) : 9 + 3 * (k % 3)] = ["", " ", ""]
    given.write_text("\n".join([head, *(",".join(row) for row in cells)]))
    found = cli.answer("calibrate", "--measured", given, "--out", out, *setup)
    assert found["degrees"] == 20 * 6 - 9 - found["seen"]
    assert 10.0 * found["tool_after_mm"] < found["tool_before_mm"]
    cells[2][0] = ""
    given.write_text("\n".join([head, *(",".join(row) for row in cells)]))
    _, error = cli.run("calibrate", "--measured", given, "--out", out, *setup, status=2)
    assert "line 4, column l1_mm" in error


def test_planes_of_a_gauge_stay_with_their_poses(cli: CommandLine, tmp_path: Path) -> None:
    poses, out, point = tmp_path / "poses.csv", tmp_path / "machine.json", write_points(tmp_path, 1)
    planes = ("--planes", *WALLS.base.ravel().tolist())
    setup = ("--typical", "--targets", point, "--sigma", 0.001, *planes)
    argv = ("calibrate", "poses", "--measure", "gauge", "--count", 90, "--out", poses)
    cli.run(*argv, *setup)
    numbers = [row["plane"] for row in csv.DictReader(poses.read_text().splitlines())]
    assert numbers == ["1", "2", "3"] * 30
    given = measure(poses, replace(WALLS, sigma=np.array(1e-4)))
    head, *lines = given.read_text().splitlines()
    lines = [f"{line},{number}" for line, number in zip(lines, numbers, strict=True)]
    given.write_text("\n".join([f"{head},plane", *lines]))
    found = cli.answer("calibrate", "--measured", given, "--out", out, *setup)
    del lines[4]
    given.write_text("\n".join([f"{head},plane", *reversed(lines)]))
    other = cli.answer("calibrate", "--measured", given, "--out", out, *setup)
    assert other["seen"] == found["seen"]
    assert other["chi_square"] == pytest.approx(found["chi_square"], abs=20.0)
    given.write_text("\n".join([f"{head},plane", f"{lines[0].rpartition(',')[0]},4"]))
    _, error = cli.run("calibrate", "--measured", given, "--out", out, *setup, status=2)
    assert "line 2, column plane: '4': the number of a plane, 1 to 3" in error


def test_tables_that_cannot_be_meant_are_refused(cli: CommandLine, tmp_path: Path) -> None:
    poses, out = tmp_path / "poses.csv", tmp_path / "machine.json"
    cli.run("calibrate", "poses", "--typical", "--out", poses)
    given = measure(poses, POSES)
    argv = ("calibrate", "--measured", given, "--typical", "--out")
    text = given.read_text()
    assert "is the table to read" in cli.run(*argv, given, status=2)[1]
    assert given.read_text() == text
    given.write_text(
        text.replace("qw", "aw").replace("qx", "ax").replace("qy", "ay").replace("qz", "az")
    )
    assert "has no orientations" in cli.run(*argv, out, status=2)[1]
    head, *lines = text.splitlines()
    given.write_text("\n".join([f"{head},sigma_mm", *(f"{line},0" for line in lines)]))
    assert "line 2, column sigma_mm: '0'" in cli.run(*argv, out, status=2)[1]


def test_wrong_poses_are_named_from_one(cli: CommandLine, tmp_path: Path) -> None:
    poses, out = tmp_path / "poses.csv", tmp_path / "machine.json"
    cli.run("calibrate", "poses", "--count", 20, "--typical", "--out", poses)
    given = measure(poses, POSES, shift=(0.0, 0.1, 0.0, 0.0, -0.1))
    found = cli.answer("calibrate", "--measured", given, "--typical", "--out", out)
    assert found["outliers"] == [2, 5]
    assert "2, 5" in cli.text("calibrate", "--measured", given, "--typical", "--out", out)


def test_machine_without_errors_gains_nothing_and_writes_no_file(
    cli: CommandLine, tmp_path: Path
) -> None:
    poses, out = tmp_path / "poses.csv", tmp_path / "machine.json"
    cli.run("calibrate", "poses", "--count", 12, "--typical", "--out", poses)
    given = measure(poses, POSES, BuiltMachine(TYPICAL))
    argv = ("calibrate", "--measured", given, "--typical", "--out", out)
    found = cli.answer(*argv, status=1)
    assert found["file"] is None
    assert not any(found["machine"]["zeros_mm"])
    assert "nothing gained" in found["faults"][0]
    assert "nothing gained" in cli.run(*argv, status=1)[1]
    assert not out.exists()


def test_column_of_sigma_counts_in_place_of_the_option(cli: CommandLine, tmp_path: Path) -> None:
    poses, out = tmp_path / "poses.csv", tmp_path / "machine.json"
    cli.run("calibrate", "poses", "--count", 12, "--typical", "--out", poses)
    given = measure(poses, POSES)
    same = cli.answer("calibrate", "--measured", given, "--typical", "--out", out)
    lines = given.read_text().splitlines()
    head, *rest = lines
    given.write_text("\n".join([f"{head},sigma_mm", *(f"{line},0.01" for line in rest)]))
    argv = ("calibrate", "--measured", given, "--typical", "--out", out)
    assert cli.answer(*argv, "--sigma", 5)["machine"] == same["machine"]
    given.write_text("\n".join([f"{head},sigma_mm", *(f"{line},1" for line in rest)]))
    assert cli.answer(*argv)["tool_after_mm"] > 1.5 * same["tool_after_mm"]


@pytest.mark.parametrize(
    ("argv", "words"),
    [
        ((), "give either --measured FILE.csv, or the word poses"),
        (
            ("poses", "--measure", "targets"),
            "targets need a table of where they are (--targets): columns x, y, z",
        ),
        (("poses", "--measure", "bar"), "--ball X Y Z says about where"),
        (
            ("poses", "--measure", "gauge", "--planes", "0", "0", "0", "1"),
            "the normal of a plane must not be all zeros",
        ),
        (("poses", "--planes", "0", "0", "1"), "1 to 3 planes"),
        (("poses", "--count", "0"), "must lie within 1 to 1000"),
    ],
)
def test_faulty_options_are_refused(
    cli: CommandLine, tmp_path: Path, argv: tuple[str, ...], words: str
) -> None:
    full = ("calibrate", *argv, "--typical", "--out", tmp_path / "out")
    assert words in cli.run(*full, status=2)[1]


def test_design_without_tolerances_is_told_what_it_needs(cli: CommandLine, tmp_path: Path) -> None:
    poses = tmp_path / "poses.csv"
    cli.run("calibrate", "poses", "--typical", "--out", poses)
    given = measure(poses, POSES)
    _, error = cli.run("calibrate", "--measured", given, "--out", tmp_path / "m.json", status=2)
    assert "no deviation has a tolerance" in error
    assert "--typical" in error
