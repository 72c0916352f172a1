"""The parts of the prototype, in step with the design while they are shown."""

from __future__ import annotations

import msgspec

from explorer.app.features.feature import Services
from explorer.app.features.prototype.parts import Parts, PartsDrawing, PartsRequest, parts_drawing
from explorer.app.session.feed import Feed
from explorer.app.state.frame import Frame


class PartsFeed(Feed[PartsRequest, PartsDrawing]):
    """The parts of the design, made again when the design changes, not when the pose does."""

    def __init__(self, services: Services) -> None:
        super().__init__(services.worker, parts_drawing, _request, services.session.redraw)

    @property
    def parts(self) -> Parts | None:
        """The parts to draw; None while there are none or none are shown."""
        drawing = self.drawing
        return None if drawing is None else drawing.parts

    @property
    def floor(self) -> float | None:
        """Height of the lowest point of the base in design units; None without parts."""
        parts = self.parts
        return None if parts is None else parts.floor


def _request(frame: Frame) -> PartsRequest | None:
    if frame.state.view.drawn_as != "prototype":
        return None
    return PartsRequest(msgspec.structs.replace(frame.state.design, name=""))
