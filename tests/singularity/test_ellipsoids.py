"""Velocity and force ellipsoids, and singularity-free balls."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, strategies as st
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation
from strategies import Case, ordinary_cases, singular_cases

from explorer import PRESETS, Pose, inverse, jacobian, margins
from explorer.mechanism.margins import planes_of_singularity
from explorer.numerics.arrays import FloatArray
from explorer.singularity.ellipsoids import performance, singularity_free_ball
from explorer.singularity.nearest import displacement, nearest_singularities

OPTIMAL = PRESETS["paper-optimal"]


def rates_of(case: Case) -> FloatArray:
    """Return the Jacobian of a well-conditioned case."""
    at = case.at
    assume(at.inverse_condition > 1e-6)
    return at.jacobian


@given(ordinary_cases(), st.tuples(*[st.floats(-1.0, 1.0)] * 3), st.integers(0, 2**32))
def test_ellipsoids_at_the_tool_hold_its_speeds_and_the_gains_of_unit_loads(
    case: Case, direction: tuple[float, float, float], seed: int
) -> None:
    tool, inverse_rates = case.size * np.array(direction), np.linalg.inv(rates_of(case))
    reach, found = case.design.reach, performance(case.design, case.pose, tool)
    arm = case.rotation @ tool
    # Speeds at unit actuator speed lie in the ellipsoids.
    drive = np.random.default_rng(seed).normal(size=(100, 6))
    twists = drive / np.linalg.norm(drive, axis=-1, keepdims=True) @ inverse_rates.T
    speeds = twists[:, :3] + np.cross(twists[:, 3:], arm), reach * twists[:, 3:]
    for ellipsoid, way in zip((found.translation, found.rotation), speeds, strict=True):
        shares = np.linalg.norm(way @ ellipsoid.axes / ellipsoid.gain, axis=-1)
        assert shares.max() <= 1.0 + 1e-6
        assert_allclose(ellipsoid.axes.T @ ellipsoid.axes, np.eye(3), atol=1e-12)
        assert np.linalg.det(ellipsoid.axes) > 0.0
        assert (np.diff(ellipsoid.gain) <= 0.0).all()
        for axis, gain, force in zip(
            ellipsoid.axes.T, ellipsoid.gain, ellipsoid.force, strict=True
        ):
            # A unit force at the tool is that force at b4 and its moment; moments are over reach.
            push = [axis, np.cross(arm, axis)], [np.zeros(3), reach * axis]
            wrench = np.concatenate(push[ellipsoid is found.rotation])
            assert np.linalg.norm(inverse_rates.T @ wrench) == pytest.approx(gain, rel=1e-6)
            assert force == pytest.approx(1.0 / gain)
    at_b4 = performance(case.design, case.pose)
    assert_allclose(found.rotation.gain, at_b4.rotation.gain, rtol=1e-6)


@given(singular_cases(), st.tuples(*[st.floats(-1.0, 1.0)] * 3))
def test_singular_poses_stay_singular_at_every_tool_and_have_finite_axes(
    case: Case, direction: tuple[float, float, float]
) -> None:
    scale = np.array([1.0] * 3 + [case.size] * 3)
    rates = jacobian(case.design, case.position, case.rotation, case.size * np.array(direction))
    values = np.linalg.svd(rates / scale, compute_uv=False)
    at_b4 = jacobian(case.design, case.position, case.rotation)
    here = np.linalg.svd(at_b4 / scale, compute_uv=False)
    # A change of the point multiplies the values by 3 at the most.
    assert values[-1] <= 3.0 * here[-1] + 1e-13 * values[0]
    assert here[-1] <= 3.0 * values[-1] + 1e-13 * here[0]
    found = performance(case.design, case.pose)
    for ellipsoid in (found.translation, found.rotation):
        assert np.isfinite(ellipsoid.axes).all()
        assert (ellipsoid.gain >= 0.0).all()
        assert np.isfinite(ellipsoid.force).all()
    ball = singularity_free_ball(case.pose)
    assert np.isfinite(ball.touches).all()
    assert ball.radius >= 0.0
    if np.hypot(case.rotation[1, 0], case.rotation[2, 0]) == 0.0:
        assert ball.radius == 0.0


def test_infinite_axis_is_a_motion_at_zero_actuator_speed() -> None:
    # b4 on the base plane: it can leave that plane with all six lengths held to first order.
    pose = Pose((10.0, 5.0, 0.0), Pose.of_yaw_pitch_roll((0, 0, 0), (-70.0, 20.0, 30.0)).quaternion)
    found = performance(OPTIMAL, pose)
    assert np.isinf(found.translation.gain).tolist() == [True, False, False]
    assert found.translation.force[0] == 0.0
    rates = jacobian(OPTIMAL, pose.position, pose.rotation)
    motion = np.linalg.svd(rates)[2][-1]
    step = 1e-6 * motion
    turn = Rotation.from_rotvec(step[3:]).as_matrix()
    moved = inverse(OPTIMAL, np.array(pose.position) + step[:3], turn @ pose.rotation)
    assert_allclose(moved, inverse(OPTIMAL, pose.position, pose.rotation), atol=1e-11)
    along = motion[:3] / np.linalg.norm(motion[:3])
    assert abs(float(along @ found.translation.axes[:, 0])) == pytest.approx(1.0, abs=1e-9)


@given(ordinary_cases(), st.integers(0, 2**32))
def test_singularity_free_ball_touches_a_plane_and_contains_no_singular_position(
    case: Case, seed: int
) -> None:
    gradients = planes_of_singularity(case.rotation)
    assert_allclose(gradients @ case.position, case.margins, atol=1e-13 * case.size)
    ball = singularity_free_ball(case.pose)
    assume(ball.radius > 1e-6 * case.size)
    assert np.linalg.norm(ball.touches - case.position) == pytest.approx(ball.radius)
    touching = margins(ball.touches, case.rotation)
    assert abs(touching[ball.incidence - 1]) <= 1e-13 * case.size
    off = np.random.default_rng(seed).normal(size=(200, 3))
    off *= 0.999 * ball.radius / np.linalg.norm(off, axis=-1, keepdims=True)
    signs = np.sign(margins(case.position + off, case.rotation))
    assert (signs == np.sign(case.margins)).all()


@given(ordinary_cases(), st.integers(0, 2**32))
def test_poses_within_the_certified_radius_are_regular(case: Case, seed: int) -> None:
    radius = min(each.bound for each in nearest_singularities(case.design, case.pose))
    # The ball has only some of the motions, so it is no smaller.
    assert radius <= singularity_free_ball(case.pose).radius + 1e-12
    rng = np.random.default_rng(seed)
    turns = Rotation.from_rotvec(rng.normal(size=(100, 3)) * rng.uniform(0, 0.5, (100, 1)))
    rotations = turns.as_matrix() @ case.rotation
    positions = case.position + rng.normal(size=(100, 3)) * radius
    ways = displacement(case.design, case.position, case.rotation, positions, rotations)
    near = ways < radius * (1.0 - 1e-9)
    signs = np.sign(margins(positions[near], rotations[near]))
    assert (signs == np.sign(case.margins)).all()
