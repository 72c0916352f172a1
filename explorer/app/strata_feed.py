"""Keeps the distances of all strata in step with the pose, while their diagram is shown."""

from __future__ import annotations

from collections.abc import Callable

from explorer.app.jobs import Worker
from explorer.app.state import Frame
from explorer.app.tasks import StrataDistances, StrataRequest
from explorer.app.workspace_feed import Feed


class StrataFeed(Feed[StrataRequest, StrataDistances]):
    """Distances to the nearest pose in each stratum."""

    def __init__(self, worker: Worker, redraw: Callable[[], None]) -> None:
        super().__init__(worker, "strata_distances", _wanted, redraw)


def _wanted(frame: Frame) -> StrataRequest | None:
    if not frame.state.view.singular.strata:
        return None
    return StrataRequest(frame.state.design, frame.state.pose)
