"""The command line and the Python that give an answer."""

from __future__ import annotations

import shlex
from collections.abc import Iterable
from typing import Literal, NamedTuple

from explorer.mechanism.configuration import tool_position
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import Pose, Triple
from explorer.statics.loaded import LoadedPose

DESIGN_FILE = "design.json"
"""File of a design that is no preset."""

PoseTopic = Literal["singularity", "interference"]
LoadTopic = Literal["forces", "accuracy"]


class Source(NamedTuple):
    """The command line and the lines of Python that give an answer.

    The remark is a sentence on what the command leaves out.
    """

    command: str
    python: tuple[str, ...]
    remark: str = ""

    @property
    def text(self) -> str:
        """Both, below a comment on what they need."""
        file = f"{DESIGN_FILE} is the design file." if DESIGN_FILE in self.command else ""
        comments = [f"# {words}" for words in (file, self.remark) if words]
        return "\n".join((*comments, self.command, "", *self.python, ""))


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


def pose_source(topic: PoseTopic, design: Design, pose: Pose) -> Source:
    """Return how the margins or the clearances of a pose are computed."""
    printed = {"singularity": "margins, snapshot.nearest", "interference": "clearances"}[topic]
    return Source(
        f"{_start(topic, design)}{pose_options(design, pose)}",
        (
            *("import explorer", ""),
            *_design_and_pose(design, pose),
            "snapshot = explorer.evaluate(design, pose)",
            f"print(snapshot.{printed})",
        ),
    )


def load_source(topic: LoadTopic, loaded: LoadedPose, density: float | None = None) -> Source:
    """Return how the forces or the precision at the tool of a loaded pose are computed.

    The density of the prototype's parts, in kg/m³, is given if their weights count.
    """
    design, pose = loaded.design, loaded.pose
    imports = ["import explorer", "from explorer.statics.loaded import LoadedPose"]
    lines = [*_design_and_pose(design, pose)]
    options, arguments, remark = pose_options(design, pose, loaded.point), ["design", "pose"], ""
    if any(loaded.load):
        options += f" --load {_words(loaded.load)}"
        arguments.append(f"load={tuple(map(float, loaded.load))}")
    if not loaded.weighs_payload:
        options += " --payload 0"
        arguments.append("weighs_payload=False")
    if density is not None:
        imports.append("from explorer.motion.masses import moving_bodies")
        masses = f"explorer.make_prototype(design).masses({density:g})"
        lines.append(f"own = moving_bodies(design, {masses}, payload=False)")
        arguments.append("own=own")
        if topic == "forces":
            options += f" --density {density:g} --parts"
        else:
            remark = "The command leaves the weights of the parts out."
    lines.append(f"loaded = LoadedPose({', '.join(arguments)})")
    if topic == "accuracy":
        imports.append("from explorer.statics.loaded import ToolPrecision")
        lines.append("precision = ToolPrecision(loaded)")
        lines.append("print(precision.worst(), precision.deflection)")
    else:
        lines.append("print(loaded.reactions.actuators, loaded.shares)")
    command = f"{_start(topic, design)}{options} --at tool"
    return Source(command, (*imports, "", *lines), remark)


def _start(topic: PoseTopic | LoadTopic, design: Design) -> str:
    return f"explorer {topic} --design {shlex.quote(name_of(design))}"


def _design_and_pose(design: Design, pose: Pose) -> tuple[str, str]:
    x, y, z = pose.position
    return (
        f"design = explorer.load_design({name_of(design)!r})",
        f"pose = explorer.Pose(({x!r}, {y!r}, {z!r}), {tuple(map(float, pose.quaternion))})",
    )


def _words(values: Iterable[float]) -> str:
    return " ".join(repr(float(value)) for value in values)
