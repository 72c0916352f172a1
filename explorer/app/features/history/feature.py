"""The steps of the session, to return to any of them."""

from __future__ import annotations

from explorer.app.features.feature import Feature, InBar, Tab
from explorer.app.features.history.panel import HistoryPanel
from explorer.app.features.history.undo import UndoButtons

HISTORY = Feature(
    "history",
    tabs=(Tab("dialog", "History", HistoryPanel),),
    bar=(InBar("left", UndoButtons),),
)
