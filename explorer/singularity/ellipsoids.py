"""The ellipsoids of velocities and forces of a pose, and the ball of positions about it.

Since joint rates = J · twist, actuator forces J⁻ᵀ · wrench balance a wrench. So the speed of a
point (b4, or that of the tool) per unit of actuator speed and the actuator force per unit of force
at that point are the same three numbers along the same three directions: the faster the platform,
the weaker it is. The reach makes rotations comparable: it multiplies angular velocities and divides
moments.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Design
from explorer.mechanism.margins import LOST, planes_of_singularity
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray, lengths_of


@dataclass(frozen=True)
class Ellipsoid:
    """The velocity ellipsoid of a pose, and the force ellipsoid reciprocal to it.

    Attributes:
        axes: Principal directions in the base frame, in columns, shape (3, 3), a right-handed
            frame.
        gain: Speed per unit of actuator speed along each axis, which is also the actuator
            force per unit of force; descending, inf in a singular direction, shape (3,).
    """

    axes: FloatArray
    gain: FloatArray

    @property
    def force(self) -> FloatArray:
        """Semi-axes of the ellipsoid of forces that unit actuator force balances, shape (3,)."""
        with np.errstate(divide="ignore"):
            return np.where(np.isinf(self.gain), 0.0, 1.0 / self.gain)


@dataclass(frozen=True)
class Performance:
    """The ellipsoids of a pose, dimensionless.

    Attributes:
        translation: Velocities of the point and forces at it.
        rotation: Angular velocities times the reach, and moments over the reach, at any point.
    """

    translation: Ellipsoid
    rotation: Ellipsoid


@dataclass(frozen=True)
class SingularityFreeBall:
    """The largest ball of positions about a pose, at its orientation, without singularity.

    Attributes:
        radius: Radius in design units; 0 at a singular pose.
        incidence: Number 1, 2 or 3 of the margin whose plane the ball touches.
        touches: Point of contact in the base frame, shape (3,), in design units.
    """

    radius: float
    incidence: int
    touches: FloatArray


def performance(design: Design, pose: Pose, tool: ArrayLike | None = None) -> Performance:
    """Return the ellipsoids of a pose; some axes are infinite if it is singular.

    The point of the velocities and forces is the tool, (3,), in the platform frame; b4 if None.

    Raises:
        InputError: The tool is not finite.
    """
    rates = Configuration.at(design, pose, tool).jacobian / np.repeat([1.0, design.reach], 3)
    _, values, rows = np.linalg.svd(rates)
    is_lost = values <= LOST * values[0]
    inverse = np.divide(1.0, values, out=np.zeros(6), where=~is_lost)
    # Twists by column: those at zero actuator speed, and those per unit of actuator speed.
    return Performance(
        _ellipsoid(rows.T[:3, is_lost], rows.T[:3] * inverse),
        _ellipsoid(rows.T[3:, is_lost], rows.T[3:] * inverse),
    )


def singularity_free_ball(pose: Pose) -> SingularityFreeBall:
    """Return the largest open ball of positions about a pose without a singular position.

    The orientation is fixed. The ball about b4 touches the nearest of the singular planes, so
    it is exact.
    """
    position, planes = np.array(pose.position), planes_of_singularity(pose.rotation)
    lengths = lengths_of(planes)
    # If the lines a1a2 and b2b3 are parallel every position is singular, and δ2 has no plane.
    units = np.divide(planes, lengths[:, None], out=np.zeros((3, 3)), where=lengths[:, None] > LOST)
    heights = units @ position
    index = int(np.abs(heights).argmin())
    touches = position - heights[index] * units[index]
    return SingularityFreeBall(float(abs(heights[index])), index + 1, touches)


def _ellipsoid(free: FloatArray, driven: FloatArray) -> Ellipsoid:
    """Return the ellipsoid of velocities: free ones (3, k) and those per actuator speed (3, 6)."""
    axes, sizes, _ = np.linalg.svd(free @ free.T)
    count = int((sizes > LOST).sum())
    infinite = axes[:, :count]
    projector = np.eye(3) - infinite @ infinite.T
    directions, gains, _ = np.linalg.svd(projector @ driven, full_matrices=False)
    finite = 3 - count
    axes = np.concatenate([infinite, directions[:, :finite]], axis=1)
    if np.linalg.det(axes) < 0.0:
        axes[:, 2] *= -1.0
    return Ellipsoid(axes, np.concatenate([np.full(count, math.inf), gains[:finite]]))
