"""The command lines that give the answers of the page and of a report."""

from __future__ import annotations

import shlex
from collections.abc import Iterable
from typing import Literal

from explorer.mechanism.configuration import tool_position
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import Pose, Triple
from explorer.statics.loaded import LoadedPose

DESIGN_FILE = "design.json"
"""File of a design that is no preset."""

PoseTopic = Literal["singularity", "interference"]
LoadTopic = Literal["forces", "accuracy"]


def name_of(design: Design) -> str:
    """Return the name of a design for `--design`: that of a preset, or of its file."""
    return design.name if PRESETS.get(design.name) == design else DESIGN_FILE


def pose_options(design: Design, pose: Pose, tool: Triple | None = None) -> str:
    """Return the options for a pose, each after a blank; none for the home pose.

    The position is that of the tool, a point in the platform frame, or of b4 if it is None.
    """
    if pose == design.home_pose:
        return ""
    position = pose.position if tool is None else tool_position(pose, tool)
    return f" --position {_words(position)} --quaternion {_words(pose.quaternion)}"


def pose_command(topic: PoseTopic, design: Design, pose: Pose) -> str:
    """Return the command that tells the margins or the clearances of a pose."""
    return f"{_start(topic, design)}{pose_options(design, pose)}"


def load_command(topic: LoadTopic, loaded: LoadedPose, density: float | None = None) -> str:
    """Return the command that tells the forces or the precision at the tool of a loaded pose.

    The density of the prototype's parts, in kg/m³, is given if their weights count; the precision
    by the command leaves these out.
    """
    options = pose_options(loaded.design, loaded.pose, loaded.point)
    if any(loaded.load):
        options += f" --load {_words(loaded.load)}"
    if not loaded.weighs_payload:
        options += " --payload 0"
    if density is not None and topic == "forces":
        options += f" --density {density:g} --parts"
    return f"{_start(topic, loaded.design)}{options} --at tool"


def _start(topic: PoseTopic | LoadTopic, design: Design) -> str:
    return f"explorer {topic} --design {shlex.quote(name_of(design))}"


def _words(values: Iterable[float]) -> str:
    return " ".join(repr(float(value)) for value in values)
