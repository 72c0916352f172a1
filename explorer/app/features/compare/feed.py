"""The drawings of the compared designs, requested from the worker.

Each column has a feed of its own, so that a slider requests the live design alone. Nothing is
requested while there is nothing to compare.
"""

from __future__ import annotations

from functools import partial

from explorer.app.features.compare.drawing import ComparedDrawing, ComparedRequest, compared_drawing
from explorer.app.features.feature import Services
from explorer.app.features.workspace.regions import rows_of
from explorer.app.session.feed import Feed
from explorer.app.state.compared import SLOTS, unnamed
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.mechanism.design import Design
from explorer.numerics.arrays import FloatArray

LIVE = 0
"""The column of the live design; those of the pinned ones follow."""

COLUMNS = 1 + len(SLOTS)


class CompareFeed:
    """A feed for each column: the live design, then the pinned ones."""

    def __init__(self, services: Services) -> None:
        self._feeds = [
            Feed[ComparedRequest, ComparedDrawing](
                services.worker,
                compared_drawing,
                partial(_request_for, column),
                services.session.redraw,
                key=("compared", column),
            )
            for column in range(COLUMNS)
        ]

    @property
    def is_settled(self) -> bool:
        """Whether no newer drawing is being computed."""
        return all(feed.is_settled for feed in self._feeds)

    def follow(self, frame: Frame) -> None:
        """Request what a frame needs, unless it is requested already."""
        for feed in self._feeds:
            feed.follow(frame)

    def drawing(self, column: int) -> ComparedDrawing | None:
        """Return the drawing of a column; of a pinned one only if the design is the same."""
        feed = self._feeds[column]
        drawing, request = feed.drawing, feed.request
        if drawing is None or request is None:
            return None
        return drawing if column == LIVE or drawing.request.design == request.design else None

    def extents(self, state: State) -> list[FloatArray]:
        """Return the extents of the drawn workspaces, each (2, 3), in units of the live design."""
        if not state.compared.look.overlay:
            return []
        extents: list[FloatArray] = []
        for column, design in enumerate((state.design, *state.compared.pinned)):
            drawing = self.drawing(column)
            if design is not None and drawing is not None and drawing.extent is not None:
                extent = drawing.extent + drawing.offset(state.view.at)
                extents.append(extent * unit_ratio(design, state.design))
        return extents

    def is_current(self, column: int) -> bool:
        """Whether a column shows its newest request."""
        return self._feeds[column].is_current

    def problem(self, column: int) -> str | None:
        """Return why there is no newer drawing in a column, if its last request failed."""
        return self._feeds[column].problem


def unit_ratio(design: Design, live: Design) -> float:
    """Return one unit of a design in units of the live design."""
    return design.unit_mm / live.unit_mm


def _request_for(column: int, frame: Frame) -> ComparedRequest | None:
    state = frame.state
    compared = state.compared
    if compared.is_empty:
        return None
    design = state.design if column == LIVE else compared.pinned[column - 1]
    if design is None:
        return None
    look = compared.look
    if not look.overlay:
        return ComparedRequest(unnamed(design))
    tolerance = state.view.workspace.tolerance
    if tolerance is not None:
        # The tolerance in millimetres is that of the live design.
        tolerance *= state.design.unit_mm / design.unit_mm
    rotation = None
    if column == LIVE and look.at_pose:
        rotation = rows_of(frame.snapshot.rotation)
    return ComparedRequest(unnamed(design), drawn=True, rotation=rotation, tolerance=tolerance)
