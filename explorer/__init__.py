"""Design explorer of the flagged 4-4 parallel manipulator.

The names below are the whole public interface; each is loaded when it is first used, so
that `import explorer` costs next to nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from explorer.app.notebook import Shown, show
    from explorer.clearance import PAIRS, LegClearances, leg_clearances
    from explorer.crossings import path_margins
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
    from explorer.least_clearance import LeastClearances, least_clearances
    from explorer.move_validity import moves_are_valid
    from explorer.moves import (
        MoveClearance,
        MoveClearances,
        move_clearance,
        move_clearances,
        moves_are_clear,
        poses_between,
    )
    from explorer.nearest_singular import (
        NearestSingularity,
        nearest_singular_poses,
        nearest_singularities,
    )
    from explorer.nearest_stratum import nearest_in_stratum
    from explorer.optimise.defaults import make_problem
    from explorer.optimise.outcome import Iterate, Outcome, Run
    from explorer.optimise.problem import Demands, Problem, Variable
    from explorer.optimise.solver import optimise_design
    from explorer.orientations import orientation_capability
    from explorer.performance import singularity_free_ball
    from explorer.planning import NoPathError, PlannedPath, plan_path
    from explorer.pose import (
        Pose,
        quaternion_from_rotation,
        rotation_from_quaternion,
        rotation_from_yaw_pitch_roll,
        yaw_pitch_roll_from_rotation,
    )
    from explorer.prototype.assembly import Prototype, make_prototype
    from explorer.radii import RadiusCurve, radius_curve
    from explorer.reachable import PairCost, ReachableWorkspace, reachable_workspace
    from explorer.singularity import jacobian, margins
    from explorer.slice_fields import slice_field
    from explorer.snapshot import Snapshot, evaluate
    from explorer.solid import Solid
    from explorer.solids import convex_hull, workspace_solid
    from explorer.strata import stratum
    from explorer.sweep.cluster import DaskWorkers
    from explorer.sweep.results import Results, load_results
    from explorer.sweep.run import run_study
    from explorer.sweep.study import Study, load_study
    from explorer.sweep.workers import LocalWorkers
    from explorer.tetrahedra import tetrahedra_overlap
    from explorer.uncoupled import UNCOUPLED
    from explorer.validity import poses_are_valid
    from explorer.workspace import NodeCount, Volume, workspace_nodes, workspace_volume

_HOMES = {
    "app.notebook": ("Shown", "show"),
    "clearance": ("PAIRS", "LegClearances", "leg_clearances"),
    "crossings": ("path_margins",),
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
    "least_clearance": ("LeastClearances", "least_clearances"),
    "move_validity": ("moves_are_valid",),
    "moves": (
        "MoveClearance",
        "MoveClearances",
        "move_clearance",
        "move_clearances",
        "moves_are_clear",
        "poses_between",
    ),
    "nearest_singular": (
        "NearestSingularity",
        "nearest_singular_poses",
        "nearest_singularities",
    ),
    "optimise.outcome": ("Iterate", "Outcome", "Run"),
    "optimise.defaults": ("make_problem",),
    "optimise.problem": ("Demands", "Problem", "Variable"),
    "optimise.solver": ("optimise_design",),
    "nearest_stratum": ("nearest_in_stratum",),
    "orientations": ("orientation_capability",),
    "performance": ("singularity_free_ball",),
    "planning": ("NoPathError", "PlannedPath", "plan_path"),
    "pose": (
        "Pose",
        "quaternion_from_rotation",
        "rotation_from_quaternion",
        "rotation_from_yaw_pitch_roll",
        "yaw_pitch_roll_from_rotation",
    ),
    "prototype.assembly": ("Prototype", "make_prototype"),
    "radii": ("RadiusCurve", "radius_curve"),
    "reachable": ("PairCost", "ReachableWorkspace", "reachable_workspace"),
    "singularity": ("jacobian", "margins"),
    "slice_fields": ("slice_field",),
    "snapshot": ("Snapshot", "evaluate"),
    "solid": ("Solid",),
    "solids": ("convex_hull", "workspace_solid"),
    "strata": ("stratum",),
    "sweep.cluster": ("DaskWorkers",),
    "sweep.results": ("Results", "load_results"),
    "sweep.run": ("run_study",),
    "sweep.study": ("Study", "load_study"),
    "sweep.workers": ("LocalWorkers",),
    "tetrahedra": ("tetrahedra_overlap",),
    "uncoupled": ("UNCOUPLED",),
    "validity": ("poses_are_valid",),
    "workspace": ("NodeCount", "Volume", "workspace_nodes", "workspace_volume"),
}
_MODULE_OF = {name: module for module, names in _HOMES.items() for name in names}

__all__ = [
    "JOINTS",
    "PAIRS",
    "PRESETS",
    "UNCOUPLED",
    "VARIABLES",
    "DaskWorkers",
    "Demands",
    "Design",
    "DesignError",
    "ExplorerError",
    "InputError",
    "Iterate",
    "LeastClearances",
    "LegClearances",
    "Limits",
    "LocalWorkers",
    "MissingExtraError",
    "MoveClearance",
    "MoveClearances",
    "NearestSingularity",
    "NoAnswerError",
    "NoPathError",
    "NodeCount",
    "Outcome",
    "PairCost",
    "PlannedPath",
    "Pose",
    "Problem",
    "Prototype",
    "RadiusCurve",
    "ReachableWorkspace",
    "Results",
    "Run",
    "Shown",
    "Snapshot",
    "Solid",
    "Study",
    "Variable",
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
    "least_clearances",
    "leg_clearances",
    "load_design",
    "load_results",
    "load_study",
    "make_problem",
    "make_prototype",
    "margins",
    "move_clearance",
    "move_clearances",
    "moves_are_clear",
    "moves_are_valid",
    "nearest_in_stratum",
    "nearest_singular_poses",
    "nearest_singularities",
    "optimise_design",
    "orientation_capability",
    "path_margins",
    "plan_path",
    "poses_are_valid",
    "poses_between",
    "quaternion_from_rotation",
    "radius_curve",
    "reachable_workspace",
    "rotation_from_quaternion",
    "rotation_from_yaw_pitch_roll",
    "run_study",
    "show",
    "singularity_free_ball",
    "slice_field",
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
