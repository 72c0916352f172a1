"""Keeps the figures and workspaces of the compared designs in step with the state.

Each column has a feed of its own, so that a slider asks for the live design alone. Nothing is
asked for while there is nothing to compare.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from explorer.app.features.compare.drawing import ComparedDrawing, ComparedRequest, compared_drawing
from explorer.app.session.feed import Feed
from explorer.app.session.jobs import Worker
from explorer.app.state.compared import SLOTS, unnamed
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.mechanism.design import Design
from explorer.numerics.arrays import FloatArray

LIVE = 0
"""The column of the live design; those of the pinned ones follow."""

COLUMNS = 1 + len(SLOTS)


class CompareFeed:
    """A feed for each column: the live design, then the pinned ones.

    Args:
        worker: That finds the figures.
        redraw: Called when there are new ones.
    """

    def __init__(self, worker: Worker, redraw: Callable[[], None]) -> None:
        self._feeds = [
            Feed[ComparedRequest, ComparedDrawing](
                worker,
                compared_drawing,
                partial(_wanted, column),
                redraw,
                key=("compared", column),
            )
            for column in range(COLUMNS)
        ]

    @property
    def is_settled(self) -> bool:
        """Whether nothing newer is on its way."""
        return all(feed.is_settled for feed in self._feeds)

    def follow(self, frame: Frame) -> None:
        """Ask for what a frame wants, unless it is asked for already."""
        for feed in self._feeds:
            feed.follow(frame)

    def drawing(self, column: int) -> ComparedDrawing | None:
        """Return what there is of a column: of a pinned design never what another one was."""
        feed = self._feeds[column]
        drawing, asked = feed.drawing, feed.asked
        if drawing is None or asked is None:
            return None
        return drawing if column == LIVE or drawing.request.design == asked.design else None

    def extents(self, state: State) -> list[FloatArray]:
        """Return the extents of what is drawn, each (2, 3), in units of the live design."""
        if not state.compared.look.overlay:
            return []
        found: list[FloatArray] = []
        for column, design in enumerate((state.design, *state.compared.pinned)):
            drawing = self.drawing(column)
            if design is not None and drawing is not None and drawing.extent is not None:
                found.append(drawing.extent * true_size(design, state.design))
        return found

    def is_current(self, column: int) -> bool:
        """Whether a column shows what was last asked for."""
        return self._feeds[column].is_current

    def problem(self, column: int) -> str | None:
        """Return why there is nothing newer in a column, if its last request failed."""
        return self._feeds[column].problem


def true_size(design: Design, live: Design) -> float:
    """Return by what lengths of a design are multiplied to be in the live design's units."""
    return design.unit_mm / live.unit_mm


def _wanted(column: int, frame: Frame) -> ComparedRequest | None:
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
        # As fine in millimetres as that of the live one.
        tolerance *= state.design.unit_mm / design.unit_mm
    rotation = None
    if column == LIVE and look.at_pose:
        rotation = tuple(tuple(row) for row in frame.snapshot.rotation.tolist())
    return ComparedRequest(unnamed(design), drawn=True, rotation=rotation, tolerance=tolerance)
