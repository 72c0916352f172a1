"""`explorer orientation`, and the option `--at tool` of every command, against the functions."""

from __future__ import annotations

import csv
import dataclasses
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
import trimesh
from command_line import CommandLine
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

import explorer
from explorer.app.state.state import POINTS, open_state
from explorer.app.state.view import View
from explorer.cli import COMMANDS
from explorer.cli.parsing import load_command
from explorer.mechanism.configuration import position_of
from explorer.mechanism.tilt_torsion import rotation_from_tilt_torsion
from explorer.singularity.ellipsoids import performance
from explorer.workspace.orientations.share import orientation_share
from explorer.workspace.orientations.tilts import tilt_by_torsion, tilt_map, torsion_range

OPTIMAL = explorer.PRESETS["paper-optimal"]
TOOL = (1.0, -0.5, 3.0)
TOOLED = msgspec.structs.replace(OPTIMAL, tool=explorer.Tool(position=TOOL), name="tooled")
PLACE = (9.0, 3.0, 12.5)
ANGLES = (-65.0, 8.0, -4.0)
TURN = explorer.rotation_from_yaw_pitch_roll(ANGLES)
B4 = np.array(PLACE) - TURN @ TOOL
POSE = ["--position", *map(str, PLACE), "--yaw-pitch-roll", *map(str, ANGLES)]

AT_TOOL = ("--design", TOOLED, "--at", "tool")


def test_positions_are_those_of_the_tool(cli: CommandLine) -> None:
    found = cli.answer("inverse", *POSE, *AT_TOOL)
    assert_allclose(found["joints"], explorer.inverse(TOOLED, B4, TURN), rtol=1e-12)
    assert_allclose(found["tool_position"], PLACE)
    assert_allclose(found["position"], B4)
    assert "tool position         9.00000  3.00000  12.5000" in cli.text("inverse", *POSE, *AT_TOOL)


def test_poses_are_completed_from_the_tool_at_home(cli: CommandLine) -> None:
    home = TOOLED.home_pose
    at_home = np.array(home.position) + home.rotation @ TOOL
    assert cli.answer("inverse", *AT_TOOL)["position"] == list(home.position)
    turned = cli.answer("inverse", "--yaw-pitch-roll", *ANGLES, *AT_TOOL)
    assert_allclose(turned["tool_position"], at_home)
    assert_allclose(turned["position"], at_home - TURN @ TOOL)
    moved = cli.answer("inverse", "--position", *PLACE, *AT_TOOL)
    assert_allclose(moved["position"], np.array(PLACE) - home.rotation @ TOOL)
    assert_allclose(moved["quaternion"], home.quaternion)


def test_accuracy_is_that_of_the_tool(cli: CommandLine) -> None:
    found = cli.answer("accuracy", *POSE, "--errors", "0.2", *AT_TOOL)
    worst = explorer.worst_error(TOOLED, B4, TURN, [0.02] * 6, TOOL)
    assert found["worst_displacement"] == pytest.approx(float(worst.displacement))


def test_singularity_has_the_ellipsoids_of_the_tool(cli: CommandLine) -> None:
    found = cli.answer("singularity", *POSE, *AT_TOOL)
    pose = explorer.Pose.of(B4, TURN)
    expected = performance(TOOLED, pose, TOOL)
    for name in ("translation", "rotation"):
        assert_allclose(found["tool_ellipsoids"][name]["gain"], getattr(expected, name).gain)
        axes = np.array(found["tool_ellipsoids"][name]["axes"])
        assert_allclose(np.abs(axes @ getattr(expected, name).axes), np.eye(3), atol=1e-9)
    # Singular poses do not depend on the tool.
    same = cli.answer("singularity", "--position", *B4.tolist(), "--yaw-pitch-roll", *ANGLES)
    for key in ("margins", "determinant", "inverse_condition", "proximity", "stratum"):
        assert_allclose(found[key], same[key], rtol=1e-9)
    for ours, theirs in zip(found["nearest"], same["nearest"], strict=True):
        assert ours["distance"] == pytest.approx(theirs["distance"], rel=1e-6)
        rotation = Rotation.from_quat(ours["quaternion"], scalar_first=True).as_matrix()
        assert_allclose(ours["tool_position"], ours["position"] + rotation @ TOOL, atol=1e-9)


def test_forward_has_the_tool_of_each_mode(cli: CommandLine) -> None:
    joints = explorer.inverse(TOOLED, B4, TURN).tolist()
    for options in (AT_TOOL, AT_TOOL[:2]):
        modes = cli.answer("forward", "--joints", *joints, *options)["modes"]
        for mode in modes:
            rotation = Rotation.from_quat(mode["quaternion"], scalar_first=True).as_matrix()
            expected = mode["position"] + rotation @ TOOL
            assert_allclose(mode["tool_position"], expected, atol=1e-9)
        assert (
            min(float(np.linalg.norm(np.array(m["tool_position"]) - PLACE)) for m in modes) < 1e-9
        )
    assert "tool z" in cli.text("forward", "--joints", *joints, *AT_TOOL)
    plain = cli.answer("forward", "--joints", *joints)["modes"]
    assert all("tool_position" not in mode for mode in plain)


def test_path_of_the_tool_goes_straight(cli: CommandLine, tmp_path: Path) -> None:
    out = tmp_path / "path.csv"
    to = ["--to", "11", "5", "11", "--to-yaw-pitch-roll", "-85", "-10", "15"]
    where = ["--from", *POSE[1:4], "--from-yaw-pitch-roll", *POSE[5:]]
    found = cli.answer("path", *where, *to, *AT_TOOL, "--samples", "41", "--out", out)
    assert_allclose(found["poses"][0]["tool_position"], PLACE, atol=1e-9)
    assert_allclose(found["poses"][-1]["tool_position"], (11.0, 5.0, 11.0), atol=1e-9)
    assert_allclose(found["poses"][0]["position"], B4, atol=1e-9)
    assert len(found["poses"]) == 2
    timed = found["trajectory"]
    positions, tools = np.array(timed["position"]), np.array(timed["tool_position"])
    rotations = Rotation.from_quat(timed["quaternion"], scalar_first=True).as_matrix()
    assert_allclose(tools, positions + rotations @ TOOL, atol=1e-9)
    along = tools - tools[0]
    way = along[-1] / np.linalg.norm(along[-1])
    assert_allclose(along, (along @ way)[:, None] * way, atol=1e-9)
    # b4 goes along a curve, and every pose of it is within the limits.
    off = positions - positions[0]
    straight = off[-1] / np.linalg.norm(off[-1])
    assert np.linalg.norm(off - (off @ straight)[:, None] * straight, axis=1).max() > 0.05
    assert explorer.poses_are_valid(TOOLED, positions, rotations).all()
    head, *rows = csv.reader(out.read_text(encoding="utf-8").splitlines())
    assert head[-3:] == [f"tool_{axis} [10 mm]" for axis in "xyz"]
    assert_allclose([[float(word) for word in row[-3:]] for row in rows], tools)
    assert "tool position" in cli.text("path", *where, *to, *AT_TOOL)
    assert "tool_position" not in cli.answer("path", "--to", "11", "5", "8")["trajectory"]


def test_workspace_of_the_tool_is_moved_as_a_whole(cli: CommandLine) -> None:
    options = ["--step", "4", "--hull", "--interference", "--yaw-pitch-roll", *POSE[5:]]
    found, b4 = (cli.answer("workspace", *options, *more) for more in (AT_TOOL, AT_TOOL[:2]))
    for key, value in b4.items():
        if key != "extent":
            if key in ("mesh", "accessible_solid"):
                assert found[key]["volume"] == pytest.approx(value["volume"], rel=1e-9)
            elif key == "hull_volume":
                assert found[key] == pytest.approx(value, rel=1e-9)
            else:
                assert found[key] == value, key
    assert_allclose(found["extent"], np.array(b4["extent"]) + TURN @ TOOL)
    assert "of the tool point  1.00000  -0.500000  3.00000" in cli.text("workspace", *AT_TOOL)


def test_capability_and_orientations_are_those_of_the_tool(cli: CommandLine) -> None:
    share = cli.answer(
        "workspace", "--capability", *PLACE, "--samples", "3000", "--step", "4", *AT_TOOL
    )["orientation_capability"]
    assert share == explorer.orientation_capability(TOOLED, PLACE, 3000, TOOL)
    found = cli.answer("orientation", "--position", *PLACE, "--samples", "3000", *AT_TOOL)
    assert found["share"] == share
    assert found["tool_position"] == list(PLACE)
    assert "position" not in found
    assert found["greatest_tilt"] == explorer.greatest_tilt(TOOLED, PLACE, tool=TOOL).tilt
    assert found["tilts"] == tilt_map(TOOLED, PLACE, tool=TOOL).tilts.tolist()
    home = TOOLED.home_pose
    default = cli.answer("orientation", "--samples", "10", *AT_TOOL)
    assert_allclose(default["tool_position"], position_of(TOOLED, home, "tool"))
    assert default["home_connected"]


@pytest.mark.parametrize("what", ["workspace", "hull"])
def test_export_of_the_workspace_is_moved_to_the_tool(
    cli: CommandLine, tmp_path: Path, what: str
) -> None:
    files = [tmp_path / f"{name}.ply" for name in ("b4", "tool")]
    answers = [
        cli.answer("export", what, "--out", file, "--yaw-pitch-roll", *ANGLES, *options)
        for file, options in zip(files, (AT_TOOL[:2], AT_TOOL), strict=True)
    ]
    assert answers[1]["volume"] == pytest.approx(answers[0]["volume"], rel=1e-9)
    untyped: Any = trimesh
    b4, tool = (np.array(untyped.load(file, process=False).vertices) for file in files)
    assert_allclose(tool, b4 + TOOLED.unit_mm * TURN @ TOOL, atol=1e-9)
    named = tmp_path / "tool.obj"
    cli.answer("export", what, "--out", named, *AT_TOOL)
    assert f"o {what}_of_the_tool_of_tooled" in named.read_text()


def test_every_command_that_takes_a_position_takes_the_point() -> None:
    taking: list[str] = []
    for name in COMMANDS:
        command = load_command(name, COMMANDS)
        names = {field.name for field in dataclasses.fields(command)}
        if names & {"position", "from_", "capability"}:
            taking.append(name)
            assert "at" in names, name
    assert {"inverse", "screenshot", "export", "path", "orientation", "workspace"} <= {*taking}


def test_tool_too_far_away_is_refused(cli: CommandLine, tmp_path: Path) -> None:
    far = tmp_path / "far.json"
    far.write_bytes(explorer.encode_design(TOOLED).replace(b"3.0", b"3e9"))
    assert "tool" in cli.refusal("inverse", "--at", "tool", "--design", far)


def test_pose_with_a_point_at_a_position_is_inverse_to_the_position_of_the_point() -> None:
    rng = np.random.default_rng(0)
    for r in Rotation.random(50, random_state=rng).as_matrix():
        pose = explorer.Pose.of(rng.normal(size=3), r)
        x, y, z = rng.normal(size=3).tolist()
        for at in POINTS:
            there = open_state(TOOLED, view=View(at=at)).pose_at((x, y, z), pose)
            assert_allclose(position_of(TOOLED, there, at), (x, y, z), atol=1e-12)
            assert there.quaternion == pose.quaternion


PRESET = explorer.PRESETS["paper-optimal"]
POSITION = (10.0, 5.0, 9.0)
AT = ("orientation", "--position", "10", "5", "9")


def test_orientation_json_has_share_tilts_and_torsions(cli: CommandLine) -> None:
    found = cli.answer(*AT, "--torsion", "-60", "--samples", "5000")
    share = orientation_share(PRESET, POSITION, 5000)
    assert (found["share"], found["standard_error"]) == (share.share, share.standard_error)
    assert found["orientations"] == 5000
    least = explorer.greatest_tilt(PRESET, POSITION, -60.0)
    assert (found["greatest_tilt"], found["azimuth"]) == (least.tilt, least.azimuth)
    assert (found["torsion"], found["limit"]) == (-60.0, least.limit)
    tilts = tilt_map(PRESET, POSITION, -60.0)
    assert found["tilts"] == tilts.tilts.tolist()
    assert found["limits"] == list(tilts.limits)
    torsions = torsion_range(PRESET, POSITION, -60.0)
    assert found["torsion_range"] == [torsions.low, torsions.high]
    assert found["torsion_limits"] == [torsions.low_limit, torsions.high_limit]
    by_torsion = tilt_by_torsion(PRESET, POSITION)
    assert found["torsions"] == by_torsion.torsions.tolist()
    assert found["tilts_by_torsion"] == [
        None if np.isnan(tilt) else tilt for tilt in by_torsion.tilts.tolist()
    ]
    assert found["best_tilt"] == by_torsion.best.tilt >= found["greatest_tilt"]
    assert found["best_torsion"] == by_torsion.best.torsion
    assert found["home_connected"] is True


def test_orientation_text_has_a_line_for_each_azimuth(cli: CommandLine) -> None:
    text = cli.text(*AT)
    assert "share of all orientations" in text
    assert "ended by margin δ1" in text
    ends = [line for line in text.splitlines() if line.endswith(("δ1", "δ2", "order"))]
    assert len([line for line in ends if not line.startswith("greatest")]) == 72


def test_orientation_where_tilt_zero_violates_a_limit_says_so(cli: CommandLine) -> None:
    outside = ("orientation", "--position", "30", "5", "9", "--samples", "100")
    found = cli.answer(*outside)
    assert found["share"] == 0.0
    assert found["greatest_tilt"] is None
    assert found["torsion_range"] == [None, None]
    assert found["home_connected"] is False
    assert "none: tilt zero violates" in cli.text(*outside)


def test_tilt_torsion_gives_the_orientation(cli: CommandLine) -> None:
    found = cli.answer("inverse", "--position", "10", "5", "9", "--tilt-torsion", "30", "15", "-70")
    rotation = rotation_from_tilt_torsion([30.0, 15.0, -70.0])
    np.testing.assert_allclose(
        found["joints"], explorer.inverse(PRESET, POSITION, rotation), rtol=1e-12
    )
