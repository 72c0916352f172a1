"""The proximity to singularities, and the motions that a singular pose allows."""

from __future__ import annotations

import viser

from explorer.app.features.feature import Feature, InBar, StateCommand, Tab
from explorer.app.features.singularity.panel import SingularityPanel
from explorer.app.features.singularity.scene import (
    BallScene,
    EllipsoidScene,
    FreeMotion,
    NearestGhost,
)
from explorer.app.features.singularity.work import STRATA_FEED, GoToSingularity, strata_distances
from explorer.app.state.frame import Frame
from explorer.app.widgets.buttons import figure
from explorer.app.widgets.commands import shift
from explorer.measures.blocks.singularity import LOOKS


def distance_figure(frame: Frame) -> str:
    """Return the distance to the nearest singular pose, and which margin is zero there."""
    verdict, unit_mm = frame.verdict, frame.state.design.unit_mm
    hint, look = f"{verdict.title}: {verdict.reason(unit_mm)}.", f"ex-{LOOKS[verdict.kind]}"
    name = "Nearest singular pose"
    return figure("Singularity", name, verdict.brief(unit_mm), hint=hint, look=look)


SINGULARITY = Feature(
    "singularity",
    tabs=(Tab("analyse", "Singularity", SingularityPanel, viser.Icon.ALERT_TRIANGLE),),
    bar=(InBar("middle", lambda _: distance_figure),),
    scene=(NearestGhost, EllipsoidScene, BallScene, FreeMotion),
    later_feeds=(STRATA_FEED,),
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
