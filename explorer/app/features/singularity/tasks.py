"""The worker's task for singularities: the distances to all strata."""

from __future__ import annotations

from dataclasses import dataclass

from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose
from explorer.singularity.bruhat import Stratum
from explorer.singularity.nearest_stratum import nearest_in_strata


@dataclass(frozen=True)
class StrataRequest:
    """A request for the distances of a pose to all strata."""

    design: Design
    pose: Pose


@dataclass(frozen=True)
class StrataDistances:
    """The distances of a pose to the 24 strata.

    Attributes:
        request: The request.
        distances: Root-mean-square displacements of b1 to b4 to the nearest pose in each stratum,
            in design units.
    """

    request: StrataRequest
    distances: dict[Stratum, float]


def strata_distances(request: StrataRequest) -> StrataDistances:
    """Return the distances of a pose to all strata."""
    poses = nearest_in_strata(request.design, request.pose)
    return StrataDistances(request, {w: pose.distance for w, pose in poses.items()})
