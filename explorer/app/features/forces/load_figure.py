"""The largest share of a limit under the load, for the bar."""

from __future__ import annotations

from explorer.app.features.feature import Services
from explorer.app.features.forces.loads import Loads
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
