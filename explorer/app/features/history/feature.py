"""The steps of the session, to return to any of them."""

from __future__ import annotations

from explorer.app.features.feature import Feature, Tab
from explorer.app.features.history.panel import HistoryPanel

HISTORY = Feature("history", tabs=(Tab("drawer", "History", HistoryPanel),))
