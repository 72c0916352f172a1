"""Drives: energy, bounds, scaling by time, a motion in closed form, and limits of paths."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from machines import six
from numpy.testing import assert_allclose
from refusals import refusal

from explorer import (
    PRESETS,
    Actuators,
    Design,
    NoAnswerError,
    Payload,
    Pose,
    inverse_dynamics,
    joint_rates,
)
from explorer.legs.moves import StraightMoves
from explorer.mechanism.machine import STANDARD_GRAVITY
from explorer.mechanism.pose import Triple
from explorer.motion.chains import BODIES, Chains
from explorer.motion.masses import DENSITY, bar_masses, moving_bodies, with_payload
from explorer.motion.weights import MovingBodies
from explorer.numerics.arrays import triple
from explorer.paths.crossings import path_margins
from explorer.paths.drives import PathDrives, TimedPath, check_limits, drives_along
from explorer.paths.time_law import TimeLaw, law_at_speed

EMPTY = PRESETS["paper-optimal"]
OPTIMAL = msgspec.structs.replace(EMPTY, payload=Payload(2.0, (1, 0, 1)))
HOME = OPTIMAL.home_pose
X, Y, Z = HOME.position
WAY = 3.0
ALONG_GUIDE = [HOME, Pose((X + WAY, Y, Z), HOME.quaternion)]
TOOL = (0.5, 1.0, -2.0)


def random_path(seed: int) -> list[Pose]:
    rng = np.random.default_rng(seed)
    turns = np.array([-73.1, 0.0, 0.0]) + rng.uniform(-15.0, 15.0, (2, 3))
    places = np.array(HOME.position) + rng.uniform(-2.0, 2.0, (2, 3))
    pairs = zip(places, turns, strict=True)
    return [HOME, *(Pose.of_yaw_pitch_roll(triple(p), triple(t)) for p, t in pairs)]


def bodies_of(design: Design) -> MovingBodies:
    return moving_bodies(design, bar_masses(design, DENSITY))


def drives_of(design: Design, law: TimeLaw) -> PathDrives:
    return PathDrives.along(design, law, bodies_of(design))


def law_of_duration(path: list[Pose], duration: float, tool: Triple | None = None) -> TimeLaw:
    moves = StraightMoves.along(path, tool)
    return law_at_speed(OPTIMAL, moves, acceleration=1.0).lasting(duration)


def potential_energy(design: Design, pose: Pose) -> float:
    """Return the potential energy of all bodies in a pose, in joules."""
    places = Chains.of(design).places_at(pose.position, pose.rotation)
    energy = 0.0
    for name, mass in with_payload(design, bar_masses(design, DENSITY)).items():
        body = BODIES.index(name)
        centre = 1e-3 * design.unit_mm * places.origin[body] + places.rotation[body] @ mass.centre
        energy -= mass.mass * STANDARD_GRAVITY * float(centre @ np.array(design.gravity))
    return energy


@pytest.mark.parametrize("seed", range(4))
def test_work_of_the_actuators_from_rest_to_rest_is_the_change_of_potential_energy(
    seed: int,
) -> None:
    path = random_path(seed)
    before, after = (potential_energy(OPTIMAL, pose) for pose in (path[0], path[-1]))
    for law in (
        law_of_duration(path, 0.4, TOOL),
        law_at_speed(OPTIMAL, StraightMoves.along(path, TOOL), 20.0, 200.0),
    ):
        found = drives_of(OPTIMAL, law)
        work = float(found.mean(found.power).sum()) * found.law.duration
        size = found.law.duration * float(found.summary.mean_power.sum())
        assert work == pytest.approx(after - before, abs=1e-4 * size)


@pytest.mark.parametrize("seed", range(3))
def test_peaks_bound_means_and_the_least_motor_bounds_all_actuators(seed: int) -> None:
    path = random_path(seed)
    found = drives_of(OPTIMAL, law_of_duration(path, 0.3))
    assert found.law.duration == pytest.approx(0.3)
    speed, force, steady, power, mean = found.summary
    assert (steady <= force).all()
    assert (mean <= power).all()
    assert (power <= 1e-3 * force * speed).all()
    for name, largest in found.least_motor.items():
        assert largest == getattr(found.summary, name).max()


def test_slower_law_has_slower_speeds_and_in_the_end_the_forces_at_rest() -> None:
    path = random_path(1)
    law = law_of_duration(path, 0.3)
    found, slower = (drives_of(OPTIMAL, each) for each in (law, law.lasting(0.9)))
    assert_allclose(slower.speed, found.speed / 3.0, rtol=1e-6, atol=1e-9)
    assert_allclose(slower.acceleration, found.acceleration / 9.0, rtol=1e-6, atol=1e-6)
    still = drives_of(OPTIMAL, law.lasting(3e4))
    # What a motion adds to the forces at rest falls with the square of the time.
    added, less = found.force - still.force, slower.force - still.force
    assert_allclose(less, added / 9.0, atol=1e-6 * np.abs(added).max())


def test_pauses_hold_the_forces_at_rest_and_count_in_the_means() -> None:
    path, duration, pause = random_path(1), 0.5, 0.2
    pauses = (0.0, pause, *[0.0] * (len(path) - 2))
    found = drives_along(OPTIMAL, TimedPath(path, duration, pauses=pauses))
    moving = drives_of(OPTIMAL, law_of_duration(path, duration - pause))
    assert found.law.duration == pytest.approx(duration, rel=1e-12)
    assert_allclose(found.summary.peak_force, moving.summary.peak_force, rtol=1e-9)
    at_rest = drives_of(OPTIMAL, law_of_duration(path, 3e4))
    resting = found.force[np.repeat(found.law.pause > 0.0, 3)]
    still = at_rest.at(
        at_rest.law.time[np.flatnonzero(np.diff(at_rest.law.intervals.number))[:1] + 1]
    )
    assert_allclose(resting, np.repeat(still.force, 3, axis=0), rtol=1e-5)
    squares = (duration - pause) * moving.summary.rms_force**2 + pause * resting[0] ** 2
    assert_allclose(found.summary.rms_force, np.sqrt(squares / duration), rtol=1e-9)


def test_motion_along_the_guide_has_the_numbers_of_its_closed_form() -> None:
    duration, mass = 0.5, 2.0
    bodies = MovingBodies().with_mass(mass, (0.0, 0.0, 0.0))
    law = law_of_duration(ALONG_GUIDE, duration)
    found = PathDrives.along(OPTIMAL, law, bodies)
    way = OPTIMAL.unit_mm * WAY
    assert_allclose(found.summary.peak_speed[[1, 3]], 2.0 * way / duration, rtol=1e-9)
    assert_allclose(np.abs(found.acceleration[:, [1, 3]]), 4.0 * way / duration**2, rtol=1e-9)
    # The weight of the point does no work, so that all power is that of its inertia.
    power = 1e-6 * mass * found.acceleration[:, 1] * found.speed[:, 1]
    assert_allclose(found.power.sum(axis=1), power, atol=1e-9 * np.abs(power).max())


def test_drives_at_any_time_are_the_inverse_dynamics_of_a_trapezoid() -> None:
    # The carriages are the fastest all along, so that x over time is the trapezoid.
    start, step, speed, acceleration = np.array([10.0, 5.0, 11.0]), (4.0, -2.0, 0.0), 20.0, 400.0
    goal = Pose(triple(start + step), HOME.quaternion)
    moves = StraightMoves.along([Pose(triple(start), HOME.quaternion), goal])
    found = drives_of(OPTIMAL, law_at_speed(OPTIMAL, moves, speed, acceleration))
    ramp, duration = speed / acceleration, step[0] / speed + speed / acceleration
    assert found.law.duration == pytest.approx(duration, rel=1e-12)
    time = np.linspace(0.0, duration, 20_002, dtype=np.float64)[1:-1]
    before_end = duration - time
    rate = np.minimum(speed, acceleration * np.minimum(time, before_end))
    change = acceleration * ((time < ramp) * 1.0 - (before_end < ramp) * 1.0)
    rising, falling = (0.5 * acceleration * np.minimum(t, ramp) ** 2 for t in (time, before_end))
    even = speed * (np.clip(time, ramp, duration - ramp) - ramp)
    way = rising + even + 0.5 * speed * ramp - falling
    along_x = np.array([*step, 0.0, 0.0, 0.0]) / step[0]
    places = start + way[:, None] * along_x[:3]
    forces = inverse_dynamics(
        OPTIMAL, places, HOME.rotation, rate[:, None] * along_x, change[:, None] * along_x
    )
    rates = joint_rates(OPTIMAL, places, HOME.rotation, rate[:, None] * along_x)
    at = found.at(time)
    assert_allclose(at.speed, OPTIMAL.unit_mm * rates, atol=1e-7)
    assert_allclose(at.force, forces, atol=1e-6)
    power = 1e-3 * np.abs(OPTIMAL.unit_mm * rates * forces)
    assert_allclose(at.power, 1e-3 * OPTIMAL.unit_mm * rates * forces, atol=1e-6)
    summary = found.summary
    assert_allclose(summary.peak_force, np.abs(forces).max(axis=0), rtol=1e-3)
    assert_allclose(summary.peak_power, power.max(axis=0), rtol=1e-3)
    assert_allclose(summary.mean_power, power.mean(axis=0), rtol=1e-3)
    assert_allclose(summary.rms_force**2, (forces**2).mean(axis=0), rtol=1e-3)


def test_binding_limits_are_those_used_up_or_else_the_one_used_the_most() -> None:
    path = random_path(2)
    law = law_of_duration(path, 0.3)
    found = drives_of(OPTIMAL, law)
    assert found.binding == ((),) * 6
    summary = found.summary
    shares = [1.5, 1.0, 1.0, 1.0, 1.25, 0.6]
    limits = Actuators(
        speed_mm_s=six(summary.peak_speed * [0.8, 0.8, 0.8, 0.8, 0.8, 2.0]),
        push_n=six(2.0 * summary.peak_force),
        continuous_n=six(summary.rms_force / shares),
    )
    limited = drives_of(msgspec.structs.replace(OPTIMAL, actuators=limits), law)
    for joint, (*others, last) in enumerate(limited.binding):
        assert last == ("continuous force", pytest.approx(shares[joint]), None)
        assert len(others) == (1 if joint < 5 else 0)
        for limit, share, time in others:
            assert (limit, share) == ("speed", pytest.approx(1.25))
            speed = np.interp(time or 0.0, found.time, np.abs(found.speed[:, joint]))
            assert speed == pytest.approx(summary.peak_speed[joint])


def test_path_through_a_singular_pose_between_its_samples_is_refused() -> None:
    free = OPTIMAL.with_limits(margin=None, box=None)
    through = [HOME, Pose((X + 0.3, Y + 0.2, -0.77 * Z), HOME.quaternion)]
    assert path_margins(through).crossings
    for duration in (1.0, None):
        with pytest.raises(NoAnswerError, match="singular"):
            drives_along(free, TimedPath(through, duration))


def test_path_by_half_a_turn_is_refused_for_what_it_is() -> None:
    free = OPTIMAL.with_limits(margin=None)
    half = Pose.of_yaw_pitch_roll(HOME.position, (180.0 - 73.09, 0.0, 0.0))
    start = Pose.of_yaw_pitch_roll(HOME.position, (-73.09, 0.0, 0.0))
    assert "half a turn" in refusal(check_limits, free, StraightMoves.along([start, half]))


def test_path_without_length_or_through_a_singular_pose_is_refused() -> None:
    for rounding in (0.0, 1e-14, 1e-7):
        nearby = Pose((X + rounding, Y, Z), HOME.quaternion)
        assert "no length" in refusal(law_of_duration, [HOME, nearby], 1.0)
    assert "10000 moves" in refusal(law_of_duration, [*ALONG_GUIDE] * 5001, 1.0)
    assert "above zero" in refusal(law_of_duration, ALONG_GUIDE, math.nan)
    through = [HOME, Pose((X, Y, 0.0), HOME.quaternion)]
    with pytest.raises(NoAnswerError, match="singular"):
        drives_of(OPTIMAL, law_of_duration(through, 1.0))


def test_path_beyond_the_limits_is_refused_with_the_place_and_the_limit() -> None:
    check_limits(OPTIMAL, StraightMoves.along(ALONG_GUIDE))
    far = Pose((X, 40.0, Z), HOME.quaternion)
    words = refusal(lambda: check_limits(OPTIMAL, StraightMoves.along([*ALONG_GUIDE, far])))
    assert words.startswith("move 2 of the path leaves the limits at ")
    assert "above its maximum" in words
