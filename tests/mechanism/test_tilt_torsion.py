"""Azimuth, tilt and torsion against Euler angles, both ways, also where an angle is free."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from explorer import (
    InputError,
    pose_of_tilt_torsion,
    rotation_from_tilt_torsion,
    rotation_from_yaw_pitch_roll,
    tilt_torsion_from_rotation,
)
from explorer.mechanism.tilt_torsion import tilt_torsion_of


def test_rotation_is_that_of_the_euler_angles() -> None:
    angles = np.random.default_rng(0).uniform(-400.0, 400.0, (50, 4, 3))
    euler = angles.copy()
    euler[..., 2] -= euler[..., 0]
    expected = Rotation.from_euler("ZYZ", euler.reshape(-1, 3), degrees=True).as_matrix()
    found = rotation_from_tilt_torsion(angles)
    np.testing.assert_allclose(found, expected.reshape(50, 4, 3, 3), atol=1e-12)
    full_turns = rotation_from_tilt_torsion([1e17, -1e25, 3e300])
    remainders = rotation_from_tilt_torsion([math.fmod(x, 360.0) for x in (1e17, -1e25, 3e300)])
    np.testing.assert_allclose(full_turns, remainders, atol=1e-12)


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


def test_pose_has_the_position_and_the_rotation() -> None:
    pose = pose_of_tilt_torsion([1.0, 2.0, 3.0], [30.0, 20.0, -70.0])
    assert pose.position == (1.0, 2.0, 3.0)
    np.testing.assert_allclose(pose.rotation, rotation_from_tilt_torsion([30.0, 20.0, -70.0]))


def test_unusable_angles_are_refused() -> None:
    for angles in ([math.nan, 0.0, 0.0], [1.0, 2.0], "x"):
        with pytest.raises(InputError, match="azimuth, tilt and torsion"):
            rotation_from_tilt_torsion(angles)
    with pytest.raises(InputError, match="rotation"):
        tilt_torsion_from_rotation(np.zeros((3, 3)))
