"""Poses: every parameterisation of a rotation comes back as the same rotation."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from strategies import QUARTER_TURNS, rotations, small_rotations

from explorer import (
    ExplorerError,
    InputError,
    Pose,
    quaternion_from_rotation,
    rotation_from_quaternion,
    rotation_from_yaw_pitch_roll,
    yaw_pitch_roll_from_rotation,
)
from explorer.mechanism.pose import ORTHONORMAL_TOLERANCE, checked_rotation
from explorer.numerics.arrays import FloatArray

ROUNDING = 4e-15
angles = st.floats(-180.0, 180.0)
components = st.floats(-1.0, 1.0)
quaternions = st.tuples(components, components, components, components).filter(
    lambda q: max(map(abs, q)) > 1e-3
)


def elementary(axis: int, degrees: float) -> FloatArray:
    """Return the rotation about a coordinate axis, written out."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.eye(3)
    matrix[i, i] = matrix[j, j] = c
    matrix[i, j], matrix[j, i] = -s, s
    return matrix


@given(rotations())
def test_quaternions_come_back_as_the_rotation(rotation: FloatArray) -> None:
    quaternion = quaternion_from_rotation(rotation)
    assert abs(float(np.linalg.norm(quaternion)) - 1.0) <= ROUNDING
    assert quaternion[0] >= 0.0
    assert_allclose(rotation_from_quaternion(quaternion), rotation, rtol=0, atol=ROUNDING)


@given(quaternions)
def test_rotations_come_back_as_the_quaternion_up_to_length_and_sign(
    quaternion: tuple[float, ...],
) -> None:
    unit = np.array(quaternion) / np.linalg.norm(quaternion)
    found = quaternion_from_rotation(rotation_from_quaternion(quaternion))
    assert abs(abs(float(found @ unit)) - 1.0) <= ROUNDING


@given(quaternions, st.sampled_from([-1.0, 1e-150, 1e-9, 2.0, 1e9, 1e150]))
def test_the_length_and_sign_of_a_quaternion_do_not_matter(
    quaternion: tuple[float, ...], factor: float
) -> None:
    one = rotation_from_quaternion(quaternion)
    other = rotation_from_quaternion(np.array(quaternion) * factor)
    assert_allclose(other, one, rtol=0, atol=ROUNDING)


@given(rotations())
def test_yaw_pitch_roll_come_back_as_the_rotation(rotation: FloatArray) -> None:
    found = yaw_pitch_roll_from_rotation(rotation)
    assert abs(found[1]) <= 90.0 + 1e-9
    # Near a pitch of 90° its sine is flat, so half the digits of the angle are lost.
    assert_allclose(rotation_from_yaw_pitch_roll(found), rotation, rtol=0, atol=3e-7)


@given(angles, st.floats(-89.0, 89.0), angles)
def test_angles_away_from_gimbal_lock_come_back_as_the_angles(
    yaw: float, pitch: float, roll: float
) -> None:
    found = yaw_pitch_roll_from_rotation(rotation_from_yaw_pitch_roll([yaw, pitch, roll]))
    difference = (found - [yaw, pitch, roll] + 180.0) % 360.0 - 180.0
    assert_allclose(difference, 0.0, atol=1e-10)


@given(angles, st.sampled_from([90.0, -90.0]), angles)
def test_gimbal_lock_keeps_the_rotation_and_gives_a_roll_of_zero(
    yaw: float, pitch: float, roll: float
) -> None:
    rotation = rotation_from_yaw_pitch_roll([yaw, pitch, roll])
    found = yaw_pitch_roll_from_rotation(rotation)
    assert found[2] == 0.0
    assert_allclose(found[1], pitch, atol=1e-5)
    assert_allclose(rotation_from_yaw_pitch_roll(found), rotation, rtol=0, atol=3e-7)


@given(small_rotations())
def test_small_rotations_keep_their_digits(rotation: FloatArray) -> None:
    off = rotation - np.eye(3)
    again = rotation_from_quaternion(quaternion_from_rotation(rotation)) - np.eye(3)
    assert_allclose(again, off, rtol=0, atol=ROUNDING)
    angles_found = yaw_pitch_roll_from_rotation(rotation)
    again = rotation_from_yaw_pitch_roll(angles_found) - np.eye(3)
    assert_allclose(again, off, rtol=0, atol=ROUNDING)


@given(angles, angles, angles)
def test_yaw_pitch_roll_turn_about_intrinsic_z_y_x(yaw: float, pitch: float, roll: float) -> None:
    expected = elementary(2, yaw) @ elementary(1, pitch) @ elementary(0, roll)
    assert_allclose(
        rotation_from_yaw_pitch_roll([yaw, pitch, roll]), expected, rtol=0, atol=ROUNDING
    )


def test_a_quaternion_is_scalar_first() -> None:
    half = math.sqrt(0.5)
    assert_allclose(rotation_from_quaternion([half, 0, 0, half]), elementary(2, 90.0), atol=1e-15)
    assert_array_equal(rotation_from_quaternion([1, 0, 0, 0]), np.eye(3))


@pytest.mark.parametrize("index", range(24))
def test_quarter_turns_come_back_from_quaternions_and_angles(index: int) -> None:
    rotation = QUARTER_TURNS[index]
    quaternion = quaternion_from_rotation(rotation)
    assert_allclose(rotation_from_quaternion(quaternion), rotation, rtol=0, atol=ROUNDING)
    found = yaw_pitch_roll_from_rotation(rotation)
    assert_allclose(rotation_from_yaw_pitch_roll(found), rotation, rtol=0, atol=ROUNDING)


def test_conversions_take_batches_over_leading_axes() -> None:
    rng = np.random.default_rng(0)
    several = rotation_from_quaternion(rng.normal(size=(2, 3, 4)))
    assert several.shape == (2, 3, 3, 3)
    quaternion = quaternion_from_rotation(several)
    found = yaw_pitch_roll_from_rotation(several)
    again = rotation_from_yaw_pitch_roll(found)
    for index in np.ndindex(2, 3):
        assert_allclose(quaternion[index], quaternion_from_rotation(several[index]), atol=ROUNDING)
        assert_allclose(found[index], yaw_pitch_roll_from_rotation(several[index]), atol=1e-12)
        assert_allclose(again[index], several[index], atol=1e-12)


@pytest.mark.parametrize(
    "matrix",
    [
        np.zeros((3, 3)),
        np.ones((3, 3)),
        2.0 * np.eye(3),
        -np.eye(3),
        np.diag([1.0, 1.0, -1.0]),
        np.eye(3) * (1.0 + 2.0 * ORTHONORMAL_TOLERANCE),
        np.array([[1.0, 1e-3, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
        np.full((3, 3), np.nan),
        np.diag([1.0, 1.0, np.inf]),
        np.eye(4),
        np.eye(3)[0],
        "turn",
        None,
        np.stack([np.eye(3), -np.eye(3)]),
    ],
)
def test_matrix_that_is_no_rotation_is_refused_on_one_line(matrix: Any) -> None:
    for function in (checked_rotation, quaternion_from_rotation, yaw_pitch_roll_from_rotation):
        with pytest.raises(InputError) as caught:
            function(matrix)
        assert len(str(caught.value).splitlines()) == 1


@given(rotations())
def test_rotations_off_by_less_than_the_tolerance_are_used_as_given(rotation: FloatArray) -> None:
    given_one = rotation + 1e-8
    assert_array_equal(checked_rotation(given_one), given_one)


@pytest.mark.parametrize(
    ("position", "quaternion"),
    [
        ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0)),
        ((0.0, 0.0, 0.0), (math.nan, 0.0, 0.0, 1.0)),
        ((0.0, 0.0, 0.0), (math.inf, 0.0, 0.0, 1.0)),
        ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
        ((0.0, 0.0, math.nan), (1.0, 0.0, 0.0, 0.0)),
        ((0.0, 0.0, -math.inf), (1.0, 0.0, 0.0, 0.0)),
        ((0.0, 0.0, 1e300), (1.0, 0.0, 0.0, 0.0)),
        ((0.0, 0.0), (1.0, 0.0, 0.0, 0.0)),
        (((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), (1.0, 0.0, 0.0, 0.0)),
        ("xyz", (1.0, 0.0, 0.0, 0.0)),
        (None, (1.0, 0.0, 0.0, 0.0)),
    ],
)
def test_unusable_poses_are_refused_on_one_line(position: Any, quaternion: Any) -> None:
    with pytest.raises(ExplorerError) as caught:
        Pose(position, quaternion)
    assert len(str(caught.value).splitlines()) == 1


def test_a_quaternion_of_zeros_is_refused_alone_and_in_a_batch() -> None:
    for quaternion in (np.zeros(4), np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0]])):
        with pytest.raises(InputError, match="zeros"):
            rotation_from_quaternion(quaternion)


@given(quaternions, st.sampled_from([1e-300, 1e-9, 1.0, 1e9, 1e300]))
def test_a_pose_keeps_its_quaternion_at_unit_length(
    quaternion: tuple[float, float, float, float], factor: float
) -> None:
    w, x, y, z = (factor * value for value in quaternion)
    pose = Pose((1.0, 2.0, 3.0), (w, x, y, z))
    assert abs(float(np.linalg.norm(pose.quaternion)) - 1.0) <= ROUNDING
    assert Pose(pose.position, pose.quaternion) == pose
    assert_allclose(pose.rotation, rotation_from_quaternion(quaternion), rtol=0, atol=1e-14)


@given(rotations())
def test_pose_of_a_rotation_has_that_rotation(rotation: FloatArray) -> None:
    pose = Pose.of([1.0, 2.0, 3.0], rotation)
    assert pose.position == (1.0, 2.0, 3.0)
    assert_allclose(pose.rotation, rotation, rtol=0, atol=ROUNDING)


def test_a_pose_of_angles_has_those_angles() -> None:
    pose = Pose.of_yaw_pitch_roll([1.0, 2.0, 3.0], [-73.1, 10.0, 20.0])
    assert_allclose(yaw_pitch_roll_from_rotation(pose.rotation), [-73.1, 10.0, 20.0], atol=1e-12)


def test_poses_of_equal_values_are_equal_and_frozen() -> None:
    one, other = Pose((1.0, 2.0, 3.0), (1.0, 0.0, 0.0, 0.0)), Pose((1, 2, 3), (2, 0, 0, 0))
    assert one == other
    assert hash(one) == hash(other)
    with pytest.raises(AttributeError):
        one.position = (0.0, 0.0, 0.0)  # pyright: ignore[reportAttributeAccessIssue]
