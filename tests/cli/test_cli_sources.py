"""The commands and the Python lines that answers name give these answers."""

from __future__ import annotations

import shlex

import msgspec
import pytest
from command_line import CommandLine
from numpy.testing import assert_allclose

import explorer
from explorer.measures.blocks.source import load_source, name_of, pose_source
from explorer.statics.loaded import LoadedPose, ToolPrecision

OPTIMAL = explorer.PRESETS["paper-optimal"]
POSE = explorer.Pose.of_yaw_pitch_roll((8.0, -2.5, 11.0), (-60.0, 9.0, -7.0))
LOAD = (1.0, 2.0, -10.0, 0.0, 3.0, 0.5)


def values_of(source: tuple[str, ...]) -> dict[str, object]:
    """Return the names that the Python lines define."""
    names: dict[str, object] = {}
    exec("\n".join(source), names)
    return names


def arguments(command: str) -> list[str]:
    program, *argv = shlex.split(command)
    assert program == "explorer"
    return argv


@pytest.mark.parametrize("weighs_payload", [True, False])
def test_source_of_forces_gives_the_forces(cli: CommandLine, weighs_payload: bool) -> None:
    loaded = LoadedPose(OPTIMAL, POSE, LOAD, weighs_payload=weighs_payload)
    source = load_source("forces", loaded)
    found = values_of(source.python)["loaded"]
    assert isinstance(found, LoadedPose)
    assert_allclose(found.reactions.actuators, loaded.reactions.actuators)
    cli.capsys.readouterr()
    answer = cli.answer(*arguments(source.command))
    assert_allclose(answer["actuator_forces"], loaded.reactions.actuators)
    assert "--density 1240 --parts" in load_source("forces", loaded, 1240.0).command
    assert "own" in values_of(load_source("accuracy", loaded, 1240.0).python)


def test_source_of_precision_and_of_margins_gives_them(cli: CommandLine) -> None:
    precision = ToolPrecision(LoadedPose(OPTIMAL, POSE, LOAD))
    source = load_source("accuracy", precision.loaded)
    found = values_of(source.python)["precision"]
    assert isinstance(found, ToolPrecision)
    assert found.loaded.pose == POSE
    cli.capsys.readouterr()
    answer = cli.answer(*arguments(source.command))
    assert_allclose(answer["compliance"], precision.compliance, rtol=1e-9)
    source = pose_source("singularity", OPTIMAL, POSE)
    values_of(source.python)
    cli.capsys.readouterr()
    answer = cli.answer(*arguments(source.command))
    assert_allclose(answer["margins"], explorer.evaluate(OPTIMAL, POSE).margins)


def test_source_of_a_design_that_is_no_preset_needs_its_file() -> None:
    other = msgspec.structs.replace(OPTIMAL, unit_mm=3.0)
    assert name_of(OPTIMAL) == "paper-optimal"
    text = pose_source("singularity", other, POSE).text
    assert text.startswith(
        "# design.json is the design file.\nexplorer singularity --design design"
    )
