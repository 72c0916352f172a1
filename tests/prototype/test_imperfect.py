"""Machines that deviate from their design: exact geometry, the linear model, MuJoCo."""

from __future__ import annotations

from typing import Any

import msgspec
import numpy as np
import pytest
from mujoco_models import at_home, engine, joints_of, loops_of
from numpy.testing import assert_allclose
from scipy.linalg import eigh, null_space
from scipy.spatial.transform import Rotation
from statics_cases import random_poses

from explorer import (
    JOINTS,
    PRESETS,
    Actuators,
    Design,
    InputError,
    NoAnswerError,
    Pose,
    Struts,
    Tolerances,
    Tool,
    compliance,
    deflection,
    inverse,
)
from explorer.export.simulation import simulation_mjcf
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design_file import typical_machine
from explorer.mechanism.machine import Six
from explorer.motion.chains import ACTUATED
from explorer.motion.inverse_jacobian import twists_of_actuators
from explorer.numerics.arrays import FloatArray
from explorer.prototype.imperfect import ImperfectMachine
from explorer.statics.accuracy import (
    IS_TILT,
    SOURCES,
    error_by_source,
    rms_of_sources,
    source_errors,
)
from explorer.statics.budget import source_costs
from explorer.statics.compliance import stiffness_of
from explorer.statics.loaded import LoadedPose, ToolPrecision

TOOL = (0.5, 1.0, -2.0)
IDEAL = msgspec.structs.replace(PRESETS["paper-optimal"], tool=Tool(TOOL))
ERRORS: Six = (0.05, 0.02, 0.1, 0.03, 0.06, 0.04)
TOLERANCES = Tolerances(
    *(((0.1, 0.2, 0.05), (0.3, 0.1, 0.2), (0.15, 0.1, 0.1), (0.1, 0.2))),
    *(((0.1, 0.1, 0.2), (0.05, 0.1, 0.1), (0.1, 0.0, 0.3), (0.2, 0.1, 0.1), (0.1, 0.05))),
)
OFF = msgspec.structs.replace(
    IDEAL, actuators=Actuators(error_mm=ERRORS), tolerances=TOLERANCES, unit_mm=12.0
)
STIFFNESS: Six = (900.0, 1100.0, 700.0, 1300.0, 800.0, 1000.0)
SPRINGS = msgspec.structs.replace(IDEAL, actuators=Actuators(stiffness_n_mm=STIFFNESS))


def random_machine(seed: int, share: float = 1e-4) -> ImperfectMachine:
    """Return a machine of a random design at a regular home, off by a share of the reach."""
    rng = np.random.default_rng(seed)
    values = [value * rng.uniform(0.7, 1.3) for value in IDEAL.variables]
    design = msgspec.structs.replace(
        IDEAL.with_variables(values),
        unit_mm=float(10.0 ** rng.uniform(0.5, 2.0)),
        tool=Tool(tuple(rng.normal(size=3))),
    )
    positions, rotations = random_poses(design, 1, seed)
    design = msgspec.structs.replace(design, home=Pose.of(positions[0], rotations[0]))
    sizes = np.full(len(SOURCES), share * design.reach)
    sizes[IS_TILT] = share
    return ImperfectMachine(design, sizes * rng.uniform(-1.0, 1.0, len(SOURCES)))


def joints_read(machine: ImperfectMachine, pose: Pose) -> FloatArray:
    """Return what the encoders read in a pose, from the drawing's points and lines."""
    off = dict(zip(SOURCES, machine.deviations, strict=True))
    design = machine.design

    def point(name: str, x: float = 0.0, y: float = 0.0) -> FloatArray:
        return np.array([x, y, 0.0]) + [off[f"{name}{axis}"] for axis in "xyz"]

    def end(name: str, x: float = 0.0, y: float = 0.0) -> FloatArray:
        return pose.position + pose.rotation @ point(name, x, y)

    vector = np.array([0.0, off["guide tilt y"], off["guide tilt z"]])
    angle = float(np.linalg.norm(vector))
    # Rodrigues' formula, of the guide's direction (1, 0, 0), which is across the vector.
    x = np.array([1.0, 0.0, 0.0])
    along = np.cos(angle) * x + np.sinc(angle / np.pi) * np.cross(vector, x)
    joints = [float(np.linalg.norm(end("b1", *design.b1) - point("a1")))]
    for name, place, strut in (("b2", design.b2, 2), ("b3", design.b3, 3)):
        arm = end(name, place) - point("guide ")
        # The strut, its part across the guide and its part along it are a right triangle.
        across, lean = float(np.linalg.norm(np.cross(arm, along))), off[f"strut {strut} tilt"]
        length = across / np.cos(lean)
        joints += [float(arm @ along) - length * np.sin(lean), length]
    joints.append(float(np.linalg.norm(end("b4") - point("a3", *design.a3))))
    return np.array(joints) - [off[name] for name in JOINTS]


@pytest.mark.parametrize("seed", range(5))
def test_machine_reads_the_joints_of_the_design_and_errs_by_the_second_order(seed: int) -> None:
    machine = random_machine(seed)
    design, home = machine.design, machine.design.home_pose
    expected = inverse(design, home.position, home.rotation)
    assert_allclose(joints_read(machine, machine.home), expected, atol=3e-12 * design.reach)
    off = np.linalg.norm(np.array(machine.home.position) - home.position)
    assert off > 1e-6 * design.reach
    rest: list[float] = []
    for share in (0.1, 0.05):
        one = ImperfectMachine(machine.design, share * machine.deviations)
        slopes = error_by_source(Configuration.at(design, home, design.tool.position))
        linear = slopes @ one.deviations
        rest.append(float(np.abs(one.tool_error() - linear).max()))
        assert rest[-1] < 0.05 * np.abs(linear).max()
    assert rest[0] / rest[1] == pytest.approx(4.0, rel=0.1)


def test_deviations_are_drawn_within_the_errors_of_the_design() -> None:
    errors = source_errors(OFF)
    drawn = np.array([ImperfectMachine.draw(OFF, seed).deviations for seed in range(500)])
    assert (np.abs(drawn) <= errors).all()
    off = errors > 0.0
    assert off.sum() == 30
    shares = drawn[:, off] / errors[off]
    assert (shares.min(axis=0) < -0.97).all()
    assert (shares.max(axis=0) > 0.97).all()
    # Uniform and independent: six standard deviations of the mean and of the covariances.
    assert np.abs(shares.mean(axis=0)).max() < 6.0 / np.sqrt(3.0 * 500.0)
    covariance = shares.T @ shares / 500.0
    assert np.abs(covariance - np.eye(30) / 3.0).max() < 6.0 / (3.0 * np.sqrt(500.0))
    assert (ImperfectMachine.draw(OFF, 3).deviations == drawn[3]).all()


@pytest.mark.parametrize("design", [OFF, typical_machine(IDEAL)[0]])
def test_rms_errors_are_those_of_drawn_machines(design: Design) -> None:
    home = design.home_pose
    precision = ToolPrecision(LoadedPose(design, home, (0, 0, 0, 0, 0, 0), point=TOOL))
    costs = source_costs(Configuration.at(design, home, TOOL))
    drawn = np.array([ImperfectMachine.draw(design, seed).deviations for seed in range(4000)])
    by_source = error_by_source(Configuration.at(design, home, TOOL))
    moved = drawn @ by_source.T
    displacement, turn = (
        float(np.sqrt((moved[:, half] ** 2).sum(axis=1).mean())) for half in (slice(3), slice(3, 6))
    )
    for computed in (precision.rms(), rms_of_sources(by_source, source_errors(design))):
        assert float(computed.displacement) == pytest.approx(displacement, rel=0.03)
        assert float(computed.turn) == pytest.approx(turn, rel=0.03)
    assert costs.rms_displacement == pytest.approx(design.unit_mm * displacement, rel=0.03)
    assert costs.rms_turn == pytest.approx(np.degrees(turn), rel=0.03)
    semi_axes = precision.ellipsoid.semi_axes
    expected = np.sqrt(np.linalg.eigvalsh(moved[:, :3].T @ moved[:, :3] / len(moved))[::-1])
    assert_allclose(semi_axes, expected, rtol=0.05)
    # Those of the actuators alone.
    twists = twists_of_actuators(Configuration.at(design, home, TOOL))
    joints = drawn[:, :6] @ twists.T
    alone = rms_of_sources(twists, source_errors(design)[:6])
    found = float(np.sqrt((joints[:, :3] ** 2).sum(axis=1).mean()))
    assert float(alone.displacement) == pytest.approx(found, rel=0.03)


def model_of(machine: ImperfectMachine) -> Any:
    return engine.MjModel.from_xml_string(simulation_mjcf(machine))


def tool_of(design: Design, data: Any) -> tuple[FloatArray, FloatArray]:
    """Return position, in design units, of the tool of a model, and rotation of its platform."""
    turn = np.array(data.body("platform").xmat).reshape(3, 3)
    return data.site("tool").xpos * 1e3 / design.unit_mm, turn


def error_of(found: tuple[FloatArray, FloatArray], pose: Pose, tool: FloatArray) -> FloatArray:
    """Return displacement and turn (6,) of a tool from its place in a pose."""
    moved = found[0] - pose.position - pose.rotation @ tool
    turn = Rotation.from_matrix(found[1] @ pose.rotation.T).as_rotvec()
    return np.concatenate([moved, turn])


# Deviations below a micrometre too, where MuJoCo takes a site for the frame of its body.
@pytest.mark.parametrize(("seed", "share"), [(0, 1e-4), (1, 1e-6), (2, 1e-8), (3, 1e-8)])
def test_model_of_machine_starts_closed_with_the_readings_of_home(seed: int, share: float) -> None:
    machine = random_machine(seed, share)
    design, home = machine.design, machine.design.home_pose
    model = model_of(machine)
    data = at_home(model)
    metres = 1e-3 * design.unit_mm
    assert np.abs(loops_of(model, data)[0]).max() < 1e-14 * metres * design.reach
    assert (model.qpos0 == model.key_qpos[0]).all()
    commands = metres * inverse(design, home.position, home.rotation)
    assert_allclose(model.key_ctrl[0], commands, rtol=1e-12)
    assert_allclose(data.qpos[list(ACTUATED)], commands, atol=3e-12 * metres * design.reach)
    # The model's own geometry, apart from the joints: its ends of legs, its guide and its bases.
    platform = data.body("platform")
    ends = platform.xpos + metres * machine.points @ platform.xmat.reshape(3, 3).T
    for leg, end in zip((1, 2, 3, 4), ends, strict=True):
        assert_allclose(data.body(f"rod_{leg}").xpos, end, atol=1e-11 * metres * design.reach)
    off = machine.deviations[6:] * metres
    assert_allclose(data.body("cross_1").xpos, off[:3], atol=1e-15)
    place = metres * np.array([*design.a3, 0.0]) + off[3:6]
    assert_allclose(data.body("cross_4").xpos, place, atol=1e-15)
    turn = Rotation.from_rotvec([0.0, *machine.deviations[15:17]]).as_matrix()
    for leg in (2, 3):
        carriage = data.body(f"carriage_{leg}")
        along = (carriage.xpos - off[6:9]) @ turn
        assert_allclose(along[1:], 0.0, atol=1e-14)
        assert_allclose(np.array(carriage.xmat).reshape(3, 3)[:, 0], turn[:, 0], atol=1e-14)


def test_model_of_machine_at_rest_has_the_tool_of_the_solved_pose() -> None:
    design = msgspec.structs.replace(
        OFF, actuators=Actuators(error_mm=ERRORS, stiffness_n_mm=(5.0, 6.0, 5.0, 4.0, 5.0, 7.0))
    )
    machine = ImperfectMachine.draw(design, 5)
    home = design.home_pose
    meant = Pose.of_yaw_pitch_roll(np.array(home.position) + [0.8, -0.5, 0.6], (-68.0, 4.0, -3.0))
    joints = inverse(design, meant.position, meant.rotation)
    true = machine.pose(joints, meant)
    tool = np.array(TOOL)
    perfect = ImperfectMachine(design, np.zeros(len(SOURCES)))
    for each, seen in ((machine, true), (perfect, meant)):
        model = model_of(each)
        model.opt.gravity[:] = 0.0
        data = at_home(model)
        steps = int(0.4 / model.opt.timestep)
        for step in range(2 * steps):
            share = min(1.0, step / steps)
            commands = inverse(design, home.position, home.rotation) * (1.0 - share)
            data.ctrl[:] = 1e-3 * design.unit_mm * (commands + share * joints)
            engine.mj_step(model, data)
        assert np.abs(data.qvel).max() < 1e-6
        off = error_of(tool_of(design, data), seen, tool)
        assert np.abs(off[:3]).max() < 1e-6 * design.reach
        assert np.abs(off[3:]).max() < 1e-6
    # What the machine does wrong is a thousand times as much.
    wrong = error_of((np.array(true.position) + true.rotation @ tool, true.rotation), meant, tool)
    assert np.linalg.norm(wrong[:3]) > 1e-3 * design.reach


def come_to_rest(model: Any, data: Any, design: Design, load: FloatArray) -> None:
    """Move a model to its equilibrium under a load at the tool, by Newton's method."""
    metres = 1e-3 * design.unit_mm
    platform = data.body("platform")
    force, moment = load[:3], metres * load[3:]

    def accelerations(velocity: FloatArray) -> FloatArray:
        start = np.array(data.qpos)
        engine.mj_integratePos(model, data.qpos, velocity, 1.0)
        engine.mj_kinematics(model, data)
        arm = np.array(platform.xmat).reshape(3, 3) @ (metres * np.array(design.tool.position))
        data.xfrc_applied[platform.id] = [
            *force,
            *(moment + np.cross(platform.xpos + arm - platform.xipos, force)),
        ]
        engine.mj_forward(model, data)
        found = np.array(data.qacc)
        data.qpos[:] = start
        return found

    data.qvel[:] = 0.0
    step, axes, move = 1e-8, np.eye(model.nv), np.full(model.nv, np.inf)
    for _ in range(3):
        ends = [accelerations(sign * step * axis) for sign in (1.0, -1.0) for axis in axes]
        slopes = (np.array(ends[: model.nv]) - ends[model.nv :]) / (2.0 * step)
        move = np.linalg.solve(slopes.T, -accelerations(np.zeros(int(model.nv))))
        engine.mj_integratePos(model, data.qpos, move, 1.0)
    assert np.abs(move).max() < 1e-12
    engine.mj_kinematics(model, data)


def springs_of(design: Design) -> tuple[Any, Any]:
    """Return the model of a design's springs, without gravity and limits, and its data."""
    model = model_of(ImperfectMachine.draw(design, 0))
    model.opt.gravity[:] = 0.0
    # The loops are the stiffer, the smaller the time step.
    model.opt.timestep = 5e-6
    flags = engine.mjtDisableBit
    model.opt.disableflags |= int(flags.mjDSBL_LIMIT) | int(flags.mjDSBL_CLAMPCTRL)
    return model, engine.MjData(model)


def difference(
    design: Design, model: Any, data: Any, pose: Pose, softness: FloatArray, load: FloatArray
) -> float:
    """Return how much the model's displacement and turn differ from ours, the larger share.

    The load is reduced to one that moves the tool by a millionth of the reach.
    """
    expected = deflection(softness, load)
    share = 1e-6 * design.reach / np.abs(expected).max()
    data.qpos[:] = joints_of(design, np.array(pose.position), pose.rotation)
    data.ctrl[:] = data.qpos[list(ACTUATED)]
    come_to_rest(model, data, design, share * load)
    off = error_of(tool_of(design, data), pose, np.array(TOOL)) - share * expected
    halves = (slice(3), slice(3, 6))
    sizes = [np.linalg.norm(off[h]) / np.linalg.norm(share * expected[h]) for h in halves]
    return float(max(sizes))


def test_deflection_is_that_of_a_model_with_springs() -> None:
    model, data = springs_of(SPRINGS)
    positions, rotations = random_poses(SPRINGS, 12, seed=4)
    rng = np.random.default_rng(1)
    stiffness = np.array(STIFFNESS) * SPRINGS.unit_mm
    most = 0.0
    for position, rotation in zip(positions, rotations, strict=True):
        softness = compliance(SPRINGS, position, rotation, stiffness, tool=TOOL)
        load = rng.normal(size=6) * [1.0, 1.0, 1.0, 10.0, 10.0, 10.0]
        pose = Pose.of(position, rotation)
        most = max(most, difference(SPRINGS, model, data, pose, softness, load))
    # The ball joints of the model give way a little.
    assert most < 1e-3


@pytest.mark.parametrize("actuators", [SPRINGS.actuators, Actuators()])
def test_deflection_at_home_is_that_of_a_model_whose_struts_bend(actuators: Actuators) -> None:
    design = msgspec.structs.replace(
        IDEAL, actuators=actuators, struts=Struts(outer_mm=6.0, inner_mm=4.0)
    )
    model, data = springs_of(design)
    home = design.home_pose
    stiffness, bending = stiffness_of(design)
    if actuators.stiffness_n_mm is None:
        # Actuators that are rigid have ten times the stiffness of the stiffest strut.
        joints = inverse(design, home.position, home.rotation)
        struts = 3.0 * bending / joints[[2, 4]] ** 3
        stiffness[[0, 2, 4, 5]] = 10.0 * struts.max()
    softness = compliance(design, home.position, home.rotation, stiffness, bending, TOOL)
    for load in np.eye(6):
        assert difference(design, model, data, home, softness, load) < 1e-3


@pytest.mark.parametrize("seed", range(3))
def test_inertia_of_servos_is_that_of_the_model(seed: int) -> None:
    design = msgspec.structs.replace(
        random_machine(seed).design, actuators=Actuators(stiffness_n_mm=STIFFNESS)
    )
    model, data = springs_of(design)
    engine.mj_forward(model, data)
    full = np.zeros((model.nv, model.nv))
    engine.mj_fullM(model, data, full)
    full -= np.diag(model.dof_armature)
    moves = null_space(loops_of(model, data)[1])
    moves = moves @ np.linalg.inv(moves[list(ACTUATED)])
    expected = moves.T @ full @ moves
    # With the rotors, the fastest motion turns by less than half a radian in MuJoCo's step of 2 ms.
    stiffness = np.diag(1e3 * np.array(STIFFNESS))
    rotors = np.diag(model.dof_armature[list(ACTUATED)])
    fastest = float(np.sqrt(eigh(stiffness, expected + rotors, eigvals_only=True)[-1]))
    assert fastest * 2e-3 < 0.4
    assert (np.diag(rotors) >= 0.999 * np.diag(expected)).all()


def test_model_of_a_seed_is_the_same_and_states_it() -> None:
    first, again, other = (simulation_mjcf(ImperfectMachine.draw(OFF, n)) for n in (7, 7, 8))
    assert first == again != other
    assert "drawn with seed 7." in first
    assert f"l1: {ImperfectMachine.draw(OFF, 7).deviations[0] * OFF.unit_mm:+.6g} mm" in first
    assert "seed" not in simulation_mjcf(OFF)


def test_servos_of_machine_without_deviations_are_those_of_the_design() -> None:
    models = [engine.MjModel.from_xml_string(simulation_mjcf(each)) for each in (SPRINGS, IDEAL)]
    assert (models[0].actuator_gainprm == models[1].actuator_gainprm).all()
    model, _ = springs_of(SPRINGS)
    assert_allclose(model.actuator_gainprm[:, 0], 1e3 * np.array(STIFFNESS), rtol=1e-12)


def test_machines_that_cannot_be_made_are_refused() -> None:
    with pytest.raises(InputError, match=r"states no errors.*tolerances, actuators\.error_mm"):
        ImperfectMachine.draw(IDEAL, 0)
    with pytest.raises(InputError, match="deviations"):
        ImperfectMachine(OFF, np.zeros(28))
    with pytest.raises(InputError, match="deviations"):
        ImperfectMachine(OFF, np.full(31, np.nan))
    huge = ImperfectMachine(OFF, np.full(31, 30.0))
    with pytest.raises(NoAnswerError, match="do not close near the pose of the design"):
        simulation_mjcf(huge)
    singular = Pose(OFF.home_pose.position, (1.0, 0.0, 0.0, 0.0))
    # Some machines have a pose near a singular one with its joints, others none.
    flat = msgspec.structs.replace(OFF, home=singular)
    closing = ImperfectMachine.draw(flat, 0)
    joints = inverse(flat, singular.position, singular.rotation)
    assert_allclose(joints_read(closing, closing.home), joints, atol=3e-12 * OFF.reach)
    with pytest.raises(NoAnswerError, match="do not close"):
        simulation_mjcf(ImperfectMachine.draw(flat, 2))
    springs = msgspec.structs.replace(SPRINGS, home=singular)
    with pytest.raises(NoAnswerError, match="no servos hold it"):
        simulation_mjcf(ImperfectMachine.draw(springs, 0))
