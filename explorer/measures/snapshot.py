"""Everything there is to know about one design in one pose, computed once, when it is needed.

The page, the command line, reports and tests all read this; none computes its own.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from explorer.legs.clearance import LegClearances, leg_clearances
from explorer.mechanism.design import Design
from explorer.mechanism.feasible_intervals import Interval, feasible_intervals
from explorer.mechanism.home import home_pose
from explorer.mechanism.kinematics import (
    AttachmentPoints,
    ForwardKinematics,
    attachment_points,
    forward,
    inverse,
)
from explorer.mechanism.margins import margins, mode_name, mode_of, signs_of
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray
from explorer.singularity.bruhat import incidences
from explorer.singularity.jacobian import (
    determinant,
    inverse_condition,
    jacobian,
    tetrahedron_volumes,
)
from explorer.singularity.nearest import (
    NearestPoses,
    NearestSingularity,
    each_singularity,
    nearest_singular_poses,
)
from explorer.singularity.strata import inversions, stratum
from explorer.workspace.limits.broken import Violation, violations


@dataclass(frozen=True)
class Snapshot:
    """A design in a pose; what follows is computed when it is first asked for.

    Lengths are in design units.

    Attributes:
        design: The manipulator.
        pose: Of the platform.
    """

    design: Design
    pose: Pose

    @cached_property
    def rotation(self) -> FloatArray:
        """The rotation of the pose, shape (3, 3)."""
        return self.pose.rotation

    @cached_property
    def points(self) -> AttachmentPoints:
        """The attachment points in the base frame, each (3,)."""
        return attachment_points(self.design, self.pose.position, self.rotation)

    @cached_property
    def joints(self) -> FloatArray:
        """(l1, d1, d2, d3, d4, l4), shape (6,)."""
        return inverse(self.design, self.pose.position, self.rotation)

    @cached_property
    def margins(self) -> FloatArray:
        """(δ1, δ2, δ3), shape (3,)."""
        return margins(self.pose.position, self.rotation)

    @cached_property
    def volumes(self) -> FloatArray:
        """Of the three tetrahedra, shape (3,), in cubed design units."""
        return tetrahedron_volumes(self.design, self.margins)

    @cached_property
    def determinant(self) -> float:
        """The determinant of J."""
        return float(determinant(self.design, self.joints, self.margins))

    @property
    def volume_sizes(self) -> FloatArray:
        """The volumes with margins as long as the reach, beside which rounding is told, (3,)."""
        return np.abs(tetrahedron_volumes(self.design, np.full(3, self.design.reach)))

    @property
    def determinant_size(self) -> float:
        """The |determinant| with the smallest margin as long as the reach, as `volume_sizes`."""
        long = self.margins.copy()
        long[np.abs(long).argmin()] = self.design.reach
        return abs(float(determinant(self.design, self.joints, long)))

    @cached_property
    def inverse_condition(self) -> float:
        """Of J made homogeneous with the reach, 0 (singular) to 1."""
        matrix = jacobian(self.design, self.pose.position, self.rotation)
        return float(inverse_condition(matrix, self.design.reach))

    @cached_property
    def stratum(self) -> tuple[int, ...]:
        """The relative position of the two flags."""
        found = stratum(self.pose.position, self.rotation, self.design.reach)
        return tuple(found.tolist())

    @property
    def stratum_dimension(self) -> int:
        """6 generic to 0 coinciding."""
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
        """The assembly modes that meet in the pose: its own, or where singular 2, 4 or 8."""
        free = sum(4 >> (incidence - 1) for incidence in incidences(self.stratum))
        return tuple(mode for mode in range(8) if mode & ~free == self.mode & ~free)

    @property
    def sign_words(self) -> str:
        """The signs of the margins as people read them, 0 for one that vanishes: "− 0 +"."""
        signs = mode_name(self.mode).split()
        for incidence in incidences(self.stratum):
            signs[incidence - 1] = "0"
        return " ".join(signs)

    @property
    def proximity(self) -> float:
        """The smallest |margin| over the reach."""
        return float(np.abs(self.margins).min()) / self.design.reach

    @cached_property
    def violations(self) -> tuple[Violation, ...]:
        """The limits that the pose breaks."""
        return violations(
            self.design,
            np.array(self.pose.position),
            self.rotation,
            self.joints,
            self.margins,
            _home_signs(home_pose(self.design)),
        )

    @cached_property
    def clearances(self) -> LegClearances:
        """The clearances of the six pairs of legs."""
        return leg_clearances(self.design, np.array(self.pose.position), self.rotation)

    @cached_property
    def nearest_distances(self) -> tuple[float, float, float]:
        """The distances of `nearest`, without the poses, which take three times as long."""
        first, second, third = self._nearest_poses.distance.tolist()
        return first, second, third

    @cached_property
    def nearest(self) -> tuple[NearestSingularity, NearestSingularity, NearestSingularity]:
        """The nearest singular pose of each incidence, in the order δ1, δ2, δ3."""
        return each_singularity(self._nearest_poses, self.pose)

    @cached_property
    def _nearest_poses(self) -> NearestPoses:
        return nearest_singular_poses(self.design, self.pose.position, self.rotation)

    @cached_property
    def modes(self) -> ForwardKinematics:
        """All eight assembly modes of these joints."""
        return forward(self.design, self.joints)

    @cached_property
    def intervals(self) -> tuple[tuple[Interval, ...], ...]:
        """Per joint, the intervals in which the lengths close while the others hold."""
        return feasible_intervals(self.design, self.joints)


def evaluate(design: Design, pose: Pose) -> Snapshot:
    """Return the snapshot of a design in a pose.

    Args:
        design: The manipulator.
        pose: Of its platform, in design units.
    """
    return Snapshot(design, pose)


@lru_cache(64)
def _home_signs(home: Pose) -> tuple[int, int, int]:
    return signs_of(int(mode_of(margins(home.position, home.rotation))))
