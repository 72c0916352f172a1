"""The load on the platform, what holds it, and the shares of the limits."""

from __future__ import annotations

import viser

from explorer.app.features.feature import Feature, InBar, Services, Tab
from explorer.app.features.forces.loads import WEIGHTS_FEED, Loads, nearest_feed
from explorer.app.features.forces.panel import ForcesPanel
from explorer.app.features.forces.scene import ForcesScene, LoadHandle
from explorer.app.features.forces.tasks import nearest_position, weights_of_parts
from explorer.app.state.frame import Frame
from explorer.app.widgets.buttons import figure
from explorer.measures.blocks.block import Share
from explorer.statics.reactions import PART_NAMES, has_limits


class LoadFigure:
    """The largest share of a limit; nothing for a design without limits."""

    def __init__(self, services: Services) -> None:
        self._loads = services.get(Loads)

    def __call__(self, frame: Frame) -> str:
        """Return the figure for a frame, as HTML."""
        loaded = self._loads.of(frame)
        if not has_limits(loaded.design):
            return ""
        hint = f"Largest share of a limit under the load of this tab: {PART_NAMES[loaded.worst]}."
        share = Share(loaded.share)
        return figure("Forces", "Load here", share.text(), hint=hint, look=f"ex-{share.look}")


FORCES = Feature(
    "forces",
    tabs=(Tab("analyse", "Forces", ForcesPanel, viser.Icon.ARROW_DOWN_CIRCLE),),
    bar=(InBar("middle", LoadFigure),),
    scene=(ForcesScene, LoadHandle),
    later_feeds=(WEIGHTS_FEED, nearest_feed),
    tasks=(weights_of_parts, nearest_position),
    lists=("Weights",),
)
