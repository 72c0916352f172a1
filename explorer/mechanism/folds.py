"""The folds: six coordinates of a pose in which every singularity is a flat fold.

The mechanism is a strip of four leaves, hinged along three lines. The base plane is folded at the
guide into the plane of the guide and b4, that one at the line a1b4 into the plane of a1 and the
line b2b3, and that one at the line b2b3 into the platform:

    r   distance of a1 and b4
    β   angle from the guide's direction, x̂, to that from a1 to b4
    ε   angle from the direction from a1 to b4 to the platform's x-axis
    φ1  fold at the line b2b3; 0 where a1 is in the platform plane, on the side of the platform's y
    φ2  fold at the line a1b4; 0 where the three directions are in one plane, with β + ε from x̂ to
        the platform's x-axis
    φ3  fold at the guide; 0 where b4 is in the base plane, on the side of the base's y

With rotations X(·) and Z(·) about x and z, a pose is

    p = X(φ3) Z(β) (r, 0, 0),    R = X(φ3) Z(β) X(−φ2) Z(ε) X(−φ1)

and its margins are products of sines with one fold in each:

    δ1 = r sin ε sin φ1,    δ2 = r sin β sin ε sin φ2,    δ3 = r sin β sin φ3.

So each assembly mode is the open box r > 0, 0 < β, ε < π with each fold between 0 and π or between
−π and 0, and a pose is singular exactly on a wall of it. Within a mode log |δi| is concave in the
coordinates, so that along a straight line between two poses of it each |δi| stays at or above the
smaller of its two ends.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from explorer.mechanism.margins import signs_of
from explorer.mechanism.pose import Pose, pose_rows
from explorer.numerics.arrays import FloatArray, finite_array, for_kernel
from explorer.numerics.compiled import helper, kernel

FOLDS = ("r", "β", "ε", "φ1", "φ2", "φ3")
"""The names of the coordinates: a distance, two angles and three folds."""

FOLD_LINES = ("line b2b3", "line a1b4", "guide")
"""The line at which the mechanism folds, in the order φ1, φ2, φ3."""

# Signs of φ1, φ2 and φ3 in the eight assembly modes.
MODE_SIGNS = np.array([signs_of(mode) for mode in range(8)])

# The cosine and the sine of an angle.
Direction = tuple[float, float]


def to_folds(position: ArrayLike, rotation: ArrayLike) -> FloatArray:
    """Return the fold coordinates (r, β, ε, φ1, φ2, φ3) of a pose, shape (..., 6).

    The pose is b4 in the base frame, (..., 3), in design units, and platform to base, (..., 3, 3).
    r is a distance in design units, the others are angles in radians: β and ε from 0 to π, the
    folds above −π and up to π. On lower strata some are undefined and chosen: where b4 is on the
    guide φ3 is 0, where a1 is on the line b2b3 φ2 is 0, and where a1 and b4 coincide β is 0 too.
    The other folds then are what remains of the rotation.

    Raises:
        InputError: The position is not finite, or the rotation is not one.
    """
    positions, rotations, batch = pose_rows(position, rotation)
    count = len(positions)
    coordinates = np.empty((count, 6))
    sines, cosines = np.empty((2, count, 5))
    write_angles(count, positions, rotations, coordinates, sines, cosines)
    np.arctan2(sines, cosines, out=coordinates[:, 1:])
    # Just above −π, a fold may be rounded to it.
    np.abs(coordinates, out=coordinates, where=coordinates == -np.pi)
    return coordinates.reshape(*batch, 6)


def from_folds(coordinates: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return position (..., 3) and rotation (..., 3, 3) of fold coordinates.

    These are (r, β, ε, φ1, φ2, φ3), shape (..., 6), in design units and radians. Angles may have
    any size; beyond their ranges the pose has other coordinates as well.

    Raises:
        InputError: The coordinates are not six finite numbers, or r is negative.
    """
    array = finite_array(f"folds ({', '.join(FOLDS)})", coordinates, (6,))
    finite_array("the distance r", array[..., 0], (), signed=False)
    rows = for_kernel(array.reshape(-1, 6))
    positions, rotations = np.empty((len(rows), 3)), np.empty((len(rows), 3, 3))
    write_poses(len(rows), rows, positions, rotations)
    batch = array.shape[:-1]
    return positions.reshape(*batch, 3), rotations.reshape(*batch, 3, 3)


def assembly_modes(position: ArrayLike, rotation: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return the eight poses with the joints of a pose, by mode, shapes (8, 3) and (8, 3, 3).

    They have its folds with the signs of each mode, so that those which meet in a singular pose
    are that pose, to rounding. From joints they follow to the square root of it only. The pose is
    b4 in the base frame, shape (3,), in design units, and platform to base, shape (3, 3).

    Raises:
        InputError: The position is not finite, or the rotation is not one.
    """
    folds = np.tile(to_folds(position, rotation), (len(MODE_SIGNS), 1))
    folds[:, 3:] = MODE_SIGNS * np.abs(folds[:, 3:])
    return from_folds(folds)


def pose_of_folds(folds: Sequence[float]) -> Pose:
    """Return the pose of r in design units and β, ε, φ1, φ2, φ3 in degrees."""
    r, *angles = folds
    return Pose.of(*from_folds([r, *np.radians(angles)]))


@helper
def write_rotation(
    angles: tuple[Direction, Direction],
    folds: tuple[Direction, Direction, Direction],
    rotation: FloatArray,
) -> None:
    """Write the rotation (3, 3) of cosines and sines of β and ε, and of φ1, φ2 and φ3."""
    (cos_b, sin_b), (cos_e, sin_e) = angles
    (cos1, sin1), (cos2, sin2), (cos3, sin3) = folds
    # The columns of X(−φ2) Z(ε) X(−φ1).
    columns = (
        (cos_e, sin_e * cos2, -sin_e * sin2),
        (-sin_e * cos1, cos_e * cos1 * cos2 - sin1 * sin2, -cos_e * cos1 * sin2 - sin1 * cos2),
        (-sin_e * sin1, cos_e * sin1 * cos2 + cos1 * sin2, cos1 * cos2 - cos_e * sin1 * sin2),
    )
    for column in range(3):
        x, y, z = columns[column]
        x, y = cos_b * x - sin_b * y, sin_b * x + cos_b * y
        rotation[0, column] = x
        rotation[1, column] = cos3 * y - sin3 * z
        rotation[2, column] = sin3 * y + cos3 * z


@helper
def write_pose(coordinates: FloatArray, position: FloatArray, rotation: FloatArray) -> None:
    """Write the position (3,) and the rotation (3, 3) of fold coordinates (6,)."""
    r, b, e = coordinates[0], coordinates[1], coordinates[2]
    f1, f2, f3 = coordinates[3], coordinates[4], coordinates[5]
    cos_b, sin_b = math.cos(b), math.sin(b)
    fold1, fold2 = (math.cos(f1), math.sin(f1)), (math.cos(f2), math.sin(f2))
    cos3, sin3 = math.cos(f3), math.sin(f3)
    angles = (cos_b, sin_b), (math.cos(e), math.sin(e))
    write_rotation(angles, (fold1, fold2, (cos3, sin3)), rotation)
    position[0], position[1], position[2] = r * cos_b, r * sin_b * cos3, r * sin_b * sin3


@kernel("void(f8[:,::1], f8[:,::1], f8[:,:,::1])")
def write_poses(coordinates: FloatArray, positions: FloatArray, rotations: FloatArray) -> None:
    """Write the positions (n, 3) and the rotations (n, 3, 3) of fold coordinates (n, 6)."""
    for row in range(coordinates.shape[0]):
        write_pose(coordinates[row], positions[row], rotations[row])


@helper
def length_of(a: float, b: float) -> float:
    """Return √(a² + b²); `math.hypot` takes ten times as long."""
    return math.sqrt(a * a + b * b)


@kernel("void(f8[:,::1], f8[:,:,::1], f8[:,::1], f8[:,::1], f8[:,::1])")
def write_angles(
    positions: FloatArray,
    rotations: FloatArray,
    coordinates: FloatArray,
    sines: FloatArray,
    cosines: FloatArray,
) -> None:
    """Write the distance, and sines and cosines of the angles and folds, of n poses.

    The distance r goes into the first column of the coordinates (n, 6); sines and cosines of β, ε,
    φ1, φ2 and φ3 have the shape (n or more, 5), and no zero of a sine is a negative one.
    """
    for row in range(positions.shape[0]):
        # A negative zero would turn a fold of π into −π.
        px, py, pz = positions[row, 0], positions[row, 1], positions[row, 2] + 0.0
        h = length_of(py, pz)
        r = length_of(px, h)
        c3, s3 = (py / h, pz / h) if h > 0.0 else (1.0, 0.0)
        cb, sb = (px / r, h / r) if r > 0.0 else (1.0, 0.0)
        # The platform's axes, turned back by X(φ3) Z(β): parts along a1b4, across it in the leaf
        # of the guide, and across both.
        ux, uy, uz = rotations[row, 0, 0], rotations[row, 1, 0], rotations[row, 2, 0]
        vx, vy, vz = rotations[row, 0, 1], rotations[row, 1, 1], rotations[row, 2, 1]
        nx, ny, nz = rotations[row, 0, 2], rotations[row, 1, 2], rotations[row, 2, 2]
        uy, uz = c3 * uy + s3 * uz, c3 * uz - s3 * uy
        vy, vz = c3 * vy + s3 * vz, c3 * vz - s3 * vy
        ny, nz = c3 * ny + s3 * nz, c3 * nz - s3 * ny
        along, across = cb * ux + sb * uy, cb * uy - sb * ux
        se = length_of(across, uz)
        c2, s2 = (across / se, (0.0 - uz) / se) if se > 0.0 else (1.0, 0.0)
        coordinates[row, 0] = r
        sines[row, 0], cosines[row, 0] = sb, cb
        sines[row, 1], cosines[row, 1] = se, along
        sines[row, 2] = 0.0 - (s2 * (cb * vy - sb * vx) + c2 * vz)
        cosines[row, 2] = s2 * (cb * ny - sb * nx) + c2 * nz
        sines[row, 3], cosines[row, 3] = s2, c2
        sines[row, 4], cosines[row, 4] = s3, c3
