"""Design explorer of the flagged 4-4 parallel manipulator.

The names below are the whole public interface; each is loaded when it is first used, so
that `import explorer` costs next to nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from explorer.clearance import PAIRS, LegClearances, leg_clearances
    from explorer.design import JOINTS, VARIABLES, Design, Limits
    from explorer.design_file import PRESETS, decode_design, encode_design, load_design
    from explorer.errors import (
        DesignError,
        ExplorerError,
        InputError,
        MissingExtraError,
        NoAnswerError,
    )
    from explorer.home import home_pose
    from explorer.interference import step_is_free, step_overlaps, swept_tetrahedra
    from explorer.kinematics import attachment_points, discriminants, forward, inverse
    from explorer.moves import (
        MoveClearance,
        MoveClearances,
        move_clearance,
        move_clearances,
        moves_are_clear,
        poses_between,
    )
    from explorer.pose import (
        Pose,
        quaternion_from_rotation,
        rotation_from_quaternion,
        rotation_from_yaw_pitch_roll,
        yaw_pitch_roll_from_rotation,
    )
    from explorer.singularity import jacobian, margins
    from explorer.snapshot import Snapshot, evaluate
    from explorer.solids import Solid, convex_hull, workspace_solid
    from explorer.strata import stratum
    from explorer.tetrahedra import tetrahedra_overlap
    from explorer.workspace import NodeCount, Volume, workspace_nodes, workspace_volume

_HOMES = {
    "clearance": ("PAIRS", "LegClearances", "leg_clearances"),
    "design": ("JOINTS", "VARIABLES", "Design", "Limits"),
    "design_file": ("PRESETS", "decode_design", "encode_design", "load_design"),
    "errors": (
        "DesignError",
        "ExplorerError",
        "InputError",
        "MissingExtraError",
        "NoAnswerError",
    ),
    "home": ("home_pose",),
    "interference": ("step_is_free", "step_overlaps", "swept_tetrahedra"),
    "kinematics": ("attachment_points", "discriminants", "forward", "inverse"),
    "moves": (
        "MoveClearance",
        "MoveClearances",
        "move_clearance",
        "move_clearances",
        "moves_are_clear",
        "poses_between",
    ),
    "pose": (
        "Pose",
        "quaternion_from_rotation",
        "rotation_from_quaternion",
        "rotation_from_yaw_pitch_roll",
        "yaw_pitch_roll_from_rotation",
    ),
    "singularity": ("jacobian", "margins"),
    "snapshot": ("Snapshot", "evaluate"),
    "solids": ("Solid", "convex_hull", "workspace_solid"),
    "strata": ("stratum",),
    "workspace": ("NodeCount", "Volume", "workspace_nodes", "workspace_volume"),
    "tetrahedra": ("tetrahedra_overlap",),
}
_MODULE_OF = {name: module for module, names in _HOMES.items() for name in names}

__all__ = [
    "JOINTS",
    "PAIRS",
    "PRESETS",
    "VARIABLES",
    "Design",
    "DesignError",
    "ExplorerError",
    "InputError",
    "LegClearances",
    "Limits",
    "MissingExtraError",
    "MoveClearance",
    "MoveClearances",
    "NoAnswerError",
    "NodeCount",
    "Pose",
    "Snapshot",
    "Solid",
    "Volume",
    "attachment_points",
    "convex_hull",
    "decode_design",
    "discriminants",
    "encode_design",
    "evaluate",
    "forward",
    "home_pose",
    "inverse",
    "jacobian",
    "leg_clearances",
    "load_design",
    "margins",
    "move_clearance",
    "move_clearances",
    "moves_are_clear",
    "poses_between",
    "quaternion_from_rotation",
    "rotation_from_quaternion",
    "rotation_from_yaw_pitch_roll",
    "step_is_free",
    "step_overlaps",
    "stratum",
    "swept_tetrahedra",
    "tetrahedra_overlap",
    "workspace_nodes",
    "workspace_solid",
    "workspace_volume",
    "yaw_pitch_roll_from_rotation",
]

__version__ = "0.1.0"


def __getattr__(name: str) -> object:
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'explorer' has no attribute {name!r}")
    return getattr(importlib.import_module(f"explorer.{_MODULE_OF[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
