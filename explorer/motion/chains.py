"""The legs as chains of bodies and joints: joint values and the bodies' placements in a pose.

Legs 1 and 4 have a universal joint, fixed at a1 and a3, and a prismatic actuator. Legs 2 and 3
have a carriage on the guide, a revolute about it and a prismatic actuator. So each leg has
three joints, three bodies, and a ball joint at its end.

The origin of a body's frame is its leg's base joint, that of a rod's frame its ball. The z-axis
of cylinders and rods points along the leg; the x-axis of crosses and carriages is the axis that
the base holds.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Design
from explorer.mechanism.pose import quaternion_from_rotation, rotation_array
from explorer.numerics.arrays import FloatArray

LEGS = (1, 2, 3, 4)
ON_GUIDE = (2, 3)
"""The legs whose base joint is a carriage on the guide."""

CHAIN_JOINTS = (
    *("a1 first", "a1 second", "l1"),
    *("d1", "guide 2", "d2"),
    *("d3", "guide 3", "d4"),
    *("a3 first", "a3 second", "l4"),
)
"""The joints of the four chains, from the base to the platform; angles in radians."""

ACTUATED = (2, 3, 5, 6, 8, 11)
"""Indices of those chain joints that are the design's, in the order of
`explorer.mechanism.design.JOINTS`."""

BODIES = (
    "base",
    *("cross 1", "cylinder 1", "rod 1"),
    *("carriage 2", "cylinder 2", "rod 2"),
    *("carriage 3", "cylinder 3", "rod 3"),
    *("cross 4", "cylinder 4", "rod 4"),
    "platform",
)
"""The rigid bodies, the base first and the platform last."""

_GUIDE = np.array([False, True, True, False])
_LENGTHS, _FIRST, _SECOND, _CARRIAGES = [2, 5, 8, 11], [0, 4, 7, 9], [1, 10], [3, 6]


def joints_of_leg(joints: FloatArray, leg: int) -> FloatArray:
    """Return the three joint values of a leg, the last of them its length, shape (..., 3)."""
    return joints[..., 3 * leg - 3 : 3 * leg]


class Places(NamedTuple):
    """Placements of bodies: a point of a body's frame lies at `origin + rotation @ point`.

    Attributes:
        origin: Origins of the bodies' frames in the base frame, in design units, shape
            (..., 14, 3).
        rotation: Rotations from the bodies' frames to the base frame, shape (..., 14, 3, 3).
    """

    origin: FloatArray
    rotation: FloatArray

    def within(self, body: int, outer: int) -> tuple[FloatArray, FloatArray]:
        """Return origin (3,) and quaternion (w, x, y, z) of a body in the frame of another one."""
        turn = self.rotation[outer].T
        offset = turn @ (self.origin[body] - self.origin[outer])
        return offset, quaternion_from_rotation(turn @ self.rotation[body])


@dataclass(frozen=True)
class Chains:
    """The mounting of a design's chains; it depends on the home pose.

    Attributes:
        design: The manipulator.
        side: Side of the base plane on which the platform is at home, +1 above, else −1.
        platform_side: Side of the platform plane on which a1 is at home, +1 on the side of
            the platform's z-axis, else −1.
        mounts: Rotations from each leg's base joint to the base frame, shape (4, 3, 3): x is
            the joint's first axis, in the base plane; z points to the platform's side.
    """

    design: Design
    side: int
    platform_side: int
    mounts: FloatArray

    @staticmethod
    def of(design: Design) -> Chains:
        """Return the chains of a design.

        The first axis of a universal joint is perpendicular to the leg at home.
        """
        home = design.home_pose
        points = Configuration.at(design, home).points
        side = -1 if home.position[2] < 0.0 else 1
        above = -1 if float(home.rotation[:, 2] @ points.b4) > 0.0 else 1
        along = np.diag([1.0, side, side])
        mounts = np.stack([along] * 4)
        for index, leg in ((0, points.b1), (3, points.b4 - points.a3)):
            across = np.array([-leg[1], leg[0], 0.0]) * side
            x = across / np.linalg.norm(across) if across.any() else np.array([1.0, 0.0, 0.0])
            z = np.array([0.0, 0.0, float(side)])
            mounts[index] = np.column_stack([x, np.cross(z, x), z])
        return Chains(design, side, above, mounts)

    def joints(self, position: ArrayLike, rotation: ArrayLike) -> FloatArray:
        """Return the joint values of all chains in a pose, shape (..., 12), as `CHAIN_JOINTS`.

        Angles are zero where a leg is normal to the base plane. Where a leg lies along the first
        axis of its universal joint, the first angle is undefined and is set to zero. The position
        of b4, (..., 3), is in design units, the rotation (..., 3, 3) from platform to base.

        Raises:
            InputError: A pose that is not finite or not a rotation.
        """
        c = Configuration(self.design, position, rotation)
        x, y, z = np.moveaxis(np.einsum("kji,...kj->...ki", self.mounts, c.legs), -1, 0)
        joint_values = np.empty((*x.shape[:-1], len(CHAIN_JOINTS)))
        # Adding zero makes a negative zero positive, so that a leg of no length has the angle zero.
        joint_values[..., _FIRST] = np.arctan2(0.0 - y, z + 0.0)
        across = np.hypot(y, z)
        joint_values[..., _SECOND] = np.arctan2(x, across)[..., [0, 3]]
        joint_values[..., _LENGTHS] = np.hypot(x, across)
        joint_values[..., 3], joint_values[..., 6] = c.points.b2[..., 0], c.points.b3[..., 0]
        return joint_values

    def places(self, joints: FloatArray, position: ArrayLike, rotation: ArrayLike) -> Places:
        """Return the placements of all bodies in a pose, in the order of `BODIES`.

        A leg depends on its own joint values alone, shape (..., 12).
        """
        shape = joints.shape[:-1]
        origin = np.zeros((*shape, len(BODIES), 3))
        turn = np.zeros((*shape, len(BODIES), 3, 3))
        turn[..., 0, :, :] = np.eye(3)
        # The second of each leg's three bodies is the cylinder.
        first, cylinder, rod = slice(1, 13, 3), slice(2, 13, 3), slice(3, 13, 3)
        alpha, beta = joints[..., _FIRST], np.zeros((*shape, 4))
        beta[..., [0, 3]] = joints[..., _SECOND]
        turned = self.mounts @ _turns(0, alpha)
        turn[..., first, :, :] = np.where(_GUIDE[:, None, None], self.mounts, turned)
        turn[..., cylinder, :, :] = turn[..., rod, :, :] = turned @ _turns(1, beta)
        starts = np.zeros((*shape, 4, 3))
        starts[..., 3, :2] = self.design.a3
        starts[..., [1, 2], 0] = joints[..., _CARRIAGES]
        along = turn[..., rod, :, 2] * joints[..., _LENGTHS, None]
        origin[..., first, :] = origin[..., cylinder, :] = starts
        origin[..., rod, :] = starts + along
        origin[..., -1, :], turn[..., -1, :, :] = position, rotation_array(rotation)
        return Places(origin, turn)

    def places_at(self, position: ArrayLike, rotation: ArrayLike) -> Places:
        """Return the placements of all bodies in a pose; arguments are those of `joints`."""
        return self.places(self.joints(position, rotation), position, rotation)


def _turns(axis: int, angle: FloatArray) -> FloatArray:
    """Return the rotations about an axis of the frame by angles (...), shape (..., 3, 3)."""
    turn = np.zeros((*angle.shape, 3, 3))
    first, second = (axis + 1) % 3, (axis + 2) % 3
    turn[..., axis, axis] = 1.0
    turn[..., first, first] = turn[..., second, second] = np.cos(angle)
    turn[..., second, first], turn[..., first, second] = np.sin(angle), -np.sin(angle)
    return turn
