"""The commands `forces` and `accuracy`: what the library computes, as JSON and as text."""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np
import pytest
from command_line import CommandLine
from numpy.testing import assert_allclose

import explorer
from explorer.mechanism.machine import STANDARD_GRAVITY
from explorer.prototype.assembly import make_prototype
from explorer.prototype.weights import machine_weights
from explorer.statics.weights import carry

POSE = ["--position", "8", "-2.5", "11", "--yaw-pitch-roll", "-60", "12.5", "-7"]
AT = (8.0, -2.5, 11.0), explorer.rotation_from_yaw_pitch_roll((-60.0, 12.5, -7.0))
OPTIMAL = explorer.PRESETS["paper-optimal"]
LOAD = [1.0, -2.0, 3.0, 4.0, 5.0, -6.0]
MACHINE = msgspec.structs.replace(
    OPTIMAL,
    tool=explorer.Tool(position=(0.5, 0.25, 1.0)),
    payload=explorer.Payload(0.3, (0.0, 0.0, 1.0)),
    actuators=explorer.Actuators(
        push_n=(90.0, 80.0, 70.0, 60.0, 50.0, 40.0),
        error_mm=(0.1, 0.2, 0.1, 0.2, 0.1, 0.1),
        stiffness_n_mm=(50.0, 60.0, 50.0, 60.0, 50.0, 40.0),
    ),
    struts=explorer.Struts(outer_mm=8.0, inner_mm=6.0, stress_mpa=200.0),
    guide=explorer.Guide(force_n=100.0, moment_nm=5.0),
    tolerances=explorer.Tolerances(a3=(0.1, 0.2, 0.0)),
)


@pytest.fixture
def machine(tmp_path: Path) -> Path:
    """Return the file of a design with all parts of a machine."""
    path = tmp_path / "machine.json"
    path.write_bytes(explorer.encode_design(MACHINE))
    return path


def test_forces_json_has_those_of_the_load(cli: CommandLine) -> None:
    found = cli.answer("forces", *POSE, "--load", *LOAD)
    assert_allclose(found["actuator_forces"], explorer.actuator_forces(OPTIMAL, *AT, LOAD))
    assert_allclose(found["strut_bending"], explorer.strut_bending(OPTIMAL, *AT, LOAD))
    assert found["largest_force"] is found["largest_payload"] is found["worst_direction"] is None
    assert not any(found["shares"].values())
    three = cli.answer("forces", *POSE, "--load", *LOAD[:3])
    expected = explorer.actuator_forces(OPTIMAL, *AT, [*LOAD[:3], 0.0, 0.0, 0.0])
    assert_allclose(three["actuator_forces"], expected)


def test_forces_with_limits_have_a_largest_force(cli: CommandLine, machine: Path) -> None:
    tool = MACHINE.tool.position
    found = cli.answer("forces", *POSE, "--most", "50", "--at", "tool", "--design", machine)
    b4 = np.array(AT[0]) - AT[1] @ tool
    expected = explorer.largest_force(MACHINE, b4, AT[1], [50.0] * 6, tool)
    assert found["largest_force"] == pytest.approx(float(expected))
    own = cli.answer("forces", *POSE, "--design", machine)
    expected = explorer.largest_force(MACHINE, *AT, MACHINE.actuators.limits[0])
    assert own["largest_force"] == pytest.approx(float(expected))
    assert own["worst_actuator"] in explorer.JOINTS
    assert own["largest_payload"] == pytest.approx(float(explorer.largest_payload(MACHINE, *AT)))
    assert max(own["shares"].values()) > 0.0


def test_an_added_force_has_the_direction_that_is_worst_with_the_load(
    cli: CommandLine, machine: Path
) -> None:
    given = ["forces", *POSE, "--design", machine, "--at", "tool"]
    found = cli.answer(*given, "--load", *LOAD, "--force", "7")["worst_force"]
    force = 7.0 * np.array(found["direction"]) + LOAD[:3]
    there = cli.answer(*given, "--load", *force, *LOAD[3:])
    assert max(there["shares"].values()) == pytest.approx(found["share"], rel=1e-9)
    assert there["shares"][found["part"]] == max(there["shares"].values())
    free = cli.answer("forces", *POSE, "--force", "7")["worst_force"]
    assert (free["direction"], free["part"], free["share"]) == (None, None, 0.0)


def test_where_a_load_is_not_held_the_nearest_position_is_told(
    cli: CommandLine, machine: Path
) -> None:
    given = ["forces", "--design", machine, "--at", "tool", "--load", "0", "0", "-30"]
    low = ["--position", "10", "5", "4"]
    found = cli.answer(*given, *low)
    nearest = found["nearest_held"]
    assert max(found["shares"].values()) > 1.0
    there = cli.answer(
        *given, "--position", *nearest["tool_position"], "--quaternion", *nearest["quaternion"]
    )
    assert 0.999 < max(there["shares"].values()) <= 1.0
    assert there["nearest_held"] is None
    text = cli.text(*given, *low)
    assert "gives way" in text
    assert "nearest position that holds the load" in text


def test_parts_of_the_prototype_weigh_in_place_of_bars(cli: CommandLine) -> None:
    design = explorer.PRESETS["paper-optimal"]
    weights = machine_weights(design, make_prototype(design).masses(2700.0), payload=False)
    carried = carry(design, *AT, weights).wrench
    expected = explorer.actuator_forces(design, *AT, carried)
    found = cli.answer("forces", *POSE, "--density", "2700", "--parts")
    assert_allclose(found["actuator_forces"], expected)
    assert "--density" in cli.refusal("forces", *POSE, "--parts")


def test_a_part_with_a_limit_tells_its_share_though_nothing_loads_it(
    cli: CommandLine, machine: Path
) -> None:
    given = ["forces", *POSE, "--design", machine, "--payload", "0"]
    text = cli.text(*given)
    assert text.count("0.0 %") == 10
    for words in ("force, N", "bending, N x unit", "largest payload", "worst direction"):
        assert words in text
    assert "load acts at  b4" in text
    assert "load acts at  the tool" in cli.text(*given, "--at", "tool")
    free = cli.text("forces", *POSE)
    assert "%" not in free
    assert "no limit" in free


def test_forces_of_payload_are_those_of_its_weight(cli: CommandLine, machine: Path) -> None:
    found = cli.answer("forces", *POSE, "--payload", "2", "--design", machine)
    arm = AT[1] @ np.array([0.0, 0.0, 1.0])
    weight = np.array([0.0, 0.0, -2.0 * STANDARD_GRAVITY])
    load = [*weight, *np.cross(arm, weight)]
    assert_allclose(found["actuator_forces"], explorer.actuator_forces(MACHINE, *AT, load))
    none = cli.answer("forces", *POSE, "--payload", "0", "--design", machine)
    assert not any(none["actuator_forces"])


def test_forces_json_has_what_the_process_may_add(cli: CommandLine, tmp_path: Path) -> None:
    design = msgspec.structs.replace(MACHINE, payload=explorer.Payload(0.3, (0.0, 0.0, 1.0), 7.0))
    path = tmp_path / "process.json"
    path.write_bytes(explorer.encode_design(design))
    found = cli.answer("forces", *POSE, "--design", path)
    # A force of any direction adds the length of the row of what unit forces along the axes do.
    tool = design.tool.position
    rows = np.array([explorer.actuator_forces(design, *AT, unit, tool) for unit in np.eye(6)[:3]])
    process = np.array(list(found["process"].values()))
    assert_allclose(process[:6], 7.0 * np.linalg.norm(rows, axis=0))
    # The shares are those of the forces with what the process adds.
    forces, push = np.array(found["actuator_forces"]), np.array(design.actuators.push_n)
    shares = np.array(list(found["shares"].values()))[:6]
    assert_allclose(shares, (np.abs(forces) + process[:6]) / push)
    assert "process, ± N" in cli.text("forces", *POSE, "--design", path)
    assert not any(cli.answer("forces", *POSE)["process"].values())


def test_accuracy_json_has_errors_compliance_and_deflection(
    cli: CommandLine, machine: Path
) -> None:
    found = cli.answer("accuracy", *POSE, "--load", *LOAD, "--payload", "0", "--design", machine)
    precision = explorer.pose_precision(MACHINE, *AT)
    assert_allclose(found["compliance"], precision.compliance)
    assert_allclose(found["deflection"], explorer.deflection(precision.compliance, LOAD))
    assert found["worst_displacement"] == pytest.approx(float(precision.worst.displacement))
    assert found["worst_turn"] == pytest.approx(float(precision.worst.turn))
    assert_allclose(found["pose_error_by_geometry"], precision.by_geometry, atol=1e-12)
    assert sum(found["deflection_shares"].values()) == pytest.approx(1.0)
    assert len(found["dimensions"]) == len(found["displacement_by_geometry"]) == 23


def test_accuracy_options_replace_those_of_the_design(cli: CommandLine) -> None:
    options = ["--errors", "0.1", "--stiffness", "50", "60", "50", "60", "50", "40"]
    found = cli.answer("accuracy", *POSE, *options)
    worst = explorer.worst_error(OPTIMAL, *AT, [0.01] * 6)
    assert found["worst_displacement"] == pytest.approx(float(worst.displacement))
    stiffness = 10.0 * np.array([50.0, 60.0, 50.0, 60.0, 50.0, 40.0])
    assert_allclose(found["compliance"], explorer.compliance(OPTIMAL, *AT, stiffness))
    assert "softest first" in cli.text("accuracy", *POSE, *options)


def test_accuracy_of_ideal_design_is_exact_and_rigid(cli: CommandLine) -> None:
    found = cli.answer("accuracy", *POSE, "--load", *LOAD)
    assert found["worst_displacement"] == found["worst_turn"] == 0.0
    assert not any(found["deflection"])
    assert found["deflection_shares"] == {"guide": None, "struts": None, "actuators": None}
    assert "rigid: the design states no stiffness" in cli.text("accuracy", *POSE)


@pytest.mark.parametrize("command", ["forces", "accuracy"])
def test_statics_of_singular_pose_have_no_answer(cli: CommandLine, command: str) -> None:
    pose = ["--position", "3", "4", "0", "--quaternion", "0.8", "0.3", "0.2", "0.4"]
    message = cli.refusal(command, *pose, status=1)
    assert "the pose is singular (δ3 = 0: b4 on the base plane)" in message


@pytest.mark.parametrize(
    ("argv", "words"),
    [
        (["forces", "--load", "1", "2"], "--load needs a force fx fy fz"),
        (["forces", "--load", "1", "2", "nan"], "fz must be a finite number"),
        (["forces", "--payload", "-1"], "--payload must be a number of at least 0; got -1"),
        (["forces", "--most", "0"], "six positive numbers"),
        (["forces", "--at", "b2"], "--at"),
        (["forces", "--density", "0"], "--density must be a positive number"),
        (["accuracy", "--errors", "-1"], "actuators.error_mm must not be negative; got -1"),
        (["accuracy", "--stiffness", "0"], "actuators.stiffness_n_mm must be positive; got 0"),
    ],
)
def test_statics_unusable_options_are_refused(
    cli: CommandLine, argv: list[str], words: str
) -> None:
    assert words in cli.refusal(*argv)
