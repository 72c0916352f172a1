"""Poses: every parameterisation of a rotation converts back to the same rotation."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from refusals import refusal
from scipy.spatial.transform import Rotation
from strategies import QUARTER_TURNS, rotations, small_rotations

from explorer import (
    InputError,
    Pose,
    rotation_from_quaternion,
    rotation_from_yaw_pitch_roll,
    yaw_pitch_roll_from_rotation,
)
from explorer.mechanism.pose import ORTHONORMAL_TOLERANCE, quaternion_from_rotation, rotation_array
from explorer.mechanism.tilt_torsion import (
    rotation_from_tilt_torsion,
    tilt_torsion_from_rotation,
    tilt_torsion_of,
)
from explorer.numerics.arrays import FloatArray

ROUNDING = 4e-15
angles = st.floats(-180.0, 180.0)
components = st.floats(-1.0, 1.0)
quaternions = st.tuples(components, components, components, components).filter(
    lambda q: max(map(abs, q)) > 1e-3
)


@given(rotations())
def test_rotation_converted_and_back_is_unchanged(rotation: FloatArray) -> None:
    pose = Pose.of([1.0, 2.0, 3.0], rotation)
    quaternion, turns = quaternion_from_rotation(rotation), yaw_pitch_roll_from_rotation(rotation)
    assert pose.position == (1.0, 2.0, 3.0)
    assert abs(float(np.linalg.norm(quaternion)) - 1.0) <= ROUNDING
    assert quaternion[0] >= 0.0
    assert abs(turns[1]) <= 90.0 + 1e-9
    assert_allclose(rotation_from_quaternion(quaternion), rotation, rtol=0, atol=ROUNDING)
    assert_allclose(pose.rotation, rotation, rtol=0, atol=ROUNDING)
    # Near a pitch of 90° its sine is flat, so half the digits of the angle are lost.
    assert_allclose(rotation_from_yaw_pitch_roll(turns), rotation, rtol=0, atol=3e-7)
    # What is off by less than the tolerance is used unchanged.
    assert_array_equal(rotation_array(rotation + 1e-8), rotation + 1e-8)


@given(quaternions, st.sampled_from([-1.0, 1e-9, 2.0, 1e9]))
def test_quaternion_of_any_length_and_sign_is_that_of_its_rotation(
    quaternion: tuple[float, ...], factor: float
) -> None:
    rotation = rotation_from_quaternion(quaternion)
    unit = np.array(quaternion) / np.linalg.norm(quaternion)
    assert abs(abs(float(quaternion_from_rotation(rotation) @ unit)) - 1.0) <= ROUNDING
    scalar_last = Rotation.from_quat(np.roll(unit, -1)).as_matrix()
    assert_allclose(rotation, scalar_last, rtol=0, atol=ROUNDING)
    other = rotation_from_quaternion(np.array(quaternion) * factor)
    assert_allclose(other, rotation, rtol=0, atol=ROUNDING)


@given(angles, st.floats(-89.0, 89.0), angles)
def test_yaw_pitch_roll_turn_about_intrinsic_z_y_x_and_convert_back(
    yaw: float, pitch: float, roll: float
) -> None:
    rotation = rotation_from_yaw_pitch_roll([yaw, pitch, roll])
    expected = Rotation.from_euler("ZYX", [yaw, pitch, roll], degrees=True).as_matrix()
    assert_allclose(rotation, expected, rtol=0, atol=ROUNDING)
    difference = yaw_pitch_roll_from_rotation(rotation) - [yaw, pitch, roll]
    assert_allclose((difference + 180.0) % 360.0 - 180.0, 0.0, atol=1e-10)
    assert_array_equal(Pose.of_yaw_pitch_roll([0, 0, 0], [yaw, pitch, roll]).quaternion,
                       Pose.of([0, 0, 0], rotation).quaternion)  # fmt: skip


@given(angles, st.sampled_from([90.0, -90.0]), angles)
def test_yaw_pitch_roll_at_gimbal_lock_have_a_roll_of_zero(
    yaw: float, pitch: float, roll: float
) -> None:
    rotation = rotation_from_yaw_pitch_roll([yaw, pitch, roll])
    converted = yaw_pitch_roll_from_rotation(rotation)
    assert converted[2] == 0.0
    assert_allclose(converted[1], pitch, atol=1e-5)
    assert_allclose(rotation_from_yaw_pitch_roll(converted), rotation, rtol=0, atol=3e-7)


@given(small_rotations() | st.sampled_from(list(QUARTER_TURNS)))
def test_small_rotations_and_quarter_turns_convert_to_the_last_digits(rotation: FloatArray) -> None:
    quaternion, turns = quaternion_from_rotation(rotation), yaw_pitch_roll_from_rotation(rotation)
    for again in (rotation_from_quaternion(quaternion), rotation_from_yaw_pitch_roll(turns)):
        assert_allclose(again, rotation, rtol=0, atol=ROUNDING)


@pytest.mark.parametrize(
    "matrix",
    [
        *(np.zeros((3, 3)), np.ones((3, 3)), np.full((3, 3), np.nan), np.diag([1.0, 1.0, np.inf])),
        *(2.0 * np.eye(3), -np.eye(3), np.diag([1.0, 1.0, -1.0]), np.eye(4), np.eye(3)[0]),
        np.eye(3) * (1.0 + 2.0 * ORTHONORMAL_TOLERANCE),
        np.array([[1.0, 1e-3, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
        np.stack([np.eye(3), -np.eye(3)]),
        *("turn", None),
    ],
)
def test_matrix_that_is_no_rotation_is_refused(matrix: Any) -> None:
    for function in (rotation_array, quaternion_from_rotation, yaw_pitch_roll_from_rotation):
        refusal(function, matrix)


@pytest.mark.parametrize(
    ("position", "quaternion"),
    [
        *(((0, 0, 0), quaternion) for quaternion in ((0, 0, 0, 0), (1, 0, 0), (math.nan, 0, 0, 1))),
        *(((0, 0, odd), (1, 0, 0, 0)) for odd in (math.nan, -math.inf, 1e300)),
        ((0, 0, 0), (math.inf, 0, 0, 1)),
        *((position, (1, 0, 0, 0)) for position in ((0, 0), ((0, 0, 0), (0, 0, 0)), "xyz", None)),
    ],
)
def test_unusable_pose_is_refused(position: Any, quaternion: Any) -> None:
    refusal(Pose, position, quaternion)


@given(quaternions, st.sampled_from([1e-9, 1.0, 1e9]))
def test_pose_keeps_its_quaternion_at_unit_length(
    quaternion: tuple[float, float, float, float], factor: float
) -> None:
    w, x, y, z = (factor * value for value in quaternion)
    pose = Pose((1.0, 2.0, 3.0), (w, x, y, z))
    assert abs(float(np.linalg.norm(pose.quaternion)) - 1.0) <= ROUNDING
    again = Pose(pose.position, pose.quaternion)
    assert again == pose
    assert hash(again) == hash(pose)
    assert_allclose(pose.rotation, rotation_from_quaternion(quaternion), rtol=0, atol=1e-14)


@pytest.mark.parametrize(
    "tilt", [0.0, 1e-13, 1e-9, 1e-5, 20.0, 90.0, 180.0 - 1e-5, 180.0 - 1e-9, 180.0]
)
def test_rotation_converted_and_back_is_unchanged_near_free_angles_too(tilt: float) -> None:
    rng = np.random.default_rng(2)
    angles = np.column_stack(
        [rng.uniform(-180, 180, 50), np.full(50, tilt), rng.uniform(-180, 180, 50)]
    )
    r = rotation_from_tilt_torsion(angles)
    found = tilt_torsion_from_rotation(r)
    np.testing.assert_allclose(rotation_from_tilt_torsion(found), r, atol=1e-11)
    if tilt in (20.0, 90.0):
        np.testing.assert_allclose(found, angles, atol=1e-9)
    assert (np.abs(found[:, [0, 2]]) <= 180.0).all()
    assert ((found[:, 1] >= 0.0) & (found[:, 1] <= 180.0)).all()


def test_azimuth_is_zero_at_tilt_zero_and_torsion_at_tilt_180() -> None:
    level = tilt_torsion_of(rotation_from_yaw_pitch_roll([-73.1, 0.0, 0.0]))
    assert level == pytest.approx((0.0, 0.0, -73.1), abs=1e-12)
    assert math.copysign(1.0, level.azimuth) == 1.0
    over = tilt_torsion_of(rotation_from_tilt_torsion([30.0, 180.0, 20.0]))
    assert over == pytest.approx((20.0, 180.0, 0.0), abs=1e-9)


def test_unusable_angles_are_refused() -> None:
    for angles in ([math.nan, 0.0, 0.0], [1.0, 2.0], "x"):
        with pytest.raises(InputError, match="azimuth, tilt and torsion"):
            rotation_from_tilt_torsion(angles)
    with pytest.raises(InputError, match="rotation"):
        tilt_torsion_from_rotation(np.zeros((3, 3)))
