"""The optimiser: its problem, the search and the result."""

from __future__ import annotations

import viser

from explorer.app.features.feature import Feature, InBar, Tab
from explorer.app.features.optimise.chip import SearchChip
from explorer.app.features.optimise.panel import OptimisePanel
from explorer.app.features.optimise.presses import PRESSES
from explorer.app.features.optimise.runner import Optimiser
from explorer.app.features.optimise.scene import RequiredBox

OPTIMISE = Feature(
    "optimise",
    tabs=(Tab("work", "Optimise", OptimisePanel, viser.Icon.SPARKLES),),
    bar=(InBar("right", SearchChip),),
    scene=(RequiredBox,),
    runners=(Optimiser,),
    keys={f"Optimise › {press.label}": press.keys for press in PRESSES.values() if press.keys},
    lists=("Objective",),
)
