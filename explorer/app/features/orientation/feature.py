"""The orientations of a position, and the workspaces over orientations."""

from __future__ import annotations

import viser

from explorer.app.features.feature import Feature, Tab
from explorer.app.features.orientation.panel import OrientationPanel
from explorer.app.features.orientation.scene import OrientationScene
from explorer.app.features.orientation.work import (
    POSITION_FEED,
    RANGE_FEED,
    TILTS_FEED,
    orientations_at,
    range_solid,
    tilts_at_nodes,
)

ORIENTATION = Feature(
    "orientation",
    tabs=(Tab("analyse", "Tilt", OrientationPanel, viser.Icon.COMPASS),),
    scene=(OrientationScene,),
    later_feeds=(POSITION_FEED, TILTS_FEED, RANGE_FEED),
    tasks=(orientations_at, tilts_at_nodes, range_solid),
    lists=("Solid over tilts",),
)
