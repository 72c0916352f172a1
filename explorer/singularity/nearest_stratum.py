"""The nearest pose in each stratum of codimension one or more.

The conditions of a stratum leave three, two, one or no angles of the rotation free, and b4 must
lie on a plane or a line through a1, or on a1 itself. The best position is then a projection, and
the squared distance a smooth function of the angles: Newton's method refines its local minima on a
grid. It is L + s S², where L and S are linear in the cosine and the sine of each angle, so that one
array of coefficients gives the value and all derivatives, for all strata at once.

The three strata of codimension one have an exact solution in `explorer.singularity.nearest`.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from explorer.errors import InputError
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray
from explorer.singularity.nearest import PlatformPoints, displacement, nearest_singularities
from explorer.singularity.strata import (
    OF_INCIDENCES,
    STRATA,
    Stratum,
    codimension,
    is_below,
    stratum_of,
)

X, _, Z = np.eye(3)
# Directions of lines and normals of planes that contain b4, and which of these the platform has.
_AXES = {"platform": Z, "base": Z, "u": X, "guide": X}
_ON_PLATFORM, _PLANES = ("platform", "u"), ("platform", "base")


@dataclass(frozen=True)
class NearestInStratum:
    """The nearest pose in the closure of a stratum.

    The distance is the root-mean-square displacement of b1 to b4, in design units. At the tolerance
    of incidences the pose may lack one that its other incidences imply.
    """

    stratum: Stratum
    distance: float
    pose: Pose


@dataclass(frozen=True)
class _Closure:
    """The closure of a stratum as conditions on the rotation and on b4.

    The rotation is the product of turns about the base axes in their order, times one of the half
    turns `flips`, "" for none. The place of b4 is a line through a1, which is "u" (b2b3), "guide"
    or "node" (where the planes intersect), the plane "platform" or "base" through a1, or "a1".
    """

    axes: str
    flips: tuple[str, ...]
    place: str


_FREE = ("zxz", ("",))
# The guide parallel to the platform plane; the line b2b3 parallel to the base plane.
_GUIDE_ALONG, _LINE_ALONG = ("xz", ("",)), ("zx", ("",))
_PARALLEL_PLANES, _PARALLEL_LINES = ("z", ("", "x")), ("x", ("", "z"))
_PARALLEL_FLAGS = ("", ("", "x", "y", "z"))

_CLOSURES: Mapping[Stratum, _Closure] = {
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
"""The closures of all strata of codimension two or more."""


def nearest_in_stratum(design: Design, pose: Pose, asked: Stratum) -> NearestInStratum:
    """Return the nearest pose in the closure of a stratum; the pose itself if it lies in it.

    Raises:
        InputError: The stratum asked for is no permutation of (1, 2, 3, 4).
    """
    w = tuple(asked)
    if w not in STRATA:
        raise InputError(f"a stratum is a permutation of (1, 2, 3, 4); got {w}")
    return nearest_in_strata(design, pose, (w,))[w]


def nearest_in_strata(
    design: Design, pose: Pose, strata: Sequence[Stratum] = STRATA
) -> Mapping[Stratum, NearestInStratum]:
    """Return the nearest pose in the closure of each stratum, by stratum."""
    here = stratum_of(Configuration.at(design, pose))
    found = {w: NearestInStratum(w, 0.0, pose) for w in strata if is_below(here, w)}
    apart = [w for w in strata if w not in found]
    if not apart:
        return found
    special = [w for w in apart if codimension(w) > 1]
    nearest = dict(zip(special, _nearest_poses(design, pose, special), strict=True))
    exact: dict[Stratum, float] = {}
    if len(special) < len(apart):
        for w, singular in zip(OF_INCIDENCES, nearest_singularities(design, pose), strict=True):
            if w in apart:
                nearest[w], exact[w] = singular.pose, float(singular.distance)
    positions = np.array([each.position for each in nearest.values()])
    rotations = np.array([each.rotation for each in nearest.values()])
    ways = displacement(design, pose.position, pose.rotation, positions, rotations)
    for (w, goal), way in zip(nearest.items(), ways, strict=True):
        found[w] = NearestInStratum(w, exact.get(w, float(way)), goal)
    return {w: found[w] for w in strata}


@dataclass(frozen=True)
class _Target:
    """The pose to approximate; the unit of length is `PlatformPoints.length`.

    It is the centroid of the points in the platform frame, the same in the base frame (`goal`),
    and the product R M of rotation and scatter.
    """

    centroid: FloatArray
    goal: FloatArray
    rotated_scatter: FloatArray

    def position(self, place: str, angles: FloatArray, rotation: FloatArray) -> FloatArray:
        """Return the best position (3,) at angles (3,) and their rotation (3, 3)."""
        free = self.goal - rotation @ self.centroid
        if place == "a1":
            return np.zeros(3)
        if place == "node":
            # The first turn is about the base's normal, the second about this line.
            axis = np.array([math.cos(angles[0]), math.sin(angles[0]), 0.0])
        else:
            axis = rotation @ _AXES[place] if place in _ON_PLATFORM else _AXES[place]
        along = float(free @ axis) * axis
        return free - along if place in _PLANES else along

    def coefficients(self, closure: _Closure, flip: str) -> tuple[FloatArray, float]:
        """Return the coefficients (2, 3, 3, 3) of L and S in the squared distance, and s.

        Each of the last three axes belongs to an angle, with the coefficients of its cosine, of
        its sine and of 1.
        """
        basis = _rotation_coefficients(closure.axes, flip)
        goal, centroid, place = self.goal, self.centroid, closure.place
        square = np.zeros((3, 3, 3))
        if place in _PLANES:
            # Across a plane only the distance from it counts.
            sign, matrix, constant = 1.0, self.rotated_scatter, 2.0
        else:
            # Along a line the distance from a1 to the projection does not count.
            sign = 0.0 if place == "a1" else -1.0
            matrix = self.rotated_scatter + np.outer(goal, centroid)
            constant = 2.0 + float(goal @ goal + centroid @ centroid)
        if place == "node":
            square[0, 2, 2], square[1, 2, 2] = goal[0], goal[1]
            square[2, 2, 0], square[2, 2, 1] = -centroid[0], centroid[1]
        elif place in _ON_PLATFORM:
            square = _contract(basis, np.outer(goal, _AXES[place]))
            square[2, 2, 2] -= _AXES[place] @ centroid
        elif place != "a1":
            square = -_contract(basis, np.outer(_AXES[place], centroid))
            square[2, 2, 2] += _AXES[place] @ goal
        linear = -2.0 * _contract(basis, matrix)
        linear[2, 2, 2] += constant
        return np.stack([linear, square]), sign


def _contract(basis: FloatArray, matrix: FloatArray) -> FloatArray:
    return np.einsum("abcij,ij->abc", basis, matrix)


@functools.cache
def _rotation_coefficients(axes: str, flip: str) -> FloatArray:
    """Return the coefficients of cosine, sine and 1 of each entry of turns, (3, 3, 3, 3, 3)."""
    turns: list[FloatArray] = []
    for unit in (np.eye(3)["xyz".index(axis)] for axis in axes):
        along = np.outer(unit, unit)
        turns.append(np.array([np.eye(3) - along, np.cross(unit, np.eye(3)).T, along]))
    still = np.zeros((3, 3, 3))
    still[2] = np.eye(3)
    first, second, third = turns + [still] * (ANGLES - len(turns))
    half = 2.0 * np.diag(np.eye(3)["xyz".index(flip)]) - np.eye(3) if flip else np.eye(3)
    return np.einsum("aij,bjk,ckl,lm->abcim", first, second, third, half)


def _nearest_poses(design: Design, pose: Pose, strata: Sequence[Stratum]) -> list[Pose]:
    platform = PlatformPoints.of(design)
    unit, rotation = platform.length, pose.rotation
    centroid = platform.centroid / unit
    goal = np.array(pose.position) / unit + rotation @ centroid
    target = _Target(centroid, goal, rotation @ platform.scatter / unit**2)
    problems = [(w, flip) for w in strata for flip in _CLOSURES[w].flips]
    if not problems:
        return []
    terms = [target.coefficients(_CLOSURES[w], flip) for w, flip in problems]
    starts = [
        grid_minima(*each, len(_CLOSURES[w].axes))
        for each, (w, _) in zip(terms, problems, strict=True)
    ]
    which = np.repeat(np.arange(len(problems)), [len(each) for each in starts])
    coefficients = np.array([each for each, _ in terms])[which]
    angles = np.concatenate(starts)
    value = minimise(coefficients, np.array([each for _, each in terms])[which], angles)
    best: dict[Stratum, Pose] = {}
    for index in np.argsort(value, kind="stable").tolist():
        w, flip = problems[which[index]]
        if w not in best:
            closure, at = _CLOSURES[w], angles[index]
            basis = _rotation_coefficients(closure.axes, flip)
            turn = np.einsum("abcij,a,b,c->ij", basis, *powers_of(at)[:, 0])
            best[w] = Pose.of(unit * target.position(closure.place, at, turn), turn)
    return [best[w] for w in strata]


# Number of grid angles in a turn, largest number of Newton steps, and the last step in radians.
GRID, STEPS, LAST_STEP = 12, 60, 1e-12
ANGLES = 3
"""Largest number of angles."""

# Relative rounding error of a value.
ROUNDING = 1e-15
# Orders of derivatives by each angle, of the gradient and of the Hessian.
_ORDERS = np.eye(ANGLES, dtype=np.int64)
FIRST = tuple(_ORDERS.T)
SECOND = tuple(np.moveaxis(_ORDERS[:, None] + _ORDERS, -1, 0))


def grid_minima(coefficients: FloatArray, sign: float, count: int) -> FloatArray:
    """Return the angles (n, 3) of local minima of a squared distance on a grid over all turns.

    For two angles these are the minima along either angle alone: far from a1 the value has
    valleys too narrow for the grid to locate the lowest point of their floor. For three
    angles there would be too many.
    """
    turn = np.linspace(0.0, 2.0 * math.pi, GRID, endpoint=False)
    powers = powers_of(turn)[:, 0]
    grids = [powers] * count + [powers[:1]] * (ANGLES - count)
    linear, square = coefficients
    for grid in reversed(grids):
        linear, square = (np.moveaxis(each @ grid.T, -1, 0) for each in (linear, square))
    value = linear + sign * square**2
    if count == 0:
        return np.zeros((1, ANGLES))
    along = [
        (value <= np.roll(value, 1, axis=axis)) & (value <= np.roll(value, -1, axis=axis))
        for axis in range(count)
    ]
    low = np.any(along, axis=0) if count == 2 else np.all(along, axis=0)
    return turn[np.argwhere(low)]


def minimise(coefficients: FloatArray, sign: FloatArray, angles: FloatArray) -> FloatArray:
    """Lower squared distances by Newton's method: change the angles (n, 3), return the values."""
    value, slope, curvature = derivatives(coefficients, sign, angles)
    rounding = ROUNDING * np.abs(coefficients[:, 0]).sum(axis=(1, 2, 3))
    damping = np.zeros(len(angles))
    active = np.arange(len(angles))
    for _ in range(STEPS):
        curvatures, axes = np.linalg.eigh(curvature[active])
        # The step descends even if the value is not convex, and is short if it is flat.
        curvatures = np.maximum(np.abs(curvatures), 1e-9) + damping[active, None]
        along = (np.swapaxes(axes, -1, -2) @ slope[active, :, None])[..., 0] / curvatures
        step = -(axes @ along[..., None])[..., 0]
        longest = np.abs(step).max(axis=-1)
        step *= np.minimum(1.0, 0.5 / np.maximum(longest, 1e-300))[:, None]
        trial = angles[active] + step
        moved = derivatives(coefficients[active], sign[active], trial)
        better = moved[0] <= value[active] + rounding[active]
        done = active[better]
        angles[done] = trial[better]
        value[done], slope[done], curvature[done] = (each[better] for each in moved)
        old = damping[active]
        damping[active] = np.where(better, 0.1 * old, np.maximum(10.0 * old, 1e-2))
        active = active[longest > LAST_STEP]
        if not len(active):
            break
    return value


def derivatives(
    coefficients: FloatArray, sign: FloatArray, angles: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return values (n,), gradients (n, 3) and Hessians (n, 3, 3) of squared distances.

    The coefficients of L and S are of shape (n, 2, 3, 3, 3), the signs s of S² of shape (n,).
    """
    count = len(angles)
    powers = np.swapaxes(powers_of(angles), -1, -2)
    # Each product replaces the last axis by orders of derivatives, and puts it first.
    result = coefficients.reshape(count, 2, 9, 3)
    for angle in (2, 1, 0):
        product = result.reshape(count, -1, 3) @ powers[:, angle]
        result = np.moveaxis(product.reshape(count, 2, 9, 3), 3, 2)
    result = result.reshape(count, 2, 3, 3, 3)
    linear, square = result[:, 0], result[:, 1]
    base = square[:, 0, 0, 0]
    first = square[:, *FIRST]
    value = linear[:, 0, 0, 0] + sign * base**2
    slope = linear[:, *FIRST] + 2.0 * (sign * base)[:, None] * first
    curvature = linear[:, *SECOND] + 2.0 * sign[:, None, None] * (
        base[:, None, None] * square[:, *SECOND] + first[:, :, None] * first[:, None, :]
    )
    return value, slope, curvature


def powers_of(angles: FloatArray) -> FloatArray:
    """Return cosine, sine and 1 of angles (...), and two derivatives of each, (..., 3, 3)."""
    cosine, sine = np.cos(angles), np.sin(angles)
    powers = np.zeros((*angles.shape, 3, 3))
    powers[..., 0, 0], powers[..., 0, 1], powers[..., 0, 2] = cosine, sine, 1.0
    powers[..., 1, 0], powers[..., 1, 1] = -sine, cosine
    powers[..., 2, 0], powers[..., 2, 1] = -cosine, -sine
    return powers
