"""The load on the platform, what holds it, and the shares of the limits."""

from __future__ import annotations

import viser

from explorer.app.features.feature import Feature, InBar, Tab
from explorer.app.features.forces.load_figure import LoadFigure
from explorer.app.features.forces.loads import NearestFeed, WeightsFeed
from explorer.app.features.forces.panel import ForcesPanel
from explorer.app.features.forces.scene import ForcesScene, LoadHandle
from explorer.app.features.forces.tasks import nearest_position, weights_of_parts

FORCES = Feature(
    "forces",
    tabs=(Tab("analyse", "Forces", ForcesPanel, viser.Icon.ARROW_DOWN_CIRCLE),),
    bar=(InBar("middle", LoadFigure),),
    scene=(ForcesScene, LoadHandle),
    later_feeds=(WeightsFeed, NearestFeed),
    tasks=(weights_of_parts, nearest_position),
    lists=("Weights",),
)
