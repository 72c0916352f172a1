"""The last change of the design: a ghost of what was before, and the differences."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape

import numpy as np
import viser

from explorer.app.features.feature import Services
from explorer.app.features.workspace.feeds import VOLUME_FEED, volume_request
from explorer.app.features.workspace.regions import Selection
from explorer.app.features.workspace.tasks import (
    MeasuredVolume,
    measure_volume,
)
from explorer.app.scene.placing import Placed, ScenePart, outline
from explorer.app.scene.shapes import add_lines
from explorer.app.session.feed import Feed
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import GHOST
from explorer.app.widgets.markup import dim, row, table
from explorer.numerics.number_text import drop_rounding, format_number

OVER = "change.over"
DIGITS = 4


class DesignChange:
    """Follows the design from the last step of the history to the present one.

    A change counts until another step, undo or redo, or a press outside of the scene.

    Attributes:
        before: The design and its pose before the change, with all that is computed of them; None
            if the last step did not change the design.
    """

    def __init__(self, services: Services) -> None:
        self.before: Frame | None = None
        self._session = services.session
        self._now = services.get(VOLUME_FEED)
        # Another page of the same state may not have measured the design before the change.
        self._then = Feed[Selection, MeasuredVolume](
            services.worker,
            measure_volume,
            lambda _: None if self.before is None else volume_request(self.before),
            services.session.redraw,
            key="volume before",
        )
        self._ended: State | None = None
        services.buttons.on(OVER, self._end, values=("",))

    @property
    def words(self) -> str:
        """The last step in words."""
        return self._session.history.step.words

    @property
    def volumes(self) -> tuple[float | None, float | None]:
        """Volumes before and now, in cubed design units; None for one that is being computed."""
        return _volume(self._then), _volume(self._now)

    def follow(self, frame: Frame) -> None:
        """Find what was before the change that led to a frame, and request its volume."""
        history, now = self._session.history, frame.state
        state = history.steps[history.at - 1].state if history.is_open and history.at else None
        # Another design that is opened is no change of this one.
        if (
            state is None
            or state is self._ended
            or state.base != now.base
            or state.design == now.design
        ):
            self.before = None
        elif self.before is None or self.before.state is not state:
            # What a frame has computed is kept from one value of a slider to the next.
            self.before = Frame(state)
        self._then.follow(frame)

    def _end(self, _: str, client: viser.ClientHandle) -> None:
        del client
        if self.before is not None:
            self._ended = self.before.state
            self._session.redraw()


def _volume(feed: Feed[Selection, MeasuredVolume]) -> float | None:
    drawing = feed.drawing
    return None if drawing is None or not feed.is_current else drawing.measured.volume


class ChangeCard:
    """Volume, reach and clearance: the values before and now, and their differences."""

    def __init__(self, services: Services) -> None:
        self._change = services.get(DesignChange)

    def __call__(self, frame: Frame) -> str:
        """Return the card as HTML; nothing without a change."""
        old = self._change.before
        if old is None:
            return ""
        lines = [
            _difference("Volume", *self._change.volumes, "units³"),
            _difference("Reach", _reach(old), _reach(frame), "mm"),
            _difference("Clearance here", _clearance(old), _clearance(frame), "mm"),
        ]
        body = table(lines, head=("", "before", "now", ""))
        return (
            f'<div class="ex-change-card" role="status" data-until-press="{OVER}">'
            f"<b>{escape(self._change.words)}</b>{body}</div>"
        )


def _difference(name: str, before: float | None, now: float | None, unit: str) -> str:
    """Return a row with a value before and now, and the difference; "…" while one is computed."""
    words = ""
    if before is not None and now is not None:
        change = drop_rounding(now - before, max(abs(before), abs(now)))
        sign = "+" if change > 0.0 else ""
        words = "same" if change == 0.0 else f"<b>{sign}{format_number(change, 3)}</b>"
    texts = ("…" if value is None else format_number(value, DIGITS) for value in (before, now))
    return row(f"{name} {dim(unit)}", *texts, words)


def _reach(frame: Frame) -> float:
    design = frame.state.design
    return design.reach * design.unit_mm


def _clearance(frame: Frame) -> float:
    clearances = frame.snapshot.clearances
    return float(clearances.clearance[int(clearances.closest)]) * frame.state.design.unit_mm


class ChangeScene(ScenePart):
    """The outline of base, legs and platform before the change."""

    def __init__(self, services: Services) -> None:
        self._change = services.get(DesignChange)
        self._lines = add_lines(services.scene, "/change/before", 1, GHOST, 2.0)

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw the ghost of this frame."""
        before = self._change.before
        yield self._lines, "visible", before is not None
        if before is not None:
            ratio = before.state.design.unit_mm / placed.frame.state.design.unit_mm
            lines = placed.scale * ratio * outline(before.snapshot)
            yield self._lines, "points", lines.astype(np.float32)
