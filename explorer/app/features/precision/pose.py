"""The precision of the present pose, for the panel and the scene."""

from __future__ import annotations

from explorer.app.features.feature import Services
from explorer.app.features.forces.loads import Loads
from explorer.app.state.frame import Frame
from explorer.statics.tool_precision import ToolPrecision


class PosePrecision:
    """The precision of the present frame, under the load of the tab Forces."""

    def __init__(self, services: Services) -> None:
        self._loads = services.get(Loads)
        self._kept: ToolPrecision | None = None

    def of(self, frame: Frame) -> ToolPrecision:
        """Return the precision of a frame."""
        loaded = self._loads.of(frame)
        if self._kept is None or self._kept.loaded is not loaded:
            self._kept = ToolPrecision(loaded)
        return self._kept
