"""Orientations as azimuth, tilt and torsion (T&T angles), in which orientation ranges are drawn.

The platform tilts by θ about a horizontal axis, towards the azimuth φ of the base, and turns by
the torsion σ about its own axis: R = Rz(φ) Ry(θ) Rz(σ − φ), platform to base. At tilt zero the
orientation is a yaw of σ. The torsion does not depend on the azimuth of the tilt, unlike the
third Euler angle. Source: I. A. Bonev, D. Zlatanov, C. M. Gosselin, "Advantages of the modified
Euler angles in the design and control of PKMs", Parallel Kinematic Machines International
Conference, 2002.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from explorer.mechanism.pose import Pose, rotation_array
from explorer.numerics.arrays import FloatArray, finite_array

# Sine of the tilt below which the azimuth is rounding noise.
LEVEL = 1e-12


class TiltTorsion(NamedTuple):
    """An orientation as three angles in degrees.

    Attributes:
        azimuth: Direction in the base's xy-plane that the platform's z-axis tilts towards,
            −180 to 180.
        tilt: Angle between the z-axes of platform and base, 0 to 180.
        torsion: Turn about the platform's z-axis, −180 to 180.
    """

    azimuth: float
    tilt: float
    torsion: float


def rotation_from_tilt_torsion(tilt_torsion: ArrayLike) -> FloatArray:
    """Return rotation matrices (..., 3, 3) of azimuth, tilt and torsion (..., 3) in degrees.

    Any finite angles are allowed; a negative tilt is one towards the opposite azimuth.
    """
    angles = finite_array("azimuth, tilt and torsion", tilt_torsion, (3,))
    turns = np.stack([angles[..., 0], angles[..., 1], angles[..., 2] - angles[..., 0]], axis=-1)
    return Rotation.from_euler("ZYZ", turns, degrees=True).as_matrix()


def tilt_torsion_from_rotation(rotation: ArrayLike) -> FloatArray:
    """Return azimuth, tilt and torsion (..., 3) in degrees of rotation matrices (..., 3, 3).

    At tilt 0 every azimuth gives the same rotation, so the azimuth is 0. At tilt 180° only twice
    the azimuth less the torsion is determined, so the torsion is 0.
    """
    r = rotation_array(rotation)
    sine = np.hypot(r[..., 0, 2], r[..., 1, 2])
    tilt = np.arctan2(sine, r[..., 2, 2])
    is_free = sine < LEVEL
    is_low = r[..., 2, 2] >= 0.0
    azimuth = np.arctan2(r[..., 1, 2], r[..., 0, 2])
    # The torsion is well determined by sums while the tilt is below 90°, 2 φ − σ beyond.
    torsion = np.arctan2(r[..., 1, 0] - r[..., 0, 1], r[..., 0, 0] + r[..., 1, 1])
    twice = np.arctan2(-r[..., 1, 0] - r[..., 0, 1], r[..., 1, 1] - r[..., 0, 0])
    azimuth = np.where(is_free, np.where(is_low, 0.0, 0.5 * twice), azimuth)
    beyond = np.remainder(2.0 * azimuth - twice + np.pi, 2.0 * np.pi) - np.pi
    torsion = np.where(is_low, torsion, np.where(is_free, 0.0, beyond))
    # No angle is a negative zero.
    return np.degrees(np.stack([azimuth, tilt, torsion], axis=-1)) + 0.0


def pose_of_tilt_torsion(position: ArrayLike, tilt_torsion: ArrayLike) -> Pose:
    """Return the pose with this position and azimuth, tilt and torsion (3,) in degrees."""
    return Pose.of(position, rotation_from_tilt_torsion(tilt_torsion))


def tilt_torsion_of(rotation: ArrayLike) -> TiltTorsion:
    """Return azimuth, tilt and torsion of one rotation, platform to base, shape (3, 3)."""
    return TiltTorsion(*tilt_torsion_from_rotation(rotation).tolist())
