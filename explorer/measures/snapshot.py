"""The snapshot of a design in a pose: all of its values, each computed once, on first use.

The page, the command line and reports all read these values. Indices of J depend on the reach,
which makes J homogeneous, and on b4 as the reference point; the transmission index needs neither,
as it consists of angles between forces and velocities alone.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from explorer.legs.clearance import LegClearances, leg_clearances
from explorer.mechanism.configuration import Conditioning, Configuration
from explorer.mechanism.design import Design
from explorer.mechanism.feasible_intervals import Interval, feasible_intervals
from explorer.mechanism.folds import assembly_modes
from explorer.mechanism.kinematics import determinant, jacobian_factors, tetrahedron_volumes
from explorer.mechanism.margins import describe_modes, mode_name, mode_of, signs_of
from explorer.mechanism.pose import Pose
from explorer.motion.inverse_jacobian import twists_of_actuators
from explorer.numerics.arrays import FloatArray, lengths_of, triple
from explorer.singularity.freedoms import FlagGaps, Freedoms, flag_gaps, freedoms, least_turns
from explorer.singularity.nearest import (
    NearestPoses,
    NearestSingularity,
    nearest_singular_poses,
    singularities_of,
)
from explorer.singularity.strata import GENERIC, incidences, inversions, stratum_of
from explorer.statics.accuracy import CORNERS
from explorer.workspace.limits.valid_poses import Collision, Violation, violations


class Indices(Conditioning):
    """Indices of poses, which follow from J; those of conditioning are 0 in a singular pose.

    Attributes:
        twists: J⁻¹, whose columns are twists (v; ω), shape (..., 6, 6); infinite in singular poses.
        joint_arms: Vectors from the point of the twists to the points at which the forces of the
            joints act on the platform, shape (..., 6, 3).
    """

    twists: cached_property[FloatArray]
    joint_arms: cached_property[FloatArray]

    @property
    def smallest_singular_value(self) -> FloatArray:
        """The smallest singular value σ of J with lengths over the reach, shape (...).

        Errors of actuators and loads are enlarged at most 1/σ times, see
        `Configuration.singular_values`.
        """
        return self.singular_values.min(axis=-1)

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

        With all other actuators locked the platform has one twist. The index is the power of the
        actuator's wrench on this twist, over the largest power that a force of this size at the
        same point can have (Wang, Wu and Liu, "Performance evaluation of parallel manipulators:
        Motion/force transmissibility and its index", 2010). The wrench is a force through the
        centre of the leg's spherical joint: along legs 1 and 4, along the guide for d1 and d3, and
        along the strut for d2 and d4. So the index is the cosine of the angle between the force and
        the velocity of its point, one over the speed of that point at a unit rate of the actuator.
        For l1 it is |δ1| / l1, for l4 |a3y δ3| / (l4 times the distance of b4 from the guide). Each
        force lies along its actuator's motion, so that the input transmission indices are 1.
        """
        twists = np.swapaxes(self.twists, -1, -2)
        # Velocities of the points are infinite in a singular pose.
        with np.errstate(invalid="ignore"):
            speeds = lengths_of(twists[..., :3] + np.cross(twists[..., 3:], self.joint_arms))
        return np.where(np.isnan(speeds), 0.0, 1.0 / speeds)

    @property
    def transmission_index(self) -> FloatArray:
        """The local transmission index, the least of `transmissions`, shape (...)."""
        return self.transmissions.min(axis=-1)

    @property
    def force_per_newton(self) -> FloatArray:
        """The largest force of an actuator by a force of 1 N in any direction, shape (...).

        The force acts at the point of the twists, without a moment. Row i of J⁻ᵀ, which gives the
        force of actuator i, is column i of J⁻¹; only its first three entries count.
        """
        return lengths_of(np.swapaxes(self.twists[..., :3, :], -1, -2)).max(axis=-1)

    @property
    def error_per_joint_error(self) -> FloatArray:
        """The largest displacement of the point by errors within ±1 of every joint, shape (...)."""
        with np.errstate(invalid="ignore"):
            moved = lengths_of(np.swapaxes(self.twists[..., :3, :] @ CORNERS, -1, -2))
        return np.where(np.isnan(moved), np.inf, moved).max(axis=-1)


class PoseIndices(Configuration, Indices):
    """A design in poses with its indices, those of forces and velocities at b4."""

    @cached_property
    def twists(self) -> FloatArray:
        """J⁻¹ at the tool, shape (..., 6, 6); infinite in a singular pose."""
        return twists_of_actuators(self)


class Snapshot(PoseIndices):
    """A design in one pose, and the values that follow from both; lengths in design units."""

    def __init__(self, design: Design, pose: Pose) -> None:
        super().__init__(design, pose.position, pose.rotation)
        self.pose = pose

    @cached_property
    def gaps(self) -> FlagGaps:
        """The gaps that are left to each incidence."""
        return flag_gaps(self.position, self.rotation)

    @cached_property
    def volumes(self) -> FloatArray:
        """The volumes of the three tetrahedra, shape (3,), in cubed design units."""
        return tetrahedron_volumes(self.design, self.margins)

    @cached_property
    def determinant(self) -> float:
        """The determinant of the actuator Jacobian J."""
        return float(determinant(self.design, self.joints, self.margins))

    @cached_property
    def least_turns(self) -> tuple[float, float, float]:
        """The least turns that lead to each incidence, in radians, in the order δ1, δ2, δ3."""
        return triple(least_turns(self.position, self.rotation))

    @property
    def worst_conditioned(self) -> int:
        """The number 1 to 3 of the margin that makes the conditioning of J what it is."""
        return int(jacobian_factors(self.design, self.joints, self.margins).argmin()) + 1

    @cached_property
    def stratum(self) -> tuple[int, ...]:
        """The stratum: the permutation of the relative position of the two flags."""
        return stratum_of(self)

    @property
    def is_singular(self) -> bool:
        """Whether an incidence of the flags holds, to rounding."""
        return self.stratum != GENERIC

    @cached_property
    def freedoms(self) -> Freedoms:
        """The freedoms of the platform with all actuators locked; none unless it is singular."""
        return freedoms(self)

    @property
    def stratum_dimension(self) -> int:
        """The dimension of the stratum, from 6 (generic) to 0 (flags that coincide)."""
        return inversions(self.stratum)

    @property
    def mode(self) -> int:
        """The assembly mode, 0 to 7."""
        return int(mode_of(self.margins))

    @property
    def signs(self) -> tuple[int, int, int]:
        """The sign triple of the mode."""
        return signs_of(self.mode)

    @property
    def bordering_modes(self) -> tuple[int, ...]:
        """The assembly modes that meet in the pose: 1, or 2, 4 or 8 if it is singular."""
        free = sum(4 >> (incidence - 1) for incidence in incidences(self.stratum))
        return tuple(mode for mode in range(8) if mode & ~free == self.mode & ~free)

    @property
    def sign_words(self) -> str:
        """The signs of the margins as text, 0 for one that vanishes, such as "− 0 +"."""
        signs = mode_name(self.mode).split()
        for incidence in incidences(self.stratum):
            signs[incidence - 1] = "0"
        return " ".join(signs)

    @property
    def mode_words(self) -> str:
        """The mode in words, such as "mode 1 (− − +)" or "boundary of modes 1 and 3 (− 0 +)"."""
        modes = self.bordering_modes
        name = describe_modes(modes) if len(modes) > 1 else f"mode {self.mode}"
        return f"{name} ({self.sign_words})"

    @property
    def proximity(self) -> float:
        """The smallest |δ| over the reach."""
        return float(np.abs(self.margins).min()) / self.design.reach

    @cached_property
    def violations(self) -> tuple[Violation | Collision, ...]:
        """The limits that the pose breaks, and the legs that collide in it."""
        return violations(self)[0]

    @cached_property
    def mode_violations(self) -> tuple[tuple[Violation | Collision, ...], ...]:
        """The limits that each of the eight assembly modes breaks, and the legs that collide."""
        return tuple(violations(self.modes))

    @cached_property
    def clearances(self) -> LegClearances:
        """The clearances of the six pairs of legs."""
        return leg_clearances(self)

    @cached_property
    def nearest_distances(self) -> tuple[float, float, float]:
        """The distances of `nearest`, computed in a third of the time of the poses."""
        return triple(self._nearest_poses.distance)

    @cached_property
    def nearest(self) -> tuple[NearestSingularity, NearestSingularity, NearestSingularity]:
        """The nearest singular pose of each incidence, in the order δ1, δ2, δ3."""
        return singularities_of(self._nearest_poses, self.pose)

    @cached_property
    def _nearest_poses(self) -> NearestPoses:
        return nearest_singular_poses(self)

    @cached_property
    def modes(self) -> Configuration:
        """The design in the eight assembly modes of the joint values."""
        return Configuration(self.design, *assembly_modes(self.position, self.rotation))

    @cached_property
    def intervals(self) -> tuple[tuple[Interval, ...], ...]:
        """The intervals of each joint in which a pose exists, the other joints held."""
        return feasible_intervals(self.design, self.joints)


evaluate = Snapshot
"""The snapshot of a design in a pose; callers outside the package know it by this name."""
