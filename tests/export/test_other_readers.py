"""The simulation model as Pinocchio and Drake read it, where they are installed: pin and drake."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mujoco_models import engine, joints_of
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation
from statics_cases import random_poses
from test_simulation_scene import LOADED

from explorer import JOINTS, Design, Pose
from explorer.export.simulation import DENSITY, SIMULATION_JOINTS, SimulationModel
from explorer.mechanism.machine import STANDARD_GRAVITY
from explorer.motion.chains import ACTUATED
from explorer.motion.masses import bar_masses, moving_bodies
from explorer.numerics.arrays import FloatArray
from explorer.statics.loaded import LoadedPose

pytestmark = [pytest.mark.long, pytest.mark.filterwarnings("default")]

every_design = pytest.mark.parametrize("design", LOADED, ids=range(len(LOADED)))
# The loops of Drake give way where legs are light and their payload is heavy.
LARGE = [design for design in LOADED if design.unit_mm >= 10.0]


@pytest.fixture
def drake() -> Any:
    logging.getLogger("drake").setLevel(logging.ERROR)
    return pytest.importorskip("pydrake.all")


@pytest.fixture
def file(design: Design, tmp_path: Path) -> str:
    path = tmp_path / "machine.xml"
    path.write_text(SimulationModel(design).text(), encoding="utf-8")
    return str(path)


def poses(design: Design) -> Iterator[tuple[FloatArray, FloatArray]]:
    home = design.home_pose
    yield np.array(home.position), home.rotation
    yield from zip(*random_poses(design, 5, seed=4), strict=True)


def forces_of_statics(design: Design, position: FloatArray, rotation: FloatArray) -> FloatArray:
    weights = moving_bodies(design, bar_masses(design, DENSITY), payload=False)
    loaded = LoadedPose(design, Pose.of(position, rotation), own=weights)
    return loaded.reactions.actuators


@every_design
def test_pinocchio_reads_joints_masses_loops_and_poses(design: Design, file: str) -> None:
    pinocchio: Any = pytest.importorskip("pinocchio")
    ours = engine.MjModel.from_xml_path(file)
    model, loops, _ = pinocchio.buildModelAndConstraintsFromMJCF(file)
    assert list(model.names)[1:] == list(SIMULATION_JOINTS)
    assert len(loops) == 3
    assert pinocchio.computeTotalMass(model) == pytest.approx(ours.body_mass.sum())
    assert_allclose(model.armature, ours.dof_armature)
    home = ours.key_qpos[0]
    assert_allclose(model.referenceConfigurations["home"], [*home[:12], *home[13:], home[12]])
    metres = 1e-3 * design.unit_mm
    # The base has no joint, and Pinocchio takes its frame for that of the world.
    model.gravity.linear = STANDARD_GRAVITY * np.array(design.gravity)
    data = model.createData()
    for position, rotation in poses(design):
        q = joints_of(design, position, rotation)
        q = np.array([*q[:12], *q[13:], q[12]])
        pinocchio.computeJointJacobians(model, data, q)
        pinocchio.updateFramePlacements(model, data)
        platform = data.oMf[model.getFrameId("platform")]
        assert_allclose(platform.translation, metres * position, atol=1e-9)
        assert_allclose(platform.rotation, rotation, atol=1e-9)
        tool = metres * (position + rotation @ design.tool.position)
        assert_allclose(data.oMf[model.getFrameId("tool")].translation, tool, atol=1e-9)
        columns = [np.eye(int(model.nv))[list(ACTUATED)]]
        for loop in loops:
            state = loop.createData()
            loop.calc(model, data, state)
            assert_allclose(state.constraint_position_error, 0.0, atol=1e-9)
            columns.append(np.array(loop.jacobian(model, data, state)))
        # What the loops leave of the weights is left to the servos.
        still = np.zeros(int(model.nv))
        weights = np.array(pinocchio.rnea(model, data, q, still, still))
        forces = np.linalg.solve(np.vstack(columns).T, weights)[:6]
        expected = forces_of_statics(design, position, rotation)
        assert_allclose(forces, expected, atol=1e-8 * np.abs(expected).max())


def plant_of(file: str, drake: Any) -> tuple[Any, Any, Any]:
    """Return a plant of the model with its servos, its instance, and its diagram."""
    ours = engine.MjModel.from_xml_path(file)
    builder = drake.DiagramBuilder()
    plant, _ = drake.AddMultibodyPlantSceneGraph(builder, 2e-4)
    (instance,) = drake.Parser(plant).AddModels(file)
    for name in JOINTS:
        servo = ours.actuator(name)
        actuator = plant.AddJointActuator(name, plant.GetJointByName(name))
        gains = drake.PdControllerGains(p=servo.gainprm[0], d=-servo.biasprm[2])
        actuator.set_controller_gains(gains)
        actuator.set_default_rotor_inertia(ours.dof_armature[ours.joint(name).dofadr[0]])
    plant.Finalize()
    return plant, instance, builder.Build()


@every_design
def test_drake_reads_joints_masses_loops_and_poses(design: Design, file: str, drake: Any) -> None:
    plant, _, diagram = plant_of(file, drake)
    ours = engine.MjModel.from_xml_path(file)
    context = plant.GetMyContextFromRoot(diagram.CreateDefaultContext())
    program = drake.MathematicalProgram()
    variables = program.NewContinuousVariables(plant.num_positions())
    rows = drake.AddMultibodyPlantConstraints(plant, variables, program, context)
    loops = [row.evaluator() for row in rows if "Ball" in row.evaluator().get_description()]
    assert len(loops) == plant.num_constraints() == 3
    names = [plant.get_joint(each).name() for each in plant.GetJointIndices()]
    assert [name for name in names if name in SIMULATION_JOINTS] == list(SIMULATION_JOINTS)
    assert plant.num_positions() == ours.nv
    assert plant.CalcTotalMass(context) == pytest.approx(ours.body_mass.sum())
    assert_allclose(plant.GetPositions(context)[:12], ours.key_qpos[0, :12])
    limited = ours.jnt_limited[:12] == 1
    assert_allclose(plant.GetPositionUpperLimits()[:12][limited], ours.jnt_range[:12][limited, 1])
    metres = 1e-3 * design.unit_mm
    for position, rotation in poses(design):
        q = joints_of(design, position, rotation)
        ball = Rotation.from_quat(q[12:], scalar_first=True).as_euler("xyz")
        plant.SetPositions(context, [*q[:12], *ball])
        for loop in loops:
            gap = loop.Eval(plant.GetPositions(context)) - loop.lower_bound()
            assert_allclose(gap, 0.0, atol=1e-9)
        base, platform = (
            plant.EvalBodyPoseInWorld(context, plant.GetBodyByName(name))
            for name in ("base", "platform")
        )
        found = base.inverse() @ platform
        assert_allclose(found.translation(), metres * position, atol=1e-9)
        assert_allclose(found.rotation().matrix(), rotation, atol=1e-9)


@pytest.mark.parametrize("design", LARGE, ids=range(len(LARGE)))
def test_drake_servos_at_rest_give_the_forces_of_statics(
    design: Design, file: str, drake: Any
) -> None:
    plant, instance, diagram = plant_of(file, drake)
    ours = engine.MjModel.from_xml_path(file)
    simulator = drake.Simulator(diagram)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    commands = np.concatenate([ours.key_ctrl[0], np.zeros(6)])
    plant.get_desired_state_input_port(instance).FixValue(context, commands)
    plant.get_actuation_input_port().FixValue(context, ours.actuator_biasprm[:, 0])
    simulator.AdvanceTo(0.5)
    home = design.home_pose
    expected = forces_of_statics(design, np.array(home.position), home.rotation)
    forces = plant.get_net_actuation_output_port().Eval(context)
    assert_allclose(forces, expected, atol=1e-3 * np.abs(expected).max())
