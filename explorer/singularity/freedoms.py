"""Motions of the flags: six that change one margin, those that a singular pose frees, and gaps.

On the axes of each of the two frames there are three uncoupled motions: the translation along x
moves the flag's point on its line, the rotation about x turns its plane about the line, and the
rotation about z turns its line in the plane. Each leaves the other two elements of the flag.

The mechanism folds along three lines (`explorer.mechanism.folds`). Where the fold along one is
flat, and no leg has length zero, a turn about that line changes no joint at first order:

- δ1 = 0: a turn about the line b2b3. Legs 2 to 4 end on it, and leg 1 lies in the platform plane
  with it.
- δ2 = 0: a turn about the line a1b4. Legs 2 and 3 push within the plane of the lines a1a2 and b2b3,
  in which it lies; it meets leg 1 at a1 and leg 4 at b4.
- δ3 = 0: a turn about the guide. Legs 1 to 3 meet it, and leg 4 lies in the base plane with it.

These are pure turns: the pitch is zero. Where one incidence holds, the turn is the only freedom.
Where several hold there may be more freedoms, and combinations of two turns about skew lines are
screws. A leg of length zero holds its end in every direction, so that there may be no freedom.

A gap is the shortest segment from an element of the base flag to one of the platform flag: from a1
to the platform plane (δ1), between the lines a1a2 and b2b3 (δ2), and from the base plane to b4
(δ3). The mechanism is singular where one of them closes, or where the two lines are parallel.

A least turn is one about b4 or about a1, the points of the two flags, and about any axis through
them. Each incidence is then the meeting of a line and a plane of which the turn moves one and
leaves the other, so that the least turn is the angle between the two, and its sine is the margin
over a length: δ1 and δ3 over |a1 b4|, δ2 over the distance of b4 from the guide (a turn about b4)
or of a1 from the line b2b3 (a turn about a1). Uncoupled rotations are no shorter.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from explorer.errors import InputError
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import LENGTH_ROWS
from explorer.mechanism.folds import FOLD_LINES
from explorer.mechanism.margins import ROUNDING, margins
from explorer.mechanism.pose import Pose, rotation_array
from explorer.numerics.arrays import FloatArray, dot, lengths_of, position_array, triple
from explorer.singularity.strata import incidences, stratum_of


@dataclass(frozen=True)
class UncoupledMotion:
    """A motion along or about an axis of a frame that changes one margin and no other.

    The axis passes through b4 (platform) or a1 (base); the incidence is the number 1, 2 or 3 of the
    margin that changes.
    """

    frame: Literal["platform", "base"]
    kind: Literal["translation", "rotation"]
    axis: Literal["x", "z"]
    incidence: int

    @property
    def name(self) -> str:
        """The motion's name, such as "along the platform's x"."""
        how = "along" if self.kind == "translation" else "about"
        return f"{how} the {self.frame}'s {self.axis}"

    def line(self, pose: Pose) -> tuple[FloatArray, FloatArray]:
        """Return a point on the axis and its unit direction, shape (3,) each, in the base frame."""
        unit = np.eye(3)["xyz".index(self.axis)]
        if self.frame == "base":
            return np.zeros(3), unit
        return np.array(pose.position), pose.rotation @ unit

    def move(self, pose: Pose, amount: float) -> Pose:
        """Return a pose after the motion by a distance in design units or an angle in radians."""
        if not math.isfinite(amount):
            raise InputError(f"a motion {self.name} needs a finite amount; got {amount}")
        point, direction = self.line(pose)
        if self.kind == "translation":
            return Pose(triple(np.array(pose.position) + amount * direction), pose.quaternion)
        return pose.turn(point, amount * direction)


UNCOUPLED = (
    UncoupledMotion("platform", "rotation", "x", 1),
    UncoupledMotion("platform", "rotation", "z", 2),
    UncoupledMotion("platform", "translation", "x", 3),
    UncoupledMotion("base", "translation", "x", 1),
    UncoupledMotion("base", "rotation", "z", 2),
    UncoupledMotion("base", "rotation", "x", 3),
)
"""The six motions: three of each frame, in the order of the margins that they change."""


# Joint rates of a twist of length one, and changes of joints, with lengths over the reach, that
# count as zero; a pose is singular to 1e-9 of the reach.
ZERO = 1e-7


@dataclass(frozen=True)
class FreeTurn:
    """A turn about a line that changes no joint at first order.

    Attributes:
        incidence: Number 1, 2 or 3 of the incidence that frees it.
        point: Point of the line in the base frame, shape (3,), in design units: b4 of the line
            b2b3, a1 of the others.
        direction: Unit vector along the line in the base frame, shape (3,).
        is_finite: Whether it changes no joint at any angle, to rounding.
    """

    incidence: int
    point: FloatArray
    direction: FloatArray
    is_finite: bool

    @property
    def line_name(self) -> str:
        """The name of the line."""
        return f"the {FOLD_LINES[self.incidence - 1]}"

    def move(self, pose: Pose, angle: float) -> Pose:
        """Return a pose after the turn by an angle in radians."""
        return pose.turn(self.point, angle * self.direction)


@dataclass(frozen=True)
class Freedoms:
    """The freedoms of the platform with all actuators locked.

    Attributes:
        count: Number of independent freedoms; 0 unless the pose is singular.
        turns: Independent turns among them, at most one for each incidence, in the order δ1, δ3,
            δ2, since the line a1b4 may be one of the others.
    """

    count: int
    turns: tuple[FreeTurn, ...]


def freedoms(configuration: Configuration) -> Freedoms:
    """Return the freedoms that one pose leaves the platform with all actuators locked.

    The tool point of the configuration is b4. Incidences hold to 1e-9 of the reach
    (`explorer.singularity.strata`), and rates below 1e-7 of the reach count as zero.
    """
    c, p, r = configuration, configuration.position, configuration.rotation
    reach = c.design.reach
    holding = incidences(stratum_of(c))
    if not holding:
        return Freedoms(0, ())
    a1, distance = np.zeros(3), float(lengths_of(p))
    lines = {1: (p, r[:, 0]), 3: (a1, np.array([1.0, 0.0, 0.0]))}
    # Where a1 and b4 coincide they have no line.
    if distance > ZERO * reach:
        lines[2] = a1, p / distance
    locked = _locked_rates(c)
    turns: list[FreeTurn] = []
    twists: list[FloatArray] = []
    for incidence, (point, direction) in lines.items():
        if incidence not in holding:
            continue
        twist = np.concatenate([np.cross(direction, p - point) / reach, direction])
        twist /= np.linalg.norm(twist)
        is_free = np.abs(locked @ twist).max() <= ZERO
        # The line a1b4 is the line b2b3 where a1 is on that one, the guide where b4 is.
        if is_free and np.linalg.matrix_rank(np.array([*twists, twist]), ZERO) > len(twists):
            # Joints depend on the cosine of the angle alone, so that half a turn is the test.
            half = 2.0 * np.outer(direction, direction) - np.eye(3)
            there = Configuration(c.design, point + half @ (p - point), half @ r)
            change = np.abs(there.joints - c.joints).max()
            turns.append(FreeTurn(incidence, point, direction, bool(change <= ZERO * reach)))
            twists.append(twist)
    # A nearly degenerate design has singular values near the limit.
    return Freedoms(max(len(_free(locked)), len(turns)), tuple(turns))


def free_twists(configuration: Configuration) -> FloatArray:
    """Return a basis of the twists that locked actuators leave the platform in one pose.

    It has the shape (n, 6), with n = 0 unless the pose is singular: the velocity of b4 over the
    reach, and the angular velocity, base axes, of length one together. Tolerances are those of
    `freedoms`.
    """
    if not incidences(stratum_of(configuration)):
        return np.empty((0, 6))
    return _free(_locked_rates(configuration))


def _free(locked: FloatArray) -> FloatArray:
    """Return a basis of the twists without any of these rates, shape (n, 6)."""
    _, values, twists = np.linalg.svd(locked)
    return twists[values <= ZERO]


def _locked_rates(c: Configuration) -> FloatArray:
    """Return the rates that locked actuators hold at zero by the twist (v over the reach; ω).

    They are those of joints and of ends of legs of length zero, shape (6 or more, 6).
    """
    rows = [c.jacobian]
    for arm, length in zip(c.joint_arms[LENGTH_ROWS], c.leg_lengths, strict=True):
        if length <= ZERO * c.design.reach:
            # The columns are those of v + ω × arm.
            x, y, z = arm.tolist()
            turning = np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])
            rows.append(np.hstack([np.eye(3), turning]))
    return np.vstack(rows) / np.repeat([1.0, c.design.reach], 3)


@dataclass(frozen=True)
class FlagGaps:
    """The three gaps of a pose, in the order δ1, δ2, δ3, in design units.

    Attributes:
        base: Ends on a1, the line a1a2 and the base plane, in the base frame, shape (3, 3).
        platform: Ends on the platform plane, the line b2b3 and b4, in the base frame, shape (3, 3).
        lengths: Lengths: |δ1|, the distance of the lines and |δ3|. That of the lines is |δ2| over
            the sine between them. Of parallel lines the gap is the common perpendicular through b4.
    """

    base: FloatArray
    platform: FloatArray
    lengths: tuple[float, float, float]


def flag_gaps(position: FloatArray, rotation: FloatArray) -> FlagGaps:
    """Return the gaps of a pose."""
    x, y, z = position.tolist()
    height = float(rotation[:, 2] @ position)
    along, uy, uz = rotation[:, 0].tolist()
    sine = math.hypot(uy, uz)
    if sine <= ROUNDING:
        on_line = (x, y, z)
        on_guide, distance = (x, 0.0, 0.0), math.hypot(y, z)
    else:
        ny, nz = -uz / sine, uy / sine
        apart = ny * y + nz * z
        # Way from b4 along b2b3 to the point closest to the guide.
        way = -(y * uy + z * uz) / sine / sine
        on_guide = (x + way * along, 0.0, 0.0)
        on_line = (on_guide[0], apart * ny, apart * nz)
        distance = abs(apart)
    base = np.array([(0.0, 0.0, 0.0), on_guide, (x, y, 0.0)])
    platform = np.array([height * rotation[:, 2], on_line, (x, y, z)])
    return FlagGaps(base, platform, (abs(height), distance, abs(z)))


def least_turns(position: ArrayLike, rotation: ArrayLike) -> FloatArray:
    """Return the least turns to δ1 = 0, δ2 = 0 and δ3 = 0, shape (..., 3), in radians.

    They are from 0, for a pose that has the incidence, to a quarter turn. Arguments and errors are
    those of `explorer.mechanism.margins.margins`.
    """
    p, r = position_array("position", position), rotation_array(rotation)
    line = r[..., :, 0]
    from_line = np.cross(line, p)
    distance = np.sqrt(dot(p, p))
    arm = np.maximum(np.hypot(p[..., 1], p[..., 2]), np.sqrt(dot(from_line, from_line)))
    sizes = np.abs(margins(p, r))
    arms = np.stack(np.broadcast_arrays(distance, arm, distance), axis=-1)
    sines = np.divide(sizes, arms, out=np.zeros(sizes.shape), where=arms > 0.0)
    return np.arcsin(np.minimum(sines, 1.0))
