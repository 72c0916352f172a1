"""Up to three pinned designs beside the live one."""

from __future__ import annotations

import viser

from explorer.app.features.compare.panel import ComparePanel
from explorer.app.features.compare.scene import ComparedScene
from explorer.app.features.compare.work import FEEDS, compared_drawing
from explorer.app.features.feature import Feature, Tab

COMPARE = Feature(
    "compare",
    tabs=(Tab("work", "Compare", ComparePanel, viser.Icon.COLUMNS_3),),
    scene=(ComparedScene,),
    feeds=FEEDS,
    tasks=(compared_drawing,),
)
