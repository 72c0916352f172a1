"""Keeps the distances of all strata in step with the pose, where they are shown.

The diagram shows all of them, and the words below it those of one more incidence: at a singular
pose these are deeper strata too, of which only the worker knows the distances.
"""

from __future__ import annotations

from collections.abc import Callable

from explorer.app.features.singularity.tasks import StrataDistances, StrataRequest, strata_distances
from explorer.app.session.feed import Feed
from explorer.app.session.jobs import Worker
from explorer.app.state.frame import Frame
from explorer.singularity.strata import GENERIC


class StrataFeed(Feed[StrataRequest, StrataDistances]):
    """Distances to the nearest pose in each stratum."""

    def __init__(self, worker: Worker, redraw: Callable[[], None]) -> None:
        super().__init__(worker, strata_distances, _wanted, redraw)


def _wanted(frame: Frame) -> StrataRequest | None:
    if not frame.state.view.singular.strata and frame.snapshot.stratum == GENERIC:
        return None
    return StrataRequest(frame.state.design, frame.state.pose)
