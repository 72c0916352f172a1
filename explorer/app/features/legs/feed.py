"""The radius curve, requested from the worker while it is shown."""

from __future__ import annotations

from explorer.app.features.feature import Services
from explorer.app.features.legs.tasks import RadiusDrawing, RadiusRequest, draw_radius_curve
from explorer.app.features.workspace.feeds import workspace_rows, workspace_start
from explorer.app.session.feed import Feed
from explorer.app.state.frame import Frame
from explorer.workspace.accessible.radii import with_radius


class RadiusFeed(Feed[RadiusRequest, RadiusDrawing]):
    """Drawings of the accessible volume against the radius of the legs."""

    def __init__(self, services: Services) -> None:
        super().__init__(
            services.worker,
            draw_radius_curve,
            _request_for,
            services.session.redraw,
            has_stages=True,
        )


def _request_for(frame: Frame) -> RadiusRequest | None:
    if not frame.state.view.radius_curve:
        return None
    thin = with_radius(frame.state.design, 0.0)
    return RadiusRequest(thin, workspace_rows(frame), workspace_start(frame))
