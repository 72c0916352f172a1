"""The worker's task for singularities: the distances to all strata."""

from __future__ import annotations

from dataclasses import dataclass

from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose
from explorer.singularity.bruhat import Stratum
from explorer.singularity.nearest_stratum import nearest_in_strata


@dataclass(frozen=True)
class StrataRequest:
    """From which pose to measure the way to each stratum."""

    design: Design
    pose: Pose


@dataclass(frozen=True)
class StrataDistances:
    """The root-mean-square way of b1 to b4 to the nearest pose in each of the 24 strata.

    Attributes:
        request: What was asked for.
        distances: In design units, by stratum.
    """

    request: StrataRequest
    distances: dict[Stratum, float]


def strata_distances(request: StrataRequest) -> StrataDistances:
    """Return how far the pose is from each stratum."""
    found = nearest_in_strata(request.design, request.pose)
    return StrataDistances(request, {w: nearest.distance for w, nearest in found.items()})
