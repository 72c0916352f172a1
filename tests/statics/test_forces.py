"""Forces of actuators and struts: the reference, virtual work, laws of statics, derivatives."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from differences import moved
from numpy.testing import assert_allclose
from refusals import refusal
from scipy.spatial.transform import Rotation
from statics_cases import CASES, LegMasses, random_poses

from explorer import (
    PRESETS,
    Actuators,
    Design,
    Guide,
    InputError,
    Payload,
    Struts,
    Tool,
    actuator_forces,
    inverse,
    jacobian,
    largest_force,
    largest_payload,
    reactions,
    strut_bending,
)
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.machine import STANDARD_GRAVITY
from explorer.mechanism.pose import Triple
from explorer.motion.inverse_jacobian import twists_of_actuators
from explorer.motion.weights import MovingBodies, carry
from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import MANY_ROWS
from explorer.statics.forces import worst_direction
from explorer.statics.reactions import limit_shares

OPTIMAL = PRESETS["paper-optimal"]
LIMITED = msgspec.structs.replace(
    OPTIMAL,
    payload=Payload(0.8, (0.5, -0.3, 1.0)),
    actuators=Actuators(
        push_n=(300.0, 400.0, 300.0, 400.0, 300.0, 250.0),
        pull_n=(200.0, 300.0, 200.0, 300.0, 200.0, 150.0),
    ),
    struts=Struts(outer_mm=12.0, inner_mm=9.0, stress_mpa=250.0),
    guide=Guide(force_n=260.0, moment_nm=22.0),
)
BODY = Payload(0.4, (1.0, -0.5, 0.2))
LEGS = LegMasses(
    carriages=(0.0, 0.15, 0.2, 0.0),
    cylinders=(0.3, 0.25, 0.35, 0.2),
    cylinder_centres=(2.0, 1.5, 1.0, 2.5),
    rods=(0.1, 0.15, 0.12, 0.08),
    rod_centres=(2.5, 1.0, 2.0, 1.5),
)
WEIGHTS = LEGS.bodies.with_mass(BODY.mass_kg, BODY.centre)


MASSES = [
    BODY.mass_kg,
    *np.transpose((LEGS.carriages, LEGS.cylinders, LEGS.rods)).ravel().tolist(),
]
GRAVITIES = ((0.0, 0.0, -1.0), (1.0, 2.0, -0.5))


def test_forces_of_reference_are_those_of_the_reference() -> None:
    assert len(CASES) == 150
    for case in CASES:
        given = case.pose
        forces = actuator_forces(*given, case.load, case.tool)
        assert_allclose(forces, case.actuator_forces, atol=1e-9 * np.abs(forces).max())
        bending = strut_bending(*given, case.load, case.tool)
        assert_allclose(bending, case.strut_bending, atol=1e-9 * bending.max())
        force = largest_force(*given, case.most_force, case.tool)
        assert_allclose(force, case.force_in_any_direction, rtol=1e-9)


def test_forces_at_the_papers_home_are_the_published_ones() -> None:
    home = OPTIMAL.home_pose
    down = [0.0, 0.0, -10.0, 0.0, 0.0, 0.0]
    forces = actuator_forces(OPTIMAL, home.position, home.rotation, down)
    assert_allclose(forces, [0.0, 16.04, 6.34, -8.76, -3.24, 10.32], atol=0.02)
    bending = strut_bending(OPTIMAL, home.position, home.rotation, down)
    assert_allclose(bending, [149.8, 78.9], atol=0.2)


def test_twists_of_actuators_invert_the_jacobian() -> None:
    positions, rotations = random_poses(OPTIMAL, 200)
    twists = twists_of_actuators(Configuration(OPTIMAL, positions, rotations))
    products = jacobian(OPTIMAL, positions, rotations) @ twists
    scale = np.abs(twists).max(axis=(1, 2))[:, None, None]
    assert (np.abs(products - np.eye(6)) < 1e-12 * np.maximum(scale, 1.0)).all()


def centres(design: Design, position: FloatArray, rotation: FloatArray) -> FloatArray:
    """Return the centres of all masses, in the order of `MASSES`, from the geometry of the legs."""
    at = Configuration(design, position, rotation).points
    points = [position + rotation @ np.array(BODY.centre)]
    foot2, foot3 = at.b2 * [1.0, 0.0, 0.0], at.b3 * [1.0, 0.0, 0.0]
    legs = [(at.a1, at.b1), (foot2, at.b2), (foot3, at.b3), (at.a3, at.b4)]
    for leg, (base, end) in enumerate(legs):
        axis = (end - base) / np.linalg.norm(end - base)
        points += [base, base + LEGS.cylinder_centres[leg] * axis]
        points += [end - LEGS.rod_centres[leg] * axis]
    return np.array(points)


@pytest.mark.parametrize("gravity", GRAVITIES)
def test_forces_do_the_work_of_load_and_weights_in_every_displacement(gravity: Triple) -> None:
    design = msgspec.structs.replace(OPTIMAL, gravity=gravity)
    g = STANDARD_GRAVITY * np.array(design.gravity)
    rng = np.random.default_rng(4)
    for position, rotation in zip(*random_poses(design, 30, seed=4), strict=True):
        load, tool, step = rng.normal(size=6), rng.normal(size=3), 1e-5 * rng.normal(size=6)
        wrench = load + carry(Configuration(design, position, rotation, tool), WEIGHTS).wrench
        forces = actuator_forces(design, position, rotation, wrench, tool)
        ends = [moved(position, rotation, sign * step) for sign in (1.0, -1.0)]
        joints = np.subtract(*(inverse(design, *end) for end in ends))
        tools = np.subtract(*(p + r @ tool for p, r in ends))
        weights = np.subtract(*(centres(design, *end) for end in ends))
        work = load[:3] @ tools + load[3:] @ (2.0 * step[3:]) + MASSES @ weights @ g
        assert forces @ joints + work == pytest.approx(0.0, abs=1e-7 * np.abs(forces).max())


@pytest.mark.parametrize("gravity", GRAVITIES)
def test_joint_forces_balance_the_platform_and_each_leg(gravity: Triple) -> None:
    design = msgspec.structs.replace(OPTIMAL, gravity=gravity)
    g = STANDARD_GRAVITY * np.array(design.gravity)
    positions, rotations = random_poses(design, 20, seed=6)
    load = np.array([3.0, -2.0, 5.0, 1.0, 4.0, -6.0])
    held = reactions(Configuration(design, positions, rotations), load, WEIGHTS)
    scale = np.abs(held.joints).max()
    for k, (position, rotation) in enumerate(zip(positions, rotations, strict=True)):
        at = Configuration(design, position, rotation).points
        ends = [at.b1, at.b2, at.b3, at.b4]
        centre, weight = rotation @ np.array(BODY.centre), BODY.mass_kg * g
        force = load[:3] + weight + held.joints[k].sum(axis=0)
        arms = np.array([end - position for end in ends])
        moment = load[3:] + np.cross(centre, weight)
        moment = moment + np.cross(arms, held.joints[k]).sum(axis=0)
        assert_allclose(force, 0.0, atol=1e-10 * scale)
        assert_allclose(moment, 0.0, atol=1e-9 * scale)
        # Legs 2 and 3 about their carriages: the moment across the strut is the bending.
        points = centres(design, position, rotation)
        for leg in (1, 2):
            carriage, cylinder, rod = points[1 + 3 * leg : 4 + 3 * leg]
            on_strut = np.cross(ends[leg] - carriage, -held.joints[k, leg])
            on_strut += np.cross(cylinder - carriage, LEGS.cylinders[leg] * g)
            on_strut += np.cross(rod - carriage, LEGS.rods[leg] * g)
            bending = held.bending[k, leg - 1]
            # The carriage turns freely about the guide.
            assert on_strut[0] == pytest.approx(0.0, abs=1e-9 * scale)
            assert np.linalg.norm(on_strut) == pytest.approx(bending, rel=1e-9, abs=1e-9 * scale)
            total = (LEGS.carriages[leg] + LEGS.cylinders[leg] + LEGS.rods[leg]) * g
            across = (total - held.joints[k, leg])[1:]
            assert np.linalg.norm(across) == pytest.approx(held.guide_force[k, leg - 1], rel=1e-9)


def test_worst_direction_loads_its_actuator_to_the_limit() -> None:
    positions, rotations = random_poses(OPTIMAL, 40, seed=8)
    most = np.array([50.0, 60.0, 70.0, 80.0, 90.0, 40.0])
    tool = (0.3, 0.2, 1.0)
    worst = worst_direction(Configuration(OPTIMAL, positions, rotations, tool), most)
    force = largest_force(OPTIMAL, positions, rotations, most, tool)
    load = np.concatenate([force[:, None] * worst.direction, np.zeros((40, 3))], axis=1)
    shares = np.abs(actuator_forces(OPTIMAL, positions, rotations, load, tool)) / most
    assert_allclose(shares.max(axis=1), 1.0, rtol=1e-9)
    assert (shares.argmax(axis=1) == worst.actuator).all()
    rng = np.random.default_rng(8)
    for _ in range(50):
        other = rng.normal(size=(40, 3))
        other *= (force / np.linalg.norm(other, axis=1))[:, None]
        load = np.concatenate([other, np.zeros((40, 3))], axis=1)
        held = np.abs(actuator_forces(OPTIMAL, positions, rotations, load, tool)) / most
        assert (held <= 1.0 + 1e-9).all()


def test_largest_payload_uses_a_limit_up_and_keeps_all() -> None:
    positions, rotations = random_poses(LIMITED, 40, seed=9)
    load = [1.0, 2.0, -3.0, 0.0, 1.0, 0.0]
    most = largest_payload(Configuration(LIMITED, positions, rotations), load, WEIGHTS)

    def largest_share(k: int, mass: float) -> float:
        """Return the largest share of a limit in a pose under a payload."""
        weights = WEIGHTS.with_mass(mass, LIMITED.payload.centre)
        held = reactions(Configuration(LIMITED, positions[k], rotations[k]), load, weights)
        return float(limit_shares(LIMITED, held).max())

    assert 10 < (most > 0.0).sum() < 40
    for k, mass in enumerate(most.tolist()):
        if mass > 0.0:
            assert (
                largest_share(k, mass * (1.0 - 1e-9)) <= 1.0 < largest_share(k, mass * (1 + 1e-9))
            )
        else:
            assert min(largest_share(k, each) for each in np.linspace(0.0, 40.0, 40)) > 1.0


def test_mass_may_hold_a_load_that_exceeds_a_limit_alone() -> None:
    home = LIMITED.home_pose
    at_home = Configuration.at(LIMITED, home)
    alone = limit_shares(LIMITED, reactions(at_home, [0.0, 0.0, 1.0, 0.0, 0.0, 0.0])).max()
    load = [0.0, 0.0, 1.2 / float(alone), 0.0, 0.0, 0.0]
    assert limit_shares(LIMITED, reactions(at_home, load)).max() > 1.0
    most = float(largest_payload(at_home, load))
    assert most > float(largest_payload(at_home)) > 0.0
    for factor, kept in ((1.0 - 1e-9, True), (1.0 + 1e-9, False)):
        weights = MovingBodies().with_mass(most * factor, LIMITED.payload.centre)
        held = reactions(at_home, load, weights)
        assert (limit_shares(LIMITED, held).max() <= 1.0) == kept


def test_limit_shares_without_limits_are_zero_and_the_payload_is_unbounded() -> None:
    positions, rotations = random_poses(OPTIMAL, 10)
    held = reactions(Configuration(OPTIMAL, positions, rotations), [0.0, 0.0, -10.0, 0.0, 0.0, 0.0])
    assert not limit_shares(OPTIMAL, held).any()
    assert np.isinf(largest_payload(Configuration(OPTIMAL, positions, rotations))).all()
    assert np.isinf(largest_force(OPTIMAL, positions, rotations, np.full(6, np.inf))).all()


@pytest.mark.parametrize("count", [1, 2 * MANY_ROWS])
@pytest.mark.parametrize(
    ("position", "quaternion"),
    [
        ([3.0, 4.0, 5.0], [1.0, 0.0, 0.0, 0.0]),
        *((at, [0.8, 0.3, 0.2, 0.4]) for at in ([3.0, 4.0, 0.0], [0.0] * 3, [*OPTIMAL.a3, 0.0])),
    ],
)
def test_forces_of_singular_pose_are_infinite(
    position: list[float], quaternion: list[float], count: int
) -> None:
    positions = np.resize(np.array(position), (count, 3))
    turn = Rotation.from_quat(quaternion, scalar_first=True).as_matrix()
    given = LIMITED, positions, np.resize(turn, (count, 3, 3))
    load = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    assert (actuator_forces(*given, load) == np.inf).all()
    assert (strut_bending(*given, load) == np.inf).all()
    assert (largest_force(*given, np.ones(6)) == 0.0).all()
    assert (largest_payload(Configuration(*given)) == 0.0).all()
    # Without a limit, too.
    for most in (np.ones(6), np.full(6, np.inf)):
        worst = worst_direction(Configuration(*given), most)
        assert np.isnan(worst.direction).all()
        assert (worst.utilisation == np.inf).all()
    held = reactions(Configuration(*given), load)
    for values in (*held[:-1], limit_shares(LIMITED, held)):
        assert (values == np.inf).all()


def test_forces_of_unusable_arguments_are_refused() -> None:
    home = OPTIMAL.home_pose
    given = OPTIMAL, home.position, home.rotation
    assert "load (FX FY FZ MX MY MZ)" in refusal(actuator_forces, *given, [1, 2])
    for number in (np.nan, 1e308):
        refusal(actuator_forces, *given, [number] * 6)
    refusal(actuator_forces, *given, np.zeros(6), [1.0, 2.0])
    for most in ([0.0] * 6, [1.0] * 5, [np.nan] * 6):
        assert "6 positive" in refusal(largest_force, *given, most)
    positions, rotations = random_poses(OPTIMAL, 4)
    loads = np.zeros((3, 6))
    assert "broadcast" in refusal(
        actuator_forces, OPTIMAL, positions, rotations, loads, kind=InputError
    )


STEP = 1e-5


def random_case(seed: int) -> tuple[Design, FloatArray, FloatArray]:
    """Return a random design with a tool, positions and a rotation."""
    random = np.random.default_rng(seed)
    a3 = tuple(random.uniform(6.0, 14.0, 2).tolist())
    b1 = tuple((random.choice((-1.0, 1.0), 2) * random.uniform(2.0, 5.0, 2)).tolist())
    b2, gap = random.uniform(-2.0, 2.0), random.uniform(1.0, 4.0)
    design = Design(a3=a3, b1=b1, b2=b2, b3=b2 + gap)
    tool = Tool(tuple(random.normal(size=3).tolist()))
    rotation = Rotation.from_euler("zyx", random.uniform(-1.2, 1.2, 3)).as_matrix()
    positions = random.uniform((2.0, 2.0, 5.0), (12.0, 8.0, 12.0), (8, 3))
    return msgspec.structs.replace(design, tool=tool), positions, rotation
