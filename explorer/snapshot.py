"""Everything there is to know about one design in one pose, computed once.

The page, the command line, reports and tests all read this; none computes its own.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from explorer.arrays import FloatArray
from explorer.clearance import LegClearances, leg_clearances
from explorer.design import Design
from explorer.feasibility import Interval, feasible_intervals
from explorer.home import home_pose
from explorer.kinematics import (
    AttachmentPoints,
    ForwardKinematics,
    attachment_points,
    forward,
    inverse,
)
from explorer.limits import Violation, violations
from explorer.nearest_singular import NearestSingularity, nearest_singularities
from explorer.pose import Pose
from explorer.singularity import (
    determinant,
    inverse_condition,
    jacobian,
    margins,
    mode_of,
    signs_of,
    tetrahedron_volumes,
)
from explorer.strata import inversions, stratum


@dataclass(frozen=True)
class Snapshot:
    """A design in a pose, and all that follows; lengths in design units.

    Attributes:
        design: The manipulator.
        pose: Of the platform.
        rotation: That of the pose, shape (3, 3).
        points: The attachment points in the base frame, each (3,).
        joints: (l1, d1, d2, d3, d4, l4), shape (6,).
        margins: (κ1, κ2, κ3), shape (3,).
        volumes: Of the three tetrahedra, shape (3,), in cubed design units.
        determinant: det J.
        inverse_condition: Of J made homogeneous with the reach, 0 (singular) to 1.
        stratum: The relative position of the two flags.
        stratum_dimension: 6 generic to 0 coinciding.
        mode: The assembly mode, 0 to 7.
        proximity: The smallest |margin| over the reach.
        violations: The limits that the pose breaks.
    """

    design: Design
    pose: Pose
    rotation: FloatArray
    points: AttachmentPoints
    joints: FloatArray
    margins: FloatArray
    volumes: FloatArray
    determinant: float
    inverse_condition: float
    stratum: tuple[int, ...]
    stratum_dimension: int
    mode: int
    proximity: float
    violations: tuple[Violation, ...]

    @property
    def signs(self) -> tuple[int, int, int]:
        """The sign triple of the mode."""
        return signs_of(self.mode)

    @cached_property
    def clearances(self) -> LegClearances:
        """The clearances of the six pairs of legs."""
        return leg_clearances(self.design, np.array(self.pose.position), self.rotation)

    @cached_property
    def nearest(self) -> tuple[NearestSingularity, NearestSingularity, NearestSingularity]:
        """The nearest singular pose of each incidence, in the order κ1, κ2, κ3."""
        return nearest_singularities(self.design, self.pose)

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
    rotation = pose.rotation
    position = np.array(pose.position)
    joints = inverse(design, position, rotation)
    margin = margins(position, rotation)
    home = home_pose(design)
    flags = tuple(stratum(position, rotation, design.reach).tolist())
    return Snapshot(
        design=design,
        pose=pose,
        rotation=rotation,
        points=attachment_points(design, position, rotation),
        joints=joints,
        margins=margin,
        volumes=tetrahedron_volumes(design, margin),
        determinant=float(determinant(design, joints, margin)),
        inverse_condition=float(
            inverse_condition(jacobian(design, position, rotation), design.reach)
        ),
        stratum=flags,
        stratum_dimension=inversions(flags),
        mode=int(mode_of(margin)),
        proximity=float(np.abs(margin).min()) / design.reach,
        violations=violations(design, position, rotation, joints, margin, _home_signs(home)),
    )


@lru_cache(64)
def _home_signs(home: Pose) -> tuple[int, int, int]:
    return signs_of(int(mode_of(margins(home.position, home.rotation))))
