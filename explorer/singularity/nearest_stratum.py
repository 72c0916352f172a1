"""The nearest pose in each stratum of codimension one or more.

The conditions of a stratum leave three, two, one or no angles of the rotation free, and b4 must
lie on a plane or a line through a1, or on a1 itself. The best position is then a projection,
and the squared distance a smooth function of the angles: Newton's method, with derivatives by
complex steps, refines its local minima on a grid. The three strata of codimension one have an
exact solution in `explorer.singularity.nearest`; where the rotation alone is free, it is that of
the orthogonal Procrustes problem (Schönemann 1966; for rotations, Kabsch 1976).
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from explorer.errors import InputError
from explorer.mechanism.design import Design
from explorer.mechanism.displacement import PlatformPoints, displacement
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray
from explorer.singularity.bruhat import OF_INCIDENCES, Stratum, codimension, is_below
from explorer.singularity.nearest import nearest_singularities
from explorer.singularity.strata import STRATA, stratum

# Arrays of real numbers, or of complex ones for derivatives.
Array: TypeAlias = NDArray[Any]

# Number of grid angles in a turn, and largest number of Newton steps.
GRID, STEPS = 12, 40
COMPLEX_STEP, HESSIAN_STEP = 1e-40, 1e-5


@dataclass(frozen=True)
class NearestInStratum:
    """The nearest pose in the closure of a stratum.

    Attributes:
        stratum: Requested stratum.
        seen: Stratum of the nearest pose, which is the requested one or lies in its closure.
        distance: Root-mean-square displacement of b1 to b4, in design units.
        pose: The nearest pose.
    """

    stratum: Stratum
    seen: Stratum
    distance: float
    pose: Pose


@dataclass(frozen=True)
class _Closure:
    """The closure of a stratum as conditions on the rotation and on b4.

    Attributes:
        axes: Base axes; the rotation is the product of turns about them in this order.
        flips: Axes of half turns, one of which multiplies the rotation on the right; "" for
            none.
        place: Set of positions of b4: a line through a1, which is "u" (b2b3), "guide" or "node"
            (where the planes intersect), the plane "platform" or "base" through a1, or "a1".
    """

    axes: str
    flips: tuple[str, ...]
    place: str


_FREE = ("zxz", ("",))
# The guide parallel to the platform plane; the line b2b3 parallel to the base plane.
_GUIDE_ALONG, _LINE_ALONG = ("xz", ("",)), ("zx", ("",))
_PARALLEL_PLANES, _PARALLEL_LINES = ("z", ("", "x")), ("x", ("", "z"))
_PARALLEL_FLAGS = ("", ("", "x", "y", "z"))
_TURNED_ABOUT_A1 = _Closure(*_FREE, "a1")

_CLOSURES: Mapping[Stratum, _Closure] = MappingProxyType(
    {
        (3, 4, 1, 2): _Closure(*_FREE, "node"),
        (2, 4, 3, 1): _Closure(*_FREE, "u"),
        (4, 1, 3, 2): _Closure(*_FREE, "guide"),
        (1, 4, 3, 2): _TURNED_ABOUT_A1,
        (3, 2, 4, 1): _Closure(*_GUIDE_ALONG, "platform"),
        (2, 3, 4, 1): _Closure(*_GUIDE_ALONG, "u"),
        (3, 1, 4, 2): _Closure(*_GUIDE_ALONG, "guide"),
        (1, 3, 4, 2): _Closure(*_GUIDE_ALONG, "a1"),
        (4, 2, 1, 3): _Closure(*_LINE_ALONG, "base"),
        (2, 4, 1, 3): _Closure(*_LINE_ALONG, "u"),
        (4, 1, 2, 3): _Closure(*_LINE_ALONG, "guide"),
        (1, 4, 2, 3): _Closure(*_LINE_ALONG, "a1"),
        (3, 2, 1, 4): _Closure(*_PARALLEL_PLANES, "base"),
        (2, 3, 1, 4): _Closure(*_PARALLEL_PLANES, "u"),
        (3, 1, 2, 4): _Closure(*_PARALLEL_PLANES, "guide"),
        (1, 3, 2, 4): _Closure(*_PARALLEL_PLANES, "a1"),
        (2, 1, 4, 3): _Closure(*_PARALLEL_LINES, "guide"),
        (1, 2, 4, 3): _Closure(*_PARALLEL_LINES, "a1"),
        (2, 1, 3, 4): _Closure(*_PARALLEL_FLAGS, "guide"),
        (1, 2, 3, 4): _Closure(*_PARALLEL_FLAGS, "a1"),
    }
)
"""The closures of all strata of codimension two or more."""


def nearest_in_stratum(design: Design, pose: Pose, asked: Stratum) -> NearestInStratum:
    """Return the nearest pose in the closure of a stratum; the pose itself if it lies in it.

    Args:
        design: The manipulator.
        pose: Pose of its platform.
        asked: Requested stratum, a permutation of (1, 2, 3, 4).

    Raises:
        InputError: There is no such stratum.
    """
    w = tuple(asked)
    if w not in STRATA:
        raise InputError(f"a stratum is a permutation of (1, 2, 3, 4); got {w}")
    here = seen_stratum(design, pose)
    if is_below(here, w):
        return NearestInStratum(w, here, 0.0, pose)
    if codimension(w) == 1:
        singular = nearest_singularities(design, pose)[OF_INCIDENCES.index(w)]
        nearest, distance = singular.pose, singular.distance
    else:
        nearest = _nearest(design, pose, _CLOSURES[w])
        distance = float(
            displacement(design, pose.position, pose.rotation, nearest.position, nearest.rotation)
        )
    seen = seen_stratum(design, nearest)
    # Within the tolerance of incidences a pose may lack one that its other incidences imply.
    return NearestInStratum(w, seen if is_below(seen, w) else w, distance, nearest)


def nearest_in_strata(design: Design, pose: Pose) -> Mapping[Stratum, NearestInStratum]:
    """Return the nearest pose in the closure of each of the 24 strata, by stratum."""
    return {w: nearest_in_stratum(design, pose, w) for w in STRATA}


def seen_stratum(design: Design, pose: Pose) -> Stratum:
    """Return the stratum of a pose, with a tolerance relative to the design's reach."""
    return tuple(stratum(pose.position, pose.rotation, design.reach).tolist())


@dataclass(frozen=True)
class _Problem:
    """The minimisation of the distance to a closure; the unit is `PlatformPoints.length`.

    Attributes:
        closure: The closure.
        flip: One of its half turns as a rotation, shape (3, 3).
        centroid: Centroid of the points in the platform frame, shape (3,).
        goal: Centroid of the points of the given pose in the base frame, shape (3,).
        rotated_scatter: Product R M of the given rotation and the scatter, shape (3, 3).
    """

    closure: _Closure
    flip: FloatArray
    centroid: FloatArray
    goal: FloatArray
    rotated_scatter: FloatArray

    def rotation(self, angles: Array) -> Array:
        """Return rotations (..., 3, 3) of angles (..., d)."""
        matrix: Array = np.broadcast_to(self.flip, (*angles.shape[:-1], 3, 3))
        for index in reversed(range(len(self.closure.axes))):
            matrix = _turn(self.closure.axes[index], angles[..., index]) @ matrix
        return matrix

    def position(self, angles: Array, rotation: Array) -> Array:
        """Return the best positions (..., 3) at angles (..., d) and their rotations."""
        free = self.goal - rotation @ self.centroid
        place = self.closure.place
        if place == "a1":
            return np.zeros_like(free)
        if place in ("platform", "base"):
            normal = rotation[..., 2] if place == "platform" else np.array([0.0, 0.0, 1.0])
            return free - (free * normal).sum(axis=-1, keepdims=True) * normal
        along: Array = np.array([1.0, 0.0, 0.0])
        if place == "u":
            along = rotation[..., 0]
        elif place == "node":
            # The first turn is about the base's normal, the second about this line.
            along = _turn("z", angles[..., 0])[..., 0]
        return (free * along).sum(axis=-1, keepdims=True) * along

    def value(self, angles: Array) -> Array:
        """Return the squared distance, shape (...), at angles (..., d)."""
        rotation = self.rotation(angles)
        position = self.position(angles, rotation)
        off = self.goal - rotation @ self.centroid - position
        # Without absolute values the function extends to complex angles.
        trace = (rotation * self.rotated_scatter).sum(axis=(-2, -1))
        return 2.0 - 2.0 * trace + (off * off).sum(axis=-1)

    def slope(self, angles: FloatArray) -> FloatArray:
        """Return the gradient (..., d) at angles (..., d), accurate to rounding."""
        steps = 1j * COMPLEX_STEP * np.eye(angles.shape[-1])
        return np.imag(self.value(angles[..., None, :] + steps)) / COMPLEX_STEP

    def minimise(self) -> tuple[float, FloatArray]:
        """Return the smallest squared distance and its angles, shape (d,)."""
        count = len(self.closure.axes)
        if count == 0:
            none = np.zeros(0)
            return float(self.value(none)), none
        angles = self._starts(count)
        value, damping = self.value(angles), np.zeros(len(angles))
        for _ in range(STEPS):
            slope = self.slope(angles)
            offsets = HESSIAN_STEP * np.eye(count)
            ahead = self.slope(angles[:, None, :] + offsets)
            behind = self.slope(angles[:, None, :] - offsets)
            hessian = (ahead - behind) / (2.0 * HESSIAN_STEP)
            hessian = 0.5 * (hessian + np.swapaxes(hessian, -1, -2))
            curvatures, axes = np.linalg.eigh(hessian)
            # The step descends even if the value is not convex, and is short if it is flat.
            curvatures = np.maximum(np.abs(curvatures), 1e-9) + damping[:, None]
            along = (np.swapaxes(axes, -1, -2) @ slope[..., None])[..., 0] / curvatures
            step = -(axes @ along[..., None])[..., 0]
            step *= np.minimum(1.0, 0.5 / np.maximum(np.abs(step).max(axis=-1), 1e-300))[:, None]
            moved = self.value(angles + step)
            better = moved <= value + 1e-14
            angles = np.where(better[:, None], angles + step, angles)
            value = np.where(better, moved, value)
            damping = np.where(better, 0.1 * damping, np.maximum(10.0 * damping, 1e-2))
            if np.abs(step[better]).max(initial=0.0) < 1e-15:
                break
        best = int(value.argmin())
        return float(value[best]), angles[best]

    def _starts(self, count: int) -> FloatArray:
        """Return the angles (n, d) of local minima on a grid over all turns.

        For two angles these are the minima along either angle alone: far from a1 the value has
        valleys too narrow for the grid to locate the lowest point of their floor. For three
        angles there would be too many.
        """
        grid = _grid(count)
        value = self.value(grid)
        along = [
            (value <= np.roll(value, 1, axis=axis)) & (value <= np.roll(value, -1, axis=axis))
            for axis in range(count)
        ]
        low = np.any(along, axis=0) if count == 2 else np.all(along, axis=0)
        return grid[low][np.argsort(value[low], kind="stable")]


def _nearest(design: Design, pose: Pose, closure: _Closure) -> Pose:
    """Return the nearest pose in a closure over all its flips."""
    platform = PlatformPoints.of(design)
    unit, rotation = platform.length, pose.rotation
    centroid = platform.centroid / unit
    goal = np.array(pose.position) / unit + rotation @ centroid
    rotated_scatter = rotation @ platform.scatter / unit**2
    if closure == _TURNED_ABOUT_A1:
        turn = _nearest_rotation(rotated_scatter + np.outer(goal, centroid))
        return Pose.of(np.zeros(3), turn)
    best, nearest = math.inf, pose
    for flip in closure.flips:
        half_turn = _turn(flip, np.array(math.pi)) if flip else np.eye(3)
        problem = _Problem(closure, half_turn, centroid, goal, rotated_scatter)
        value, angles = problem.minimise()
        if value < best:
            turn = problem.rotation(angles)
            best, nearest = value, Pose.of(unit * problem.position(angles, turn), turn)
    return nearest


def _nearest_rotation(matrix: FloatArray) -> FloatArray:
    """Return the rotation R (3, 3) with the largest trace of Rᵀ A for a matrix A (3, 3)."""
    left, _, right = np.linalg.svd(matrix)
    side = np.sign(np.linalg.det(left @ right))
    return left @ np.diag([1.0, 1.0, side]) @ right


@functools.cache
def _grid(count: int) -> FloatArray:
    steps = np.linspace(0.0, 2.0 * math.pi, GRID, endpoint=False, dtype=np.float64)
    return np.stack(np.meshgrid(*[steps] * count, indexing="ij"), axis=-1)


def _turn(axis: str, angle: Array) -> Array:
    """Return the rotations (..., 3, 3) about a base axis by angles (...)."""
    i = "xyz".index(axis)
    j, k = (i + 1) % 3, (i + 2) % 3
    cosine, sine = np.cos(angle), np.sin(angle)
    matrix = np.zeros((*angle.shape, 3, 3), dtype=cosine.dtype)
    matrix[..., i, i] = 1.0
    matrix[..., j, j], matrix[..., k, k] = cosine, cosine
    matrix[..., j, k], matrix[..., k, j] = -sine, sine
    return matrix
