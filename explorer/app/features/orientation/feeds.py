"""What the worker computes for the tab, kept in step with the state."""

from __future__ import annotations

from explorer.app.features.feature import Services
from explorer.app.features.orientation.tasks import (
    PositionDrawing,
    PositionRequest,
    RangeDrawing,
    RangeRequest,
    TiltsDrawing,
    TiltsRequest,
    orientations_at,
    range_solid,
    tilts_at_nodes,
)
from explorer.app.session.feed import Feed
from explorer.app.state.frame import Frame

# Digits of a torsion in degrees beyond which tilts are not computed again.
DIGITS = 3


class PositionFeed(Feed[PositionRequest, PositionDrawing]):
    """Orientations that the present position can have."""

    def __init__(self, services: Services) -> None:
        super().__init__(
            services.worker,
            orientations_at,
            lambda frame: PositionRequest(
                frame.state.design, frame.state.position, frame.state.tool
            ),
            services.session.redraw,
        )


class TiltsFeed(Feed[TiltsRequest, TiltsDrawing]):
    """Greatest tilts over the workspace, while they are shown."""

    def __init__(self, services: Services) -> None:
        super().__init__(
            services.worker, tilts_at_nodes, _tilts_of, services.session.redraw, has_stages=True
        )


def _tilts_of(frame: Frame) -> TiltsRequest | None:
    if not frame.state.view.orientation.tilts:
        return None
    torsion = round(frame.state.tilt_torsion.torsion, DIGITS)
    return TiltsRequest(frame.state.design, torsion, frame.state.tool)


class RangeFeed(Feed[RangeRequest, RangeDrawing]):
    """The workspace over a range of tilts, while one is shown."""

    def __init__(self, services: Services) -> None:
        super().__init__(services.worker, range_solid, _range_of, services.session.redraw)


def _range_of(frame: Frame) -> RangeRequest | None:
    view, design = frame.state.view.orientation, frame.state.design
    if view.over == "none":
        return None
    home, tool = design.home_pose, frame.state.tool
    return RangeRequest(design, home, view.range, view.turn, view.over, tool)
