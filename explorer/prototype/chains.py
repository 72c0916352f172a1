"""The legs as chains of bodies and joints: the angles of a pose, and the bodies' places.

Legs 1 and 4 turn about two axes of a universal joint, fixed at a1 and a3, and then
lengthen. Legs 2 and 3 slide along the guide, turn about it and lengthen. So each leg has
three joints, three bodies behind them and a ball joint at the end.

A body's frame lies at its leg's base joint, a rod's at its ball; the z-axis of cylinders
and rods is the leg, the x-axis of crosses and carriages what is held in the base.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from explorer.mechanism.design import Design
from explorer.mechanism.home import home_pose
from explorer.mechanism.kinematics import attachment_points
from explorer.mechanism.pose import checked_rotation
from explorer.numerics.arrays import FloatArray

LEGS = (1, 2, 3, 4)
ON_GUIDE = (2, 3)
"""The legs that start from carriages."""

CHAIN_JOINTS = (
    *("a1 first", "a1 second", "l1"),
    *("d1", "guide 2", "d2"),
    *("d3", "guide 3", "d4"),
    *("a3 first", "a3 second", "l4"),
)
"""The joints of the four chains, from the base to the platform; angles in radians."""

ACTUATED = (2, 3, 5, 6, 8, 11)
"""Which of them are the joints of the design, in the order of
`explorer.mechanism.design.JOINTS`."""

BODIES = (
    "base",
    *("cross 1", "cylinder 1", "rod 1"),
    *("carriage 2", "cylinder 2", "rod 2"),
    *("carriage 3", "cylinder 3", "rod 3"),
    *("cross 4", "cylinder 4", "rod 4"),
    "platform",
)
"""The bodies that move as one, the base first and the platform last."""

_GUIDE = np.array([False, True, True, False])
_LENGTHS, _FIRST, _SECOND, _CARRIAGES = [2, 5, 8, 11], [0, 4, 7, 9], [1, 10], [3, 6]


class Places(NamedTuple):
    """Where bodies are: points of a body's frame go to `origin + rotation @ point`.

    Attributes:
        origin: In the base frame, in design units, shape (..., 14, 3).
        rotation: To the base frame, shape (..., 14, 3, 3).
    """

    origin: FloatArray
    rotation: FloatArray


@dataclass(frozen=True)
class Chains:
    """How the chains of a design are mounted; it depends on the home pose.

    Attributes:
        design: The manipulator.
        side: +1 if the platform is above the base plane at home, else −1.
        platform_side: +1 if a1 is above the platform plane at home, on the side of the
            platform's z-axis, else −1.
        mounts: Of each leg, base joint to base frame, shape (4, 3, 3): x is the first
            axis, which lies in the base plane, z points to the platform's side.
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
        home = home_pose(design)
        points = attachment_points(design, home.position, home.rotation)
        side = -1 if home.position[2] < 0.0 else 1
        above = -1 if float(home.rotation[:, 2] @ points.b4) > 0.0 else 1
        along = np.diag([1.0, side, side])
        mounts = np.stack([along] * 4)
        for index, leg in ((0, points.b1), (3, points.b4 - points.a3)):
            across = np.array([-leg[1], leg[0], 0.0]) * side
            length = float(np.hypot(across[0], across[1]))
            x = across / length if length > 0.0 else np.array([1.0, 0.0, 0.0])
            z = np.array([0.0, 0.0, float(side)])
            mounts[index] = np.column_stack([x, np.cross(z, x), z])
        return Chains(design, side, above, mounts)

    def joints(self, position: ArrayLike, rotation: ArrayLike) -> FloatArray:
        """Return the joints of all chains in a pose, shape (..., 12), see `CHAIN_JOINTS`.

        Angles are zero where a leg is normal to the base plane. Where a leg lies in the
        first axis of its universal joint the first angle is undefined, and zero.

        Args:
            position: b4 in the base frame, shape (..., 3), in design units.
            rotation: Platform to base, shape (..., 3, 3).

        Raises:
            InputError: a pose that is not finite or not a rotation.
        """
        b = attachment_points(self.design, position, rotation)
        ends = np.stack([b.b1, b.b2, b.b3, b.b4 - b.a3], axis=-2)
        legs = np.where(_GUIDE[:, None], ends * [0.0, 1.0, 1.0], ends)
        x, y, z = np.moveaxis(np.einsum("kji,...kj->...ki", self.mounts, legs), -1, 0)
        found = np.empty((*x.shape[:-1], len(CHAIN_JOINTS)))
        # Adding zero makes a negative zero positive, so that the angle of no leg is zero.
        found[..., _FIRST] = np.arctan2(0.0 - y, z + 0.0)
        across = np.hypot(y, z)
        found[..., _SECOND] = np.arctan2(x, across)[..., [0, 3]]
        found[..., _LENGTHS] = np.hypot(x, across)
        found[..., _CARRIAGES] = ends[..., [1, 2], 0]
        return found

    def places(self, joints: FloatArray, position: ArrayLike, rotation: ArrayLike) -> Places:
        """Return where all bodies are, in the order of `BODIES`.

        Args:
            joints: Of the chains, shape (..., 12); each leg follows from its own alone.
            position: Of the platform, shape (..., 3), in design units.
            rotation: Of the platform, shape (..., 3, 3).

        Raises:
            InputError: not a rotation.
        """
        shape = joints.shape[:-1]
        origin = np.zeros((*shape, len(BODIES), 3))
        turn = np.zeros((*shape, len(BODIES), 3, 3))
        turn[..., 0, :, :] = np.eye(3)
        # The middle one of each leg's three bodies is the cylinder.
        first, cylinder, rod = slice(1, 13, 3), slice(2, 13, 3), slice(3, 13, 3)
        alpha, beta = joints[..., _FIRST], np.zeros((*shape, 4))
        beta[..., [0, 3]] = joints[..., _SECOND]
        turned = self.mounts @ _about_x(alpha)
        turn[..., first, :, :] = np.where(_GUIDE[:, None, None], self.mounts, turned)
        turn[..., cylinder, :, :] = turn[..., rod, :, :] = turned @ _about_y(beta)
        starts = np.zeros((*shape, 4, 3))
        starts[..., 3, :2] = self.design.a3
        starts[..., [1, 2], 0] = joints[..., _CARRIAGES]
        along = turn[..., rod, :, 2] * joints[..., _LENGTHS, None]
        origin[..., first, :] = origin[..., cylinder, :] = starts
        origin[..., rod, :] = starts + along
        origin[..., -1, :], turn[..., -1, :, :] = position, checked_rotation(rotation)
        return Places(origin, turn)

    def places_at(self, position: ArrayLike, rotation: ArrayLike) -> Places:
        """Return where all bodies are in a pose.

        Args:
            position: b4 in the base frame, shape (..., 3), in design units.
            rotation: Platform to base, shape (..., 3, 3).

        Raises:
            InputError: a pose that is not finite or not a rotation.
        """
        return self.places(self.joints(position, rotation), position, rotation)


def _about_x(angle: FloatArray) -> FloatArray:
    c, s, o, i = np.cos(angle), np.sin(angle), np.zeros_like(angle), np.ones_like(angle)
    return np.stack([i, o, o, o, c, -s, o, s, c], axis=-1).reshape(*angle.shape, 3, 3)


def _about_y(angle: FloatArray) -> FloatArray:
    c, s, o, i = np.cos(angle), np.sin(angle), np.zeros_like(angle), np.ones_like(angle)
    return np.stack([c, o, s, o, i, o, -s, o, c], axis=-1).reshape(*angle.shape, 3, 3)
