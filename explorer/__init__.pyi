"""The public names, and the module from which each is loaded on first use.

Every other name is imported from its room: `from explorer.statics.accuracy import rms_of_sources`.
"""

from .app.notebook import show as show
from .calibration.identify import calibrate as calibrate
from .calibration.machine_file import load_machine as load_machine
from .calibration.measurement import Measurement as Measurement
from .calibration.poses import calibration_poses as calibration_poses
from .errors import (
    ExplorerError as ExplorerError,
    InputError as InputError,
    MissingExtraError as MissingExtraError,
    NoAnswerError as NoAnswerError,
)
from .find.check import check_requirement as check_requirement
from .find.find import find_designs as find_designs
from .find.nearest import nearest_values as nearest_values
from .find.requirement import (
    Requirement as Requirement,
    load_requirement as load_requirement,
)
from .legs.clearance import leg_clearances as leg_clearances
from .legs.interference import tetrahedra_overlap as tetrahedra_overlap
from .measures.snapshot import Snapshot as Snapshot, evaluate as evaluate
from .mechanism.built_machine import BuiltMachine as BuiltMachine
from .mechanism.configuration import Configuration as Configuration, tool_position as tool_position
from .mechanism.design import JOINTS as JOINTS, Design as Design, Limits as Limits
from .mechanism.design_file import (
    PRESETS as PRESETS,
    decode_design as decode_design,
    encode_design as encode_design,
    load_design as load_design,
)
from .mechanism.folds import from_folds as from_folds, to_folds as to_folds
from .mechanism.kinematics import forward as forward, inverse as inverse, jacobian as jacobian
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
    rotation_from_quaternion as rotation_from_quaternion,
    rotation_from_yaw_pitch_roll as rotation_from_yaw_pitch_roll,
    yaw_pitch_roll_from_rotation as yaw_pitch_roll_from_rotation,
)
from .motion.dynamics import inverse_dynamics as inverse_dynamics
from .motion.rates import joint_accelerations as joint_accelerations, joint_rates as joint_rates
from .optimise.defaults import make_problem as make_problem
from .optimise.solver import optimise_design as optimise_design
from .paths.planning import plan_path as plan_path
from .prototype.assembly import make_prototype as make_prototype
from .singularity.ellipsoids import performance as performance
from .singularity.nearest import nearest_singularities as nearest_singularities
from .singularity.strata import stratum as stratum
from .six_legged.case import TableCase as TableCase
from .six_legged.files import TABLES as TABLES, load_table as load_table
from .six_legged.table import SixLegged as SixLegged, TablePoses as TablePoses
from .statics.accuracy import (
    pose_error_by_geometry as pose_error_by_geometry,
    worst_error as worst_error,
)
from .statics.compliance import compliance as compliance, deflection as deflection
from .statics.forces import (
    actuator_forces as actuator_forces,
    largest_force as largest_force,
    strut_bending as strut_bending,
)
from .statics.reactions import largest_payload as largest_payload, reactions as reactions
from .sweep.results import load_results as load_results
from .sweep.run import run_study as run_study
from .sweep.study import load_study as load_study
from .workspace.accessible.workspace import accessible_workspace as accessible_workspace
from .workspace.limits.valid_poses import poses_are_valid as poses_are_valid
from .workspace.orientations.share import orientation_capability as orientation_capability
from .workspace.orientations.tilts import greatest_tilt as greatest_tilt
from .workspace.slices.volume import workspace_volume as workspace_volume
from .workspace.solids.solids import workspace_solid as workspace_solid
from .workspace.workspace import Workspace as Workspace

__all__: list[str]
__version__: str
