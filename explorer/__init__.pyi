"""The public names, and the module from which each is loaded on first use."""

from .app.notebook import Shown as Shown, show as show
from .errors import (
    DesignError as DesignError,
    ExplorerError as ExplorerError,
    InputError as InputError,
    MissingExtraError as MissingExtraError,
    NoAnswerError as NoAnswerError,
)
from .export.imperfect import (
    ImperfectMachine as ImperfectMachine,
    draw_deviations as draw_deviations,
)
from .export.simulation import simulation_mjcf as simulation_mjcf
from .legs.clearance import (
    PAIRS as PAIRS,
    LegClearances as LegClearances,
    leg_clearances as leg_clearances,
)
from .legs.interference import (
    step_is_free as step_is_free,
    step_overlaps as step_overlaps,
    swept_tetrahedra as swept_tetrahedra,
)
from .legs.moves import (
    MoveClearance as MoveClearance,
    MoveClearances as MoveClearances,
    move_clearance as move_clearance,
    move_clearances as move_clearances,
    moves_are_clear as moves_are_clear,
    poses_between as poses_between,
)
from .legs.tetrahedra import tetrahedra_overlap as tetrahedra_overlap
from .measures.snapshot import Snapshot as Snapshot, evaluate as evaluate
from .mechanism.configuration import Configuration as Configuration
from .mechanism.design import (
    JOINTS as JOINTS,
    VARIABLES as VARIABLES,
    Design as Design,
    Limits as Limits,
)
from .mechanism.design_file import (
    PRESETS as PRESETS,
    decode_design as decode_design,
    encode_design as encode_design,
    load_design as load_design,
)
from .mechanism.folds import from_folds as from_folds, to_folds as to_folds
from .mechanism.kinematics import (
    discriminants as discriminants,
    forward as forward,
    inverse as inverse,
)
from .mechanism.machine import (
    Actuators as Actuators,
    Guide as Guide,
    Payload as Payload,
    Struts as Struts,
    Tolerances as Tolerances,
    Tool as Tool,
)
from .mechanism.margins import margins as margins
from .mechanism.pose import (
    Pose as Pose,
    quaternion_from_rotation as quaternion_from_rotation,
    rotation_from_quaternion as rotation_from_quaternion,
    rotation_from_yaw_pitch_roll as rotation_from_yaw_pitch_roll,
    yaw_pitch_roll_from_rotation as yaw_pitch_roll_from_rotation,
)
from .mechanism.tilt_torsion import (
    TiltTorsion as TiltTorsion,
    pose_of_tilt_torsion as pose_of_tilt_torsion,
    rotation_from_tilt_torsion as rotation_from_tilt_torsion,
    tilt_torsion_from_rotation as tilt_torsion_from_rotation,
)
from .mechanism.tool_point import tool_offset as tool_offset, tool_position as tool_position
from .optimise.defaults import make_problem as make_problem
from .optimise.outcome import Iterate as Iterate, Outcome as Outcome, Run as Run
from .optimise.problem import Demands as Demands, Problem as Problem, Variable as Variable
from .optimise.solver import optimise_design as optimise_design
from .paths.crossings import path_margins as path_margins
from .paths.loads import path_loads as path_loads
from .paths.planning import (
    NoPathError as NoPathError,
    PlannedPath as PlannedPath,
    plan_path as plan_path,
)
from .prototype.assembly import Prototype as Prototype, make_prototype as make_prototype
from .singularity.ellipsoids import (
    Performance as Performance,
    performance as performance,
    singularity_free_ball as singularity_free_ball,
)
from .singularity.jacobian import jacobian as jacobian
from .singularity.nearest import (
    NearestSingularity as NearestSingularity,
    nearest_singular_poses as nearest_singular_poses,
    nearest_singularities as nearest_singularities,
)
from .singularity.nearest_stratum import nearest_in_stratum as nearest_in_stratum
from .singularity.strata import stratum as stratum
from .singularity.uncoupled import UNCOUPLED as UNCOUPLED
from .statics.accuracy import (
    ToolError as ToolError,
    pose_error_by_geometry as pose_error_by_geometry,
    worst_error as worst_error,
)
from .statics.budget.allocation import (
    ToleranceBudget as ToleranceBudget,
    tolerance_budget as tolerance_budget,
)
from .statics.budget.costs import (
    SourceCosts as SourceCosts,
    source_costs as source_costs,
    with_tolerances as with_tolerances,
)
from .statics.compliance import (
    compliance as compliance,
    compliance_shares as compliance_shares,
    deflection as deflection,
    principal_compliances as principal_compliances,
)
from .statics.error_sources import (
    SOURCES as SOURCES,
    LargestError as LargestError,
    errors_alone as errors_alone,
    largest_error as largest_error,
    rms_of_sources as rms_of_sources,
    source_errors as source_errors,
)
from .statics.forces import (
    actuator_forces as actuator_forces,
    largest_force as largest_force,
    strut_bending as strut_bending,
    worst_direction as worst_direction,
)
from .statics.reactions import (
    Reactions as Reactions,
    largest_payload as largest_payload,
    limit_shares as limit_shares,
    reactions as reactions,
)
from .statics.weights import Weights as Weights
from .sweep.cluster import DaskWorkers as DaskWorkers
from .sweep.results import Results as Results, load_results as load_results
from .sweep.run import run_study as run_study
from .sweep.study import Study as Study, load_study as load_study
from .sweep.workers import LocalWorkers as LocalWorkers
from .workspace.accessible.radii import RadiusCurve as RadiusCurve, radius_curve as radius_curve
from .workspace.accessible.workspace import (
    AccessibleWorkspace as AccessibleWorkspace,
    PairCost as PairCost,
    accessible_workspace as accessible_workspace,
)
from .workspace.least_clearance import (
    LeastClearances as LeastClearances,
    least_clearances as least_clearances,
)
from .workspace.limits.valid_moves import moves_are_valid as moves_are_valid
from .workspace.limits.valid_poses import poses_are_valid as poses_are_valid
from .workspace.orientations.connected import is_connected as is_connected
from .workspace.orientations.share import (
    OrientationShare as OrientationShare,
    orientation_capability as orientation_capability,
    orientation_share as orientation_share,
)
from .workspace.orientations.tilts import (
    GreatestTilt as GreatestTilt,
    TiltMap as TiltMap,
    greatest_tilt as greatest_tilt,
    greatest_tilts as greatest_tilts,
    tilt_map as tilt_map,
)
from .workspace.orientations.torsions import (
    TiltByTorsion as TiltByTorsion,
    TorsionRange as TorsionRange,
    tilt_by_torsion as tilt_by_torsion,
    torsion_range as torsion_range,
)
from .workspace.slices.fields import slice_field as slice_field
from .workspace.slices.volume import (
    NodeCount as NodeCount,
    Volume as Volume,
    workspace_nodes as workspace_nodes,
    workspace_volume as workspace_volume,
)
from .workspace.solids.solid import Solid as Solid
from .workspace.solids.solids import (
    convex_hull as convex_hull,
    inclusive_solid as inclusive_solid,
    total_solid as total_solid,
    workspace_solid as workspace_solid,
)

__all__: list[str]
__version__: str
