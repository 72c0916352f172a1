"""The layout of the panels, and what each new browser needs: its room, theme and camera."""

from __future__ import annotations

import threading
import time

import viser

from explorer.app.browser.browser_facts import BrowserFacts, ask_browser
from explorer.app.browser.viser_gaps import panel_in
from explorer.app.features.feature import DRAWER_HEIGHT
from explorer.app.scene.camera import Cameras
from explorer.app.widgets.theme import Theme

# Seconds until the panels of a new page are laid out.
SETTLE_SECONDS = 0.7
# Number of times that a new browser's camera is placed again, and the longest pause in seconds.
MOST_LOOKS, LONGEST_PAUSE_SECONDS = 12, 5.0
# Width and height of a window in pixels: in a narrower one the left panel goes below the right
# one, which leaves the scene room, if the window is high enough for both.
NARROW, HIGH_ENOUGH = 1100, 700
# Widths of the panels, and of the space beside what lies over the scene, in pixels.
RIGHT_WIDTH, LEFT_WIDTH, FREE = 350, 286, 16
# Width of the open drawer in pixels; the scene of a small laptop's screen is as wide.
DRAWER_WIDTH = 620


class Layout:
    """Lays out the panels, and suits the page to each new browser.

    Args:
        server: Server of the page.
        theme: Theme of the page.
        cameras: Cameras of the browsers.
        side: The panel on the left.
        drawer: The panel over the foot of the scene.
        docked: Whether panels lie beside the scene.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        theme: Theme,
        cameras: Cameras,
        side: viser.PanelHandle,
        drawer: viser.PanelHandle,
        *,
        docked: bool,
    ) -> None:
        self._theme = theme
        self._cameras = cameras
        self._docked: tuple[viser.PanelHandle, viser.PanelHandle] | None = None
        drawer.float(x=FREE // 2, y=-FREE // 2, width=DRAWER_WIDTH, height=DRAWER_HEIGHT)
        drawer.minimize()
        if docked:
            main = server.gui.main_panel
            main.dock_right()
            main.set_width(RIGHT_WIDTH)
            side.dock_left()
            side.set_width(LEFT_WIDTH)
            self._docked = (side, drawer)
        server.on_client_connect(self._connected)

    def _connected(self, client: viser.ClientHandle) -> None:
        ask_browser(client, lambda facts: self._answered(client, facts))

    def _answered(self, client: viser.ClientHandle, facts: BrowserFacts) -> None:
        # A thread of its own waits until the page is laid out.
        threading.Thread(
            target=self._suit, args=(client, facts), name="layout", daemon=True
        ).start()

    def _suit(self, client: viser.ClientHandle, facts: BrowserFacts) -> None:
        if self._docked is not None:
            _make_room(client, facts, *self._docked)
        self._theme.follow_browser(dark=facts.dark)
        # Some browsers report the size of the scene before its panels are laid out, and not again
        # before the camera moves; slow ones miss where it is put. Each try makes them report.
        pause = SETTLE_SECONDS
        for look in range(MOST_LOOKS):
            time.sleep(pause)
            # The camera of a browser that has disconnected counts as placed too.
            if look > 0 and self._cameras.stands(client):
                return
            self._cameras.look_again(client)
            pause = min((1.0 + look) * SETTLE_SECONDS, LONGEST_PAUSE_SECONDS)


def is_narrow(facts: BrowserFacts) -> bool:
    """Whether panels on both sides would leave the scene too little room."""
    return facts.width < NARROW and facts.height >= HIGH_ENOUGH


def _make_room(
    client: viser.ClientHandle,
    facts: BrowserFacts,
    side: viser.PanelHandle,
    drawer: viser.PanelHandle,
) -> None:
    if not is_narrow(facts):
        return
    panel_in(client, side).dock_below(client.gui.main_panel)
    room = facts.width - RIGHT_WIDTH - FREE
    panel_in(client, drawer).set_width(min(DRAWER_WIDTH, room))
