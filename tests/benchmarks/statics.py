"""Forces, motions and precision of many poses, beside the same by NumPy's linear algebra."""

from __future__ import annotations

from collections.abc import Iterator

import msgspec
import numpy as np
from machines import same_for_all

from benchmarks.samples import DESIGN, around_home
from benchmarks.table import Row, seconds, times
from benchmarks.timing import best_of
from explorer import (
    Actuators,
    Payload,
    Pose,
    Struts,
    Tolerances,
    actuator_forces,
    deflection,
    inverse,
    inverse_dynamics,
    jacobian,
    joint_accelerations,
    joint_rates,
    largest_force,
    strut_bending,
)
from explorer.legs.moves import StraightMoves
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import GUIDE_ROWS, STRUT_ROWS
from explorer.mechanism.machine import STANDARD_GRAVITY
from explorer.motion.inverse_jacobian import twists_of_actuators
from explorer.motion.masses import DENSITY, bar_masses, moving_bodies
from explorer.numerics.arrays import FloatArray, triple
from explorer.numerics.compiled import warm
from explorer.paths.shortest_time import law_of_shortest_time
from explorer.statics.accuracy import (
    actuator_errors,
    error_by_source,
    largest_error,
    source_errors,
    worst_errors,
)
from explorer.statics.compliance import (
    compliance_of,
    compliance_shares,
    principal_compliances,
    stiffness_of,
)

FORCE_POSES, POSES, ROUNDS = 100_000, 10_000, 10
SHORT = {"FORCE_POSES": 500, "POSES": 100, "ROUNDS": 1}
TENTH = (0.1, 0.1, 0.1)
MACHINE = msgspec.structs.replace(
    DESIGN,
    actuators=Actuators(
        error_mm=(0.1, 0.2, 0.1, 0.2, 0.1, 0.1),
        stiffness_n_mm=(500.0, 600.0, 500.0, 600.0, 500.0, 400.0),
    ),
    struts=Struts(outer_mm=6.0, inner_mm=4.0),
    tolerances=Tolerances(TENTH, TENTH, TENTH, (0.1, 0.1), b1=TENTH, b2=TENTH, b3=TENTH, b4=TENTH),
)
LOAD = (3.0, -2.0, 4.0, 5.0, -6.0, 2.0)
HALVES = (slice(0, 3), slice(3, 6))


def run() -> Iterator[Row]:
    """Yield the rows."""
    warm()
    yield from _forces()
    yield from _motion()
    yield from _precision()


def _forces() -> Iterator[Row]:
    positions, rotations, _ = around_home(FORCE_POSES)
    loads = np.random.default_rng(1).normal(size=(FORCE_POSES, 6))
    most = np.full(6, 100.0)
    ours = best_of(ROUNDS, lambda: actuator_forces(DESIGN, positions, rotations, loads))

    def solve() -> object:
        transposed = np.swapaxes(jacobian(DESIGN, positions, rotations), -1, -2)
        return np.linalg.solve(transposed, -loads[..., None])

    theirs = best_of(3, solve)
    yield Row(
        f"forces of the six actuators in {FORCE_POSES:,} poses, one core",
        seconds(ours),
        "60 ms",
        f"numpy.linalg.solve: {seconds(theirs)}; {times(theirs / ours)}",
    )
    bending = best_of(ROUNDS, lambda: strut_bending(DESIGN, positions, rotations, loads))
    yield Row(f"bending of both struts in {FORCE_POSES:,} poses", seconds(bending))
    force = best_of(ROUNDS, lambda: largest_force(DESIGN, positions, rotations, most))
    yield Row(f"largest force in every direction in {FORCE_POSES:,} poses", seconds(force))
    one = positions[0], rotations[0], loads[0]
    alone = best_of(100, lambda: actuator_forces(DESIGN, *one))
    yield Row("forces of the six actuators in one pose", seconds(alone))


def _motion() -> Iterator[Row]:
    positions, rotations, _ = around_home(FORCE_POSES)
    rng = np.random.default_rng(2)
    twists, accelerations = rng.normal(size=(2, FORCE_POSES, 6))
    motions = positions, rotations, twists, accelerations
    carrying = msgspec.structs.replace(DESIGN, payload=Payload(2.0, (0.5, 0.0, 1.0)))
    ours = best_of(ROUNDS, lambda: inverse_dynamics(carrying, *motions))
    centre, metres = np.array(carrying.payload.centre), 1e-3 * carrying.unit_mm
    gravity = np.array([0.0, 0.0, -STANDARD_GRAVITY]) / metres

    def plain() -> object:
        arms, turning = rotations @ centre, twists[:, 3:]
        fall = gravity - accelerations[:, :3] - np.cross(accelerations[:, 3:], arms)
        force = (
            metres * carrying.payload.mass_kg * (fall - np.cross(turning, np.cross(turning, arms)))
        )
        load = np.concatenate([force, np.cross(arms, force)], axis=1)
        transposed = np.swapaxes(jacobian(carrying, positions, rotations), -1, -2)
        return np.linalg.solve(transposed, -load[..., None])

    theirs = best_of(3, plain)
    yield Row(
        f"inverse dynamics with legs in {FORCE_POSES:,} motions, one core",
        seconds(ours),
        "150 ms",
        f"NumPy, the payload alone: {seconds(theirs)}; {times(theirs / ours)}",
    )
    rates = best_of(3, lambda: joint_rates(DESIGN, *motions[:3]))
    yield Row(f"rates of the joints in {FORCE_POSES:,} motions", seconds(rates))
    changes = best_of(3, lambda: joint_accelerations(DESIGN, *motions))
    yield Row(f"accelerations of the joints in {FORCE_POSES:,} motions", seconds(changes))
    home = carrying.home_pose
    way = home, Pose(triple(np.array(home.position) + (2.0, -1.0, 1.0)), home.quaternion)
    force, speed, acceleration = map(same_for_all, (100.0, 300.0, 5000.0))
    limits = Actuators(force, speed_mm_s=speed, acceleration_mm_s2=acceleration)
    timed = msgspec.structs.replace(carrying, actuators=limits)
    bodies = moving_bodies(timed, bar_masses(timed, DENSITY))
    shortest = best_of(3, lambda: law_of_shortest_time(timed, StraightMoves.along(way), bodies))
    yield Row("shortest time of a move", seconds(shortest), "0.2 s")


def _precision() -> Iterator[Row]:
    positions, rotations, _ = around_home(POSES)
    errors, (stiffness, bending) = actuator_errors(MACHINE), stiffness_of(MACHINE)

    def all_of_it() -> object:
        poses = Configuration(MACHINE, positions, rotations)
        soft = compliance_of(poses, stiffness, bending)
        return (
            error_by_source(poses),
            worst_errors(poses, errors),
            _ellipsoids(twists_of_actuators(poses)[:, :3] * errors),
            principal_compliances(soft),
            deflection(soft, LOAD),
            compliance_shares(poses, LOAD, stiffness, bending),
        )

    def plain() -> object:
        twists = np.linalg.inv(jacobian(MACHINE, positions, rotations))
        lengths = inverse(MACHINE, positions, rotations)[:, STRUT_ROWS]
        soft = np.tile(1.0 / stiffness, (POSES, 1))
        soft[:, GUIDE_ROWS] += lengths**3 / (3.0 * bending)
        compliance = (twists * soft[:, None]) @ np.swapaxes(twists, -1, -2)
        return (
            [np.linalg.norm((twists * errors)[:, half], axis=(1, 2)) for half in HALVES],
            [np.linalg.eigh(compliance[:, half, half]) for half in HALVES],
            compliance @ LOAD,
        )

    ours, theirs = best_of(ROUNDS, all_of_it), best_of(3, plain)
    yield Row(
        "worst and RMS errors, by actuator and dimension, their ellipsoid, compliance, principal "
        f"directions, deflection and shares in {POSES:,} poses, one core",
        seconds(ours),
        "60 ms",
        f"NumPy, RMS errors and compliance alone: {seconds(theirs)}; {times(theirs / ours)}",
    )

    def of_one() -> object:
        pose = Configuration(MACHINE, positions[0], rotations[0])
        return error_by_source(pose), worst_errors(pose, errors), compliance_of(pose, stiffness)

    alone = best_of(100, of_one)
    yield Row("errors and compliance of one pose", seconds(alone))
    sources = error_by_source(Configuration(MACHINE, positions, rotations))
    bounds = source_errors(MACHINE)
    worst = best_of(3, lambda: largest_error(sources, bounds))
    yield Row(f"the exact largest errors by all 29 sources in {POSES:,} poses", seconds(worst))


def _ellipsoids(moved: FloatArray) -> object:
    """Return the squared semi-axes and the axes of errors, given those of each actuator."""
    return np.linalg.eigh(moved @ np.swapaxes(moved, -1, -2))
