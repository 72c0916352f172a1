"""The point of the platform whose position is meant: b4, or the point of the tool."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from explorer.errors import InputError
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose, Triple
from explorer.numerics.arrays import FloatArray, for_kernel, position_array

Point = Literal["b4", "tool"]
"""The point whose position is meant."""


def point_of(design: Design, at: Point) -> Triple:
    """Return a point in the platform frame, in design units; zeros for b4."""
    return design.tool.position if at == "tool" else (0.0, 0.0, 0.0)


def position_of(design: Design, pose: Pose, at: Point) -> Triple:
    """Return the position of a point in the base frame, in design units."""
    return pose.position if at == "b4" else tool_position(pose, point_of(design, at))


def tool_position(pose: Pose, tool: Triple) -> Triple:
    """Return the position of a point of the platform in the base frame, in design units."""
    x, y, z = (np.array(pose.position) + tool_offset(pose.rotation, tool)).tolist()
    return x, y, z


def pose_with(design: Design, at: Point, position: Triple, pose: Pose) -> Pose:
    """Return the pose with the orientation of a pose and a point at a position.

    Args:
        design: The manipulator.
        at: The point that has the position.
        position: Its position in the base frame, in design units.
        pose: The pose with the orientation.

    Raises:
        InputError: The position is not finite, or too far away.
    """
    x, y, z = (np.array(position) - offset_of(design, pose.rotation, at)).tolist()
    return Pose((x, y, z), pose.quaternion)


def offset_of(design: Design, rotation: FloatArray, at: Point) -> FloatArray:
    """Return the vector from b4 to a point along the axes of the base, shape (..., 3).

    Args:
        design: The manipulator.
        rotation: Platform to base, shape (..., 3, 3).
        at: The point.
    """
    return tool_offset(rotation, point_of(design, at))


def one_tool(tool: ArrayLike | None) -> FloatArray:
    """Return one tool point in the platform frame (3,) after checking it; that of b4 if None.

    Raises:
        InputError: The point is not finite, or there are several.
    """
    if tool is None:
        return np.zeros(3)
    t = position_array("tool", tool)
    if t.ndim != 1:
        raise InputError(f"give one tool point, three numbers; got the shape {t.shape}")
    return for_kernel(t)


def tool_offset(rotation: FloatArray, tool: ArrayLike | None) -> FloatArray:
    """Return the vector from b4 to a tool point along the axes of the base, shape (..., 3).

    Args:
        rotation: Platform to base, shape (..., 3, 3).
        tool: Tool point in the platform frame, shape (..., 3), in design units; None for b4.

    Raises:
        InputError: The tool is not finite.
    """
    t = np.zeros(3) if tool is None else position_array("tool", tool)
    return np.asarray((rotation @ t[..., None])[..., 0])
