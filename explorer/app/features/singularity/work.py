"""The distances to all strata, computed by the worker while they are shown."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from explorer.app.session.feed import Feed, feed_of
from explorer.app.state.frame import Frame
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
    """The distances of a pose to the 24 strata, in design units.

    A distance is the root-mean-square displacement of b1 to b4 to the nearest pose in the stratum.
    """

    request: StrataRequest
    distances: dict[Stratum, float]


def strata_distances(request: StrataRequest) -> StrataDistances:
    """Return the distances of a pose to all strata."""
    poses = nearest_in_strata(request.design, request.pose)
    return StrataDistances(request, {w: pose.distance for w, pose in poses.items()})


def _request_for(frame: Frame) -> StrataRequest | None:
    if not frame.state.view.singular.strata and not frame.snapshot.is_singular:
        return None
    return StrataRequest(frame.state.design, frame.state.pose)


StrataFeed: TypeAlias = Feed[StrataRequest, StrataDistances]
STRATA_FEED = feed_of(strata_distances, _request_for)
"""The distances to the strata, for the diagram; at a singular pose the list needs some too."""
