"""The progress of a drawing that takes long, and buttons that stop and repeat it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import viser

from explorer.app.session.feed import Feed
from explorer.app.widgets.markup import alert
from explorer.numerics.number_text import format_decimals
from explorer.page.widgets.assigning import Update
from explorer.page.widgets.palette import WithCommands

AnyFeed = Feed[Any, Any]


class UnderWay:
    """The buttons that cancel and repeat a feed's computation, each visible while it has an effect.

    The drawing has a name, such as "workspace".
    """

    def __init__(self, page: WithCommands, what: str, feed: AnyFeed) -> None:
        gui, self._feed = page.gui, feed
        self._cancel = gui.add_button(
            f"Stop computing the {what}",
            icon=viser.Icon.PLAYER_STOP,
            hint=f"End the present computation of the {what}.",
            visible=False,
        )
        self._retry = gui.add_button(
            f"Compute the {what}",
            icon=viser.Icon.REFRESH,
            hint=f"Compute the {what} again after it was stopped.",
            visible=False,
        )
        for button, act in ((self._cancel, feed.cancel), (self._retry, feed.retry)):
            button.on_click(lambda _, act=act: act())
            page.commands.offer(button, lambda _, act=act: act())

    def updates(self) -> Iterator[Update]:
        """Yield the updates that show the buttons that have an effect."""
        yield self._cancel, "visible", self._feed.stage is not None
        yield self._retry, "visible", self._feed.is_cancelled


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
