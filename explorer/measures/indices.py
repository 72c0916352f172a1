"""Indices of performance of poses: conditioning, manipulability, and transmission of the actuators.

Those of J depend on the reach, which makes J homogeneous, and on b4 as the reference point. The
transmission index needs neither: it consists of angles between forces and velocities alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from explorer.mechanism.configuration import Configuration
from explorer.numerics.arrays import FloatArray, lengths_of
from explorer.singularity.jacobian import jacobian_of, singular_values
from explorer.statics.forces import twists_of_actuators


@dataclass(frozen=True)
class PoseIndices:
    """The indices of a design in poses; each is 0 in a singular pose.

    Attributes:
        configuration: Design and poses.
    """

    configuration: Configuration

    @cached_property
    def singular_values(self) -> FloatArray:
        """The singular values of J, made homogeneous by the reach, descending, shape (..., 6)."""
        return singular_values(jacobian_of(self.configuration), self.configuration.design.reach)

    @property
    def inverse_condition(self) -> FloatArray:
        """The inverse condition number 1/κ of the homogeneous J, from 0 to 1, shape (...)."""
        return self.singular_values[..., -1] / self.singular_values[..., 0]

    @property
    def smallest_singular_value(self) -> FloatArray:
        """The smallest singular value σ of the homogeneous J, shape (...).

        Errors of actuators and loads are enlarged at most 1/σ times, see
        `explorer.singularity.jacobian.singular_values`.
        """
        return self.singular_values[..., -1]

    @property
    def manipulability(self) -> FloatArray:
        """The manipulability √det(J Jᵀ) = |det J| of the homogeneous J, shape (...).

        Yoshikawa ("Manipulability of Robotic Mechanisms", 1985) defines it for the matrix that
        maps joint rates to the twist, here J⁻¹. In singular poses of a parallel manipulator that
        one is infinite, therefore J takes its place: the volume of joint rates for all twists of
        unit length is proportional to the value, that of twists to its inverse.
        """
        return np.prod(self.singular_values, axis=-1)

    @cached_property
    def transmissions(self) -> FloatArray:
        """The output transmission index of each actuator, from 0 to 1, shape (..., 6).

        For an actuator, all others are locked: the platform then has one twist. The index is the
        power of the actuator's wrench on this twist, over the largest power that a force of this
        size at the same point can have (Wang, Wu and Liu, "Performance evaluation of parallel
        manipulators: Motion/force transmissibility and its index", 2010). The wrench is what the
        passive joints of the leg and its other actuator leave: a force through the centre of the
        spherical joint, at b1 along leg 1, at b4 along leg 4, at b2 and b3 along the guide for d1
        and d3 and along the strut for d2 and d4. So the index is the cosine of the angle between
        the force and the velocity of its point, one over the speed of that point at a unit rate of
        the actuator. For l1 it is |δ1| / l1, for l4 |a3y δ3| / (l4 times the distance of b4 from
        the guide).

        The force of each actuator lies along its motion, so that the input transmission indices
        are 1.
        """
        c = self.configuration
        twists = np.swapaxes(twists_of_actuators(c), -1, -2)
        ends = c.design.platform_points[[0, 1, 1, 2, 2, 3]] - c.tool[..., None, :]
        arms = ends @ np.swapaxes(c.rotation, -1, -2)
        # Velocities of the points are infinite in a singular pose.
        with np.errstate(invalid="ignore"):
            speeds = lengths_of(twists[..., :3] + np.cross(twists[..., 3:], arms))
        return np.where(np.isnan(speeds), 0.0, 1.0 / speeds)

    @property
    def transmission_index(self) -> FloatArray:
        """The output transmission index: the least one of the six actuators, shape (...)."""
        return self.transmissions.min(axis=-1)
