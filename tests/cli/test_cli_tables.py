"""Tables of poses and joints: any units and dialects, round trips, and faults named by place."""

from __future__ import annotations

import csv
import io
import re
from pathlib import Path

import numpy as np
import pytest
from command_line import CommandLine

import explorer
from explorer.errors import InputError
from explorer.export import pose_tables as tables
from explorer.export.tables import trajectory_csv
from explorer.legs.clearance import leg_clearances
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design_file import decode_design
from explorer.mechanism.pose import rotation_from_yaw_pitch_roll
from explorer.mechanism.tilt_torsion import tilt_torsion_from_rotation
from explorer.numerics.arrays import FloatArray
from explorer.paths.trajectory import trajectory
from explorer.workspace.limits.valid_poses import violations

PRESET = explorer.PRESETS["paper-optimal"]
HOME = PRESET.home_pose
ANGLES = ("yaw_degrees", "pitch deg", "roll_radians")


def random_poses(count: int) -> tuple[FloatArray, FloatArray]:
    """Return positions and yaw, pitch, roll in degrees, within the limits and outside them."""
    random = np.random.default_rng(11)
    position = random.uniform((1.0, -11.0, 1.0), (25.0, 20.0, 17.0), (count, 3))
    return position, random.uniform((-120.0, -30.0, -30.0), (-30.0, 30.0, 30.0), (count, 3))


def rows_of(answer: tables.TableAnswer) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(answer.csv)))


def answer_to(
    text: str, design: explorer.Design = PRESET, encoding: str = "utf-8"
) -> tables.TableAnswer:
    table = tables.parse_table("poses.csv", text.encode(encoding), design.unit_mm)
    return tables.inverse_answer(table, tables.read_poses(table, design, HOME.rotation))


@pytest.mark.parametrize(
    ("separator", "decimal"), [(",", "."), (";", ","), (";", "."), ("\t", "."), ("\t", ",")]
)
@pytest.mark.parametrize("start", ["", "sep="])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "cp1252", "utf-16", "utf-16-le"])
def test_poses_of_any_dialect_come_back_through_their_joints(
    separator: str, decimal: str, start: str, encoding: str
) -> None:
    position, angles = random_poses(60)
    units = np.array([10.0, 1.0, 0.01, 1.0, 1.0, np.pi / 180.0])
    head = separator.join(["note", "x_mm", " Y [cm]", "z (m)", *ANGLES])
    lines = [
        separator.join(["ä", *(repr(value).replace(".", decimal) for value in row)])
        for row in (np.hstack([position, angles]) * units).tolist()
    ]
    text = f"\n{separator * 6}\n".join([f"{start}{separator}"] * bool(start) + [head, *lines])
    there = answer_to(text, encoding=encoding)
    assert rows_of(there)[0]["line"] == ("5" if start else "3")
    rotation = rotation_from_yaw_pitch_roll(angles)
    at = Configuration(PRESET, position, rotation)
    table = tables.parse_table("joints.csv", there.csv.encode(), PRESET.unit_mm)
    joints = tables.read_joints(table)
    np.testing.assert_allclose(joints, at.joints, rtol=1e-12)
    back = tables.forward_answer(table, PRESET, joints)
    rows = rows_of(back)
    assert [int(row["mode"]) for row in rows] == [*range(8)] * 60
    again = tables.parse_table("modes.csv", back.csv.encode(), PRESET.unit_mm)
    poses = tables.read_poses(again, PRESET, HOME.rotation)
    own = 8 * np.arange(60) + [int(row["mode"]) for row in rows_of(there)]
    np.testing.assert_allclose(poses.position[own], position, atol=1e-9)
    np.testing.assert_allclose(poses.rotation[own], rotation, atol=1e-9)
    for answer, each in ((there, at), (back, poses)):
        broken = violations(each)
        for row, violated in zip(rows_of(answer), broken, strict=True):
            assert row["within_limits"] == ("false" if violated else "true")
            names = [name for name in row["violations"].split("; ") if name]
            assert all(name.startswith(v.limit) for name, v in zip(names, violated, strict=True))
    assert 0 < there.within < 60


@pytest.mark.parametrize("tool", [None, (1.0, 2.0, 3.0)])
def test_trajectory_is_read_as_it_is_written(tool: tuple[float, float, float] | None) -> None:
    end = explorer.Pose.of_yaw_pitch_roll((12.0, 8.0, 7.0), (-60.0, 5.0, 8.0))
    course = trajectory(PRESET, (HOME, end), samples=33, tool=tool)
    table = tables.parse_table("path.csv", trajectory_csv(course).encode(), PRESET.unit_mm)
    assert tables.read_joints(table).tolist() == course.joints.tolist()
    rows = rows_of(tables.inverse_answer(table, tables.read_poses(table, PRESET, HOME.rotation)))
    assert [float(row["time_s"]) for row in rows] == course.time.tolist()
    found = [[float(row[f"{name} [10 mm]"]) for name in explorer.JOINTS] for row in rows]
    np.testing.assert_allclose(found, course.joints, rtol=1e-12)


def test_poses_of_the_tool_are_those_of_b4_beside_it(tmp_path: Path, cli: CommandLine) -> None:
    design = decode_design(
        b'{"schema": 1, "a3": [19.2, 7.0], "b1": [4.3, -3.9], "b2": 2.6, "b3": 4.9, '
        b'"unit_mm": 25.4, "tool": {"position": [1, -2, 3]}}',
        "design.json",
    )
    poses, out = tmp_path / "poses.csv", tmp_path / "out.csv"
    position, angles = random_poses(5)
    heads = "tool_x [in],tool_y [in],tool_z [in],yaw,pitch,roll"
    lines = [",".join(map(repr, row)) for row in np.hstack([position, angles]).tolist()]
    poses.write_text("\n".join([heads, *lines]), encoding="utf-8")
    files = ("--poses", poses, "--out", out)
    found = cli.answer("inverse", "--design", design, "--at", "tool", *files)
    assert found["lines"] == found["closing"] == 5
    with out.open(encoding="utf-8", newline="") as stream:
        rows = [*csv.DictReader(stream)]
    for row, place, turn in zip(rows, position.tolist(), angles.tolist(), strict=True):
        one = cli.answer(
            *("inverse", "--design", design, "--at", "tool", "--position", *place),
            *("--yaw-pitch-roll", *turn),
        )
        for k, name in enumerate(explorer.JOINTS):
            assert float(row[f"{name} [25.4 mm]"]) == pytest.approx(one["joints"][k], rel=1e-12)
        for axis, value in zip("xyz", place, strict=True):
            assert float(row[f"tool_{axis} [25.4 mm]"]) == pytest.approx(value, abs=1e-12)
        assert (row["within_limits"] == "true") is one["within_limits"]


def test_command_and_table_count_colliding_legs_among_the_limits(
    tmp_path: Path, cli: CommandLine
) -> None:
    design = PRESET.with_limits(leg_radii=(0.3, 0.5, 0.2, 0.4))
    poses, out = tmp_path / "poses.csv", tmp_path / "out.csv"
    position, angles = random_poses(60)
    position[0], angles[0] = HOME.position, (-80.0, 0.0, 0.0)
    lines = [",".join(map(repr, row)) for row in np.hstack([position, angles]).tolist()]
    poses.write_text("\n".join(["x,y,z,yaw,pitch,roll", *lines]), encoding="utf-8")
    cli.run("inverse", "--design", design, "--poses", poses, "--out", out)
    with out.open(encoding="utf-8", newline="") as stream:
        rows = [*csv.DictReader(stream)]
    at = Configuration(design, position, rotation_from_yaw_pitch_roll(angles))
    valid = explorer.poses_are_valid(design, at.position, at.rotation).tolist()
    assert [row["within_limits"] == "true" for row in rows] == valid
    collides = (leg_clearances(at).clearance <= 0.0).any(axis=-1).tolist()
    assert ["legs" in row["violations"] for row in rows] == collides
    assert rows[0]["violations"] == "legs 2–3"
    for place, turn, is_valid in [*zip(position.tolist(), angles.tolist(), valid, strict=True)][:5]:
        at_pose = "--position", *place, "--yaw-pitch-roll", *turn
        for command in ("inverse", "interference"):
            one = cli.answer(command, "--design", design, *at_pose)
            assert one["within_limits"] is is_valid
    text = cli.text("inverse", "--design", design, "--yaw-pitch-roll", -80, 0, 0)
    assert "outside the limits:\n  legs 2 and 3 overlap by 0.3001" in text


def test_joints_that_do_not_close_are_told_and_the_others_answered(
    tmp_path: Path, cli: CommandLine
) -> None:
    here, out = tmp_path / "joints.csv", tmp_path / "out.csv"
    good = explorer.inverse(PRESET, HOME.position, HOME.rotation)
    bad, far = good.copy(), explorer.inverse(PRESET, (30.0, 5.0, 9.0), HOME.rotation)
    bad[5] = 600.0
    lines = [",".join(map(repr, row.tolist())) for row in (good, bad, far)]
    here.write_text("\n".join(["l1,d1,d2,d3,d4,l4", "", *lines, ""]), encoding="utf-8")
    argv = ("forward", "--joints-file", here, "--out", out)
    found = cli.answer(*argv)
    assert found == {
        "file": str(out),
        "lines": 3,
        "closing": 2,
        "within": 1,
        "skipped": [],
        "first_outside": {"line": 4, "fault": "the lengths do not close"},
    }
    assert "line 4: the lengths do not close" in cli.text(*argv)
    with out.open(encoding="utf-8", newline="") as stream:
        rows = [*csv.DictReader(stream)]
    assert [row["line"] for row in rows] == ["3"] * 8 + ["4"] + ["5"] * 8
    assert [row for row in rows if not row["mode"]] == [rows[8]]
    assert rows[8]["violations"] == "the lengths do not close"


def test_modes_of_singular_joints_are_numbered_as_those_of_others() -> None:
    places = [[10.0, 5.0, 9.0], [10.0, 5.0, 0.0], [0.0, 0.0, 0.0]]
    turns = rotation_from_yaw_pitch_roll([[-73.0, 5.0, 3.0]] * 3)
    joints = explorer.inverse(PRESET, places, turns)
    lines = [",".join(map(repr, row)) for row in joints.tolist()]
    text = "\n".join(["l1,d1,d2,d3,d4,l4", *lines])
    table = tables.parse_table("joints.csv", text.encode(), PRESET.unit_mm)
    rows = rows_of(tables.forward_answer(table, PRESET, joints))
    assert [(row["line"], row["mode"]) for row in rows] == [
        (str(line), str(mode)) for line in (2, 3, 4) for mode in range(8)
    ]


def test_first_line_outside_is_told_with_all_that_it_violates() -> None:
    answer = answer_to("x_mm,y_mm,z_mm\n100,50,90\n300,50,90\n110,50,90")
    assert (answer.lines, answer.closing, answer.within) == (3, 3, 2)
    assert answer.first == (3, "mode 1 violates l1 maximum; box x maximum")
    assert answer_to("x,y,z\n10,5,9").first is None


FAULTS = """
x_mm,y_mm,z_mm/1,2,3/1,two,3 | line 3, column y_mm: 'two': a number, such as 12.5, is needed
x_mm;y;z/1;2,5;3/1;2.5.1;3 | line 3, column y: '2.5.1': a number, such as 12,5, is needed
x,y,z/1,2,3//1,,3 | line 4, column y: ''
x;y;z/1,5;2,5;3.5 | line 2, column z: '3.5': a number, such as 12,5, is needed
x,y,z/1,nan,3 | column y: 'nan': this must be a finite number
x,y,z/1,2,1e300 | column z: '1e300': this must not exceed 1e+12
x,y,z/1,5,2,3 | line 2 has 4 cells below 3 headings
x,y,z/1,2 | line 2, column z: ''
x_in,y-mm,z/1,2,3 | column y-mm: its unit must be one of mm, cm, m, in, such as y_mm; a column of
x_in,v/1,2 | has no column y among x_in, v; it needs x, y, z, each with its unit
x,y,z,yaw_degree,pitch_deg,roll_deg/1,2,3,4,5,6 | yaw_degree: its unit must be one of deg, °, degree
x,y,z,yaw_degree/1,2,3,4 | such as yaw_degrees; a column of anything else needs another name
x,y,z,azimuth [grad]/1,2,3,4 | azimuth [grad]: its unit must be one of deg, °, degrees, rad, radians
x,y,z,Roll.deg/1,2,3,4 | column Roll.deg: its unit must be one of deg
x,y,z,tilt°/1,2,3,4 | such as tilt [°]
x,y,z [µm]/1,2,3 | column z [µm]: its unit must be one of mm, cm, m, in, such as z_
xmm,y,z/1,2,3 | column xmm: its unit must be one of mm, cm, m, in, such as x_mm
x,y,z,time_ms/1,2,3,4 | column time_ms: its unit must be one of s, such as time_s
x,y,z,qw_x,qx,qy,qz/1,2,3,1,0,0,0 | column qw_x: its unit must be left out
x,y,z,x_mm/1,2,3,4 | two columns x: leave one out
x,y,z,yaw,qw/1,2,3,4,5 | the orientation twice
x,y,z,yaw/1,2,3,4 | has no column pitch among x, y, z, yaw; it needs yaw, pitch, roll, each
x [deg],y,z/1,2,3 | column x [deg]: its unit must be one of mm, cm, m, in, such as x_
x,y,z,yaw_mm,pitch,roll/1,2,3,4,5,6 | its unit must be one of deg, °, degrees, rad, radians
x,y,z,qw,qx,qy,qz/1,2,3,0,0,0,0 | line 2, column qw: '0': a quaternion must not be all zeros
x,y,z | 1 to 100000 lines of numbers below it; lines that are not blank: 1
x,y,z/"1,2,3 | line 2, column x
"""
"""Tables, a slash between their lines, each with words of the message."""


def test_columns_of_other_quantities_are_skipped_and_told() -> None:
    heads = "note,x,y,z,speed,x2,l1 speed [mm/s],l1 force [N],z_offset_mm,roll number 3,psi,,mode"
    answer = answer_to(f"{heads}\na,10,5,9,1,2,3,4,5,6,7,8,9")
    left_out = {"x", "y", "z", "", "mode"}
    assert answer.skipped == tuple(head for head in heads.split(",") if head not in left_out)
    assert rows_of(answer) == rows_of(answer_to("x,y,z\n10,5,9"))


@pytest.mark.parametrize("case", FAULTS.strip().splitlines())
def test_faults_are_told_with_line_and_column(case: str) -> None:
    text, words = case.split(" | ")
    with pytest.raises(InputError) as caught:
        answer_to(text.replace("/", "\n"))
    assert words in str(caught.value)
    assert str(caught.value).startswith("poses.csv")
    # A heading that is offered is read.
    for wrong, offered in re.findall(r"column (.+): its unit .*, such as (.+);", str(caught.value)):
        mended = tables.parse_table("poses.csv", f"{offered}\n1".encode(), 1.0)
        assert mended.columns.keys() == {re.split(r"[^a-z]", offered)[0]}
        assert wrong[0].lower() == offered[0]


def test_truncated_utf16_is_refused_in_one_sentence() -> None:
    with pytest.raises(InputError, match=r"poses.csv: line 2: the bytes are no text in UTF-16; "):
        tables.parse_table("poses.csv", "x,y,z\n1,2,3".encode("utf-16")[:-1], 1.0)


def test_options_of_tables_are_refused_without_one(cli: CommandLine, tmp_path: Path) -> None:
    table, out = tmp_path / "joints.csv", tmp_path / "out.csv"
    table.write_text("l1,d1,d2,d3,d4,l4\n1,2,-3,4,5,6\n", encoding="utf-8")
    turns = tmp_path / "turns.csv"
    turns.write_text("x,y,z,yaw,pitch,roll\n1,2,3,4,5,6\n", encoding="utf-8")
    joints = ("--joints", *"123456")
    for argv, words in (
        (("inverse", "--out", out), "give both"),
        (("inverse", "--poses", table), "give both"),
        (("inverse", "--poses", table, "--out", out, "--position", *"123"), "leave --position"),
        (("inverse", "--poses", tmp_path / "none.csv", "--out", out), "cannot read"),
        (("inverse", "--poses", table, "--out", "/nowhere/out.csv"), "there is no folder"),
        (("inverse", "--poses", table, "--out", table), "name another file"),
        (("inverse", "--poses", turns, "--out", out, "--quaternion", *"1000"), "has orientations"),
        (("forward", "--joints-file", table, "--out", out, *joints), "either --joints or"),
        (("forward", "--joints-file", table, "--out", out), "column d2: '-3': a length must not"),
    ):
        assert words in cli.refusal(*argv)
    assert not out.exists()


def test_angles_and_azimuths_state_the_same_orientation() -> None:
    position, angles = random_poses(20)
    rotation = rotation_from_yaw_pitch_roll(angles)
    tilts = tilt_torsion_from_rotation(rotation)
    joints = [
        [row["l1 [10 mm]"] for row in rows_of(answer_to(text))]
        for text in (
            "\n".join([f"x,y,z,{names}", *(",".join(map(repr, row)) for row in rows)])
            for names, rows in (
                ("yaw,pitch,roll", np.hstack([position, angles]).tolist()),
                ("azimuth,tilt,torsion", np.hstack([position, tilts]).tolist()),
            )
        )
    ]
    np.testing.assert_allclose(*np.array(joints, dtype=np.float64), rtol=1e-12)
