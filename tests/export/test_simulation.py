"""The simulation model, judged by MuJoCo: loops, servos, singularities."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import numpy as np
import pytest
from limited_designs import limited
from mujoco_models import at_home, engine, joints_of, loops_of
from scipy.spatial.transform import Rotation
from strategies import WAYS

from explorer import (
    JOINTS,
    PRESETS,
    Design,
    InputError,
    Pose,
    evaluate,
    forward,
    inverse,
    margins,
)
from explorer.export.simulation import (
    SIMULATION_BODIES,
    SIMULATION_JOINTS,
    simulation_mjcf,
)
from explorer.mechanism.design import Swing
from explorer.mechanism.margins import mode_of
from explorer.motion.chains import ACTUATED, CHAIN_JOINTS, Chains
from explorer.motion.masses import Mass, ball, bar, total_mass
from explorer.numerics.arrays import FloatArray
from explorer.prototype.assembly import make_prototype

OPTIMAL = PRESETS["paper-optimal"]
POSES = 40


def random_design(seed: int) -> Design:
    """Return a design of any proportions, size and unit, its home of any orientation."""
    rng = np.random.default_rng(seed)
    x = rng.uniform(0.3, 1.0, 6) * rng.choice([-1.0, 1.0], 6) * 10.0 ** rng.uniform(0.5, 2.5)
    a3x, a3y, b1x, b1y, b2, b3 = x.tolist()
    rotation = Rotation.random(random_state=rng).as_matrix()
    pose = Pose.of(rng.uniform(-1.0, 1.0, 3) * abs(a3x), rotation)
    return Design(
        a3=(a3x, a3y),
        b1=(b1x, b1y),
        b2=b2,
        b3=b3 if abs(b3 - b2) > 0.2 * abs(b3) else -b3,
        unit_mm=10.0 ** rng.uniform(1.0, 2.0),
        home=pose,
    )


DESIGNS = [OPTIMAL, *map(random_design, range(3))]


def random_poses(design: Design, many: int, seed: int = 0) -> tuple[FloatArray, FloatArray]:
    rng = np.random.default_rng(seed)
    positions = rng.uniform(-1.5, 1.5, (many, 3)) * design.reach
    return positions, Rotation.random(many, random_state=rng).as_matrix()


def model_of(design: Design) -> Any:
    return engine.MjModel.from_xml_string(simulation_mjcf(design))


def set_pose(design: Design, data: Any, position: FloatArray, rotation: FloatArray) -> None:
    data.qpos[:] = joints_of(design, position, rotation)


def test_model_has_every_joint_and_six_servos() -> None:
    model = model_of(OPTIMAL)
    assert (model.nq, model.nv, model.nu, model.neq) == (16, 15, 6, 3)
    names = [model.joint(k).name for k in range(model.njnt)]
    assert tuple(names) == SIMULATION_JOINTS
    assert [model.actuator(k).name for k in range(6)] == list(JOINTS)
    assert [names.index(name) for name in JOINTS] == list(ACTUATED)
    bodies = [model.body(k).name for k in range(1, model.nbody)]
    sockets = [f"socket_{leg}" for leg in (1, 2, 3)]
    assert [name for name in bodies if name not in sockets] == list(SIMULATION_BODIES)
    assert not any(" " in name for name in [*names, *bodies])
    for name in SIMULATION_BODIES[1:]:
        assert model.body(name).mass[0] > 0.0
        assert (model.body(name).inertia > 0.0).all()
    assert model.body("base").mass[0] == 0.0
    for leg in (1, 2, 3):
        socket, rod = model.body(f"socket_{leg}"), model.body(f"rod_{leg}")
        assert 0.0 < socket.mass[0] < 1e-9 * rod.mass[0]
        assert (socket.inertia < 1e-9 * rod.inertia.max()).all()


@pytest.mark.parametrize("design", DESIGNS)
def test_model_starts_at_home_and_its_loops_close_at_our_joint_values(design: Design) -> None:
    model = model_of(design)
    home, metres = design.home_pose, design.unit_mm * 1e-3
    expected = joints_of(design, np.array(home.position), home.rotation)
    assert (model.key_qpos[0] == model.qpos0).all()
    np.testing.assert_allclose(model.key_qpos[0], expected, rtol=1e-12, atol=1e-12)
    lengths = inverse(design, home.position, home.rotation) * metres
    np.testing.assert_allclose(model.key_ctrl[0], lengths, rtol=1e-12)
    data = engine.MjData(model)
    size = metres * max(design.reach, *map(abs, design.variables))
    positions, rotations = random_poses(design, POSES)
    for position, rotation in zip(positions, rotations, strict=True):
        set_pose(design, data, position, rotation)
        engine.mj_forward(model, data)
        residual, _ = loops_of(model, data)
        assert np.abs(residual).max() < 1e-8 * size
        # The values are not merely consistent: they are the joints of the pose.
        actuated = data.qpos[list(ACTUATED)] / metres
        np.testing.assert_allclose(actuated, inverse(design, position, rotation), rtol=1e-12)
    # And a wrong length opens its loop.
    data.qpos[ACTUATED[0]] += 1e-6 * size
    engine.mj_forward(model, data)
    assert np.abs(loops_of(model, data)[0]).max() > 1e-7 * size


@pytest.mark.parametrize("design", DESIGNS)
def test_model_bodies_lie_where_the_chains_put_them(design: Design) -> None:
    model = model_of(design)
    data = engine.MjData(model)
    chains = Chains.of(design)
    metres = design.unit_mm * 1e-3
    positions, rotations = random_poses(design, 20, seed=3)
    places = chains.places_at(positions, rotations)
    for index, (position, rotation) in enumerate(zip(positions, rotations, strict=True)):
        set_pose(design, data, position, rotation)
        engine.mj_kinematics(model, data)
        atol = 1e-12 * metres * design.reach
        bodies = [data.body(name) for name in SIMULATION_BODIES]
        origins = np.array([body.xpos for body in bodies])
        np.testing.assert_allclose(origins, metres * places.origin[index], atol=atol)
        turns = np.array([body.xmat for body in bodies]).reshape(-1, 3, 3)
        np.testing.assert_allclose(turns, places.rotation[index], atol=1e-12)


def locked_jacobian(design: Design, position: FloatArray, rotation: FloatArray) -> FloatArray:
    """Return the loops' Jacobian with the actuated joints locked, made homogeneous, (15, 15)."""
    model = model_of(design)
    data = engine.MjData(model)
    set_pose(design, data, position, rotation)
    engine.mj_forward(model, data)
    _, loops = loops_of(model, data)
    locks = np.eye(model.nv)[list(ACTUATED)]
    # Rates of slides are lengths over time, the others angles.
    is_length = np.append(np.isin(CHAIN_JOINTS, JOINTS), [False] * 3)
    size = design.reach * design.unit_mm * 1e-3
    columns = np.where(is_length, size, 1.0)
    return np.vstack([loops / size, locks / size]) * columns


def singular_pose(
    design: Design, way: tuple[int, ...], rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Return a random pose at which the margins of a way vanish."""
    rotation = Rotation.random(random_state=rng).as_matrix()
    normals = {
        1: rotation[:, 2],
        2: np.array([0.0, -rotation[2, 0], rotation[1, 0]]),
        3: np.array([0.0, 0.0, 1.0]),
    }
    rows = np.array([normals[each] for each in way])
    position = rng.uniform(-1.0, 1.0, 3) * design.reach
    return position - np.linalg.pinv(rows) @ (rows @ position), rotation


@pytest.mark.parametrize("design", DESIGNS)
def test_locked_model_moves_at_singular_poses_alone(design: Design) -> None:
    rng = np.random.default_rng(7)
    for way in (way for way in WAYS if len(way) < 3):
        for _ in range(2):
            position, rotation = singular_pose(design, way, rng)
            values = np.linalg.svd(locked_jacobian(design, position, rotation), compute_uv=False)
            assert values[-1] < 1e-12 * values[0]
    positions, rotations = random_poses(design, 10, seed=11)
    for position, rotation in zip(positions, rotations, strict=True):
        share = margins(position, rotation) / design.reach
        locked = locked_jacobian(design, position, rotation)
        values = np.linalg.svd(locked, compute_uv=False)
        assert values[-1] > 1e-6 * np.abs(share).min() * values[0]


def test_model_servos_reach_the_pose_of_forward_kinematics() -> None:
    design = OPTIMAL
    model = model_of(design)
    data = at_home(model)
    home = design.home_pose
    mode = int(mode_of(margins(home.position, home.rotation)))
    metres = design.unit_mm * 1e-3
    turn = Rotation.from_euler("ZYX", [8.0, -5.0, 6.0], degrees=True).as_matrix()
    start = inverse(design, home.position, home.rotation)
    shift = 0.08 * design.reach * np.array([1.0, -0.5, 0.7])
    end = inverse(design, home.position + shift, home.rotation @ turn)
    steps = 1000
    for step in range(steps):
        share = min(1.0, 1.5 * step / steps)
        smooth = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
        command = start + smooth * (end - start)
        data.ctrl[:] = metres * command
        engine.mj_step(model, data)
        if step % 100 == 99:
            found = forward(design, command)
            assert bool(found.feasible)
            off = np.linalg.norm(data.body("platform").xpos / metres - found.position[mode])
            assert off < 2e-2 * design.reach
    # At rest nothing is left but what the weight and the soft constraints give.
    reached = data.qpos[list(ACTUATED)] / metres
    np.testing.assert_allclose(reached, end, atol=1e-3 * design.reach)
    found = forward(design, reached)
    platform = data.body("platform")
    off = np.linalg.norm(platform.xpos / metres - found.position[mode])
    assert off < 1e-4 * design.reach
    relative = platform.xmat.reshape(3, 3).T @ found.rotation[mode]
    assert Rotation.from_matrix(relative).magnitude() < 1e-4
    moved = np.linalg.norm(platform.xpos / metres - home.position)
    assert moved > 0.9 * np.linalg.norm(shift)


def test_model_limits_become_ranges_in_metres() -> None:
    limits: dict[str, Any] = {
        "l1": (3.0, 15.0),
        "d2": (2.0, None),
        "guide": (-1.0, 22.0),
        "gap": 0.25,
        "swing": Swing(a1=30.0, a3=100.0, b1=40.0),
    }
    design = limited(OPTIMAL, **limits)
    model = model_of(design)
    assert model.joint("l1").range.tolist() == pytest.approx([0.03, 0.15])
    assert model.joint("d2").range.tolist() == pytest.approx([0.02, 0.01 * design.reach])
    for name in ("d1", "d3"):
        assert model.joint(name).range.tolist() == pytest.approx([-0.01, 0.22])
        assert model.actuator(name).ctrlrange.tolist() == pytest.approx([-0.01, 0.22])
    half = math.radians(30.0)
    names = [model.tendon(k).name for k in range(model.ntendon)]
    assert names == ["gap", "a1_first", "a1_second"]
    for index in (1, 2):
        assert model.tendon_range[index].tolist() == pytest.approx([-half, half])
        assert not model.joint(names[index]).limited
    data = engine.MjData(model)
    engine.mj_forward(model, data)
    assert model.tendon_range[0, 0] == pytest.approx(0.0025)
    home = design.home_pose
    q = inverse(design, home.position, home.rotation)
    assert data.ten_length.tolist() == pytest.approx([0.01 * abs(q[1] - q[3]), 0.0, 0.0])


@pytest.mark.parametrize("yaw", [-73.1, -106.9])
def test_model_carriages_keep_the_demanded_order(yaw: float) -> None:
    home = Pose.of_yaw_pitch_roll(OPTIMAL.home_pose.position, (yaw, 0.0, 0.0))
    design = msgspec.structs.replace(OPTIMAL, home=home)
    model = model_of(design)
    data = engine.MjData(model)
    engine.mj_forward(model, data)
    low, high = model.tendon_range[0].tolist()
    assert low == 0.0 < data.ten_length[0] < high
    assert model_of(limited(design, carriage_order="any")).ntendon == 0


@pytest.mark.parametrize("half_angle", [20.0, 89.0])
def test_model_ranges_of_hinges_hold_the_swing_cone(half_angle: float) -> None:
    design = limited(OPTIMAL, margin=None, swing=Swing(a1=half_angle, a3=half_angle))
    model = model_of(design)
    rng = np.random.default_rng(2)
    home = design.home_pose
    shifts = rng.uniform(-1.0, 1.0, (400, 3)) * rng.uniform(0.0, design.reach, (400, 1))
    positions = np.array(home.position) + shifts
    rotations = np.broadcast_to(home.rotation, (400, 3, 3))
    values = joints_of(design, positions, rotations)
    kept = 0
    for position, rotation, joints in zip(positions, rotations, values, strict=True):
        snapshot = evaluate(design, Pose.of(position, rotation))
        if any(each.limit.startswith("swing") for each in snapshot.violations):
            continue
        kept += 1
        for name in ("a1_first", "a1_second", "a3_first", "a3_second"):
            low, high = model.tendon_range[model.tendon(name).id]
            assert low <= joints[SIMULATION_JOINTS.index(name)] <= high
    assert kept > 20


def test_model_masses_of_parts_are_used() -> None:
    prototype = make_prototype(OPTIMAL)
    masses = prototype.masses(2700.0)
    model = engine.MjModel.from_xml_string(simulation_mjcf(OPTIMAL, masses=masses))
    for name, mass in masses.items():
        body = model.body(name.replace(" ", "_"))
        assert body.mass[0] == pytest.approx(mass.mass, rel=1e-9)
        np.testing.assert_allclose(body.ipos, mass.centre, atol=1e-12)
        turn = np.empty(9)
        engine.mju_quat2Mat(turn, body.iquat)
        axes = turn.reshape(3, 3)
        inertia = axes @ np.diag(body.inertia) @ axes.T
        np.testing.assert_allclose(inertia, mass.inertia, atol=1e-6 * mass.inertia.max())
    # All but the base: what moves weighs what its parts weigh.
    volume = sum(part.solid.volume for part in prototype.parts[1:]) * 1e-6
    assert float(model.body_mass.sum()) == pytest.approx(2700.0 * volume, rel=1e-9)


def test_model_unusable_designs_are_refused_with_advice() -> None:
    for density in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(InputError, match="density must be positive"):
            simulation_mjcf(OPTIMAL, density)
    light = msgspec.structs.replace(OPTIMAL, unit_mm=1e-3)
    with pytest.raises(InputError, match="the unit must be at least") as refusal:
        simulation_mjcf(light)
    least = float(str(refusal.value).partition("the unit must be at least ")[2].split(" ")[0])
    model_of(msgspec.structs.replace(OPTIMAL, unit_mm=least))
    collapsed = Pose((*OPTIMAL.a3, 0.0), (0.8, 0.0, 0.0, 0.6))
    with pytest.raises(InputError, match="leg 4 has no length"):
        simulation_mjcf(msgspec.structs.replace(OPTIMAL, home=collapsed))


def test_masses_of_bars_balls_and_meshes_agree() -> None:
    import trimesh

    shapes: Any = trimesh.creation
    start, end = np.array([1.0, 2.0, 3.0]), np.array([2.0, 0.0, 5.0])
    rod = shapes.cylinder(0.5, segment=[start, end], sections=400)
    sphere = shapes.icosphere(5, 0.7)
    sphere.apply_translation([3.0, 1.0, 0.0])
    found = bar(0.5, start, end, 2.0), ball(0.7, np.array([3.0, 1.0, 0.0]), 2.0)
    for each in (rod, sphere):
        each.density = 2.0
    meshes = [Mass(each.mass, each.center_mass, each.moment_inertia) for each in (rod, sphere)]
    for exact, mesh in zip((*found, total_mass(found)), (*meshes, total_mass(meshes)), strict=True):
        assert mesh.mass == pytest.approx(exact.mass, rel=2e-3)
        np.testing.assert_allclose(mesh.centre, exact.centre, atol=1e-3)
        np.testing.assert_allclose(mesh.inertia, exact.inertia, atol=5e-3 * exact.inertia.max())
