"""The machine that was built: a design with deviations of its encoders and of its geometry.

Nothing is linear here. Each leg is the one of the design, moved as a whole: legs 1 and 4 with a1
and a3, legs 2 and 3 with the guide, whose tilt is the rotation by the vector (0, y, z) about a1.
Struts 2 and 3 lean along the guide. The ends b1 to b4 lie elsewhere on the platform.

The inverse kinematics is closed. For the forward one, d1 to d4 place b2 and b3 up to a turn α of
all about the guide, and the platform up to a turn γ about the line b2b3. Then l4 gives α, and l1
gives γ, each in closed form if the other turn is known. Neither depends on the other but by the
distances of b4 from that line and of a1 from the guide, which are deviations: a few rounds settle
both, the sooner as the changes of γ are extrapolated as a geometric series.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from explorer.errors import InputError
from explorer.mechanism.design import GUIDE_ROWS, JOINTS, STRUT_ROWS, Design
from explorer.mechanism.kinematics import ForwardKinematics, joint_array
from explorer.mechanism.machine import A1, A3, DIMENSIONS, GUIDE, PLATFORM, STRUTS, TILT
from explorer.mechanism.margins import margins, signs_of
from explorer.mechanism.pose import pose_rows
from explorer.numerics.arrays import BoolArray, FloatArray, IntArray, finite_array, lengths_of

COUNT = len(JOINTS) + len(DIMENSIONS)
"""Number of deviations: six zeros of the encoders, then one for each dimension."""

ROUNDS = 8
"""Most rounds after the first; three do where margins are a hundred times the deviations."""

# Change of a turn, in radians, at which the rounds end, and largest error of the joints of a pose
# that closes, as a share of the reach.
SETTLED, CLOSED = 1e-15, 1e-12


class BuiltPose(NamedTuple):
    """Poses of the platform's frame.

    Attributes:
        position: Positions of its origin in the base frame, shape (..., 3), in design units.
        rotation: Rotations from platform to base, shape (..., 3, 3).
        closes: Whether the legs close, shape (...); if not, the pose means nothing.
    """

    position: FloatArray
    rotation: FloatArray
    closes: BoolArray


@dataclass(frozen=True, eq=False)
class BuiltMachine:
    """A design with the deviations of a machine that was built of it.

    Attributes:
        design: The manipulator.
        deviations: True less read values of the six joints, then deviations of the `DIMENSIONS`,
            shape (31,); none by default. Lengths are in design units, angles in radians.

    Raises:
        InputError: The deviations are not 31 finite numbers.
    """

    design: Design
    deviations: FloatArray = field(default_factory=lambda: np.zeros(COUNT))

    def __post_init__(self) -> None:
        if finite_array("deviations", self.deviations, (COUNT,)).ndim != 1:
            raise InputError("a machine has one set of deviations, not a batch")

    @property
    def encoder_offsets(self) -> FloatArray:
        """True joint values less those that the encoders read, shape (6,), in design units."""
        return self.deviations[:6]

    @property
    def strut_tilts(self) -> FloatArray:
        """Tilts of struts 2 and 3 along the guide, shape (2,), in radians."""
        return self.deviations[6:][STRUTS]

    @cached_property
    def points(self) -> FloatArray:
        """True b1, b2, b3 and b4 in the platform frame, shape (4, 3), in design units."""
        return self.design.platform_points + self.deviations[6:][PLATFORM].reshape(4, 3)

    @cached_property
    def shifts(self) -> FloatArray:
        """Displacements of the four legs' bases, shape (4, 3), in design units."""
        return np.stack([self.deviations[6:][part] for part in (A1, GUIDE, GUIDE, A3)])

    @cached_property
    def turns(self) -> FloatArray:
        """Rotations of the four legs' bases about a1, shape (4, 3, 3)."""
        guide = [0.0, *self.deviations[6:][TILT]]
        return Rotation.from_rotvec([np.zeros(3), guide, guide, np.zeros(3)]).as_matrix()

    @cached_property
    def bases(self) -> FloatArray:
        """True a1 and a3 from the guide's origin along its axes, shape (2, 3), in design units."""
        ends = np.array([(0.0, 0.0), self.design.a3]) @ np.eye(2, 3) + self.shifts[[0, 3]]
        return (ends - self.shifts[1]) @ self.turns[1]

    @cached_property
    def b2b3_frame(self) -> tuple[FloatArray, FloatArray]:
        """Axes along b2b3 and near the platform's y, (3, 3), and b1 and b4 from b2 along them."""
        b1, b2, b3, b4 = self.points
        x = (b3 - b2) * np.sign(b3[0] - b2[0])
        z = np.cross(x, [0.0, 1.0, 0.0])
        axes = np.stack([x, np.cross(z, x), z])
        axes /= lengths_of(axes)[:, None]
        return axes, (np.stack([b1, b4]) - b2) @ axes.T

    @property
    def defects(self) -> FloatArray:
        """Places of a1 beside the guide and of b4 beside the line b2b3, shape (2, 2), in units."""
        return np.stack([self.bases[0, 1:], self.b2b3_frame[1][1, 1:]])

    @property
    def allowance(self) -> float:
        """Most by which a margin of the machine's own flags is not zero in its singular poses.

        Without the defects the machine has exact flags, which are not where they were drawn.
        """
        return float(lengths_of(self.defects).sum())

    def leg_ends(self, position: FloatArray, rotation: FloatArray) -> FloatArray:
        """Return b1 to b4 in n poses in the frames of the bases of their legs, (n, 4, 3)."""
        arms = position[:, None] + self.points @ np.swapaxes(rotation, 1, 2) - self.shifts
        return np.einsum("kji,nkj->nki", self.turns, arms)

    def inverse(self, position: ArrayLike, rotation: ArrayLike) -> FloatArray:
        """Return the joints that the encoders read in poses, shape (..., 6), in design units.

        Positions (..., 3) and rotations (..., 3, 3) are those of the platform's frame.

        Raises:
            InputError: A position is not finite, or a rotation is not one.
        """
        p, r, batch = pose_rows(position, rotation)
        return self._readings(p, r).reshape(*batch, 6)

    def _readings(self, position: FloatArray, rotation: FloatArray) -> FloatArray:
        ends = self.leg_ends(position, rotation)
        joints = np.empty((len(ends), 6))
        joints[:, 0] = lengths_of(ends[:, 0])
        joints[:, 5] = lengths_of(ends[:, 3] - [*self.design.a3, 0.0])
        radii = np.hypot(ends[:, 1:3, 1], ends[:, 1:3, 2])
        joints[:, STRUT_ROWS] = radii / np.cos(self.strut_tilts)
        joints[:, GUIDE_ROWS] = ends[:, 1:3, 0] - radii * np.tan(self.strut_tilts)
        return joints - self.encoder_offsets

    def forward(self, joints: ArrayLike, signs: ArrayLike | None = None) -> BuiltPose:
        """Return the poses in which the encoders read joints (..., 6), in design units.

        They are those of assembly modes, by sign triples (..., 3); None for the one of home.

        Raises:
            InputError: The joints are not usable.
        """
        asked, reach = joint_array(joints), self.design.reach
        triples = np.asarray(self.design.home_signs if signs is None else signs)
        batch = np.broadcast_shapes(asked.shape[:-1], triples.shape[:-1])
        rows = np.broadcast_to(asked, (*batch, 6)).reshape(-1, 6)
        triples = np.broadcast_to(triples, (*batch, 3)).reshape(-1, 3)
        with np.errstate(invalid="ignore", divide="ignore"):
            p, r = self._solve(rows + self.encoder_offsets, triples.T)
            off = np.abs(self._readings(p, r) - rows).max(axis=1)
        closes = np.asarray(off <= CLOSED * np.maximum(reach, np.abs(rows).max(axis=1)))
        p, r = np.where(closes[:, None], p, 0.0), np.where(closes[:, None, None], r, np.eye(3))
        return BuiltPose(p.reshape(*batch, 3), r.reshape(*batch, 3, 3), closes.reshape(batch))

    def modes(self, joints: ArrayLike) -> ForwardKinematics:
        """Return the poses of all eight modes; joints close only if all modes do.

        Arguments and errors are those of `forward`.
        """
        found = self.forward(joint_array(joints)[..., None, :], [*map(signs_of, range(8))])
        return ForwardKinematics(
            found.position, found.rotation, np.asarray(found.closes.all(axis=-1))
        )

    def nominal_commands(self, position: ArrayLike, rotation: ArrayLike) -> BuiltPose:
        """Return the poses to command a controller that knows the design alone, for true ones.

        Each closes if the design has a pose of the same joints in the same mode. Arguments and
        errors are those of `inverse`.
        """
        signs = np.where(margins(position, rotation) > 0.0, 1, -1)
        return BuiltMachine(self.design).forward(self.inverse(position, rotation), signs)

    def _solve(self, joints: FloatArray, signs: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return positions and rotations, (n, 3) and (n, 3, 3), by true joints and signs (3, n)."""
        (a1, a3), (axes, (b1, b4)), tilts = self.bases, self.b2b3_frame, self.strut_tilts
        on_x, to_a3, to_b1 = np.sign([self.design.b3 - self.design.b2, a3[1], b1[1]])
        l1, l4, lengths = joints[:, 0], joints[:, 5], joints[:, STRUT_ROWS]
        x2, x3 = (joints[:, GUIDE_ROWS] + lengths * np.sin(tilts)).T
        r2, r3 = (lengths * np.cos(tilts)).T
        # b2 and b3 along the axes of the guide, turned so that b2 lies at y > 0, z = 0.
        run, span = x3 - x2, self.points[2] - self.points[1]
        c = np.clip((run * run + r2 * r2 + r3 * r3 - span @ span) / (2.0 * r2 * r3), -1.0, 1.0)
        s = -signs[1] * on_x * np.sqrt((1.0 - c) * (1.0 + c))
        b2 = np.stack([x2, r2, np.zeros_like(r2)], axis=1)
        u = on_x * np.stack([run, r3 * c - r2, r3 * s], axis=1)
        u /= lengths_of(u)[:, None]
        # Axes about the line b2b3: γ turns the platform's y from v towards w.
        v = [1.0, 0.0, 0.0] - u[:, :1] * u
        v /= lengths_of(v)[:, None]
        frame = np.stack([u, v, np.cross(u, v)], axis=1)
        alpha = gamma = last = np.zeros_like(r2)
        seen4 = b4 * [1.0, 0.0, 0.0]
        for k in range(1 + ROUNDS):
            end = b2 + np.einsum("ni,nij->nj", _turn(gamma, seen4), frame)
            alpha = _turn_between(end, a3, l4, signs[2] * to_a3)
            a1_seen = np.einsum("nij,nj->ni", frame, _turn(-alpha, a1) - b2)
            new = _turn_between(np.broadcast_to(b1, b2.shape), a1_seen, l1, -signs[0] * to_b1)
            ratio = np.nan_to_num(np.clip((new - gamma) / last, -0.1, 0.1)) if k > 1 else 0.0
            last = new - gamma
            gamma, seen4 = new + last * ratio / (1.0 - ratio), b4
            if np.abs(last).max(initial=0.0) <= SETTLED:
                break
        # The platform's axes turned by γ about u, then all by α, and with the guide.
        turned = _turn(gamma[:, None], np.eye(3)) @ frame
        rotation = self.turns[1] @ np.swapaxes(_turn(alpha[:, None], turned), 1, 2) @ axes
        place = self.shifts[1] + _turn(alpha, b2) @ self.turns[1].T
        return place - rotation @ self.points[1], rotation


def _turn_between(
    point: FloatArray, fixed: FloatArray, length: FloatArray, side: FloatArray
) -> FloatArray:
    """Return the turn about x of a point that brings it to a side of a fixed one, a length away."""
    one, other = (np.hypot(each[..., 1], each[..., 2]) for each in (point, fixed))
    square = length * length - (point[..., 0] - fixed[..., 0]) ** 2 - (one - other) ** 2
    half = np.arcsin(np.sqrt(np.clip(square / (4.0 * one * other), 0.0, 1.0)))
    here, there = (np.arctan2(each[..., 2], each[..., 1]) for each in (point, fixed))
    return there - here + 2.0 * side * half


def _turn(angle: FloatArray, vector: FloatArray) -> FloatArray:
    """Return vectors (..., 3) turned about x by angles (...)."""
    cos, sin = np.cos(angle), np.sin(angle)
    x, y, z = np.moveaxis(vector, -1, 0)
    turned = np.broadcast_arrays(x, cos * y - sin * z, sin * y + cos * z)
    return np.stack(turned, axis=-1)
