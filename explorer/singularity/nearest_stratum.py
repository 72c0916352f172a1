"""The nearest pose in each stratum of codimension one or more.

What a stratum asks of the rotation leaves three angles free, or two, one or none; what it then
asks of b4 is that it lies on a plane or a line through a1, or on a1 itself. So the best
position is a projection, and what is left is a smooth function of the angles alone: its local
leasts on a grid are polished by Newton's method, with derivatives by complex steps. The
three strata of codimension one have their exact answer in `explorer.singularity.nearest`.
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

# Real, or complex for a derivative.
Array: TypeAlias = NDArray[Any]

GRID = 12
STEPS = 40
COMPLEX_STEP, HESSIAN_STEP = 1e-40, 1e-5


@dataclass(frozen=True)
class NearestInStratum:
    """The nearest pose in a stratum, or in its closure where that is nearer still.

    Attributes:
        stratum: That which was asked for.
        seen: That of the pose: the same, or one in its closure.
        distance: The root-mean-square way of b1 to b4 to it, in design units.
        pose: The nearest pose.
    """

    stratum: Stratum
    seen: Stratum
    distance: float
    pose: Pose


@dataclass(frozen=True)
class _Closure:
    """The closure of a stratum, by what it asks of the rotation and of b4.

    Attributes:
        axes: Of the base, the rotation is the product of turns about them in this order.
        flips: Times one of these at the right, "" for none: half turns about an axis.
        place: Where b4 is: on the line "u" (b2b3), "guide" or "node" (of both planes),
            on the plane "platform" or "base", or on "a1".
    """

    axes: str
    flips: tuple[str, ...]
    place: str


_FREE = ("zxz", ("",))
# The guide on the direction of the platform plane; the line b2b3 on that of the base.
_GUIDE_ALONG, _LINE_ALONG = ("xz", ("",)), ("zx", ("",))
_PARALLEL_PLANES, _PARALLEL_LINES = ("z", ("", "x")), ("x", ("", "z"))
_PARALLEL_FLAGS = ("", ("", "x", "y", "z"))

_CLOSURES: Mapping[Stratum, _Closure] = MappingProxyType(
    {
        (3, 4, 1, 2): _Closure(*_FREE, "node"),
        (2, 4, 3, 1): _Closure(*_FREE, "u"),
        (4, 1, 3, 2): _Closure(*_FREE, "guide"),
        (1, 4, 3, 2): _Closure(*_FREE, "a1"),
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
"""All strata but the generic one and those of codimension one."""


def nearest_in_stratum(design: Design, pose: Pose, asked: Stratum) -> NearestInStratum:
    """Return the nearest pose in a stratum; the pose itself if that lies in its closure.

    Args:
        design: The manipulator.
        pose: Of its platform.
        asked: A permutation of (1, 2, 3, 4).

    Raises:
        InputError: no such stratum.
    """
    w = tuple(asked)
    if w not in STRATA:
        raise InputError(f"a stratum is a permutation of (1, 2, 3, 4); got {w}")
    here = seen_stratum(design, pose)
    if is_below(here, w):
        return NearestInStratum(w, here, 0.0, pose)
    if codimension(w) == 1:
        nearest = nearest_singularities(design, pose)[OF_INCIDENCES.index(w)]
        found, distance = nearest.pose, nearest.distance
    else:
        found = _nearest(design, pose, _CLOSURES[w])
        distance = float(
            displacement(design, pose.position, pose.rotation, found.position, found.rotation)
        )
    seen = seen_stratum(design, found)
    # Just at the tolerance of incidences, those that imply others need not agree.
    return NearestInStratum(w, seen if is_below(seen, w) else w, distance, found)


def nearest_in_strata(design: Design, pose: Pose) -> Mapping[Stratum, NearestInStratum]:
    """Return the nearest pose in each of the 24 strata."""
    return {w: nearest_in_stratum(design, pose, w) for w in STRATA}


def seen_stratum(design: Design, pose: Pose) -> Stratum:
    """Return the stratum of a pose, to the tolerance that a snapshot has."""
    return tuple(stratum(pose.position, pose.rotation, design.reach).tolist())


@dataclass(frozen=True)
class _Problem:
    """The least way to a closure, in units of the platform's own length.

    Attributes:
        closure: Where to.
        flip: Which of its flips, shape (3, 3).
        centroid: Of the platform's points, in its own frame, shape (3,).
        goal: The same of the pose, in the base frame, shape (3,).
        turned: R M, shape (3, 3): the scatter of the points, turned as the pose is.
    """

    closure: _Closure
    flip: FloatArray
    centroid: FloatArray
    goal: FloatArray
    turned: FloatArray

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
            # The platform turned about the base's normal, then about this line.
            along = _turn("z", angles[..., 0])[..., 0]
        return (free * along).sum(axis=-1, keepdims=True) * along

    def value(self, angles: Array) -> Array:
        """Return the square of the way, shape (...), at angles (..., d)."""
        rotation = self.rotation(angles)
        position = self.position(angles, rotation)
        off = self.goal - rotation @ self.centroid - position
        # No absolute values: it is a function of complex angles, too.
        return 2.0 - 2.0 * (rotation * self.turned).sum(axis=(-2, -1)) + (off * off).sum(axis=-1)

    def slope(self, angles: FloatArray) -> FloatArray:
        """Return the gradient (..., d) at angles (..., d), to the last digits."""
        steps = 1j * COMPLEX_STEP * np.eye(angles.shape[-1])
        return np.imag(self.value(angles[..., None, :] + steps)) / COMPLEX_STEP

    def least(self) -> tuple[float, FloatArray]:
        """Return the least square and its angles (d,)."""
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
            bends, axes = np.linalg.eigh(hessian)
            # Downhill also where it is not convex, and not far where it is nearly flat.
            bends = np.maximum(np.abs(bends), 1e-9) + damping[:, None]
            along = (np.swapaxes(axes, -1, -2) @ slope[..., None])[..., 0] / bends
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
        """Return the angles (n, d) of the local leasts on a grid over all turns.

        Of two angles, those that are least along either alone: far from a1, the value has
        valleys so narrow that a grid does not tell where their floor is lowest. Of three,
        these would be too many.
        """
        grid = _grid(count)
        value = self.value(grid)
        along = [
            (value <= np.roll(value, 1, axis=axis)) & (value <= np.roll(value, -1, axis=axis))
            for axis in range(count)
        ]
        low = np.any(along, axis=0) if count == 2 else np.all(along, axis=0)
        found = grid[low]
        return found[np.argsort(value[low], kind="stable")]


def _nearest(design: Design, pose: Pose, closure: _Closure) -> Pose:
    """Return the nearest pose in a closure, of all its flips."""
    platform = PlatformPoints.of(design)
    unit, rotation = platform.length, pose.rotation
    centroid = platform.centroid / unit
    goal = np.array(pose.position) / unit + rotation @ centroid
    turned = rotation @ platform.scatter / unit**2
    best, found = math.inf, pose
    for flip in closure.flips:
        half_turn = _turn(flip, np.array(math.pi)) if flip else np.eye(3)
        problem = _Problem(closure, half_turn, centroid, goal, turned)
        value, angles = problem.least()
        if value < best:
            turn = problem.rotation(angles)
            best, found = value, Pose.of(unit * problem.position(angles, turn), turn)
    return found


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
