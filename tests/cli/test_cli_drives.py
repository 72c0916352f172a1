"""What `explorer drives` answers: numbers of a path, its table, and refusals in a sentence."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from command_line import CommandLine
from machines import same_for_all

import explorer

COMMAND = ("drives",)
CORNERS = "x_mm,y_mm,z_mm\n100,50,90\n100,50,110\n140,30,110\n140,30,90\n"
MOVE = ("--to", "12", "4", "8", "--payload", "2")


def test_drives_of_a_table_of_corners_and_their_csv_agree(cli: CommandLine, tmp_path: Path) -> None:
    corners, out = tmp_path / "corners.csv", tmp_path / "drives.csv"
    corners.write_text(CORNERS, encoding="utf-8")
    words = ["--path", corners, "--payload", "2", "--duration", "0.5"]
    found = cli.answer(*words, "--samples", "2001", "--out", out)
    assert found["duration"] == pytest.approx(0.5)
    assert found["binding"] == [[]] * 6
    with out.open(encoding="utf-8", newline="") as stream:
        rows = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(stream)]
    assert len(rows) == 2001
    for name, unit in (("speed", "mm/s"), ("force", "N"), ("power", "W")):
        columns = [[row[f"{joint} {name} [{unit}]"] for row in rows] for joint in explorer.JOINTS]
        peak = np.abs(columns).max(axis=1)
        np.testing.assert_allclose(peak, found[f"peak_{name}"], rtol=0.01, atol=1e-3)
    way = np.trapezoid([row["l4 speed [mm/s]"] for row in rows], dx=rows[1]["time_s"])
    assert way == pytest.approx(rows[-1]["l4 [mm]"] - rows[0]["l4 [mm]"], abs=1e-3)
    assert "One motor for all six needs at least" in cli.text(*words)


def test_drives_take_the_corners_of_a_planned_path_and_the_shortest_time_of_a_design(
    cli: CommandLine, tmp_path: Path
) -> None:
    limits = explorer.Actuators(
        push_n=same_for_all(100.0),
        speed_mm_s=same_for_all(200.0),
        acceleration_mm_s2=same_for_all(2000.0),
    )
    design = msgspec.structs.replace(explorer.PRESETS["paper-optimal"], actuators=limits)
    corners = tmp_path / "corners.csv"
    path = replace(cli, command=("path",))
    assert path.answer(*MOVE[:4], "--design", design, "--corners", corners)["found"]
    by_file = cli.answer("--path", corners, "--payload", "2", "--design", design)
    alike = cli.answer(*MOVE, "--design", design)
    assert by_file["least_motor"] == pytest.approx(alike["least_motor"], rel=1e-9)
    binding = [each for limits in by_file["binding"] for each in limits]
    assert max(each["share"] for each in binding) == pytest.approx(1.0, abs=1e-6)
    assert {each["limit"] for each in binding} <= {"speed", "acceleration", "push"}


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ([], "--path"),
        (MOVE, "choose a duration"),
        ([*MOVE, "--speed", "3"], "--speed needs --acceleration"),
        ([*MOVE, "--speed", "3", "--acceleration", "9", "--duration", "1"], "either --duration"),
        ([*MOVE, "--duration", "0"], "a positive number"),
        (["--to", "12", "40", "8", "--duration", "1"], "leaves the limits"),
        ([*MOVE, "--path", "corners.csv"], "leave out --from, --to"),
    ],
)
def test_drives_refuse_what_is_no_path_in_time(
    cli: CommandLine, words: list[str], reason: str
) -> None:
    assert reason in cli.refusal(*words)


def test_path_refuses_one_file_for_corners_and_trajectory(cli: CommandLine, tmp_path: Path) -> None:
    file = tmp_path / "path.csv"
    path = replace(cli, command=("path",))
    assert "need two files" in path.refusal(*MOVE[:4], "--out", file, "--corners", file)


def test_drives_refuse_a_path_that_is_in_time_already(cli: CommandLine, tmp_path: Path) -> None:
    table = tmp_path / "path.csv"
    table.write_text("time_s,x,y,z\n0,10,5,9\n1,11,5,9\n", encoding="utf-8")
    assert "give the corners alone" in cli.refusal("--path", table, "--duration", "1")
    table.write_text("x,y,z\n10,5,9\n", encoding="utf-8")
    assert "two poses that differ" in cli.refusal("--path", table, "--duration", "1")
