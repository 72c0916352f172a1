"""The configuration: a design in one pose or a batch of poses, with a point of the platform.

Statics, clearances and singularities are asked of one. What follows from it is computed on first
use and kept, so that no two of them compute it twice. Its point may be named: b4 or the tool.
"""

from __future__ import annotations

from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from explorer.errors import InputError
from explorer.mechanism.design import GUIDE_ROWS, LENGTH_ROWS, Design
from explorer.mechanism.margins import margin_rows
from explorer.mechanism.points import AttachmentPoints, joints_of, points_of
from explorer.mechanism.pose import Pose, Triple, rotation_array
from explorer.numerics import arrays
from explorer.numerics.arrays import FloatArray

WITHOUT_TOOL = (
    *("points", "legs", "leg_lengths", "leg_directions", "joints", "margins"),
    *("variables", "positions", "rotations"),
)
"""The properties of a `Configuration` that do not depend on its tool."""


class Conditioning:
    """The conditioning of J in poses.

    Attributes:
        singular_values: Those of J with lengths over the reach, descending, shape (..., 6).
    """

    singular_values: cached_property[FloatArray]

    @property
    def inverse_condition(self) -> FloatArray:
        """The inverse condition number 1/κ of J with lengths over the reach, shape (...)."""
        return self.singular_values[..., -1] / self.singular_values[..., 0]


class Configuration(Conditioning):
    """A design in one pose or in a batch of poses, with a tool point; all are attributes too.

    Args:
        design: The manipulator.
        position: b4 in the base frame, shape (..., 3), in design units.
        rotation: Platform to base, shape (..., 3, 3).
        tool: Tool point in the platform frame, shape (..., 3), in design units; None for b4.

    Raises:
        InputError: The position or the tool is not finite, the rotation is not one, or their
            batch axes do not broadcast.
    """

    def __init__(
        self,
        design: Design,
        position: ArrayLike,
        rotation: ArrayLike,
        tool: ArrayLike | None = None,
    ) -> None:
        self.design = design
        self.position = arrays.position_array("position", position)
        self.rotation = rotation_array(rotation)
        self.tool = np.zeros(3) if tool is None else arrays.position_array("tool", tool)
        self.batch = self.batch_with()

    @staticmethod
    def at(design: Design, pose: Pose, tool: ArrayLike | None = None) -> Configuration:
        """Return the configuration of a design in one pose."""
        return Configuration(design, pose.position, pose.rotation, tool)

    def batch_with(self, *values: FloatArray) -> tuple[int, ...]:
        """Return the batch axes that poses and vectors (..., k) share."""
        own = (self.position, 1), (self.rotation, 2), (self.tool, 1)
        return arrays.batch_shape(*own, *((value, 1) for value in values))

    def spread(self, *values: FloatArray) -> Configuration:
        """Return the configuration with the batch axes that it shares with vectors (..., k)."""
        batch = self.batch_with(*values)
        if batch == self.batch:
            return self
        spread = object.__new__(Configuration)
        spread.design, spread.tool, spread.batch = self.design, self.tool, batch
        spread.position = np.broadcast_to(self.position, (*batch, 3))
        spread.rotation = np.broadcast_to(self.rotation, (*batch, 3, 3))
        return spread

    def with_tool(self, tool: ArrayLike) -> Configuration:
        """Return the configuration with another tool point in the platform frame.

        It keeps what is known of legs, joints and margins, which have no tool.
        """
        if np.array_equal(self.tool, tool):
            return self
        moved = object.__new__(Configuration)
        moved.design, moved.position, moved.rotation = self.design, self.position, self.rotation
        moved.tool = arrays.position_array("tool", tool)
        moved.batch = moved.batch_with()
        if moved.batch == self.batch:
            known = {name: self.__dict__[name] for name in WITHOUT_TOOL if name in self.__dict__}
            moved.__dict__.update(known)
        return moved

    @cached_property
    def points(self) -> AttachmentPoints:
        """The attachment points in the base frame, each of shape (..., 3), in design units."""
        return points_of(self.design.variables, self.design.a2x, self.position, self.rotation)

    @cached_property
    def legs(self) -> FloatArray:
        """The legs as vectors from base to platform, shape (..., 4, 3), in design units."""
        return self.points.legs()

    @cached_property
    def leg_lengths(self) -> FloatArray:
        """The lengths l1, d2, d4 and l4 of the legs, shape (..., 4), in design units."""
        return arrays.lengths_of(self.legs)

    @cached_property
    def leg_directions(self) -> FloatArray:
        """The unit vectors of the legs, shape (..., 4, 3); zero for a leg without a length."""
        lengths = self.leg_lengths[..., None]
        return np.divide(self.legs, lengths, out=np.zeros_like(self.legs), where=lengths > 0.0)

    @cached_property
    def joints(self) -> FloatArray:
        """The joints (l1, d1, d2, d3, d4, l4), shape (..., 6), in design units."""
        return joints_of(self.points, self.leg_lengths)

    @cached_property
    def margins(self) -> FloatArray:
        """The margins (δ1, δ2, δ3), shape (..., 3), in design units."""
        out = np.empty((len(self.positions), 3))
        margin_rows(len(out), self.positions, self.rotations, out)
        return out.reshape(*self.batch, 3)

    @cached_property
    def arm(self) -> FloatArray:
        """The vector from b4 to the tool point along the axes of the base, shape (..., 3)."""
        return arrays.rotate(self.rotation, self.tool)

    @cached_property
    def jacobian(self) -> FloatArray:
        """The actuator Jacobian J, shape (..., 6, 6): joint rates = J @ twist.

        J maps the platform's twist to the joint rates; Merlet ("Parallel Robots", 2006) calls this
        matrix the inverse Jacobian. The twist (v; ω) is the velocity of the tool point and the
        angular velocity in radians, along the axes of the base frame. The rows have the order of
        `JOINTS`; columns 1 to 3 are dimensionless, columns 4 to 6 are lengths in design units. The
        determinant does not depend on the tool.

        A joint of length zero has no direction, and its row is zero: such a pose is singular.
        """
        out = np.zeros((*self.batch, 6, 6))
        out[..., LENGTH_ROWS, :3] = self.leg_directions
        out[..., GUIDE_ROWS, 0] = 1.0
        # The moment arm × direction of every row; np.cross takes three times as long.
        dx, dy, dz = (out[..., i] for i in range(3))
        ax, ay, az = (self.joint_arms[..., i] for i in range(3))
        out[..., 3] = ay * dz - az * dy
        out[..., 4] = az * dx - ax * dz
        out[..., 5] = ax * dy - ay * dx
        return out

    @cached_property
    def joint_arms(self) -> FloatArray:
        """The vectors from the tool point to the platform points of the joints, (..., 6, 3)."""
        tool = self.position + self.arm
        b1, b2, b3, b4 = (point - tool for point in self.points[3:])
        return np.stack(np.broadcast_arrays(b1, b2, b2, b3, b3, b4), axis=-2)

    @cached_property
    def singular_values(self) -> FloatArray:
        """The singular values of J with lengths over the reach, descending, shape (..., 6).

        One over the smallest is the largest factor by which J⁻¹ enlarges errors of the actuators,
        to those of the platform (displacement; reach × turn), and loads (force; moment / reach), to
        forces of the actuators; all as Euclidean norms of six numbers.
        """
        homogeneous = self.jacobian / np.repeat([1.0, self.design.reach], 3)
        return np.asarray(np.linalg.svd(homogeneous, compute_uv=False), dtype=np.float64)

    @cached_property
    def variables(self) -> FloatArray:
        """The design variables as kernels take them, shape (6,)."""
        return np.array(self.design.variables)

    @cached_property
    def positions(self) -> FloatArray:
        """The positions as rows for kernels, shape (n, 3)."""
        return self.rows(self.position)

    @cached_property
    def rotations(self) -> FloatArray:
        """The rotations as rows for kernels, shape (n, 3, 3)."""
        return arrays.rows_for_kernel(self.rotation, self.batch, 2)

    @cached_property
    def tools(self) -> FloatArray:
        """The tool points as rows for kernels, shape (n, 3), or (1, 3) if all poses have one."""
        return self.rows_or_one(self.tool)

    def rows(self, vectors: FloatArray) -> FloatArray:
        """Return vectors (..., k) as one row for each pose."""
        return arrays.rows_for_kernel(vectors, self.batch, 1)

    def rows_or_one(self, vectors: FloatArray) -> FloatArray:
        """Return vectors (..., k) as one row for each pose, or as one row for all."""
        return arrays.for_kernel(vectors[None]) if vectors.ndim == 1 else self.rows(vectors)


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


def offset_of(design: Design, rotation: FloatArray, at: Point) -> FloatArray:
    """Return the vector from b4 to a point along the axes of the base, shape (..., 3)."""
    return tool_offset(rotation, point_of(design, at))


def one_tool(tool: ArrayLike | None) -> FloatArray:
    """Return one tool point in the platform frame (3,), checked; b4 if it is None."""
    if tool is None:
        return np.zeros(3)
    t = arrays.position_array("tool", tool)
    if t.ndim != 1:
        raise InputError(f"give one tool point, three numbers; got the shape {t.shape}")
    return arrays.for_kernel(t)


def tool_offset(rotation: FloatArray, tool: ArrayLike | None) -> FloatArray:
    """Return the vector from b4 to a tool point along the axes of the base, shape (..., 3)."""
    t = np.zeros(3) if tool is None else arrays.position_array("tool", tool)
    return np.asarray((rotation @ t[..., None])[..., 0])
