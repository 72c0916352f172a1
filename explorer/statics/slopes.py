"""Derivatives of J⁻¹ at the tool by the design variables, the yaw of home and the position.

A row of J is (n; a × n) with n the direction of a joint's rate and a the arm from the tool to the
joint's point on the platform. Both have elementary derivatives, and ∂(J⁻¹) = −J⁻¹ (∂J) J⁻¹.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import VARIABLES, Design
from explorer.numerics.arrays import FloatArray, dot
from explorer.statics.equilibrium import twists_of_actuators

PARAMETERS = (*VARIABLES, "yaw", "x", "y", "z")
"""The parameters: the design variables, the yaw of the platform in radians, and b4's position."""

RADIAL = np.array([0.0, 1.0, 1.0])
VERTICAL = np.array([0.0, 0.0, 1.0])


class TwistSlopes(NamedTuple):
    """J⁻¹ at the tool and the lengths of the struts, with their derivatives by `PARAMETERS`.

    Attributes:
        twists: J⁻¹, shape (n, 6, 6).
        by: Derivatives of J⁻¹, shape (n, 10, 6, 6).
        struts: Lengths d2 and d4, shape (n, 2), in design units.
        struts_by: Their derivatives, shape (n, 10, 2).
    """

    twists: FloatArray
    by: FloatArray
    struts: FloatArray
    struts_by: FloatArray


def twist_slopes(design: Design, positions: FloatArray, rotation: FloatArray) -> TwistSlopes:
    """Return J⁻¹ at the design's tool at regular positions, with its derivatives.

    Args:
        design: The manipulator.
        positions: b4 in the base frame, shape (n, 3), in design units.
        rotation: Platform to base, shape (3, 3).

    Raises:
        InputError: A position is not finite.
    """
    tool = np.array(design.tool.position)
    twists = twists_of_actuators(Configuration(design, positions, rotation, tool))
    # Joints' points on the platform and the tool, from b4 along the axes of the base.
    u, v = rotation[:, 0], rotation[:, 1]
    b1, b2, b3 = rotation[:, :2] @ np.array(design.b1), design.b2 * u, design.b3 * u
    still, to_tool = np.zeros(3), rotation @ tool
    offsets = np.array([b1, b2, b2, b3, b3, still])
    arms = offsets - to_tool
    arms_by = _arms_by(u, v, (b1, b2, b3)) - _turned(to_tool)
    from_base = positions[:, None, :] + offsets
    from_base[:, 5, :2] -= design.a3
    from_base_by = _from_base_by(u, v, (b1, b2, b3))
    directions, directions_by = _directions(from_base, from_base_by)
    rows_by = np.concatenate(
        [
            directions_by,
            np.cross(arms_by, directions[:, None]) + np.cross(arms, directions_by),
        ],
        axis=-1,
    )
    by = -(twists[:, None] @ rows_by @ twists[:, None])
    radial = from_base[:, (2, 4)] * RADIAL
    lengths = np.sqrt(dot(radial, radial))
    lengths_by = np.einsum("nki,nqki->nqk", directions[:, (2, 4)], from_base_by[None, :, (2, 4)])
    return TwistSlopes(twists, by, lengths, lengths_by)


def _turned(vector: FloatArray) -> FloatArray:
    """Return the derivatives of a vector fixed to the platform by `PARAMETERS`, (10, 1, 3)."""
    by = np.zeros((len(PARAMETERS), 1, 3))
    by[PARAMETERS.index("yaw"), 0] = np.cross(VERTICAL, vector)
    return by


def _arms_by(
    u: FloatArray, v: FloatArray, points: tuple[FloatArray, FloatArray, FloatArray]
) -> FloatArray:
    """Return the derivatives of the offsets of the six joints from b4, shape (10, 6, 3)."""
    b1, b2, b3 = points
    by = np.zeros((len(PARAMETERS), 6, 3))
    by[PARAMETERS.index("b1x"), 0] = u
    by[PARAMETERS.index("b1y"), 0] = v
    by[PARAMETERS.index("b2"), 1:3] = u
    by[PARAMETERS.index("b3"), 3:5] = u
    for joint, point in enumerate((b1, b2, b2, b3, b3)):
        by[PARAMETERS.index("yaw"), joint] = np.cross(VERTICAL, point)
    return by


def _from_base_by(
    u: FloatArray, v: FloatArray, points: tuple[FloatArray, FloatArray, FloatArray]
) -> FloatArray:
    """Return the derivatives of the vectors to the joints' points, shape (10, 6, 3)."""
    by = _arms_by(u, v, points)
    by[PARAMETERS.index("a3x"), 5, 0] = -1.0
    by[PARAMETERS.index("a3y"), 5, 1] = -1.0
    for axis, name in enumerate("xyz"):
        by[PARAMETERS.index(name), :, axis] = 1.0
    return by


def _directions(from_base: FloatArray, by: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the directions of the joints' rates, (n, 6, 3), and derivatives, (n, 10, 6, 3)."""
    across = np.ones((6, 3))
    across[[2, 4]] = RADIAL
    vectors = from_base * across
    lengths = np.sqrt(dot(vectors, vectors))[..., None]
    directions = vectors / np.maximum(lengths, 1e-300)
    moved = (by * across)[None]
    along = np.einsum("nki,nqki->nqk", directions, moved)[..., None]
    directions_by = (moved - along * directions[:, None]) / np.maximum(lengths, 1e-300)[:, None]
    directions[:, [1, 3]] = (1.0, 0.0, 0.0)
    directions_by[:, :, [1, 3]] = 0.0
    return directions, directions_by
