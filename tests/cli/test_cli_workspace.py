"""`explorer workspace` answers what the package measures, and refuses what it cannot."""

from __future__ import annotations

import re
from dataclasses import replace

import msgspec
import pytest
from command_line import CommandLine

import explorer
from explorer.legs.clearance import PAIRS
from explorer.workspace.accessible.radii import with_radius
from explorer.workspace.orientations.share import (
    cone_of_directions,
    orientation_capability,
    yaw_pitch_roll_range,
)
from explorer.workspace.slices.volume import node_count_of, workspace_volume
from explorer.workspace.solids.solid import Solid, convex_hull
from explorer.workspace.solids.solids import inclusive_solid, total_solid, workspace_solid
from explorer.workspace.workspace import Workspace

COMMAND = ("workspace",)
OPTIMAL = explorer.PRESETS["paper-optimal"]
COARSE = ["--tolerance", "0.4"]
KEYS = {
    *("volume", "gradient", "empty_because", "node_step", "node_count", "node_volume"),
    *("extent", "mesh", "mean_inverse_condition", "mean_transmission_index"),
}


def test_workspace_json_has_the_public_measures(cli: CommandLine) -> None:
    found = cli.answer()
    assert set(found) == KEYS
    volume, nodes, solid = (
        workspace_volume(OPTIMAL),
        node_count_of(Workspace(OPTIMAL)),
        workspace_solid(OPTIMAL),
    )
    assert found["volume"] == pytest.approx(volume.volume, rel=1e-12)
    assert found["gradient"].keys() == volume.gradient.keys()
    assert found["empty_because"] == []
    assert (found["node_count"], found["node_volume"], found["node_step"]) == (999, 7992.0, 2.0)
    assert found["extent"] == [list(ends) for ends in nodes.extent or ()]
    assert found["mesh"] == {
        "volume": pytest.approx(solid.volume, rel=1e-12),
        "triangles": len(solid.faces),
        "watertight": True,
    }


def test_workspace_disagreeing_mesh_is_reported(
    cli: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    wrong = replace(workspace_solid(OPTIMAL), agrees=False)

    def make(*_args: object, **_options: object) -> Solid:
        return wrong

    monkeypatch.setattr("explorer.workspace.solids.solids.whole_solid", make)
    assert cli.answer()["mesh_agrees"] is False
    assert "its volume does not agree with the exact one" in cli.text()


def test_workspace_orientation_step_and_tolerance_are_used(cli: CommandLine) -> None:
    found = cli.answer("--yaw-pitch-roll", "-60", "5", "2", "--step", "3", *COARSE, "--hull")
    rotation = explorer.rotation_from_yaw_pitch_roll([-60.0, 5.0, 2.0])
    assert found["volume"] == pytest.approx(workspace_volume(OPTIMAL, rotation).volume, rel=1e-9)
    assert found["node_count"] == node_count_of(Workspace(OPTIMAL, rotation), 3.0).count
    solid = workspace_solid(OPTIMAL, rotation, 0.4)
    assert found["mesh"]["triangles"] == len(solid.faces)
    assert found["hull_volume"] == pytest.approx(convex_hull(solid).volume, rel=1e-9)


def test_workspace_empty_has_status_0(cli: CommandLine) -> None:
    empty = OPTIMAL.with_limits(gap=50.0)
    found = cli.answer("--design", empty, "--hull")
    assert found["volume"] == found["node_count"] == found["hull_volume"] == 0
    assert found["extent"] is None
    assert found["empty_because"] == ["gap |d1 − d3|"]
    assert found["mesh"] == {"volume": 0.0, "triangles": 0, "watertight": False}
    assert "empty because of gap |d1 − d3|" in cli.text("--design", empty)


def test_workspace_ranges_and_tilts_add_two_volumes(cli: CommandLine) -> None:
    found = cli.answer(
        "--yaw-range", "-80", "-65", "--roll-range", "0", "6", "--samples", "3", *COARSE
    )
    home = explorer.yaw_pitch_roll_from_rotation(OPTIMAL.home_pose.rotation)
    pitch = float(home[1])
    rotations = yaw_pitch_roll_range([-80.0, pitch, 0.0], [-65.0, pitch, 6.0], [3, 1, 3])
    assert found["orientations"] == 9
    for key, make in (("inclusive_mesh", inclusive_solid), ("total_mesh", total_solid)):
        assert set(found[key]) == {"volume", "triangles", "watertight"}
        assert found[key]["volume"] == pytest.approx(make(OPTIMAL, rotations, 0.4).volume, rel=1e-6)
    assert found["total_mesh"]["volume"] < found["mesh"]["volume"]
    assert found["mesh"]["volume"] < found["inclusive_mesh"]["volume"]
    tilted = cli.answer("--tilt", "8", "--samples", "5", *COARSE)
    rotations = cone_of_directions(OPTIMAL.home_pose.rotation, 8.0, 5)
    assert tilted["orientations"] == 5
    volume = inclusive_solid(OPTIMAL, rotations, 0.4).volume
    assert tilted["inclusive_mesh"]["volume"] == pytest.approx(volume, rel=1e-6)
    page = cli.text("--tilt", "8", "--samples", "5", "--hull", "--capability", 10, 5, 9, *COARSE)
    for word in ("exact volume", "node volume", "999 nodes", "mesh", "convex hull", "inclusive"):
        assert word in page
    for word in ("total", "5 orientations", "watertight", "b1x", "capability"):
        assert word in page


def test_workspace_capability_is_over_the_given_orientations(cli: CommandLine) -> None:
    position = ["--capability", "10", "5", "9"]
    found = cli.answer(*position, "--samples", "2000", *COARSE)
    share = orientation_capability(OPTIMAL, [10.0, 5.0, 9.0], 2000)
    assert found["orientation_capability"] == pytest.approx(share, abs=1e-12)
    assert 0.0 < share < 1.0
    near = cli.answer(*position, "--tilt", "1", *COARSE)
    assert near["orientation_capability"] == 1.0


def test_workspace_interference_adds_the_accessible_volume(cli: CommandLine) -> None:
    found = cli.answer("--interference", "--radii", "0.2")
    assert set(found) == KEYS | {
        *("accessible_volume", "accessible_node_count", "harmless_radius", "pairs"),
        "accessible_solid",
    }
    expected = explorer.accessible_workspace(with_radius(OPTIMAL, 0.2))
    assert found["accessible_volume"] == pytest.approx(expected.accessible_volume, rel=1e-9)
    assert found["accessible_volume"] < found["volume"]
    assert found["accessible_node_count"] == expected.accessible_node_count < found["node_count"]
    assert found["accessible_solid"]["watertight"]
    assert [tuple(pair["legs"]) for pair in found["pairs"]] == list(PAIRS)
    for pair, own in zip(found["pairs"], expected.pairs, strict=True):
        assert set(pair) == {"legs", "clearance", "bound", "blocked_volume"}
        assert pair["clearance"] == pytest.approx(own.clearance, abs=1e-9)
        assert pair["blocked_volume"] == pytest.approx(own.blocked_volume, rel=1e-6)
    text = cli.text("--interference", "--radii", "0.2", "--radius-curve")
    assert "943 of 999 nodes" in text
    assert "no radius is harmless" in text


def test_workspace_with_a_load_has_the_volume_that_holds_it(cli: CommandLine) -> None:
    actuators = explorer.Actuators(push_n=(60.0, 50.0, 40.0, 50.0, 45.0, 70.0))
    limited = msgspec.structs.replace(OPTIMAL, actuators=actuators)
    found = cli.answer("--design", limited, "--load", 0, 0, -20)
    assert 0.0 < found["held_volume"] < found["volume"]
    assert found["held_mesh"]["watertight"]
    assert "that holds the load" in cli.text("--design", limited, "--load", 0, 0, -20)
    refusal = cli.refusal("--design", "paper-optimal", "--load", 0, 0, -20)
    assert "so that it holds any load" in refusal
    assert "held_factor" not in found
    heavy = cli.answer("--design", limited, "--load", 0, 0, -1e5)
    assert heavy["held_volume"] == heavy["held_mesh"]["triangles"] == 0
    assert 0.0 < heavy["held_factor"] < 1e-2
    text = cli.text("--design", limited, "--load", 0, 0, -1e5)
    assert re.search(r"empty because of actuator \w+; 0\.\d+ of load and payload", text)
