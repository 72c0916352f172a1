"""A drawing that takes long: how far it is, and the buttons to cancel it and to ask again."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import viser

from explorer.app.session.feed import Feed
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.markup import alert

AnyFeed = Feed[Any, Any]


class UnderWay:
    """Two buttons that are shown when they are of use.

    Args:
        gui: On which they are added, here and now.
        what: What is drawn, such as "workspace".
    """

    def __init__(self, gui: viser.GuiApi, what: str) -> None:
        self._feed: AnyFeed | None = None
        self._cancel = gui.add_button(
            f"Stop computing the {what}",
            icon=viser.Icon.PLAYER_STOP,
            hint=f"End the computation of the {what} that is under way.",
            visible=False,
        )
        self._again = gui.add_button(
            f"Compute the {what}",
            icon=viser.Icon.REFRESH,
            hint=f"Compute the {what} whose computation was cancelled.",
            visible=False,
        )
        self._cancel.on_click(lambda _: self._feed and self._feed.cancel())
        self._again.on_click(lambda _: self._feed and self._feed.ask_again())

    def updates(self, feed: AnyFeed) -> Iterator[Update]:
        """Yield what makes the buttons follow a feed."""
        self._feed = feed
        yield self._cancel, "visible", feed.stage is not None
        yield self._again, "visible", feed.is_cancelled


def progress(feed: AnyFeed) -> str:
    """Return in words that a drawing is being computed, and how far it is if that is known."""
    stage = feed.stage
    if stage is None:
        return "computing …"
    return f"computing the {stage.words}, {100.0 * stage.share:.0f} % done …"


def problem(feed: AnyFeed, title: str, again: str) -> str:
    """Return why there is no newer drawing, as HTML.

    Args:
        feed: Whose last request failed or was cancelled.
        title: Of a failure.
        again: The button that computes what was cancelled.
    """
    if feed.is_cancelled:
        return alert("Stopped", f"Press “{again}”, or change something, to compute it.")
    return alert(title, feed.problem or "")
