"""Inverse dynamics, judged by MuJoCo, by the balance of energy and by Newton's laws of the legs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import msgspec
import numpy as np
import pytest
from mujoco_models import OPTIMAL, engine, joints_of, loops_of, random_design
from numpy.testing import assert_allclose
from refusals import refusal
from scipy.spatial.transform import Rotation
from smooth_motion import Motion, derivatives, random_motions

from explorer import (
    Configuration,
    Design,
    Payload,
    inverse_dynamics,
    jacobian,
    joint_rates,
    make_prototype,
    reactions,
)
from explorer.export.simulation import simulation_mjcf
from explorer.mechanism.design import DOWN
from explorer.mechanism.machine import STANDARD_GRAVITY
from explorer.motion.chains import ACTUATED, BODIES, LEGS, ON_GUIDE, Chains
from explorer.motion.inverse_jacobian import forces_of
from explorer.motion.masses import DENSITY, Mass, bar_masses, moving_bodies, with_payload
from explorer.motion.weights import carry
from explorer.numerics.arrays import FloatArray

DESIGNS = [msgspec.structs.replace(OPTIMAL, payload=Payload(0.5)), *map(random_design, range(9))]
# States of each design, so fast that inertia counts as much as weight.
STATES, RATE = 20, 4.0
# Step of time of differences: some legs are nearly along their first axis, where they turn fast.
STEP = 0.002
# Which velocities of the model are those of hinges.
HINGES = ~np.isin(np.arange(15), [*ACTUATED, 12, 13, 14])


def forces_of_model(design: Design, model: Any, motion: Motion) -> FloatArray:
    """Return the actuator forces (6,) of MuJoCo's equations of motion in one motion."""
    data = engine.MjData(model)
    here = joints_of(design, *motion[:2])

    def way(time: float) -> FloatArray:
        out = np.zeros(15)
        there = joints_of(design, *motion.pose_at(time))
        engine.mj_differentiatePos(model, out, 1.0, here, there)
        # Angles go the short way round.
        return np.where(HINGES, (out + np.pi) % (2.0 * np.pi) - np.pi, out)

    data.qpos[:] = here
    data.qvel[:], acceleration = derivatives(way, STEP)
    engine.mj_forward(model, data)
    inertia = np.zeros((15, 15))
    engine.mj_fullM(model, data, inertia)
    needed = inertia @ acceleration + np.array(data.qfrc_bias, dtype=np.float64)
    columns = np.concatenate([np.eye(15)[list(ACTUATED)], loops_of(model, data)[1]]).T
    return np.array(np.linalg.solve(columns, needed)[:6], dtype=np.float64)


@pytest.mark.parametrize(
    ("index", "of"),
    [*((index, "bars") for index in range(len(DESIGNS))), (0, "parts")],
)
def test_inverse_dynamics_is_that_of_the_exported_model(index: int, of: str) -> None:
    design = DESIGNS[index]
    masses = make_prototype(design).masses(DENSITY) if of == "parts" else None
    model = engine.MjModel.from_xml_string(simulation_mjcf(design, DENSITY, masses))
    model.opt.gravity[:] = STANDARD_GRAVITY * np.array(DOWN)
    # The rotors belong to the servos, not to the mechanism.
    model.dof_armature[:] = 0.0
    motions = random_motions(design, STATES, index, RATE)
    if masses is None:
        found = inverse_dynamics(design, *motions)
    else:
        c = Configuration(design, *motions[:2])
        found = forces_of(c, carry(c, moving_bodies(design, masses), *motions[2:]).wrench)
    for forces, motion in zip(found, motions.each(), strict=True):
        expected = forces_of_model(design, model, motion)
        assert_allclose(forces, expected, atol=1e-6 * np.abs(expected).max())


def wrench_on(
    design: Design, mass: Mass, body: int, motion: Motion, point: FloatArray
) -> FloatArray:
    """Return the force and the moment about a point (3,) that move a body against its weight."""
    metres, chains = 1e-3 * design.unit_mm, Chains.of(design)
    turned = chains.places_at(*motion[:2]).rotation[body]

    def centre(time: float) -> FloatArray:
        places = chains.places_at(*motion.pose_at(time))
        return metres * places.origin[body] + places.rotation[body] @ mass.centre

    def turn(time: float) -> FloatArray:
        places = chains.places_at(*motion.pose_at(time))
        return Rotation.from_matrix(places.rotation[body] @ turned.T).as_rotvec()

    gravity = STANDARD_GRAVITY * np.array(design.gravity)
    force = mass.mass * (derivatives(centre, STEP)[1] - gravity)
    (spin, rate), inertia = derivatives(turn, STEP), turned @ mass.inertia @ turned.T
    moment = inertia @ rate + np.cross(spin, inertia @ spin)
    return np.array([*force, *moment + np.cross(centre(0.0) - metres * point, force)])


@pytest.mark.parametrize("index", range(4))
def test_reactions_in_a_motion_keep_newtons_laws_of_every_leg(index: int) -> None:
    design, tool = DESIGNS[index], np.array([0.5, 1.0, -2.0])
    masses, metres = bar_masses(design, DENSITY), 1e-3 * design.unit_mm
    motions = random_motions(design, 5, 7, RATE)
    c = Configuration(design, *motions[:2], tool)
    found = reactions(c, np.zeros(6), carry(c, moving_bodies(design, masses), *motions[2:]))
    assert_allclose(found.actuators, inverse_dynamics(design, *motions), rtol=1e-9)
    size = np.abs(found.joints).max()
    for k, motion in enumerate(motions.each()):
        places = Chains.of(design).places_at(*motion[:2])
        for leg in LEGS:
            bodies = range(3 * leg - 2, 3 * leg + 1)
            start, first = places.origin[bodies[0]], places.rotation[bodies[0]][:, 0]
            wrenches = [wrench_on(design, masses[BODIES[b]], b, motion, start) for b in bodies]
            # What the base does: all that the leg needs, less what the platform does to it.
            push, lever = -found.joints[k, leg - 1], metres * c.legs[k, leg - 1]
            by_base = np.sum(wrenches, axis=0) - [*push, *np.cross(lever, push)]
            second = np.cross(c.leg_directions[k, leg - 1], first)
            second /= np.linalg.norm(second)
            about_first, about_second = first @ by_base[3:], second @ by_base[3:]
            reach = metres * design.reach
            assert abs(about_first) < 1e-6 * size * reach
            if leg in ON_GUIDE:
                bending = metres * found.bending[k, leg - 2]
                assert_allclose(abs(about_second), bending, atol=1e-6 * size * reach)
                across = np.linalg.norm(by_base[1:3])
                assert_allclose(found.guide_force[k, leg - 2], across, atol=1e-6 * size)
                assert_allclose(found.actuators[k, 2 * leg - 3], by_base[0], atol=1e-6 * size)
            else:
                assert abs(about_second) < 1e-6 * size * reach


def energy_of(
    design: Design, masses: Mapping[str, Mass], poses: Callable[[float], Any], time: float
) -> float:
    """Return kinetic and potential energy of all bodies in a motion at a time, in joules."""
    metres, chains = 1e-3 * design.unit_mm, Chains.of(design)
    here, energy = chains.places_at(*poses(time)), 0.0
    for name, mass in masses.items():
        body = BODIES.index(name)

        def place(later: float, body: int = body, mass: Mass = mass) -> FloatArray:
            there = chains.places_at(*poses(time + later))
            turn = Rotation.from_matrix(there.rotation[body] @ here.rotation[body].T).as_rotvec()
            centre = metres * there.origin[body] + there.rotation[body] @ mass.centre
            return np.array([*centre, *turn])

        velocity = derivatives(place, STEP)[0]
        spin = here.rotation[body].T @ velocity[3:]
        energy += 0.5 * (mass.mass * velocity[:3] @ velocity[:3] + spin @ mass.inertia @ spin)
        height = place(0.0)[:3] @ np.array(design.gravity)
        energy -= mass.mass * STANDARD_GRAVITY * height
    return energy


@pytest.mark.parametrize("index", range(4))
def test_work_of_the_actuators_is_the_change_of_energy(index: int) -> None:
    design, rng = DESIGNS[index], np.random.default_rng(index)
    masses = with_payload(design, bar_masses(design, DENSITY))
    home = design.home_pose
    ways = rng.normal(size=(4, 3)) * 0.05 * design.reach
    axes = rng.normal(size=(2, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    frequencies = rng.uniform(1.0, 3.0, 2)

    # Sines along two directions, while the platform swings about two axes.
    def poses(time: float) -> tuple[FloatArray, FloatArray]:
        sines = np.sin(frequencies * time)
        turns = [Rotation.from_rotvec(0.2 * s * axis) for s, axis in zip(sines, axes, strict=True)]
        turn = (turns[0] * turns[1]).as_matrix()
        return np.array(home.position) + sines @ ways[:2], turn @ home.rotation

    def motion(time: float) -> Motion:
        sines = np.sin(frequencies * time)
        rates = frequencies * np.cos(frequencies * time)
        seconds = -(frequencies**2) * sines
        first, second = axes[0], Rotation.from_rotvec(0.2 * sines[0] * axes[0]).apply(axes[1])
        spin = 0.2 * (rates[0] * first + rates[1] * second)
        change = 0.2 * (seconds[0] * first + seconds[1] * second)
        change += 0.04 * rates[0] * rates[1] * np.cross(first, second)
        twist = np.array([*rates @ ways[:2], *spin])
        return Motion(*poses(time), twist, np.array([*seconds @ ways[:2], *change]))

    nodes, weights = np.polynomial.legendre.leggauss(40)
    rows = [motion(0.5 * (1.0 + float(x))) for x in nodes]
    motions = Motion(*map(np.stack, zip(*rows, strict=True)))
    powers = inverse_dynamics(design, *motions) * joint_rates(design, *motions[:3])
    work = 1e-3 * design.unit_mm * 0.5 * weights @ powers.sum(axis=1)
    before, after = (energy_of(design, masses, poses, time) for time in (0.0, 1.0))
    assert_allclose(work, after - before, atol=1e-7 * np.abs(powers).max() * 1e-3 * design.unit_mm)


@pytest.mark.parametrize("index", range(4))
def test_without_bodies_of_the_prototype_the_payload_counts_in_closed_form(index: int) -> None:
    payload = Payload(0.7, (1.0, 2.0, -1.0), inertia_kg_mm2=(300.0, 500.0, 400.0))
    design = msgspec.structs.replace(DESIGNS[index], payload=payload)
    metres, gravity = 1e-3 * design.unit_mm, STANDARD_GRAVITY * np.array(design.gravity)
    motions = random_motions(design, 20, index, RATE)
    found = inverse_dynamics(design, *motions, legs=False)
    for forces, (position, rotation, twist, rate) in zip(found, motions.each(), strict=True):
        arm, spin, change = metres * rotation @ payload.centre, twist[3:], rate[3:]
        acceleration = metres * rate[:3] + np.cross(change, arm)
        acceleration = acceleration + np.cross(spin, np.cross(spin, arm))
        force = payload.mass_kg * (gravity - acceleration)
        inertia = 1e-6 * rotation @ np.diag(payload.inertia_kg_mm2) @ rotation.T
        moment = np.cross(arm, force) - inertia @ change - np.cross(spin, inertia @ spin)
        wrench = np.array([*force, *moment / metres])
        expected = -np.linalg.solve(jacobian(design, position, rotation).T, wrench)
        assert_allclose(forces, expected, atol=1e-9 * np.abs(expected).max())


def test_platform_without_a_mass_is_refused() -> None:
    motion = OPTIMAL.home_pose.position, OPTIMAL.home_pose.rotation, np.ones(6), np.ones(6)
    design = msgspec.structs.replace(OPTIMAL, payload=Payload())
    assert "no mass" in refusal(lambda: inverse_dynamics(design, *motion, legs=False))


def test_inverse_dynamics_is_infinite_in_singular_poses_and_finite_along_a_first_axis() -> None:
    home = OPTIMAL.home_pose
    motion = np.ones(6), np.ones(6)
    singular = inverse_dynamics(OPTIMAL, (*OPTIMAL.a3, 0.0), home.rotation, *motion)
    assert np.isinf(singular).all()
    # b1 on the first axis of leg 1, across that leg's direction at home.
    b1 = Configuration.at(OPTIMAL, home).points.b1
    along = np.array([-b1[1], b1[0], 0.0])
    rotation = Rotation.from_rotvec([0.3, 0.2, 0.1]).as_matrix() @ home.rotation
    position = along - rotation @ OPTIMAL.platform_points[0]
    assert np.isfinite(inverse_dynamics(OPTIMAL, position, rotation, *motion)).all()
