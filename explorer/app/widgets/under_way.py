"""The progress of a drawing that takes long, and why there is none, in words."""

from __future__ import annotations

from typing import Any

from explorer.app.session.feed import Feed
from explorer.app.widgets.markup import alert
from explorer.numerics.number_text import format_decimals

AnyFeed = Feed[Any, Any]


def progress(feed: AnyFeed) -> str:
    """Return the progress of a drawing that is being computed, in words."""
    stage = feed.stage
    if stage is None:
        return "computing …"
    return f"computing the {stage.words}, {format_decimals(100.0 * stage.share, 0)} % done …"


def problem(feed: AnyFeed, title: str, button: str) -> str:
    """Return why there is no newer drawing of a feed, as HTML.

    The title is that of a failure; the label is of the button that repeats what was cancelled.
    """
    if feed.is_cancelled:
        return alert("Stopped", f"Press “{button}”, or change something, to compute it.")
    return alert(title, feed.problem or "")


def look_of(feed: AnyFeed) -> str:
    """Return the class of what belongs to the drawing of a feed: pale while a newer one is made."""
    return "" if feed.drawing is None or feed.is_current else "is-outdated"
