"""The commands that answers name give these answers."""

from __future__ import annotations

import shlex

import msgspec
import pytest
from command_line import CommandLine
from numpy.testing import assert_allclose

import explorer
from explorer.measures.blocks.commands import load_command, name_of, pose_command
from explorer.statics.loaded import LoadedPose, ToolPrecision

OPTIMAL = explorer.PRESETS["paper-optimal"]
POSE = explorer.Pose.of_yaw_pitch_roll((8.0, -2.5, 11.0), (-60.0, 9.0, -7.0))
LOAD = (1.0, 2.0, -10.0, 0.0, 3.0, 0.5)


def arguments(command: str) -> list[str]:
    program, *argv = shlex.split(command)
    assert program == "explorer"
    return argv


@pytest.mark.parametrize("weighs_payload", [True, False])
def test_command_of_forces_gives_the_forces(cli: CommandLine, weighs_payload: bool) -> None:
    loaded = LoadedPose(OPTIMAL, POSE, LOAD, weighs_payload=weighs_payload)
    answer = cli.answer(*arguments(load_command("forces", loaded)))
    assert_allclose(answer["actuator_forces"], loaded.reactions.actuators)
    assert "--density 1240 --parts" in load_command("forces", loaded, 1240.0)


def test_command_of_precision_and_of_margins_gives_them(cli: CommandLine) -> None:
    precision = ToolPrecision(LoadedPose(OPTIMAL, POSE, LOAD))
    answer = cli.answer(*arguments(load_command("accuracy", precision.loaded)))
    assert_allclose(answer["compliance"], precision.compliance, rtol=1e-9)
    answer = cli.answer(*arguments(pose_command("singularity", OPTIMAL, POSE)))
    assert_allclose(answer["margins"], explorer.evaluate(OPTIMAL, POSE).margins)


def test_command_of_a_design_that_is_no_preset_needs_its_file() -> None:
    other = msgspec.structs.replace(OPTIMAL, unit_mm=3.0)
    assert name_of(OPTIMAL) == "paper-optimal"
    command = pose_command("singularity", other, POSE)
    assert command.startswith("explorer singularity --design design.json --position 8.0")
