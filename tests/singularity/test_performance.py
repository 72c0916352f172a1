"""Velocity and force ellipsoids, singularity-free balls, and maps over a slice."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, strategies as st
from limited_designs import ordinary_case
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation
from strategies import Case, all_cases, ordinary_cases, singular_cases

from explorer import (
    PRESETS,
    InputError,
    Pose,
    evaluate,
    home_pose,
    inverse,
    jacobian,
    margins,
    nearest_singularities,
)
from explorer.mechanism.displacement import displacement
from explorer.singularity.ellipsoids import (
    certified_radius,
    performance,
    planes_of_singularity,
    singular_plane_distances,
    singularity_free_ball,
)
from explorer.singularity.jacobian import inverse_condition
from explorer.workspace.slices.fields import FIELDS, field_at, slice_field

OPTIMAL = PRESETS["paper-optimal"]
HOME = home_pose(OPTIMAL)


def pose_of(case: Case) -> Pose:
    return Pose.of(case.position, case.rotation)


def is_well_conditioned(case: Case) -> bool:
    rates = jacobian(case.design, case.position, case.rotation)
    return float(inverse_condition(rates, case.design.reach)) > 1e-6


@given(ordinary_cases(), st.integers(0, 2**32))
def test_velocities_at_unit_actuator_speed_lie_in_the_ellipsoids(case: Case, seed: int) -> None:
    assume(is_well_conditioned(case))
    found = performance(case.design, pose_of(case))
    drive = np.random.default_rng(seed).normal(size=(100, 6))
    drive /= np.linalg.norm(drive, axis=-1, keepdims=True)
    rates = jacobian(case.design, case.position, case.rotation)
    twists = drive @ np.linalg.inv(rates).T
    for ellipsoid, way in (
        (found.translation, twists[:, :3]),
        (found.rotation, case.design.reach * twists[:, 3:]),
    ):
        shares = way @ ellipsoid.axes / ellipsoid.velocity
        assert np.linalg.norm(shares, axis=-1).max() <= 1.0 + 1e-9


@given(ordinary_cases())
def test_a_unit_force_on_an_axis_takes_the_gain_of_actuator_force(case: Case) -> None:
    assume(is_well_conditioned(case))
    found = performance(case.design, pose_of(case))
    rates = jacobian(case.design, case.position, case.rotation)
    for ellipsoid, start, unit in (
        (found.translation, 0, 1.0),
        (found.rotation, 3, case.design.reach),
    ):
        assert_allclose(ellipsoid.axes.T @ ellipsoid.axes, np.eye(3), atol=1e-12)
        assert np.linalg.det(ellipsoid.axes) > 0.0
        assert (np.diff(ellipsoid.gain) <= 0.0).all()
        for index in range(3):
            wrench = np.zeros(6)
            # A moment over the reach.
            wrench[start : start + 3] = unit * ellipsoid.axes[:, index]
            force = np.linalg.solve(rates.T, wrench)
            assert np.linalg.norm(force) == pytest.approx(ellipsoid.gain[index], rel=1e-6)
            assert ellipsoid.force[index] == pytest.approx(1.0 / ellipsoid.gain[index])


@given(singular_cases())
def test_ellipsoids_of_singular_poses_have_finite_axes(case: Case) -> None:
    found = performance(case.design, pose_of(case))
    for ellipsoid in (found.translation, found.rotation):
        assert np.isfinite(ellipsoid.axes).all()
        assert (ellipsoid.gain >= 0.0).all()
        assert np.isfinite(ellipsoid.force).all()


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


@given(ordinary_cases())
def test_margins_are_the_position_along_the_normals_of_their_planes(case: Case) -> None:
    gradients = planes_of_singularity(case.rotation)
    assert_allclose(
        gradients @ case.position, margins(case.position, case.rotation), atol=1e-13 * case.size
    )


@given(ordinary_cases(), st.integers(0, 2**32))
def test_the_largest_ball_touches_a_plane_and_holds_no_singular_position(
    case: Case, seed: int
) -> None:
    ball = singularity_free_ball(pose_of(case))
    assume(ball.radius > 1e-6 * case.size)
    assert np.linalg.norm(ball.touches - case.position) == pytest.approx(ball.radius)
    touching = margins(ball.touches, case.rotation)
    assert abs(touching[ball.incidence - 1]) <= 1e-13 * case.size
    off = np.random.default_rng(seed).normal(size=(200, 3))
    off *= 0.999 * ball.radius / np.linalg.norm(off, axis=-1, keepdims=True)
    signs = np.sign(margins(case.position + off, case.rotation))
    assert (signs == np.sign(margins(case.position, case.rotation))).all()


@given(all_cases())
def test_singularity_free_ball_of_any_pose_is_finite(case: Case) -> None:
    ball = singularity_free_ball(pose_of(case))
    assert np.isfinite(ball.touches).all()
    assert ball.radius == ball.distances.min() >= 0.0
    if np.hypot(case.rotation[1, 0], case.rotation[2, 0]) == 0.0:
        assert ball.radius == 0.0


@given(ordinary_cases(), st.integers(0, 2**32))
def test_no_pose_within_the_certified_radius_is_singular(case: Case, seed: int) -> None:
    radius = certified_radius(case.design, pose_of(case))
    # The ball has only some of the motions, so it is no smaller.
    assert radius <= singularity_free_ball(pose_of(case)).radius + 1e-12
    rng = np.random.default_rng(seed)
    turns = Rotation.from_rotvec(rng.normal(size=(100, 3)) * rng.uniform(0, 0.5, (100, 1)))
    rotations = turns.as_matrix() @ case.rotation
    positions = case.position + rng.normal(size=(100, 3)) * radius
    ways = displacement(case.design, case.position, case.rotation, positions, rotations)
    near = ways < radius * (1.0 - 1e-9)
    signs = np.sign(margins(positions[near], rotations[near]))
    assert (signs == np.sign(margins(case.position, case.rotation))).all()


@pytest.mark.parametrize("field", FIELDS)
@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_a_map_holds_the_field_of_each_position(field: str, axis: str) -> None:
    assert field in FIELDS
    found = slice_field(OPTIMAL, HOME.rotation, field, axis=axis, level=4.0, steps=9)
    assert found.values.shape == found.inside.shape == (len(found.rows), len(found.columns))
    assert max(found.values.shape) == 9
    for i, j in ((0, 0), (len(found.rows) // 2, len(found.columns) // 2), (-1, -1)):
        others = iter((found.columns[j], found.rows[i]))
        x, y, z = (4.0 if each == axis else float(next(others)) for each in "xyz")
        snapshot = evaluate(OPTIMAL, Pose((x, y, z), HOME.quaternion))
        expected = {
            "margin": float(np.abs(snapshot.margins).min()),
            "condition": snapshot.inverse_condition,
            "ball": float(singular_plane_distances((x, y, z), HOME.rotation).min()),
            "distance": min(each.distance for each in snapshot.nearest),
        }[field]
        assert found.values[i, j] == pytest.approx(expected, abs=1e-9)
        if not any(str(each).startswith("margin") for each in snapshot.violations):
            assert found.inside[i, j] == (not snapshot.violations)


def test_a_map_can_be_of_any_box_and_orientation() -> None:
    design, rotation = ordinary_case(3)
    found = slice_field(
        design, rotation, "margin", level=2.0, steps=20, extent=([-1, -2, 0], [3, 6, 9])
    )
    assert found.columns[[0, -1]].tolist() == [-1.0, 3.0]
    assert found.rows[[0, -1]].tolist() == [-2.0, 6.0]
    assert found.values.shape == (20, 10)


def test_fields_take_batches_of_poses() -> None:
    positions = np.random.default_rng(0).uniform(-5.0, 5.0, (3, 4, 3))
    rotations = Rotation.random(12, random_state=1).as_matrix().reshape(3, 4, 3, 3)
    for field in FIELDS:
        assert field_at(OPTIMAL, positions, rotations, field).shape == (3, 4)
    distances = field_at(OPTIMAL, positions, rotations, "distance")
    alone = nearest_singularities(OPTIMAL, Pose.of(positions[1, 2], rotations[1, 2]))
    assert distances[1, 2] == pytest.approx(min(each.distance for each in alone))


def test_map_with_unusable_arguments_is_refused() -> None:
    r = HOME.rotation
    with pytest.raises(InputError, match="no field"):
        slice_field(OPTIMAL, r, "colour", level=1.0)  # pyright: ignore[reportArgumentType]
    with pytest.raises(InputError, match="x, y or z"):
        slice_field(OPTIMAL, r, "margin", axis="w", level=1.0)
    with pytest.raises(InputError, match="steps"):
        slice_field(OPTIMAL, r, "margin", level=1.0, steps=1)
    with pytest.raises(InputError, match="extent"):
        slice_field(OPTIMAL, r, "margin", level=1.0, extent=([0, 0, 0], [1, 0, 1]))
    with pytest.raises(InputError, match="position"):
        field_at(OPTIMAL, [math.nan, 0, 0], r, "margin")
