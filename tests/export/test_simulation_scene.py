"""The simulation model as a part of scenes, and its servos at rest, judged by MuJoCo."""

from __future__ import annotations

from typing import Any

import msgspec
import numpy as np
import pytest
from limited_designs import limited
from machines import FULL, OPTIMAL, PRESS
from mujoco_models import at_home, engine, joints_of, loops_of
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation
from statics_cases import random_poses

from explorer import (
    JOINTS,
    PRESETS,
    Actuators,
    Design,
    NoAnswerError,
    Payload,
    Pose,
    Tool,
    inverse,
    tool_position,
)
from explorer.export.simulation import DENSITY, SimulationModel, simulation_mjcf
from explorer.mechanism.design import DOWN, LENGTHS, Swing
from explorer.mechanism.design_file import typical_machine
from explorer.mechanism.machine import STANDARD_GRAVITY
from explorer.motion.chains import ACTUATED
from explorer.motion.masses import bar_masses, moving_bodies
from explorer.prototype.assembly import make_prototype
from explorer.prototype.imperfect import ImperfectMachine
from explorer.statics.accuracy import SOURCES
from explorer.statics.loaded import LoadedPose

UNLIMITED = msgspec.structs.replace(
    PRESS, actuators=Actuators(), tool=Tool((1, 0, 2), (1, 1, 0, 1))
)
FILE = "machine.xml"
# Scenes of bodies that touch, with options, units of angles and defaults of their own.
OPTIONS = '<option timestep="0.003" integrator="implicit" gravity="0.5 0 -3" iterations="7"/>'
THINGS = """
<worldbody>
  <geom name="floor" type="plane" size="5 5 .1"/>
  <body name="crate" pos="0.7 0.7 0.1"><freejoint/><geom name="crate" type="box" size=".1 .1 .1"/>
    <body><joint name="lid" type="hinge" axis="1 0 0" range="-1 1" ref="0.1"
      limited="true"/>
      <geom type="box" size=".1 .1 .01" pos="0 0 .3"/></body></body>
</worldbody>
<actuator><general name="lid" joint="lid" dyntype="integrator"/></actuator>
"""
DEFAULTS = """
<default>
  <geom mass="3" contype="1" conaffinity="1" friction="2 .1 .1"/>
  <joint damping="5" armature="1" frictionloss="2" stiffness="3" limited="true" range="-1 1"
    pos="0.1 0 0" margin="0.01" springdamper="0.1 1"
    actuatorfrclimited="true" actuatorfrcrange="-1 1"/>
  <equality active="false" solref="0.05 1" solimp="0.5 0.6 0.01"/>
  <tendon stiffness="9" damping="3" frictionloss="1" limited="false" margin="1"/>
  <general dyntype="filter" dynprm="0.2" ctrllimited="true" ctrlrange="-1 1" gear="7"
    forcelimited="true" forcerange="-0.1 0.1" biastype="none"
    actlimited="true" actrange="0 1"/>
</default>
"""
HOSTS = [
    ("", '<compiler angle="radian"/>' + OPTIONS),
    ('<compiler angle="radian" autolimits="false"/>' + OPTIONS, ""),
    (OPTIONS + '<compiler angle="degree"/>', ""),
]


def model_of(text: str, machine: str = "") -> Any:
    return engine.MjModel.from_xml_string(text, {FILE: machine.encode()})


def scene_of(ahead: str, behind: str, guest: str = f'<include file="{FILE}"/>') -> str:
    return f"<mujoco>{ahead}{guest}{THINGS}{behind}</mujoco>"


def rest(model: Any, data: Any, seconds: float = 1.5, still: float = 1e-4) -> None:
    """Step a model until it is at rest."""
    engine.mj_step(model, data, nstep=int(seconds / model.opt.timestep))
    assert data.time > 0.9 * seconds
    assert np.abs(data.qvel).max() < still


def loaded(seed: int) -> Design:
    """Return a random design, with a payload, a tool, a direction of gravity and a home."""
    rng = np.random.default_rng(seed)
    design = PRESETS["paper-optimal"]
    design = design.with_variables([v * rng.uniform(0.8, 1.2) for v in design.variables])
    ranges = dict.fromkeys(LENGTHS, (0.0, 4.0 * design.reach))
    radii = tuple(rng.uniform(0.1, 0.6, 4))
    limits = msgspec.structs.replace(design.limits, leg_radii=radii, **ranges)
    positions, rotations = random_poses(design, 1, seed, margin=0.2)
    return msgspec.structs.replace(
        design,
        limits=limits,
        unit_mm=float(rng.choice([3.0, 10.0, 40.0])),
        payload=Payload(rng.uniform(0.1, 5.0), tuple(rng.normal(size=3) * 2.0)),
        tool=Tool(tuple(rng.normal(size=3)), tuple(rng.normal(size=4))),
        gravity=tuple(rng.normal(size=3)) if seed % 2 else DOWN,
        home=Pose.of(positions[0], rotations[0]),
    )


HUNG = msgspec.structs.replace(UNLIMITED, gravity=(0, 0, 1))
LOADED = [UNLIMITED, OPTIMAL, HUNG, *map(loaded, range(3))]


@pytest.mark.parametrize(("ahead", "behind"), HOSTS)
def test_scene_with_the_model_keeps_its_options_contacts_and_units(ahead: str, behind: str) -> None:
    alone = model_of(scene_of(ahead, behind, ""))
    both = model_of(scene_of(ahead, behind), simulation_mjcf(PRESS))
    for name in dir(alone.opt):
        if not name.startswith("_"):
            assert np.array_equal(getattr(alone.opt, name), getattr(both.opt, name)), name
    for kind in ("geom", "joint", "body", "actuator"):
        for index in range(
            getattr(alone, {"joint": "njnt", "actuator": "nu"}.get(kind, f"n{kind}"))
        ):
            name = getattr(alone, kind)(index).name
            if not name:
                continue
            one, other = (getattr(each, kind)(name) for each in (alone, both))
            for field in ("contype", "conaffinity", "mass", "range", "friction", "limited", "gear"):
                if hasattr(one, field):
                    assert np.array_equal(getattr(one, field), getattr(other, field)), field
    # The scene's own bodies still touch each other.
    data = at_home(both)
    engine.mj_step(both, data, nstep=400)
    assert data.time > 1.0
    assert data.ncon > 0
    assert data.body("crate").xpos[2] > 0.05


@pytest.mark.parametrize("design", [PRESS, limited(OPTIMAL, swing=Swing(a1=30.0, a3=50.0))])
@pytest.mark.parametrize(("ahead", "behind"), HOSTS)
def test_model_in_a_scene_is_the_model_alone(design: Design, ahead: str, behind: str) -> None:
    machine = simulation_mjcf(design)
    alone = model_of(machine)
    both = model_of(scene_of(ahead.replace("false", "true") + DEFAULTS, behind), machine)
    joints = [alone.joint(k).name for k in range(alone.njnt)]
    fields = {
        "joint": ("armature", "damping", "frictionloss", "stiffness", "limited", "range", "pos"),
        "actuator": ("gainprm", "biasprm", "dyntype", "gear", "ctrllimited", "forcelimited"),
        "body": ("mass", "inertia", "ipos"),
    }
    names = {"joint": joints, "actuator": JOINTS, "body": ["base", "platform", "rod_4", "cross_1"]}
    for kind, listed in names.items():
        for name in listed:
            one, other = (getattr(each, kind)(name) for each in (alone, both))
            for field in fields[kind]:
                if field != "range" or one.limited[0]:
                    expected = getattr(one, field)
                    assert np.array_equal(expected, getattr(other, field)), (name, field)
    fields_of_model = (
        *("eq_active0", "eq_solref", "eq_solimp"),
        *("tendon_stiffness", "tendon_limited", "tendon_range", "tendon_margin"),
    )
    for field in fields_of_model:
        assert np.array_equal(getattr(alone, field), getattr(both, field)), field
    assert not both.geom_contype[both.geom_bodyid == both.body("platform").id].any()
    data = at_home(both)
    for k, name in enumerate(joints):
        start, width = alone.joint(name).qposadr[0], len(alone.joint(name).qpos0)
        assert_allclose(
            data.joint(name).qpos, alone.key_qpos[0][start : start + width], err_msg=str(k)
        )
    # The scene's keyframes are shorter by its own joints, which come first or last.
    assert np.abs(loops_of(both, data)[0]).max() < 1e-9


# The parts of a random design need not fit.
BODIES = [(design, "bars") for design in LOADED] + [(UNLIMITED, "parts"), (OPTIMAL, "parts")]


@pytest.mark.parametrize(("design", "masses"), BODIES, ids=range(len(BODIES)))
def test_servos_at_rest_give_the_forces_of_statics(design: Design, masses: str) -> None:
    found = bar_masses(design, DENSITY)
    if masses == "parts":
        found = make_prototype(design).masses(2700.0)
    given = SimulationModel(design, masses=found)
    model = model_of(given.text())
    weights = moving_bodies(design, found, payload=False)
    home, metres = design.home_pose, 1e-3 * design.unit_mm
    rng = np.random.default_rng(5)
    for share in (0.0, 0.05, 0.05):
        position = np.array(home.position) + share * design.reach * rng.uniform(-1.0, 1.0, 3)
        turn = Rotation.from_rotvec(2.0 * share * rng.normal(size=3)).as_matrix()
        pose = Pose.of(position, home.rotation @ turn)
        forces = LoadedPose(design, pose, own=weights).reactions.actuators
        data = engine.MjData(model)
        data.qpos[:] = joints_of(design, position, pose.rotation)
        data.ctrl[:] = metres * inverse(design, position, pose.rotation)
        data.ctrl[:] += (forces - given.servos.forces) / given.servos.stiffness
        engine.mj_forward(model, data)
        start = data.site("tool").xpos.copy(), data.site("tool").xmat.reshape(3, 3).copy()
        tool = data.body("base").xmat.reshape(3, 3) @ tool_position(pose, design.tool.position)
        assert_allclose(start[0], metres * tool, atol=1e-12 * metres * design.reach)
        rest(model, data)
        assert_allclose(data.actuator_force, forces, atol=1e-3 * np.abs(forces).max())
        # Nothing droops, but for what the loops give way in steps of 2 ms.
        assert np.linalg.norm(data.site("tool").xpos - start[0]) < 1e-4 * metres * design.reach
        turned = Rotation.from_matrix(data.site("tool").xmat.reshape(3, 3) @ start[1].T)
        assert turned.magnitude() < 1e-4


@pytest.mark.parametrize(
    ("integrator", "timestep"), [("EULER", 5e-4), ("IMPLICITFAST", 4e-3), ("RK4", 4e-3)]
)
def test_servos_are_stable_for_time_steps_and_integrators(integrator: str, timestep: float) -> None:
    for design in (UNLIMITED, loaded(3)):
        model = model_of(simulation_mjcf(design))
        model.opt.timestep = timestep
        model.opt.integrator = getattr(engine.mjtIntegrator, f"mjINT_{integrator}")
        data = at_home(model)
        data.ctrl[:] += 0.02 * 1e-3 * design.unit_mm * design.reach * np.array([1, 1, -1, 1, 1, -1])
        # Implicit integrators leave a tremor of the loops.
        rest(model, data, still=2e-2)
        reach = 1e-3 * design.unit_mm * design.reach
        assert np.abs(loops_of(model, data)[0]).max() < 1e-3 * reach
        assert_allclose(data.qpos[list(ACTUATED)], data.ctrl, atol=1e-2 * reach)


@pytest.mark.parametrize("design", LOADED)
def test_machines_on_a_flange_a_ceiling_and_behind_other_bodies_start_closed(
    design: Design,
) -> None:
    arm = f"""<mujoco><asset><model name="guest" file="{FILE}"/></asset>{DEFAULTS}<worldbody>
    <body name="arm" pos="0 0 1"><joint name="arm" axis="0 1 0"/><geom size="0.1"/>
    <frame pos="0.1 0 0.2" euler="20 30 40"><attach model="guest" body="base" prefix="flange-"/>
    </frame></body><frame pos="0 0 3" quat="0 1 0 0">
    <attach model="guest" body="base" prefix="ceiling-"/></frame></worldbody></mujoco>"""
    behind = f'<mujoco>{THINGS}<include file="{FILE}"/></mujoco>'
    machine = simulation_mjcf(design)
    alone = at_home(model_of(machine))
    expected = alone.body("base").xmat.reshape(3, 3).T @ alone.body("platform").xpos
    for host, prefixes in ((arm, ("flange-", "ceiling-")), (behind, ("",))):
        model = model_of(host, machine)
        data = engine.MjData(model)
        # Whatever moves the flange, the loops stay closed.
        data.joint(0).qpos[0] += 0.7
        for state in (data, *(at_home(model, f"{prefix}home") for prefix in prefixes if prefix)):
            engine.mj_forward(model, state)
            loops = np.array(state.efc_type) == int(engine.mjtConstraint.mjCNSTR_EQUALITY)
            assert loops.sum() == 9 * len(prefixes)
            assert np.abs(np.array(state.efc_pos)[loops]).max() < 1e-9
            for prefix in prefixes:
                base, platform = (state.body(prefix + name) for name in ("base", "platform"))
                found = base.xmat.reshape(3, 3).T @ (platform.xpos - base.xpos)
                assert_allclose(found, expected, atol=1e-9)


@pytest.mark.parametrize("seed", range(2))
def test_droop_is_that_of_the_model(seed: int) -> None:
    design = loaded(seed)
    design = msgspec.structs.replace(
        design, actuators=Actuators(stiffness_n_mm=(9e4, 8e4, 7e4, 6e4, 8e4, 5e4))
    )
    given = SimulationModel(ImperfectMachine(design, np.zeros(len(SOURCES))))
    model = model_of(given.text())
    model.opt.gravity[:] = STANDARD_GRAVITY * np.array(DOWN)
    model.opt.timestep = 2e-4
    data = at_home(model)
    start = data.site("tool").xpos.copy(), data.site("tool").xmat.reshape(3, 3).copy()
    rest(model, data, 0.5, still=1e-2)
    base = data.body("base").xmat.reshape(3, 3)
    moved = base.T @ (data.site("tool").xpos - start[0]) * 1e3 / design.unit_mm
    turned = Rotation.from_matrix(data.site("tool").xmat.reshape(3, 3) @ start[1].T).as_rotvec()
    expected = given.servos.droop(design)
    for found, meant in ((moved, expected[:3]), (base.T @ turned, expected[3:])):
        assert_allclose(found, meant, atol=0.01 * np.abs(meant).max())


def test_servos_push_and_pull_up_to_their_limits() -> None:
    design = msgspec.structs.replace(
        PRESS, actuators=Actuators(push_n=(5, 5, 5, 5, 5, 5), pull_n=(3, 2, 3, 2, 3, 3))
    )
    model = model_of(simulation_mjcf(design))
    assert model.actuator_forcelimited.all()
    ranges = np.stack([-np.array(design.actuators.pull_n or ()), [5.0] * 6], axis=1)
    assert_allclose(model.actuator_forcerange, ranges)
    assert not model_of(simulation_mjcf(UNLIMITED)).actuator_forcelimited.any()
    # Statics ask for 6.4 N of d1, which has 5 N: the platform sinks.
    data = at_home(model)
    start = data.site("tool").xpos.copy()
    engine.mj_step(model, data, nstep=100)
    assert data.actuator("d1").force == 5.0
    assert np.linalg.norm(data.site("tool").xpos - start) > 1e-4
    pulls_only = Actuators(pull_n=(3, 2, 3, 2, 3, 3))
    model = model_of(simulation_mjcf(msgspec.structs.replace(PRESS, actuators=pulls_only)))
    assert (model.actuator_forcerange[:, 0] == [-3, -2, -3, -2, -3, -3]).all()
    assert (model.actuator_forcerange[:, 1] >= 1e9).all()


def test_limits_that_home_exceeds_end_at_home() -> None:
    design = limited(UNLIMITED, l1=(0.0, 5.0), d2=(12.0, None), guide=(0.0, 5.0), gap=4.0)
    model = model_of(simulation_mjcf(design))
    data = at_home(model)
    for name in ("l1", "d2", "d1", "d3"):
        low, high = model.joint(name).range
        assert low <= data.joint(name).qpos[0] <= high
    rest(model, data)
    tool = 1e-3 * design.unit_mm * np.array(tool_position(design.home_pose, design.tool.position))
    assert_allclose(data.site("tool").xpos, tool, atol=1e-5)


def test_model_lists_what_it_leaves_out() -> None:
    always = ("friction", "contacts", "the mass of the base")
    free = limited(msgspec.structs.replace(OPTIMAL, payload=Payload(1.0)), box=None)
    assert SimulationModel(free).left_out == always
    told = SimulationModel(limited(FULL, margin=0.1, swing=Swing(b4=30.0))).left_out
    assert told == (
        *always,
        "the force of the payload, 4 N",
        "limits of struts",
        "limits of the guide",
        "swing limits of the ball joints",
        "the box of positions",
        "the least margins",
    )
    assert "; ".join(told) in simulation_mjcf(limited(FULL, margin=0.1, swing=Swing(b4=30.0)))
    typical, _ = typical_machine(free)
    assert SimulationModel(typical).left_out == (*always, "errors and stiffness")
    assert SimulationModel(ImperfectMachine.draw(typical, 0)).left_out == always
    exceeded = limited(free, gap=9.0)
    assert SimulationModel(exceeded).left_out == (*always, "limits that the home pose exceeds")


def test_model_of_a_singular_home_is_refused() -> None:
    singular = Pose(OPTIMAL.home_pose.position, (1.0, 0.0, 0.0, 0.0))
    with pytest.raises(NoAnswerError, match="home pose is singular, so that no servos hold it"):
        simulation_mjcf(msgspec.structs.replace(OPTIMAL, home=singular))
