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
    columns = {
        name: np.array([[row[f"{q} {name} [{unit}]"] for q in explorer.JOINTS] for row in rows])
        for name, unit in (("speed", "mm/s"), ("force", "N"), ("power", "W"))
    }
    for name, values in columns.items():
        peak = np.abs(values).max(axis=0)
        np.testing.assert_allclose(peak, found[f"peak_{name}"], rtol=0.01, atol=1e-3)
    power = 1e-3 * columns["force"] * columns["speed"]
    np.testing.assert_allclose(columns["power"], power, rtol=1e-12, atol=1e-12)
    few = cli.answer(*words, "--samples", "9", "--out", out)
    assert few["peak_power"] == found["peak_power"]
    with out.open(encoding="utf-8", newline="") as stream:
        lines = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(stream)]
    for line, row in zip(lines, rows[::250], strict=True):
        assert line == pytest.approx(row, rel=1e-9, abs=1e-9)
    way = np.trapezoid([row["l4 speed [mm/s]"] for row in rows], dx=rows[1]["time_s"])
    assert way == pytest.approx(rows[-1]["l4 [mm]"] - rows[0]["l4 [mm]"], abs=1e-3)
    assert "One motor for all six needs at least" in cli.text(*words)


def test_pauses_of_a_table_of_corners_are_part_of_the_duration(
    cli: CommandLine, tmp_path: Path
) -> None:
    plain, paused = tmp_path / "plain.csv", tmp_path / "paused.csv"
    plain.write_text(CORNERS, encoding="utf-8")
    pauses = ("pause_s", "0", "0.1", "", "0.2")
    lines = map(",".join, zip(CORNERS.split(), pauses, strict=True))
    paused.write_text("\n".join(lines) + "\n", encoding="utf-8")
    for words, given in (
        (("--duration", "0.5"), ("--duration", "0.8")),
        (("--speed", "30", "--acceleration", "1000"),) * 2,
    ):
        moving = cli.answer("--path", plain, "--payload", "2", *words)
        found = cli.answer("--path", paused, "--payload", "2", *given)
        assert found["duration"] == pytest.approx(moving["duration"] + 0.3)
        assert found["peak_force"] == pytest.approx(moving["peak_force"], rel=1e-9)
    refused = cli.refusal("--path", paused, "--payload", "2", "--duration", "0.3")
    assert "the pauses take 0.3 s of the 0.3 s" in refused
    paused.write_text("x,y,z,pause_s\n10,5,9,0\n11,5,9,-1\n", encoding="utf-8")
    refused = cli.refusal("--path", paused, "--duration", "1")
    assert "line 3, column pause_s: '-1': a pause must not be below zero" in refused


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


@pytest.mark.parametrize("law", [("--speed", "10", "--acceleration", "1000"), ()])
def test_drives_of_a_move_to_and_fro_are_those_of_both_moves(
    cli: CommandLine, tmp_path: Path, law: tuple[str, ...]
) -> None:
    limits = explorer.Actuators(
        push_n=same_for_all(150.0),
        speed_mm_s=same_for_all(200.0),
        acceleration_mm_s2=same_for_all(5000.0),
    )
    design = msgspec.structs.replace(explorer.PRESETS["paper-optimal"], actuators=limits)
    words = ("--design", design, "--payload", "2", *law)
    here, there = ("6", "-1", "7"), ("13", "5", "10")
    file, ends = tmp_path / "path.csv", [here, there] * 13
    file.write_text("\n".join(map(",".join, ["xyz", *ends, here])) + "\n", encoding="utf-8")
    path = cli.answer("--path", file, *words)
    ways = [cli.answer("--from", *e, "--to", *f, *words) for e, f in ((here, there), (there, here))]
    times = [way["duration"] for way in ways]
    assert path["duration"] == pytest.approx(13.0 * sum(times), rel=1e-9)
    for name in ("peak_speed", "peak_force", "peak_power"):
        expected = np.max([way[name] for way in ways], axis=0)
        np.testing.assert_allclose(path[name], expected, rtol=1e-6)
    for name, power in (("rms_force", 2), ("mean_power", 1)):
        means = np.average([np.power(way[name], power) for way in ways], axis=0, weights=times)
        np.testing.assert_allclose(np.power(path[name], power), means, rtol=1e-6)


def test_corner_within_the_rounding_of_a_table_asks_nothing_more(
    cli: CommandLine, tmp_path: Path
) -> None:
    file, lines = tmp_path / "path.csv", ["x_mm,y_mm,z_mm", "100,50,90", "100,50,110", "145,50,110"]
    answers: list[dict[str, float]] = []
    for more in ([], ["145,50.0000000001,110"], ["145,50.00001,110"]):
        file.write_text("\n".join([*lines, *more]) + "\n", encoding="utf-8")
        words = ["--path", file, "--payload", "2", "--duration", "0.5"]
        answers.append(cli.answer(*words)["least_motor"])
    for answer in answers[1:]:
        assert answer == pytest.approx(answers[0], rel=1e-9)


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
