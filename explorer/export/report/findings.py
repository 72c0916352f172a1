"""All that a report tells of a design, found once by the functions that everything else uses.

What cannot be found is no reason for no report: its reason stands where it would have stood.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from hashlib import sha256
from typing import TypeVar

from explorer.errors import ExplorerError
from explorer.export.simulation import DENSITY
from explorer.measures.snapshot import Snapshot, evaluate
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import encode_design
from explorer.mechanism.home import home_pose
from explorer.mechanism.pose import Pose
from explorer.optimise.record import Record
from explorer.prototype.assembly import make_prototype
from explorer.prototype.bill import Bill, bill_of_materials
from explorer.singularity.ellipsoids import (
    Performance,
    SingularityFreeBall,
    certified_radius,
    performance,
    singularity_free_ball,
)
from explorer.workspace.accessible.workspace import ReachableWorkspace, reachable_workspace
from explorer.workspace.least_clearance import LeastClearances, least_clearances
from explorer.workspace.slices.volume import NodeCount, Volume, workspace_nodes, workspace_volume
from explorer.workspace.solids.solid import Solid
from explorer.workspace.solids.solids import convex_hull, workspace_solid

T = TypeVar("T")


@dataclass(frozen=True)
class Missing:
    """What could not be found, and why.

    Attributes:
        reason: One line for people.
    """

    reason: str


@dataclass(frozen=True)
class Findings:
    """A design in a pose, its workspace at that orientation, and what follows.

    Attributes:
        snapshot: The design in the pose.
        is_home: Whether that is its home pose.
        volume: Of the workspace, exact.
        nodes: The paper's measure of it.
        solid: The workspace as a mesh.
        hull_volume: Of the convex hull of the mesh.
        least: The least clearances over the workspace.
        reachable: What of it can be reached; None where legs have no radii.
        performance: The ellipsoids of the pose.
        ball: The largest ball of positions about the pose without a singular one.
        certified: The way of b1 to b4 below which no pose is singular.
        bill: Of the prototype's parts.
        record: Of the search that found the design, if one was given.
    """

    snapshot: Snapshot
    is_home: bool
    volume: Volume
    nodes: NodeCount | Missing
    solid: Solid | Missing
    hull_volume: float | Missing
    least: LeastClearances
    reachable: ReachableWorkspace | Missing | None
    performance: Performance
    ball: SingularityFreeBall
    certified: float
    bill: Bill | Missing
    record: Record | None

    @property
    def design(self) -> Design:
        """The design."""
        return self.snapshot.design

    @property
    def design_file(self) -> str:
        """The design as a file."""
        return encode_design(self.design).decode()

    @property
    def design_hash(self) -> str:
        """The SHA-256 of that file, in hexadecimal."""
        return sha256(encode_design(self.design)).hexdigest()


def find(design: Design, pose: Pose | None = None, record: Record | None = None) -> Findings:
    """Return all that a report tells.

    Args:
        design: The manipulator.
        pose: Of its platform, whose orientation the workspace has; its home pose if None.
        record: Of the search that found the design.
    """
    home = home_pose(design)
    at = home if pose is None else pose
    r = at.rotation
    volume = workspace_volume(design, r)
    solid = Missing("the workspace is empty")
    if volume.volume > 0.0:
        solid = _attempt(lambda: workspace_solid(design, r, volume=volume))
    thick = any(design.limits.leg_radii)
    return Findings(
        snapshot=evaluate(design, at),
        is_home=at == home,
        volume=volume,
        nodes=_attempt(lambda: workspace_nodes(design, r)),
        solid=solid,
        hull_volume=solid if isinstance(solid, Missing) else _attempt(lambda: _hull(solid)),
        least=least_clearances(design, r),
        reachable=_attempt(lambda: reachable_workspace(design, r, start=at.position))
        if thick
        else None,
        performance=performance(design, at),
        ball=singularity_free_ball(at),
        certified=certified_radius(design, at),
        bill=_attempt(lambda: bill_of_materials(make_prototype(design), DENSITY)),
        record=record,
    )


def _hull(solid: Solid) -> float:
    return convex_hull(solid).volume


def _attempt(find: Callable[[], T]) -> T | Missing:
    try:
        return find()
    except ExplorerError as error:
        return Missing(str(error))
