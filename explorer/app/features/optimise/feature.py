"""The optimiser: its problem, the search and the result."""

from __future__ import annotations

import viser

from explorer.app.features.feature import Feature, InBar, Tab
from explorer.app.features.optimise.bar import search_chip
from explorer.app.features.optimise.panel import OptimisePanel
from explorer.app.features.optimise.runner import Optimiser
from explorer.app.features.optimise.scene import RequiredBox

OPTIMISE = Feature(
    "optimise",
    tabs=(Tab("work", "Optimise", OptimisePanel, viser.Icon.SPARKLES),),
    bar=(InBar("right", lambda _: search_chip),),
    scene=(RequiredBox,),
    runners=(Optimiser,),
    lists=("Objective",),
)
