"""The precision of the tool, as a tab and in the scene."""

from __future__ import annotations

import viser

from explorer.app.features.feature import Export, Feature, Tab
from explorer.app.features.precision.budget import BUDGET_FEED, ToleranceFile
from explorer.app.features.precision.panel import PrecisionPanel
from explorer.app.features.precision.scene import DeflectedScene, ErrorEllipsoidScene
from explorer.app.features.precision.tasks import budget_of, budget_table

PRECISION = Feature(
    "precision",
    tabs=(Tab("analyse", "Precision", PrecisionPanel, viser.Icon.RULER_MEASURE),),
    exports=(
        Export(
            "Tolerances",
            "The dimensions by part, with their tolerances and what they cost at the tool.",
            ("CSV",),
            lambda services: lambda _, who: services.get(ToleranceFile).send(who),
        ),
    ),
    scene=(ErrorEllipsoidScene, DeflectedScene),
    later_feeds=(BUDGET_FEED,),
    tasks=(budget_of, budget_table),
    lists=("Worst over",),
)
