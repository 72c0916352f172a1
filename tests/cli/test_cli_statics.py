"""The commands `forces`, `accuracy` and `budget` answer what the library computes."""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np
import pytest
from command_line import CommandLine
from machines import PRECISE
from numpy.testing import assert_allclose

import explorer
from explorer.measures.box import positions_over
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design_file import typical_machine
from explorer.motion.masses import moving_bodies
from explorer.motion.weights import carry, payload_wrench
from explorer.prototype.assembly import make_prototype
from explorer.statics.accuracy import (
    SOURCES,
    actuator_errors,
    error_by_source,
    largest_error,
    rms_of_sources,
    source_errors,
    stated_tolerances,
)
from explorer.statics.budget import source_costs
from explorer.statics.compliance import deflection, stiffness_of
from explorer.statics.loaded import LoadedPose

POSE = ["--position", "8", "-2.5", "11", "--yaw-pitch-roll", "-60", "12.5", "-7"]
AT = (8.0, -2.5, 11.0), explorer.rotation_from_yaw_pitch_roll((-60.0, 12.5, -7.0))
OPTIMAL = explorer.PRESETS["paper-optimal"]
LOAD = [1.0, -2.0, 3.0, 4.0, 5.0, -6.0]
MACHINE = msgspec.structs.replace(
    PRECISE,
    payload=explorer.Payload(0.3, (0.0, 0.0, 1.0)),
    guide=explorer.Guide(force_n=100.0, moment_nm=5.0),
    tolerances=explorer.Tolerances(a3=(0.1, 0.2, 0.0)),
)


def test_forces_json_has_those_of_the_load(cli: CommandLine) -> None:
    found = cli.answer("forces", *POSE, "--load", *LOAD)
    assert_allclose(found["actuator_forces"], explorer.actuator_forces(OPTIMAL, *AT, LOAD))
    assert_allclose(found["strut_bending"], explorer.strut_bending(OPTIMAL, *AT, LOAD))
    assert found["largest_force"] is found["largest_payload"] is found["worst_direction"] is None
    assert not any(found["shares"].values())
    three = cli.answer("forces", *POSE, "--load", *LOAD[:3])
    expected = explorer.actuator_forces(OPTIMAL, *AT, [*LOAD[:3], 0.0, 0.0, 0.0])
    assert_allclose(three["actuator_forces"], expected)


def test_forces_with_limits_have_a_largest_force(cli: CommandLine) -> None:
    tool = MACHINE.tool.position
    found = cli.answer("forces", *POSE, "--most", "50", "--at", "tool", "--design", MACHINE)
    b4 = np.array(AT[0]) - AT[1] @ tool
    expected = explorer.largest_force(MACHINE, b4, AT[1], [50.0] * 6, tool)
    assert found["largest_force"] == pytest.approx(float(expected))
    own = cli.answer("forces", *POSE, "--design", MACHINE)
    expected = explorer.largest_force(MACHINE, *AT, MACHINE.actuators.limits[0])
    assert own["largest_force"] == pytest.approx(float(expected))
    assert own["worst_actuator"] in explorer.JOINTS
    assert own["largest_payload"] == pytest.approx(
        float(explorer.largest_payload(explorer.Configuration(MACHINE, *AT)))
    )
    assert max(own["shares"].values()) > 0.0


def test_an_added_force_has_the_direction_that_is_worst_with_the_load(cli: CommandLine) -> None:
    given = ["forces", *POSE, "--design", MACHINE, "--at", "tool"]
    found = cli.answer(*given, "--load", *LOAD, "--force", "7")["worst_force"]
    force = 7.0 * np.array(found["direction"]) + LOAD[:3]
    there = cli.answer(*given, "--load", *force, *LOAD[3:])
    assert max(there["shares"].values()) == pytest.approx(found["share"], rel=1e-9)
    assert there["shares"][found["part"]] == max(there["shares"].values())
    free = cli.answer("forces", *POSE, "--force", "7")["worst_force"]
    assert (free["direction"], free["part"], free["share"]) == (None, None, 0.0)


def test_where_a_load_is_not_held_the_nearest_position_is_told(cli: CommandLine) -> None:
    given = ["forces", "--design", MACHINE, "--at", "tool", "--load", "0", "0", "-30"]
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
    assert "Does not hold the load" in text
    assert "from here, with the tool at" in text


def test_parts_of_the_prototype_weigh_in_place_of_bars(cli: CommandLine) -> None:
    design = explorer.PRESETS["paper-optimal"]
    weights = moving_bodies(design, make_prototype(design).masses(2700.0), payload=False)
    carried = carry(Configuration(design, *AT), weights).wrench
    expected = explorer.actuator_forces(design, *AT, carried)
    found = cli.answer("forces", *POSE, "--density", "2700", "--parts")
    assert_allclose(found["actuator_forces"], expected)
    assert "--density" in cli.refusal("forces", *POSE, "--parts")


def test_forces_without_the_payload_leave_its_inertia_out(cli: CommandLine) -> None:
    body = explorer.Payload(0.3, (0.0, 0.0, 1.0), inertia_kg_mm2=(3.0, 4.0, 5.0))
    heavy = msgspec.structs.replace(MACHINE, payload=body)
    found = cli.answer("forces", *POSE, "--payload", 0, "--design", heavy)
    assert found == cli.answer("forces", *POSE, "--payload", 0, "--design", MACHINE)
    assert body.with_mass(0.0).inertia_kg_mm2 == (0.0, 0.0, 0.0)
    assert body.with_mass(2.0) == msgspec.structs.replace(body, mass_kg=2.0)


def test_forces_of_payload_are_those_of_its_weight(cli: CommandLine) -> None:
    for mass in (2.0, 0.0):
        found = cli.answer("forces", *POSE, "--payload", mass, "--design", MACHINE)
        payload = msgspec.structs.replace(MACHINE.payload, mass_kg=mass)
        weight = payload_wrench(msgspec.structs.replace(MACHINE, payload=payload), AT[1])
        expected = explorer.actuator_forces(MACHINE, *AT, weight, MACHINE.tool.position)
        assert_allclose(found["actuator_forces"], expected)


def test_forces_json_has_what_the_process_may_add(cli: CommandLine) -> None:
    design = msgspec.structs.replace(MACHINE, payload=explorer.Payload(0.3, (0.0, 0.0, 1.0), 7.0))
    found = cli.answer("forces", *POSE, "--design", design)
    loaded = LoadedPose(design, explorer.Pose.of(*AT), point=(0.0, 0.0, 0.0))
    assert_allclose(list(found["process"].values())[:6], loaded.reactions.spread[:6])
    assert_allclose(list(found["shares"].values()), loaded.shares)
    assert "payload's force, ± N" in cli.text("forces", *POSE, "--design", design)
    assert not any(cli.answer("forces", *POSE)["process"].values())


def test_accuracy_json_has_errors_compliance_and_deflection(cli: CommandLine) -> None:
    found = cli.answer("accuracy", *POSE, "--load", *LOAD, "--payload", "0", "--design", MACHINE)
    soft = explorer.compliance(MACHINE, *AT, *stiffness_of(MACHINE))
    worst = explorer.worst_error(MACHINE, *AT, actuator_errors(MACHINE))
    assert_allclose(found["compliance"], soft)
    assert_allclose(found["deflection"], deflection(soft, LOAD))
    assert found["worst_displacement"] == pytest.approx(float(worst.displacement))
    assert found["worst_turn"] == pytest.approx(float(worst.turn))
    assert_allclose(
        found["pose_error_by_geometry"], explorer.pose_error_by_geometry(MACHINE, *AT), atol=1e-12
    )
    assert sum(found["deflection_shares"].values()) == pytest.approx(1.0)
    assert len(found["dimensions"]) == len(found["displacement_by_geometry"]) == 23
    assert len(found["displacement_by_square"]) == len(found["turn_by_square"]) == 2


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
    assert "Rigid: the design states no stiffness" in cli.text("accuracy", *POSE)


HOME = OPTIMAL.home_pose
BOX = (8.0, 3.0, 7.0, 12.0, 7.0, 11.0)
OVER_BOX = ("--required-box", *BOX)
POSITIONS = positions_over(OPTIMAL, "box", HOME, (BOX[:3], BOX[3:]))
EACH = (0.1, 0.2, 0.15)
STATED = msgspec.structs.replace(
    OPTIMAL,
    tool=explorer.Tool((0.5, 0.25, 1.0)),
    actuators=explorer.Actuators(error_mm=(0.01, 0.02, 0.01, 0.02, 0.01, 0.03)),
    tolerances=explorer.Tolerances(a3=EACH, b1=EACH, guide_tilt_deg=(0.1, 0.0)),
)


def test_budget_without_wanted_precision_ranks_the_costs(cli: CommandLine) -> None:
    found = cli.answer("budget", "--design", STATED, *OVER_BOX, "--at", "tool")
    costs = source_costs(Configuration(STATED, POSITIONS, HOME.rotation, STATED.tool.position))
    assert found["count"] == 729
    assert found["ranking"] == [SOURCES[k] for k in costs.ranking]
    assert_allclose(found["displacement"], costs.displacement)
    assert_allclose(found["turn_within"], costs.turn_within)
    assert_allclose(found["stated"], stated_tolerances(STATED))
    assert found["worst_displacement"] == pytest.approx(costs.worst_displacement)
    assert found["tolerances"] is found["effort"] is found["out"] is None
    assert found["assumed"] == []
    text = cli.text("budget", "--design", STATED, *OVER_BOX)
    assert "worst over 729 nodes of a grid over the box" in text
    rows = [line for line in text.splitlines() if line.split(" ")[0] in SOURCES]
    rows += [line for line in text.splitlines() if line.startswith(("guide ", "strut "))]
    assert len(rows) == 31
    assert "found" not in text


def test_budget_writes_the_design_that_keeps_what_is_wanted(
    cli: CommandLine, tmp_path: Path
) -> None:
    out = tmp_path / "better.json"
    wanted = ["--wanted", "0.05", "--wanted-turn", "0.04"]
    found = cli.answer("budget", "--design", STATED, *OVER_BOX, *wanted, "--out", out)
    better = explorer.load_design(str(out))
    assert found["out"] == str(out)
    assert_allclose(stated_tolerances(better), found["tolerances"])
    costs = source_costs(Configuration(better, POSITIONS, HOME.rotation))
    assert found["worst_displacement"] == costs.worst_displacement <= 0.05
    assert found["worst_turn"] == costs.worst_turn <= 0.04
    assert found["effort"] >= found["least_effort"] > 0.0
    # The command ranks what it wrote.
    again = cli.answer("budget", "--design", out, *OVER_BOX)
    assert again["ranking"] == found["ranking"]
    assert better.name == STATED.name
    text = cli.text("budget", "--design", STATED, *OVER_BOX, *wanted, "--out", out)
    for words in ("of the wanted 0.05 mm", "of the wanted 0.04°", "above the least", str(out)):
        assert words in text


def test_kept_errors_of_actuators_stay_or_are_refused(cli: CommandLine) -> None:
    given = ["budget", "--design", STATED, *OVER_BOX, "--keep-actuators"]
    found = cli.answer(*given, "--wanted", "1")
    assert_allclose(found["tolerances"][:6], STATED.actuators.error_mm)
    message = cli.refusal(*given, "--wanted", "0.05", status=1)
    assert "the errors of the actuators alone move the tool by up to" in message


def test_typical_values_are_told(cli: CommandLine) -> None:
    typical, words = typical_machine(OPTIMAL)
    for command in ("budget", "accuracy"):
        found = cli.answer(command, "--typical")
        assert found["assumed"] == list(words)
        line = cli.text(command, "--typical").splitlines()[1]
        assert line == f"assumed, since the design states none: {'; '.join(words)}"
        assert "assumed" not in cli.text(command)
        # Stated values stay.
        own = cli.answer(command, "--typical", "--design", STATED)["assumed"]
        assert len(own) == 2
    costs = source_costs(Configuration(typical, [HOME.position], HOME.rotation))
    found = cli.answer("budget", "--typical")
    assert found["worst_displacement"] == pytest.approx(costs.worst_displacement)
    # Given errors are not assumed.
    given = cli.answer("accuracy", "--typical", "--errors", "0.2")
    assert not any("errors" in words for words in given["assumed"])


def test_accuracy_has_totals_of_dimensions_and_of_all_sources(cli: CommandLine) -> None:
    found = cli.answer("accuracy", "--design", STATED)
    by_source = error_by_source(explorer.Configuration(STATED, HOME.position, HOME.rotation))
    bounds = source_errors(STATED)
    for name, sources in (("dimensions", slice(6, 31)), ("all", slice(0, 31))):
        worst = largest_error(by_source[:, sources], bounds[sources])
        rms = rms_of_sources(by_source[:, sources], bounds[sources])
        for kind in ("displacement", "turn"):
            assert found[f"worst_{kind}_of_{name}"] == pytest.approx(float(getattr(worst, kind)))
            assert found[f"rms_{kind}_of_{name}"] == pytest.approx(float(getattr(rms, kind)))
    # The first keys are those of the actuators.
    actuators = explorer.worst_error(STATED, HOME.position, HOME.rotation, bounds[:6])
    assert found["worst_displacement"] == pytest.approx(float(actuators.displacement))
    text = cli.text("accuracy", "--design", STATED)
    assert "all, worst" in text
    assert "all, worst" not in cli.text("accuracy", "--errors", "0.1")


def test_budget_about_singular_positions_has_no_answer(cli: CommandLine) -> None:
    message = cli.refusal("budget", "--over", "box", status=1)
    assert "δ3 = 0: b4 on the base plane" in message
    assert "the pose is singular" in cli.refusal("budget", "--position", "3", "4", "0", status=1)
    unboxed = OPTIMAL.with_limits(box=None)
    assert "need a box" in cli.refusal("budget", "--over", "box", "--design", unboxed)


@pytest.mark.parametrize(
    ("load", "words"),
    [(("0", "0", "-10"), "no forces hold it"), (("10", "0", "0"), "held, but by no unique forces")],
)
def test_forces_in_a_singular_pose_say_whether_the_load_is_held(
    cli: CommandLine, load: tuple[str, ...], words: str
) -> None:
    given = ("forces", "--position", "10", "5", "0", "--load", *load)
    assert words in cli.refusal(*given, status=1)
    assert words in cli.answer(*given, status=1)["message"]
