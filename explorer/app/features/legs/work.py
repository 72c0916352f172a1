"""The accessible volume over the radius of the legs, computed by the worker while it is shown."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from explorer.app.features.workspace.feeds import workspace_rows, workspace_start
from explorer.app.features.workspace.regions import Rows, Trouble, trouble_of
from explorer.app.session.feed import Feed, feed_of, watch_of
from explorer.app.session.worker import Channel
from explorer.app.state.frame import Frame
from explorer.errors import ExplorerError
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Triple
from explorer.workspace.accessible.radii import RadiusCurve, radius_curve, with_radius


@dataclass(frozen=True)
class RadiusRequest:
    """A request for the accessible volume over the radius of the legs, at an orientation.

    Paths start with b4 at a position; None stands for home. The legs of the design have no radii.
    """

    design: Design
    rotation: Rows
    start: Triple | None


def draw_radius_curve(
    request: RadiusRequest, channel: Channel | None = None
) -> RadiusCurve | Trouble:
    """Return the accessible volume over the radius of all legs, or why there is no curve."""
    design, rotation = request.design, np.array(request.rotation)
    try:
        return radius_curve(design, rotation, start=request.start, watch=watch_of(channel))
    except ExplorerError as error:
        return trouble_of(error)


def _request_for(frame: Frame) -> RadiusRequest | None:
    if not frame.state.view.radius_curve:
        return None
    thin = with_radius(frame.state.design, 0.0)
    return RadiusRequest(thin, workspace_rows(frame), workspace_start(frame))


RadiusFeed: TypeAlias = Feed[RadiusRequest, RadiusCurve | Trouble]
RADIUS_FEED = feed_of(draw_radius_curve, _request_for, has_stages=True)
