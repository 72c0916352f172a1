"""Keeps the parts of the prototype in step with the design, while they are shown."""

from __future__ import annotations

from collections.abc import Callable

import msgspec

from explorer.app.features.prototype.parts import Parts, PartsDrawing, PartsRequest, parts_drawing
from explorer.app.session.feed import Feed
from explorer.app.session.jobs import Worker
from explorer.app.state.frame import Frame


class PartsFeed(Feed[PartsRequest, PartsDrawing]):
    """Parts of the design, made anew when it changes and not when it moves."""

    def __init__(self, worker: Worker, redraw: Callable[[], None]) -> None:
        super().__init__(worker, parts_drawing, _wanted, redraw)

    @property
    def parts(self) -> Parts | None:
        """What is to be drawn: None while there are none, or none are wanted."""
        drawing = self.drawing
        return None if drawing is None else drawing.parts


def _wanted(frame: Frame) -> PartsRequest | None:
    view, design = frame.state.view, frame.state.design
    # Of the twin there is no prototype.
    if not view.prototype.shown or view.twin:
        return None
    return PartsRequest(msgspec.structs.replace(design, name=""))
