"""Clearances of the legs in the pose and in the last move, and the effect of their radii."""

from __future__ import annotations

import viser

from explorer.app.features.feature import Feature, InBar, Tab
from explorer.app.features.legs.clearance import ClearanceScene
from explorer.app.features.legs.clearance_figure import clearance_figure
from explorer.app.features.legs.feed import RadiusFeed
from explorer.app.features.legs.panel import LegsPanel
from explorer.app.features.legs.swept import SweptTetrahedra
from explorer.app.features.legs.tasks import draw_radius_curve

LEGS = Feature(
    "legs",
    tabs=(Tab("analyse", "Legs", LegsPanel, viser.Icon.LINE),),
    bar=(InBar("middle", lambda _: clearance_figure),),
    scene=(ClearanceScene, SweptTetrahedra),
    feeds=(RadiusFeed,),
    tasks=(draw_radius_curve,),
)
