"""Pictures, scenes, tables and reports to take away."""

from __future__ import annotations

from explorer.app.features.feature import Feature, Tab
from explorer.app.features.sharing.files import SessionRecorder
from explorer.app.features.sharing.panel import SharePanel

SHARING = Feature("sharing", tabs=(Tab("drawer", "Share", SharePanel),), runners=(SessionRecorder,))
