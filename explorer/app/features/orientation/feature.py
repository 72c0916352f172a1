"""The orientations of a position, and the workspaces over orientations."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import viser

from explorer.app.features.feature import Feature, Feed, Services, Tab
from explorer.app.features.orientation.feeds import PositionFeed, RangeFeed, TiltsFeed
from explorer.app.features.orientation.panel import OrientationPanel
from explorer.app.features.orientation.scene import OrientationScene
from explorer.app.features.orientation.tasks import orientations_at, range_solid, tilts_at_nodes


def _of_kind(kind: Callable[[Services], Feed], services: Services) -> Feed:
    """Return the one feed of a kind."""
    return services.get(kind)


ORIENTATION = Feature(
    "orientation",
    tabs=(Tab("analyse", "Tilt", OrientationPanel, viser.Icon.COMPASS),),
    scene=(OrientationScene,),
    later_feeds=tuple(partial(_of_kind, kind) for kind in (PositionFeed, TiltsFeed, RangeFeed)),
    tasks=(orientations_at, tilts_at_nodes, range_solid),
    lists=("Solid over tilts",),
)
