"""The pose of the platform: the position of b4 and the rotation from platform to base.

Quaternions are (w, x, y, z). Yaw, pitch and roll are degrees about the intrinsic z, y
and x axes, in this order, so R = Rz(yaw) Ry(pitch) Rx(roll).
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence

import msgspec
import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from explorer.errors import InputError
from explorer.numerics import arrays
from explorer.numerics.arrays import FloatArray, finite_array
from explorer.numerics.checks import FARTHEST
from explorer.numerics.compiled import helper, kernel
from explorer.numerics.number_text import format_apart

Triple = tuple[float, float, float]
Quadruple = tuple[float, float, float, float]

# Largest entry of R Rᵀ − I of an accepted rotation, which is then used unchanged.
ORTHONORMAL_TOLERANCE = 1e-6


class Pose(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A pose of the platform.

    Attributes:
        position: b4 in the base frame, in design units.
        quaternion: (w, x, y, z), platform to base, normalised.

    Raises:
        InputError: The position or the quaternion is not of three or four finite numbers, the
            position exceeds 1e100, or the quaternion is zero.
    """

    position: Triple
    quaternion: Quadruple

    def __post_init__(self) -> None:
        position = finite_array("position", self.position, (3,), FARTHEST)
        quaternion = finite_array("quaternion", self.quaternion, (4,))
        if position.ndim != 1 or quaternion.ndim != 1:
            raise InputError("a pose has one position and one quaternion, not a batch")
        norm = math.hypot(*quaternion)
        if norm == 0.0:
            raise InputError("quaternion must not be all zeros; no rotation is (1, 0, 0, 0)")
        # A quaternion of unit length stays the same to the last bit, so that files round-trip.
        if abs(norm - 1.0) > 4e-16:
            quaternion = quaternion / norm
        # Plain numbers, whatever was given: others can be neither compared nor written to a file.
        msgspec.structs.force_setattr(self, "position", tuple(position.tolist()))
        msgspec.structs.force_setattr(self, "quaternion", tuple(quaternion.tolist()))

    @property
    def rotation(self) -> FloatArray:
        """The rotation matrix, platform to base, shape (3, 3), read-only."""
        return _rotation(self.quaternion)

    @property
    def yaw_pitch_roll(self) -> Triple:
        """The angles of the rotation, in degrees, pitch within ±90°; roll is 0 at ±90°."""
        return _angles(self.quaternion)

    @staticmethod
    def of(position: ArrayLike, rotation: ArrayLike) -> Pose:
        """Return the pose with this position (3,) and rotation matrix (3, 3)."""
        x, y, z = arrays.position_array("position", position).tolist()
        w, i, j, k = quaternion_from_rotation(rotation).tolist()
        return Pose((x, y, z), (w, i, j, k))

    @staticmethod
    def of_yaw_pitch_roll(position: ArrayLike, yaw_pitch_roll: ArrayLike) -> Pose:
        """Return the pose with this position (3,) and these angles (3,), in degrees."""
        return Pose.of(position, rotation_from_yaw_pitch_roll(yaw_pitch_roll))

    def turn(self, point: FloatArray, vector: FloatArray) -> Pose:
        """Return the pose after a turn about an axis through a point, (3,), in design units.

        The rotation vector, (3,), is in radians; both are in the base frame.
        """
        turn = Rotation.from_rotvec(vector).as_matrix()
        return Pose.of(point + turn @ (np.array(self.position) - point), turn @ self.rotation)


def rotation_from_quaternion(quaternion: ArrayLike) -> FloatArray:
    """Return rotation matrices (..., 3, 3) of quaternions (..., 4) of any length but zero.

    Raises:
        InputError: A quaternion is not finite, or it is zero.
    """
    array = finite_array("quaternion", quaternion, (4,))
    largest = np.abs(array).max(axis=-1, keepdims=True)
    if not largest.all():
        raise InputError("quaternion must not be all zeros; no rotation is (1, 0, 0, 0)")
    # Any length will do, also one whose square is no number.
    return Rotation.from_quat(array / largest, scalar_first=True).as_matrix()


def quaternion_from_rotation(rotation: ArrayLike) -> FloatArray:
    """Return unit quaternions (w, x, y, z), shape (..., 4), of rotations; w is not negative."""
    matrix = rotation_array(rotation)
    return Rotation.from_matrix(matrix).as_quat(canonical=True, scalar_first=True)


def rotation_from_yaw_pitch_roll(yaw_pitch_roll: ArrayLike) -> FloatArray:
    """Return rotation matrices (..., 3, 3) of yaw, pitch and roll (..., 3) in degrees.

    Raises:
        InputError: An angle is not finite.
    """
    angles = finite_array("yaw, pitch and roll", yaw_pitch_roll, (3,))
    return Rotation.from_euler("ZYX", angles, degrees=True).as_matrix()


def yaw_pitch_roll_from_rotation(rotation: ArrayLike) -> FloatArray:
    """Return yaw, pitch and roll (..., 3) in degrees, pitch within ±90°.

    At a pitch of ±90° only yaw ∓ roll is determined; roll is then zero.

    Raises:
        InputError: A matrix is not a rotation.
    """
    return _euler(Rotation.from_matrix(rotation_array(rotation)))


def _euler(rotation: Rotation) -> FloatArray:
    return rotation.as_euler("ZYX", degrees=True, suppress_warnings=True)


def rotation_array(rotation: ArrayLike) -> FloatArray:
    """Return rotation matrices (..., 3, 3) as float64 after checking them.

    Raises:
        InputError: A matrix is not orthonormal to 1e-6, or is a reflection.
    """
    matrix = finite_array("rotation", rotation, (3, 3))
    if matrix.ndim == 2:
        deviation, determinant = deviation_of(matrix.tolist())
    else:
        bounds = np.zeros(2)
        matrices = arrays.for_kernel(matrix.reshape(-1, 3, 3))
        measure_rotations(len(matrices), matrices, bounds)
        deviation, determinant = bounds.tolist()
    if deviation > ORTHONORMAL_TOLERANCE:
        most, got = format_apart((ORTHONORMAL_TOLERANCE, deviation), 3)
        raise InputError(
            f"rotation must be orthonormal to {most}; R Rᵀ is off the identity by {got}"
        )
    if determinant < 0.0:
        raise InputError("rotation must have determinant +1; this one is a reflection")
    return matrix


def pose_rows(
    position: ArrayLike, rotation: ArrayLike
) -> tuple[FloatArray, FloatArray, tuple[int, ...]]:
    """Return positions (n, 3) and rotations (n, 3, 3) for kernels, and the batch axes of poses.

    Raises:
        InputError: A position is not finite, a rotation is not one, or batch axes do not broadcast.
    """
    p, r = arrays.position_array("position", position), rotation_array(rotation)
    batch = arrays.batch_shape((p, 1), (r, 2))
    return arrays.rows_for_kernel(p, batch, 1), arrays.rows_for_kernel(r, batch, 2), batch


@helper
def deviation_of(matrix: Sequence[Sequence[float]]) -> tuple[float, float]:
    """Return the largest entry of |R Rᵀ − I|, and the determinant, of a matrix (3, 3)."""
    ax, ay, az = matrix[0]
    bx, by, bz = matrix[1]
    cx, cy, cz = matrix[2]
    deviation = max(
        abs(ax * ax + ay * ay + az * az - 1.0),
        abs(bx * bx + by * by + bz * bz - 1.0),
        abs(cx * cx + cy * cy + cz * cz - 1.0),
        abs(ax * bx + ay * by + az * bz),
        abs(ax * cx + ay * cy + az * cz),
        abs(bx * cx + by * cy + bz * cz),
    )
    determinant = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    return deviation, determinant


@kernel("void(f8[:,:,::1], f8[::1])")
def measure_rotations(matrices: FloatArray, bounds: FloatArray) -> None:
    """Raise and lower the bounds to the largest entry of |R Rᵀ − I| and the least determinant."""
    for row in range(matrices.shape[0]):
        deviation, determinant = deviation_of(matrices[row])
        bounds[0] = max(bounds[0], deviation)
        bounds[1] = min(bounds[1], determinant)


@functools.lru_cache(64)
def _rotation(quaternion: Quadruple) -> FloatArray:
    rotation = rotation_from_quaternion(quaternion)
    # All callers share the cached array.
    rotation.flags.writeable = False
    return rotation


@functools.lru_cache(64)
def _angles(quaternion: Quadruple) -> Triple:
    return arrays.triple(_euler(Rotation.from_quat(quaternion, scalar_first=True)))
