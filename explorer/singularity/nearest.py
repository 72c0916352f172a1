"""The nearest singular pose of each of the three incidences, by a distance between poses.

The distance is the root-mean-square displacement of b1, b2, b3 and b4, a metric of G. Nawratil
("New performance indices for 6-dof UPS and 3-dof RPR parallel manipulators", 2009), who calls its
least value to a singular pose the singularity distance. Its square is |g' − g|² + 2 tr M − 2 tr(R'
M Rᵀ), with the centroid g of the four points and their scatter M about it (Kabsch 1976; Horn 1987).
It has the unit of the design, needs no length that weights angles, and does not depend on frames.

Each of the three poses is a global minimum with a proven lower bound, see
`explorer.singularity.nearest_plane` for δ1 and δ3 and `explorer.singularity.nearest_lines` for δ2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Design
from explorer.mechanism.margins import INCIDENCES, ROUNDING, margins_at
from explorer.mechanism.pose import Pose, rotation_array
from explorer.numerics.arrays import FloatArray, batch_shape, dot, position_array
from explorer.numerics.compiled import helper, kernel
from explorer.numerics.computed_once import computed_once
from explorer.singularity.nearest_lines import (
    ROOM,
    constants_at,
    minimise_on_torus,
    polish,
    write_on_plane,
)
from explorer.singularity.nearest_plane import nearest_quaternion, write_form, write_turned


@dataclass(frozen=True)
class PlatformPoints:
    """The four points of a platform with their first and second moments, in the platform frame.

    Attributes:
        points: b1, b2, b3 and b4, shape (4, 3), in design units.
        centroid, scatter: Mean c of the points, (3,), and of (b − c)(b − c)ᵀ, (3, 3).
        length: Root-mean-square distance of the points from the centroid, in design units.
    """

    points: FloatArray
    centroid: FloatArray
    scatter: FloatArray
    length: float

    @staticmethod
    def of(design: Design) -> PlatformPoints:
        """Return the points of a design's platform."""
        points = design.platform_points
        centroid = points.mean(axis=0)
        off = points - centroid
        scatter = off.T @ off / len(points)
        return PlatformPoints(points, centroid, scatter, float(np.sqrt(np.trace(scatter))))


def displacement(
    design: Design,
    position: ArrayLike,
    rotation: ArrayLike,
    other_position: ArrayLike,
    other_rotation: ArrayLike,
) -> FloatArray:
    """Return the root-mean-square displacement of b1 to b4, shape (...), in design units.

    Raises:
        InputError: A position is not finite, a rotation is not one, or batch axes do not broadcast.
    """
    p = position_array("position", position)
    q = position_array("other position", other_position)
    r, s = rotation_array(rotation), rotation_array(other_rotation)
    batch_shape((p, 1), (r, 2), (q, 1), (s, 2))
    # For close poses the formula with the scatter would cancel; these squares do not.
    moves = (q - p)[..., None, :] + design.platform_points @ np.swapaxes(s - r, -1, -2)
    return np.sqrt(dot(moves, moves).mean(axis=-1))


class NearestPoses(NamedTuple):
    """The nearest singular poses of a batch of poses, in the order δ1, δ2, δ3.

    Attributes:
        distance: Root-mean-square displacement of b1 to b4, shape (..., 3), in design units.
        bound: Proven lower bound of the distance, shape (..., 3), in design units. Its square
            is within 1e-8 (relative) of the square of the distance, or within 1e-13 of the
            square of the platform's size; it is looser where the lines a1a2 and b2b3 nearly
            coincide, for the size of the platform.
        position: b4 of the nearest poses in the base frame, shape (..., 3, 3), in design units.
        rotation: Platform to base, of the nearest poses, shape (..., 3, 3, 3).
    """

    distance: FloatArray
    bound: FloatArray
    position: FloatArray
    rotation: FloatArray


@dataclass(frozen=True)
class NearestSingularity:
    """The nearest pose with one of the three incidences.

    Attributes:
        incidence: Number 1, 2 or 3 of the margin δ1, δ2 or δ3 that vanishes.
        distance: Root-mean-square displacement of b1 to b4, in design units; 0 for a pose with
            the incidence.
        bound: Proven lower bound of the distance, in design units, see `NearestPoses`.
        pose: The nearest pose; the pose itself at a distance of 0.
    """

    incidence: int
    distance: float
    bound: float
    pose: Pose

    @property
    def name(self) -> str:
        """The name of the incidence, such as "a1 on the platform plane"."""
        return INCIDENCES[self.incidence - 1]


def nearest_singularities(
    design: Design, pose: Pose
) -> tuple[NearestSingularity, NearestSingularity, NearestSingularity]:
    """Return the nearest singular pose of each incidence, in the order δ1, δ2, δ3.

    The pose may be singular itself.
    """
    return singularities_of(nearest_singular_poses(Configuration.at(design, pose)), pose)


def singularities_of(
    nearest: NearestPoses, pose: Pose
) -> tuple[NearestSingularity, NearestSingularity, NearestSingularity]:
    """Return the results of `nearest_singular_poses` for one pose, in the order δ1, δ2, δ3."""

    def of_margin(index: int) -> NearestSingularity:
        distance, bound = float(nearest.distance[index]), float(nearest.bound[index])
        if distance == 0.0:
            return NearestSingularity(index + 1, 0.0, 0.0, pose)
        singular = Pose.of(nearest.position[index], nearest.rotation[index])
        return NearestSingularity(index + 1, distance, bound, singular)

    return of_margin(0), of_margin(1), of_margin(2)


@computed_once
def nearest_singular_poses(configuration: Configuration) -> NearestPoses:
    """Return the nearest singular poses of a batch of poses."""
    platform, batch = PlatformPoints.of(configuration.design), configuration.batch
    # The kernel's tolerances are those of a platform whose own length is one.
    unit = platform.length
    points = platform.points / unit, platform.centroid / unit, platform.scatter / unit**2
    poses = configuration.positions / unit, configuration.rotations
    count = len(poses[0])
    distance, bound = np.empty((count, 3)), np.empty((count, 3))
    near_p, near_r = np.empty((count, 3, 3)), np.empty((count, 3, 3, 3))
    # The branch and bound examines some hundred boxes for each pose.
    nearest_rows(100 * count, *points, *poses, distance, bound, near_p, near_r)
    return NearestPoses(
        (distance * unit).reshape(*batch, 3),
        (bound * unit).reshape(*batch, 3),
        (near_p * unit).reshape(*batch, 3, 3),
        near_r.reshape(*batch, 3, 3, 3),
    )


@helper
def rms_displacement(
    points: FloatArray, p: FloatArray, r: FloatArray, q: FloatArray, s: FloatArray
) -> float:
    """Return the root-mean-square displacement of points from the pose (p, r) to (q, s)."""
    total = 0.0
    for point in range(points.shape[0]):
        for i in range(3):
            way = q[i] - p[i]
            for j in range(3):
                way += (s[i, j] - r[i, j]) * points[point, j]
            total += way * way
    return math.sqrt(total / points.shape[0])


@helper
def write_point_on_plane(
    is_a1: bool,
    g: FloatArray,
    r: FloatArray,
    c: FloatArray,
    forms: FloatArray,
    q: FloatArray,
    s: FloatArray,
) -> float:
    """Write the nearest pose (q, s) with a1 (δ1 = 0) or b4 (δ3 = 0) on the plane of the other flag.

    g and c are the centroid of the points in the base frame and in the platform frame; `forms`,
    shape (5, 4, 4), begins with the quadratic form of the scatter, the others are overwritten.
    Returns a lower bound of the squared distance.
    """
    # x is the distance of a1 from the turned plane through the centroid, or the height of b4
    # with the centroid where it was.
    linear = forms[4]
    for i in range(3):
        along = -(r[0, i] * g[0] + r[1, i] * g[1] + r[2, i] * g[2])
        for j in range(3):
            linear[i, j] = (along if j == 2 else 0.0) if is_a1 else -r[2, i] * c[j]
    write_form(linear, forms[1])
    constant = 0.0 if is_a1 else g[2]
    turn, least = nearest_quaternion(forms[0], forms[1], constant, forms[2], forms[3])
    write_turned(r, turn, s)
    for i in range(3):
        q[i] = g[i] - s[i, 0] * c[0] - s[i, 1] * c[1]
    if not is_a1:
        q[2] = 0.0
        return 2.0 + least
    # The second projection removes the rounding of the first.
    for _ in range(2):
        off = s[0, 2] * q[0] + s[1, 2] * q[1] + s[2, 2] * q[2]
        for i in range(3):
            q[i] -= off * s[i, 2]
    return 2.0 + least


@helper
def shorten(
    way: float,
    shift: float,
    n: tuple[float, float, float],
    p: FloatArray,
    r: FloatArray,
    q: FloatArray,
    s: FloatArray,
) -> float:
    """Write (p − shift n, r) into (q, s) if it is nearer than `way`; return the smaller one.

    Distances below the square root of rounding cannot be compared by their squares.
    """
    if way <= abs(shift):
        return way
    for i in range(3):
        q[i] = p[i] - shift * n[i]
    copy_rotation(r, s)
    return abs(shift)


@helper
def angles_at(r: FloatArray) -> tuple[float, float]:
    """Return the angles on the torus at which the line b2b3 has the direction of a rotation."""
    across = math.hypot(r[1, 0], r[2, 0])
    ny, nz = -r[2, 0] / across, r[1, 0] / across
    ex, ey, ez = ny * r[2, 0] - nz * r[1, 0], nz * r[0, 0], -ny * r[0, 0]
    up = ny * r[1, 1] + nz * r[2, 1]
    return math.atan2(-ny, nz), math.atan2(up, ex * r[0, 1] + ey * r[1, 1] + ez * r[2, 1])


@helper
def copy_rotation(rotation: FloatArray, into: FloatArray) -> None:
    """Copy a rotation (3, 3) element by element, for which Numba compiles far less code."""
    for i in range(3):
        for j in range(3):
            into[i, j] = rotation[i, j]


@helper
def copy_pose(
    position: FloatArray,
    rotation: FloatArray,
    into_position: FloatArray,
    into_rotation: FloatArray,
) -> None:
    """Copy a position (3,) and a rotation (3, 3)."""
    for i in range(3):
        into_position[i] = position[i]
    copy_rotation(rotation, into_rotation)


@kernel(
    "void(f8[:,::1], f8[::1], f8[:,::1], f8[:,::1], f8[:,:,::1],"
    " f8[:,::1], f8[:,::1], f8[:,:,::1], f8[:,:,:,::1])"
)
def nearest_rows(
    points: FloatArray,
    c: FloatArray,
    scatter: FloatArray,
    position: FloatArray,
    rotation: FloatArray,
    distance: FloatArray,
    bound: FloatArray,
    nearest_position: FloatArray,
    nearest_rotation: FloatArray,
) -> None:
    """Write the three nearest singular poses of each of n poses, see `NearestPoses`.

    The points b1 to b4 (4, 3) have the centroid c (3,) and a scatter (3, 3) with a trace of one.
    """
    forms, boxes, g = np.zeros((5, 4, 4)), np.empty((ROOM, 4)), np.empty(3)
    near_q, near_s = np.empty(3), np.empty((3, 3))
    write_form(scatter, forms[0])
    for row in range(position.shape[0]):
        p, r, q, s = position[row], rotation[row], nearest_position[row], nearest_rotation[row]
        size = math.sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2])
        for i in range(3):
            g[i] = p[i] + r[i, 0] * c[0] + r[i, 1] * c[1]
            distance[row, i] = bound[row, i] = 0.0
            copy_pose(p, r, q[i], s[i])
        delta1, delta2, delta3 = margins_at(p, r)
        for i in (0, 2):
            n = (0.0, 0.0, 1.0) if i == 2 else (r[0, 2], r[1, 2], r[2, 2])
            off = delta3 if i == 2 else -delta1
            if abs(off) > ROUNDING * size:
                square = write_point_on_plane(i == 0, g, r, c, forms, q[i], s[i])
                way = rms_displacement(points, p, r, q[i], s[i])
                way = shorten(way, off, n, p, r, q[i], s[i])
                distance[row, i], bound[row, i] = way, min(way, math.sqrt(max(0.0, square)))
        across = math.hypot(r[1, 0], r[2, 0])
        if across > ROUNDING and abs(delta2) > ROUNDING * across * size:
            k = constants_at(r, g, scatter, c)
            phi, sigma, square = minimise_on_torus(k, boxes)
            write_on_plane(phi, sigma, k, c, g, s[1], q[1])
            way = rms_displacement(points, p, r, q[1], s[1])
            # As in `shorten`, squares may miss a minimum very close to the given pose.
            phi, sigma = angles_at(r)
            phi, sigma = polish(phi, sigma, k)
            write_on_plane(phi, sigma, k, c, g, near_s, near_q)
            near_way = rms_displacement(points, p, r, near_q, near_s)
            if near_way < way:
                copy_pose(near_q, near_s, q[1], s[1])
                way = near_way
            n = (0.0, -r[2, 0] / across, r[1, 0] / across)
            way = shorten(way, delta2 / across, n, p, r, q[1], s[1])
            distance[row, 1], bound[row, 1] = way, min(way, math.sqrt(max(0.0, square)))
