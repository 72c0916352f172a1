"""The distances to all strata, requested from the worker while they are shown.

The diagram shows all of them. At a singular pose the list of strata with one more incidence needs
some of them too.
"""

from __future__ import annotations

from explorer.app.features.feature import Services
from explorer.app.features.singularity.tasks import StrataDistances, StrataRequest, strata_distances
from explorer.app.session.feed import Feed
from explorer.app.state.frame import Frame


class StrataFeed(Feed[StrataRequest, StrataDistances]):
    """Distances to the nearest pose in each stratum."""

    def __init__(self, services: Services) -> None:
        super().__init__(services.worker, strata_distances, _request_for, services.session.redraw)


def _request_for(frame: Frame) -> StrataRequest | None:
    if not frame.state.view.singular.strata and not frame.snapshot.is_singular:
        return None
    return StrataRequest(frame.state.design, frame.state.pose)
