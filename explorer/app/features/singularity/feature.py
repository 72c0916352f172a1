"""The proximity to singularities, and what a singular pose means."""

from __future__ import annotations

import viser

from explorer.app.features.feature import Feature, InBar, StateCommand, Tab
from explorer.app.features.singularity.actions import GoToSingularity
from explorer.app.features.singularity.distance_figure import distance_figure
from explorer.app.features.singularity.feed import StrataFeed
from explorer.app.features.singularity.freedom import FreeMotion
from explorer.app.features.singularity.panel import SingularityPanel
from explorer.app.features.singularity.scene import BallScene, EllipsoidScene, NearestGhost
from explorer.app.features.singularity.tasks import strata_distances
from explorer.app.widgets.commands import shift

SINGULARITY = Feature(
    "singularity",
    tabs=(Tab("analyse", "Singularity", SingularityPanel, viser.Icon.ALERT_TRIANGLE),),
    bar=(InBar("middle", lambda _: distance_figure),),
    scene=(NearestGhost, EllipsoidScene, BallScene, FreeMotion),
    later_feeds=(StrataFeed,),
    tasks=(strata_distances,),
    commands=(
        StateCommand(
            "Singularity › Go to the nearest one",
            "Move the mechanism to the closest of the nearest poses of δ1, δ2 and δ3.",
            lambda _: GoToSingularity(None),
            keys=(shift("G"),),
        ),
    ),
    lists=("Ghost", "Ellipsoid"),
)
