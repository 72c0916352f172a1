"""Clearances of the legs in the pose and in the last move, and the effect of their radii."""

from __future__ import annotations

from explorer.app.features.feature import Feature, Tab
from explorer.app.features.legs.clearance import ClearanceScene
from explorer.app.features.legs.feed import RadiusFeed
from explorer.app.features.legs.panel import LegsPanel
from explorer.app.features.legs.swept import SweptTetrahedra
from explorer.app.features.legs.tasks import draw_radius_curve

LEGS = Feature(
    "legs",
    tabs=(Tab("side", "Legs", LegsPanel),),
    scene=(ClearanceScene, SweptTetrahedra),
    feeds=(RadiusFeed,),
    tasks=(draw_radius_curve,),
)
