"""The cones within which universal and ball joints let their legs swing."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Design, Swing
from explorer.numerics.arrays import FloatArray


@dataclass(frozen=True)
class JointCone:
    """The cone of a joint, about the direction of its leg in the home pose.

    Attributes:
        joint: Name of the joint, such as "a1".
        leg: Number of the leg, 1 to 4.
        axis: Unit direction of the leg in the home pose, from base to platform, shape (3,). It is
            in the platform frame for a ball joint and in the base frame for a universal joint.
            None if the leg has no length at home; no pose satisfies such a cone.
        half_angle: Half-angle in radians.
        in_platform: Whether the axis is in the platform frame.
    """

    joint: str
    leg: int
    axis: FloatArray | None
    half_angle: float
    in_platform: bool


def joint_cones(design: Design) -> tuple[JointCone, ...]:
    """Return the cones of the joints whose swing a design limits."""
    swing = design.limits.swing
    if swing == Swing():
        return ()
    home = design.home_pose
    home_legs = legs(design, np.array(home.position), home.rotation)
    cones: list[JointCone] = []
    for joint in swing.__struct_fields__:
        degrees = getattr(swing, joint)
        if degrees is None:
            continue
        leg = 4 if joint == "a3" else int(joint[1])
        direction = home_legs[leg - 1]
        length = float(np.linalg.norm(direction))
        in_platform = joint.startswith("b")
        axis = direction / length if length > 0.0 else None
        if axis is not None and in_platform:
            axis = home.rotation.T @ axis
        cones.append(JointCone(joint, leg, axis, math.radians(degrees), in_platform))
    return tuple(cones)


def legs(design: Design, position: FloatArray, rotation: FloatArray) -> FloatArray:
    """Return the four legs of a pose as vectors from base to platform, shape (4, 3).

    Legs 2 and 3 start at their carriages, so they are perpendicular to the guide.
    """
    points = Configuration(design, position, rotation).points
    across = np.array([0.0, 1.0, 1.0])
    return np.array([points.b1, points.b2 * across, points.b3 * across, points.b4 - points.a3])


def angle_between(vector: FloatArray, axis: FloatArray) -> FloatArray:
    """Return the angles (...) of vectors (..., 3) and an axis (3,), in radians."""
    across = np.linalg.norm(np.cross(vector, axis), axis=-1)
    return np.asarray(np.arctan2(across, vector @ axis))
