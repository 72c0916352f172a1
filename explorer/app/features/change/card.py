"""The differences that the last change of the design made, over the scene."""

from __future__ import annotations

from html import escape

from explorer.app.features.change.before import OVER, DesignChange
from explorer.app.features.feature import Services
from explorer.app.state.frame import Frame
from explorer.app.widgets.markup import dim, row, table
from explorer.numerics.number_text import drop_rounding, format_number

DIGITS = 4


class ChangeCard:
    """Volume, reach and clearance: the values before and now, and their differences."""

    def __init__(self, services: Services) -> None:
        self._change = services.get(DesignChange)

    def __call__(self, frame: Frame) -> str:
        """Return the card as HTML; nothing without a change."""
        before = self._change.before
        if before is None:
            return ""
        old, new = before.frame, frame
        lines = [
            difference("Volume", *self._change.volumes, "units³"),
            difference("Reach", _reach(old), _reach(new), "mm"),
            difference("Clearance here", _clearance(old), _clearance(new), "mm"),
        ]
        body = table(lines, head=("", "before", "now", ""))
        return (
            f'<div class="ex-change-card" role="status" data-until-press="{OVER}">'
            f"<b>{escape(before.words)}</b>{body}</div>"
        )


def difference(name: str, before: float | None, now: float | None, unit: str) -> str:
    """Return a row with a value before and now, and the difference; "…" while one is computed."""
    words = ""
    if before is not None and now is not None:
        change = drop_rounding(now - before, max(abs(before), abs(now)))
        sign = "+" if change > 0.0 else ""
        words = "same" if change == 0.0 else f"<b>{sign}{format_number(change, 3)}</b>"
    return row(f"{name} {dim(unit)}", _text(before), _text(now), words)


def _text(value: float | None) -> str:
    return "…" if value is None else format_number(value, DIGITS)


def _reach(frame: Frame) -> float:
    design = frame.state.design
    return design.reach * design.unit_mm


def _clearance(frame: Frame) -> float:
    clearances = frame.snapshot.clearances
    return float(clearances.clearance[int(clearances.closest)]) * frame.state.design.unit_mm
